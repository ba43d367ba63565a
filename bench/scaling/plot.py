#!/usr/bin/env python3
"""Draws the scaling laws of bench/scaling/README.md. Needs Debian's python3-matplotlib.

plot.py RESULTS.json FOLDER     writes FOLDER/pixels.png, layers.png and irregular.png, and prints the page's figures

Points and figures are medians over the repetitions; bars, and figures in parentheses, are the minimum and the maximum."""

import json
import sys
from pathlib import Path
from typing import NamedTuple

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

OPERATORS = {"float32": "3 x 3 convolution, float32", "int8": "3 x 3 convolution, int8", "plan": "its plan", "coarsen": "coarsen",
             "components": "components"}
COLORS = dict(zip(OPERATORS, ("C0", "C1", "C2", "C3", "C4")))


class Point(NamedTuple):
    """One operator on one graph. Times are nanoseconds per pixel, over the repetitions."""
    x: float
    median: float
    least: float
    most: float
    irregular: float  # percent


def read(path):
    """Returns {(axis, kind, operator): [Point]}."""
    runs = {}
    for b in json.loads(Path(path).read_text())["benchmarks"]:
        if b["run_type"] == "iteration":
            _, axis, kind, operator, _ = b["run_name"].split("/")[:5]
            key = axis, kind, operator, b["x"], b["irregular_percent"]
            runs.setdefault(key, []).append(b["cpu_time"] * 1000 / b["pixels"])
    lines = {}
    for (axis, kind, operator, x, irregular), times in runs.items():
        point = Point(x, sorted(times)[len(times) // 2], min(times), max(times), irregular)
        lines.setdefault((axis, kind, operator), []).append(point)
    return lines


def draw(lines, axis, label, file, log=False, x_of=lambda point: point.x):
    figure, axes = plt.subplots(1, 2, figsize=(10, 3.8), dpi=90)
    for (a, kind, operator), points in lines.items():
        if a != axis:
            continue
        panel = axes[0] if operator in ("float32", "int8") else axes[1]
        points = sorted(points, key=x_of)
        style = "o-" if kind == "ldi" else "x:"
        name = OPERATORS[operator] + (", layered image" if kind == "ldi" else ", image")
        if axis == "irregular":  # the first point is the image
            panel.axhline(points[0].median, linestyle=":", linewidth=1, color=COLORS[operator], label=OPERATORS[operator] + ", image")
        bars = [[p.median - p.least for p in points], [p.most - p.median for p in points]]
        panel.errorbar([x_of(p) for p in points], [p.median for p in points], bars, fmt=style, color=COLORS[operator], label=name, markersize=4,
                       capsize=2)
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


def ratio(point, base):
    """Formats the ratio of a point's time to the median time of `base`: median (minimum to maximum)."""
    return f"{point.median / base.median:.2f} ({point.least / base.median:.2f} to {point.most / base.median:.2f})"


def print_figures(lines):
    for operator in OPERATORS:
        image, *cut = sorted(lines[("irregular", "ldi", operator)], key=lambda p: p.irregular)
        print(f"{OPERATORS[operator]}: {image.median:.2f} ns per pixel of an image. Relative to it, by irregular pixels:")
        for p in cut:  # the image has some irregular pixels along its border
            each = (p.median - image.median) / image.median / (p.irregular - image.irregular) * 100
            print(f"    {p.irregular:.1f} %: {ratio(p, image)}; an additional irregular pixel costs {each:.1f} pixels more")
    for axis in ("pixels", "layers"):
        for operator in OPERATORS:
            image = {p.x: p for p in lines[(axis, "image", operator)]}
            print(f"{axis}, {OPERATORS[operator]}; layered image relative to the image, and ns per pixel of both:")
            for p in sorted(lines[(axis, "ldi", operator)]):
                if p.x in image:
                    print(f"    {p.x:g}: {ratio(p, image[p.x])}; {p.median:.2f}, {image[p.x].median:.2f} ns")


lines = read(sys.argv[1])
folder = Path(sys.argv[2])
draw(lines, "pixels", "megapixels", folder / "pixels.png", log=True)
draw(lines, "layers", "layers of 512 x 512 pixels", folder / "layers.png")
draw(lines, "irregular", "irregular pixels, %", folder / "irregular.png", x_of=lambda point: point.irregular)
print_figures(lines)
