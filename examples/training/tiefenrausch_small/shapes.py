"""Pastes objects in front of a photograph, with a sharp disparity step around them, so that the network learns from silhouettes with
exactly known disparity."""
import cv2
import numpy as np

MIN_STEP, MAX_STEP = 0.04, 0.55  # range of the disparity step between the covered and the covering surface


def relief(rng, size):
    """Returns the disparity of a surface, up to a constant: a slanted plane, or a bulge."""
    y, x = np.mgrid[-1:1:size[0] * 1j, -1:1:size[1] * 1j].astype(np.float32)
    slant = rng.normal(0, 0.04, 2)
    bulge = rng.uniform(0, 0.12) if rng.random() < 0.5 else 0.0
    return (slant[0] * y + slant[1] * x + bulge * np.sqrt(np.clip(1 - 0.9 * (x * x + y * y), 0, 1))).astype(np.float32)


def outline(rng, size):
    """Returns the opacity of a shape: an ellipse, a bar, a polygon or a blob."""
    height, width = size
    mask, kind = np.zeros(size, np.uint8), rng.integers(4)
    if kind == 0:
        cv2.ellipse(mask, ((width / 2, height / 2), (width * rng.uniform(0.5, 0.95), height * rng.uniform(0.5, 0.95)), rng.uniform(0, 180)), 1, -1)
    elif kind == 1:
        box = ((width / 2, height / 2), (width * rng.uniform(0.04, 0.35), height * 1.5), rng.normal(0, 12) + 90 * (rng.random() < 0.3))
        cv2.fillPoly(mask, [np.int32(cv2.boxPoints(box))], 1)
    elif kind == 2:
        angles = np.sort(rng.uniform(0, 2 * np.pi, rng.integers(3, 9)))
        radii = rng.uniform(0.3, 1, len(angles))
        points = np.stack([width / 2 * (1 + radii * np.cos(angles)), height / 2 * (1 + radii * np.sin(angles))], 1)
        cv2.fillPoly(mask, [np.int32(points)], 1)
    else:
        noise = cv2.resize(rng.normal(0, 1, (rng.integers(3, 8), rng.integers(3, 8))).astype(np.float32), (width, height), interpolation=cv2.INTER_CUBIC)
        y, x = np.mgrid[-1:1:height * 1j, -1:1:width * 1j]
        mask[:] = noise * 0.5 + 1 - 1.6 * (x * x + y * y) > 0.3
    return mask.astype(np.float32)


def paste(rng, color, truth, cutting, disparity, opacity):
    """Pastes a cutout (from data.Photographs.cutting) at a random place over a crop, nearer than the covered pixels. Changes color (H x W x 3 uint8) and
    truth (H x W, NaN where unknown) in place."""
    height, width = truth.shape
    scale = rng.uniform(0.25, 0.95) * max(height, width) / max(opacity.shape)
    h, w = max(2, round(opacity.shape[0] * scale)), max(2, round(opacity.shape[1] * scale * np.exp(rng.uniform(-0.15, 0.15))))
    way = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    cutting, disparity, opacity = (cv2.resize(a, (w, h), interpolation=way) for a in (cutting, disparity, opacity))
    if rng.random() < 0.5:
        cutting, disparity, opacity = cutting[:, ::-1], disparity[:, ::-1], opacity[:, ::-1]
    top, left = int(rng.integers(-h // 3, height - h // 2 + 1)), int(rng.integers(-w // 2, width - w // 2 + 1))
    y0, x0, y1, x1 = max(0, top), max(0, left), min(height, top + h), min(width, left + w)
    if y1 - y0 < 4 or x1 - x0 < 4:
        return
    inside, of_cutting = (slice(y0, y1), slice(x0, x1)), (slice(y0 - top, y1 - top), slice(x0 - left, x1 - left))
    alpha = cv2.GaussianBlur(opacity[of_cutting], (0, 0), rng.uniform(0.3, 0.8))
    solid = alpha > 0.5
    if solid.sum() < 60:
        return
    covered = truth[inside]
    under = covered[solid & ~np.isnan(covered)]
    base = np.percentile(under, 90) if len(under) else 0.4
    own = disparity[of_cutting]
    own = (own - np.median(own[solid])) * rng.uniform(0.3, 1.0)
    nearer = base + np.exp(rng.uniform(np.log(MIN_STEP), np.log(MAX_STEP))) + np.clip(own, -0.2, 0.2)
    covered[solid] = np.fmax(nearer, np.nan_to_num(covered, nan=0.0) + MIN_STEP)[solid]
    most = np.nanmax(truth)
    if most > 1:
        truth /= most
    # shifts the cutout's mean color toward that of its new surroundings
    place, piece = color[inside].astype(np.float32), cutting[of_cutting].astype(np.float32)
    lean = rng.uniform(0, 0.7)
    piece = piece + lean * (place.mean((0, 1)) - piece[solid].mean(0))
    color[inside] = np.clip(place + alpha[..., None] * (np.clip(piece, 0, 255) - place) + 0.5, 0, 255).astype(np.uint8)
