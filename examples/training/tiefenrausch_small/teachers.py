"""Writes other networks' estimates of photographs, one small file per photograph and network. Resumes an interrupted run.

    python3 teachers.py --photos PHOTOS --out RAW --teacher FOLDER             layout and detail: TCMonoDepth, small (FOLDER has teacher.py)
    python3 teachers.py --photos PHOTOS --out RAW --published FOLDER --estimate PROGRAM    the published Tiefenrausch, by estimate.cpp
    python3 teachers.py --photos PHOTOS --out RAW --student FILE --estimate PROGRAM        layout: an earlier student, by estimate.cpp
    python3 teachers.py --photos PHOTOS --out RAW --segmentation FOLDER        objects to cut out: DeepLab v3 (FOLDER has tflite_torch.py)
    python3 teachers.py --photos PHOTOS --out RAW --borders FOLDER             borders of salient objects and of the sky (FOLDER has masks.py)

PHOTOS is a folder of photographs, with or without a manifest.json. The output files are RAW/teacher/NAME.npz, RAW/published/NAME.npz,
RAW/student/NAME.npz, RAW/masks/NAME.npz and RAW/borders/NAME.npz. They contain maps with a long side of 384 pixels. The keys are the
network's input sizes for teacher and published, "student", "classes" in masks, and "objects" and "sky" in borders.
"""
import argparse
import json
import os
import sys
import time

import cv2
import numpy as np
import torch

from estimator import Estimator

LABEL_SIDE = 384
SHORT_SIDES = (192, 256, 384)  # input sizes of the teacher
LONG_SIDES = (224, 288)  # input sizes of the published network, in addition to 384
SEGMENTATION_SIDE = 513
MASK_SIDES = {"objects": ("u2netp", 320), "sky": ("sky", 384)}  # files and input sizes of the networks for borders
MEAN, DEVIATION = (0.485, 0.456, 0.406), (0.229, 0.224, 0.225)  # of ImageNet's colors; these networks expect standardized colors


def label_size(photo):
    """Returns (width, height) of a photograph's maps."""
    height, width = (max(1, round(n * LABEL_SIDE / max(photo.shape[:2]))) for n in photo.shape[:2])
    return width, height


def teacher_maps(folder):
    sys.path.append(folder)
    import teacher
    network = teacher.Teacher()
    network.weights = {name: w.contiguous(memory_format=torch.channels_last) if w.dim() == 4 else w for name, w in network.weights.items()}
    return lambda photo: {str(side): teacher.estimate(network, photo, side) for side in SHORT_SIDES}


def published_maps(model, program):
    network = Estimator(program, model)

    def mirrored_too(photo, resize):
        mirrored = network(np.ascontiguousarray(photo[:, ::-1]), resize)[:, ::-1]
        return np.log(network(photo, resize)) / 2 + np.log(mirrored) / 2

    def at_size(photo, side):
        height, width = (max(32, round(n * side / max(photo.shape[:2]) / 32) * 32) for n in photo.shape[:2])
        return cv2.resize(photo, (width, height), interpolation=cv2.INTER_AREA)
    return lambda photo: {"384": mirrored_too(photo, True), **{str(s): mirrored_too(at_size(photo, s), False) for s in LONG_SIDES}}


def masks(folder):
    sys.path.append(folder)
    import tflite_torch
    network = tflite_torch.Net(os.path.join(folder, "deeplabv3_mnv2_pascal_quant.tflite"))

    def classes(photo):
        square = cv2.resize(photo, (SEGMENTATION_SIDE, SEGMENTATION_SIDE), interpolation=cv2.INTER_AREA).astype(np.float32)
        return {"classes": np.asarray(network.run(((square - 128) / 128)[None]))[0].astype(np.uint8)}
    return classes


def borders(folder):
    sys.path.append(folder)
    import masks as runner
    networks = {key: (runner.load(*(os.path.join(folder, f"{name}.{kind}") for kind in ("param", "bin"))), side)
                for key, (name, side) in MASK_SIDES.items()}

    def mask(photo, network, side):
        color = cv2.resize(photo, (side, side), interpolation=cv2.INTER_AREA).astype(np.float32) / 255
        color = (color / max(color.max(), 1e-3) - np.float32(MEAN)) / np.float32(DEVIATION)
        with torch.no_grad():
            found = runner.run(network, torch.from_numpy(color).permute(2, 0, 1)[None])
        first = "out0" if "out0" in found else next(layer[2][0] for layer in network if layer[0] == "Sigmoid")
        share = cv2.resize(np.clip(found[first][0, 0].numpy(), 0, 1), label_size(photo), interpolation=cv2.INTER_LINEAR)
        return (share * 255).astype(np.uint8)
    return lambda photo: {key: mask(photo, *network) for key, network in networks.items()}


def photographs(folder):
    """Returns [(name, path)]."""
    manifest = os.path.join(folder, "manifest.json")
    if os.path.exists(manifest):
        with open(manifest) as file:
            return [(entry["name"], os.path.join(folder, entry["image"])) for entry in json.load(file)]
    return [(os.path.splitext(name)[0], os.path.join(folder, name)) for name in sorted(os.listdir(folder))]


def ask(network, photos, out):
    """Writes the maps of `network` (photograph -> {name: map}) for each photograph that has no file yet."""
    os.makedirs(out, exist_ok=True)
    start, asked = time.time(), 0
    for name, path in photographs(photos):
        target = os.path.join(out, name + ".npz")
        if os.path.exists(target):
            continue
        photo = cv2.cvtColor(cv2.imread(path, cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
        found = {}
        for key, values in network(photo).items():
            is_class = values.dtype == np.uint8
            resized = cv2.resize(values, label_size(photo), interpolation=cv2.INTER_NEAREST if is_class else cv2.INTER_LINEAR)
            found[key] = resized if is_class else resized.astype(np.float16)
        np.savez(target + ".part.npz", **found)
        os.replace(target + ".part.npz", target)
        asked += 1
    print(f"{out}: {asked} photographs in {time.time() - start:.0f} s")


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("photos", "out"):
        p.add_argument("--" + name, required=True)
    for name in ("teacher", "published", "student", "estimate", "segmentation", "borders"):
        p.add_argument("--" + name)
    a = p.parse_args()
    if a.teacher:
        ask(teacher_maps(a.teacher), a.photos, os.path.join(a.out, "teacher"))
    if a.published:
        ask(published_maps(a.published, a.estimate), a.photos, os.path.join(a.out, "published"))
    if a.student:
        network = Estimator(a.estimate, a.student)
        ask(lambda photo: {"student": network(photo)}, a.photos, os.path.join(a.out, "student"))
    if a.borders:
        ask(borders(a.borders), a.photos, os.path.join(a.out, "borders"))
    if a.segmentation:
        ask(masks(a.segmentation), a.photos, os.path.join(a.out, "masks"))


if __name__ == "__main__":
    main()
