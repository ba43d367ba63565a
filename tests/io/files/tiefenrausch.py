#!/usr/bin/env python3
"""Writes the reference files of tests/io/weight_files.cpp to the folder of this script. The first file contains a student network of
examples/training/tiefenrausch_small with few channels and random weights, quantized and exported like a trained student. The second file
contains a random picture and the network's output for it, computed with exact integers. Needs Debian's python3-torch.

    tiefenrausch.py
"""
import pathlib
import sys

import torch
import torch.nn.functional as F

FOLDER = pathlib.Path(__file__).resolve().parent
TRAINING = FOLDER.parents[2] / "examples/training"
sys.path[:0] = [str(TRAINING), str(TRAINING / "tiefenrausch_small")]
import export  # noqa: E402
import model  # noqa: E402
import quantize  # noqa: E402
from weight_files import write_safetensors  # noqa: E402

torch.manual_seed(0)
model.STEM, model.CHANNELS_UP, model.RESIDUALS_UP = 4, (4, 5, 8, 8, 8, 8), (0, 1, 0, 0, 1, 1)
model.STAGES_DOWN = ((5, 1, (1,)), (6, 2, (2, 1)), (8, 2, (2,)), (8, 2, (2,)), (8, 2, (1,)), (8, 2, (2, 1)))
student = model.Student().train()
photo = F.interpolate(torch.rand(4, 3, 6, 8), (64, 96), mode="bilinear", align_corners=False).mul(255).round()
student(photo / 255)  # input for the normalization's statistics
net = quantize.Quantized(quantize.find_ranges(student.eval(), [photo / 255])).take(student).eval()
with torch.no_grad():
    for bias in net.biases.values():
        bias.add_(torch.randn_like(bias) * 0.05)
tensors, metadata = export.tensors_of(net), {"format": "ldi", "name": "tiefenrausch_small", "version": "1", "output": "disparity",
                                             "operator_names": " ".join(op.name for op in net.operators)}
write_safetensors(str(FOLDER / "tiefenrausch_weights.safetensors"), tensors, metadata)
rgb = photo[0].permute(1, 2, 0).numpy().astype("uint8")
rgb[:8, :8], rgb[8:16, :8] = 0, 255
write_safetensors(str(FOLDER / "tiefenrausch_example.safetensors"),
                  {"photo": rgb, "levels": export.Integers(tensors)(rgb)}, {"format": "ldi", "name": "example"})
