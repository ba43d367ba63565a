"""Trains the student on what prepare.py wrote. See README.md.

    python3 train.py --data DATA --out FOLDER --hours H

Everything lies in FOLDER: checkpoint.pt (all that is needed to go on; a second start with the same FOLDER does), log.tsv, snapshots.
To steer it, make a file there:

    stop    save and end. Delete the file and start again to go on.
    hours   holds a number: processor hours that the schedule is to end after, instead of --hours; may change at any time
    finish  come to the end of the schedule within the next 30 minutes of processor time (or as many as the file says)
"""
import argparse
import copy
import math
import os
import signal
import time

import cv2
import numpy as np
import torch

import data
from losses import losses
from model import Student
from quantise import Quantised, find_ranges

WARM_UP = 300  # steps
# The schedule: (share of the processor time until then, pixels of a step, shapes of crops). Small crops first, all of a photograph last.
STAGES = (
    (0.20, 12 * 128 * 128, ((128, 128), (96, 160), (160, 96), (128, 160), (160, 128))),
    (0.55, 8 * 192 * 192, ((192, 192), (160, 224), (224, 160), (192, 224), (224, 192))),
    (0.80, 6 * 256 * 256, ((256, 256), (224, 288), (288, 224), (192, 320), (320, 192))),
    (1.00, 4 * 288 * 384, ((288, 384), (384, 288), (256, 384), (384, 256), (224, 384), (384, 224), (320, 384), (384, 192))),
)
QUANTISED_FROM = 0.80  # share of the schedule that is trained in floating point; the rest has 8 bits
LAST = 0.70  # share of the schedule that `finish` goes on from


def rate_at(progress):
    return 0.5 * (1 + math.cos(math.pi * progress))


@torch.no_grad()
def validate(net, batches):
    """(spread of the error of log disparity, share of pixels within a factor of 1.25, gradient loss): against the teacher, whole photographs."""
    spreads, shares, gradients = [], [], []
    for colour, truth, known in batches:
        with torch.cpu.amp.autocast(dtype=torch.bfloat16):
            y = net(colour)
        error = y.float() - truth
        error = error - error.flatten(1).median(1).values[:, None, None, None]
        spreads.append(error.flatten(1).std(1))
        shares.append((error.abs() < math.log(1.25)).float().flatten(1).mean(1))
        gradients.append(losses(y.float(), truth, known)["gradient"][None].expand(len(colour)))
    return tuple(torch.cat(v).mean().item() for v in (spreads, shares, gradients))


def calibration(photographs, rng):
    """What the ranges of the 8-bit tensors are found from."""
    return [photographs.batch(rng, 4, shape)[0] for shape in STAGES[-1][2] for _ in range(2)]


class Run:
    """The state that a checkpoint holds: the network, its running average (which is what ships), the optimiser and the counts."""

    def __init__(self):
        self.step, self.samples, self.seconds, self.progress = 0, 0, 0.0, 0.0  # seconds of processor time
        self.ranges = None  # quantisation of the tensors, once there is one
        self.use(Student())

    def use(self, net):
        self.net = net.to(memory_format=torch.channels_last)
        self.average = copy.deepcopy(self.net).eval()
        decayed = [p for p in self.net.parameters() if p.dim() > 1]
        others = [p for p in self.net.parameters() if p.dim() <= 1]
        decay = 0.02 if self.ranges is None else 0.0
        self.optimiser = torch.optim.AdamW([{"params": decayed, "weight_decay": decay}, {"params": others, "weight_decay": 0.0}],
                                           betas=(0.9, 0.99))
        self.since = self.step

    def quantise(self, batches):
        """Goes on in 8 bits, from the average of the float network."""
        self.ranges = find_ranges(self.average, batches)
        self.use(Quantised(self.ranges).take(self.average))

    def state(self):
        return {"net": self.net.state_dict(), "average": self.average.state_dict(), "optimiser": self.optimiser.state_dict(),
                "ranges": self.ranges, "step": self.step, "since": self.since, "samples": self.samples, "seconds": self.seconds,
                "progress": self.progress}

    def save(self, path):
        torch.save(self.state(), path + ".part")
        os.replace(path + ".part", path)

    def load(self, path):
        state = torch.load(path)
        if state["ranges"]:
            self.ranges = state["ranges"]
            self.use(Quantised(self.ranges))
        self.net.load_state_dict(state["net"])
        self.average.load_state_dict(state["average"])
        self.optimiser.load_state_dict(state["optimiser"])
        self.step, self.since, self.samples, self.seconds = (state[n] for n in ("step", "since", "samples", "seconds"))
        self.progress = state.get("progress", 0.0)

    @torch.no_grad()
    def follow(self):
        """Moves the average towards the network."""
        steps = self.step - self.since
        decay = min(0.999, (steps + 1) / (steps + 10))
        for mean, value in zip(self.average.state_dict().values(), self.net.state_dict().values()):
            mean.lerp_(value, 1 - decay) if mean.dtype.is_floating_point else mean.copy_(value)

    def learn(self, batch, rate):
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        colour, truth, known = batch
        with torch.cpu.amp.autocast(dtype=torch.bfloat16):
            y = self.net(colour)
        terms = losses(y, truth, known)
        self.optimiser.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        norm = torch.nn.utils.clip_grad_norm_(self.net.parameters(), 2.0)
        if not torch.isfinite(norm):
            return {}
        self.optimiser.step()
        self.step += 1
        self.samples += len(colour)
        self.follow()
        return {**{name: term.item() for name, term in terms.items()}, "norm": norm.item()}


class Schedule:
    """How far the training has come, 0 to 1, from the processor time spent and the files that steer it."""

    def __init__(self, folder, hours):
        self.folder, self.hours, self.hurry = folder, hours, None

    def read(self, name, default):
        try:
            with open(os.path.join(self.folder, name)) as file:
                return float(file.read().strip() or default)
        except (FileNotFoundError, ValueError):
            return None

    def progress(self, seconds, reached):
        """reached  what this returned last, if this is a new start"""
        hours = self.read("hours", self.hours) or self.hours
        progress = min(1.0, seconds / (3600 * hours))
        minutes = self.read("finish", 30.0)
        if minutes is None:
            self.hurry = None
            return progress
        if self.hurry is None:
            self.hurry = (max(LAST, progress, reached), seconds)
        start, since = self.hurry
        return min(1.0, start + (1 - start) * (seconds - since) / (60 * minutes))


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--data", required=True, help="folder that prepare.py wrote")
    p.add_argument("--out", required=True, help="folder for checkpoints and log")
    p.add_argument("--hours", type=float, default=6.0, help="processor hours of the whole schedule")
    p.add_argument("--rate", type=float, default=2e-3, help="learning rate")
    p.add_argument("--threads", type=int, default=1)
    return p.parse_args()


def main():
    a = arguments()
    torch.set_num_threads(a.threads)
    torch.manual_seed(0)
    cv2.setNumThreads(1)
    os.makedirs(a.out, exist_ok=True)

    def path(name):
        return os.path.join(a.out, name)

    run, checkpoint = Run(), path("checkpoint.pt")
    if os.path.exists(checkpoint):
        run.load(checkpoint)
    rng = np.random.default_rng([7, run.step])
    cv2.setRNGSeed(run.step)
    photographs = data.Photographs(a.data)
    validation = photographs.validation_batches((288, 384))
    print(f"{len(photographs.train)} photographs, {len(photographs.held_out)} more held out; from step {run.step}", flush=True)

    asked = []
    signal.signal(signal.SIGTERM, lambda *_: asked.append("stop"))
    schedule = Schedule(a.out, a.hours)
    before, processor = run.seconds, time.process_time()
    saved, looked, snapped = time.time(), run.seconds if run.step > 0 else -math.inf, run.seconds
    means = {}
    while True:
        run.seconds = before + time.process_time() - processor
        progress = schedule.progress(run.seconds, run.progress)
        if run.ranges is not None:
            progress = max(progress, QUANTISED_FROM)  # there is no way back
        run.progress = progress
        done = asked or progress >= 1 or os.path.exists(path("stop"))
        if run.seconds - looked > 300 or done:
            looked = run.seconds
            spread, share, gradient = validate(run.average, validation)
            new = not os.path.exists(path("log.tsv"))
            with open(path("log.tsv"), "a") as log:
                names = ("data", "gradient", "norm")
                if new:
                    log.write("\t".join(("step", "samples", "processor_hours", "progress", *names, "spread", "delta", "held_out_gradient")) + "\n")
                log.write("\t".join(str(v) for v in (run.step, run.samples, f"{run.seconds / 3600:.4f}", f"{progress:.4f}",
                                                     *(f"{means.get(n, float('nan')):.4f}" for n in names),
                                                     f"{spread:.4f}", f"{share:.4f}", f"{gradient:.4f}")) + "\n")
            print(f"{time.strftime('%H:%M:%S')} step {run.step} {run.seconds / 3600:.2f} h ({100 * progress:.1f} %)  "
                  + "  ".join(f"{n} {v:.3f}" for n, v in means.items())
                  + f"  held out: spread {spread:.3f}, within 1.25 {share:.3f}, gradient {gradient:.3f}", flush=True)
        if done or time.time() - saved > 300:
            saved = time.time()
            run.save(checkpoint)
        if run.seconds - snapped > 3600:
            snapped = run.seconds
            run.save(path(f"step_{run.step:07d}.pt"))
        if done:
            break
        if progress >= QUANTISED_FROM and run.ranges is None:
            run.save(path("float.pt"))
            run.quantise(calibration(photographs, rng))
            print(f"step {run.step}: on in 8 bits", flush=True)
        _, pixels, shapes = next(s for s in STAGES if progress < s[0])
        shape = shapes[rng.integers(len(shapes))]
        rate = a.rate * min(1.0, (run.step - run.since + 1) / WARM_UP) * rate_at(progress)
        for name, value in run.learn(photographs.batch(rng, round(pixels / (shape[0] * shape[1])), shape), rate).items():
            means[name] = value if name not in means else 0.99 * means[name] + 0.01 * value
    if progress >= 1:
        run.save(path("final.pt"))
    print("ended", flush=True)


if __name__ == "__main__":
    main()
