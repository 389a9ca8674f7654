"""One training picture: background, instruments on it, and what light, smoke and camera make of them."""

import cv2
import numpy as np

from canvas import COLUMNS, HEIGHT, ROWS, WIDTH, blur, colour, mix, noise, patch, soft_step
from instruments import draw_instrument
from organs import organs, pinned_pad
from robotic import draw_robotic
from tissue import background, thread


def shadow(rng, picture, cover, width):
    shift = np.float32([[1, 0, rng.normal(0, 0.5 * width + 4)], [0, 1, rng.normal(0, 0.5 * width + 4)]])
    dark = blur(cv2.warpAffine(cover, shift, (WIDTH, HEIGHT)), rng.uniform(2, 14))
    return picture * (1 - rng.uniform(0.2, 0.75) * dark[..., None])


def behind_tissue(rng, cover, tip, width):
    """Tissue that the jaws hold hides their end."""
    radius, centre = width * rng.uniform(0.2, 0.8), tip + rng.normal(0, 0.3 * width, 2)
    distance = np.hypot(COLUMNS - centre[0], ROWS - centre[1]) + radius * 0.8 * (noise(rng, max(6, radius), 2) - 0.5)
    return cover * soft_step(distance - radius, rng.uniform(0.5, 2.5))


def put_on(rng, picture, instrument, cover):
    """Blends with the edge that focus, or motion, makes."""
    if rng.random() < 0.12:
        length = int(rng.integers(3, 14))
        kernel = np.zeros((length, length), np.float32)
        cv2.line(kernel, (0, int(rng.integers(0, length))), (length - 1, int(rng.integers(0, length))), 1, 1)
        kernel /= kernel.sum()
        weighted = cv2.filter2D(instrument * cover[..., None], -1, kernel)
        cover = cv2.filter2D(cover, -1, kernel)
    else:
        weighted = instrument * cover[..., None]
        if rng.random() < 0.6:
            deviation = rng.uniform(0.4, 1.5)
            weighted, cover = cv2.GaussianBlur(weighted, (0, 0), deviation), cv2.GaussianBlur(cover, (0, 0), deviation)
    return picture * (1 - cover[..., None]) + np.clip(weighted, 0, 290)


def highlights(rng, picture, cover):
    field = noise(rng, rng.uniform(4, 40), 3, 0.6)
    field = np.clip((field - np.quantile(field[::4, ::4], rng.uniform(0.95, 0.998))) * rng.uniform(20, 120), 0, 1)
    field = field * (noise(rng, 80, 2) > rng.uniform(0.35, 0.6)) * rng.uniform(0.3, 1)
    if rng.random() < 0.8:
        field = field * (1 - cover)
    return mix(picture, 255.0, field)


def smoke(rng, picture):
    return mix(picture, rng.uniform(120, 230), noise(rng, rng.uniform(60, 200), 3) * rng.uniform(0.1, 0.7))


def camera(rng, picture):
    """Exposure, white balance, fall-off of the light, gamma, saturation, focus and sharpening."""
    picture = picture * (rng.uniform(0.7, 1.35) * colour(rng, (0.92, 1, 0.94), (1.08, 1.0001, 1.07)))
    if rng.random() < 0.4:
        x, y = rng.uniform(0.2, 0.8) * WIDTH, rng.uniform(0.2, 0.8) * HEIGHT
        away = np.clip(np.hypot(COLUMNS - x, ROWS - y) / rng.uniform(130, 230), 0, 1) ** rng.uniform(1, 2.5)
        picture = picture * (1 - rng.uniform(0.2, 0.85) * away[..., None])
    picture = np.clip(picture, 0, 255)
    gamma = rng.uniform(0.65, 1.4)
    if rng.random() < 0.6:  # as an automatic exposure would
        mean = np.clip(picture.mean() / 255 + 0.02, 0.03, 0.9)
        gamma = float(np.clip(np.log(rng.uniform(0.26, 0.6)) / np.log(mean), 0.45, 1.6))
    picture = 255 * (picture / 255) ** gamma
    level = picture.mean(2, keepdims=True)
    picture = level + (picture - level) * rng.uniform(0.7, 1.45)
    if rng.random() < 0.3:
        picture = cv2.GaussianBlur(picture, (0, 0), rng.uniform(0.4, 1.8))
    if rng.random() < 0.4:
        picture = picture + rng.uniform(0.3, 1.5) * (picture - cv2.GaussianBlur(picture, (0, 0), rng.uniform(0.7, 2)))
    return picture


def surround(rng, picture, mask):
    """The black around a round scope, or around a rectified or letter-boxed picture."""
    kind = rng.random()
    if kind < 0.2:
        radius = rng.uniform(0.55, 1.2) * WIDTH / 2
        x, y = WIDTH / 2 + rng.normal(0, 12), HEIGHT / 2 + rng.normal(0, 12)
        inside = soft_step(radius - np.hypot(COLUMNS - x, ROWS - y), 1 / rng.uniform(0.5, 2))
        return picture * inside[..., None], mask * (inside > 0.5)
    if kind < 0.3:
        inside = np.zeros((HEIGHT, WIDTH), np.float32)
        left, top = int(rng.integers(0, 30)), int(rng.integers(0, 24))
        inside[top : HEIGHT - top, left : WIDTH - left] = 1
        return mix(rng.uniform(0, 12), picture, inside), mask * inside
    return picture, mask


def burnt_in_text(rng, picture):
    text = "".join(rng.choice(list("LeftRigh01234:/.mN"), int(rng.integers(3, 9))))
    at = (int(rng.uniform(0, WIDTH * 0.8)), int(rng.uniform(10, HEIGHT)))
    picture = np.ascontiguousarray(picture, np.float32)
    cv2.putText(picture, text, at, int(rng.integers(0, 4)), rng.uniform(0.3, 0.9), (255, 255, 255), 1, cv2.LINE_AA)
    return picture


def training_picture(seed, pictures):
    """BGR picture and mask, 8-bit, HEIGHT x WIDTH; the same for the same seed and pictures."""
    rng = np.random.default_rng(seed)
    kind = rng.random()
    picture = organs(rng) if kind < 0.55 else pinned_pad(rng) if kind < 0.77 else background(rng, pictures)
    picture = np.clip(picture, 0, 255)
    cover = np.zeros((HEIGHT, WIDTH), np.float32)
    for _ in range(rng.choice([0, 1, 2, 3], p=[0.1, 0.5, 0.32, 0.08])):
        drawn, own, tip, width = (draw_robotic if rng.random() < 0.7 else draw_instrument)(rng, picture)
        if rng.random() < 0.15:
            own = behind_tissue(rng, own, tip, width)
        if rng.random() < 0.55:
            picture = shadow(rng, picture, own, width)
        picture = put_on(rng, picture, drawn, own)
        cover = np.maximum(cover, own)
    for _ in range(rng.integers(1, 3) if rng.random() < 0.2 else 0):
        picture = thread(rng, picture)
    if rng.random() < 0.4:
        picture = highlights(rng, picture, cover)
    if rng.random() < 0.15:
        picture = smoke(rng, picture)
    picture, cover = surround(rng, camera(rng, picture), cover)
    if rng.random() < 0.1:
        picture = burnt_in_text(rng, picture)
    picture = picture + rng.standard_normal((HEIGHT, WIDTH, 1 if rng.random() < 0.5 else 3), dtype=np.float32) * rng.uniform(0.5, 6)
    picture = np.clip(picture, 0, 255).astype(np.uint8)
    if rng.random() < 0.6:
        picture = cv2.imdecode(cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(35, 95))])[1], 1)
    return picture, (np.clip(cover, 0, 1) * 255).astype(np.uint8)
