"""Quantization-aware training of the student in the arithmetic of the library's 8-bit networks.

Every tensor holds integers: 8-bit values minus their zero point. Sums of their products are exact in float32 up to 2^24, and few sums are
larger. Gradients pass through rounding unchanged, and are zero for clipped values. export.py has the same network in exact integers.
"""
import numpy as np
import torch
import torch.nn as nn
import torch.nn.functional as F

from model import Addition, Convolution, Enlargement, key, operators

PHOTO = (float(np.float32(1) / np.float32(255)), 0)  # scale and zero point of the network's input, bytes from 0 to 255


class Round(torch.autograd.Function):
    @staticmethod
    def forward(ctx, x):
        return x.round()

    @staticmethod
    def backward(ctx, gradient):
        return gradient


class Requantize(torch.autograd.Function):
    """accumulator * factor, rounded and clipped to [low, high]. Works in place; clipped values have no gradient."""

    @staticmethod
    def forward(ctx, accumulator, factor, low, high):
        ctx.mark_dirty(accumulator)
        y = accumulator.mul_(factor).round_().clamp_(low, high)
        ctx.save_for_backward(y)
        ctx.constants = factor, low, high
        return y

    @staticmethod
    def backward(ctx, gradient):
        (y,), (factor, low, high) = ctx.saved_tensors, ctx.constants
        gradient = torch.ops.aten.threshold_backward(gradient, y, low)
        return torch.ops.aten.threshold_backward(gradient, high - y, 0).mul_(factor), None, None, None


def scale_and_zero_point(low, high):
    """Returns the quantization that covers [low, high] and 0."""
    low, high = min(low, 0.0), max(high, 1e-6)
    scale = float(np.float32((high - low) / 255))
    return scale, int(min(255, max(0, round(-low / scale))))


def weight_quantization(low, high, bits):
    """Returns (scale, zero point) of weights in [low, high]. The zero point is the middle of the range, so that weights minus zero point
    are signed bytes, which processors multiply three times faster than wider integers."""
    half = 2 ** (bits - 1)
    return float(np.float32(max(-low / half, high / (half - 1), 1e-9))), half


def best_range(values):
    """Returns the (low, high) with the minimum mean square error in 8 bits. A smaller range clips more values; a larger range has coarser
    steps."""
    low, high = min(values.min().item(), 0.0), max(values.max().item(), 1e-6)
    best = None
    for share in np.linspace(0.3, 1.0, 29):
        for lower, upper in ((low * share, high * share), (low * share, high), (low, high * share)):
            scale, zero_point = scale_and_zero_point(lower, upper)
            q = (values / scale).round().clamp(-zero_point, 255 - zero_point) * scale
            error = ((q - values) ** 2).mean().item()
            if best is None or error < best[0]:
                best = (error, lower, upper)
    return best[1:]


@torch.no_grad()
def find_ranges(student, batches):
    """Returns every tensor's quantization, from the float network's values on some photographs."""
    seen = {}
    for color in batches:
        tensors = {"photo": color}
        for op in student.operators:
            if isinstance(op, Convolution):
                tensors[op.name] = student.layers[key(op.name)](tensors[op.input])
            elif isinstance(op, Addition):
                tensors[op.name] = tensors[op.a] + tensors[op.b]
            else:
                tensors[op.name] = F.interpolate(tensors[op.input], scale_factor=2, mode="nearest")
            if not isinstance(op, Enlargement):
                values = tensors[op.name].flatten()
                few = values[torch.randint(len(values), (8000,))]
                seen.setdefault(op.name, []).append(torch.cat([few, values.min()[None], values.max()[None]]))
    ranges = {"photo": PHOTO}
    for op in student.operators:
        ranges[op.name] = (ranges[op.input] if isinstance(op, Enlargement)
                           else scale_and_zero_point(*best_range(torch.cat(seen[op.name]))))
    # The result's range is never clipped, because clipping would flatten near surfaces to one constant disparity.
    last = torch.cat(seen["disparity"])
    ranges["disparity"] = scale_and_zero_point(last.min().item() if student.logarithmic else 0.0, last.max().item())
    return ranges


class Quantized(nn.Module):
    """color B x 3 x H x W in [0, 1], multiples of 1/255 -> disparity B x 1 x H x W"""

    def __init__(self, ranges, weight_bits=8, ops=None, logarithmic=False):
        """ranges: {tensor: (scale, zero point)}; ops, logarithmic: as for model.Student"""
        super().__init__()
        self.operators, self.logarithmic, self.ranges, self.weight_bits = ops or operators(), logarithmic, ranges, weight_bits
        self.weights, self.biases = nn.ParameterDict(), nn.ParameterDict()
        for op in self.operators:
            if isinstance(op, Convolution):
                inputs = 1 if op.depthwise else op.inputs
                self.weights[key(op.name)] = nn.Parameter(torch.zeros(op.outputs, inputs, op.kernel, op.kernel))
                self.biases[key(op.name)] = nn.Parameter(torch.zeros(op.outputs))

    @torch.no_grad()
    def take(self, student):
        """Copies the weights of a float network, with folded normalization."""
        for name, layer in student.layers.items():
            weight, bias = layer.folded()
            self.weights[name].copy_(weight)
            self.biases[name].copy_(bias)
        return self

    def integers(self, op):
        """Returns (weights minus zero point, scale, zero point, bias) of a convolution; integers stored as float32."""
        weight, bias = self.weights[key(op.name)], self.biases[key(op.name)]
        with torch.no_grad():
            scale, zero_point = weight_quantization(weight.min().item(), weight.max().item(), self.weight_bits)
        whole = Round.apply((weight / scale).clamp(-zero_point, zero_point - 1))
        bias = Round.apply(bias / (self.ranges[op.input][0] * scale))
        return whole, scale, zero_point, bias

    def clip(self, name, accumulator, factor):
        _, zero_point = self.ranges[name]
        return Requantize.apply(accumulator, factor, -zero_point, 255 - zero_point)

    def forward(self, color):
        scale, zero_point = self.ranges["photo"]
        photo = (color / scale).round().clamp(-zero_point, 255 - zero_point)
        tensors = {"photo": photo.contiguous(memory_format=torch.channels_last)}
        for op in self.operators:
            scale = self.ranges[op.name][0]
            if isinstance(op, Convolution):
                weight, weight_scale, _, bias = self.integers(op)
                accumulator = F.conv2d(tensors[op.input], weight.contiguous(memory_format=torch.channels_last), bias, op.stride,
                                       op.kernel // 2, 1, op.inputs if op.depthwise else 1)
                y = self.clip(op.name, accumulator, self.ranges[op.input][0] * weight_scale / scale)
            elif isinstance(op, Addition):
                total = tensors[op.a] * (self.ranges[op.a][0] / scale)
                y = self.clip(op.name, total.add_(tensors[op.b], alpha=self.ranges[op.b][0] / scale), 1.0)
            else:
                y = F.interpolate(tensors[op.input], scale_factor=2, mode="nearest")
            tensors[op.name] = y
        result = tensors["disparity"] * self.ranges["disparity"][0]
        return result.exp() if self.logarithmic else result
