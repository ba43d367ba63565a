"""Computes one label per photograph from the estimates of several networks."""
import cv2
import numpy as np

LAYOUT, DETAIL = ("192", "256"), "384"  # short sides at which the teacher estimates layout (first two) and edges (last)
COARSE_SIGMA = 6.0  # in pixels of the label; coarser structures come from the layout
AGREEMENT = 0.8  # minimum correlation between the teacher's estimates at its smallest and largest size; the label ignores teachers below it
FAR, OPEN = -1.2, 0.1  # maximum log disparity of the sky in the published network's estimates; minimum share of such pixels in a landscape
SNAP_RADIUS, SNAP_ROUNDS = 9, 2  # parameters of the weighted median that moves steps to color edges
LOW, HIGH = 0.5, 99.5  # percentiles of a label that are scaled to the two values of NEAR_FAR
NEAR_FAR = 0.05, 1.0  # disparity of far and of near surfaces in a label


def standardized(disparity):
    """Shifts and scales a map to a median of 0 and a mean absolute deviation of 1."""
    centered = disparity - np.median(disparity)
    return centered / (np.abs(centered).mean() + 1e-6)


def fitted(disparity, to):
    """Returns a * disparity + b, fitted to another map by least squares."""
    centered = disparity - disparity.mean()
    return centered * (centered * (to - to.mean())).mean() / ((centered ** 2).mean() + 1e-9) + to.mean()


def merged(sizes):
    """Combines the teacher's estimates of one photograph: layout from the small sizes, detail from the large one.

    sizes  {short side: disparity H x W}; returns H x W, standardized"""
    layout = np.mean([standardized(sizes[side]) for side in LAYOUT], 0)
    detail = fitted(sizes[DETAIL], layout)
    return detail + cv2.GaussianBlur(layout - detail, (0, 0), COARSE_SIGMA)


def chosen(teacher, published):
    """Returns the teacher's estimate, or the published network's if the teacher contradicts itself (patterned walls, ornate rooms, naves), or
    the mean of both in open landscapes, where the published network separates trees, roofs and mountains from the sky.

    teacher    {short side: disparity}
    published  {long side: log disparity}; returns H x W, standardized"""
    layout = (published["224"] + published["288"]) / 2
    other = standardized(np.exp(published["384"] + cv2.GaussianBlur(layout - published["384"], (0, 0), COARSE_SIGMA)))
    if np.corrcoef(teacher[LAYOUT[0]].ravel(), teacher[DETAIL].ravel())[0, 1] < AGREEMENT:
        return other
    if (published["384"] < FAR).mean() > OPEN:
        return (merged(teacher) + other) / 2
    return merged(teacher)


def snapped(disparity, photo):
    """Moves steps of disparity to color edges by a median that weights each neighbor by color similarity.

    photo H x W x 3 uint8. Keeps values that the median would change by no more than 8-bit rounding does."""
    for _ in range(SNAP_ROUNDS):
        low, high = disparity.min(), disparity.max()
        levels = (disparity - low) / max(high - low, 1e-6) * 255
        median = cv2.ximgproc.weightedMedianFilter(photo, levels.astype(np.uint8), SNAP_RADIUS, 25.5, cv2.ximgproc.WMF_EXP)
        change = median - levels
        disparity = disparity + np.where(np.abs(change) > 1.5, change, 0) * ((high - low) / 255)
    return disparity


def in_range(disparity):
    """Scales and shifts a map so that nearly all values lie in NEAR_FAR; NaN stays NaN."""
    low, high = np.nanpercentile(disparity, (LOW, HIGH))
    far, near = NEAR_FAR
    return np.clip(far + (disparity - low) * ((near - far) / max(high - low, 1e-6)), 0, 1.25)
