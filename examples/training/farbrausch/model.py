"""Farbrausch, the inpainting network: a partial-convolution U-Net that corrects the fill of diffusion.

Paper: Kopf et al., One Shot 3D Photography, section "LDI Inpainting"; partial convolution: Liu et al., ECCV 2018. Five stride-2
stages, 0.378 M parameters, 2.67 GMAC at 512x512.

The network is trained on images and applied to layered depth images, so it uses only operators that exist for both:
windows around a pixel, stride-2 coarsening that keeps the even pixels, and nearest upsampling. Two masks, B x 1 x H x W with values
0 and 1, go with an image:

    exists  1 where the sheet has a pixel. The surface in front of a hole is a separate sheet of a layered depth image, without links
            to the hole, so the network must not read its pixels. The network reads pixels with 0 at no scale.
    known   1 where the photograph shows the pixel's color; 0 in holes and where `exists` is 0

README.md states every step as arithmetic on a layered depth image.
"""
import torch
import torch.nn as nn
import torch.nn.functional as F

CHANNELS = (20, 40, 56, 72, 80)
KERNELS = (7, 5, 5, 3, 3)
INPUTS = 4  # red, green, blue, known
LEAK = 0.2
LEVELS = len(CHANNELS)
GROWTH = 4  # pixels by which the coarsest level's colors grow into its unknown pixels


def upsample(x, like):
    """Repeats every pixel in a 2 x 2 block, and crops the result to the size of `like`, which may be odd."""
    x = F.interpolate(x, scale_factor=2, mode="nearest")
    return x[:, :, :like.shape[2], :like.shape[3]]


def coarsen_mask(mask):
    return mask[:, :, ::2, ::2]


def window_sum(x, stride):
    """Returns the sum over each 3x3 window."""
    height, width = x.shape[2:]
    x = F.pad(x, (1, 1, 1, 1))
    x = x[:, :, 0:height:stride] + x[:, :, 1:height + 1:stride] + x[:, :, 2:height + 2:stride]
    return x[:, :, :, 0:width:stride] + x[:, :, :, 1:width + 1:stride] + x[:, :, :, 2:width + 2:stride]


def average(values, mask, exists, stride=1):
    """Computes a partial convolution with weights 1/9. Returns (average, mask): for each 3x3 window, the average per channel of the pixels
    whose mask is 1, and 1 if there is such a pixel, else 0. Values must be zero where the mask is zero."""
    count = window_sum(mask, stride)
    valid = (count > 0.5).to(values) * exists
    return window_sum(values, stride) * (valid / count.clamp(min=1)), valid


def spread(color, mask, exists, keep_color, keep, passes):
    """Replaces pixels where `keep` is 0 with their 3x3 average, `passes` times. Other pixels keep `keep_color`."""
    for _ in range(passes):
        averaged, mask = average(color, mask, exists)
        color = torch.where(keep > 0, keep_color, averaged)
    return color, mask


@torch.no_grad()
def smooth_fills(image, known, exists):
    """Returns (fill, tone), both B x 3 x H x W and zero where no pixel exists.

    fill  the image where known; in the holes, an approximation of isotropic diffusion in a fixed number of passes (0.2 dB worse than
          the exact solution). The network's output is added to it.
    tone  the mean color of a wide neighborhood, for known pixels and holes alike. It is subtracted from the network's input, so that a
          red and a gray door look alike and the network never predicts an absolute color.
    """
    colors, masks, existing = [image * known], [known], [exists]
    for _ in range(LEVELS):
        existing.append(coarsen_mask(existing[-1]))
        color, mask = average(colors[-1], masks[-1], existing[-1], stride=2)
        colors.append(color)
        masks.append(mask)
    color, mask = spread(colors[-1], masks[-1], existing[-1], colors[-1], masks[-1], GROWTH)
    tone, tone_mask = color, mask
    for i in reversed(range(LEVELS)):
        above = upsample(mask, existing[i]) * existing[i]
        color = torch.where(masks[i] > 0, colors[i], upsample(color, existing[i]) * above)
        color, mask = spread(color, torch.maximum(above, masks[i]), existing[i], colors[i], masks[i], 2 << i)

        above = upsample(tone_mask, existing[i]) * existing[i]
        tone = torch.where(above > 0, upsample(tone, existing[i]), colors[i])
        tone, tone_mask = average(tone, torch.maximum(above, masks[i]), existing[i])
    mean = colors[0].sum((2, 3), keepdim=True) / masks[0].sum((2, 3), keepdim=True).clamp(min=1)
    return torch.where(mask > 0, color, mean) * exists, torch.where(tone_mask > 0, tone, mean) * exists


class PartialConvolution(nn.Module):
    """out = W (x . m) * (C k^2 / sum m) + b, then normalization and activation; zero where no pixel exists.

    The mask m is existence, because holes have values from the start. The window of an existing pixel contains the pixel itself, so sum m >
    0. The mask does not change from layer to layer, and the ratio C k^2 / sum m depends only on the graph.
    """

    def __init__(self, c_in, c_out, kernel, stride=1, normalize=True, leak=None):
        super().__init__()
        self.kernel, self.stride, self.leak = kernel, stride, leak
        self.weight = nn.Parameter(torch.empty(c_out, c_in, kernel, kernel))
        nn.init.kaiming_normal_(self.weight, a=LEAK)
        self.bias = None if normalize else nn.Parameter(torch.zeros(c_out))
        self.norm = nn.BatchNorm2d(c_out) if normalize else None

    def forward(self, parts, exists):
        """parts: [(values B x C x H x W, mask B x 1 x H x W)], concatenated along the channels; values are zero where their mask is zero.
        exists: B x 1 x H' x W', where H' x W' is the size of the output."""
        x = torch.cat([values for values, _ in parts], 1) if len(parts) > 1 else parts[0][0]
        with torch.no_grad():
            weighted = sum(mask * values.shape[1] for values, mask in parts)
            count = F.avg_pool2d(weighted, self.kernel, self.stride, self.kernel // 2, divisor_override=1)
            ratio = exists * (self.kernel ** 2 * x.shape[1]) / count.clamp(min=1)
        y = F.conv2d(x, self.weight, None, self.stride, self.kernel // 2) * ratio
        y = self.norm(y) if self.norm is not None else y + self.bias.view(1, -1, 1, 1)
        if self.leak is not None:
            y = F.leaky_relu(y, self.leak) if self.leak > 0 else F.relu(y)
        return y * exists

    def folded(self):
        """Returns (weight, bias) of the same layer with folded normalization."""
        if self.norm is None:
            return self.weight.detach(), self.bias.detach()
        scale = self.norm.weight / torch.sqrt(self.norm.running_var + self.norm.eps)
        return (self.weight * scale.view(-1, 1, 1, 1)).detach(), (self.norm.bias - self.norm.running_mean * scale).detach()


class Farbrausch(nn.Module):
    def __init__(self):
        super().__init__()
        c_in = [INPUTS, *CHANNELS[:-1]]
        self.encoder = nn.ModuleList(
            PartialConvolution(a, b, k, 2, normalize=i > 0, leak=0.0) for i, (a, b, k) in enumerate(zip(c_in, CHANNELS, KERNELS)))
        # decoder[j] doubles the resolution that encoder[LEVELS - 1 - j] halved
        self.decoder = nn.ModuleList()
        previous = CHANNELS[-1]
        for i in reversed(range(LEVELS)):
            c_out = c_in[i] if i > 0 else 3
            self.decoder.append(PartialConvolution(previous + c_in[i], c_out, 3, normalize=i > 0, leak=LEAK if i > 0 else None))
            previous = c_out
        with torch.no_grad():
            self.decoder[-1].weight.mul_(0.1)  # so that an untrained network hardly changes the fill

    def residual(self, x, exists):
        """Returns the correction to add to the fill. x: B x INPUTS x H x W, zero where nothing exists."""
        existing = [exists]
        for _ in range(LEVELS):
            existing.append(coarsen_mask(existing[-1]))
        skips = [x]
        for i, layer in enumerate(self.encoder):
            skips.append(layer([(skips[i], existing[i])], existing[i + 1]))
        y = skips[-1]
        for j, layer in enumerate(self.decoder):
            i = LEVELS - 1 - j
            # 0 for pixels whose coarse pixel does not exist
            above = upsample(existing[i + 1], existing[i]) * existing[i]
            y = layer([(upsample(y, existing[i]) * existing[i], above), (skips[i], existing[i])], existing[i])
        return y

    def forward(self, image, known, exists):
        """image: B x 3 x H x W in [0, 1]. Returns a color for every existing pixel, valid only in the holes; not clamped."""
        known = known * exists
        fill, tone = smooth_fills(image, known, exists)
        x = torch.cat([fill - tone, known], 1).contiguous(memory_format=torch.channels_last)
        return fill + self.residual(x, exists)
