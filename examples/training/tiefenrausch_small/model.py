"""The network as a list of operators: convolutions, additions and enlargements, the three that the library's 8-bit networks have.

The same list serves the float network below, the quantised one (quantise.py) and the export.
"""
from collections import namedtuple

import torch
import torch.nn as nn
import torch.nn.functional as F

# Tensors are named after the operator that makes them; the network's input is called "photo".
Convolution = namedtuple("Convolution", "name input inputs outputs kernel stride depthwise relu normalised")
Addition = namedtuple("Addition", "name a b")
Enlargement = namedtuple("Enlargement", "name input")  # every pixel twice in both directions


class Builder:
    """Lists operators; every method returns the name of the tensor that it makes."""

    def __init__(self):
        self.operators, self.channels = [], {"photo": 3}

    def convolution(self, name, x, outputs, kernel=1, stride=1, depthwise=False, relu=False, normalised=True):
        inputs = self.channels[x]
        self.operators.append(Convolution(name, x, inputs, outputs or inputs, kernel, stride, depthwise, relu, normalised))
        self.channels[name] = outputs or inputs
        return name

    def addition(self, name, a, b):
        assert self.channels[a] == self.channels[b]
        self.operators.append(Addition(name, a, b))
        self.channels[name] = self.channels[a]
        return name

    def block(self, name, x, outputs, expansion, stride=1, enlarge=False):
        """The paper's: pointwise and ReLU, enlargement, depthwise 3 x 3, pointwise; around it a shortcut where shapes allow one.
        Only its narrow end is normalised: on the wide tensors normalisation costs a fifth of the training's time."""
        y = self.convolution(name + ".expand", x, round(self.channels[x] * expansion), relu=True, normalised=False)
        if enlarge:
            self.operators.append(Enlargement(name + ".enlarge", y))
            self.channels[name + ".enlarge"] = self.channels[y]
            y = name + ".enlarge"
        y = self.convolution(name + ".depthwise", y, None, 3, stride, depthwise=True, normalised=False)
        y = self.convolution(name + ".project", y, outputs)
        if stride == 1 and not enlarge and outputs == self.channels[x]:
            y = self.addition(name + ".sum", x, y)
        return y


# Per level, from full resolution to 1/32: channels, expansion of the blocks, blocks on the way down, blocks on the way up.
CHANNELS = (8, 24, 32, 56, 80, 96)
EXPANSION = (0, 2, 4, 4, 5, 5)
DOWN = (0, 0, 2, 3, 3, 3)
UP = (0, 1, 2, 2, 2, 0)
EXPANSION_DOWN = (0, 0, 2, 5, 5, 6)  # of the block that halves the resolution to reach the level
EXPANSION_UP = (1, 2, 4, 4, 4, 0)  # of the block that doubles it
CHANNELS_UP = (8, 16, 32, 56, 80, 96)


def operators():
    b = Builder()
    levels = [b.convolution("level0", "photo", CHANNELS[0], 3, relu=True, normalised=False)]
    levels.append(b.convolution("level1", levels[0], CHANNELS[1], 3, 2, relu=True))
    for i in range(2, 6):
        x = b.block(f"down{i}.0", levels[-1], CHANNELS[i], EXPANSION_DOWN[i], stride=2)
        for j in range(DOWN[i]):
            x = b.block(f"down{i}.{j + 1}", x, CHANNELS[i], EXPANSION[i])
        levels.append(x)
    for i in range(4, -1, -1):
        x = b.block(f"up{i}.0", x, CHANNELS_UP[i], EXPANSION_UP[i], enlarge=True)
        skip = levels[i] if CHANNELS_UP[i] == CHANNELS[i] else b.convolution(f"skip{i}", levels[i], CHANNELS_UP[i])
        x = b.addition(f"merge{i}", skip, x)
        for j in range(UP[i]):
            x = b.block(f"up{i}.{j + 1}", x, CHANNELS_UP[i], EXPANSION[i])
    b.convolution("log_disparity", x, 1, 3, normalised=False)
    return b.operators


class Layer(nn.Module):
    """A convolution and its normalisation."""

    def __init__(self, op):
        super().__init__()
        inputs = 1 if op.depthwise else op.inputs
        self.weight = nn.Parameter(torch.empty(op.outputs, inputs, op.kernel, op.kernel))
        nn.init.normal_(self.weight, 0, ((2.0 if op.relu else 1.0) / (inputs * op.kernel ** 2)) ** 0.5)
        self.norm = nn.BatchNorm2d(op.outputs, momentum=0.02) if op.normalised else None
        self.bias = None if op.normalised or op.depthwise else nn.Parameter(torch.zeros(op.outputs))
        self.stride, self.padding, self.groups, self.relu = op.stride, op.kernel // 2, op.inputs if op.depthwise else 1, op.relu

    def forward(self, x):
        y = F.conv2d(x, self.weight, self.bias, self.stride, self.padding, 1, self.groups)
        if self.norm is not None:
            y = self.norm(y)
        return F.relu_(y) if self.relu else y

    @torch.no_grad()
    def folded(self):
        """(weight, bias) of the convolution that does the same as this layer in evaluation."""
        if self.norm is None:
            return self.weight.clone(), torch.zeros(self.weight.shape[0]) if self.bias is None else self.bias.clone()
        factor = self.norm.weight / torch.sqrt(self.norm.running_var + self.norm.eps)
        return self.weight * factor[:, None, None, None], self.norm.bias - self.norm.running_mean * factor


class Student(nn.Module):
    """colour B x 3 x H x W in [0, 1], sides multiples of 32 -> log disparity B x 1 x H x W"""

    def __init__(self):
        super().__init__()
        self.operators = operators()
        self.layers = nn.ModuleDict({key(op.name): Layer(op) for op in self.operators if isinstance(op, Convolution)})
        for op in self.operators:  # every shortcut block starts as the identity
            if isinstance(op, Addition) and op.name.endswith(".sum"):
                nn.init.constant_(self.layers[key(op.b)].norm.weight, 0.1)
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
            if op.name == "log_disparity":  # in full precision even where autocast is on
                with torch.cpu.amp.autocast(enabled=False):
                    y = self.layers[key(op.name)](tensors[op.input].float())
            elif isinstance(op, Convolution):
                y = self.layers[key(op.name)](tensors[op.input])
            elif isinstance(op, Addition):
                y = tensors[op.a] + tensors[op.b]
            else:
                y = F.interpolate(tensors[op.input], scale_factor=2, mode="nearest")
            for name in self.ends.get(op.name, ()):
                del tensors[name]
            tensors[op.name] = y
        return tensors["log_disparity"]


def key(name):
    """A name that torch allows for a module."""
    return name.replace(".", "_")


def costs(height=288, width=384):
    """(parameters with folded normalisation, multiplications), for a photograph of that size"""
    sizes, parameters, products = {"photo": height * width}, 0, 0
    for op in operators():
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
