"""Small drawing tools that everything in this folder shares. Pictures are float32, BGR, 0..255, HEIGHT x WIDTH."""

import cv2
import numpy as np

WIDTH, HEIGHT = 352, 256
ROWS, COLUMNS = np.mgrid[0:HEIGHT, 0:WIDTH].astype(np.float32)

cv2.setNumThreads(1)


def blur(picture, deviation):
    """Gaussian; wide ones at a quarter of the size, which nobody can tell."""
    if deviation < 6 or picture.shape[:2] != (HEIGHT, WIDTH):
        return cv2.GaussianBlur(picture, (0, 0), deviation)
    small = cv2.resize(picture, (WIDTH // 4, HEIGHT // 4), interpolation=cv2.INTER_AREA)
    return cv2.resize(cv2.GaussianBlur(small, (0, 0), deviation / 4), (WIDTH, HEIGHT))


def noise(rng, cell, octaves=3, gain=0.55, height=HEIGHT, width=WIDTH):
    """Smooth random field, 0..1, whose coarsest features are `cell` pixels wide."""
    total, weight, amplitude = np.zeros((height, width), np.float32), 0.0, 1.0
    for _ in range(octaves):
        grid = rng.random((int(height / cell) + 3, int(width / cell) + 3), dtype=np.float32)
        total += amplitude * cv2.resize(grid, (width, height), interpolation=cv2.INTER_CUBIC)
        weight += amplitude
        amplitude *= gain
        cell = max(1.5, cell / 2.1)
    return total / weight


def soft_step(field, sharpness):
    return 1 / (1 + np.exp(-np.clip(field * sharpness, -30, 30)))


def patch(rng, cell=None, extent=None):
    """Mask, 0..1, of irregular patches with soft or sharp edges."""
    threshold = rng.uniform(0.42, 0.62) if extent is None else 1 - extent
    return soft_step(noise(rng, cell or rng.uniform(50, 160), 3, 0.4) - threshold, rng.uniform(4, 80))


def curve(rng, steps, step, turn):
    """Points of a wandering line, somewhere in the picture."""
    at = np.array([rng.uniform(-20, WIDTH + 20), rng.uniform(-20, HEIGHT + 20)])
    direction, points = rng.uniform(0, 2 * np.pi), [at]
    for _ in range(steps):
        direction += rng.normal(0, turn)
        at = at + step * np.array([np.cos(direction), np.sin(direction)])
        points.append(at)
    points = np.array(points)
    fine = np.linspace(0, steps, 5 * steps)
    return np.stack([np.interp(fine, np.arange(steps + 1), points[:, k]) for k in (0, 1)], 1)


def stroke(points, thickness):
    """Mask, 0..1, of a line through points."""
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    cv2.polylines(mask, [np.round(points * 8).astype(np.int32)], False, 255, max(1, int(thickness)), cv2.LINE_AA, 3)
    return mask.astype(np.float32) / 255


def filled(points, hole=None):
    """Mask, 0..1, of a polygon, with a hole."""
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    cv2.fillPoly(mask, [np.round(points * 8).astype(np.int32)], 255, cv2.LINE_AA, 3)
    if hole is not None:
        cv2.fillPoly(mask, [np.round(hole * 8).astype(np.int32)], 0, cv2.LINE_AA, 3)
    return mask.astype(np.float32) / 255


def mix(below, above, mask):
    mask = mask[..., None] if mask.ndim == 2 else mask
    return below * (1 - mask) + above * mask


def colour(rng, low, high):
    """Random BGR between two."""
    return np.array([rng.uniform(a, b) for a, b in zip(low, high)], np.float32)


def grey(rng, low, high, tint=0.07):
    return (rng.uniform(low, high) * np.array([rng.uniform(1 - tint, 1 + tint), 1, rng.uniform(1 - tint, 1 + tint)])).astype(
        np.float32
    )
