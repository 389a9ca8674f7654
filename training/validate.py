"""Judges weights on real pictures that are outlined in ../bench/accuracy/instrument_outlines.json: IoU, precision and
recall by set, and what it marks in pictures without any instrument.

    python3 validate.py NETWORK.onnx PICTURES [VIEW.png]

PICTURES holds the repositories davinci, endogaussian and laparoscopic (docs/instruments.md says which) and reference,
the reference data.
"""

import json
import os
import sys

import cv2
import numpy as np

OUTLINES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../bench/accuracy/instrument_outlines.json")
FOLDERS = {"davinci": "davinci", "endonerf": "endogaussian", "super": "endogaussian", "laparoscopic": "laparoscopic"}
WITHOUT = ["scared_keyframe/left.png", "hamlyn_heart/f7_dynamic_deint_L_0100.png"]
PIXELS = 320 * 192  # of the network's input, about


def picture_of(entry, folder):
    name = os.path.join(folder, FOLDERS[entry["set"]], entry["picture"])
    if "frame" not in entry:
        return cv2.imread(name)
    video, picture = cv2.VideoCapture(name), None
    for _ in range(entry["frame"] + 1):
        read, frame = video.read()
        if read:
            picture = frame
    return picture


def drawn(polygons, scale, size):
    mask = np.zeros(size, np.uint8)
    for polygon in polygons:
        cv2.fillPoly(mask, [np.round(np.array(polygon) * scale).astype(np.int32)], 255)
    return mask > 0


def truth_of(entry, picture):
    width = entry.get("crop", [0, 0, picture.shape[1]])[2]
    scale = width / entry["width"]
    truth = drawn(entry["polygons"], scale, picture.shape[:2]) & ~drawn(entry.get("holes", []), scale, picture.shape[:2])
    return truth, ~drawn(entry.get("ignore", []), scale, picture.shape[:2])


def cropped(entry, *arrays):
    if "crop" not in entry:
        return arrays
    x, y, width, height = entry["crop"]
    return [a[y : y + height, x : x + width] for a in arrays]


def found_in(network, picture):
    rows, columns = picture.shape[:2]
    scale = (PIXELS / (rows * columns)) ** 0.5
    size = tuple(int(max(1, round(scale * n / 32)) * 32) for n in (columns, rows))
    network.setInput(cv2.dnn.blobFromImage(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), 1 / 255, swapRB=True))
    return cv2.resize(network.forward()[0, 0], (columns, rows)) > 0


def main(onnx, folder, view=None):
    network, by_set, views = cv2.dnn.readNetFromONNX(onnx), {}, []

    def show(picture, mask, truth=None):
        outlined = picture.copy()
        for which, tone in ((mask, (0, 255, 0)), (truth, (255, 255, 0))):
            if which is not None:
                lines, _ = cv2.findContours(which.astype(np.uint8), cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
                cv2.drawContours(outlined, lines, -1, tone, max(1, picture.shape[1] // 300))
        views.append(cv2.resize(outlined, (400, 300)))

    for entry in json.load(open(OUTLINES))["pictures"]:
        picture = picture_of(entry, folder)
        picture, truth, judged = cropped(entry, picture, *truth_of(entry, picture))
        mask = found_in(network, picture)
        both, found, true = (mask & truth & judged).sum(), (mask & judged).sum(), (truth & judged).sum()
        by_set.setdefault(entry["set"], []).append((both / max(1, (mask & judged | truth & judged).sum()), both / max(1, found), both / true))
        show(picture, mask, truth)
    for name, figures in by_set.items():
        print(f"{name:13s} IoU {np.mean(figures, 0)[0]:.3f}, precision {np.mean(figures, 0)[1]:.3f}, recall {np.mean(figures, 0)[2]:.3f}   "
              + " ".join(f"{f[0]:.2f}" for f in figures))
    print(f"all {np.mean([np.mean(f, 0)[0] for f in by_set.values()]):.3f}")
    for name in WITHOUT:
        picture = cv2.imread(os.path.join(folder, "reference", name))
        mask = found_in(network, picture)
        print(f"{name}: {100 * mask.mean():.2f} % marked")
        show(picture, mask)
    if view:
        views += [np.zeros_like(views[0])] * (-len(views) % 6)
        cv2.imwrite(view, np.vstack([np.hstack(views[i : i + 6]) for i in range(0, len(views), 6)]))


if __name__ == "__main__":
    main(*sys.argv[1:])
