#!/usr/bin/env python3
"""Writes clicks.json into a copy of github.com/fdheenmo/thrust: the tips that its authors clicked in both images of each
pair ([x left, y left, x right, y right], px from 1), out of their matchedPoints.mat.

    thrust_clicks.py FOLDER
"""
import json
import pathlib
import struct
import sys
import zlib


def arrays(file):
    """Name -> numbers of the compressed variables of a MATLAB 5 file."""
    data, at, found = file.read_bytes(), 128, {}
    while at + 8 <= len(data):
        kind, length = struct.unpack_from("<II", data, at)
        part = data[at + 8 : at + 8 + length]
        at += 8 + length
        part = zlib.decompress(part) if kind == 15 else part
        name = part.find(b"matchedPoints")
        if name >= 0:
            size = struct.unpack_from("<I", part, name + 20)[0]
            found[part[name : name + 14].decode()] = struct.unpack_from(f"<{size // 8}d", part, name + 24)
    return found


def main():
    folder = pathlib.Path(sys.argv[1])
    points = arrays(next(folder.glob("annotated_*/matchedPoints.mat")))
    left, right = points["matchedPointsL"], points["matchedPointsR"]
    count = len(left) // 2
    clicks = [[left[i], left[count + i], right[i], right[count + i]] for i in range(count)]
    (folder / "clicks.json").write_text(json.dumps(clicks))


if __name__ == "__main__":
    main()
