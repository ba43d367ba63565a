"""Computes one label per photograph from the estimates of several networks."""
import cv2
import numpy as np
from scipy import ndimage

LAYOUT, DETAIL = ("192", "256"), "384"  # short sides at which the teacher estimates layout (first two) and edges (last)
COARSE_SIGMA = 6.0  # in pixels of the label; coarser structures come from the layout
AGREEMENT = 0.8  # minimum correlation between the teacher's estimates at its smallest and largest size; the label ignores teachers below it
FAR, OPEN = -1.2, 0.1  # maximum log disparity of the sky in the published network's estimates; minimum share of such pixels in a landscape
SNAP_RADIUS, SNAP_ROUNDS = 9, 2  # parameters of the weighted median that moves steps to color edges
STUDENT_SIGMA = 24.0  # in pixels of the label; coarser structures come from an earlier student, if there is one
OBJECT_BAND, SKY_BAND = 9, 6  # distance from a mask's border, in pixels, at which the depth of either side is measured
OBJECT_STEP = 0.1  # minimum step at the border of an object, as a share of the label's range
MIN_SIDE = 200  # minimum number of pixels on each side of a mask's border, beyond the band
MIN_SKY, MIN_SKY_ABOVE = 0.05, 0.3  # minimum share of sky in the photograph, and in its first three rows
FARTHEST_SKY = 20  # percentile of disparity below which the median of the sky must be
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


def with_layout_of(student, disparity):
    """Keeps the details of a label, and replaces its layout with that of an earlier student, both H x W."""
    detail = fitted(disparity, student)
    return detail + cv2.GaussianBlur(student - detail, (0, 0), STUDENT_SIGMA)


def nearest(values, source):
    """Returns for each pixel the value at the nearest pixel of the mask `source`."""
    at = ndimage.distance_transform_edt(~source, return_distances=False, return_indices=True)
    return values[at[0], at[1]]


def moved_to_border(disparity, inside, band, step):
    """Moves a step of disparity to the border of a mask. Near the border, each pixel takes the disparity of its own side, measured beyond
    a band of `band` pixels, where the inside is nearer than the outside by more than `step`."""
    window = np.ones((2 * band + 1,) * 2, np.uint8)
    core = cv2.erode(inside.astype(np.uint8), window) > 0
    far = cv2.dilate(inside.astype(np.uint8), window) == 0
    if min(core.sum(), far.sum()) < MIN_SIDE:
        return disparity
    front, back = (cv2.GaussianBlur(nearest(disparity, side), (0, 0), 2) for side in (core, far))
    return np.where(~core & ~far & (front - back > step), np.where(inside, front, back), disparity)


def masked(disparity, salient, sky):
    """Moves steps to the borders of salient objects and of the sky. Ignores a mask of the sky that is small, does not touch the upper border,
    or whose median is not among the farthest fifth of all pixels.

    salient, sky  H x W, 0 to 255"""
    low, high = np.percentile(disparity, (2, 98))
    result = moved_to_border((disparity - low) / max(high - low, 1e-6), salient > 127, OBJECT_BAND, OBJECT_STEP)
    is_sky = sky > 127
    if (is_sky.mean() > MIN_SKY and is_sky[:3].mean() > MIN_SKY_ABOVE
            and np.median(result[is_sky]) <= np.percentile(result, FARTHEST_SKY)):
        result = moved_to_border(result, ~is_sky, SKY_BAND, 0.0)
    return result * max(high - low, 1e-6) + low


def in_range(disparity):
    """Scales and shifts a map so that nearly all values lie in NEAR_FAR; NaN stays NaN."""
    low, high = np.nanpercentile(disparity, (LOW, HIGH))
    far, near = NEAR_FAR
    return np.clip(far + (disparity - low) * ((near - far) / max(high - low, 1e-6)), 0, 1.25)
