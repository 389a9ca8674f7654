"""Instruments of a surgical robot: brushed or plastic shafts, polished wrists, insulating sleeves with scissors."""

import cv2
import numpy as np

from canvas import HEIGHT, WIDTH, blur, colour, filled, grey, noise
from instruments import Drawing, draw_jaws, entry_point, mechanism, placed, round_shading


def lengthwise(rng, rows, columns, fine):
    """Streaks along a body, 0..1."""
    return cv2.resize(rng.random((max(2, int(rows / fine)), max(2, columns // 60)), dtype=np.float32), (columns, rows), interpolation=cv2.INTER_CUBIC)


def shaft_surface(rng, rows, columns, pale):
    """Brushed carbon, painted steel or pale plastic: nearly without colour, evenly lit along, with a broad gloss."""
    across = np.linspace(-1, 1, rows, dtype=np.float32)
    lamp = rng.uniform(-0.7, 0.7)
    lit = rng.uniform(0.1, 0.45) + np.clip(np.sqrt(np.maximum(0, 1 - across**2)) * np.cos(lamp) + across * np.sin(lamp), 0, 1) ** rng.uniform(0.7, 1.6)
    base = grey(rng, 100, 235, 0.08) if pale else grey(rng, 14, 75, 0.12) if rng.random() < 0.5 else grey(rng, 50, 140, 0.12)
    if rng.random() < 0.5:  # olive or bluish
        base = base * np.float32([rng.uniform(0.78, 1), rng.uniform(0.95, 1.03), 1.0]) if rng.random() < 0.7 else base * np.float32([1.08, 1.0, rng.uniform(0.85, 1)])
    texture = 1 + rng.uniform(0, 0.25) * (lengthwise(rng, rows, columns, rng.uniform(1, 4)) - 0.5)
    texture = texture * (1 + rng.uniform(0, 0.3) * (noise(rng, rng.uniform(2, 12), 2, height=rows, width=columns) - 0.5))
    along = np.linspace(1, rng.uniform(0.7, 1.3), columns, dtype=np.float32)
    surface = base * (lit[:, None] * texture * along)[..., None]
    for _ in range(rng.integers(0, 3)):
        at, wide = rng.uniform(-0.7, 0.7), rng.uniform(0.05, 0.4)
        surface += (255 * rng.uniform(0.05, 0.7) * np.exp(-(((across - at) / wide) ** 2)))[:, None, None] * along[None, :, None]
    if pale or rng.random() < 0.3:  # rings and steps
        for at in rng.uniform(0, columns, rng.integers(0, 6)):
            surface[:, int(at) : int(at) + int(rng.integers(1, 6))] *= rng.uniform(0.5, 1.3)
    if rng.random() < 0.35:
        text = "".join(rng.choice(list("abcdeilnorstuvxyzDVI 0478"), 9))
        scale = rng.uniform(0.4, 1.1)
        cv2.putText(surface, text, (int(rng.uniform(0, 0.6 * columns)), int(rows * rng.uniform(0.4, 0.9))), 0, scale, [float(rng.choice([30, 235]))] * 3, int(rng.integers(1, 3)), cv2.LINE_AA)
    return np.ascontiguousarray(surface, np.float32)


def polished(rng, rows, columns):
    """Chrome: bright and dark stripes along, broken by joints, holes and cables."""
    stripes = lengthwise(rng, rows, columns, rng.uniform(2, 6))
    stripes = np.clip((stripes - 0.5) * rng.uniform(1.5, 4) + rng.uniform(0.3, 0.6), 0.03, 1.1)
    surface = grey(rng, 130, 255, 0.06) * (stripes * round_shading(rng, rows, columns)[0].clip(0.4, 1.2))[..., None]
    surface = np.ascontiguousarray(surface, np.float32)
    for _ in range(rng.integers(2, 7)):
        x, y, radius = int(rng.uniform(0, columns)), int(rng.uniform(0.1, 0.9) * rows), int(rows * rng.uniform(0.04, 0.2))
        cv2.circle(surface, (x, y), radius, [float(rng.uniform(5, 60))] * 3, -1 if rng.random() < 0.5 else max(1, radius // 3), cv2.LINE_AA)
    for at in rng.uniform(0, columns, rng.integers(1, 5)):
        surface[:, int(at) : int(at) + int(rng.integers(1, 5))] *= rng.uniform(0.15, 0.6)
    return surface


def specks(rng, drawing):
    """Drops of blood and water."""
    for _ in range(int(rng.integers(0, 40)) if rng.random() < 0.6 else 0):
        tone = colour(rng, (10, 10, 60), (50, 40, 150)) if rng.random() < 0.7 else grey(rng, 180, 255)
        centre = (int(rng.uniform(0, WIDTH)), int(rng.uniform(0, HEIGHT)))
        axes = (max(1, int(abs(rng.normal(0, 2.5)))), max(1, int(abs(rng.normal(0, 2)))))
        cv2.ellipse(drawing.colour, centre, axes, rng.uniform(0, 180), 0, 360, tone.tolist(), -1, cv2.LINE_AA)


def draw_sleeve(rng, drawing, root, angle, width, length, pale):
    """An insulating sleeve that narrows to scissors, a hook or a spatula."""
    end = rng.uniform(0.22, 0.6)
    x = np.linspace(0, 1, 16)
    half = 0.5 * width * (1 - (1 - end) * x ** rng.uniform(0.8, 2.2)) * (1.02 + 0.03 * rng.choice([0, 1]))
    points = np.vstack([np.stack([length * x, half], 1), np.stack([length * x, -half], 1)[::-1]])
    surface = shaft_surface(rng, 40, int(np.clip(40 * length / width, 30, 200)), pale)
    if rng.random() < 0.4:
        surface[:, -int(rng.integers(4, 20)) :] *= rng.uniform(0.4, 1.5)
    corners = [[0, -0.5 * width], [length, -0.5 * end * width], [length, 0.5 * end * width], [0, 0.5 * width]]
    blades = width * rng.uniform(0.3, 1.1)
    joint = placed([[length - 0.1 * blades, 0]], root, angle)[0]
    draw_jaws(rng, drawing, joint, angle + rng.normal(0, 0.25), blades, width * rng.uniform(0.3, 0.8))
    drawing.paste(surface, placed(corners, root, angle), filled(placed(points, root, angle)))


def draw_robotic(rng, surroundings):
    """Colour, cover (0..1), tip and width of one instrument."""
    drawing = Drawing()
    width = float(np.exp(rng.uniform(np.log(14), np.log(125))))
    entry = entry_point(rng)
    tip = np.array([rng.uniform(0.08, 0.92) * WIDTH, rng.uniform(0.08, 0.92) * HEIGHT])
    way = tip - entry
    length = np.linalg.norm(way)
    if length < 1.2 * width:
        way = np.array([WIDTH / 2, HEIGHT / 2]) - entry
        tip = entry + way * min(1, 1.5 * width / np.linalg.norm(way))
        way, length = tip - entry, np.linalg.norm(tip - entry)
    angle = np.arctan2(way[1], way[0])
    sleeved, pale = rng.random() < 0.4, rng.random() < 0.45
    wrist_angle = angle + rng.normal(0, 0.2)
    jaw_angle = wrist_angle + rng.normal(0, 0.35)
    jaw_length = min(width * rng.uniform(0.6, 2.2), 0.5 * length)
    wrist_length = width * rng.uniform(0.6, 1.8)
    head = wrist_length + jaw_length if not sleeved else width * rng.uniform(0.8, 2.2)
    root = tip - head * np.array([np.cos(wrist_angle), np.sin(wrist_angle)])
    direction = angle
    if (root - entry) @ way > 0.2 * length * length:
        direction = np.arctan2(*(root - entry)[::-1])
    along = np.array([np.cos(direction), np.sin(direction)])
    across = np.array([-along[1], along[0]])
    long = max(np.linalg.norm(root - entry), 60) + 80
    nearer = width * (1 + rng.uniform(-0.05, 0.35) * long / 200)
    corners = np.array([root - along * long - across * nearer / 2, root - across * width / 2, root + across * width / 2, root - along * long + across * nearer / 2])
    drawing.paste(shaft_surface(rng, 48, int(np.clip(long * 48 / width, 60, 900)), pale), corners, filled(corners))
    if rng.random() < 0.6 and not sleeved:  # the steel ring at the end of the shaft
        ring = placed([[-width * rng.uniform(0.1, 1.2), -0.5 * width], [0, -0.5 * width], [0, 0.5 * width], [-0.1, 0.5 * width]], root, direction)
        ring[3] = ring[0] + (ring[2] - ring[1])
        drawing.paste(polished(rng, 40, 40) if rng.random() < 0.4 else shaft_surface(rng, 40, 40, True), ring, filled(ring))
    if sleeved:
        draw_sleeve(rng, drawing, root, wrist_angle, width, head, pale)
    else:
        joint = root + wrist_length * np.array([np.cos(wrist_angle), np.sin(wrist_angle)])

        def wrist():
            near, far = width * rng.uniform(0.85, 1.05), width * rng.uniform(0.55, 0.95)
            body = placed([[-0.1 * width, -near / 2], [0.5 * wrist_length, -near / 2], [wrist_length, -far / 2], [wrist_length + 0.3 * far, 0], [wrist_length, far / 2], [0.5 * wrist_length, near / 2], [-0.1 * width, near / 2]], root, wrist_angle)
            frame = placed([[0, -near / 2], [wrist_length * 1.1, -near / 2], [wrist_length * 1.1, near / 2], [0, near / 2]], root, wrist_angle)
            columns = int(np.clip(50 * wrist_length / width, 30, 120))
            drawing.paste(polished(rng, 50, columns) if rng.random() < 0.6 else mechanism(rng, 50, columns), frame, filled(body))
            if rng.random() < 0.45:  # ceramic or plastic at the joint
                a, b = width * rng.uniform(0.15, 0.45), width * rng.uniform(0.1, 0.4)
                t = np.linspace(0, 2 * np.pi, 20)
                piece = placed(np.stack([wrist_length * rng.uniform(0.7, 1.05) + a * np.cos(t), rng.uniform(-0.25, 0.25) * width + b * np.sin(t)], 1), root, wrist_angle)
                tone = colour(rng, (140, 175, 185), (215, 235, 245)) if rng.random() < 0.7 else grey(rng, 150, 240)
                if rng.random() < 0.15:
                    tone = colour(rng, (150, 90, 30), (240, 170, 110))  # a marker
                patch = np.ones((20, 20, 3), np.float32) * tone * (0.5 + 0.6 * noise(rng, 8, 2, height=20, width=20))[..., None]
                drawing.paste(patch, placed([[wrist_length * 0.6, -b], [wrist_length * 1.2, -b], [wrist_length * 1.2, b], [wrist_length * 0.6, b]], root, wrist_angle), filled(piece))

        def jaws():
            draw_jaws(rng, drawing, joint, jaw_angle, jaw_length, width)

        for part in (wrist, jaws) if rng.random() < 0.5 else (jaws, wrist):
            part()
    specks(rng, drawing)
    picture = drawing.colour * rng.uniform(0.7, 1.35)
    if rng.random() < 0.5:  # the tissue in its mirror
        share = rng.uniform(0.03, 0.22)
        picture = picture * (1 - share) + share * blur(surroundings, rng.uniform(6, 20))[::-1, ::-1]
    if rng.random() < 0.35:
        picture = picture * (1 - rng.uniform(0.2, 0.7) * np.clip(2 * noise(rng, rng.uniform(60, 160), 2) - 0.6, 0, 1))[..., None]
    if rng.random() < 0.12:
        stain = np.clip((noise(rng, rng.uniform(6, 40), 3) - rng.uniform(0.5, 0.7)) * 12, 0, 1)[..., None] * rng.uniform(0.3, 0.9)
        picture = picture * (1 - stain) + stain * (picture.mean(2, keepdims=True) * 0.5 + 15) * colour(rng, (0.1, 0.1, 0.7), (0.5, 0.5, 1.5))
    return picture.astype(np.float32), drawing.cover, tip, width
