"""How well a disparity map agrees with measured depth, up to scale and shift of disparity, as MiDaS evaluates."""
import json
import os
import re

import cv2
import numpy as np

FARTHEST = 20.0  # times the median distance: nothing counts as farther, in the truth or in the estimate
EDGE_SIDE = 384  # edges are looked for at this long side
REACH = 4  # pixels: a step smeared over less is an edge in full, and edges that lie this near each other are the same
EDGE = 1.15  # the factor between disparities that makes an edge


def read_pairs(folder):
    """(name, photograph H x W x 3 uint8 RGB, disparity H x W float64 with NaN where unknown), sorted as in the manifest."""
    with open(os.path.join(folder, "manifest.json")) as file:
        manifest = json.load(file)
    for entry in manifest:
        photo = cv2.cvtColor(cv2.imread(os.path.join(folder, entry["image"]), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
        stored = cv2.imread(os.path.join(folder, entry["map"]), cv2.IMREAD_UNCHANGED).astype(np.float64)
        value = np.where(stored == entry["invalid"], np.nan, stored / entry["scale"])
        offset = re.search(r"disparity \+ ([0-9.]+)", entry["note"])  # what cropping took away
        disparity = 1 / value if entry["kind"] == "depth" else value + (float(offset[1]) if offset else 0.0)
        yield entry["name"], photo, disparity


def align(estimate, truth, known):
    """a * estimate + b with the least squared error where known"""
    x, y = estimate[known], truth[known]
    a, b = np.polyfit(x, y, 1) if x.std() > 0 else (0.0, y.mean())
    return a * estimate + b


def edges(logarithm, known):
    """Pixels that differ from the one REACH to the right, or below, by a factor of EDGE or more, both known."""
    found = np.zeros(known.shape, bool)
    for y, x in ((0, REACH), (REACH, 0)):
        h, w = known.shape[0] - y, known.shape[1] - x
        step = np.abs(logarithm[y:, x:] - logarithm[:h, :w]) > np.log(EDGE)
        found[y // 2:y // 2 + h, x // 2:x // 2 + w] |= step & known[y:, x:] & known[:h, :w]
    return found


def edge_agreement(ours, true, known):
    """F1 of the estimate's edges against the truth's, those within REACH pixels of each other agreeing; NaN if the truth has next to none."""
    scale = EDGE_SIDE / max(known.shape)
    size = (round(known.shape[1] * scale), round(known.shape[0] * scale))
    ours, true, known = (cv2.resize(a, size, interpolation=cv2.INTER_NEAREST) for a in (np.log(ours), np.log(true), known.astype(np.uint8)))
    known, disc = known > 0, np.ones((2 * REACH + 1,) * 2, np.uint8)
    a, b = edges(ours, known), edges(true, known)
    if b.sum() < 100:
        return np.nan
    precision = (cv2.dilate(b.astype(np.uint8), disc) > 0)[a].mean() if a.any() else 0.0
    recall = (cv2.dilate(a.astype(np.uint8), disc) > 0)[b].mean()
    return 2 * precision * recall / max(precision + recall, 1e-9)


def compare(disparity, truth):
    """disparity h x w of any size, truth H x W with NaN where unknown -> dict of measures"""
    known = np.isfinite(truth) & (truth > 0)
    estimate = cv2.resize(disparity.astype(np.float64), truth.shape[::-1], interpolation=cv2.INTER_LINEAR)
    least = np.median(truth[known]) / FARTHEST
    true = np.where(known, np.maximum(truth, least), least)
    ours = np.maximum(align(estimate, true, known), least)
    x, y = ours[known], true[known]
    ratio = np.maximum(x / y, y / x)
    median = np.median(y)
    return {"delta": (ratio < 1.25).mean(), "abs_rel": np.abs(y / x - 1).mean(), "rmse": np.sqrt(np.mean((median / x - median / y) ** 2)),
            "edges": edge_agreement(ours, true, known)}
