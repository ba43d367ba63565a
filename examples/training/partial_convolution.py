"""The full-size PartialConv, which the paper compares Farbrausch with, in PyTorch, and its weights as a file that the library loads.

    python3 partial_convolution.py --out partial_convolution.safetensors [--state state.pt] [--type float16|float32]

Liu et al., Image Inpainting for Irregular Holes Using Partial Convolutions, ECCV 2018: 16 partial convolutions, 32.85 M weights,
37.97 G multiplications at 512 x 512. This project has not trained the network. --state is a state_dict of PartialConvolutionNetwork.
Without it, weights are random, which suffices to measure time and to compare arithmetic.

The network differs from Farbrausch (farbrausch/model.py) in input and output. The input is colors, with a mask that is 0 in holes. Holes
shrink from layer to layer. The output is colors instead of a correction to a smooth fill. Colors are in [0, 1], and no mean is subtracted:
a mean cannot be folded into the bias of a partial convolution, whose ratio differs from pixel to pixel.
"""
import argparse
import json
import os
import sys

import torch
import torch.nn as nn
import torch.nn.functional as F

sys.path.append(os.path.dirname(os.path.abspath(__file__)))
from weight_files import write_safetensors  # noqa: E402

CHANNELS = (64, 128, 256, 512, 512, 512, 512, 512)
KERNELS = (7, 5, 5, 3, 3, 3, 3, 3)
LEAK = 0.2


class PartialConvolution(nn.Module):
    """out = W (x . m) * (C k^2 / sum m) + b where the mask's sum over the window is positive, else 0 and masked; normalized and
    activated. The normalization also changes masked values, which no layer reads, so it can be folded into W and b."""

    def __init__(self, c_in, c_out, kernel, stride=1, normalize=True, leak=None):
        super().__init__()
        self.kernel, self.stride, self.leak = kernel, stride, leak
        self.weight = nn.Parameter(torch.empty(c_out, c_in, kernel, kernel))
        nn.init.kaiming_normal_(self.weight)
        self.bias = nn.Parameter(torch.zeros(c_out))
        self.norm = nn.BatchNorm2d(c_out) if normalize else None

    def forward(self, x, mask):
        """x, mask: B x C x H x W. Returns the result's values and mask; one mask channel applies to all channels."""
        with torch.no_grad():
            count = F.conv2d(mask, torch.ones_like(self.weight[:1]), None, self.stride, self.kernel // 2)
            valid = (count > 0.5).to(x)
            ratio = valid * self.weight[0].numel() / count.clamp(min=1)
        y = F.conv2d(x * mask, self.weight, None, self.stride, self.kernel // 2)
        y = y * ratio + self.bias.view(1, -1, 1, 1) * valid
        y = self.norm(y) if self.norm is not None else y
        return (F.leaky_relu(y, self.leak) if self.leak is not None else y), valid

    def folded(self):
        """Returns (weight, bias) of the same layer with folded normalization."""
        if self.norm is None:
            return self.weight.detach(), self.bias.detach()
        scale = self.norm.weight / torch.sqrt(self.norm.running_var + self.norm.eps)
        return ((self.weight * scale.view(-1, 1, 1, 1)).detach(),
                (self.norm.bias + (self.bias - self.norm.running_mean) * scale).detach())


class PartialConvolutionNetwork(nn.Module):
    def __init__(self, channels=CHANNELS, kernels=KERNELS):
        super().__init__()
        c_in = [3, *channels[:-1]]
        self.channels, self.kernels = channels, kernels
        self.encoder = nn.ModuleList(PartialConvolution(a, b, k, 2, normalize=i > 0, leak=0.0)
                                     for i, (a, b, k) in enumerate(zip(c_in, channels, kernels)))
        # decoder[j] doubles the resolution that encoder[-1 - j] halved; the last layer returns colors without activation
        self.decoder = nn.ModuleList(PartialConvolution(channels[i] + c_in[i], c_in[i], 3, normalize=i > 0, leak=LEAK if i > 0 else None)
                                     for i in reversed(range(len(channels))))

    def forward(self, image, known, exists=None):
        """image: B x 3 x H x W in [0, 1]; known, exists: B x 1 x H x W, 0 or 1. Pixels that do not exist (on a layered
        depth image, those of another surface) are masked at every scale."""
        existing = [torch.ones_like(known) if exists is None else exists]
        skips = [(image, known * existing[0])]
        for layer in self.encoder:
            x, mask = skips[-1]
            x, valid = layer(x, mask.expand_as(x))
            existing.append(existing[-1][:, :, ::2, ::2])
            skips.append((x, valid * existing[-1]))
        y, above = skips[-1]
        for layer, (x, mask), there in zip(self.decoder, skips[-2::-1], existing[-2::-1]):
            up = [F.interpolate(part, scale_factor=2, mode="nearest")[:, :, :x.shape[2], :x.shape[3]] for part in (y, above)]
            y, valid = layer(torch.cat([up[0], x], 1), torch.cat([(up[1] * there).expand_as(up[0]), mask.expand_as(x)], 1))
            above = valid * there
        return y

    def layers(self):
        for part in ("encoder", "decoder"):
            for i, layer in enumerate(getattr(self, part)):
                yield f"{part}.{i}", layer

    def architecture(self):
        return {"name": "partial_convolution", "version": 1, "layout": "out,in,height,width", "inputs": "red, green, blue, masked",
                "output": "red, green, blue", "colour_range": 1.0, "channels": list(self.channels), "kernels": list(self.kernels),
                "decoder_kernel": 3, "decoder_inputs": "upsampled, skip", "encoder_activation": "relu",
                "decoder_activation": f"leaky_relu {LEAK}, none in the last"}


def write(net, path, dtype="float32"):
    tensors = {}
    for name, layer in net.layers():
        for part, values in zip(("weight", "bias"), layer.folded()):
            tensors[f"{name}.{part}"] = values.contiguous().numpy().astype(dtype)
    write_safetensors(path, tensors, {"format": "ldi", "name": "partial_convolution", "architecture": json.dumps(net.architecture())})


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--out", required=True)
    p.add_argument("--state")
    p.add_argument("--type", choices=("float16", "float32"), default="float16")
    a = p.parse_args()
    net = PartialConvolutionNetwork().eval()
    if a.state:
        net.load_state_dict(torch.load(a.state))
    write(net, a.out, a.type)
    weights, biases = (sum(getattr(layer, part).numel() for _, layer in net.layers()) for part in ("weight", "bias"))
    print(f"{a.out}: {os.path.getsize(a.out)} bytes, {weights} weights and {biases} biases")


if __name__ == "__main__":
    main()
