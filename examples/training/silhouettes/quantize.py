"""8-bit arithmetic as the library computes it (include/ldi/nn/ldi/convolution.hpp): values of 8 bits with one range per tensor, weights of
7 bits with one scale per output. For training with it, and for ranges in the exported file."""
import contextlib
import os
import sys

import torch

import composites
from model import LAYERS, Silhouettes

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from weight_files import read_safetensors  # noqa: E402

LARGEST_WEIGHT = 63
INPUT_RANGE = (-128 / 127, 1.0)  # in steps of 1 / 127
SHARE_INSIDE = 0.9999            # of a tensor's values in its range


class Round(torch.autograd.Function):
    """Rounds; gradients pass as if it had not."""

    @staticmethod
    def forward(ctx, x):
        return torch.round(x)

    @staticmethod
    def backward(ctx, gradient):
        return gradient


def network_of(path):
    """(network, ranges or none) of an exported file, or of the average of a checkpoint: normalization folded in, weights not rounded"""
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
    """(the network with rounded weights, what rounds its values): what the library computes; both as they are where there are no ranges"""
    if not ranges:
        return net, lambda name, value: value
    with rounded_weights(net, ranges):
        rounded = [layer.weight.detach() for layer in net.layers]
    for layer, weight in zip(net.layers, rounded):
        layer.weight = torch.nn.Parameter(weight)
    return net, rounding(ranges)


def rounding(ranges):
    """For Silhouettes.forward: rounds and clips what layers read."""
    def observe(name, value):
        low, high = ranges[name]
        scale = (high - low) / 255
        zero = round(-low / scale)
        return (Round.apply(value.float() / scale).clamp(-zero, 255 - zero) * scale).to(value.dtype)
    return observe


class RoundAway(Round):
    """The same, halves away from zero, as pack_byte_convolution() rounds weights."""

    @staticmethod
    def forward(ctx, x):
        return torch.sign(x) * torch.floor(x.abs() + 0.5)


@contextlib.contextmanager
def rounded_weights(net, ranges):
    """Inside, the layers' weights are those that 7 bits can hold, and gradients reach the unrounded ones."""
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
    """{"input": (least, greatest), ...} of every tensor that a layer reads."""
    highest = {}

    def observe(name, value):
        v = value[value > 0]
        k = max(1, int(len(v) * (1 - SHARE_INSIDE)))
        highest.setdefault(name, []).append(torch.topk(v, min(k, len(v))).values[-1].item() if len(v) else 0.0)
        return value

    for x, _, state in batches:
        net(x, (state > composites.OUTSIDE).float(), observe)
    return {name: INPUT_RANGE if name == "input" else (0.0, max(max(found), 1e-3)) for name, found in highest.items()}
