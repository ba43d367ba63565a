"""Memory-mapped photographs and labels, crops, pasted foregrounds, and augmentation."""
import json
import os
import queue
import threading

import cv2
import numpy as np
import torch

import shapes

# Relative frequency of each source's photographs, default 1. Portraits and birds are over-represented in the data, streets and rooms rare.
SOURCE_WEIGHT = {"codrops": 0.5, "fakeprof": 0.5, "fauna": 0.5, "cid22": 1.3, "mdx": 1.3, "clic25": 1.5, "gb82": 1.5, "h5up": 1.5,
                 "depth": 2.0, "scene": 0.5}  # "depth": photographs with measured depth; "scene": ray-cast scenes
VALIDATION_EVERY = 32  # one in VALIDATION_EVERY photographs is held out for validation
PASTED = 0.45  # share of the crops with a pasted foreground
WHOLE = ((288, 384), (384, 288), (256, 384), (384, 256), (224, 384), (384, 224), (320, 384), (384, 192))  # input shapes that the library uses
GRAY = np.array([0.299, 0.587, 0.114], np.float32)


class Library:
    """Output of prepare.py: photographs (uint8), disparities (float16, 0 to 1, NaN where unknown) and masks of objects to cut out (uint8), of
    different sizes."""

    def __init__(self, folder):
        with open(os.path.join(folder, "index.json")) as file:
            self.entries = json.load(file)["entries"]
        self.colors = np.memmap(os.path.join(folder, "colours.u8"), np.uint8, "r")
        self.labels = np.memmap(os.path.join(folder, "labels.f16"), np.float16, "r")
        self.fronts = np.memmap(os.path.join(folder, "fronts.u8"), np.uint8, "r")

    def photograph(self, entry):
        height, width, at = entry["height"], entry["width"], entry["colour_at"]
        return self.colors[at:at + height * width * 3].reshape(height, width, 3)

    def of_label(self, values, entry):
        height, width, at = entry["label_height"], entry["label_width"], entry["label_at"]
        return values[at:at + height * width].reshape(height, width)

    def label(self, entry):
        return self.of_label(self.labels, entry)

    def front(self, entry):
        """Returns the mask of an object to cut out (a person, an animal, a vehicle or other), 1 inside."""
        return self.of_label(self.fronts, entry)


def view_of(rng, height, width, out_height, out_width, least):
    """Returns a random part (top, left, height, width) of a photograph, in fractions of the photograph's sides. The part's aspect ratio
    differs from the crop's by at most 20 %. The part's sides are at least `least` times those of the largest part with this aspect
    ratio."""
    aspect = out_width / out_height * np.exp(rng.uniform(-0.18, 0.18)) * height / width  # fractions of the sides
    h, w = (1.0, aspect) if aspect <= 1 else (1 / aspect, 1.0)
    zoom = rng.uniform(least, 1.0)
    h, w = h * zoom, w * zoom
    return rng.uniform(0, 1 - h), rng.uniform(0, 1 - w), h, w


def cut(image, view, size, interpolation):
    """Crops a view from an image and resizes it to `size` (height, width)."""
    height, width = image.shape[:2]
    top, left = int(view[0] * height + 0.5), int(view[1] * width + 0.5)
    bottom = min(height, max(top + 1, int((view[0] + view[2]) * height + 0.5)))
    right = min(width, max(left + 1, int((view[1] + view[3]) * width + 0.5)))
    return cv2.resize(image[top:bottom, left:right], size[::-1], interpolation=interpolation)


def vary_color(rng, image):
    """Applies the paper's variations (gamma, contrast, saturation, hue), then defects of poor cameras: exposure, color cast, noise, blur, JPEG."""
    ramp = np.linspace(0, 1, 256, dtype=np.float32)[:, None] ** rng.uniform(0.6, 1.4)
    if rng.random() < 0.4:
        ramp = ramp * np.exp(rng.uniform(-0.9, 0.6))  # darker, or brighter with clipped highlights
    if rng.random() < 0.3:
        ramp = ramp * np.exp(rng.uniform(-0.12, 0.12, 3))
    image = cv2.LUT(image, np.clip(np.broadcast_to(ramp, (256, 3)) * 255 + 0.5, 0, 255).astype(np.uint8)[None])
    contrast, saturation, hue = rng.uniform(0.6, 1), rng.uniform(0.6, 1), np.deg2rad(rng.uniform(-25, 25))
    if rng.random() < 0.04:
        saturation = 0.0
    # one matrix that rotates hue about the gray axis, scales saturation toward luma, and scales contrast toward middle gray
    c, s = np.cos(hue), np.sin(hue) / np.sqrt(3)
    turn = c * np.eye(3) + (1 - c) / 3 + s * np.array([[0, -1, 1], [1, 0, -1], [-1, 1, 0]])
    matrix = contrast * (saturation * np.eye(3) + (1 - saturation) * np.repeat(GRAY[None], 3, 0)) @ turn
    matrix = np.concatenate([matrix, np.full((3, 1), 127.5 * (1 - contrast))], 1).astype(np.float32)
    image = cv2.transform(image, matrix)
    if rng.random() < 0.15:
        image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.4, 1.4))
    if rng.random() < 0.3:
        noise = np.empty(image.shape, np.int16)
        cv2.randn(noise, 0, rng.uniform(2, 22))
        image = np.clip(image + noise, 0, 255).astype(np.uint8)
    if rng.random() < 0.15:
        image = cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(15, 80))])[1], cv2.IMREAD_COLOR)
    return image


def to_tensors(photos, labels):
    """Converts numpy arrays to (color B x 3 x H x W in [0, 1], disparity B x 1 x H x W with 0 where unknown, weight 1 where known)."""
    color = torch.from_numpy(photos).permute(0, 3, 1, 2).float().div_(255).contiguous(memory_format=torch.channels_last)
    label = torch.from_numpy(labels)[:, None]
    known = (~torch.isnan(label)).float()
    return color, torch.nan_to_num(label), known


class Photographs:
    """Crops for training and for validation, from an output folder of prepare.py."""

    def __init__(self, folder):
        self.library = Library(folder)
        photos = [e for e in self.library.entries]
        plain = [e for e in photos if e["source"] not in ("depth", "scene")]
        self.held_out = plain[::VALIDATION_EVERY]
        skip = {e["name"] for e in self.held_out}
        self.train = [e for e in photos if e["name"] not in skip]
        self.with_front = [e for e in self.train if e["front"]]
        weight = np.array([SOURCE_WEIGHT.get(e["source"], 1.0) for e in self.train])
        self.cumulative = np.cumsum(weight / weight.sum())

    def draw(self, rng):
        return self.train[min(int(np.searchsorted(self.cumulative, rng.random())), len(self.train) - 1)]

    def cutting(self, rng):
        """Returns a foreground to paste: (color h x w x 3 uint8; disparity h x w; opacity h x w, 0 to 1)."""
        if self.with_front and rng.random() < 0.6:
            entry = self.with_front[rng.integers(len(self.with_front))]
            front = self.library.front(entry)
            rows, columns = np.flatnonzero(front.any(1)), np.flatnonzero(front.any(0))
            box = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
            label = np.nan_to_num(self.library.label(entry)[box].astype(np.float32), nan=0.5)
            whole = cv2.resize(self.library.photograph(entry), front.shape[::-1], interpolation=cv2.INTER_AREA)
            return whole[box], label, front[box].astype(np.float32)
        entry = self.draw(rng)
        photo = self.library.photograph(entry)
        size = (int(rng.integers(96, 288)), int(rng.integers(96, 288)))
        view = view_of(rng, *photo.shape[:2], *size, 0.2)
        return cut(photo, view, size, cv2.INTER_AREA), shapes.relief(rng, size), shapes.outline(rng, size)

    def sample(self, rng, size):
        entry = self.draw(rng)
        photo, label = self.library.photograph(entry), self.library.label(entry)
        # The sides of a crop are at least half those of the largest crop that fits into the photograph.
        view = view_of(rng, *photo.shape[:2], *size, 0.5)
        color = cut(photo, view, size, (cv2.INTER_AREA, cv2.INTER_LINEAR, cv2.INTER_NEAREST)[rng.choice(3, p=(0.6, 0.2, 0.2))])
        truth = cut(label.astype(np.float32), view, size, cv2.INTER_NEAREST)
        if rng.random() < 0.5:
            color, truth = color[:, ::-1], truth[:, ::-1]
        color, truth = np.ascontiguousarray(color), np.ascontiguousarray(truth)
        if rng.random() < PASTED:
            for _ in range(int(rng.integers(1, 4))):
                shapes.paste(rng, color, truth, *self.cutting(rng))
        return vary_color(rng, color), truth

    def batch(self, rng, count, size):
        """size  (height, width) of the crops"""
        colors, truths = np.empty((count, *size, 3), np.uint8), np.empty((count, *size), np.float32)
        for i in range(count):
            colors[i], truths[i] = self.sample(rng, size)
        return to_tensors(colors, truths)

    def calibration(self, rng):
        """Returns batches of colors in the shapes of whole photographs, to measure the ranges of 8-bit tensors."""
        return [self.batch(rng, 4, shape)[0] for shape in WHOLE for _ in range(2)]

    def validation_batches(self, size):
        """Returns held-out photographs without augmentation, resized regardless of aspect ratio, in batches of up to 8."""
        batches = []
        for start in range(0, len(self.held_out), 8):
            entries = self.held_out[start:start + 8]
            colors = np.stack([cut(self.library.photograph(e), (0, 0, 1, 1), size, cv2.INTER_AREA) for e in entries])
            truths = np.stack([cut(self.library.label(e).astype(np.float32), (0, 0, 1, 1), size, cv2.INTER_NEAREST) for e in entries])
            batches.append(to_tensors(colors, truths))
        return batches


class Ahead:
    """Prepares batches in a separate thread, a few steps before training needs them."""

    def __init__(self, photographs, seed):
        self.photographs, self.rng = photographs, np.random.default_rng(seed)
        self.wanted, self.made = queue.Queue(), queue.Queue()
        threading.Thread(target=self.work, daemon=True).start()

    def work(self):
        while True:
            try:
                self.made.put(self.photographs.batch(self.rng, *self.wanted.get()))
            except Exception as failure:
                self.made.put(failure)

    def want(self, count, size):
        self.wanted.put((count, size))

    def next(self):
        made = self.made.get()
        if isinstance(made, Exception):
            raise made
        return made
