"""Photographs, crops and augmentation. Data stays uint8 as long as possible to save time, because the
training thread also prepares the data."""
import json
import os

import cv2
import numpy as np
import torch

import masks

# Relative frequency of each source's photographs, default 1. Portraits and birds are over-represented in the data, streets and rooms rare.
SOURCE_WEIGHT = {"codrops": 0.4, "fakeprof": 0.4, "fauna": 0.6, "cid22": 1.3, "mdx": 1.3, "clic25": 1.5, "gb82": 1.5, "h5up": 1.5}
SHRUNK_MASKS = 0.25  # share of masks that are shrunk, so that a crop contains a larger part of the mask
OWN_HOLES = 0.5  # share of crops with holes behind their own surfaces, among those with known disparity
OWN_MOTION = 20, 90  # range of the parallax between disparity 1 and disparity 0 in these crops, in pixels
VALIDATION_EVERY = 32  # one in VALIDATION_EVERY photographs is held out for validation


def names_of(folder):
    names = sorted(f for f in os.listdir(folder) if f.lower().endswith((".jpg", ".jpeg", ".png")))
    if not names:
        raise SystemExit(f"{folder}: expected .jpg, .jpeg or .png files, found none")
    return names


def training_names(folder):
    return [name for i, name in enumerate(names_of(folder)) if i % VALIDATION_EVERY]


def read_folder(folder):
    """Returns [(name, H x W x 3 uint8 RGB)], sorted by name."""
    return [(n, cv2.cvtColor(cv2.imread(os.path.join(folder, n), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)) for n in names_of(folder)]


def window_of(rng, height, width, size):
    """Returns (rows, columns) of a random square to crop, at half to full resolution."""
    scale = rng.uniform(min(1.0, max(0.5, size / min(height, width))), 1.0)
    side = min(int(np.ceil(size / scale)), height, width)
    y, x = rng.integers(height - side + 1), rng.integers(width - side + 1)
    return slice(y, y + side), slice(x, x + side)


def cut(image, window, size):
    crop = image[window]
    if crop.shape[0] != size:
        crop = cv2.resize(crop, (size, size), interpolation=cv2.INTER_AREA if crop.shape[0] > size else cv2.INTER_LINEAR)
    return crop


def crop_of(rng, image, size):
    return cut(image, window_of(rng, *image.shape[:2], size), size)


def vary_color(rng, crop):
    """Applies random gamma, gain, balance and saturation, and sometimes permutes the channels, so that no hue is typical of a subject."""
    if rng.random() < 0.25:
        crop = crop[:, :, rng.permutation(3)]
    if rng.random() < 0.5:
        ramp = np.linspace(0, 1, 256)[:, None] ** rng.uniform(0.6, 1.4) * (rng.uniform(0.75, 1.1) * rng.uniform(0.9, 1.1, 3))
        table = np.clip(ramp * 255, 0, 255).astype(np.uint8)
        crop = cv2.LUT(np.ascontiguousarray(crop), table[None])
    if rng.random() < 0.3:
        s = rng.uniform(0.5, 1.6)
        gray = np.array([[0.299, 0.587, 0.114]])
        crop = cv2.transform(np.ascontiguousarray(crop), (s * np.eye(3) + (1 - s) * np.repeat(gray, 3, 0)).astype(np.float32))
    return crop


def is_of_use(labels):
    return (labels == masks.HOLE).mean() > 0.01 and (labels == masks.KNOWN).mean() > 0.1


def labels_of(rng, bank, size):
    """Returns a random part of a random mask, resized, in one of eight orientations."""
    while True:
        labels = bank[rng.integers(len(bank))]
        full = labels.shape[0]
        # masks mostly keep their scale, so that the holes have the width that expand() produces
        side = rng.integers(size, full + 1) if full > size and rng.random() < SHRUNK_MASKS else min(size, full)
        y, x = rng.integers(full - side + 1), rng.integers(full - side + 1)
        labels = labels[y:y + side, x:x + side]
        if side != size:
            labels = cv2.resize(labels, (size, size), interpolation=cv2.INTER_NEAREST)
        if is_of_use(labels):
            return np.rot90(labels[::-1] if rng.random() < 0.5 else labels, rng.integers(4))


def to_tensors(photos, labels):
    """Converts uint8 arrays B x H x W x 3 and B x H x W to (image B x 3 x H x W in [0, 1], known, exists)."""
    image = torch.from_numpy(np.ascontiguousarray(photos)).permute(0, 3, 1, 2).float().div_(255)
    labels = torch.from_numpy(np.ascontiguousarray(labels))[:, None]
    return image, (labels == masks.KNOWN).float(), (labels != masks.ABSENT).float()


def read_disparities(folder):
    """Reads {name: H x W, 0 to 1} from the output of tiefenrausch_small/prepare.py."""
    with open(os.path.join(folder, "index.json")) as file:
        entries = json.load(file)["entries"]
    values = np.memmap(os.path.join(folder, "labels.f16"), np.float16, "r")
    return {e["name"]: values[e["label_at"]:e["label_at"] + e["label_height"] * e["label_width"]].reshape(e["label_height"], e["label_width"])
            for e in entries}


class Photographs:
    """The photographs of a folder, for training and for validation.

    disparities: output folder of tiefenrausch_small/prepare.py, for holes behind the photographs' own surfaces; None: random holes only"""

    def __init__(self, folder, disparities=None):
        named, taught = read_folder(folder), set(training_names(folder))
        self.train = [image for name, image in named if name in taught]
        self.held_out = [image for name, image in named if name not in taught]
        weight = np.array([SOURCE_WEIGHT.get(name.rsplit("_", 1)[0], 1.0) for name, _ in named if name in taught])
        self.cumulative = np.cumsum(weight / weight.sum())
        found = read_disparities(disparities) if disparities else {}
        self.disparities = [found.get(os.path.splitext(name)[0]) for name, _ in named if name in taught]

    def own_labels(self, rng, pick, window, size):
        """Returns holes behind the surfaces of a photograph's crop; None if the photograph has no disparity, or the crop too few hole pixels."""
        if self.disparities[pick] is None:
            return None
        height, width = self.train[pick].shape[:2]
        disparity = cv2.resize(self.disparities[pick].astype(np.float32), (width, height), interpolation=cv2.INTER_NEAREST)[window]
        disparity = cv2.resize(disparity, (size, size), interpolation=cv2.INTER_NEAREST)
        labels = masks.covered(disparity, rng.uniform(*OWN_MOTION), rng.uniform(0, 2 * np.pi))
        return labels if is_of_use(labels) else None

    def batch(self, rng, bank, count, size):
        photos, labels = np.empty((count, size, size, 3), np.uint8), np.empty((count, size, size), np.uint8)
        for i in range(count):
            pick = min(int(np.searchsorted(self.cumulative, rng.random())), len(self.train) - 1)
            window = window_of(rng, *self.train[pick].shape[:2], size)
            own = self.own_labels(rng, pick, window, size) if rng.random() < OWN_HOLES else None
            photos[i], labels[i] = vary_color(rng, cut(self.train[pick], window, size)), labels_of(rng, bank, size) if own is None else own
            if rng.random() < 0.5:
                photos[i], labels[i] = photos[i, :, ::-1].copy(), labels[i, :, ::-1].copy()
        return to_tensors(photos, labels)

    def validation_batches(self, count, size=256, batch=8):
        """Returns the same crops and holes on every call, without augmentation."""
        rng, bank = np.random.default_rng(1), masks.bank(count, size, seed=2)
        batches = []
        for start in range(0, count, batch):
            photos = [crop_of(rng, self.held_out[i % len(self.held_out)], size) for i in range(start, min(start + batch, count))]
            batches.append(to_tensors(np.stack(photos), bank[start:start + batch]))
        return batches
