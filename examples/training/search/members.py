"""Trains members of the design space (space.py) briefly. The predictor is fitted to their errors.

    python3 members.py --photos FOLDER --estimate PROGRAM --teacher FILE.safetensors --out FOLDER [--depth RGBD_FOLDER]...

The teacher is the shipped network: the library (estimate.cpp) computes its disparity of each photograph, which is the label. All members see
the same batches in the same order, so that batches cause no differences between members. Writes the labels to FOLDER and the results to
members.json. If members.json exists, only members that it lacks are trained, and their results are added.
"""
import argparse
import json
import os
import time

import cv2
import numpy as np
import torch

import space
import data  # this module and the following ones are in ../tiefenrausch_small
import labels
import model
import prepare
from estimator import Estimator
from losses import aligned_error, losses

SIZE, BATCH, RATE, WARM_UP = (64, 96), 4, 3e-3, 10
REPEATED = 3  # number of training runs of the shipped member from different initial weights, to measure the noise of one run


def labeled(folder, program, teacher, count):
    """Yields `count` evenly spaced photographs of the folder with the teacher's disparity, in the format of prepare.write."""
    files = sorted(f for f in os.listdir(folder) if f.lower().endswith((".jpg", ".jpeg", ".png")))
    estimator = Estimator(program, teacher)
    for file in files[::max(1, len(files) // count)][:count]:
        photo = prepare.shrink(prepare.read_color(os.path.join(folder, file)), prepare.LONG_SIDE)
        label = labels.in_range(estimator(photo))
        yield os.path.splitext(file)[0], file.rsplit("_", 1)[0], photo, label, np.zeros(label.shape, np.uint8)


def photographs(out, items):
    if not os.path.exists(os.path.join(out, "index.json")):
        prepare.write(out, items)
    return data.Photographs(out)


def whole(library, entries):
    """Yields batches of whole, unaugmented photographs, on which members are evaluated."""
    view = (0, 0, 1, 1)
    for start in range(0, len(entries), BATCH):
        part = entries[start:start + BATCH]
        yield data.to_tensors(np.stack([data.cut(library.photograph(e), view, SIZE, cv2.INTER_AREA) for e in part]),
                              np.stack([data.cut(library.label(e).astype(np.float32), view, SIZE, cv2.INTER_NEAREST) for e in part]))


@torch.no_grad()
def error_of(net, batches):
    """Returns the mean error of disparity after fitting scale and shift per photograph."""
    errors = []
    for color, truth, known in batches:
        wrong = (aligned_error(net(color), truth, known).abs() * known).sum((1, 2, 3)) / known.sum((1, 2, 3)).clamp(min=1)
        errors.append(wrong)
    return torch.cat(errors).mean().item()


def trained(member, batches, seed):
    """Trains a member with one step per batch. Returns (network, last loss)."""
    torch.manual_seed(seed)
    net = model.Student(space.built(member).operators).to(memory_format=torch.channels_last)
    for layer in net.modules():
        if isinstance(layer, torch.nn.BatchNorm2d):
            layer.momentum = 0.05  # with few steps, the running statistics must adapt faster than in the recipe
    optimizer = torch.optim.AdamW(net.parameters(), RATE, betas=(0.9, 0.99), weight_decay=0.02)
    for step, (colors, truths) in enumerate(batches):
        share = min(1.0, (step + 1) / WARM_UP) * 0.5 * (1 + np.cos(np.pi * step / len(batches)))
        optimizer.param_groups[0]["lr"] = RATE * share
        color, truth, known = data.to_tensors(colors, truths)
        total = sum(losses(net(color), truth, known).values())
        optimizer.zero_grad(set_to_none=True)
        total.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
        optimizer.step()
    return net.eval(), total.item()


def sampled(count):
    """Returns the members to train: the shipped one, and `count` random ones. Draws 20 times as many, sorts them by number of
    multiplications, and keeps every 20th."""
    rng = np.random.default_rng(1)
    drawn = sorted((space.random_member(rng) for _ in range(20 * count)), key=lambda m: model.costs(ops=space.built(m).operators)[1])
    chosen = drawn[10::20]
    chosen = [chosen[i] for i in rng.permutation(count)]
    return [space.SHIPPED, *(tuple(m) for m in chosen)]


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("photos", "estimate", "teacher", "out"):
        p.add_argument("--" + name, required=True)
    p.add_argument("--results", help="default: members.json in --out")
    p.add_argument("--depth", action="append", default=[], help="photographs with measured depth, for a second error; not used in training")
    p.add_argument("--count", type=int, default=480, help="number of photographs; every 8th is held out")
    p.add_argument("--members", type=int, default=20)
    p.add_argument("--steps", type=int, default=150)
    p.add_argument("--also", help="result.json of search.py: also trains the members found there")
    p.add_argument("--threads", type=int, default=1)
    a = p.parse_args()
    torch.set_num_threads(a.threads)
    cv2.setNumThreads(1)
    data.VALIDATION_EVERY = 8
    found = photographs(os.path.join(a.out, "labels"), labeled(a.photos, a.estimate, a.teacher, a.count))
    held_out = list(whole(found.library, found.held_out))
    measured = []
    if a.depth:
        pairs = photographs(os.path.join(a.out, "pairs"), (item for folder in a.depth for item in prepare.measured(folder)))
        measured = list(whole(pairs.library, pairs.library.entries))
    cv2.setRNGSeed(0)
    rng = np.random.default_rng(0)
    batches = []
    for _ in range(a.steps):
        samples = [found.sample(rng, SIZE) for _ in range(BATCH)]
        batches.append((np.stack([c for c, _ in samples]), np.stack([t for _, t in samples]).astype(np.float32)))
    print(f"{len(found.train)} photographs, {len(found.held_out)} held out, {sum(len(c) for c, _, _ in measured)} with measured depth")

    path, results = a.results or os.path.join(a.out, "members.json"), []
    if os.path.exists(path):
        with open(path) as file:
            results = json.load(file)
    jobs = [(m, 0, "sample") for m in sampled(a.members)]
    jobs[4:4] = [(space.SHIPPED, seed, "repeated") for seed in range(1, REPEATED if a.members > 4 else 1)]
    if a.also:
        with open(a.also) as file:
            jobs += [(tuple(m["member"]), 0, "found") for m in json.load(file)["front"]]
    done = {(tuple(r["member"]), r["seed"], r["steps"]) for r in results}
    for member, seed, role in jobs:
        if (member, seed, a.steps) in done:
            continue
        before = time.process_time()
        net, loss = trained(member, batches, seed)
        parameters, products = model.costs(ops=net.operators)
        results.append({"member": member, "seed": seed, "role": role, "steps": a.steps, "loss": round(loss, 5),
                        "error": round(error_of(net, held_out), 5), "measured_error": round(error_of(net, measured), 5) if measured else None,
                        "parameters": parameters, "products": products, "seconds": round(time.process_time() - before, 1)})
        with open(path + ".part", "w") as file:
            file.write("[\n" + ",\n".join(json.dumps(r) for r in results) + "\n]\n")
        os.replace(path + ".part", path)
        print("{role} {seed}: held out {error}, measured {measured_error}, {products:.2e} multiplications, {seconds} s".format(**results[-1]),
              flush=True)


if __name__ == "__main__":
    main()
