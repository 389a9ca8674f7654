"""Backgrounds as an endoscope sees them: organs in layers, lit from beside the camera, wet, with vessels and shadows."""

import cv2
import numpy as np

from canvas import COLUMNS, HEIGHT, ROWS, WIDTH, blur, colour, curve, grey, mix, noise, soft_step, stroke

# hue in degrees, saturation, value: ranges of what an endoscope shows
TISSUES = {
    "fat": ((20, 40), (0.30, 0.80), (0.55, 1.0)),
    "bowel": ((-8, 20), (0.25, 0.65), (0.55, 1.0)),
    "membrane": ((-40, 15), (0.20, 0.50), (0.40, 0.9)),
    "raw": ((-10, 12), (0.50, 0.95), (0.15, 0.6)),
    "liver": ((-15, 15), (0.40, 0.80), (0.15, 0.5)),
    "pale": ((10, 45), (0.16, 0.40), (0.65, 1.0)),
    "cavity": ((-20, 20), (0.20, 0.80), (0.02, 0.14)),
}
SHARES = {"fat": 0.2, "bowel": 0.24, "membrane": 0.14, "raw": 0.2, "liver": 0.12, "pale": 0.04, "cavity": 0.06}


def tone(rng, name):
    """BGR, 0..255."""
    hue, saturation, value = (rng.uniform(*extent) for extent in TISSUES[name])
    hsv = np.float32([[[hue % 360, saturation, value]]])
    return cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)[0, 0] * 255


def lobules(rng, size):
    """Height field of fat: round bodies side by side."""
    seeds = np.full((HEIGHT, WIDTH), 255, np.uint8)
    count = int(WIDTH * HEIGHT / (size * size)) + 2
    seeds[rng.integers(0, HEIGHT, count), rng.integers(0, WIDTH, count)] = 0
    distance = cv2.distanceTransform(seeds, cv2.DIST_L2, 5)
    return blur(np.sqrt(np.clip(1 - (distance / (size * rng.uniform(0.8, 1.2))) ** 2, 0, 1)).astype(np.float32), rng.uniform(0.8, 2))


def height_of(rng, name):
    """Height in px."""
    if name == "fat":
        size = rng.uniform(8, 40)
        return 0.35 * size * lobules(rng, size) + rng.uniform(2, 12) * noise(rng, rng.uniform(30, 100), 2)
    if name == "raw":
        return rng.uniform(8, 25) * noise(rng, rng.uniform(15, 50), 4, rng.uniform(0.45, 0.7))
    if name in ("liver", "pale"):
        return rng.uniform(5, 40) * noise(rng, rng.uniform(60, 160), 2, 0.3) + rng.uniform(0, 1.2) * noise(rng, rng.uniform(3, 8), 2)
    folds = rng.uniform(0, 8) * np.abs(np.sin(rng.uniform(3, 9) * noise(rng, rng.uniform(60, 160), 2, 0.3))) if rng.random() < 0.4 else 0
    return rng.uniform(5, 45) * noise(rng, rng.uniform(40, 140), 3, rng.uniform(0.3, 0.5)) + folds


def vessels(rng, picture):
    """Trees of fine vessels."""
    dark = colour(rng, (20, 15, 70), (80, 50, 170))
    for _ in range(rng.integers(0, 7)):
        trunk = curve(rng, rng.integers(4, 12), rng.uniform(10, 26), rng.uniform(0.15, 0.5))
        thick, strength = rng.integers(1, 4), rng.uniform(0.2, 0.8)
        lines = np.maximum(0, cv2.GaussianBlur(stroke(trunk, thick), (0, 0), rng.uniform(0.5, 1.2)))
        for start in rng.choice(len(trunk), min(len(trunk), int(rng.integers(0, 7))), replace=False):
            direction, points = rng.uniform(0, 2 * np.pi), [trunk[start]]
            for _ in range(rng.integers(2, 7)):
                direction += rng.normal(0, 0.5)
                points.append(points[-1] + rng.uniform(4, 12) * np.array([np.cos(direction), np.sin(direction)]))
            lines = np.maximum(lines, 0.7 * cv2.GaussianBlur(stroke(np.array(points), 1), (0, 0), 0.6))
        picture = mix(picture, dark, lines * strength)
    return picture


def surface(rng, name, edge=None, lamp=None):
    """A lit, wet surface of one tissue; `edge` is the distance to its outline in px, towards which it turns away."""
    height = height_of(rng, name)
    if edge is not None:
        radius, edge = rng.uniform(8, 70), blur(edge, 2.5)  # without the ridges of a distance
        height = height + radius * np.sqrt(np.clip(1 - (1 - np.clip(edge / radius, 0, 1)) ** 2, 0, 1))
    dx, dy = cv2.Sobel(height, -1, 1, 0, ksize=3) / 8, cv2.Sobel(height, -1, 0, 1, ksize=3) / 8
    facing = 1 / np.sqrt(1 + dx * dx + dy * dy)
    first = tone(rng, name)
    albedo = mix(np.ones((HEIGHT, WIDTH, 3), np.float32) * first, 0.5 * (first + tone(rng, name)), soft_step(noise(rng, rng.uniform(12, 120), 3) - rng.uniform(0.4, 0.6), rng.uniform(4, 30)))
    if rng.random() < 0.3:  # another tissue shines through, or bleeds
        albedo = mix(albedo, tone(rng, str(rng.choice(["raw", "fat", "membrane"]))), soft_step(noise(rng, rng.uniform(15, 80), 3) - rng.uniform(0.5, 0.7), rng.uniform(6, 40)))
    if name != "cavity":
        albedo = vessels(rng, albedo)
    albedo = albedo * (1 + rng.uniform(0, 0.4) * (noise(rng, rng.uniform(2, 8), 2) - 0.5))[..., None]
    lx, ly = lamp
    lit = np.clip((1 - lx * dx - ly * dy) * facing, 0.02, 1.3) ** rng.uniform(0.8, 1.8)
    picture = albedo * (rng.uniform(0.05, 0.25) + 0.85 * lit)[..., None]
    # gloss: the mirror direction of the lamp, disturbed by the fine relief of the wet film
    fine = height + rng.uniform(0.2, 2.5) * noise(rng, rng.uniform(3, 10), 2)
    fx, fy = cv2.Sobel(fine, -1, 1, 0, ksize=3) / 8, cv2.Sobel(fine, -1, 0, 1, ksize=3) / 8
    tilt = np.hypot(fx - lx / 2 - rng.uniform(-0.3, 0.3), fy - ly / 2 - rng.uniform(-0.3, 0.3))
    width = rng.uniform(0.04, 0.25)
    gloss = np.exp(-((tilt / width) ** 2)) * rng.uniform(0, 1.3) * (noise(rng, rng.uniform(15, 80), 2) > rng.uniform(0.35, 0.65))
    return picture + 255 * np.clip(gloss, 0, 1)[..., None] * rng.uniform(0.9, 1, 3).astype(np.float32)


def outline(rng):
    """Mask, 0..1, of an organ: a patch with a smooth border, or a loop across the picture."""
    if rng.random() < 0.35:
        path = stroke(curve(rng, rng.integers(5, 12), rng.uniform(20, 45), rng.uniform(0.1, 0.35)), 1)
        distance = cv2.distanceTransform((path < 0.5).astype(np.uint8), cv2.DIST_L2, 5)
        return (distance + 8 * (noise(rng, 50, 2) - 0.5) < rng.uniform(10, 60)).astype(np.uint8)
    field = noise(rng, rng.uniform(60, 200), 2, 0.35)
    return (field > np.quantile(field[::4, ::4], rng.uniform(0.35, 0.85))).astype(np.uint8)


def organs(rng):
    """BGR, 0..255: layers of tissue, each with the shadow it throws on what lies deeper."""
    names, shares = list(SHARES), np.array(list(SHARES.values()))
    lamp = rng.normal(0, 0.5, 2)
    picture = surface(rng, rng.choice(names, p=shares), None, lamp) * rng.uniform(0.4, 1)
    for _ in range(rng.integers(1, 6)):
        mask = outline(rng)
        soft = cv2.GaussianBlur(mask.astype(np.float32), (0, 0), rng.uniform(0.7, 1.6))
        shade = blur(mask.astype(np.float32), rng.uniform(3, 15))
        picture = picture * (1 - rng.uniform(0.2, 0.8) * shade)[..., None]
        layer = surface(rng, rng.choice(names, p=shares), cv2.distanceTransform(mask, cv2.DIST_L2, 5), lamp) * rng.uniform(0.7, 1.1)
        picture = mix(picture, layer, soft)
    return picture.astype(np.float32)


def pinned_pad(rng):
    """A phantom: pale, pink or yellow stuff on a board or on meat, stuck with pins or dotted with balls."""
    picture = surface(rng, rng.choice(["pale", "raw", "bowel", "fat"]), None, rng.normal(0, 0.4, 2))
    mask = outline(rng)
    pad = surface(rng, rng.choice(["pale", "pale", "bowel", "fat"]), cv2.distanceTransform(mask, cv2.DIST_L2, 5), rng.normal(0, 0.4, 2))
    picture = mix(picture, pad, cv2.GaussianBlur(mask.astype(np.float32), (0, 0), 1))
    paint = colour(rng, (10,) * 3, (150,) * 3) if rng.random() < 0.6 else grey(rng, 15, 200)
    around = rng.uniform(2.5, 10)
    for _ in range(rng.integers(5, 60)):
        x, y, radius = rng.uniform(0, WIDTH), rng.uniform(0, HEIGHT), around * rng.uniform(0.85, 1.15)
        left, top = max(0, int(x - radius - 2)), max(0, int(y - radius - 2))
        box = np.s_[top : int(y + radius + 3), left : int(x + radius + 3)]
        distance = np.hypot(COLUMNS[box] - x, ROWS[box] - y) / radius
        body = paint * (0.25 + 0.9 * np.sqrt(np.clip(1 - distance**2, 0, 1)))[..., None]
        glint = np.hypot(COLUMNS[box] - x + 0.2 * radius, ROWS[box] - y + 0.2 * radius) < rng.uniform(0.15, 0.35) * radius
        picture[box] = mix(picture[box], body + 200 * glint[..., None], soft_step(1 - distance, radius))
        if rng.random() < 0.1:
            end = (int(x + rng.normal(0, 2 * radius)), int(y + rng.normal(0, 2 * radius)))
            picture = np.ascontiguousarray(picture, np.float32)
            cv2.line(picture, (int(x), int(y)), end, (paint * 0.6).tolist(), 1, cv2.LINE_AA)
    return picture.astype(np.float32)
