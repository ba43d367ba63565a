"""The silhouette network: a small U-Net over the band beside steps of disparity."""
import torch
import torch.nn.functional as F
from torch import nn

from band import CHANNELS

WIDTH, FINE = 32, 16  # channels at half resolution and below; at full resolution
PRIOR = 6.0           # factor of the prior: alpha's logit is offset by PRIOR * (share of the prepared disparity - 0.5)

# name, source tensors (the first is upsampled if it is coarser than the result), inputs, outputs, level of the result, stride
LAYERS = (
    ("fine", ("input",), CHANNELS, FINE, 0, 1),
    ("half.down", ("fine",), FINE, WIDTH, 1, 2),
    ("half", ("half.down",), WIDTH, WIDTH, 1, 1),
    ("quarter.down", ("half",), WIDTH, WIDTH, 2, 2),
    ("quarter", ("quarter.down",), WIDTH, WIDTH, 2, 1),
    ("eighth.down", ("quarter",), WIDTH, WIDTH, 3, 2),
    ("eighth", ("eighth.down",), WIDTH, WIDTH, 3, 1),
    ("quarter.up", ("eighth", "quarter"), 2 * WIDTH, WIDTH, 2, 1),
    ("half.up", ("quarter.up", "half"), 2 * WIDTH, FINE, 1, 1),
    ("fine.up", ("half.up", "fine"), 2 * FINE, FINE, 0, 1),
    ("out", ("fine.up",), FINE, 2, 0, 1),
)


class Rectified(torch.autograd.Function):
    """ReLU inside the region, zero outside. This single pass has half the memory traffic of two operations."""

    @staticmethod
    def forward(ctx, x, region):
        y = x.clamp(min=0).mul_(region)
        ctx.save_for_backward(y)
        return y

    @staticmethod
    def backward(ctx, gradient):
        return torch.ops.aten.threshold_backward(gradient, ctx.saved_tensors[0], 0), None


class Layer(nn.Module):
    """A 3 x 3 convolution. All layers but the last have batch normalization and ReLU, and set values outside the region to zero."""

    def __init__(self, name, inputs, outputs, stride):
        super().__init__()
        self.is_last, self.stride = name == "out", stride
        self.weight = nn.Parameter(torch.empty(outputs, inputs, 3, 3))
        nn.init.kaiming_normal_(self.weight, nonlinearity="relu")
        self.norm = None if self.is_last else nn.BatchNorm2d(outputs)
        self.bias = nn.Parameter(torch.zeros(outputs)) if self.is_last else None
        if self.is_last:
            nn.init.zeros_(self.weight)

    def folded(self):
        """Returns (weight, bias) with folded normalization."""
        if self.norm is None:
            return self.weight, self.bias
        scale = self.norm.weight / torch.sqrt(self.norm.running_var + self.norm.eps)
        return self.weight * scale[:, None, None, None], self.norm.bias - self.norm.running_mean * scale

    def fold(self):
        """Folds the normalization into the weights."""
        weight, bias = self.folded()
        self.weight, self.bias, self.norm = nn.Parameter(weight.detach()), nn.Parameter(bias.detach()), None

    def forward(self, x, region):
        x = F.conv2d(x, self.weight, self.bias, self.stride, 1)
        if self.norm is not None:
            x = self.norm(x)
        return x if self.is_last else Rectified.apply(x, region.to(x.dtype))


def upsampled(x, like):
    return F.interpolate(x, scale_factor=2, mode="nearest")[:, :, :like.shape[2], :like.shape[3]]


class Silhouettes(nn.Module):
    def __init__(self):
        super().__init__()
        self.layers = nn.ModuleList(Layer(name, inputs, outputs, stride) for name, _, inputs, outputs, _, stride in LAYERS)

    def forward(self, x, region, observe=lambda name, value: value):
        """Returns N x 2 x H x W: logits of alpha and of the probability that alpha's side is right.

        x        N x CHANNELS x H x W, 0 outside the region
        region   N x 1 x H x W, 0 or 1; level i + 1 keeps the pixels of level i with even x and y
        observe  function (name, tensor) -> tensor that may replace every tensor that a layer reads"""
        regions, values = [region], {"input": observe("input", x)}
        for _ in range(3):
            regions.append(regions[-1][:, :, ::2, ::2].contiguous())
        for layer, (name, reads, _, _, level, _) in zip(self.layers, LAYERS):
            read = [values[r] for r in reads]
            if len(read) == 2:
                read[0] = upsampled(read[0], read[1]) * regions[level].to(read[0].dtype)
            y = layer(read[0] if len(read) == 1 else torch.cat(read, 1), regions[level])
            values[name] = y if name == "out" else observe(name, y)
        logits = values["out"]
        prior = PRIOR * x[:, 4:5].clamp(-0.5, 0.5)
        return torch.cat([logits[:, :1] + prior, logits[:, 1:]], 1)

    def cost(self):
        """Returns (number of weights, multiplications per pixel of a region whose level i has exactly 1 / 4^i of the pixels)."""
        weights = sum(layer.weight[0].numel() * layer.weight.shape[0] for layer in self.layers)
        return weights, sum(layer.weight.numel() / 4 ** level for layer, (*_, level, _) in zip(self.layers, LAYERS))


def padded(x, multiple=8):
    """Pads H and W with zeros at the end to multiples of `multiple`."""
    return F.pad(x, (0, -x.shape[-1] % multiple, 0, -x.shape[-2] % multiple))
