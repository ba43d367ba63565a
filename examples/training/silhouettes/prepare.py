"""Writes crops with labels for train.py. Resumes an interrupted run.

    python3 prepare.py --photos PHOTOS --cutouts FOLDER --depth PROGRAM --student STUDENT.safetensors --out DATA [--crops 40000]
    python3 prepare.py ... --real --pairs RGBD --pairs RGBD

Writes two crops per composite: one with degraded true disparity, one with the depth network's estimate. With --real, cuts the crops from
unchanged photographs. There, labels come from true depth or object masks, and only pixels at a distance of a few pixels from silhouettes
have labels, because depth and masks are unreliable at silhouettes. DATA/NNNNN.npy contains CROPS x 10 x SIDE x SIDE bytes: the network's
input (band.py, 8 bits), alpha, and the state of the label (composites.py).
"""
import argparse
import glob
import json
import os

import cv2
import numpy as np

import band as bands
import composites
import evaluate

SIDE = 96
MARGIN = 8          # width of a crop's border, which the network reads but which has no labels
CROPS_PER_FILE = 256
MAX_PER_MAP = 6     # crops per disparity map
MIN_LABELED = 300  # minimum number of labeled pixels per crop
RIM = 2             # pixels without a label on each side of a mask's border
PAIRS_NAMED = ("tartan_", "iclredwood_", "tief_")  # photographs with dense, sharp depth
MIN_STEP, FADING = 0.06, 0.35  # arguments of composites.disparity()
PAIRS_SHARE = 0.3   # share of pairs with true depth among the real photographs
SIZES = ((384, 512), (512, 384), (352, 480), (448, 448), (336, 448))


def crops_of(rng, x, alpha, state, wrong):
    """Yields crops around random labeled pixels. For half of the crops, chooses a pixel with wrong prepared disparity."""
    height, width = state.shape
    packed = np.concatenate([bands.quantized(x), np.rint(alpha * 255).astype(np.uint8)[None], state[None]])
    free = state == composites.LABELED
    for _ in range(MAX_PER_MAP):
        where = np.flatnonzero(free & wrong) if rng.random() < 0.5 else np.flatnonzero(free)
        if len(where) < 60:
            where = np.flatnonzero(free)
        if len(where) < MIN_LABELED:
            return
        cy, cx = divmod(int(rng.choice(where)), width)
        top = int(np.clip(cy - SIDE // 2 + rng.integers(-20, 21), 0, height - SIDE))
        left = int(np.clip(cx - SIDE // 2 + rng.integers(-20, 21), 0, width - SIDE))
        crop = packed[:, top:top + SIDE, left:left + SIDE].copy()
        free[max(0, cy - 24):cy + 25, max(0, cx - 24):cx + 25] = False
        inner = np.zeros((SIDE, SIDE), bool)
        inner[MARGIN if top > 0 else 0:SIDE - MARGIN if top + SIDE < height else SIDE,
              MARGIN if left > 0 else 0:SIDE - MARGIN if left + SIDE < width else SIDE] = True
        crop[-1][~inner & (crop[-1] > composites.CONTEXT)] = composites.CONTEXT
        if (crop[-1] == composites.LABELED).sum() >= MIN_LABELED:
            yield crop


def coarser(rng, estimated):
    """Shrinks the estimate, so that the photo has more pixels per depth sample, as a larger photo would."""
    shrink = rng.uniform(1.2, 3.5)
    size = (max(8, round(estimated.shape[1] / shrink)), max(8, round(estimated.shape[0] / shrink)))
    return cv2.resize(estimated, size, interpolation=cv2.INTER_AREA)


def of_composite(maker, depth):
    """Yields crops of a new composite."""
    rng = maker.rng
    photo, weights, _ = maker.composite(SIZES[int(rng.integers(len(SIZES)))])
    given = [depth(photo, maker.spoiled(maker.disparity(weights, MIN_STEP, FADING), rng.random() ** 1.2))]
    seen = depth(photo)
    given.append(depth(photo, coarser(rng, seen[0])) if rng.random() < 0.5 else seen)
    for by_network, (estimated, _, prepared, _) in enumerate(given):
        band = bands.Band(prepared)
        alpha, state = composites.labels(band, weights, not by_network)
        wrong = (band.share(prepared) > 0.5) != (alpha > 0.5)
        yield from crops_of(rng, band.features(photo, estimated), alpha, state, wrong)


def read_pairs(folders):
    """Returns (photograph, share of the front, mask of known pixels) per usable photograph."""
    result = []
    for folder in folders:
        with open(os.path.join(folder, "manifest.json")) as file:
            for entry in json.load(file):
                if entry["name"].startswith(PAIRS_NAMED):
                    photo = cv2.cvtColor(cv2.imread(os.path.join(folder, entry["image"]), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
                    result.append((photo, *evaluate.true_sides(entry, folder, photo.shape[:2])))
    return result


def of_real(maker, depth, pairs):
    """Yields randomly scaled and mirrored crops of an unchanged photograph."""
    rng = maker.rng
    if pairs and rng.random() < PAIRS_SHARE:
        photo, share, known = pairs[int(rng.integers(len(pairs)))]
    else:
        name = maker.cutouts[int(rng.integers(len(maker.cutouts)))]
        photo = maker.photos[maker.index[name]]
        mask = cv2.imread(os.path.join(maker.masks_folder, name + ".png"), cv2.IMREAD_GRAYSCALE)
        border = cv2.morphologyEx((mask > 128).astype(np.uint8), cv2.MORPH_GRADIENT, bands.disk(RIM))
        share, known = (mask > 128).astype(np.float32), (border == 0) & ((mask < 40) | (mask > 215))
    scale = rng.uniform(0.75, 1.3)
    size = (round(photo.shape[1] * scale), round(photo.shape[0] * scale))
    photo = cv2.resize(photo, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    share = cv2.resize(share, size, interpolation=cv2.INTER_NEAREST)
    known = cv2.resize(known.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) > 0
    if rng.random() < 0.5:
        photo, share, known = (np.ascontiguousarray(t[:, ::-1]) for t in (photo, share, known))
    seen = depth(photo)
    estimated, _, prepared, _ = depth(photo, coarser(rng, seen[0])) if rng.random() < 0.4 else seen
    band = bands.Band(prepared)
    alpha = (share > 0.5).astype(np.float32)
    smooth = np.clip(band.share(cv2.resize(estimated, prepared.shape[::-1], interpolation=cv2.INTER_LINEAR)), 0, 1)
    _, state = composites.labels(band, np.stack([1 - alpha, alpha]), False)
    state[(state == composites.LABELED) & ~(known & evaluate.agrees(smooth, share))] = composites.CONTEXT
    yield from crops_of(rng, band.features(photo, estimated), alpha, state, (band.share(prepared) > 0.5) != (alpha > 0.5))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--photos", required=True)
    p.add_argument("--cutouts", required=True, help="folder of cutouts.py")
    p.add_argument("--depth", required=True, help="the compiled depth.cpp")
    p.add_argument("--student", required=True, help="the depth network's weights")
    p.add_argument("--out", required=True)
    p.add_argument("--crops", type=int, default=40000)
    p.add_argument("--held-out", action="store_true", help="use the held-out photographs, which training never reads, for validation")
    p.add_argument("--real", action="store_true", help="crops of unchanged photographs instead of composites")
    p.add_argument("--pairs", action="append", default=[], help="with --real: a folder of photographs with depth, with manifest.json")
    a = p.parse_args()
    cv2.setNumThreads(1)
    os.makedirs(a.out, exist_ok=True)
    depth = bands.Depth(a.depth, a.student)
    number = len(glob.glob(os.path.join(a.out, "[0-9]*.npy")))
    maker = composites.Composites(a.photos, a.cutouts, [11 + a.held_out + 2 * a.real, number], "held out" if a.held_out else "train")
    pairs = read_pairs(a.pairs) if a.real else []
    while number * CROPS_PER_FILE < a.crops:
        maker.find_cutouts()
        crops = []
        while len(crops) < CROPS_PER_FILE:
            crops.extend(of_real(maker, depth, pairs) if a.real else of_composite(maker, depth))
        maker.rng.shuffle(crops)
        np.save(os.path.join(a.out, "part"), np.stack(crops[:CROPS_PER_FILE]))
        os.replace(os.path.join(a.out, "part.npy"), os.path.join(a.out, f"{number:05d}.npy"))
        number += 1


if __name__ == "__main__":
    main()
