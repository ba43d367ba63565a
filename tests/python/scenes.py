"""Small photos for the tests."""
import numpy as np


def scene(height=96, width=128):
    """Returns a photo of a checkered square in front of a checkered wall, and its disparity."""
    y, x = np.mgrid[0:height, 0:width]
    near = (abs(y - height // 2) < height // 4) & (abs(x - width // 2) < width // 4)
    check = ((x // 6 + y // 6) % 2 * 100 + 50).astype(np.uint8)
    photo = np.stack([check, np.where(near, 200, check), np.where(near, check, 30)], axis=2).astype(np.uint8)
    return photo, np.where(near, 1.0, 0.2).astype(np.float32)


def layouts_of(array):
    """Returns the same values in memory layouts that callers use."""
    padded = np.zeros((array.shape[0] + 5, array.shape[1] + 7, *array.shape[2:]), array.dtype)
    padded[3:-2, 4:-3] = array
    spread = np.zeros((2 * array.shape[0], 3 * array.shape[1], *array.shape[2:]), array.dtype)
    spread[::2, ::3] = array
    shifted = np.zeros(array.nbytes + 1, np.uint8)[1:].view(array.dtype).reshape(array.shape)  # unaligned
    shifted[...] = array
    row = array.nbytes // array.shape[0]
    gaps = np.ndarray(array.shape, array.dtype, np.zeros(array.shape[0] * (row + 1), np.uint8), strides=(row + 1, *array.strides[1:]))
    gaps[...] = array
    read_only = array.copy()
    read_only.flags.writeable = False
    return {
        "contiguous": array.copy(),
        "Fortran order": np.asfortranarray(array),
        "read-only": read_only,
        "part of a larger array": padded[3:-2, 4:-3],
        "every other row and third column": spread[::2, ::3],
        "upside down": array[::-1].copy()[::-1],
        "mirrored": array[:, ::-1].copy()[:, ::-1],
        "unaligned": shifted,
        "a gap of one byte between rows": gaps,
        "subclass": array.copy().view(type("Subclass", (np.ndarray,), {})),
        "an object with __array__": type("Picture", (), {"__array__": lambda self, *_: array})(),
    }
