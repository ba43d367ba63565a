"""Asks the library (estimate.cpp, compiled) for log disparity."""
import subprocess

import numpy as np


class Estimator:
    """program: estimate.cpp compiled; model: what that program is to load."""

    def __init__(self, program, model):
        self.process = subprocess.Popen([program, model], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def read(self, dtype, count):
        size = np.dtype(dtype).itemsize * count
        data = self.process.stdout.read(size)
        if len(data) != size:
            raise SystemExit("the program that runs the network ended")
        return np.frombuffer(data, dtype)

    def levels(self, photo, resize=True):
        """photo H x W x 3 uint8 -> (H' x W' uint8, scale, zero point); without `resize`, the size is H x W, multiples of 32"""
        self.process.stdin.write(np.array([*photo.shape[:2], resize], "<i4").tobytes() + np.ascontiguousarray(photo).tobytes())
        self.process.stdin.flush()
        height, width = self.read("<i4", 2)
        scale, zero_point = self.read("<f4", 1)[0], self.read("<i4", 1)[0]
        return self.read(np.uint8, height * width).reshape(height, width), scale, zero_point

    def __call__(self, photo, resize=True):
        """photo H x W x 3 uint8 -> log disparity H' x W' float32"""
        levels, scale, zero_point = self.levels(photo, resize)
        return (levels.astype(np.float32) - zero_point) * scale
