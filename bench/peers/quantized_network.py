#!/usr/bin/env python3
"""Converts a weight file of an 8-bit depth network for the peers, with the same 8-bit weights and ranges. The input is the sample at
288 x 384. include/ldi/nn/dense/quantized_weights.hpp describes the format of the weight file.

    quantized_network.py model FOLDER WEIGHTS     writes FOLDER/network.onnx for ONNX Runtime, and its input FOLDER/photo.f32
    quantized_network.py time FOLDER WEIGHTS      times torch's oneDNN, one thread, and prints the median in milliseconds
"""

import os
import sys
import time
from pathlib import Path

import numpy

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "examples/training"))
from weight_files import read_safetensors  # noqa: E402

HEIGHT, WIDTH = 384, 288


def operators(tensors):
    """Yields per operator: its kind (0 convolution, 1 depthwise, 2 addition, 3 enlargement), its inputs, its kernel, and its stride or
    factor. The tensors are numbered: 0 is the photo, i + 1 the result of operator i."""
    for i, (kind, a, b, kernel, stride) in enumerate(tensors["operators"].tolist()):
        yield i, kind, a, b, kernel, stride


def signed_weights(tensors, i):
    """Returns outputs x inputs x kernel x kernel, int8, and the zero point."""
    shifted = tensors[f"{i}.weight"].astype(numpy.int16).transpose(0, 3, 1, 2) - 128
    return numpy.ascontiguousarray(shifted.astype(numpy.int8)), int(tensors["weight_zero_points"][i]) - 128


def write_model(folder, tensors):
    from onnx import TensorProto, helper, numpy_helper, save

    values, nodes = {}, []

    def constant(name, value):
        values[name] = numpy_helper.from_array(numpy.array(value), name)
        return name

    for n, (scale, zero_point) in enumerate(zip(tensors["scales"], tensors["zero_points"])):
        constant(f"{n}.s", scale)
        constant(f"{n}.z", zero_point)
    quantized = [(f"{n}", f"{n}.s", f"{n}.z") for n in range(len(tensors["scales"]))]
    nodes.append(helper.make_node("QuantizeLinear", ["x", "0.s", "0.z"], ["0"]))
    for i, kind, a, b, kernel, stride in operators(tensors):
        result, of_result = str(i + 1), [f"{i + 1}.s", f"{i + 1}.z"]
        if kind < 2:
            weights, zero_point = signed_weights(tensors, i)
            inputs = [constant(f"w{i}", weights), constant(f"w{i}.s", tensors["weight_scales"][i]), constant(f"w{i}.z", numpy.int8(zero_point))]
            nodes.append(helper.make_node(
                "QLinearConv", [*quantized[a], *inputs, *of_result, constant(f"b{i}", tensors[f"{i}.bias"])], [result],
                kernel_shape=[kernel] * 2, strides=[stride] * 2, pads=[kernel // 2] * 4, group=len(weights) if kind == 1 else 1))
        elif kind == 2:
            nodes.append(helper.make_node("QLinearAdd", [*quantized[a], *quantized[b], *of_result], [result], domain="com.microsoft"))
        else:
            factors = constant(f"f{i}", numpy.array([1, 1, stride, stride], numpy.float32))
            nodes.append(helper.make_node("Resize", [str(a), "", factors], [result], mode="nearest", nearest_mode="floor",
                                          coordinate_transformation_mode="asymmetric"))
    nodes.append(helper.make_node("DequantizeLinear", quantized[-1], ["y"]))
    graph = helper.make_graph(nodes, "network", [helper.make_tensor_value_info("x", TensorProto.FLOAT, [1, 3, HEIGHT, WIDTH])],
                              [helper.make_tensor_value_info("y", TensorProto.FLOAT, [1, 1, HEIGHT, WIDTH])], list(values.values()))
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13), helper.make_opsetid("com.microsoft", 1)])
    model.ir_version = 8
    save(model, str(folder / "network.onnx"))


def write_photo(folder):
    import cv2

    photo = cv2.cvtColor(cv2.imread(str(ROOT / "examples/photo3d/sample.jpg")), cv2.COLOR_BGR2RGB)
    photo = cv2.resize(photo, (WIDTH, HEIGHT), interpolation=cv2.INTER_AREA)
    (photo.transpose(2, 0, 1)[None] / 255).astype(numpy.float32).tofile(folder / "photo.f32")


def torch_network(tensors):
    """Returns a function from 1 x 3 x H x W colors, 0 to 1, to the network's result."""
    import torch

    torch.backends.quantized.engine = "onednn"
    scales, zero_points = tensors["scales"].tolist(), tensors["zero_points"].tolist()
    layers, last_use = {}, {}
    for i, kind, a, b, kernel, stride in operators(tensors):
        last_use[a] = last_use[b] = i
        if kind < 2:
            weights, zero_point = signed_weights(tensors, i)  # oneDNN requires weights with zero point 0: a few may saturate
            weights = numpy.clip(weights.astype(numpy.int16) - zero_point, -128, 127).astype(numpy.int8)
            scale = float(tensors["weight_scales"][i])
            bias = torch.from_numpy((tensors[f"{i}.bias"] * (scales[a] * scale)).astype(numpy.float32))
            packed = torch._make_per_tensor_quantized_tensor(torch.from_numpy(weights), scale, 0)
            layers[i] = torch.ops.quantized.conv2d_prepack(packed, bias, [stride] * 2, [kernel // 2] * 2, [1, 1], len(weights) if kind == 1 else 1)

    def run(colors):
        values = {0: torch.quantize_per_tensor(colors.contiguous(memory_format=torch.channels_last), scales[0], zero_points[0], torch.quint8)}
        for i, kind, a, b, _, stride in operators(tensors):
            if kind < 2:
                values[i + 1] = torch.ops.quantized.conv2d(values[a], layers[i], scales[i + 1], zero_points[i + 1])
            elif kind == 2:
                values[i + 1] = torch.ops.quantized.add(values[a], values[b], scales[i + 1], zero_points[i + 1])
            else:
                values[i + 1] = torch.nn.functional.interpolate(values[a], scale_factor=float(stride), mode="nearest")
            for n in {a, b} - {0}:
                if last_use[n] == i:
                    del values[n]
        return values[i + 1].dequantize()

    return run


def time_torch(folder, tensors):
    os.environ["OMP_NUM_THREADS"] = "1"
    import torch

    torch.set_num_threads(1)
    colors = torch.from_numpy(numpy.fromfile(folder / "photo.f32", numpy.float32).reshape(1, 3, HEIGHT, WIDTH))
    run, milliseconds = torch_network(tensors), []
    with torch.no_grad():
        for _ in range(14):
            start = time.perf_counter()
            run(colors)
            milliseconds.append((time.perf_counter() - start) * 1e3)
    print(sorted(milliseconds[5:])[4], flush=True)


if __name__ == "__main__":
    command, destination, (content, _) = sys.argv[1], Path(sys.argv[2]), read_safetensors(sys.argv[3])
    if command == "time":
        time_torch(destination, content)
    else:
        write_model(destination, content)
        write_photo(destination)
