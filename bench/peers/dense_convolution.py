#!/usr/bin/env python3
"""Times 3 x 3 convolutions of torch's oneDNN on an image (float32, one thread), or writes the same convolutions as models for ONNX Runtime.

    dense_convolution.py time WIDTH HEIGHT CHANNELS...           channels and median milliseconds of processor time, line by line
    dense_convolution.py models FOLDER WIDTH HEIGHT CHANNELS...  FOLDER/conv_CHANNELS.onnx
"""

import os
import sys
import time
from pathlib import Path


def time_torch(width, height, all_channels):
    os.environ["OMP_NUM_THREADS"] = "1"
    import torch

    torch.set_num_threads(1)
    for channels in all_channels:
        convolution = torch.nn.Conv2d(channels, channels, 3, padding=1).to(memory_format=torch.channels_last).eval()
        image = torch.rand(1, channels, height, width).contiguous(memory_format=torch.channels_last)
        milliseconds = []
        with torch.no_grad():
            for _ in range(7):
                start = time.process_time()
                convolution(image)
                milliseconds.append((time.process_time() - start) * 1e3)
        print(channels, sorted(milliseconds[2:])[2], flush=True)


def write_models(folder, width, height, all_channels):
    import numpy
    from onnx import TensorProto, helper, numpy_helper, save

    for channels in all_channels:
        random = numpy.random.RandomState(0)
        weights = random.randn(channels, channels, 3, 3).astype(numpy.float32) * 0.1
        bias = random.randn(channels).astype(numpy.float32)
        shape = [1, channels, height, width]
        graph = helper.make_graph(
            [helper.make_node("Conv", ["x", "w", "b"], ["y"], kernel_shape=[3, 3], pads=[1] * 4)],
            "conv",
            [helper.make_tensor_value_info("x", TensorProto.FLOAT, shape)],
            [helper.make_tensor_value_info("y", TensorProto.FLOAT, shape)],
            [numpy_helper.from_array(weights, "w"), numpy_helper.from_array(bias, "b")],
        )
        model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 13)])
        model.ir_version = 8
        save(model, str(folder / f"conv_{channels}.onnx"))


if sys.argv[1] == "time":
    time_torch(int(sys.argv[2]), int(sys.argv[3]), [int(c) for c in sys.argv[4:]])
else:
    write_models(Path(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), [int(c) for c in sys.argv[5:]])
