"""Compares a disparity map with measured depth, up to scale and shift of disparity, as MiDaS does."""
import json
import os
import re

import cv2
import numpy as np

FARTHEST = 20.0  # in median distances; larger distances are clamped, in the truth and in the estimate
EDGE_SIDE = 384  # long side at which edges are detected
REACH = 4  # distance in pixels between the two values that form an edge, which may be blurred; also the maximum distance of matching edges
EDGE = 1.15  # minimum ratio of disparities across an edge


def read_pairs(folder):
    """Yields (name, photograph H x W x 3 uint8 RGB, disparity H x W float64 with NaN where unknown) in the manifest's order."""
    with open(os.path.join(folder, "manifest.json")) as file:
        manifest = json.load(file)
    for entry in manifest:
        photo = cv2.cvtColor(cv2.imread(os.path.join(folder, entry["image"]), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
        stored = cv2.imread(os.path.join(folder, entry["map"]), cv2.IMREAD_UNCHANGED).astype(np.float64)
        value = np.where(stored == entry["invalid"], np.nan, stored / entry["scale"])
        offset = re.search(r"disparity \+ ([0-9.]+)", entry["note"])  # disparity that cropping the pictures has subtracted
        disparity = 1 / value if entry["kind"] == "depth" else value + (float(offset[1]) if offset else 0.0)
        yield entry["name"], photo, disparity


def network_size(photo):
    """Resizes a photograph to the input of the library's networks: long side 384, both sides rounded down to multiples of 32."""
    longer = max(photo.shape[:2])
    height, width = (max(32, n * 384 // longer // 32 * 32) for n in photo.shape[:2])
    return cv2.resize(photo, (width, height), interpolation=cv2.INTER_AREA)


def align(estimate, truth, known):
    """Returns a * estimate + b with the minimum squared error where known."""
    x, y = estimate[known], truth[known]
    a, b = np.polyfit(x, y, 1) if x.std() > 0 else (0.0, y.mean())
    return a * estimate + b


def edges(logarithm, known):
    """Returns a mask of the edges: places where two known pixels, REACH apart in a row or column, differ by more than a factor of EDGE."""
    found = np.zeros(known.shape, bool)
    for y, x in ((0, REACH), (REACH, 0)):
        h, w = known.shape[0] - y, known.shape[1] - x
        step = np.abs(logarithm[y:, x:] - logarithm[:h, :w]) > np.log(EDGE)
        found[y // 2:y // 2 + h, x // 2:x // 2 + w] |= step & known[y:, x:] & known[:h, :w]
    return found


def at_edge_side(ours, true, known):
    scale = EDGE_SIDE / max(known.shape)
    size = (round(known.shape[1] * scale), round(known.shape[0] * scale))
    ours, true, known = (cv2.resize(a, size, interpolation=cv2.INTER_NEAREST) for a in (ours, true, known.astype(np.uint8)))
    return ours, true, known > 0


def edge_agreement(ours, true, known):
    """Returns the F1 of the estimate's edges. Two edges match if they are within REACH pixels of each other. NaN if the truth has almost no
    edges."""
    ours, true, known = at_edge_side(ours, true, known)
    disc = np.ones((2 * REACH + 1,) * 2, np.uint8)
    a, b = edges(np.log(ours), known), edges(np.log(true), known)
    if b.sum() < 100:
        return np.nan
    precision = (cv2.dilate(b.astype(np.uint8), disc) > 0)[a].mean() if a.any() else 0.0
    recall = (cv2.dilate(a.astype(np.uint8), disc) > 0)[b].mean()
    return 2 * precision * recall / max(precision + recall, 1e-9)


def boundary_agreement(ours, true, known):
    """Returns the scale-invariant boundary F1 of Depth Pro (Bochkovskii et al., 2024): a boundary is a pixel nearer than its neighbor by more
    than a ratio. The result is the mean over ratios from 1.05 to 1.25, weighted by the ratio."""
    ratios, found = np.linspace(1.05, 1.25, 10), []
    for ratio in ratios:
        precision = recall = 0.0
        for axis in (0, 1):
            before, after = [slice(None)] * 2, [slice(None)] * 2
            before[axis], after[axis] = slice(None, -1), slice(1, None)
            before, after = tuple(before), tuple(after)
            both_known = known[before] & known[after]
            for one, other in ((before, after), (after, before)):
                a, b = ((m[one] > ratio * m[other]) & both_known for m in (ours, true))
                precision += (a & b).sum() / max(a.sum(), 1) / 4
                recall += (a & b).sum() / max(b.sum(), 1) / 4
        found.append(2 * precision * recall / (precision + recall) if precision + recall > 0 else 0.0)
    return float(np.average(found, weights=ratios))


def wrong_order(ours, true, known):
    """Returns the share of pixel pairs in wrong order, among 20,000 random pairs whose true distances differ by a fifth or more (the measure of
    DA-2K, Yang et al., "Depth Anything V2", 2024, on measured depth)."""
    x, y = ours[known], true[known]
    a, b = np.random.default_rng(1).integers(0, len(x), (2, 20000))
    ratio = y[a] / y[b]
    clear = (ratio >= 1.2) | (ratio <= 1 / 1.2)
    return float(((ratio > 1) != (x[a] > x[b]))[clear].mean()) if clear.sum() >= 100 else np.nan


def separation(disparity, mask):
    """Returns the difference in disparity between a mask and the ring around it, as a share of the photograph's range (2nd to 98th percentile)."""
    reach = max(3, round(max(mask.shape) / 50))
    grown, shrunk = (way(mask.astype(np.uint8), np.ones((2 * reach + 1,) * 2, np.uint8)) > 0 for way in (cv2.dilate, cv2.erode))
    wide = cv2.dilate(mask.astype(np.uint8), np.ones((6 * reach + 1,) * 2, np.uint8)) > 0
    low, high = np.percentile(disparity, (2, 98))
    ring = wide & ~grown  # the mask's outline is inexact by a few pixels
    if not shrunk.any() or not ring.any():
        return np.nan
    return float((np.median(disparity[shrunk]) - np.median(disparity[ring])) / max(high - low, 1e-9))


def compare(disparity, truth):
    """disparity: h x w, of any size; truth: disparity H x W, NaN where unknown. Returns {measure: value}."""
    known = np.isfinite(truth) & (truth > 0)
    estimate = cv2.resize(disparity.astype(np.float64), truth.shape[::-1], interpolation=cv2.INTER_LINEAR)
    least = np.median(truth[known]) / FARTHEST
    true = np.where(known, np.maximum(truth, least), least)
    ours = np.maximum(align(estimate, true, known), least)
    x, y = ours[known], true[known]
    ratio = np.maximum(x / y, y / x)
    median = np.median(y)
    return {"delta": (ratio < 1.25).mean(), "abs_rel": np.abs(y / x - 1).mean(), "rmse": np.sqrt(np.mean((median / x - median / y) ** 2)),
            "edges": edge_agreement(ours, true, known), "boundaries": boundary_agreement(*at_edge_side(ours, true, known)),
            "order": wrong_order(ours, true, known)}
