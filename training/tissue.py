"""What lies behind the instruments: tissue (drawn, or cut from the pictures that SOURCES.md lists), and what a network
must learn not to take for an instrument: fat, tendon, vessels, dark cavities, gauze, drapes, drains, thread, clips."""

import glob
import os

import cv2
import numpy as np

from canvas import COLUMNS, HEIGHT, ROWS, WIDTH, blur, colour, curve, grey, mix, noise, patch, soft_step, stroke

# BGR of tissue: muscle, serosa, fat, liver, spleen, mucosa, charred, veiled
TISSUE = np.array(
    [(60, 60, 150), (70, 75, 170), (40, 40, 110), (110, 115, 200), (130, 140, 215), (60, 90, 160), (80, 150, 205),
     (130, 180, 225), (80, 60, 120), (110, 90, 150), (45, 35, 85), (170, 180, 225), (60, 110, 190), (30, 25, 70),
     (150, 150, 190), (95, 125, 175), (150, 120, 165), (60, 130, 190), (35, 60, 105), (185, 200, 225)], np.float32)


def load_pictures(folder):
    """The pictures of a folder: tissue without any instrument."""
    return [cv2.imread(name) for name in sorted(glob.glob(os.path.join(folder, "*.png")))]


def tint(rng):
    return TISSUE[rng.integers(len(TISSUE))] * rng.uniform(0.6, 1.25) * colour(rng, (0.93,) * 3, (1.07,) * 3)


def relief(rng, height_field, strength):
    """Shading of a height field by a lamp near the camera, and how much each place faces it."""
    dx, dy = cv2.Sobel(height_field, -1, 1, 0, ksize=3), cv2.Sobel(height_field, -1, 0, 1, ksize=3)
    facing = 1 / np.sqrt(1 + (strength * dx) ** 2 + (strength * dy) ** 2)
    angle = rng.uniform(0, 2 * np.pi)
    lit = 0.25 + 0.65 * facing + 0.4 * strength * (dx * np.cos(angle) + dy * np.sin(angle)) * facing
    return np.clip(lit, 0.12, 1.5), facing


def vessels(rng, picture, most):
    for _ in range(rng.integers(0, most)):
        line = stroke(curve(rng, rng.integers(4, 14), rng.uniform(7, 22), rng.uniform(0.15, 0.6)), rng.integers(1, 4))
        line = cv2.GaussianBlur(line, (0, 0), rng.uniform(0.5, 1.4)) * rng.uniform(0.3, 0.9)
        picture = mix(picture, colour(rng, (10, 10, 50), (100, 70, 170)), line)
    return picture


def wet(rng, picture, facing):
    """Highlights where a wet surface faces the lamp."""
    where = np.clip((facing - rng.uniform(0.8, 0.97)) * 4, 0, 1) ** 3 * (noise(rng, rng.uniform(3, 9), 2) > rng.uniform(0.45, 0.68))
    return picture + (rng.uniform(150, 330) * rng.uniform(0, 1) * where)[..., None]


def lobules(rng):
    """Height field of fat or bowel: round bodies side by side."""
    size = rng.uniform(9, 45)
    count = int(WIDTH * HEIGHT / (size * size)) + 2
    seeds = np.full((HEIGHT, WIDTH), 255, np.uint8)
    x, y = rng.integers(0, WIDTH, count), rng.integers(0, HEIGHT, count)
    seeds[y, x] = 0
    distance = cv2.distanceTransform(seeds, cv2.DIST_L2, 5)
    return np.sqrt(np.clip(1 - (distance / (size * rng.uniform(0.7, 1.1))) ** 2, 0, 1)).astype(np.float32)


def drawn_tissue(rng):
    first, second = noise(rng, rng.uniform(18, 120), 4, rng.uniform(0.4, 0.7)), noise(rng, rng.uniform(25, 140), 3)
    height_field = noise(rng, rng.uniform(14, 100), 4, rng.uniform(0.3, 0.65))
    form = rng.random()
    if form < 0.3:
        height_field = 0.5 * blur(lobules(rng), rng.uniform(0.8, 3)) + 0.4 * height_field
    elif form < 0.5:  # folds
        height_field = 0.6 * np.abs(np.sin(rng.uniform(4, 16) * noise(rng, rng.uniform(60, 160), 3, 0.4))) + 0.3 * height_field
    picture = mix(tint(rng) * np.ones((HEIGHT, WIDTH, 1), np.float32), tint(rng), soft_step(first - 0.5, rng.uniform(4, 40)))
    picture = mix(picture, tint(rng), soft_step(second - rng.uniform(0.4, 0.6), rng.uniform(6, 60)))
    picture = vessels(rng, picture, 14)
    lit, facing = relief(rng, height_field, rng.uniform(2, 16))
    return wet(rng, picture * lit[..., None], facing).astype(np.float32)


def loop(rng, picture):
    """A bowel loop, a tube of tissue or an organ's rim across the picture."""
    radius = rng.uniform(12, 70)
    path = stroke(curve(rng, rng.integers(5, 12), rng.uniform(20, 45), rng.uniform(0.1, 0.35)), 1)
    distance = cv2.distanceTransform((path < 0.5).astype(np.uint8), cv2.DIST_L2, 5) + 6 * (noise(rng, 50, 2) - 0.5)
    across = np.clip(1 - (distance / radius) ** 2, 0, 1)
    surface = tint(rng) * (0.8 + 0.4 * noise(rng, rng.uniform(5, 40), 3)[..., None])
    surface = vessels(rng, surface * np.ones((HEIGHT, WIDTH, 1), np.float32), 16)
    surface = surface * (0.25 + 0.85 * np.sqrt(across))[..., None]
    surface = wet(rng, surface, across)
    return mix(picture, surface, soft_step(radius - distance, rng.uniform(0.6, 2)))


def photographed_tissue(rng, pictures):
    picture = pictures[rng.integers(len(pictures))]
    rows, columns = picture.shape[:2]
    high = int(max(50, rows * rng.uniform(0.25, 1.0)))
    wide = int(min(columns, max(50, high * rng.uniform(0.9, 1.6))))
    top, left = rng.integers(0, rows - high + 1), rng.integers(0, columns - wide + 1)
    part = picture[top : top + high, left : left + wide]
    part = cv2.resize(part, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA if high > HEIGHT else cv2.INTER_LINEAR)
    if rng.random() < 0.5:
        part = part[:, ::-1]
    if rng.random() < 0.4:
        part = part[::-1]
    part = np.ascontiguousarray(part)
    if rng.random() < 0.4:
        turn = cv2.getRotationMatrix2D((WIDTH / 2, HEIGHT / 2), rng.uniform(-180, 180), rng.uniform(1, 1.5))
        part = cv2.warpAffine(part, turn, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REFLECT)
    part = part.astype(np.float32)
    if rng.random() < 0.65:  # towards another tissue
        gain = tint(rng) / np.maximum(part.mean((0, 1)), 8)
        part = part * (gain ** rng.uniform(0.3, 1.0)).astype(np.float32)
    return part


def cloth_or_board(rng):
    """Gauze, drapes, a tray, a phantom's pad, paper."""
    pale = rng.random() < 0.6
    base = grey(rng, 25, 230, 0.12) if pale else colour(rng, (10,) * 3, (225,) * 3)
    picture = np.ones((HEIGHT, WIDTH, 3), np.float32) * base * (0.6 + 0.8 * noise(rng, rng.uniform(60, 200), 2))[..., None]
    picture += (noise(rng, rng.uniform(2, 8), 2) - 0.5)[..., None] * rng.uniform(0, 50)
    if rng.random() < 0.35:
        period, wave = rng.uniform(2.5, 7), 0.5 * 20 * noise(rng, 40, 1)
        weave = np.sin(COLUMNS * 2 * np.pi / period + wave) * np.sin(ROWS * 2 * np.pi / period)
        picture *= (1 + rng.uniform(0.05, 0.2) * weave)[..., None]
    if rng.random() < 0.4:  # creases
        lit, _ = relief(rng, noise(rng, rng.uniform(20, 80), 3), rng.uniform(2, 9))
        picture *= lit[..., None]
    return picture


def straight_edge(rng):
    """Mask, 0..1, of one side of a nearly straight line."""
    angle, x, y = rng.uniform(0, 2 * np.pi), rng.uniform(0, WIDTH), rng.uniform(0, HEIGHT)
    side = (COLUMNS - x) * np.cos(angle) + (ROWS - y) * np.sin(angle) + rng.uniform(0, 14) * (noise(rng, 60, 2) - 0.5)
    return soft_step(side, rng.uniform(0.3, 2))


def dark_cavity(rng, picture):
    depth = patch(rng) * rng.uniform(0.3, 0.97)
    picture = mix(picture, colour(rng, (6, 6, 14), (45, 40, 70)) * noise(rng, rng.uniform(2, 9), 2)[..., None], depth)
    glints = noise(rng, rng.uniform(2, 7), 2) > rng.uniform(0.6, 0.8)
    return picture + (depth * rng.uniform(0, 230) * glints)[..., None] * (rng.random() < 0.7)


def band(rng, picture):
    """Tendon, fat, a strip of membrane: pale and bent, with soft sides."""
    body = (stroke(curve(rng, rng.integers(3, 9), rng.uniform(18, 45), rng.uniform(0.1, 0.35)), rng.integers(3, 28)) > 0.5).astype(np.uint8)
    thickness = cv2.distanceTransform(body, cv2.DIST_L2, 3)
    thickness /= max(1.0, thickness.max())
    mask = cv2.GaussianBlur(body.astype(np.float32), (0, 0), rng.uniform(0.8, 4)) * rng.uniform(0.5, 1)
    pale = colour(rng, (110, 140, 170), (215, 225, 245)) if rng.random() < 0.7 else grey(rng, 120, 235)
    return mix(picture, pale * (0.55 + 0.6 * thickness[..., None]) * (0.8 + 0.4 * noise(rng, 12, 3)[..., None]), mask)


def drain(rng, picture):
    """A rubber tube: bent, glossy, pale or coloured; no instrument."""
    path = curve(rng, rng.integers(8, 14), rng.uniform(18, 32), rng.uniform(0.15, 0.4))
    radius = rng.uniform(2.5, 8)
    distance = cv2.distanceTransform((stroke(path, 1) < 0.5).astype(np.uint8), cv2.DIST_L2, 5)
    across = np.clip(1 - (distance / radius) ** 2, 0, 1)
    tone = grey(rng, 130, 230, 0.12) if rng.random() < 0.6 else colour(rng, (30,) * 3, (220,) * 3)
    body = tone * (0.4 + 0.7 * np.sqrt(across))[..., None] + 200 * np.clip(across - 0.75, 0, 1)[..., None]
    return mix(picture, body, soft_step(radius - distance, 1.5) * rng.uniform(0.7, 1))


def beads(rng, picture):
    """Pins, balls, clips: small, round or short, shaded as balls are."""
    tone = colour(rng, (10,) * 3, (220,) * 3) if rng.random() < 0.7 else grey(rng, 20, 230)
    radius_around = rng.uniform(2.5, 11)
    for _ in range(rng.integers(2, 40)):
        x, y, radius = rng.uniform(0, WIDTH), rng.uniform(0, HEIGHT), radius_around * rng.uniform(0.8, 1.2)
        left, top = max(0, int(x - radius - 2)), max(0, int(y - radius - 2))
        box = np.s_[top : int(y + radius + 3), left : int(x + radius + 3)]
        distance = np.hypot(COLUMNS[box] - x, ROWS[box] - y) / radius
        facing = np.sqrt(np.clip(1 - distance**2, 0, 1))
        body = tone * (0.15 + 0.9 * facing)[..., None]
        body = body + 230 * (np.hypot(COLUMNS[box] - x + 0.25 * radius, ROWS[box] - y + 0.25 * radius) < 0.22 * radius)[..., None]
        picture[box] = mix(picture[box], body, soft_step(1 - distance, radius))
        if rng.random() < 0.15:
            end = (int(x + rng.normal(0, 1.5 * radius)), int(y + rng.normal(0, 1.5 * radius)))
            cv2.line(picture, (int(x), int(y)), end, (tone * rng.uniform(0.3, 1)).tolist(), 1, cv2.LINE_AA)
    return picture


def thread(rng, picture):
    """Suture, or a needle."""
    line = stroke(curve(rng, rng.integers(3, 12), rng.uniform(9, 27), rng.uniform(0.2, 0.6)), rng.integers(1, 3))
    return mix(picture, colour(rng, (10,) * 3, (245,) * 3), cv2.GaussianBlur(line, (0, 0), 0.7))


def background(rng, pictures):
    """A picture without any instrument."""

    def surface():
        if pictures and rng.random() < 0.5:
            return photographed_tissue(rng, pictures)
        return drawn_tissue(rng)

    picture = surface()
    if rng.random() < 0.45:
        picture = mix(picture, surface(), patch(rng))
    if rng.random() < 0.35:
        picture = loop(rng, picture)
    if rng.random() < 0.04:
        picture = mix(picture, cloth_or_board(rng), patch(rng)) if rng.random() < 0.5 else cloth_or_board(rng)
    if rng.random() < 0.05:
        picture = mix(picture, cloth_or_board(rng), straight_edge(rng))
    if rng.random() < 0.30:
        picture = dark_cavity(rng, picture)
    for _ in range(rng.integers(0, 4) if rng.random() < 0.4 else 0):
        picture = band(rng, picture)
    if rng.random() < 0.08:
        picture = drain(rng, picture)
    if rng.random() < 0.15:
        picture = beads(rng, np.ascontiguousarray(picture, np.float32))
    return picture.astype(np.float32)
