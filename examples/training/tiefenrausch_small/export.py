"""Writes the trained student as a safetensors file that the library loads, and checks the file with exact integer arithmetic.

    python3 export.py --checkpoint FOLDER/final.pt --data DATA --out tiefenrausch_small.safetensors

Can export any checkpoint. Rounds a checkpoint that was not yet trained in 8 bits.

Contents of the file (n operators; tensor 0 is the photograph, tensor i + 1 the result of operator i):

    operators           I32  n x 5   kind (0 convolution, 1 depthwise convolution, 2 addition, 3 enlargement), first input, second input
                                     (additions; else 0), kernel (convolutions; else 0), stride or factor of enlargement (additions: 1)
    scales, zero_points F32, U8  n + 1   quantization of the tensors: value = (byte - zero point) * scale
    weight_scales, weight_zero_points    the same of the weights, n (1 and 0 where there are none)
    I.weight            U8   outputs x kernel x kernel x inputs (1 if depthwise), I the number of the operator
    I.bias              I32  outputs, in units of input scale * weight scale

The metadata hold the name, the version, the operators' names and the provenance. The exact arithmetic is in `Integers` below.
"""
import argparse
import hashlib
import json
import os
import sys

import numpy as np
import torch
import torch.nn.functional as F

import data
import model
from model import Addition, Convolution
from quantize import Quantized, find_ranges

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from weight_files import read_safetensors, write_safetensors  # noqa: E402


@torch.no_grad()
def tensors_of(net):
    """Converts a Quantized network to the file's tensors."""
    number = {"photo": 0, **{op.name: i + 1 for i, op in enumerate(net.operators)}}
    rows, weight_scales, weight_zero_points, parts = [], [], [], {}
    for i, op in enumerate(net.operators):
        weight_scale, weight_zero_point = 1.0, 0
        if isinstance(op, Convolution):
            rows.append((int(op.depthwise), number[op.input], 0, op.kernel, op.stride))
            whole, weight_scale, weight_zero_point, bias = net.integers(op)
            parts[f"{i}.weight"] = (whole + weight_zero_point).permute(0, 2, 3, 1).contiguous().numpy().astype(np.uint8)
            parts[f"{i}.bias"] = bias.numpy().astype(np.int32)
        elif isinstance(op, Addition):
            rows.append((2, number[op.a], number[op.b], 0, 1))
        else:
            rows.append((3, number[op.input], 0, 0, 2))
        weight_scales.append(weight_scale)
        weight_zero_points.append(weight_zero_point)
    ranges = [net.ranges[name] for name in number]
    return {"operators": np.array(rows, np.int32),
            "scales": np.array([scale for scale, _ in ranges], np.float32), "zero_points": np.array([z for _, z in ranges], np.uint8),
            "weight_scales": np.array(weight_scales, np.float32), "weight_zero_points": np.array(weight_zero_points, np.uint8), **parts}


def rounding_shift(value, shift):
    """Returns value / 2^shift, rounded to nearest, halves away from zero; numpy int64."""
    mask = (1 << shift) - 1
    remainder = (value & mask) - (value < 0)
    return (value >> shift) + (remainder > (mask >> 1))


class Integers:
    """A file's network in integer arithmetic; its results equal the library's bit for bit."""

    def __init__(self, tensors):
        self.t = tensors
        for i, (kind, a, b, _, _) in enumerate(tensors["operators"]):  # asserts the library's limits for operators
            if kind < 2:
                scale = tensors["scales"][a] * tensors["weight_scales"][i] / tensors["scales"][i + 1]
                assert 2.0 ** -32 <= scale < 1, (i, scale)
            elif kind == 2:
                ratios = tensors["scales"][[a, b]] / tensors["scales"][i + 1]
                assert (ratios > 0).all() and 2.0 ** -10 <= ratios.max() < 2.0 ** 8, (i, ratios)

    def convolution(self, i, x, kind, a, kernel, stride):
        """x  1 x C x H x W float64, integers minus their zero point"""
        t = self.t
        weight = torch.from_numpy(t[f"{i}.weight"].astype(np.float64) - t["weight_zero_points"][i]).permute(0, 3, 1, 2)
        bias = torch.from_numpy(t[f"{i}.bias"].astype(np.float64))
        if kernel == 1:
            accumulator = torch.einsum("oi,bihw->bohw", weight[:, :, 0, 0], x[:, :, ::stride, ::stride]) + bias[:, None, None]
        else:
            accumulator = F.conv2d(x, weight, bias, stride, kernel // 2, 1, len(weight) if kind == 1 else 1)
        scale = t["scales"][a] * t["weight_scales"][i] / t["scales"][i + 1]  # in float32, in this order
        bits = int(np.float32(scale).view(np.uint32))
        multiplier, shift = ((bits & 0x7FFFFF) | 0x800000) << 7, 126 - (bits >> 23)
        high = (accumulator.numpy().astype(np.int64) * multiplier + (1 << 30)) >> 31
        return rounding_shift(high, shift)

    def addition(self, i, x, y, a, b):
        ratios = self.t["scales"][[a, b]] / self.t["scales"][i + 1]
        shift = 21 - int(np.floor(np.log2(ratios.max())))
        m = [int(np.rint(np.ldexp(np.float64(r), shift))) for r in ratios]
        return rounding_shift(x.astype(np.int64) * m[0] + y.astype(np.int64) * m[1], shift)

    def __call__(self, photo):
        """photo H x W x 3 uint8, multiples of 32 -> H x W uint8"""
        zero_points = self.t["zero_points"].astype(int)
        values = [torch.from_numpy(photo.astype(np.float64) - zero_points[0]).permute(2, 0, 1)[None]]
        for i, (kind, a, b, kernel, stride) in enumerate(self.t["operators"]):
            if kind == 3:
                values.append(values[a].repeat_interleave(stride, 2).repeat_interleave(stride, 3))
                continue
            y = self.convolution(i, values[a], kind, a, kernel, stride) if kind < 2 else self.addition(
                i, values[a].numpy(), values[b].numpy(), a, b)
            values.append(torch.from_numpy(np.clip(y, -zero_points[i + 1], 255 - zero_points[i + 1]).astype(np.float64)))
        return (values[-1][0, 0].numpy() + zero_points[-1]).astype(np.uint8)


def ranges_of(tensors, ops):
    """Returns {tensor name: (scale, zero point)} from a file's tensors. Asserts that the file's network consists of `ops`."""
    number = {"photo": 0, **{op.name: i + 1 for i, op in enumerate(ops)}}
    assert len(ops) == len(tensors["operators"])
    for op, row in zip(ops, tensors["operators"]):
        if isinstance(op, Convolution):
            expected = int(op.depthwise), number[op.input], 0, op.kernel, op.stride
        else:
            expected = (2, number[op.a], number[op.b], 0, 1) if isinstance(op, Addition) else (3, number[op.input], 0, 0, 2)
        assert tuple(row) == expected, (op.name, row, expected)
    return {name: (float(tensors["scales"][i]), int(tensors["zero_points"][i])) for name, i in number.items()}


@torch.no_grad()
def start_from(student, path, photographs):
    """Sets a model.Student so that it computes the same as an exported file's network, up to rounding. Measures the statistics of the
    normalization on `photographs`, which are batches of colors."""
    tensors, _ = read_safetensors(path)
    number = {"photo": 0, **{op.name: i + 1 for i, op in enumerate(student.operators)}}
    statistics = {}
    for i, op in enumerate(student.operators):
        if isinstance(op, Convolution):
            layer, scale = student.layers[model.key(op.name)], float(tensors["weight_scales"][i])
            weight = (tensors[f"{i}.weight"].astype(np.float32) - tensors["weight_zero_points"][i]) * scale
            layer.weight.copy_(torch.from_numpy(weight).permute(0, 3, 1, 2))
            bias = torch.from_numpy(tensors[f"{i}.bias"] * (float(tensors["scales"][number[op.input]]) * scale)).float()
            if layer.norm is None:
                layer.bias.copy_(bias)
            else:
                layer.norm.weight.fill_(1)
                layer.norm.bias.copy_(bias)
                layer.norm.running_mean.zero_()
                layer.norm.running_var.fill_(1 - layer.norm.eps)
                layer.norm.register_forward_pre_hook(lambda norm, inputs: statistics.setdefault(norm, []).append(
                    torch.var_mean(inputs[0], (0, 2, 3), unbiased=False)))
    student.eval()
    for colors in photographs:
        student(colors)
    for norm, found in statistics.items():
        norm._forward_pre_hooks.clear()
        variance, mean = (torch.stack(values).mean(0) for values in zip(*found))
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(variance)
        norm.weight.copy_((variance + norm.eps).sqrt())
        norm.bias.add_(mean)
    student.train()


def load_quantized(path, folder, weight_bits):
    """Returns (quantized network in evaluation mode, checkpoint). Rounds a checkpoint that is not in 8 bits yet, with ranges from photographs
    of `folder` (written by prepare.py)."""
    state = torch.load(path)
    ops, logarithmic = model.network(state.get("network", "small"))
    if state["ranges"]:
        net = Quantized(state["ranges"], weight_bits, ops, logarithmic)
        net.load_state_dict(state["average"])
    else:
        student = model.Student(ops, logarithmic).eval()
        student.load_state_dict(state["average"])
        ranges = find_ranges(student, data.Photographs(folder).calibration(np.random.default_rng(3)))
        net = Quantized(ranges, weight_bits, ops, logarithmic).take(student)
    return net.eval(), state


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--checkpoint", required=True)
    p.add_argument("--data", required=True, help="training data (folder of prepare.py), for the provenance")
    p.add_argument("--out", required=True)
    p.add_argument("--weight-bits", type=int, default=8, help="7: weights that every instruction set multiplies without widening, at some loss of quality")
    p.add_argument("--note", default="", help="text for the provenance, such as licenses")
    p.add_argument("--example", help="also write a small photograph and the network's expected output as safetensors, for tests of readers")
    a = p.parse_args()
    torch.manual_seed(0)
    net, state = load_quantized(a.checkpoint, a.data, a.weight_bits)
    with open(os.path.join(a.data, "index.json")) as file:
        names = [entry["name"] for entry in json.load(file)["entries"]]
    parameters, products = model.costs(ops=net.operators)
    tensors = tensors_of(net)
    write_safetensors(a.out, tensors, {
        "format": "ldi", "name": "tiefenrausch_small", "version": "1", "operator_names": " ".join(op.name for op in net.operators),
        # The library runs the network at both sizes, which gives better layout and edges than one run at 384 (README.md).
        **({"output": "log disparity"} if net.logarithmic else {"output": "disparity", "details_long_side": "448", "layout_long_side": "320"}),
        "provenance": json.dumps({
            "recipe": "examples/training/tiefenrausch_small", "teachers": "TCMonoDepth, small (MIT); Tiefenrausch as published (MIT)",
            "start": "MobileNet V2 trained on ImageNet (Apache-2.0, google-coral/test_data)", "photographs": len(names),
            "photograph_names_sha256": hashlib.sha256("\n".join(names).encode()).hexdigest(), "steps": state["step"],
            "samples": state["samples"], "steps_in_8_bits": state["step"] - state["since"] if state["ranges"] else 0, "processor_hours": round(state["seconds"] / 3600, 2), "parameters": parameters,
            "multiplications_384x288": products, "note": a.note})})

    generator = torch.Generator().manual_seed(1)
    photo = F.interpolate(torch.rand(1, 3, 6, 8, generator=generator), (96, 128), mode="bilinear", align_corners=False)
    photo = (photo[0].permute(1, 2, 0) * 255).round().numpy().astype(np.uint8)
    exact = Integers(read_safetensors(a.out)[0])(photo)
    with torch.no_grad():
        trained = net(torch.from_numpy(photo).permute(2, 0, 1)[None].float() / 255)[0, 0].numpy()
    trained = np.log(trained) if net.logarithmic else trained
    scale, zero_point = net.ranges["disparity"]
    difference = np.abs(exact.astype(np.float64) - zero_point - trained / scale)
    if a.example:
        write_safetensors(a.example, {"photo": photo, "levels": exact}, {"format": "ldi", "name": "tiefenrausch_small example"})
    print(f"{a.out}: {os.path.getsize(a.out)} bytes; exact integers differ from the network as trained by {difference.mean():.2f} steps of "
          f"{scale:.4f} on average, {difference.max():.0f} at most")


if __name__ == "__main__":
    main()
