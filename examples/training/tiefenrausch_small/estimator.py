"""Estimates disparity with the library (the compiled estimate.cpp)."""
import subprocess

import numpy as np


class Estimator:
    """program: compiled estimate.cpp; model: weights"""

    def __init__(self, program, model):
        self.process = subprocess.Popen([program, model], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def read(self, dtype, count):
        size = np.dtype(dtype).itemsize * count
        data = self.process.stdout.read(size)
        if len(data) != size:
            raise SystemExit("estimate: expected a result, found the end of the output")
        return np.frombuffer(data, dtype)

    def both(self, photo, resize=True):
        """photo: H x W x 3 uint8. Returns (the network's raw output H' x W' uint8, disparity H' x W' float32). Without `resize`, the
        network processes the photo at its own size: H and W must be multiples of 32, and H' x W' is H x W."""
        self.process.stdin.write(np.array([*photo.shape[:2], resize], "<i4").tobytes() + np.ascontiguousarray(photo).tobytes())
        self.process.stdin.flush()
        height, width = self.read("<i4", 2)
        levels, disparity = self.read(np.uint8, height * width), self.read("<f4", height * width)
        return levels.reshape(height, width), disparity.reshape(height, width)

    def __call__(self, photo, resize=True):
        return self.both(photo, resize)[1]
