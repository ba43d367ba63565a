"""Reads the initial features of the training: MobileNet V2 trained on ImageNet, from a quantized TFLite file.

    tf2_mobilenet_v2_1.0_224_ptq.tflite of github.com/google-coral/test_data (Apache-2.0): 8 bits, normalization folded in

In that file every output channel has its own scale; the library's 8-bit networks have one scale for all weights of a layer. Channels with
small weights would lose precision, so weights are first moved between the layers of a block. This does not change the results as long as
the activation in between is a ReLU: relu(s x) = s relu(x) for s > 0 (Nagel et al., Data-Free Quantization Through Weight Equalization and
Bias Correction, ICCV 2019). MobileNet V2 also clips its activations at 6; this network does not, and training compensates.
"""
import numpy as np
import torch
from flatbuffers import number_types
from flatbuffers.table import Table

CONVOLUTION, DEPTHWISE = 3, 4  # TFLite's BuiltinOperator
DTYPES = {9: np.int8, 2: np.int32}  # TFLite's TensorType


class Fields(Table):
    """A table of a flatbuffer. Field numbers are those of TFLite's schema (tensorflow/lite/schema/schema.fbs)."""

    def at(self, field):
        offset = self.Offset(4 + 2 * field)
        return self.Pos + offset if offset else None

    def number(self, field, kind):
        return self.Get(kind, self.at(field)) if self.at(field) else 0

    def table(self, field):
        return Fields(self.Bytes, self.Indirect(self.at(field)))

    def tables(self, field):
        offset = self.Offset(4 + 2 * field)
        start = self.Vector(offset)
        return [Fields(self.Bytes, self.Indirect(start + 4 * i)) for i in range(self.VectorLen(offset))]

    def numbers(self, field, dtype):
        offset = self.Offset(4 + 2 * field)
        return np.frombuffer(self.Bytes, dtype, self.VectorLen(offset), self.Vector(offset)) if offset else np.zeros(0, dtype)


def read_convolutions(path):
    """Returns [(weight in torch's layout, bias)] of a TFLite file's convolutions, in order, as floats."""
    with open(path, "rb") as file:
        data = file.read()
    model = Fields(data, int.from_bytes(data[:4], "little"))
    # TFLite has two fields for an operator's code; all codes used here fit into the older one.
    codes = [code.number(0, number_types.Int8Flags) for code in model.tables(1)]
    graph, buffers = model.tables(2)[0], model.tables(4)
    tensors = graph.tables(0)

    def values(index):
        tensor = tensors[index]
        stored = np.frombuffer(buffers[tensor.number(2, number_types.Uint32Flags)].numbers(0, np.uint8).tobytes(),
                               DTYPES[tensor.number(1, number_types.Int8Flags)])
        quantization = tensor.table(4)
        scales, zero_points = quantization.numbers(2, np.float32), quantization.numbers(3, np.int64)
        shape = tensor.numbers(0, np.int32)
        along = np.ones(len(shape), int)
        along[quantization.number(6, number_types.Int32Flags)] = len(scales)
        return (stored.reshape(shape).astype(np.float64) - zero_points.reshape(along)) * scales.reshape(along)

    found = []
    for op in graph.tables(3):
        code = codes[op.number(0, number_types.Uint32Flags)]
        if code in (CONVOLUTION, DEPTHWISE):
            _, weight, bias = op.numbers(1, np.int32)
            order = (0, 3, 1, 2) if code == CONVOLUTION else (3, 0, 1, 2)  # transposed to outputs x inputs x height x width
            found.append((torch.from_numpy(values(weight).transpose(order).copy()).float(), torch.from_numpy(values(bias).copy()).float()))
    return found


def largest(weight, dim):
    """Returns the largest magnitude of each slice along a dimension."""
    return weight.abs().transpose(0, dim).flatten(1).amax(1)


def equalize(layers):
    """Equalizes the magnitudes of the channels between successive layers [(weight, bias)]. A ReLU follows every layer but the last."""
    for (weight, bias), (reader, reader_bias) in zip(layers, layers[1:]):  # folds channels of constant output into the next layer's bias
        dead = largest(weight, 0) <= 1e-6
        if reader.shape[1] == 1:
            reader_bias += dead * bias.relu() * reader.sum((1, 2, 3))
            reader[dead] = 0
    for _ in range(20):
        for (weight, bias), (reader, _) in zip(layers, layers[1:]):
            depthwise = reader.shape[1] == 1
            before, after = largest(weight, 0), largest(reader, 0 if depthwise else 1)
            factor = torch.where((before > 1e-6) & (after > 1e-6), (after / before).sqrt(), torch.ones(()))
            weight *= factor[:, None, None, None]
            bias *= factor
            reader /= factor[:, None, None, None] if depthwise else factor[None, :, None, None]


@torch.no_grad()
def start_from(student, path):
    """Copies the features of a TFLite file into the encoder of a model.Student."""
    names = [name for name in student.layers if name == "stem" or name.startswith("down")]
    layers = dict(zip(names, read_convolutions(path)))
    weight, bias = layers["stem"]  # MobileNet V2's input was (255 x - 127) / 127.5
    bias -= weight.sum((1, 2, 3)) * (127 / 127.5)
    weight *= 2
    chain = []
    for name in names:
        chain.append(layers[name])
        if name.endswith("project"):
            equalize(chain)
            chain = []
    for name, (weight, bias) in layers.items():
        assert student.layers[name].weight.shape == weight.shape, name
        student.layers[name].weight.copy_(weight)
        student.layers[name].bias.copy_(bias)
