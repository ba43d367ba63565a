#!/usr/bin/env python3
"""Plots the inpainting network's time and memory against the number of pixels. Needs Debian's python3-matplotlib.

    ldi_bench_networks_farbrausch 816 1155 1633 2309 3266 4032 | plot_scaling.py scaling.png
"""
import re
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

points = [(int(pixels) / 1e6, float(fewest), float(peak)) for pixels, fewest, peak in
          re.findall(r"(\d+) pixels.*?minimum ([\d.]+); peak ([\d.]+) MB", sys.stdin.read())]
pixels, milliseconds, megabytes = zip(*points)
figure, axes = plt.subplots(figsize=(6, 3.6), dpi=90)
axes.plot(pixels, milliseconds, "o-", label="time, ms")
axes.plot(pixels, megabytes, "s--", label="peak working memory, MB")
axes.set_xlim(0), axes.set_ylim(0)
axes.set_xlabel("pixels of the layered image, millions")
axes.grid(alpha=0.3)
axes.legend()
figure.tight_layout()
figure.savefig(sys.argv[1])
