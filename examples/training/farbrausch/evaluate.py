"""Compares methods of inpainting on held-out photographs: fills of 200 fixed holes at 256x256, shaped like those behind silhouettes.

    python3 evaluate.py --photos PHOTOS --weights checkpoint.pt [--sheets FOLDER] [--count 200]
    python3 evaluate.py --photos PHOTOS --weights farbrausch.safetensors --inpaint PROGRAM ...

With --inpaint (the compiled inpaint.cpp), the row "Farbrausch" shows the library's result with texture, and another row shows the network
alone in PyTorch. Without --inpaint, the row "Farbrausch" shows the network alone.

Columns, inside the holes: PSNR, SSIM and, with --lpips, LPIPS (averages over the pictures), mean absolute color error (0 to 255), error
of a hole's mean color (a hole is one connected component), mean gradient magnitude relative to the truth's, and the distance between the
histograms of gradient magnitude (earth mover's, 0 to 255). No method sees the pixels that do not exist. A second table has PSNR and LPIPS
by hole width. The last line is Farbrausch's lead in PSNR over the best other method.
"""
import argparse
import os
import subprocess
import sys

import cv2
import numpy as np
import torch

import data
import export
import masks
from model import Farbrausch

SIZE = 256
WIDTHS = (16, 32, 64)  # limits between the classes of hole widths in the second table, in pixels


def cases(folder, count):
    """Returns [(image H x W x 3 uint8, labels H x W)], the same for every run."""
    photographs = [image for _, image in data.read_folder(folder)]
    rng = np.random.default_rng(20)
    bank = masks.bank(count, SIZE, seed=99)
    return [(np.ascontiguousarray(data.crop_of(rng, photographs[i % len(photographs)], SIZE)), bank[i]) for i in range(count)]


def blanked(image, labels):
    return np.where((labels == masks.KNOWN)[..., None], image, 0).astype(np.uint8)


def median_fill(image, labels):
    out = blanked(image, labels)
    out[labels != masks.KNOWN] = np.median(image[labels == masks.KNOWN], 0)
    return out


def diffusion(image, labels):
    """Isotropic diffusion: every unknown pixel becomes the average of its existing neighbors. Solved coarse to fine, by relaxation."""
    known, exists = labels == masks.KNOWN, labels != masks.ABSENT
    start = np.repeat(np.repeat(diffusion(image[::2, ::2], labels[::2, ::2]), 2, 0), 2, 1)[:image.shape[0], :image.shape[1]] if (
        min(image.shape[:2]) > 8 and known[::2, ::2].any()) else np.full(image.shape, image[known].mean(0) if known.any() else 128.0)
    x = np.where(known[..., None], image, start).astype(np.float32) * exists[..., None]
    count = sum(neighbors(exists.astype(np.float32)[..., None]))
    for _ in range(200):
        average = sum(neighbors(x)) / np.maximum(count, 1)
        x = np.where(known[..., None] | (count == 0), x, average) * exists[..., None]
    return x


def neighbors(x):
    padded = np.pad(x, ((1, 1), (1, 1), (0, 0)))
    return padded[:-2, 1:-1], padded[2:, 1:-1], padded[1:-1, :-2], padded[1:-1, 2:]


def opencv(flag):
    def fill(image, labels):
        return cv2.inpaint(blanked(image, labels), (labels != masks.KNOWN).astype(np.uint8), 5, flag)
    return fill


def network(path):
    if path.endswith(".safetensors"):
        net = export.network_of(path)
    else:
        net = Farbrausch().eval()
        net.load_state_dict(torch.load(path)["average"])

    @torch.no_grad()
    def fill(image, labels):
        return (net(*data.to_tensors(image[None], labels[None]))[0].clamp(0, 1) * 255).permute(1, 2, 0).numpy()
    return fill


def library(program, path):
    process = subprocess.Popen([program, path], stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    def fill(image, labels):
        try:
            process.stdin.write(np.array(labels.shape, "<i4").tobytes() + image.tobytes() + labels.tobytes())
            process.stdin.flush()
        except BrokenPipeError:
            raise SystemExit(f"{program}: expected a filled picture, found the end of the output")
        filled = process.stdout.read(image.size)
        if len(filled) != image.size:
            raise SystemExit(f"{program}: expected a filled picture, found the end of the output")
        return np.frombuffer(filled, np.uint8).reshape(image.shape)
    return fill


def structural_similarity(a, b):
    """Returns the SSIM map of two H x W x 3 pictures, averaged over the channels (Gaussian window, sigma 1.5)."""
    a, b = a.astype(np.float64), b.astype(np.float64)

    def blur(x):
        return cv2.GaussianBlur(x, (11, 11), 1.5)

    ma, mb = blur(a), blur(b)
    va, vb, cov = blur(a * a) - ma * ma, blur(b * b) - mb * mb, blur(a * b) - ma * mb
    c1, c2 = (0.01 * 255) ** 2, (0.03 * 255) ** 2
    return ((2 * ma * mb + c1) * (2 * cov + c2) / ((ma ** 2 + mb ** 2 + c1) * (va + vb + c2))).mean(2)


def gradient_magnitudes(picture, hole):
    """Returns the gradients of pixels whose right and lower neighbors are also in the hole."""
    gray = picture.astype(np.float32) @ np.array([0.299, 0.587, 0.114], np.float32)
    inside = hole[:-1, :-1] & hole[1:, :-1] & hole[:-1, 1:]
    return np.hypot(gray[1:, :-1] - gray[:-1, :-1], gray[:-1, 1:] - gray[:-1, :-1])[inside]


def width_classes(index):
    """Returns the width class of each pixel's hole; class 0 is below WIDTHS[0] pixels. A hole's width is the diameter of the largest disk
    inside it. index: number of each pixel's hole, 0 outside of holes."""
    widths = np.zeros(index.max() + 1)
    for i in range(1, len(widths)):
        widths[i] = 2 * cv2.distanceTransform(np.pad((index == i).astype(np.uint8), 1), cv2.DIST_L2, cv2.DIST_MASK_PRECISE).max() - 1
    return np.digitize(widths, WIDTHS)[index]


def measure(image, labels, filled, lpips=None):
    hole = labels == masks.HOLE
    composite = np.where(hole[..., None], np.clip(filled, 0, 255), image)
    difference = (composite - image.astype(np.float64))[hole]
    pieces, index = cv2.connectedComponents(hole.astype(np.uint8), connectivity=4)
    perceived = lpips(composite.astype(np.uint8), image, mean=False)[hole] if lpips else np.full(len(difference), np.nan)
    shifts = [np.abs((composite - image.astype(np.float64))[index == i].mean(0)).mean() for i in range(1, pieces)]
    areas = [(index == i).sum() for i in range(1, pieces)]
    bins = np.linspace(0, 362, 182)
    return {"psnr": 10 * np.log10(255 ** 2 / max((difference ** 2).mean(), 1e-2)),
            "ssim": structural_similarity(composite, image)[hole].mean(),
            "lpips": perceived.mean(), "color": np.abs(difference).mean(), "average": np.average(shifts, weights=areas),
            "ours": np.histogram(gradient_magnitudes(composite, hole), bins)[0], "true": np.histogram(gradient_magnitudes(image, hole), bins)[0],
            "composite": composite.astype(np.uint8),
            "pixels": (width_classes(index)[hole], (difference ** 2).mean(1), perceived)}


def print_by_width(results):
    """Prints PSNR and LPIPS over all hole pixels per width class."""
    names = [f"under {WIDTHS[0]}", *(f"{a} to {b}" for a, b in zip(WIDTHS, WIDTHS[1:])), f"{WIDTHS[-1]} or more"]
    columns = {name: [np.concatenate([r["pixels"][k] for r in rows]) for k in range(3)] for name, rows in results.items()}
    classes = next(iter(columns.values()))[0]
    there = [c for c in range(len(names)) if (classes == c).any()]
    print("\nBy the width of the hole in pixels, and its class's share of all hidden pixels: PSNR / LPIPS\n")
    print("| | " + " | ".join(f"{names[c]} ({100 * (classes == c).mean():.0f} %)" for c in there) + " |\n|---|" + "---|" * len(there))
    for name, (_, squared, perceived) in columns.items():
        cells = [f"{10 * np.log10(255 ** 2 / squared[classes == c].mean()):.2f} / {perceived[classes == c].mean():.3f}" for c in there]
        print(f"| {name} | " + " | ".join(cells) + " |")


def texture(results):
    """Returns (mean gradient magnitude relative to the truth's, earth mover's distance of the two histograms)."""
    ours, true = sum(r["ours"] for r in results), sum(r["true"] for r in results)
    ours, true = ours / ours.sum(), true / true.sum()
    middles = np.arange(len(ours)) * 2 + 1
    return (ours @ middles) / (true @ middles), 2 * np.abs(np.cumsum(ours) - np.cumsum(true)).sum()


def sheet(path, chosen, inputs, columns):
    """Draws one row per photograph: the input (holes red, absent pixels black), the truth, then the given methods."""
    rows = []
    for i in chosen:
        image, labels = inputs[i]
        shown = image.copy()
        shown[labels == masks.HOLE], shown[labels == masks.ABSENT] = (255, 0, 0), 0
        rows.append(np.concatenate([shown, image, *(column[i]["composite"] for column in columns)], 1))
    half = (len(rows) + 1) // 2
    picture = np.concatenate([np.concatenate(rows[:half]), np.concatenate(rows[half:])], 1) if len(rows) % 2 == 0 else np.concatenate(rows)
    cv2.imwrite(path, cv2.cvtColor(picture, cv2.COLOR_RGB2BGR))


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--photos", required=True, help="folder of held-out photographs")
    p.add_argument("--weights", help="exported file or checkpoint; without it, only the other methods are measured")
    p.add_argument("--inpaint", help="the compiled inpaint.cpp: also measures the library; needs exported weights")
    p.add_argument("--count", type=int, default=200)
    p.add_argument("--lpips", help="folder of lpips.py: also measures the perceived difference")
    p.add_argument("--sheets", help="folder for contact sheets of the 24 best and the 24 worst fills")
    a = p.parse_args()
    if a.inpaint and not (a.weights or "").endswith(".safetensors"):
        p.error("--inpaint needs exported --weights")
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    lpips = None
    if a.lpips:
        sys.path.append(a.lpips)
        from lpips import lpips
    methods = {"median color": median_fill, "diffusion": diffusion, "Telea": opencv(cv2.INPAINT_TELEA),
               "Navier-Stokes": opencv(cv2.INPAINT_NS)}
    if a.weights:
        methods["Farbrausch without texture" if a.inpaint else "Farbrausch"] = network(a.weights)
    if a.weights and a.inpaint:
        methods["Farbrausch"] = library(a.inpaint, a.weights)
    inputs = cases(a.photos, a.count)
    results = {name: [measure(image, labels, fill(image, labels), lpips) for image, labels in inputs] for name, fill in methods.items()}
    print(f"| {len(inputs)} holes | PSNR | SSIM | LPIPS | color error | error of mean color | gradients | gradient histogram |\n|---|---|---|---|---|---|---|---|")
    for name, rows in results.items():
        ratio, distance = texture(rows)
        mean = {key: np.mean([r[key] for r in rows]) for key in ("psnr", "ssim", "lpips", "color", "average")}
        print(f"| {name} | {mean['psnr']:.2f} | {mean['ssim']:.3f} | {mean['lpips']:.3f} | {mean['color']:.2f} | {mean['average']:.2f} | {ratio:.2f} | {distance:.2f} |")
    print_by_width(results)
    if a.weights:
        decibels = {name: np.mean([r["psnr"] for r in rows]) for name, rows in results.items() if name != "Farbrausch without texture"}
        print(f"\nfarbrausch {decibels.pop('Farbrausch') - max(decibels.values()):+.2f} dB")
        if a.sheets:
            os.makedirs(a.sheets, exist_ok=True)
            # Ranks fills by their lead over Telea's method. A ranking by PSNR would only show which holes are easy.
            lead = np.array([ours["psnr"] - other["psnr"] for ours, other in zip(results["Farbrausch"], results["Telea"])])
            order = np.argsort(lead)
            columns = [results["Telea"], results["Farbrausch"]]
            sheet(os.path.join(a.sheets, "worst.png"), order[:24], inputs, columns)
            sheet(os.path.join(a.sheets, "best.png"), order[::-1][:24], inputs, columns)


if __name__ == "__main__":
    main()
