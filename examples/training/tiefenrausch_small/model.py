"""The network as a list of operators: convolutions, additions and upsamplings, the three operators of the library's 8-bit networks.

The float network below, the quantized one (quantize.py) and the export share this list. The encoder is MobileNet V2 (Sandler et al.,
CVPR 2018) down to 1/32 of the resolution, so that training can start from its features (backbone.py); the decoder is dense 3 x 3
convolutions.
"""
from collections import namedtuple

import torch
import torch.nn as nn
import torch.nn.functional as F

# A tensor has the name of its operator; the network's input is "photo".
Convolution = namedtuple("Convolution", "name input inputs outputs kernel stride depthwise relu normalized")
Addition = namedtuple("Addition", "name a b")
Enlargement = namedtuple("Enlargement", "name input")  # nearest upsampling by two


class Builder:
    """Collects operators; every method returns the name of its result."""

    def __init__(self):
        self.operators, self.channels = [], {"photo": 3}

    def convolution(self, name, x, outputs, kernel=1, stride=1, depthwise=False, relu=False, normalized=True):
        inputs = self.channels[x]
        self.operators.append(Convolution(name, x, inputs, outputs or inputs, kernel, stride, depthwise, relu, normalized))
        self.channels[name] = outputs or inputs
        return name

    def addition(self, name, a, b):
        assert self.channels[a] == self.channels[b]
        self.operators.append(Addition(name, a, b))
        self.channels[name] = self.channels[a]
        return name

    def inverted_residual(self, name, x, outputs, expansion, stride, normalized=False):
        """Appends a MobileNet V2 block. By default, it has no normalization, because normalization is folded into the pretrained
        weights."""
        y = x
        if expansion > 1:
            y = self.convolution(name + ".expand", y, self.channels[x] * expansion, relu=True, normalized=normalized)
        y = self.convolution(name + ".depthwise", y, None, 3, stride, depthwise=True, relu=True, normalized=normalized)
        y = self.convolution(name + ".project", y, outputs, normalized=normalized)
        return self.addition(name + ".sum", x, y) if stride == 1 and outputs == self.channels[x] else y

    def residual(self, name, x):
        """Appends two dense 3 x 3 convolutions with a shortcut."""
        y = self.convolution(name + ".first", x, self.channels[x], 3, relu=True)
        return self.addition(name + ".sum", x, self.convolution(name + ".second", y, self.channels[x], 3))

    def enlargement(self, name, x):
        self.operators.append(Enlargement(name, x))
        self.channels[name] = self.channels[x]
        return name


STEM = 32
# MobileNet V2: channels, expansion, and the strides of the blocks of each stage. Without its last stage (320 channels).
STAGES_DOWN = ((16, 1, (1,)), (24, 6, (2, 1)), (32, 6, (2, 1, 1)), (64, 6, (2, 1, 1, 1)), (96, 6, (1, 1, 1)), (160, 6, (2, 1, 1)))
# Per level of the decoder, from full resolution to 1/32: channels and residual pairs.
CHANNELS_UP = (8, 24, 48, 64, 96, 128)
RESIDUALS_UP = (0, 1, 1, 1, 1, 2)


def operators():
    b = Builder()
    full = b.convolution("full", "photo", CHANNELS_UP[0], 3, relu=True)
    x, levels, block = b.convolution("stem", "photo", STEM, 3, 2, relu=True, normalized=False), [full], 0
    for outputs, expansion, strides in STAGES_DOWN:
        for stride in strides:
            if stride == 2:
                levels.append(x)
            block += 1
            x = b.inverted_residual(f"down{block}", x, outputs, expansion, stride)
    levels.append(x)
    y = b.convolution("context", levels[5], CHANNELS_UP[5], relu=True)
    for level in range(5, -1, -1):
        if level < 5:
            y = b.enlargement(f"enlarge{level}", b.convolution(f"up{level}", y, CHANNELS_UP[level], 3))
            skip = levels[level] if level == 0 else b.convolution(f"skip{level}", levels[level], CHANNELS_UP[level])
            y = b.addition(f"merge{level}", skip, y)
        for i in range(RESIDUALS_UP[level]):
            y = b.residual(f"refine{level}.{i}", y)
    # The second path, "direct", has no ReLU. With the ReLU path alone, disparity was constant where all channels after the ReLU were 0.
    detail = b.convolution("detail", b.convolution("last", y, CHANNELS_UP[0], 3, relu=True), 1, 3, normalized=False)
    b.addition("disparity", b.convolution("direct", y, 1, 3, normalized=False), detail)
    return b.operators


class Layer(nn.Module):
    """A convolution and its normalization."""

    def __init__(self, op):
        super().__init__()
        inputs = 1 if op.depthwise else op.inputs
        self.weight = nn.Parameter(torch.empty(op.outputs, inputs, op.kernel, op.kernel))
        nn.init.normal_(self.weight, 0, ((2.0 if op.relu else 1.0) / (inputs * op.kernel ** 2)) ** 0.5)
        self.norm = nn.BatchNorm2d(op.outputs, momentum=0.02) if op.normalized else None
        self.bias = None if op.normalized else nn.Parameter(torch.zeros(op.outputs))
        self.stride, self.padding, self.groups, self.relu = op.stride, op.kernel // 2, op.inputs if op.depthwise else 1, op.relu

    def forward(self, x):
        y = F.conv2d(x, self.weight, self.bias, self.stride, self.padding, 1, self.groups)
        if self.norm is not None:
            y = self.norm(y)
        return F.relu_(y) if self.relu else y

    @torch.no_grad()
    def folded(self):
        """Returns (weight, bias) of the convolution that equals this layer in evaluation mode."""
        if self.norm is None:
            return self.weight.clone(), self.bias.clone()
        factor = self.norm.weight / torch.sqrt(self.norm.running_var + self.norm.eps)
        return self.weight * factor[:, None, None, None], self.norm.bias - self.norm.running_mean * factor


def network(name):
    """Returns (operators, whether the result is log disparity) of "small", the student, or "paper", the published architecture."""
    if name == "paper":
        import tr_unet
        return tr_unet.operators(), True
    return operators(), False


class Student(nn.Module):
    """color B x 3 x H x W in [0, 1], sides multiples of 32 -> disparity B x 1 x H x W, about 0 to 1"""

    def __init__(self, ops=None, logarithmic=False):
        """ops          operators whose last one is named "disparity"; default: operators()
        logarithmic  whether the last operator returns the logarithm of disparity"""
        super().__init__()
        self.operators, self.logarithmic = ops or operators(), logarithmic
        self.layers = nn.ModuleDict({key(op.name): Layer(op) for op in self.operators if isinstance(op, Convolution)})
        for op in self.operators:  # initializes every normalized block with a shortcut close to the identity
            if isinstance(op, Addition) and op.name.endswith(".sum") and self.layers[key(op.b)].norm is not None:
                nn.init.constant_(self.layers[key(op.b)].norm.weight, 0.1)
        nn.init.constant_(self.layers["direct" if "direct" in self.layers else "disparity"].bias, -0.9 if logarithmic else 0.4)
        last = {}
        for op in self.operators:
            for name in op[1:3] if isinstance(op, Addition) else op[1:2]:
                last[name] = op.name
        self.ends = {}
        for name, reader in last.items():
            self.ends.setdefault(reader, []).append(name)

    def forward(self, x):
        tensors = {"photo": x}
        for op in self.operators:
            if isinstance(op, Convolution):
                y = self.layers[key(op.name)](tensors[op.input])
            elif isinstance(op, Addition):
                y = tensors[op.a] + tensors[op.b]
            else:
                y = F.interpolate(tensors[op.input], scale_factor=2, mode="nearest")
            for name in self.ends.get(op.name, ()):
                del tensors[name]
            tensors[op.name] = y
        return tensors["disparity"].exp() if self.logarithmic else tensors["disparity"]


def key(name):
    """Converts a name to a valid name of a torch module."""
    return name.replace(".", "_")


def costs(height=288, width=384, ops=None):
    """Returns (number of parameters with folded normalization, number of multiplications) of a list of operators for a photograph of
    height x width."""
    sizes, parameters, products = {"photo": height * width}, 0, 0
    for op in ops or operators():
        if isinstance(op, Convolution):
            sizes[op.name] = sizes[op.input] // op.stride ** 2
            weights = op.outputs * op.kernel ** 2 * (1 if op.depthwise else op.inputs)
            parameters += weights + op.outputs
            products += sizes[op.name] * weights
        else:
            sizes[op.name] = sizes[op[1]] * (4 if isinstance(op, Enlargement) else 1)
    return parameters, products


if __name__ == "__main__":
    print("%d parameters, %d multiplications at 384 x 288" % costs())
