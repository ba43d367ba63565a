"""Draws the parts of a 3D photo: pictures.py PHOTO FOLDER"""
import os
import sys

import ldi
import numpy as np

photo, folder = sys.argv[1:]
os.makedirs(folder, exist_ok=True)
made = ldi.photo3d(ldi.read_photo(photo), progress=lambda stage, fraction: fraction == 0 and print(stage))
layers = made.layers
height, width = (length + 2 * layers.margin for length in made.disparity.shape)

hidden = np.zeros((height, width, 3), np.uint8)  # hidden surfaces, and surfaces past the photo's border
new = layers.known == 0
hidden[layers.y[new], layers.x[new]] = layers.color[new]
charts = np.random.default_rng(1).integers(40, 255, (len(made.charts), 3)).astype(np.uint8)
chart = np.zeros_like(hidden)
chart[layers.y, layers.x] = charts[made.charts.chart_of]
from_left, from_right = (made.render((x, 0, 0), target=(0, 0, -2)) for x in (-0.04, 0.04))
for name, picture in {"disparity": (255 * made.disparity).astype(np.uint8), "hidden": hidden, "charts": chart, "atlas": made.atlas.color, "left": from_left, "right": from_right}.items():
    ldi.write_png(os.path.join(folder, name + ".png"), picture)
