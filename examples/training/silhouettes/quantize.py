"""The library's 8-bit arithmetic (include/ldi/nn/ldi/convolution.hpp): 8-bit values with one range per tensor, 7-bit weights with one scale
per output. Used for quantization-aware training and for the ranges in the exported file."""
import contextlib
import os
import sys

import torch

import composites
from model import LAYERS, Silhouettes

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from weight_files import read_safetensors  # noqa: E402

LARGEST_WEIGHT = 63
INPUT_RANGE = (-128 / 127, 1.0)  # the input is stored in steps of 1 / 127
SHARE_INSIDE = 0.9999            # share of a tensor's values inside its range


class Round(torch.autograd.Function):
    """Rounds; gradients pass unchanged."""

    @staticmethod
    def forward(ctx, x):
        return torch.round(x)

    @staticmethod
    def backward(ctx, gradient):
        return gradient


def network_of(path):
    """Returns (network, ranges or None) of an exported file, or of a checkpoint's average, with folded normalization and unrounded weights."""
    net = Silhouettes()
    if path.endswith(".safetensors"):
        for layer in net.layers:
            layer.fold()
        tensors = {name: torch.from_numpy(t.astype("float32")) for name, t in read_safetensors(path)[0].items()}
        ranges = {name[:-len(".range")]: tuple(t.tolist()) for name, t in tensors.items() if name.endswith(".range")}
        for layer, (name, *_) in zip(net.layers, LAYERS):
            layer.load_state_dict({part: tensors[f"{name}.{part}"] for part in ("weight", "bias")})
        return net.eval(), ranges
    state = torch.load(path)
    if state.get("ranges"):
        for layer in net.layers:
            layer.fold()
    net.load_state_dict(state["average"])
    net.eval()
    for layer in net.layers:
        if layer.norm is not None:
            layer.fold()
    return net, state.get("ranges")


def in_bytes(net, ranges):
    """Returns (network with rounded weights, function that rounds the network's values). With this function as `observe`, the network
    computes the same as the library. Without `ranges`, nothing is rounded."""
    if not ranges:
        return net, lambda name, value: value
    with rounded_weights(net, ranges):
        rounded = [layer.weight.detach() for layer in net.layers]
    for layer, weight in zip(net.layers, rounded):
        layer.weight = torch.nn.Parameter(weight)
    return net, rounding(ranges)


def rounding(ranges):
    """Returns a function for Silhouettes.forward that rounds and clips the tensors that layers read."""
    def observe(name, value):
        low, high = ranges[name]
        scale = (high - low) / 255
        zero = round(-low / scale)
        return (Round.apply(value.float() / scale).clamp(-zero, 255 - zero) * scale).to(value.dtype)
    return observe


class RoundAway(Round):
    """Rounds halves away from zero, like pack_byte_convolution(); gradients pass unchanged."""

    @staticmethod
    def forward(ctx, x):
        return torch.sign(x) * torch.floor(x.abs() + 0.5)


@contextlib.contextmanager
def rounded_weights(net, ranges):
    """Within this context, layers use weights rounded to 7 bits, and gradients apply to the unrounded weights. ranges: see value_ranges();
    if empty, the weights are not rounded."""
    if not ranges:
        yield
        return
    kept = [layer.weight for layer in net.layers]
    for layer, (_, reads, inputs, _, _, _) in zip(net.layers, LAYERS):
        scales = torch.cat([torch.full((inputs // len(reads),), (ranges[r][1] - ranges[r][0]) / 255) for r in reads])[None, :, None, None]
        weight = layer.weight * scales
        step = weight.detach().abs().amax((1, 2, 3), keepdim=True).clamp(min=1e-12) / LARGEST_WEIGHT
        rounded = RoundAway.apply(weight / step) * step / scales
        del layer.weight
        layer.weight = rounded
    try:
        yield
    finally:
        for layer, weight in zip(net.layers, kept):
            del layer.weight
            layer.weight = weight


@torch.no_grad()
def value_ranges(net, batches):
    """Returns {"input": (min, max), ...} for every tensor that a layer reads."""
    highest = {}

    def observe(name, value):
        v = value[value > 0]
        k = max(1, int(len(v) * (1 - SHARE_INSIDE)))
        highest.setdefault(name, []).append(torch.topk(v, min(k, len(v))).values[-1].item() if len(v) else 0.0)
        return value

    for x, _, state in batches:
        net(x, (state > composites.OUTSIDE).float(), observe)
    return {name: INPUT_RANGE if name == "input" else (0.0, max(max(found), 1e-3)) for name, found in highest.items()}
