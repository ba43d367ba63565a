"""Holes behind silhouettes, as label images: 0 known, 1 hole (to be inpainted), 2 does not exist.

Draws a random foreground shape. The surface behind the shape expands inward from the outline by a random distance, the reach, as expand()
does (paper, "Occluded Surface Hallucination"). This band is the hole. In the rest of the shape, the background has no pixels ("does not
exist"). A shape narrower than twice the reach is entirely a hole.

Alternatively, `covered` uses the photograph's own foreground. The background pixels that the foreground covers when the camera moves are
the hole. The foreground itself counts as "does not exist".
"""
import cv2
import numpy as np

KNOWN, HOLE, ABSENT = 0, 1, 2
STEP = 0.05  # minimum step of disparity between two surfaces


def smooth_noise(rng, size):
    cells = rng.integers(3, 9)
    return cv2.resize(rng.standard_normal((cells, cells)).astype(np.float32), (size, size), interpolation=cv2.INTER_CUBIC)


def blobs(rng, size, share):
    noise = smooth_noise(rng, size)
    return (noise > np.quantile(noise, 1 - share)).astype(np.uint8)


def polygons(rng, size):
    shape = np.zeros((size, size), np.uint8)
    for _ in range(rng.integers(1, 4)):
        corners = rng.integers(3, 10)
        angle = np.sort(rng.uniform(0, 2 * np.pi, corners))
        radius = rng.uniform(0.06, 0.35) * size * rng.uniform(0.5, 1.2, corners)
        points = rng.uniform(0, size, 2) + np.stack([radius * np.cos(angle), radius * np.sin(angle)], 1)
        cv2.fillPoly(shape, [points.astype(np.int32)], 1)
    return shape


def ellipses(rng, size):
    shape = np.zeros((size, size), np.uint8)
    for _ in range(rng.integers(1, 4)):
        center = tuple(int(v) for v in rng.integers(0, size, 2))
        axes = tuple(int(v) for v in rng.uniform(0.04, 0.3, 2) * size)
        cv2.ellipse(shape, center, axes, float(rng.uniform(0, 360)), 0, 360, 1, -1)
    return shape


def strokes(rng, size):
    """Draws limbs, branches, poles: bent lines of constant width."""
    shape = np.zeros((size, size), np.uint8)
    for _ in range(rng.integers(1, 5)):
        point, angle = rng.uniform(0, size, 2), rng.uniform(0, 2 * np.pi)
        points = [point]
        for _ in range(rng.integers(2, 7)):
            angle += rng.uniform(-1, 1)
            point = point + rng.uniform(0.08, 0.25) * size * np.array([np.cos(angle), np.sin(angle)])
            points.append(point)
        cv2.polylines(shape, [np.array(points, np.int32)], False, 1, int(rng.integers(4, 36) * size / 256) + 1)
    return shape


def figure(rng, size):
    """Draws a person, the most common foreground: head, trunk and limbs. The picture's lower border may cut the legs."""
    shape = np.zeros((size, size), np.uint8)
    scale, x, foot = rng.uniform(0.25, 1.0) * size, rng.uniform(0.15, 0.85) * size, rng.uniform(0.75, 1.4) * size

    def at(dx, dy):
        return int(x + dx * scale), int(foot - dy * scale)

    cv2.ellipse(shape, at(0, 0.9), (int(0.085 * scale), int(0.11 * scale)), float(rng.uniform(-15, 15)), 0, 360, 1, -1)
    cv2.fillPoly(shape, [np.array([at(-0.15, 0.78), at(0.15, 0.78), at(0.12, 0.4), at(-0.12, 0.4)], np.int32)], 1)
    width = int(rng.uniform(0.07, 0.12) * scale) + 1
    for side in (-1, 1):
        elbow = at(side * rng.uniform(0.16, 0.3), rng.uniform(0.5, 0.75))
        hand = at(side * rng.uniform(0.05, 0.42), rng.uniform(0.35, 0.9))
        cv2.polylines(shape, [np.array([at(side * 0.13, 0.75), elbow, hand], np.int32)], False, 1, width)
        cv2.line(shape, at(side * 0.07, 0.42), at(side * rng.uniform(0.04, 0.2), 0.0), 1, int(1.4 * width))
    return shape


def foreground(rng, size):
    kind = rng.integers(0, 6)
    if kind == 0:
        return blobs(rng, size, rng.uniform(0.1, 0.4))
    if kind == 1:
        return blobs(rng, size, rng.uniform(0.25, 0.65))
    return (polygons, ellipses, strokes, figure)[kind - 2](rng, size)


def draw(rng, size=256):
    """Returns a label image of size x size pixels. The reach, the depth of the band in the shape, is 8 to 50 pixels at size 256 and grows
    in proportion to `size`."""
    while True:
        shape = foreground(rng, size)
        if rng.random() < 0.3:
            shape |= foreground(rng, size)
        reach = rng.uniform(8, 50) * size / 256
        hole = (shape > 0) & (cv2.distanceTransform(shape, cv2.DIST_L2, 5) <= reach)
        if 0.01 < hole.mean() < 0.5 and shape.mean() < 0.75:
            break
    labels = np.zeros((size, size), np.uint8)
    labels[shape > 0] = ABSENT
    labels[hole] = HOLE
    return labels


def covered(disparity, motion, angle):
    """Returns labels for a photograph from its disparity (H x W, 0 to 1). HOLE: pixels that nearer surfaces would cover if disparity 1 moved by
    `motion` pixels relative to disparity 0 in direction `angle`. ABSENT: the nearer surfaces around the hole."""
    height, width = disparity.shape
    y, x = np.mgrid[0:height, 0:width]
    to_y, to_x = (np.rint(at + motion * way * disparity).astype(np.int32) for at, way in ((y, np.sin(angle)), (x, np.cos(angle))))
    reach = int(np.ceil(motion)) + 1
    to_y, to_x = np.clip(to_y + reach, 0, height + 2 * reach - 1), np.clip(to_x + reach, 0, width + 2 * reach - 1)
    nearest = np.zeros((height + 2 * reach, width + 2 * reach), np.float32)
    order = np.argsort(disparity, axis=None)  # the nearest surface is written last
    nearest[to_y.ravel()[order], to_x.ravel()[order]] = disparity.ravel()[order]
    nearest = cv2.morphologyEx(nearest, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8))  # closes gaps that motion opens in near surfaces
    labels = np.zeros((height, width), np.uint8)
    hole = nearest[to_y, to_x] > disparity + STEP
    hole = cv2.morphologyEx(hole.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)) > 0
    if not hole.any():
        return labels
    distance, closest = cv2.distanceTransformWithLabels((~hole).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
    behind = np.zeros(closest.max() + 1, np.float32)
    behind[closest[hole]] = disparity[hole]
    labels[(disparity > behind[closest] + STEP) & (distance < 1.5 * motion)] = ABSENT
    labels[hole] = HOLE
    return labels


def bank(count, size=256, seed=0):
    rng = np.random.default_rng(seed)
    return np.stack([draw(rng, size) for _ in range(count)])
