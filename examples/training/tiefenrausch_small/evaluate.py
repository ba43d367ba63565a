"""Compares depth networks on photographs with measured depth that none was trained on. See metrics.py for the measures.

    python3 evaluate.py --pairs RGBD --estimate PROGRAM --teacher MODEL [--float FOLDER/float.pt] [--quantised FILE.safetensors] [--sheet SHEET.png]

Prints a table for the pairs as they are, one of delta for harder versions of them, and ends with the line `student -D.DDD delta`: what
the best student given (8 bits if there is one) gains or loses against the published network.
"""
import argparse
import warnings

import cv2
import numpy as np
import torch

import metrics
from estimator import Estimator
from model import Student

NOISE = 20  # standard deviation of the noisy versions


def network_size(photo):
    """As the library: long side 384, both sides rounded down to multiples of 32."""
    longer = max(photo.shape[:2])
    height, width = (max(32, n * 384 // longer // 32 * 32) for n in photo.shape[:2])
    return cv2.resize(photo, (width, height), interpolation=cv2.INTER_AREA)


def float_student(path):
    net = Student().eval()
    state = torch.load(path)
    if state["ranges"]:
        raise SystemExit(f"{path} is quantised")
    net.load_state_dict(state["average"])

    @torch.no_grad()
    def log_disparity(photo):
        with torch.cpu.amp.autocast(dtype=torch.bfloat16):
            return net(torch.from_numpy(network_size(photo)).permute(2, 0, 1)[None].float() / 255)[0, 0].float().numpy()
    return log_disparity


def portrait(image):
    """The middle of an image, upright 3 : 4."""
    height, width = image.shape[:2]
    w = min(width, height * 3 // 4)
    h = min(height, w * 4 // 3)
    y, x = (height - h) // 2, (width - w) // 2
    return image[y:y + h, x:x + w]


def versions(photo, truth):
    """(name, photograph, disparity)"""
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
    """Photograph, truth and estimates of some pairs, as one picture."""
    def shown(a):
        a = cv2.resize(a.astype(np.float32), (256, 192), interpolation=cv2.INTER_LINEAR)
        low, high = np.nanpercentile(a, (2, 98))
        return cv2.applyColorMap(np.nan_to_num(np.clip((a - low) / (high - low + 1e-9), 0, 1) * 255).astype(np.uint8), cv2.COLORMAP_MAGMA)
    return np.concatenate([np.concatenate([cv2.resize(photo[:, :, ::-1], (256, 192), interpolation=cv2.INTER_AREA)] + [shown(a) for a in others], 1)
                           for photo, *others in rows], 0)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("pairs", "estimate", "teacher"):
        p.add_argument("--" + name, required=True)
    p.add_argument("--float", help="checkpoint of the float network")
    p.add_argument("--quantised", help="what export.py wrote")
    p.add_argument("--sheet", help="where to put a picture of all estimates")
    p.add_argument("--each", action="store_true", help="print every pair too")
    p.add_argument("--quick", action="store_true", help="only the pairs as they are")
    a = p.parse_args()
    warnings.simplefilter("ignore", RuntimeWarning)
    torch.set_num_threads(1)
    networks = {"published, 8 bits": Estimator(a.estimate, a.teacher)}
    if a.float:
        networks["student, float"] = float_student(a.float)
    if a.quantised:
        networks["student, 8 bits"] = Estimator(a.estimate, a.quantised)
    results, pictures = {}, []
    for name, photo, truth in metrics.read_pairs(a.pairs):
        row = [photo, truth]
        for version, image, disparity in versions(photo, truth):
            if a.quick and version != "as they are":
                break
            for network, estimate in networks.items():
                found = np.exp(estimate(image))
                results.setdefault((version, network), []).append(metrics.compare(found, disparity))
                if version == "as they are":
                    row.append(found)
        pictures.append(row)
        if a.each:
            print(f"{name:26s}", "  ".join(f"{n} {results['as they are', n][-1]['delta']:.3f}" for n in networks))
    mean = {at: {m: np.nanmean([float(r[m]) for r in found]) for m in found[0]} for at, found in results.items()}
    measures = ("delta", "abs_rel", "rmse", "edges")
    print("| | delta < 1.25 | AbsRel | RMSE | edges (F1) |\n|---|---|---|---|---|")
    for n in networks:
        print(f"| {n} | " + " | ".join(f"{mean['as they are', n][m]:.3f}" for m in measures) + " |")
    if not a.quick:
        print("\n| delta < 1.25 | " + " | ".join(networks) + " |\n|---|" + "---|" * len(networks))
        for version in dict.fromkeys(v for v, _ in results):
            print(f"| {version} | " + " | ".join(f"{mean[version, n]['delta']:.3f}" for n in networks) + " |")
    if a.sheet:
        cv2.imwrite(a.sheet, sheet(pictures))
    names = list(networks)
    print(f"student {mean['as they are', names[-1]]['delta'] - mean['as they are', names[0]]['delta']:+.3f} delta")


if __name__ == "__main__":
    main()
