"""Draws the training curves from the log.

    python3 plot.py FOLDER/log.tsv curve.png
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

with open(sys.argv[1]) as file:
    rows = list(csv.DictReader(file, delimiter="\t"))[1:]  # the first row is the untrained network
figure, axes = plt.subplots(1, 3, figsize=(12, 3.4))
for axis, (name, label) in zip(axes, (("psnr", "PSNR in held-out holes (dB)"), ("color_error", "mean color error (of 255)"),
                                      ("texture", "gradient magnitude, relative to the truth's"))):
    axis.plot([float(r["processor_hours"]) for r in rows], [float(r[name]) for r in rows])
    axis.set_xlabel("processor hours")
    axis.set_title(label, fontsize=10)
    axis.grid(alpha=0.3)
figure.tight_layout()
figure.savefig(sys.argv[2], dpi=100)
