#!/usr/bin/env python3
"""Draws the scaling laws of bench/scaling/README.md. Needs Debian's python3-matplotlib.

plot.py RESULTS.json FOLDER     writes FOLDER/pixels.png, layers.png and irregular.png, and prints the page's figures"""

import json
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

OPERATORS = {"float32": "3 x 3 convolution, float32", "int8": "3 x 3 convolution, int8", "plan": "its plan", "coarsen": "coarsen",
             "components": "components"}
COLORS = dict(zip(OPERATORS, ("C0", "C1", "C2", "C3", "C4")))


def read(path):
    """Returns {(axis, kind, operator): [(x, nanoseconds per pixel, percent irregular)]}, medians over repetitions."""
    runs = {}
    for b in json.loads(Path(path).read_text())["benchmarks"]:
        if b["run_type"] == "iteration":
            _, axis, kind, operator, _ = b["run_name"].split("/")[:5]
            key = axis, kind, operator, b["x"], b["pixels"], b["irregular_percent"]
            runs.setdefault(key, []).append(b["cpu_time"] * 1000)
    lines = {}
    for (axis, kind, operator, x, pixels, irregular), times in runs.items():
        lines.setdefault((axis, kind, operator), []).append((x, sorted(times)[len(times) // 2] / pixels, irregular))
    return lines


def draw(lines, axis, label, file, log=False, x_of=lambda point: point[0]):
    figure, axes = plt.subplots(1, 2, figsize=(10, 3.8), dpi=90)
    for (a, kind, operator), points in lines.items():
        if a != axis:
            continue
        panel = axes[0] if operator in ("float32", "int8") else axes[1]
        points = sorted(points, key=x_of)
        style = "o-" if kind == "ldi" else "x:"
        name = OPERATORS[operator] + (", layered image" if kind == "ldi" else ", image")
        if axis == "irregular":  # the first point is the image
            panel.axhline(points[0][1], linestyle=":", linewidth=1, color=COLORS[operator], label=OPERATORS[operator] + ", image")
        panel.plot([x_of(p) for p in points], [p[1] for p in points], style, color=COLORS[operator], label=name, markersize=4)
    for panel in axes:
        panel.set_ylim(0, 1.35 * max(max(line.get_ydata()) for line in panel.lines))  # room for the legend
        if log:
            panel.set_xscale("log")
            panel.set_xticks([0.1, 0.3, 1, 3, 12, 48], ["0.1", "0.3", "1", "3", "12", "48"])
        panel.set_xlabel(label)
        panel.set_ylabel("processor time per pixel, ns")
        panel.grid(alpha=0.3)
        panel.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(file)
    plt.close(figure)


def print_figures(lines):
    for operator in OPERATORS:
        points = sorted(lines[("irregular", "ldi", operator)], key=lambda p: p[2])
        image = points[0][1]
        text = ", ".join(f"{irregular:.2g} %: {time / image:.2f}" for _, time, irregular in points)
        share, last = points[-1][2] / 100, points[-1][1]
        print(f"{OPERATORS[operator]}: {image:.2f} ns per pixel of an image; relative to it, by irregular pixels: {text}")
        print(f"    an irregular pixel costs as much as {1 + (last / image - 1) / share:.1f} pixels of an image")
    for axis in ("pixels", "layers"):
        for operator in OPERATORS:
            ldi = dict((x, t) for x, t, _ in lines[(axis, "ldi", operator)])
            image = dict((x, t) for x, t, _ in lines[(axis, "image", operator)])
            print(f"{axis}, {OPERATORS[operator]}: " + ", ".join(f"{x:g}: {ldi[x]:.2f} / {image[x]:.2f} ns" for x in sorted(ldi) if x in image))


lines = read(sys.argv[1])
folder = Path(sys.argv[2])
draw(lines, "pixels", "megapixels", folder / "pixels.png", log=True)
draw(lines, "layers", "layers of 512 x 512 pixels", folder / "layers.png")
draw(lines, "irregular", "irregular pixels, %", folder / "irregular.png", x_of=lambda point: point[2])
print_figures(lines)
