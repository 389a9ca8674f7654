"""Drawn instruments: a shaft that comes in from the border, a wrist, and jaws, a hook, a tube or nothing at its end."""

import cv2
import numpy as np

from canvas import HEIGHT, WIDTH, blur, colour, filled, grey, mix, noise, patch

# BGR
MATERIALS = {
    "steel": lambda r: grey(r, 95, 220),
    "grey": lambda r: grey(r, 60, 165, 0.1),
    "dark": lambda r: grey(r, 25, 75, 0.15),
    "black": lambda r: grey(r, 6, 32, 0.25),
    "olive": lambda r: np.sort(colour(r, (28, 42, 46), (80, 100, 112))),
    "brown": lambda r: np.sort(colour(r, (20, 35, 55), (60, 85, 120))),
    "white": lambda r: grey(r, 165, 245, 0.06),
    "pale blue": lambda r: colour(r, (150, 125, 100), (240, 205, 175)),
    "blue": lambda r: colour(r, (110, 50, 10), (230, 140, 80)),
    "green": lambda r: colour(r, (40, 80, 15), (140, 190, 100)),
    "yellow": lambda r: colour(r, (10, 110, 120), (70, 190, 215)),
    "cream": lambda r: colour(r, (135, 170, 180), (200, 225, 240)),
    "red": lambda r: colour(r, (20, 20, 120), (70, 70, 210)),
}
SHAFTS = {"grey": 2.4, "dark": 1.7, "olive": 1.8, "brown": 0.8, "black": 2.0, "steel": 1.6, "white": 1.8, "pale blue": 1.3,
          "blue": 0.6, "green": 1.0, "yellow": 0.3}
WIDE_SHAFTS = {"white": 2, "grey": 2, "steel": 1.2, "pale blue": 1, "olive": 1, "dark": 1, "black": 0.7}
JAWS = {"steel": 0.4, "grey": 0.2, "dark": 0.2, "black": 0.06, "white": 0.04, "cream": 0.06, "yellow": 0.02, "brown": 0.02}
BARE_METAL = ("steel", "grey", "dark", "olive", "brown")


def choose(rng, weights):
    names = list(weights)
    share = np.array([weights[name] for name in names], float)
    return names[rng.choice(len(names), p=share / share.sum())]


def material(rng, name):
    return MATERIALS[name](rng).astype(np.float32)


def round_shading(rng, rows, columns):
    """Brightness and gloss of a round body whose axis lies along the columns."""
    across = np.linspace(-1, 1, rows, dtype=np.float32)
    normal, lamp = np.sqrt(np.maximum(0, 1 - across**2)), rng.uniform(-1.1, 1.1)
    lit = rng.uniform(0.15, 0.5) + rng.uniform(0.4, 1.0) * np.clip(normal * np.cos(lamp) + across * np.sin(lamp), 0, 1)
    gloss = np.zeros_like(across)
    for _ in range(rng.integers(1, 4)):
        gloss += rng.uniform(0.1, 1.0) * np.exp(-(((across - rng.uniform(-0.8, 0.8)) / rng.uniform(0.03, 0.25)) ** 2))
    along = np.linspace(rng.uniform(0.4, 1.1), rng.uniform(0.7, 1.4), columns) * (1 + np.cumsum(rng.normal(0, 0.02, columns)))
    along = np.clip(along, 0.15, 1.8).astype(np.float32)
    return lit[:, None] * along, gloss[:, None] * np.clip(along, 0, 1.4)


def rod(rng, rows, columns, name):
    """Surface of a round body: brushed, ribbed, scratched, ringed or printed on."""
    lit, gloss = round_shading(rng, rows, columns)
    texture = np.ones((rows, columns), np.float32)
    if name in BARE_METAL and rng.random() < 0.5:
        texture *= 1 + 0.35 * np.sin(np.linspace(0, rng.uniform(8, 28), rows) + rng.uniform(0, 6))[:, None].astype(np.float32)
    if rng.random() < 0.6:
        kind = rng.random()
        if kind < 0.35:
            texture *= 1 + rng.uniform(0.05, 0.35) * np.sin(np.arange(columns) * 2 * np.pi / rng.uniform(3, 14))[None].astype(np.float32)
        if kind > 0.25:
            streaks = rng.normal(0, 1, (rows, max(2, columns // 24))).astype(np.float32)
            texture *= 1 + rng.uniform(0.03, 0.25) * cv2.resize(streaks, (columns, rows))
        texture *= 1 + (noise(rng, rng.uniform(4, 30), 2, height=rows, width=columns) - 0.5) * rng.uniform(0, 0.6)
    surface = material(rng, name) * (lit * texture)[..., None] + 255 * rng.uniform(0.05, 1.0) * (gloss * texture)[..., None]
    for _ in range(rng.integers(0, 4)):  # rings
        at, long = int(rng.uniform(0, columns)), int(rng.uniform(1, 12))
        surface[:, at : at + long] *= rng.choice([0.2, 0.5, 1.5, 2.0])
    if rng.random() < 0.25:  # a sleeve, a mark
        at, long = int(rng.uniform(0, columns * 0.8)), int(rng.uniform(8, 90))
        other = material(rng, rng.choice(["black", "white", "steel", "yellow", "blue", "cream", "green", "grey", "red"]))
        surface[:, at : at + long] = surface[:, at : at + long] * 0.3 + 0.7 * other * lit[:, at : at + long, None]
    if rng.random() < 0.2:
        text = "".join(rng.choice(list("ABCDEFILNORSTVXZ 0123456789"), 8))
        at = (int(rng.uniform(0, columns * 0.7)), int(rows * rng.uniform(0.4, 0.8)))
        surface = np.ascontiguousarray(surface, np.float32)
        cv2.putText(surface, text, at, 0, rng.uniform(0.3, 0.6), [float(rng.choice([20, 230]))] * 3, 1, cv2.LINE_AA)
    return np.ascontiguousarray(surface, np.float32)


def mechanism(rng, rows, columns, names=("steel", "grey", "cream", "dark", "yellow", "blue"), share=(0.46, 0.2, 0.14, 0.12, 0.03, 0.05)):
    """Surface of a wrist: plates, discs, cables and gaps, bright beside dark."""
    surface = rod(rng, rows, columns, rng.choice(names, p=share))
    for _ in range(rng.integers(4, 16)):
        tone = (material(rng, rng.choice(["steel", "steel", "grey", "black", "white", "cream", "dark"])) * rng.uniform(0.4, 1.5)).tolist()
        kind, x, y = rng.random(), int(rng.uniform(0, columns)), int(rng.uniform(0, rows))
        if kind < 0.35:
            axes = (int(rng.uniform(2, rows * 0.35)), int(rng.uniform(2, rows * 0.3)))
            cv2.ellipse(surface, (x, y), axes, rng.uniform(0, 180), 0, 360, tone, -1 if rng.random() < 0.7 else int(rng.integers(1, 4)), cv2.LINE_AA)
        elif kind < 0.7:
            corners = np.array([[x, y]]) + rng.normal(0, rows * 0.22, (int(rng.integers(3, 6)), 2))
            cv2.fillPoly(surface, [cv2.convexHull(corners.astype(np.int32))], tone, cv2.LINE_AA)
        else:
            end = (int(x + rng.normal(0, rows * 0.4)), int(y + rng.normal(0, rows * 0.25)))
            cv2.line(surface, (x, y), end, tone, int(rng.integers(1, 5)), cv2.LINE_AA)
    if rng.random() < 0.15:  # markers
        for _ in range(rng.integers(1, 4)):
            centre = (int(rng.uniform(0, columns)), int(rng.uniform(0.2, 0.8) * rows))
            axes = (int(rng.uniform(0.1, 0.35) * rows), int(rng.uniform(0.1, 0.35) * rows))
            cv2.ellipse(surface, centre, axes, 0, 0, 360, material(rng, rng.choice(["blue", "green", "yellow", "pale blue"])).tolist(), -1, cv2.LINE_AA)
    if rng.random() < 0.6:  # axle
        centre, radius = (int(columns * rng.uniform(0.4, 0.9)), rows // 2), int(rows * rng.uniform(0.1, 0.3))
        cv2.circle(surface, centre, radius, (material(rng, "steel") * rng.uniform(0.4, 1.2)).tolist(), -1, cv2.LINE_AA)
        cv2.circle(surface, centre, max(1, radius // 2), material(rng, "black").tolist(), -1, cv2.LINE_AA)
    return cv2.GaussianBlur(surface, (0, 0), rng.uniform(0.5, 1.2))


def placed(points, origin, angle):
    c, s = np.cos(angle), np.sin(angle)
    points = np.asarray(points, float)
    return np.stack([origin[0] + points[:, 0] * c - points[:, 1] * s, origin[1] + points[:, 0] * s + points[:, 1] * c], 1)


class Drawing:
    """Colour and cover of one instrument."""

    def __init__(self):
        self.colour = np.zeros((HEIGHT, WIDTH, 3), np.float32)
        self.cover = np.zeros((HEIGHT, WIDTH), np.float32)

    def paste(self, surface, corners, mask):
        """A surface, warped so that its corners come to `corners`, where the mask is."""
        x, y, wide, high = cv2.boundingRect((mask > 0).astype(np.uint8))
        if wide * high == 0:
            return
        rows, columns = surface.shape[:2]
        source = np.float32([(0, 0), (columns, 0), (columns, rows), (0, rows)])
        warp = cv2.getPerspectiveTransform(source, np.float32(corners) - np.float32([x, y]))
        warped = cv2.warpPerspective(surface, warp, (wide, high), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        box = np.s_[y : y + high, x : x + wide]
        self.colour[box] = mix(self.colour[box], warped, mask[box])
        self.cover[box] = np.maximum(self.cover[box], mask[box])


def jaw_outline(rng, length, width, kind, bend):
    """Polygon of one jaw from the joint at the origin along x."""
    x = np.linspace(0, 1, 24)
    if kind == "taper":
        wide = width * (1 - rng.uniform(0.4, 0.8) * x) * np.where(x > 0.93, np.sqrt(np.maximum(0, 1 - ((x - 0.93) / 0.07) ** 2)) * 0.9 + 0.1, 1)
    elif kind == "point":
        wide = width * (1 - x ** rng.uniform(0.8, 1.6)) + 0.6
    elif kind == "blunt":
        wide = width * rng.uniform(0.8, 1.05) * np.where(x > 0.85, np.sqrt(np.maximum(0.02, 1 - ((x - 0.85) / 0.15) ** 2)), 1)
    else:  # bulge
        wide = width * (0.55 + 0.5 * np.sin(np.pi * np.clip(x * 1.05, 0, 1)) ** 0.7) * np.where(x > 0.9, np.sqrt(np.maximum(0.02, 1 - ((x - 0.9) / 0.1) ** 2)), 1)
    middle = bend * length * x**2
    return np.vstack([np.stack([length * x, middle + wide / 2], 1), np.stack([length * x, middle - wide / 2], 1)[::-1]])


def window_in(rng, outline, length):
    """The hole of a fenestrated jaw."""
    narrow, hole, x = rng.uniform(0.35, 0.75), outline.copy(), outline[:, 0]
    middle = np.interp(x, outline[:24, 0], (outline[:24, 1] + outline[24:][::-1][:, 1]) / 2)
    hole[:, 1] = middle + (hole[:, 1] - middle) * narrow
    hole[:, 0] = x.mean() + (x - x.mean()) * rng.uniform(0.6, 0.85) + 0.03 * length
    return hole


def draw_jaws(rng, drawing, joint, angle, length, width):
    jaws, opening = (2 if rng.random() < 0.85 else 1), (abs(rng.normal(0, 0.35)) if rng.random() < 0.65 else rng.uniform(0, 0.05))
    turned, kind = rng.normal(0, 0.15), rng.choice(["taper", "point", "blunt", "bulge"], p=[0.4, 0.2, 0.2, 0.2])
    windowed = rng.random() < 0.33 and kind != "point"
    jaw_width, bend = width * rng.uniform(0.3, 0.75) * (1 if jaws == 2 else 1.1), rng.normal(0, 0.18)
    name, mirrored = choose(rng, JAWS), rng.random() < 0.25
    for jaw in range(jaws):
        side = (1 if jaw else -1) if jaws == 2 else 0
        long = length * (1 if jaw == 0 else rng.uniform(0.85, 1.05))
        outline = jaw_outline(rng, long, jaw_width, kind, bend * (side if mirrored and side else 1))
        outline[:, 1] += side * jaw_width * 0.25 * (opening < 0.1)
        at = angle + turned + side * opening
        hole = placed(window_in(rng, outline, long), joint, at) if windowed else None
        mask = filled(placed(outline, joint, at), hole)
        surface = rod(rng, 30, 90, name) if rng.random() < 0.65 else mechanism(rng, 30, 90, ("steel", "grey"), (0.7, 0.3))
        if rng.random() < 0.3:  # teeth
            surface[18:] *= (1 + 0.5 * np.sign(np.sin(np.arange(90) * 2 * np.pi / rng.uniform(3, 7))))[None, :, None]
        if jaws == 2 and opening < 0.12 and jaw == 1:  # the gap between closed ones
            drawing.colour *= 1 - 0.5 * cv2.dilate(mask, np.ones((3, 3)))[..., None]
        half = 0.6 * jaw_width
        corners = [[0, -half], [long, -half + bend * long], [long, half + bend * long], [0, half]]
        drawing.paste(surface, placed(corners, joint, at), mask)


def draw_hook(rng, drawing, joint, angle, length, width):
    thickness = max(1.6, width * rng.uniform(0.08, 0.3))
    points = [np.array([0, 0]), np.array([length * rng.uniform(0.6, 1), 0])]
    if rng.random() < 0.6:
        points.append(points[-1] + np.array([rng.uniform(-0.1, 0.3) * length, rng.choice([-1, 1]) * length * rng.uniform(0.2, 0.6)]))
    mask = np.zeros((HEIGHT, WIDTH), np.uint8)
    line = np.round(placed(points, joint, angle) * 8).astype(np.int32)
    cv2.polylines(mask, [line], False, 255, int(max(2, round(thickness))), cv2.LINE_AA, 3)
    half = 0.7 * thickness
    corners = placed([[0, -half], [length, -half], [length, half], [0, half]], joint, angle)
    drawing.paste(rod(rng, 20, 80, rng.choice(["steel", "grey", "black", "cream"])), corners, mask.astype(np.float32) / 255)


def draw_wrist(rng, drawing, root, angle, length, width, straight):
    if length < 2:
        return
    near, far = width * rng.uniform(0.85, 1.15), width * rng.uniform(0.55, 1.05)
    widest = max(near, far)
    outline = [[-0.15 * width, -near / 2], [0.6 * length, -widest / 2], [length, -far / 2], [length + 0.25 * far, -0.3 * far],
               [length + 0.25 * far, 0.3 * far], [length, far / 2], [0.6 * length, widest / 2], [-0.15 * width, near / 2]]
    if straight:
        outline = [[-2, -0.42 * width], [length, -0.36 * width], [length, 0.36 * width], [-2, 0.42 * width]]
    corners = [[-0.15 * width, -near / 2], [length + 0.2 * width, -near / 2], [length + 0.2 * width, near / 2], [-0.15 * width, near / 2]]
    drawing.paste(mechanism(rng, 50, int(np.clip(50 * length / width, 30, 120))), placed(corners, root, angle), filled(placed(outline, root, angle)))
    for _ in range(rng.integers(1, 3) if rng.random() < 0.3 else 0):  # ceramic knuckles
        centre = placed([[length * rng.uniform(0.5, 1.1), rng.uniform(-0.4, 0.4) * width]], root, angle)[0]
        mask = np.zeros((HEIGHT, WIDTH), np.uint8)
        axes = (max(1, int(width * rng.uniform(0.15, 0.4))), max(1, int(width * rng.uniform(0.1, 0.25))))
        cv2.ellipse(mask, tuple(int(v) for v in centre), axes, np.degrees(angle), 0, 360, 255, -1, cv2.LINE_AA)
        mask = mask.astype(np.float32) / 255
        drawing.colour = mix(drawing.colour, material(rng, "cream") * rng.uniform(0.6, 1.2), mask)
        drawing.cover = np.maximum(drawing.cover, mask)


def entry_point(rng):
    """A point on the border, seldom the upper one."""
    along = rng.uniform(-0.1, 1.1)
    side = rng.choice(4, p=[0.3, 0.3, 0.26, 0.14])
    return np.array([(-5, along * HEIGHT), (WIDTH + 5, along * HEIGHT), (along * WIDTH, HEIGHT + 5), (along * WIDTH, -5)][side], float)


def light_of_the_scene(rng, picture, surroundings):
    """What makes an instrument part of the scene: the tissue's light and mirror image, shadow, blood."""
    around = blur(surroundings, rng.uniform(6, 20))
    if rng.random() < 0.7:
        share = rng.uniform(0, 0.5) * rng.random()
        picture = picture * ((1 - share) + share * (around.mean((0, 1)) / max(20, around.mean())))
    if rng.random() < 0.5:
        share = rng.uniform(0.05, 0.45)
        if rng.random() < 0.4:
            share = share * patch(rng, rng.uniform(8, 60))[..., None]
        picture = picture * (1 - share) + share * around[::-1, ::-1] * rng.uniform(0.5, 1.1)
    if rng.random() < 0.4:
        picture = picture * (1 - patch(rng, rng.uniform(60, 160))[..., None] * rng.uniform(0.2, 0.8))
    picture = picture * (rng.uniform(0.6, 1.7) if rng.random() < 0.8 else rng.uniform(0.25, 0.6))
    if rng.random() < 0.35:
        blood = patch(rng, rng.uniform(6, 50)) * rng.uniform(0.3, 0.95)
        wet = (picture.mean(2, keepdims=True) * 0.6 + 20) * colour(rng, (0.1, 0.1, 0.7), (0.5, 0.5, 1.6))
        picture = mix(picture, wet, blood)
    return picture.astype(np.float32)


def draw_instrument(rng, surroundings):
    """Colour, cover (0..1), tip and width of one instrument."""
    drawing = Drawing()
    wide = rng.random() < 0.45
    width = float(np.exp(rng.uniform(np.log(40), np.log(145)) if wide else rng.uniform(np.log(8), np.log(58))))
    tip, entry = np.array([rng.uniform(0.06, 0.94) * WIDTH, rng.uniform(0.06, 0.94) * HEIGHT]), entry_point(rng)
    way = tip - entry
    length = np.linalg.norm(way)
    if length < 25:
        tip, length = entry + way / max(length, 1) * 40, 40
        way = tip - entry
    angle = np.arctan2(way[1], way[0])
    form = rng.choice(["wristed", "straight", "tube", "hook", "stub"], p=[0.56, 0.2, 0.08, 0.1, 0.06])
    shaft_name = choose(rng, WIDE_SHAFTS if wide and rng.random() < 0.6 else SHAFTS)

    # from the tip back to the shaft
    jaw_length = min(width * (rng.uniform(0.4, 0.8) if form == "stub" else rng.uniform(0.7, 2.6)), 0.5 * length + 8)
    wrist_length = width * (rng.uniform(0.6, 2.0) if form == "wristed" else rng.uniform(0, 0.3))
    jaw_angle = angle + rng.normal(0, 0.45 if form == "wristed" else 0.03)
    wrist_angle = angle + (rng.normal(0, 0.15) if form == "wristed" else 0)
    joint = tip - jaw_length * np.array([np.cos(jaw_angle), np.sin(jaw_angle)])
    root = joint - wrist_length * np.array([np.cos(wrist_angle), np.sin(wrist_angle)])
    back = root - entry
    long, direction = np.linalg.norm(back), angle
    if back @ way > 0:
        direction = np.arctan2(back[1], back[0])
    else:
        long = 60
    long += 80
    along = np.array([np.cos(direction), np.sin(direction)])
    across = np.array([-along[1], along[0]])
    behind, nearer = root - along * long, width * (1 + rng.uniform(0, 0.25) * (1 if rng.random() < 0.8 else -0.6) * long / 150)
    shaft_corners = np.array([behind - across * nearer / 2, root - across * width / 2, root + across * width / 2, behind + across * nearer / 2])

    def shaft():
        drawing.paste(rod(rng, 40, int(np.clip(long * 40 / width, 60, 900)), shaft_name), shaft_corners, filled(shaft_corners))

    def wrist():
        if form != "tube":
            draw_wrist(rng, drawing, root, wrist_angle, wrist_length, width, form == "straight")

    def jaws():
        if form == "hook":
            draw_hook(rng, drawing, joint, jaw_angle, jaw_length, width)
        elif form != "tube":
            draw_jaws(rng, drawing, joint, jaw_angle, jaw_length, width)

    for part in (shaft, jaws, wrist) if rng.random() < 0.6 else (shaft, wrist, jaws):
        part()
    return light_of_the_scene(rng, drawing.colour, surroundings), drawing.cover, tip, width
