"""Trains the silhouette network on the output of prepare.py until it is stopped. See README.md.

    python3 train.py --data DATA --held-out DATA --out FOLDER

Writes checkpoint.pt, log.tsv and snapshots to FOLDER. The checkpoint has the complete state: the same command resumes an interrupted
run. To control a run, create one of these files in FOLDER:

    stop    saves and ends. Delete the file and start again to resume.
    finish  lowers the learning rate to zero along a cosine over the next 10 minutes, or the number of minutes in the file, saves and ends.
"""
import argparse
import copy
import glob
import math
import os
import signal
import sys
import time

import numpy as np
import torch
import torch.nn.functional as F

import composites
import quantize
from model import Silhouettes

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "farbrausch"))
from muon import Muon  # noqa: E402

WARM_UP = 200  # steps
SOFT_WEIGHT, GRADIENT_WEIGHT, DOUBT_WEIGHT = 2.0, 0.7, 0.1
FILES_PER_BATCH = 4  # more than one, because each file has crops of only a few photographs
SAVE_SECONDS, LOOK_SECONDS, SNAPSHOT_SECONDS = 120, 300, 1800


class Crops:
    """Crops of all files in the given folders, including files that prepare.py adds during training."""

    def __init__(self, folders):
        self.folders, self.files = folders, {}
        self.find()

    def find(self):
        for folder in self.folders:
            for path in sorted(glob.glob(os.path.join(folder, "[0-9]*.npy"))):
                if path not in self.files:
                    self.files[path] = np.load(path, mmap_mode="r")
        self.paths = list(self.files)

    def __len__(self):
        return sum(len(f) for f in self.files.values())

    def batch(self, rng, count):
        """Returns augmented crops of random files."""
        assert count % FILES_PER_BATCH == 0, f"--batch: expected a multiple of {FILES_PER_BATCH}, found {count}"
        files = [self.files[self.paths[int(rng.integers(len(self.paths)))]] for _ in range(FILES_PER_BATCH)]
        x, alpha, state = tensors(np.concatenate([f[np.sort(rng.choice(len(f), count // len(files), replace=False))] for f in files]))
        for dim in (2, 3):
            if rng.random() < 0.5:
                x, alpha, state = (t.flip(dim) for t in (x, alpha, state))
        if rng.random() < 0.5:
            x, alpha, state = (t.transpose(2, 3) for t in (x, alpha, state))
        region = (state > composites.OUTSIDE).float()
        gain, shift = torch.from_numpy(rng.normal((1, 0), (0.15, 0.1), (count, 2)).astype(np.float32))[:, :, None, None, None].unbind(1)
        colors = (x[:, :3] * gain + shift).clamp(-1, 1) * region
        if rng.random() < 0.3:
            colors = colors[:, torch.from_numpy(rng.permutation(3))]
        return torch.cat([colors, x[:, 3:]], 1), alpha, state


def tensors(crops):
    """Converts crops of prepare.py (N x 10 x S x S bytes) to (input, alpha, state), each N x C x S x S."""
    t = torch.from_numpy(np.array(crops))
    return (t[:, :8].float() - 128) / 127, t[:, 8:9].float() / 255, t[:, 9:10]


def losses(logits, alpha, state):
    """Returns the terms of the loss, each a scalar."""
    p = torch.sigmoid(logits[:, :1])
    known, none = (state == composites.LABELED).float(), (state == composites.NO_STEP).float()
    area = known.sum().clamp(min=1)
    error = (p - alpha).abs()
    weight = known * (1 + SOFT_WEIGHT * 4 * alpha * (1 - alpha))  # higher weight where both surfaces share a pixel
    terms, gradient = {"alpha": (weight * error).sum() / area}, 0.0
    for dim in (2, 3):
        n = p.shape[dim] - 1
        step = (p - alpha).narrow(dim, 1, n) - (p - alpha).narrow(dim, 0, n)
        gradient = gradient + (step.abs() * known.narrow(dim, 1, n) * known.narrow(dim, 0, n)).sum() / area
    terms["gradient"] = GRADIENT_WEIGHT * gradient
    right = ((p > 0.5) == (alpha > 0.5)).float().detach()
    count = known * ((alpha - 0.5).abs() > 0.1).float() + none
    doubt = F.binary_cross_entropy_with_logits(logits[:, 1:], right * known, reduction="none")
    terms["doubt"] = DOUBT_WEIGHT * (doubt * count).sum() / count.sum().clamp(min=1)
    return terms


@torch.no_grad()
def validate(net, batches, observe):
    """Returns percentages over the labeled pixels: (pixels that the network assigns to the wrong side, pixels that the prepared disparity
    assigns to the wrong side, mean absolute error of alpha)."""
    wrong, before, error, pixels = 0.0, 0.0, 0.0, 0.0
    for x, alpha, state in batches:
        known = (state == composites.LABELED).float()
        p = torch.sigmoid(net(x, (state > composites.OUTSIDE).float(), observe)[:, :1])
        wrong += (((p > 0.5) != (alpha > 0.5)).float() * known).sum().item()
        before += (((x[:, 4:5] > 0) != (alpha > 0.5)).float() * known).sum().item()
        error += ((p - alpha).abs() * known).sum().item()
        pixels += known.sum().item()
    return 100 * wrong / pixels, 100 * before / pixels, 100 * error / pixels


class Run:
    """State of a checkpoint: the network, its running average (which is exported), the optimizer and the counts.

    ranges: value ranges of the 8-bit tensors, to train with rounded values, or None"""

    def __init__(self, rate, mixed, ranges=None):
        self.net = Silhouettes()
        if ranges:
            for layer in self.net.layers:
                layer.fold()
        self.net = self.net.to(memory_format=torch.channels_last)
        self.average = copy.deepcopy(self.net).eval()
        self.optimizer = Muon(self.net.parameters(), rate, dtype=torch.bfloat16 if mixed else torch.float32)
        self.mixed, self.step, self.seconds, self.ranges = mixed, 0, 0.0, ranges

    def save(self, path):
        torch.save({"net": self.net.state_dict(), "average": self.average.state_dict(), "optimizer": self.optimizer.state_dict(),
                    "step": self.step, "seconds": self.seconds, "ranges": self.ranges}, path + ".part")
        os.replace(path + ".part", path)

    def load(self, path):
        state = torch.load(path)
        self.net.load_state_dict(state["net"])
        self.average.load_state_dict(state["average"])
        self.optimizer.load_state_dict(state["optimizer"])
        for group in self.optimizer.param_groups:  # uses the options of this run, not those stored in the checkpoint
            group.update(self.optimizer.defaults)
        self.step, self.seconds = state["step"], state["seconds"]

    def observe(self, net):
        """Returns the function that rounds values to 8 bits; the identity during training in floating point."""
        return quantize.rounding(self.ranges) if self.ranges else lambda name, value: value

    @torch.no_grad()
    def follow(self):
        """Moves the average toward the network."""
        decay = min(0.999, (self.step + 1) / (self.step + 10))
        now = self.net.state_dict()
        for name, mean in self.average.state_dict().items():
            mean.lerp_(now[name], 1 - decay) if mean.dtype.is_floating_point else mean.copy_(now[name])

    def learn(self, batch, rate):
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        x, alpha, state = batch
        region = (state > composites.OUTSIDE).float()
        x = x.contiguous(memory_format=torch.channels_last)
        with torch.cpu.amp.autocast(enabled=self.mixed, dtype=torch.bfloat16), quantize.rounded_weights(self.net, self.ranges):
            logits = self.net(x, region, self.observe(self.net))
        terms = losses(logits.float(), alpha, state)
        self.optimizer.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        norm = torch.nn.utils.clip_grad_norm_(self.net.parameters(), 5.0)
        if not torch.isfinite(norm):
            self.optimizer.zero_grad(set_to_none=True)
            return None
        self.optimizer.step()
        self.step += 1
        self.follow()
        return {name: term.item() for name, term in terms.items()}


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--data", required=True, action="append", help="folder of prepare.py; may be given several times")
    p.add_argument("--held-out", required=True, help="folder of prepare.py for photographs that training does not use")
    p.add_argument("--out", required=True, help="folder for checkpoints and log")
    p.add_argument("--quantize", help="start from this checkpoint or exported file, and train with values and weights rounded to 8 bits")
    p.add_argument("--batch", type=int, default=16, help="crops per step")
    p.add_argument("--rate", type=float, default=2e-3, help="learning rate")
    p.add_argument("--threads", type=int, default=1)
    p.add_argument("--float32", action="store_true", help="no bfloat16 in the convolutions (slower on processors that have it)")
    p.add_argument("--minutes", type=float, help="finish after this number of minutes; default: never")
    return p.parse_args()


def main():
    a = arguments()
    torch.set_num_threads(a.threads)
    torch.manual_seed(0)
    os.makedirs(a.out, exist_ok=True)

    def path(name):
        return os.path.join(a.out, name)

    crops, held_out = Crops(a.data), Crops([a.held_out])
    validation = [tensors(f[i:i + 32]) for f in held_out.files.values() for i in range(0, len(f), 32)][:16]
    checkpoint, start_from, ranges = path("checkpoint.pt"), None, None
    if a.quantize:
        start_from, ranges = quantize.network_of(a.quantize)
        ranges = ranges or quantize.value_ranges(start_from, [crops.batch(np.random.default_rng(5), 32) for _ in range(20)])
    run = Run(a.rate, not a.float32, ranges)
    if os.path.exists(checkpoint):
        run.load(checkpoint)
    elif start_from is not None:
        run.net.load_state_dict(start_from.state_dict())
        run.average.load_state_dict(run.net.state_dict())
    rng = np.random.default_rng([7, run.step])
    weights, products = run.net.cost()
    print(f"{weights} weights, {products:.0f} multiplications per pixel; {len(crops)} crops; from step {run.step}", flush=True)

    asked = []
    signal.signal(signal.SIGTERM, lambda *_: asked.append("stop"))
    before, processor, start = run.seconds, time.process_time(), time.time()
    saved, looked, snapped = time.time(), run.seconds if run.step > 0 else 0, run.seconds
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
        if run.seconds - looked > LOOK_SECONDS or done:
            looked = run.seconds
            with quantize.rounded_weights(run.average, ranges):
                wrong, threshold, error = validate(run.average, validation, run.observe(run.average))
            new = not os.path.exists(path("log.tsv"))
            with open(path("log.tsv"), "a") as log:
                names = ("alpha", "gradient", "doubt")
                if new:
                    log.write("\t".join(("step", "processor_hours", "crops", *names, "wrong", "threshold", "error")) + "\n")
                log.write("\t".join(str(v) for v in (run.step, f"{run.seconds / 3600:.4f}", len(crops),
                                                     *(f"{means.get(n, float('nan')):.4f}" for n in names),
                                                     f"{wrong:.3f}", f"{threshold:.3f}", f"{error:.3f}")) + "\n")
            print(f"{time.strftime('%H:%M:%S')} step {run.step} {run.seconds / 3600:.2f} h, {len(crops)} crops: wrong side {wrong:.2f} % "
                  f"(threshold {threshold:.2f}), error {error:.2f} %", flush=True)
        if done or time.time() - saved > SAVE_SECONDS:
            saved = time.time()
            crops.find()
            run.save(checkpoint)
        if run.seconds - snapped > SNAPSHOT_SECONDS:
            snapped = run.seconds
            run.save(path(f"step_{run.step:07d}.pt"))
        if done:
            break
        rate = a.rate * min(1.0, (run.step + 1) / WARM_UP) * 0.5 * (1 + math.cos(math.pi * fallen))
        for name, value in (run.learn(crops.batch(rng, a.batch), rate) or {}).items():
            means[name] = value if name not in means else 0.99 * means[name] + 0.01 * value
    if fallen >= 1:
        run.save(path("final.pt"))
    print("ended", flush=True)


if __name__ == "__main__":
    main()
