"""Trains the student on the output of prepare.py. See README.md.

    python3 train.py --data DATA --out FOLDER --hours H --backbone FILE.tflite | --weights FILE.safetensors [--watch FOLDER]

Writes checkpoint.pt, log.tsv and snapshots to FOLDER. The checkpoint has the complete state: the same command resumes an interrupted
run. To control a run, create one of these files in FOLDER:

    stop    saves and ends. Delete the file and start again to resume.
    hours   contains a number, which replaces --hours (processor hours of the schedule); may change at any time
    finish  completes the schedule within the next 30 minutes of processor time, or the number of minutes in the file
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

import backbone
import data
import export
import metrics
from losses import aligned_error, losses
import model
from model import Student
from quantize import Quantized, find_ranges

WARM_UP = 300  # steps
# The schedule: (end as a share of the processor time, pixels per step, shapes of crops). It starts with small crops and ends with whole
# photographs.
STAGES = (
    (0.30, 10 * 192 * 192, ((192, 192), (160, 224), (224, 160), (192, 224), (224, 192))),
    (0.60, 6 * 256 * 256, ((256, 256), (224, 288), (288, 224), (192, 320), (320, 192))),
    (1.00, 4 * 288 * 384, data.WHOLE),
)
QUANTIZED_FROM = 0.80  # share of the schedule after which training continues in 8 bits
LAST = 0.70  # `finish` jumps to this share of the schedule


def rate_at(progress):
    return 0.5 * (1 + math.cos(math.pi * progress))


BACKBONE_RATE = 0.2  # factor of the learning rate for the pretrained features


@torch.no_grad()
def validate(net, batches):
    """Returns (mean error, loss of differences) against the labels of held-out photographs, each aligned by scale and shift."""
    errors, differences = [], []
    for color, truth, known in batches:
        y = net(color)
        errors.append(aligned_error(y, truth, known).abs().flatten(1).mean(1))
        differences.append(losses(y, truth, known)["gradient"][None].expand(len(color)))
    return tuple(torch.cat(v).mean().item() for v in (errors, differences))


class Watched:
    """Photographs with depth from data sets that training does not use."""

    def __init__(self, folder, most=60):
        pairs = list(metrics.read_pairs(folder)) if folder else []
        self.pairs = [(metrics.network_size(photo), truth) for _, photo, truth in pairs[::max(1, len(pairs) // most)]]

    @torch.no_grad()
    def measure(self, net):
        """Returns {measure: mean} of metrics.compare."""
        found = []
        for photo, truth in self.pairs:
            color = torch.from_numpy(photo).permute(2, 0, 1)[None].float().div(255).contiguous(memory_format=torch.channels_last)
            found.append(metrics.compare(net(color)[0, 0].numpy(), truth))
        return {m: float(np.nanmean([f[m] for f in found])) for m in ("delta", "abs_rel", "edges")} if found else {}


class Run:
    """State of a checkpoint: the network, its running average (which is exported), the optimizer and the counts."""

    def __init__(self, network, loss_weights):
        """network       name for model.network()
        loss_weights  {"gradient": weight, "rank": weight}, for losses.losses()"""
        self.network, self.loss_weights = network, loss_weights
        self.step, self.samples, self.seconds, self.progress = 0, 0, 0.0, 0.0  # processor seconds
        self.ranges = None  # quantization of the tensors; None during training in floating point
        self.use(Student(*model.network(network)))

    def use(self, net):
        self.net = net.to(memory_format=torch.channels_last)
        self.average = copy.deepcopy(self.net).eval()
        decay = 0.02 if self.ranges is None else 0.0
        groups = {}
        for name, p in self.net.named_parameters():
            old = name.split(".")[1].startswith(("stem", "down"))
            groups.setdefault((BACKBONE_RATE if old else 1.0, decay if p.dim() > 1 and not old else 0.0), []).append(p)
        self.optimizer = torch.optim.AdamW([{"params": p, "share": share, "weight_decay": d} for (share, d), p in groups.items()],
                                           betas=(0.9, 0.99))
        self.since = self.step

    def quantized(self):
        ops, logarithmic = model.network(self.network)
        return Quantized(self.ranges, ops=ops, logarithmic=logarithmic)

    def quantize(self, batches):
        """Switches to 8 bits, from the average of the float network."""
        self.ranges = find_ranges(self.average, batches)
        self.use(self.quantized().take(self.average))

    def quantize_as(self, tensors):
        """Switches to 8 bits, with the quantization of a file's tensors."""
        self.ranges = export.ranges_of(tensors, self.net.operators)
        self.use(self.quantized().take(self.net))

    def state(self):
        return {"net": self.net.state_dict(), "average": self.average.state_dict(), "optimizer": self.optimizer.state_dict(),
                "network": self.network, "ranges": self.ranges, "step": self.step, "since": self.since, "samples": self.samples,
                "seconds": self.seconds, "progress": self.progress}

    def save(self, path):
        torch.save(self.state(), path + ".part")
        os.replace(path + ".part", path)

    def load(self, path):
        state = torch.load(path)
        if state["ranges"]:
            self.ranges = state["ranges"]
            self.use(self.quantized())
        self.net.load_state_dict(state["net"])
        self.average.load_state_dict(state["average"])
        self.optimizer.load_state_dict(state["optimizer"])
        self.step, self.since, self.samples, self.seconds = (state[n] for n in ("step", "since", "samples", "seconds"))
        self.progress = state.get("progress", 0.0)

    @torch.no_grad()
    def follow(self):
        """Moves the average toward the network."""
        steps = self.step - self.since
        decay = min(0.999, (steps + 1) / (steps + 10))
        for mean, value in zip(self.average.state_dict().values(), self.net.state_dict().values()):
            mean.lerp_(value, 1 - decay) if mean.dtype.is_floating_point else mean.copy_(value)

    def learn(self, batch, rate):
        for group in self.optimizer.param_groups:
            group["lr"] = rate * group["share"]
        color, truth, known = batch
        terms = losses(self.net(color), truth, known, **self.loss_weights)
        self.optimizer.zero_grad(set_to_none=True)
        sum(terms.values()).backward()
        norm = torch.nn.utils.clip_grad_norm_(self.net.parameters(), 1.0)
        if not torch.isfinite(norm):
            return {}
        self.optimizer.step()
        self.step += 1
        self.samples += len(color)
        self.follow()
        return {**{name: term.item() for name, term in terms.items()}, "norm": norm.item()}


class Schedule:
    """Training progress, 0 to 1, from the used processor time and the control files."""

    def __init__(self, folder, hours):
        self.folder, self.hours, self.hurry = folder, hours, None

    def read(self, name, default):
        try:
            with open(os.path.join(self.folder, name)) as file:
                return float(file.read().strip() or default)
        except (FileNotFoundError, ValueError):
            return None

    def progress(self, seconds, reached):
        """Returns the progress after `seconds` of processor time.

        reached  progress so far, including that of an interrupted run which this one resumes"""
        hours = self.read("hours", self.hours) or self.hours
        progress = min(1.0, seconds / (3600 * hours))
        minutes = self.read("finish", 30.0)
        if minutes is None:
            self.hurry = None
            return progress
        if self.hurry is None:
            self.hurry = (max(LAST, progress, reached), seconds)
        start, since = self.hurry
        return min(1.0, start + (1 - start) * (seconds - since) / (60 * max(minutes, 1.0)))


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--data", required=True, help="folder that prepare.py wrote")
    p.add_argument("--out", required=True, help="folder for checkpoints and log")
    p.add_argument("--hours", type=float, default=6.0, help="processor hours of the whole schedule")
    p.add_argument("--network", choices=("small", "paper"), default="small", help="the architecture: the student's, or the published one")
    p.add_argument("--backbone", help="the TFLite file to start from (backbone.py)")
    p.add_argument("--weights", help="the safetensors file of an earlier training to start from (paper: output of convert.cpp; trains in 8 bits); "
                   "default: random weights")
    p.add_argument("--watch", help="folder of photographs with depth (manifest.json) to measure on while training")
    p.add_argument("--rate", type=float, default=1.5e-3, help="learning rate")
    p.add_argument("--gradient", type=float, default=0.5, help="weight of the loss on differences of neighboring errors")
    p.add_argument("--rank", type=float, default=0.0, help="weight of the ranking loss")
    p.add_argument("--threads", type=int, default=os.cpu_count())
    return p.parse_args()


def main():
    a = arguments()
    torch.set_num_threads(a.threads)
    torch.manual_seed(0)
    cv2.setNumThreads(1)
    os.makedirs(a.out, exist_ok=True)

    def path(name):
        return os.path.join(a.out, name)

    photographs = data.Photographs(a.data)
    run, checkpoint = Run(a.network, {"gradient": a.gradient, "rank": a.rank}), path("checkpoint.pt")
    if os.path.exists(checkpoint):
        run.load(checkpoint)
    elif a.weights or a.backbone:
        if a.backbone:
            backbone.start_from(run.net, a.backbone)
        else:
            known = photographs.calibration(np.random.default_rng(3))
            export.start_from(run.net, a.weights, known[:1] if a.network == "paper" else known)
        run.use(run.net)
        # The published weights work only in 8 bits, because that network relies on clipped tensors.
        if a.weights and a.network == "paper":
            run.quantize_as(export.read_safetensors(a.weights)[0])
    rng = np.random.default_rng([7, run.step])
    cv2.setRNGSeed(run.step)
    validation = photographs.validation_batches((288, 384))
    watched = Watched(a.watch)
    print(f"{len(photographs.train)} photographs, {len(photographs.held_out)} more held out; from step {run.step}", flush=True)

    asked = []
    signal.signal(signal.SIGTERM, lambda *_: asked.append("stop"))
    schedule = Schedule(a.out, a.hours)
    before, processor = run.seconds, time.process_time()
    started, first = time.time(), run.step
    saved, looked, snapped = time.time(), run.seconds if run.step > 0 else -math.inf, run.seconds
    means = {}
    ahead = data.Ahead(photographs, [7, run.step])

    def want(progress):
        _, pixels, shapes = next(s for s in STAGES if progress <= s[0])
        shape = shapes[rng.integers(len(shapes))]
        ahead.want(round(pixels / (shape[0] * shape[1])), shape)
    for _ in range(3):
        want(run.progress)
    while True:
        run.seconds = before + time.process_time() - processor
        progress = schedule.progress(run.seconds, run.progress)
        if run.ranges is not None:
            progress = max(progress, QUANTIZED_FROM)  # training never returns from 8 bits to floating point
        run.progress = progress
        done = asked or progress >= 1 or os.path.exists(path("stop"))
        if run.seconds - looked > 900 or done:
            looked = run.seconds
            error, difference = validate(run.average, validation)
            seen = watched.measure(run.average)
            pace = (run.step - first) / (time.time() - started)
            columns = {"step": run.step, "samples": run.samples, "processor_hours": run.seconds / 3600, "progress": progress,
                       **{n: means.get(n, math.nan) for n in ("data", "gradient", "anchor", "norm")},
                       "held_out_error": error, "held_out_gradient": difference, **seen, "rank": means.get("rank", math.nan)}
            new = not os.path.exists(path("log.tsv"))
            with open(path("log.tsv"), "a") as log:
                if new:
                    log.write("\t".join(columns) + "\n")
                log.write("\t".join(f"{v:.6g}" for v in columns.values()) + "\n")
            # wall-clock minutes, assuming the same ratio of processor time to wall-clock time as so far
            left = (run.seconds / progress - run.seconds) * (time.time() - started) / (run.seconds - before) / 60 if progress > 0 else math.nan
            print(f"{time.strftime('%H:%M:%S')} step {run.step} ({100 * progress:.1f} %, {pace:.2f} steps/s, {left:.0f} min left)  "
                  + "  ".join(f"{n} {v:.4f}" for n, v in means.items()) + f"  held out: error {error:.4f}, gradient {difference:.4f}  watched: "
                  + ", ".join(f"{n} {v:.3f}" for n, v in seen.items()), flush=True)
        if done or time.time() - saved > 300:
            saved = time.time()
            run.save(checkpoint)
        if run.seconds - snapped > 3600:
            snapped = run.seconds
            run.save(path(f"step_{run.step:07d}.pt"))
        if done:
            break
        if progress >= QUANTIZED_FROM and run.ranges is None:
            run.save(path("float.pt"))
            run.quantize(photographs.calibration(rng))
            print(f"step {run.step}: continues in 8 bits", flush=True)
        want(progress)
        rate = a.rate * min(1.0, (run.step - run.since + 1) / WARM_UP) * rate_at(progress)
        for name, value in run.learn(ahead.next(), rate).items():
            means[name] = value if name not in means else 0.99 * means[name] + 0.01 * value
    if progress >= 1:
        run.save(path("final.pt"))
    print("ended", flush=True)


if __name__ == "__main__":
    main()
