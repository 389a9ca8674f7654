"""Cuts the photographed backgrounds out of what SOURCES.md lists.

    python3 make_backgrounds.py REFERENCE_DATA FOLDER
"""

import os
import sys

import cv2


def main(reference_data, folder):
    os.makedirs(folder, exist_ok=True)
    video = cv2.VideoCapture(os.path.join(reference_data, "surgt_tissue", "video.mp4"))
    index = 0
    while True:
        read, frame = video.read()
        if not read:
            break
        if index % 9 == 0:
            rows, half = frame.shape[0], frame.shape[1] // 2
            for name, left in (("l", 0), ("r", half)):
                picture = frame[int(0.05 * rows) :, left : left + half]
                cv2.imwrite(os.path.join(folder, f"surgt_{index}{name}.png"), cv2.resize(picture, (640, 486), interpolation=cv2.INTER_AREA))
        index += 1


if __name__ == "__main__":
    main(*sys.argv[1:3])
