"""Trains Farbrausch on a folder of photographs until it is stopped. See README.md.

    python3 train.py --photos PHOTOS --out FOLDER

Writes checkpoint.pt, log.tsv and snapshots to FOLDER. The checkpoint has the complete state: the same command resumes an interrupted
run. To control a run, create one of these files in FOLDER:

    stop    saves and ends. Delete the file and start again to resume.
    finish  lowers the learning rate to zero along a cosine over the next 10 minutes, or the number of minutes in the file, saves and ends.
"""
import argparse
import copy
import math
import os
import signal
import sys
import time

import cv2
import numpy as np
import torch
import torch.nn.functional as F

import data
import export
import masks
from model import Farbrausch
from muon import Muon

WARM_UP = 300  # steps
MASKS = 4000
ABSOLUTE_WEIGHT, DECIBEL_WEIGHT, GRADIENT_WEIGHT, PERCEIVED_WEIGHT = 2.0, 0.6, 0.7, 0.5  # weights of the terms of the loss
GRADIENT_SCALES = 4
VALIDATION_CROPS = 64
CALIBRATION_BATCHES = 20


def losses(y, image, known, exists):
    """Returns the terms of the loss, each a scalar. They cover pixels in holes, because the library never uses the network's values at
    known pixels. The gradient term also covers the rims of holes, with an error of 0 on the known side."""
    hole = exists * (1 - known)
    area = hole.sum((1, 2, 3)).clamp(min=1)
    error, terms = (y - image) * hole, {}
    terms["hole"] = ABSOLUTE_WEIGHT * error.abs().sum() / (3 * area.sum())
    # The logarithm gives easy holes (sky) the same weight as hard ones. Except for sign, scale and offset, this term is the mean PSNR.
    terms["decibel"] = DECIBEL_WEIGHT * torch.log((error ** 2).sum((1, 2, 3)) / (3 * area) + 1e-4).mean()
    gradient, weight = 0.0, exists
    for scale in range(GRADIENT_SCALES):
        if scale > 0:
            error, weight, hole = (F.avg_pool2d(t, 2) for t in (error, weight, hole))
        level = error / weight.clamp(min=1e-3)
        for dim in (2, 3):
            n = level.shape[dim] - 1
            step = level.narrow(dim, 1, n) - level.narrow(dim, 0, n)
            counts = ((hole.narrow(dim, 1, n) + hole.narrow(dim, 0, n) > 0) & (weight.narrow(dim, 1, n) * weight.narrow(dim, 0, n) > 0)).float()
            gradient = gradient + (step.abs() * counts).sum() / (3 * counts.sum()).clamp(min=1)
    terms["gradient"] = GRADIENT_WEIGHT * gradient
    return terms


def perceived_difference(lpips, y, image, known, exists):
    """Returns the mean over the holes of the LPIPS map between the crop with filled holes and the original crop."""
    hole = exists * (1 - known)
    truth = image * exists * 2 - 1
    filled = torch.where(hole > 0, y.clamp(0, 1) * 2 - 1, truth)
    return (lpips(filled, truth, mean=False) * hole).sum() / hole.sum().clamp(min=1)


@torch.no_grad()
def validate(net, batches):
    """Returns (PSNR in dB, mean absolute color error 0 to 255, gradient magnitude of the fill relative to the truth's) inside holes."""
    decibels, errors, ours, true = [], [], 0.0, 0.0
    for image, known, exists in batches:
        hole = exists * (1 - known)
        y = net(image, known, exists).clamp(0, 1)
        area = 3 * hole.sum((1, 2, 3)).clamp(min=1)
        decibels.append(-10 * torch.log10((((y - image) ** 2 * hole).sum((1, 2, 3)) / area).clamp(min=1e-6)))
        errors.append(255 * ((y - image).abs() * hole).sum((1, 2, 3)) / area)
        inside = hole[:, :, :, 1:] * hole[:, :, :, :-1]
        ours += ((y[:, :, :, 1:] - y[:, :, :, :-1]).abs() * inside).sum().item()
        true += ((image[:, :, :, 1:] - image[:, :, :, :-1]).abs() * inside).sum().item()
    return torch.cat(decibels).mean().item(), torch.cat(errors).mean().item(), ours / true


@torch.no_grad()
def continue_from(net, path, batches):
    """Loads an exported file, in which normalization is folded into the weights. Inserts a new normalization into each layer without
    changing the layer's output. The scale and shift of the normalization are the standard deviation and the mean of the layer's output on
    the batches."""
    for (_, layer), (_, folded) in zip(export.layers(net), export.layers(export.network_of(path))):
        layer.weight.copy_(folded.weight)
        if layer.norm is None:
            layer.bias.copy_(folded.bias)
        else:
            layer.norm.weight.fill_(math.sqrt(1 + layer.norm.eps))
            layer.norm.bias.copy_(folded.bias)
    net.eval()
    seen = {layer.norm: [] for _, layer in export.layers(net) if layer.norm is not None}
    hooks = [norm.register_forward_hook(lambda norm, inputs, _: seen[norm].append(torch.var_mean(inputs[0], (0, 2, 3))))
             for norm in seen]
    for image, known, exists in batches:
        net(image, known, exists)
    for norm, statistics in seen.items():
        spread, mean = (torch.stack(values).mean(0) for values in zip(*statistics))
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(spread)
        norm.weight.copy_(torch.sqrt(spread + norm.eps))
        norm.bias.add_(mean)
    for hook in hooks:
        hook.remove()
    net.train()


class Run:
    """State of a checkpoint: the network, its running average (which is exported), the optimizer and the counts.

    lpips: a differentiable LPIPS for the loss, or None"""

    def __init__(self, rate, mixed, lpips=None):
        self.lpips = lpips
        self.net = Farbrausch().to(memory_format=torch.channels_last)
        self.average = copy.deepcopy(self.net).eval()
        self.optimizer = Muon(self.net.parameters(), rate, dtype=torch.bfloat16 if mixed else torch.float32)
        self.mixed = mixed
        self.step, self.seconds = 0, 0.0  # processor seconds

    def state(self):
        return {"net": self.net.state_dict(), "average": self.average.state_dict(), "optimizer": self.optimizer.state_dict(),
                "step": self.step, "seconds": self.seconds}

    def save(self, path):
        torch.save(self.state(), path + ".part")
        os.replace(path + ".part", path)

    def load(self, path):
        state = torch.load(path)
        self.net.load_state_dict(state["net"])
        self.average.load_state_dict(state["average"])
        self.optimizer.load_state_dict(state["optimizer"])
        for group in self.optimizer.param_groups:  # uses the options of this run, not those stored in the checkpoint
            group.update(self.optimizer.defaults)
        self.step, self.seconds = state["step"], state["seconds"]

    @torch.no_grad()
    def follow(self):
        """Moves the average toward the network."""
        decay = min(0.9995, (self.step + 1) / (self.step + 10))
        for mean, value in zip(self.average.state_dict().values(), self.net.state_dict().values()):
            mean.lerp_(value, 1 - decay) if mean.dtype.is_floating_point else mean.copy_(value)

    def learn(self, batch, rate):
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        image, known, exists = batch
        with torch.cpu.amp.autocast(enabled=self.mixed, dtype=torch.bfloat16):
            y = self.net(image, known, exists)
        terms = losses(y.float(), image, known, exists)
        if self.lpips:
            with torch.cpu.amp.autocast(enabled=self.mixed, dtype=torch.bfloat16):
                terms["lpips"] = PERCEIVED_WEIGHT * perceived_difference(self.lpips, y.float(), image, known, exists)
        self.optimizer.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        norm = torch.nn.utils.clip_grad_norm_(self.net.parameters(), 5.0)
        if not torch.isfinite(norm):
            self.optimizer.zero_grad(set_to_none=True)
            return None
        self.optimizer.step()
        self.step += 1
        self.follow()
        return {**{name: term.item() for name, term in terms.items()}, "norm": norm.item()}


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--photos", required=True, help="folder of photographs")
    p.add_argument("--out", required=True, help="folder for checkpoints and log")
    p.add_argument("--weights", help="exported weights to start from if FOLDER has no checkpoint, for example to fine-tune them on your own photographs")
    p.add_argument("--disparities", help="output folder of tiefenrausch_small/prepare.py for the photographs, for holes behind their own surfaces")
    p.add_argument("--lpips", help="folder of lpips.py, to add the perceived difference to the loss")
    p.add_argument("--crop", type=int, default=128, help="width in pixels, a multiple of 32")
    p.add_argument("--batch", type=int, default=16, help="crops per step")
    p.add_argument("--rate", type=float, default=1.5e-3, help="learning rate")
    p.add_argument("--threads", type=int, default=1)
    p.add_argument("--float32", action="store_true", help="no bfloat16 in the convolutions (slower on processors that have it)")
    p.add_argument("--minutes", type=float, help="finish after this number of minutes; default: never")
    return p.parse_args()


def main():
    a = arguments()
    torch.set_num_threads(a.threads)
    torch.manual_seed(0)
    cv2.setNumThreads(a.threads)
    os.makedirs(a.out, exist_ok=True)

    def path(name):
        return os.path.join(a.out, name)

    lpips = None
    if a.lpips:
        sys.path.append(a.lpips)
        from lpips import lpips
    run, checkpoint = Run(a.rate, not a.float32, lpips), path("checkpoint.pt")
    if os.path.exists(checkpoint):
        run.load(checkpoint)
    rng = np.random.default_rng([7, run.step])
    photographs, bank = data.Photographs(a.photos, a.disparities), masks.bank(MASKS, seed=3)
    validation = photographs.validation_batches(VALIDATION_CROPS)
    if a.weights and run.step == 0:
        continue_from(run.net, a.weights, (photographs.batch(rng, bank, a.batch, a.crop) for _ in range(CALIBRATION_BATCHES)))
        run.average.load_state_dict(run.net.state_dict())
    print(f"{len(photographs.train)} photographs, {len(photographs.held_out)} more held out; from step {run.step}", flush=True)

    asked = []
    signal.signal(signal.SIGTERM, lambda *_: asked.append("stop"))
    before, processor, start = run.seconds, time.process_time(), time.time()
    saved, looked, snapped = time.time(), run.seconds if run.step > 0 else -math.inf, run.seconds
    fallen, falls_for, last, means = 0.0, None, time.time(), {}  # share of the final decay, its seconds, time of the last step
    while True:
        run.seconds = before + time.process_time() - processor
        if falls_for is not None:
            fallen += min(time.time() - last, 30.0) / falls_for  # a paused training does not end early
        last = time.time()
        if falls_for is None and (os.path.exists(path("finish")) or (a.minutes and time.time() - start > 60 * a.minutes)):
            text = open(path("finish")).read().strip() if os.path.exists(path("finish")) else ""
            falls_for = 60 * max(float(text) if text else 10.0, 1.0)
            print(f"step {run.step}: finishing within {falls_for / 60:.0f} minutes", flush=True)
        done = asked or fallen >= 1 or os.path.exists(path("stop"))
        if run.seconds - looked > 600 or done:
            looked = run.seconds
            decibels, error, texture = validate(run.average, validation)
            new = not os.path.exists(path("log.tsv"))
            with open(path("log.tsv"), "a") as log:
                names = ("hole", "decibel", "gradient", "lpips", "norm")
                if new:
                    log.write("\t".join(("step", "processor_hours", *names, "psnr", "color_error", "texture")) + "\n")
                log.write("\t".join(str(v) for v in (run.step, f"{run.seconds / 3600:.4f}", *(f"{means.get(n, float('nan')):.4f}" for n in names),
                                                     f"{decibels:.3f}", f"{error:.3f}", f"{texture:.3f}")) + "\n")
            print(f"{time.strftime('%H:%M:%S')} step {run.step} {run.seconds / 3600:.2f} h  PSNR {decibels:.2f} dB  color error {error:.2f}  "
                  f"texture {texture:.2f}", flush=True)
        if done or time.time() - saved > 300:
            saved = time.time()
            run.save(checkpoint)
        if run.seconds - snapped > 3600:
            snapped = run.seconds
            run.save(path(f"step_{run.step:07d}.pt"))
        if done:
            break
        rate = a.rate * min(1.0, (run.step + 1) / WARM_UP) * 0.5 * (1 + math.cos(math.pi * fallen))
        for name, value in (run.learn(photographs.batch(rng, bank, a.batch, a.crop), rate) or {}).items():
            means[name] = value if name not in means else 0.99 * means[name] + 0.01 * value
    if fallen >= 1:
        run.save(path("final.pt"))
    print("ended", flush=True)


if __name__ == "__main__":
    main()
