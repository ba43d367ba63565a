"""Photographs and their labels, once, as two large files that training maps into memory.

    python3 prepare.py --estimate PROGRAM --teacher MODEL --photos PHOTOS [--depth RGBD_FOLDER] --out FOLDER

PROGRAM is estimate.cpp compiled, MODEL the folder of the published network. The teacher sees each photograph at three sizes, each also
mirrored (see `label_of`). Photographs with measured depth (a folder with manifest.json) get that instead.
"""
import argparse
import json
import os
import time

import cv2
import numpy as np

from estimator import Estimator

LONG_SIDE = 480  # of the photographs that training reads
COARSE = (224, 288)  # long sides of the small versions
COARSE_SIGMA = 6.0  # pixels of the label: what is smoother comes from the small versions


def read_colour(path):
    return cv2.cvtColor(cv2.imread(path, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)


def shrink(photo):
    scale = LONG_SIDE / max(photo.shape[:2])
    if scale >= 1:
        return photo
    return cv2.resize(photo, (round(photo.shape[1] * scale), round(photo.shape[0] * scale)), interpolation=cv2.INTER_AREA)


def at_size(photo, side):
    """The photograph with a long side of `side`, both sides multiples of 32."""
    scale = side / max(photo.shape[:2])
    height, width = (max(32, round(n * scale / 32) * 32) for n in photo.shape[:2])
    return cv2.resize(photo, (width, height), interpolation=cv2.INTER_AREA)


def label_of(photo, teacher):
    """What the teacher says of a photograph, better than it says it at once: coarse structure from small versions, where it sees more
    of the scene at a glance, details from its own size, each the mean with that of the mirror image (so finer than 8 bits, too)."""
    def both(image, resize):
        return (teacher(image, resize) + teacher(np.ascontiguousarray(image[:, ::-1]), resize)[:, ::-1]) / 2
    fine = both(photo, True)
    coarse = np.mean([cv2.resize(both(at_size(photo, side), False), fine.shape[::-1], interpolation=cv2.INTER_LINEAR) for side in COARSE], 0)
    return fine + cv2.GaussianBlur(coarse - fine, (0, 0), COARSE_SIGMA)


def photographs(folder, teacher):
    """(name, source, photograph, log disparity)"""
    for name in sorted(os.listdir(folder)):
        photo = read_colour(os.path.join(folder, name))
        yield name, name.rsplit("_", 1)[0], shrink(photo), label_of(photo, teacher)


def read_depth(folder, entry):
    """Log disparity of a map with measured values, NaN where there is none."""
    stored = cv2.imread(os.path.join(folder, entry["map"]), cv2.IMREAD_UNCHANGED).astype(np.float64)
    stored[stored == entry["invalid"]] = np.nan
    value = np.log(stored / entry["scale"])
    return (-value if entry["kind"] == "depth" else value).astype(np.float32)


def measured(folder):
    with open(os.path.join(folder, "manifest.json")) as file:
        manifest = json.load(file)
    for entry in manifest:
        label = read_depth(folder, entry)
        label -= np.nanmedian(label)
        scale = min(1.0, 384 / max(label.shape))
        size = (round(label.shape[1] * scale), round(label.shape[0] * scale))
        yield entry["name"], "depth", shrink(read_colour(os.path.join(folder, entry["image"]))), cv2.resize(label, size, interpolation=cv2.INTER_NEAREST)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("estimate", "teacher", "photos", "out"):
        p.add_argument("--" + name, required=True)
    p.add_argument("--depth")
    a = p.parse_args()
    os.makedirs(a.out, exist_ok=True)
    entries, colour_at, label_at, start = [], 0, 0, time.time()
    with open(os.path.join(a.out, "colours.u8"), "wb") as colours, open(os.path.join(a.out, "labels.f16"), "wb") as labels:
        sources = [photographs(a.photos, Estimator(a.estimate, a.teacher))] + ([measured(a.depth)] if a.depth else [])
        for name, source, photo, label in (item for s in sources for item in s):
            entries.append({"name": name, "source": source, "height": photo.shape[0], "width": photo.shape[1], "colour_at": colour_at,
                            "label_height": label.shape[0], "label_width": label.shape[1], "label_at": label_at})
            colours.write(np.ascontiguousarray(photo).tobytes())
            labels.write(label.astype(np.float16).tobytes())
            colour_at, label_at = colour_at + photo.size, label_at + label.size
    with open(os.path.join(a.out, "index.json"), "w") as file:
        json.dump({"entries": entries}, file)
    print(f"{len(entries)} photographs in {time.time() - start:.0f} s")


if __name__ == "__main__":
    main()
