"""The paper's losses (after Li and Snavely's MegaDepth), on log disparity."""

ANCHOR = 0.1  # how much of a constant error counts: 0 would leave the 8-bit output's range to chance
GRADIENT_WEIGHT = 1.0
SCALES = 4


def data_loss(error, known):
    """Scale-invariant: the variance of the error over each photograph (a factor of disparity is a shift of its logarithm)."""
    count = known.sum((1, 2, 3)).clamp(min=1)
    mean = (error * known).sum((1, 2, 3)) / count
    return ((error ** 2 * known).sum((1, 2, 3)) / count - (1 - ANCHOR) * mean ** 2).mean()


def gradient_loss(error, known):
    """Multi-scale: differences of neighbouring errors, at full size and at every second, fourth and eighth pixel."""
    total = 0.0
    for scale in range(SCALES):
        e, k = error[:, :, ::2 ** scale, ::2 ** scale], known[:, :, ::2 ** scale, ::2 ** scale]
        for dim in (2, 3):
            n = e.shape[dim] - 1
            both = k.narrow(dim, 0, n) * k.narrow(dim, 1, n)
            total = total + ((e.narrow(dim, 1, n) - e.narrow(dim, 0, n)).abs() * both).sum() / both.sum().clamp(min=1)
    return total


def losses(y, truth, known):
    error = y - truth
    return {"data": data_loss(error, known), "gradient": GRADIENT_WEIGHT * gradient_loss(error, known)}
