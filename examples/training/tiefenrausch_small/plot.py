"""Draws the training curves from the log.

    python3 plot.py LOG.tsv CURVE.png
"""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

with open(sys.argv[1]) as file:
    rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(file, delimiter="\t")][1:]  # the first row is the untrained network
hours = [row["processor_hours"] for row in rows]
figure, axes = plt.subplots(1, 3, figsize=(13, 3.6), constrained_layout=True)
for axis, names, title in ((axes[0], ("data", "gradient"), "loss on augmented crops"), (axes[1], ("held_out_error", "held_out_gradient"), "error on held-out photographs"),
                           (axes[2], ("delta", "edges"), "photographs with depth: share within 1.25, F1 of edges")):
    for name in names:
        axis.plot(hours, [row[name] for row in rows], label=name)
    axis.set_title(title)
    axis.set_xlabel("processor hours")
    axis.grid(alpha=0.3)
    axis.legend()
figure.savefig(sys.argv[2], dpi=110)
