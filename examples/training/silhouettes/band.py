"""The band beside sharp steps of disparity, and the network's inputs in the band. Training, evaluation and the library share this definition,
which README.md describes."""
import subprocess

import cv2
import numpy as np

MAX_STEP = 0.02      # maximum step of disparity between neighbors on one surface
MIN_STEP = 0.06      # minimum step between front and back for a band
SIDES_RADIUS = 4     # front and back are the extremes within this distance of a curve, in pixels
BAND_RADIUS = 12     # maximum distance from a curve at which alpha is defined, in pixels
REGION_RADIUS = 16   # maximum distance from a curve at which the network computes, in pixels
CHANNELS = 8


def disk(radius):
    y, x = np.mgrid[-radius:radius + 1, -radius:radius + 1]
    return (y * y + x * x <= radius * radius + radius).astype(np.uint8)


class Depth:
    """The library's depth stages (depth.cpp, compiled)."""

    def __init__(self, program, student):
        self.process = subprocess.Popen([program, student], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def read(self, dtype, *shape):
        size = np.dtype(dtype).itemsize * int(np.prod(shape))
        data = self.process.stdout.read(size)
        if len(data) != size:
            raise SystemExit("depth: expected a result, found the end of the output")
        return np.frombuffer(data, dtype).reshape(shape)

    def __call__(self, photo, given=None):
        """photo: H x W x 3 uint8, red first; given: a disparity map, or None to estimate one. Returns (the given or estimated map; the map
        sharpened and resampled; the same after the weighted median; the same after alignment), the last three H x W."""
        height, width = photo.shape[:2]
        rows, columns = (0, 0) if given is None else given.shape
        message = np.array([height, width, rows, columns], "<i4").tobytes() + np.ascontiguousarray(photo).tobytes()
        if given is not None:
            message += np.ascontiguousarray(given, "<f4").tobytes()
        self.process.stdin.write(message)
        self.process.stdin.flush()
        estimated = self.read("<f4", *self.read("<i4", 2))
        return (estimated, *(self.read("<f4", height, width) for _ in range(3)))


class Band:
    """The pixels of a photo beside silhouettes. The network assigns each of them to the front or the back.

    distance   H x W, pixels to the nearest curve, 0 on it
    front, back  H x W, disparity of the two sides of the nearest curve
    at         H x W, flat index of the nearest pixel of a curve
    """

    def __init__(self, prepared):
        """prepared: disparity after resampling and the weighted median, H x W"""
        step_x = np.abs(np.diff(prepared, axis=1)) > MAX_STEP
        step_y = np.abs(np.diff(prepared, axis=0)) > MAX_STEP
        curve = np.zeros(prepared.shape, bool)
        curve[:, 1:] |= step_x
        curve[:, :-1] |= step_x
        curve[1:] |= step_y
        curve[:-1] |= step_y
        high = cv2.dilate(prepared, disk(SIDES_RADIUS), borderType=cv2.BORDER_REPLICATE)
        low = cv2.erode(prepared, disk(SIDES_RADIUS), borderType=cv2.BORDER_REPLICATE)
        curve &= high - low >= MIN_STEP
        self.curve, self.prepared = curve, prepared
        if not curve.any():
            self.distance, self.at = np.full(prepared.shape, np.float32(1e6)), np.zeros(prepared.shape, np.int64)
        else:
            self.distance, labels = cv2.distanceTransformWithLabels((~curve).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL)
            index = np.zeros(labels.max() + 1, np.int64)
            index[labels[curve]] = np.flatnonzero(curve)
            self.at = index[labels]
        self.front, self.back = high.reshape(-1)[self.at], low.reshape(-1)[self.at]
        self.band, self.region = self.distance <= BAND_RADIUS, self.distance <= REGION_RADIUS

    def share(self, disparity):
        """Returns the position of a disparity map between back (0) and front (1), H x W, not clamped."""
        return (disparity - self.back) / np.maximum(self.front - self.back, MIN_STEP)

    def features(self, photo, estimated):
        """Returns CHANNELS x H x W in [-1, 1], 0 outside the region: red, green, blue; share of the front by the estimate and by the prepared
        map; the step's height; signed distance to the curve, positive in front; pixels per sample of the estimate."""
        height, width = self.prepared.shape
        smooth = cv2.resize(estimated, (width, height), interpolation=cv2.INTER_LINEAR)
        x = np.empty((CHANNELS, height, width), np.float32)
        x[:3] = photo.transpose(2, 0, 1) / np.float32(127.5) - 1
        prepared = self.share(self.prepared)
        x[3] = np.clip(self.share(smooth), -0.5, 1.5) - 0.5
        x[4] = np.clip(prepared, -0.5, 1.5) - 0.5
        x[5] = 4 * np.clip(self.front - self.back, 0, 0.5) - 1
        x[6] = np.where(prepared > 0.5, 1, -1) * np.minimum(self.distance / REGION_RADIUS, 1)
        x[7] = min(width / estimated.shape[1], 8) / 4 - 1
        return x * self.region


def quantized(x):
    """Converts [-1, 1] to 8 bits; 0 is 128."""
    return np.clip(np.rint(x * 127) + 128, 0, 255).astype(np.uint8)
