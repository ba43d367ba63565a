"""Measures how many pixels the silhouette network and other methods assign to the wrong side. Prints Markdown.

    python3 evaluate.py --weights CHECKPOINT_OR_SAFETENSORS --depth PROGRAM --student STUDENT.safetensors
        [--photos PHOTOS --cutouts FOLDER] [--pairs RGBD] [--count 60] [--sheets FOLDER]

Evaluates composites of photographs that were not used in training, with mildly, moderately and strongly degraded disparity and with the depth
network's estimate; and photographs with true depth. Counts only pixels of the band whose true side is known.
"""
import argparse
import json
import os

import cv2
import numpy as np
import torch

import band as bands
import composites
import quantize
from model import padded

LEVELS = (("mild", 0.0, 0.33), ("medium", 0.33, 0.66), ("strong", 0.66, 1.0), ("depth network", None, None))
SIZE = (384, 512)
MIN_PIXELS = 200, 500  # minimum number of counted pixels per composite and per photograph
MIN_ISLAND = 24


@torch.no_grad()
def alpha_of(net, observe, band, photo, estimated):
    """Returns (share of the front, probability that its side is right), each H x W."""
    x = (torch.from_numpy(bands.quantized(band.features(photo, estimated))[None]).float() - 128) / 127
    region = torch.from_numpy(band.region[None, None].astype(np.float32))
    height, width = band.region.shape
    y = torch.sigmoid(net(padded(x), padded(region), observe))[0, :, :height, :width].numpy()
    return y[0], y[1]


def without_islands(alpha, wanted):
    """Moves connected components of fewer than MIN_ISLAND pixels, within the mask `wanted`, to the other side."""
    alpha = alpha.copy()
    for side in (False, True):
        _, labels, stats, _ = cv2.connectedComponentsWithStats((((alpha > 0.5) == side) & wanted).astype(np.uint8), connectivity=4)
        small = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] < MIN_ISLAND)
        flip = np.isin(labels, small[small > 0])
        alpha[flip] = 1 - alpha[flip]
    return alpha


def grabcut(share, photo, radius=8):
    """Runs OpenCV's GrabCut. GrabCut decides only pixels within `radius` of the border between the sides. share: initial share of the
    front, H x W."""
    front, k = (share > 0.5).astype(np.uint8), bands.disk(radius)
    sure_front, sure_back = cv2.erode(front, k) > 0, cv2.dilate(front, k) == 0
    if sure_front.sum() < 20 or sure_back.sum() < 20:
        return front.astype(np.float32)
    mask = np.where(sure_front, cv2.GC_FGD, np.where(sure_back, cv2.GC_BGD, np.where(front > 0, cv2.GC_PR_FGD, cv2.GC_PR_BGD))).astype(np.uint8)
    cv2.setRNGSeed(1)
    cv2.grabCut(photo, mask, None, np.zeros((1, 65)), np.zeros((1, 65)), 4, cv2.GC_INIT_WITH_MASK)
    return ((mask == cv2.GC_FGD) | (mask == cv2.GC_PR_FGD)).astype(np.float32)


def methods(net, observe, photo, estimated, prepared, cleaned, slow=True):
    """Returns (band, {name: share of the front})."""
    band = bands.Band(prepared)
    smooth = band.share(cv2.resize(estimated, prepared.shape[::-1], interpolation=cv2.INTER_LINEAR))
    alpha, doubt = alpha_of(net, observe, band, photo, estimated)
    start = (band.share(prepared) > 0.5).astype(np.float32)
    result = {"estimate, thresholded": (smooth > 0.5).astype(np.float32), "prepared disparity": start,
              "aligned as the library does": (band.share(cleaned) > 0.5).astype(np.float32)}
    if slow:
        result["GrabCut"] = grabcut(np.where(band.region, smooth, start), photo)
    result["network"] = alpha
    result["network, sure"] = np.where(doubt > 0.6, alpha, start)
    result["network, no islands"] = without_islands(alpha, band.band)
    return band, result


def errors(p, alpha, mask):
    """Returns (share on the wrong side, mean error, mean error of gradients)."""
    def gradient(t):
        return np.stack([np.diff(t, axis=1, append=t[:, -1:]), np.diff(t, axis=0, append=t[-1:])])
    return ((p > 0.5) != (alpha > 0.5))[mask].mean(), np.abs(p - alpha)[mask].mean(), np.abs(gradient(p) - gradient(alpha)).sum(0)[mask].mean()


def class_of(kind):
    kinds = set(kind.split("+"))
    return "fine" if kinds & set(composites.FINE) else "cutout" if "cutout" in kinds else "shape"


def of_composites(a, net, observe, depth):
    print("| degradation | method | wrong side, % | error of alpha | of gradients | cutouts | fine | shapes |\n|---|---|---|---|---|---|---|---|")
    for name, low, high in LEVELS:
        maker, found, kinds = composites.Composites(a.photos, a.cutouts, 7), {}, []
        for i in range(a.count):
            photo, weights, kind = maker.composite(SIZE)
            given = None if low is None else maker.spoiled(maker.disparity(weights), maker.rng.uniform(low, high), 2.0)
            estimated, _, prepared, cleaned = depth(photo, given)
            band, result = methods(net, observe, photo, estimated, prepared, cleaned)
            alpha, state = composites.labels(band, weights, given is not None)
            known = state == composites.LABELED
            if known.sum() < MIN_PIXELS[0]:
                continue
            kinds.append(class_of(kind))
            for method, p in result.items():
                found.setdefault(method, []).append(errors(p, alpha, known))
            if a.sheets and i < 12:
                sheet(os.path.join(a.sheets, f"composite_{name.replace(' ', '_')}_{i:02d}.png"), photo, prepared, result["network"], alpha, known)
        kinds = np.array(kinds)
        for method, values in found.items():
            values = np.array(values)
            per = " | ".join(f"{100 * values[kinds == k, 0].mean():.2f}" if (kinds == k).any() else "" for k in ("cutout", "fine", "shape"))
            wrong, error, gradient = values.mean(0)
            print(f"| {name} | {method} | {100 * wrong:.2f} | {error:.4f} | {gradient:.4f} | {per} |", flush=True)


def true_sides(entry, folder, size):
    """Returns (true share of the front, mask of known pixels), both H x W, of a photograph with true depth. A pixel is known if it lies near
    a sharp step and is clearly on one side of it."""
    def k(r):
        return np.ones((2 * r + 1, 2 * r + 1), np.uint8)
    g = cv2.imread(os.path.join(folder, entry["map"]), cv2.IMREAD_UNCHANGED).astype(np.float32)
    bad = cv2.dilate((g == 0).astype(np.uint8), k(4)) > 0
    if entry["kind"] == "depth":
        g = 1 / np.maximum(g, 1)
    if g.shape != size:
        g = cv2.resize(g, size[::-1], interpolation=cv2.INTER_NEAREST)
        bad = cv2.resize(bad.astype(np.uint8), size[::-1], interpolation=cv2.INTER_NEAREST) > 0
    low, high = np.percentile(g[~bad], [0.5, 99.5])
    g = np.clip((g - low) / (high - low), 0, 1)
    if bad.any():
        g = cv2.inpaint((g * 255).astype(np.uint8), bad.astype(np.uint8), 2, cv2.INPAINT_NS).astype(np.float32) / 255
    far, near = cv2.erode(g, k(10)), cv2.dilate(g, k(10))
    share, hop = (g - far) / np.maximum(near - far, 0.01), cv2.dilate(g, k(1)) - cv2.erode(g, k(1))
    known = (near - far > 0.1) & ((share < 0.3) | (share > 0.7)) & (cv2.dilate(hop, k(9)) > 0.6 * (near - far)) & ~bad
    return share, known


def agrees(share, true):
    """Returns a mask of the pixels where estimate and truth have the same step: their correlation in windows of 25 x 25 pixels exceeds
    0.6."""
    def mean(t):
        return cv2.blur(t, (25, 25))
    spread = (mean(share * share) - mean(share) ** 2) * (mean(true * true) - mean(true) ** 2)
    return (mean(share * true) - mean(share) * mean(true)) / np.sqrt(np.maximum(spread, 1e-6)) > 0.6


def of_pairs(a, net, observe, depth):
    found, wide = {}, {}
    print("\n| photograph | pixels | wrong side, %; in the prototype's band |\n|---|---|---|")
    with open(os.path.join(a.pairs, "manifest.json")) as file:
        manifest = json.load(file)
    for entry in manifest:
        if not entry["name"].startswith(tuple(a.pairs_named.split(","))):
            continue
        photo = cv2.cvtColor(cv2.imread(os.path.join(a.pairs, entry["image"]), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
        true, known = true_sides(entry, a.pairs, photo.shape[:2])
        estimated, _, prepared, cleaned = depth(photo)
        band, result = methods(net, observe, photo, estimated, prepared, cleaned)
        result = {method: p > 0.5 for method, p in result.items()}
        smooth = cv2.resize(estimated, prepared.shape[::-1], interpolation=cv2.INTER_LINEAR)
        mask = band.band & known & agrees(np.clip(band.share(smooth), 0, 1), true)
        if mask.sum() < MIN_PIXELS[1]:
            continue
        add(found, {method: (side != (true > 0.5))[mask].mean() for method, side in result.items()})
        wide_band, smooth = windows(smooth)
        counted = wide_band & known & agrees(smooth, true)
        elsewhere = windows(prepared)[1] > 0.5
        sides = {"estimate, thresholded": smooth > 0.5, "prepared disparity": elsewhere, "aligned as the library does": windows(cleaned)[1] > 0.5}
        sides |= {method: np.where(band.band, side, elsewhere) for method, side in result.items() if method not in sides}
        add(wide, {method: (sides[method] != (true > 0.5))[counted].mean() for method in result})
        print(f"| {entry['name']} | {mask.sum()} of {counted.sum()} | " +
              ", ".join(f"{m} {100 * found[m][-1]:.2f}; {100 * wide[m][-1]:.2f}" for m in found) + " |", flush=True)
        if a.sheets:
            sheet(os.path.join(a.sheets, f"pair_{entry['name']}.png"), photo, prepared, result["network"], (true > 0.5).astype(np.float32), mask)
    print("\n| method | wrong side, % | in the prototype's band, % |\n|---|---|---|")
    for method, values in found.items():
        print(f"| {method} | {100 * np.mean(values):.2f} | {100 * np.mean(wide[method]):.2f} |")


def add(lists, values):
    for name, value in values.items():
        lists.setdefault(name, []).append(value)


def windows(disparity, radius=20, least=0.06):
    """Returns (band, share of the front) of an earlier prototype, for comparison. Its band contains all pixels around which the disparity
    changes by more than `least` in a square window, whether sharply or not."""
    def box(change, r):
        return change(disparity, np.ones((2 * r + 1, 2 * r + 1), np.uint8), borderType=cv2.BORDER_REPLICATE)
    low, high = (cv2.blur(box(change, radius), (radius + 1, radius + 1), borderType=cv2.BORDER_REPLICATE) for change in (cv2.erode, cv2.dilate))
    step = box(cv2.dilate, bands.BAND_RADIUS) - box(cv2.erode, bands.BAND_RADIUS)
    return (step > least) & (step > 0.35 * (high - low)), np.clip((disparity - low) / np.maximum(high - low, least), 0, 1)


def sheet(path, photo, prepared, alpha, truth, mask):
    """Draws photo, prepared disparity, the network's share and the true share."""
    def gray(t):
        return cv2.cvtColor(np.uint8(255 * np.clip(t, 0, 1)), cv2.COLOR_GRAY2BGR)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    half = np.where(mask, 0.0, 0.5)
    cv2.imwrite(path, np.hstack([photo[:, :, ::-1], gray(prepared), gray(np.where(mask, alpha, half)), gray(np.where(mask, truth, half))]))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--weights", required=True)
    p.add_argument("--depth", required=True, help="the compiled depth.cpp")
    p.add_argument("--student", required=True, help="the depth network's weights")
    p.add_argument("--photos", help="photographs that training did not use")
    p.add_argument("--cutouts", help="output of cutouts.py for these photographs")
    p.add_argument("--pairs", help="photographs with true depth, with manifest.json")
    p.add_argument("--pairs-named", default="mb_,hci_,slambook_ch12_", help="names of photographs with dense, sharp depth")
    p.add_argument("--count", type=int, default=60, help="composites per kind of degradation")
    p.add_argument("--sheets", help="folder for pictures")
    a = p.parse_args()
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    net, observe = quantize.in_bytes(*quantize.network_of(a.weights))
    depth = bands.Depth(a.depth, a.student)
    if a.photos:
        of_composites(a, net, observe, depth)
    if a.pairs:
        of_pairs(a, net, observe, depth)


if __name__ == "__main__":
    main()
