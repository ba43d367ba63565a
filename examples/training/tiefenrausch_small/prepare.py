"""Writes photographs and their labels to large files, which training maps into memory.

    python3 prepare.py --photos PHOTOS --raw RAW [--depth RGBD_FOLDER]... --out FOLDER

RAW is the output of teachers.py for PHOTOS; its folders student, borders and masks are optional. For photographs with depth (--depth,
folders with manifest.json), the label is that depth.
"""
import argparse
import functools
import json
import multiprocessing
import os
import time

import cv2
import numpy as np

import labels
import metrics

LONG_SIDE = 480  # long side of the photographs that training reads
LABEL_SIDE = 384
MIN_FRONT, MAX_FRONT = 0.02, 0.6  # range of an object's share of the photograph


def read_color(path):
    return cv2.cvtColor(cv2.imread(path, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)


def shrink(photo, side):
    scale = side / max(photo.shape[:2])
    if scale >= 1:
        return photo
    return cv2.resize(photo, (round(photo.shape[1] * scale), round(photo.shape[0] * scale)), interpolation=cv2.INTER_AREA)


def file_of(raw, which, name):
    return os.path.join(raw, which, name + ".npz")


def exists(raw, which, name):
    return os.path.exists(file_of(raw, which, name))


def stored(raw, which, name):
    with np.load(file_of(raw, which, name)) as file:
        return {key: file[key].astype(np.float32) for key in file}


def front_of(classes, label):
    """Returns the mask of an object to cut out: the largest connected component of all object pixels if it is nearer than its surroundings
    and neither too small nor too large, else an empty mask."""
    front = (classes > 0).astype(np.uint8)
    count, pieces, stats, _ = cv2.connectedComponentsWithStats(front)
    if count < 2:
        return np.zeros_like(front)
    piece = 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
    front = (pieces == piece).astype(np.uint8)
    ring = cv2.dilate(front, np.ones((15, 15), np.uint8)) - front
    share = front.mean()
    if not MIN_FRONT < share < MAX_FRONT or ring.sum() == 0 or np.median(label[front > 0]) < np.median(label[ring > 0]) + 0.04:
        return np.zeros_like(front)
    return front


def labeled(path, raw):
    """Returns (name, source, photograph, disparity, mask of an object to cut out)."""
    name, photo = os.path.splitext(os.path.basename(path))[0], read_color(path)
    layout = labels.chosen(stored(raw, "teacher", name), stored(raw, "published", name))
    small = cv2.resize(photo, layout.shape[::-1], interpolation=cv2.INTER_AREA)
    label = labels.snapped(layout, small)
    if exists(raw, "student", name):
        label = labels.with_layout_of(stored(raw, "student", name)["student"], label)
    if exists(raw, "borders", name):
        masks = stored(raw, "borders", name)
        label = labels.masked(label, masks["objects"], masks["sky"])
    label = labels.in_range(label)
    front = front_of(stored(raw, "masks", name)["classes"], label) if exists(raw, "masks", name) else np.zeros(label.shape, np.uint8)
    return name, name.rsplit("_", 1)[0], shrink(photo, LONG_SIDE), label, front


def photographs(folder, raw):
    """Yields the results of `labeled`, in order."""
    with multiprocessing.Pool() as pool:
        yield from pool.imap(functools.partial(labeled, raw=raw), [os.path.join(folder, file) for file in sorted(os.listdir(folder))])


def measured(folder):
    for name, photo, disparity in metrics.read_pairs(folder):
        least = np.nanmedian(disparity) / metrics.FARTHEST
        label = np.fmax(disparity, np.where(np.isnan(disparity), np.nan, least))
        scale = min(1.0, LABEL_SIDE / max(label.shape))
        size = (round(label.shape[1] * scale), round(label.shape[0] * scale))
        label = labels.in_range(cv2.resize(label, size, interpolation=cv2.INTER_NEAREST))
        source = "scene" if name.startswith("scene_") else "depth"  # depth of scenes.cpp, or measured
        yield name, source, shrink(photo, LONG_SIDE), label, np.zeros(label.shape, np.uint8)


def write(out, items):
    """Writes the files that data.Photographs reads.

    items  (name, source, photograph, disparity, mask of an object to cut out) per photograph. Returns the entries of index.json."""
    os.makedirs(out, exist_ok=True)
    entries, color_at, label_at = [], 0, 0
    with open(os.path.join(out, "colours.u8"), "wb") as colors, open(os.path.join(out, "labels.f16"), "wb") as values, \
            open(os.path.join(out, "fronts.u8"), "wb") as fronts:
        for name, source, photo, label, front in items:
            entries.append({"name": name, "source": source, "height": photo.shape[0], "width": photo.shape[1], "colour_at": color_at,
                            "label_height": label.shape[0], "label_width": label.shape[1], "label_at": label_at, "front": bool(front.any())})
            colors.write(np.ascontiguousarray(photo).tobytes())
            values.write(label.astype(np.float16).tobytes())
            fronts.write(front.tobytes())
            color_at, label_at = color_at + photo.size, label_at + label.size
    with open(os.path.join(out, "index.json"), "w") as file:
        json.dump({"entries": entries}, file)
    return entries


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("photos", "raw", "out"):
        p.add_argument("--" + name, required=True)
    p.add_argument("--depth", action="append", default=[])
    a = p.parse_args()
    start = time.time()
    sources = [photographs(a.photos, a.raw)] + [measured(folder) for folder in a.depth]
    entries = write(a.out, (item for s in sources for item in s))
    print(f"{len(entries)} photographs, {sum(e['front'] for e in entries)} with an object to cut out, in {time.time() - start:.0f} s")


if __name__ == "__main__":
    main()
