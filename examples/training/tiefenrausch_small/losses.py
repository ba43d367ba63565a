"""Losses on disparity that is known up to scale and shift, after MiDaS (Ranftl et al., TPAMI 2022), the paper's multi-scale differences
(Li and Snavely's MegaDepth), and structure-guided ranking (Xian et al., CVPR 2020)."""
import torch
from torch.nn.functional import softplus

ANCHOR = 0.1  # weight of the unaligned error. No other loss determines both scale and shift, so without it the 8-bit range would be arbitrary
MIN_SCALE, MAX_SCALE = 0.5, 2.0  # limits of the result's scale relative to the label (a crop has a smaller depth range than its photo)
SCALES = 4
PAIR_DISTANCES = 3, 6  # in pixels, along x and along y
MIN_PAIR_STEP = 0.08  # minimum step of the label between the pixels of a pair
PAIR_MARGIN = 0.7  # share of the label's step that the result must reach
PAIR_SHARPNESS = 20.0  # the loss is rounded off within about 1 / PAIR_SHARPNESS of zero, in units of disparity


def aligned_error(y, truth, known):
    """Returns the result's error, in units of the label, after fitting scale (within bounds) and shift per photograph."""
    count = known.sum((1, 2, 3), keepdim=True).clamp(min=1)
    y_mean, truth_mean = ((v * known).sum((1, 2, 3), keepdim=True) / count for v in (y, truth))
    with torch.no_grad():
        covariance = ((y - y_mean) * (truth - truth_mean) * known).sum((1, 2, 3), keepdim=True)
        variance = ((truth - truth_mean) ** 2 * known).sum((1, 2, 3), keepdim=True)
        scale = (covariance / variance.clamp(min=1e-6)).clamp(MIN_SCALE, MAX_SCALE)
    return (y - y_mean) / scale - (truth - truth_mean)


def difference_loss(error, known):
    """Returns the loss on differences of neighboring errors, at full size and at every second, fourth and eighth pixel."""
    total = 0.0
    for scale in range(SCALES):
        e, k = error[:, :, ::2 ** scale, ::2 ** scale], known[:, :, ::2 ** scale, ::2 ** scale]
        for dim in (2, 3):
            n = e.shape[dim] - 1
            both = k.narrow(dim, 0, n) * k.narrow(dim, 1, n)
            total = total + ((e.narrow(dim, 1, n) - e.narrow(dim, 0, n)).abs() * both).sum() / both.sum().clamp(min=1)
    return total


def ranking_loss(y, truth, known):
    """Returns the loss on pairs of pixels on both sides of a step of the label: the missing part of the step, rounded off at zero."""
    total, count = 0.0, 0.0
    for distance in PAIR_DISTANCES:
        for dim in (2, 3):
            n = y.shape[dim] - distance
            step, found = (v.narrow(dim, distance, n) - v.narrow(dim, 0, n) for v in (truth, y))
            both = known.narrow(dim, distance, n) * known.narrow(dim, 0, n) * (step.abs() > MIN_PAIR_STEP)
            missing = PAIR_MARGIN * step.abs() - step.sign() * found
            total = total + (softplus(PAIR_SHARPNESS * missing) / PAIR_SHARPNESS * both).sum()
            count = count + both.sum()
    return total / count.clamp(min=1)


def losses(y, truth, known, gradient=0.5, rank=0.0):
    """Returns the terms of the loss, each a scalar.

    y, truth, known  B x 1 x H x W; known is 1 where there is truth, else 0
    gradient, rank   weights of the losses on differences and on pairs"""
    error = aligned_error(y, truth, known)
    pixels = known.sum().clamp(min=1)
    terms = {"data": (error.abs() * known).sum() / pixels, "gradient": gradient * difference_loss(error, known),
             "anchor": ANCHOR * ((y - truth).abs() * known).sum() / pixels}
    if rank > 0:
        terms["rank"] = rank * ranking_loss(y, truth, known)
    return terms
