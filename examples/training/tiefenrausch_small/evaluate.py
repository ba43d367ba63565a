"""Compares the small depth network with the published one on photographs with measured depth that neither was trained on. See
metrics.py for the measures.

    python3 evaluate.py --pairs RGBD --estimate PROGRAM --convert PROGRAM --published FOLDER --student FILE.safetensors
                        [--checkpoint FOLDER/float.pt] [--sheet SHEET.png] [--each]

The programs are the compiled estimate.cpp and convert.cpp. Both networks run in 8 bits, by the library, and in floating point, with the
same weights. Prints a table for the unchanged pairs, a table of delta for harder versions, and the line `student -D.DDD delta, edges
D.DDD`: the student's gain or loss against the published network, both in 8 bits, and the F1 of its edges.
"""
import argparse
import os
import subprocess
import sys
import tempfile
import warnings

import cv2
import numpy as np
import torch
import torch.nn.functional as F

import metrics
import teachers
from estimator import Estimator
from export import Integers
from model import Student

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from weight_files import read_safetensors  # noqa: E402

LIVING = (3, 8, 10, 12, 13, 15, 17)  # classes of the segmentation: bird, cat, cow, dog, horse, person, sheep
MAX_PHOTOGRAPHS = 130  # maximum number of photographs per folder that are searched for subjects, evenly spaced
MIN_SUBJECT, MAX_SUBJECT = 0.02, 0.5  # share of the photograph's area
APART = 0.05  # minimum step at which the library separates surfaces, as a share of a photograph's disparity range
NOISE = 20  # standard deviation of the noise in the noisy versions, of 255


class Floats:
    """A file's network in floating point. Values are clipped to each tensor's 8-bit range: a network trained in 8 bits relies on clipping
    (a ReLU is a range that starts at 0), and the published network's output is wrong without clipping."""

    def __init__(self, tensors, is_logarithm):
        self.is_logarithm = is_logarithm
        self.operators, self.scales, self.weights = tensors["operators"].tolist(), tensors["scales"], {}
        self.ranges = [((0 - z) * s, (255 - z) * s) for s, z in zip(self.scales.tolist(), tensors["zero_points"].tolist())]
        for i, (kind, a, _, _, _) in enumerate(self.operators):
            if kind < 2:
                scale = tensors["weight_scales"][i]
                weight = (tensors[f"{i}.weight"].astype(np.float32) - tensors["weight_zero_points"][i]) * scale
                bias = tensors[f"{i}.bias"].astype(np.float32) * (self.scales[a] * scale)
                self.weights[i] = torch.from_numpy(weight).permute(0, 3, 1, 2).contiguous(), torch.from_numpy(bias)

    @torch.no_grad()
    def __call__(self, photo):
        """photo H x W x 3 uint8 -> disparity H' x W' float32"""
        values = [torch.from_numpy(metrics.network_size(photo)).permute(2, 0, 1)[None].float().div(255).clamp(*self.ranges[0])]
        for i, (kind, a, b, kernel, stride) in enumerate(self.operators):
            if kind < 2:
                weight, bias = self.weights[i]
                y = F.conv2d(values[a], weight, bias, stride, kernel // 2, 1, len(weight) if kind == 1 else 1)
            else:
                y = values[a] + values[b] if kind == 2 else values[a].repeat_interleave(stride, 2).repeat_interleave(stride, 3)
            values.append(y.clamp(*self.ranges[i + 1]))
        result = values[-1][0, 0].numpy()
        return np.exp(result) if self.is_logarithm else result


def check_integers(tensors, estimator, name):
    """Checks that exact integers and the library agree on every pixel for the file's network."""
    photo = np.random.default_rng(0).integers(0, 256, (64, 96, 3), np.uint8)
    levels = np.rint(photo.astype(np.float32) / np.float32(255) / tensors["scales"][0]) + tensors["zero_points"][0]
    if (Integers(tensors)(np.clip(levels, 0, 255).astype(np.uint8)) != estimator.both(photo, False)[0]).any():
        raise SystemExit(f"{name}: expected the result of exact integers from the library, found a different one")


def float_checkpoint(path):
    net = Student().eval()
    state = torch.load(path)
    if state["ranges"]:
        raise SystemExit(f"{path}: expected a checkpoint in floating point, found one in 8 bits")
    net.load_state_dict(state["average"])

    @torch.no_grad()
    def disparity(photo):
        return net(torch.from_numpy(metrics.network_size(photo)).permute(2, 0, 1)[None].float() / 255)[0, 0].numpy()
    return disparity


def portrait(image):
    """Returns the center of an image, cropped to 3 : 4, upright."""
    height, width = image.shape[:2]
    w = min(width, height * 3 // 4)
    h = min(height, w * 4 // 3)
    y, x = (height - h) // 2, (width - w) // 2
    return image[y:y + h, x:x + w]


def versions(photo, truth):
    """Yields (name, photograph, disparity) of a pair as it is and of five harder versions."""
    levels = np.arange(256) / 255
    table = lambda values: cv2.LUT(photo, (255 * np.clip(values, 0, 1) + 0.5).astype(np.uint8))
    noise = np.random.default_rng(3).normal(0, NOISE, photo.shape)
    yield "as they are", photo, truth
    yield "portrait", np.ascontiguousarray(portrait(photo)), portrait(truth)
    yield "brighter", table(1.6 * levels), truth
    yield "darker", table(0.35 * levels), truth
    yield "noisy", np.clip(photo + noise, 0, 255).astype(np.uint8), truth
    yield "dark and noisy", np.clip(0.5 * photo + noise, 0, 255).astype(np.uint8), truth


def sheet(rows):
    """Draws photograph, truth and estimates of some pairs as one picture."""
    def shown(a):
        a = cv2.resize(a.astype(np.float32), (256, 192), interpolation=cv2.INTER_LINEAR)
        low, high = np.nanpercentile(a, (2, 98))
        return cv2.applyColorMap(np.nan_to_num(np.clip((a - low) / (high - low + 1e-9), 0, 1) * 255).astype(np.uint8), cv2.COLORMAP_MAGMA)
    return np.concatenate([np.concatenate([cv2.resize(photo[:, :, ::-1], (256, 192), interpolation=cv2.INTER_AREA)] + [shown(a) for a in others], 1)
                           for photo, *others in rows], 0)


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("pairs", "estimate", "convert", "published", "student"):
        p.add_argument("--" + name, required=True)
    p.add_argument("--checkpoint", help="the student before quantization, for one more row")
    p.add_argument("--sheet", help="file for a picture of all estimates")
    p.add_argument("--subjects", action="append", default=[], help="folder of photographs, some of people and animals")
    p.add_argument("--segmentation", help="folder of the segmentation network (see teachers.py)")
    p.add_argument("--each", action="store_true", help="also print every pair")
    return p.parse_args()


def living(folders, segmentation):
    """Returns [(photograph, mask)] where the largest person or animal covers MIN_SUBJECT to MAX_SUBJECT of the photograph."""
    found, classes_of = [], teachers.masks(segmentation)
    for folder in folders:
        names = sorted(os.listdir(folder))
        for name in names[::max(1, -(-len(names) // MAX_PHOTOGRAPHS))]:
            photo = cv2.cvtColor(cv2.imread(os.path.join(folder, name), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
            mask = np.isin(classes_of(photo)["classes"], LIVING).astype(np.uint8)
            _, pieces, stats, _ = cv2.connectedComponentsWithStats(mask)
            if len(stats) > 1:
                mask = (pieces == 1 + np.argmax(stats[1:, cv2.CC_STAT_AREA])).astype(np.uint8)
                if MIN_SUBJECT < mask.mean() < MAX_SUBJECT:
                    found.append((photo, mask))
    return found


def print_separation(networks, subjects):
    print(f"\n| {len(subjects)} photographs of people and animals | separate from the background by {APART} | mean distance |\n|---|---|---|")
    for name, network in networks.items():
        values = []
        for photo, mask in subjects:
            disparity = network(photo)
            distance = metrics.separation(disparity, cv2.resize(mask, disparity.shape[::-1], interpolation=cv2.INTER_NEAREST))
            values += [] if np.isnan(distance) else [distance]
        print(f"| {name} | {100 * np.mean(np.array(values) > APART):.0f} % | {np.mean(values):.3f} |")


def networks_of(a):
    """Returns {name: function from a photograph to its disparity}."""
    with tempfile.TemporaryDirectory() as folder:
        converted = os.path.join(folder, "published.safetensors")
        subprocess.run([a.convert, a.published, converted], check=True)
        files = {"published": (converted, a.published), "student": (a.student, a.student)}
        networks = {}
        for name, (weights, model) in files.items():
            (tensors, metadata), estimator = read_safetensors(weights), Estimator(a.estimate, model)
            check_integers(tensors, estimator, name)
            networks |= {f"{name}, float": Floats(tensors, metadata.get("output") != "disparity"), f"{name}, 8 bits": estimator}
    if a.checkpoint:
        networks["student before 8 bits, float"] = float_checkpoint(a.checkpoint)
    return networks


def main():
    a = arguments()
    warnings.simplefilter("ignore", RuntimeWarning)
    torch.set_num_threads(1)
    cv2.setNumThreads(1)
    networks = networks_of(a)
    results, pictures, likeness = {}, [], {}
    for name, photo, truth in metrics.read_pairs(a.pairs):
        for version, image, disparity in versions(photo, truth):
            found = {n: estimate(image) for n, estimate in networks.items() if version == "as they are" or n.endswith("8 bits")}
            for n, estimate in found.items():
                results.setdefault((version, n), []).append(metrics.compare(estimate, disparity))
            if version == "as they are":
                pictures.append([photo, truth, *found.values()])
                for n in ("published", "student"):
                    in_8_bits = found[n + ", 8 bits"]  # may be larger, because the library runs the network twice
                    in_float = cv2.resize(found[n + ", float"], in_8_bits.shape[::-1], interpolation=cv2.INTER_LINEAR)
                    likeness.setdefault(n, []).append(np.corrcoef(in_float.ravel(), in_8_bits.ravel())[0, 1])
        if a.each:
            print(f"{name:26s}", "  ".join(f"{n} {results['as they are', n][-1]['delta']:.3f}" for n in networks))
    mean = {at: {m: np.nanmean([float(r[m]) for r in found]) for m in found[0]} for at, found in results.items()}
    print(f"| {len(pictures)} pairs | delta < 1.25 | AbsRel | RMSE | edges (F1) | boundaries (F1) | wrong order |\n|---|---|---|---|---|---|---|")
    for n in networks:
        measures = ("delta", "abs_rel", "rmse", "edges", "boundaries", "order")
        print(f"| {n} | " + " | ".join(f"{mean['as they are', n][m]:.3f}" for m in measures) + " |")
    print("\nCorrelation of float and 8 bits: " + ", ".join(f"{n} {np.mean(r):.3f}" for n, r in likeness.items()) + "\n")
    compared = [n for n in networks if n.endswith("8 bits")]
    print("| delta < 1.25 | " + " | ".join(compared) + " |\n|---|" + "---|" * len(compared))
    for version in dict.fromkeys(v for v, _ in results):
        print(f"| {version} | " + " | ".join(f"{mean[version, n]['delta']:.3f}" for n in compared) + " |")
    if a.segmentation:
        print_separation({n: networks[n] for n in compared}, living(a.subjects, a.segmentation))
    if a.sheet:
        cv2.imwrite(a.sheet, sheet(pictures))
    published, student = (mean["as they are", n] for n in compared)
    print(f"\nstudent {student['delta'] - published['delta']:+.3f} delta, edges {student['edges']:.3f}")


if __name__ == "__main__":
    main()
