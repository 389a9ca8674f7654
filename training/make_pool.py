"""Draws training pictures into a folder: pool_<n>.npy, 64 x HEIGHT x WIDTH x 4 (BGR, mask). Several may run at once.

    python3 make_pool.py BACKGROUNDS POOL FIRST COUNT
"""

import os
import sys

import numpy as np

from canvas import HEIGHT, WIDTH
from scene import training_picture
from tissue import load_pictures

IN_FILE = 64


def main(backgrounds, pool, first, count):
    os.makedirs(pool, exist_ok=True)
    pictures = load_pictures(backgrounds)
    for number in range(int(first), int(first) + int(count)):
        name = os.path.join(pool, f"pool_{number:04d}.npy")
        if os.path.exists(name):
            continue
        samples = np.zeros((IN_FILE, HEIGHT, WIDTH, 4), np.uint8)
        for i in range(IN_FILE):
            samples[i, ..., :3], samples[i, ..., 3] = training_picture(IN_FILE * number + i, pictures)
        np.save(name + ".part.npy", samples)
        os.rename(name + ".part.npy", name)


if __name__ == "__main__":
    main(*sys.argv[1:5])
