#!/usr/bin/env python3
"""Writes the reference files of tests/networks/farbrausch.cpp to its own folder: results of the PyTorch network of
examples/training/farbrausch for images with holes. Needs Debian's python3-torch and python3-opencv.

    farbrausch.py

farbrausch_weights.safetensors   a network with few channels, random weights and random statistics in its normalization, exported
                                 like a trained network
farbrausch_*.safetensors         image and masks (channel, row, column), and the colors of the hole's pixels in their order
"""
import pathlib
import sys

import numpy as np
import torch

FOLDER = pathlib.Path(__file__).resolve().parent
TRAINING = FOLDER.parents[2] / "examples/training"
sys.path[:0] = [str(TRAINING), str(TRAINING / "farbrausch")]
import export  # noqa: E402
import model  # noqa: E402
from weight_files import write_safetensors  # noqa: E402

FEW_CHANNELS, ALL_CHANNELS = (6, 8, 10, 12, 14), model.CHANNELS


def with_channels(channels):
    """Returns an untrained network with the given channels per stage."""
    model.CHANNELS = channels
    return model.Farbrausch().eval()


def random_network(seed):
    torch.manual_seed(seed)
    net = with_channels(FEW_CHANNELS)
    for _, layer in export.layers(net):
        if layer.norm is None:
            torch.nn.init.normal_(layer.bias, std=0.1)
        else:
            torch.nn.init.uniform_(layer.norm.weight, 0.5, 1.5)
            torch.nn.init.normal_(layer.norm.bias, std=0.2)
            layer.norm.running_mean.normal_(std=0.3)
            layer.norm.running_var.uniform_(0.3, 2.0)
    net.decoder[-1].weight.data.mul_(3.0)
    return net


def hashed(name_index, shape, spread):
    """Returns values in [-spread, spread) that the test computes as well, so that the repository stores no weights."""
    n = np.arange(int(np.prod(shape)), dtype=np.uint64)
    h = (n * 2654435761 + name_index * 40503 + 12345) & 0xFFFFFFFF
    h ^= h >> 15
    h = (h * 2246822519) & 0xFFFFFFFF
    h ^= h >> 13
    return torch.from_numpy(((h.astype(np.float64) / 2.0**31 - 1.0) * spread).astype(np.float32).reshape(shape))


def hashed_network():
    net = with_channels(ALL_CHANNELS)
    for i, (_, layer) in enumerate(export.layers(net)):
        fan_in = layer.weight[0].numel()
        layer.weight.data = hashed(2 * i, layer.weight.shape, 2.0 / fan_in**0.5)
        layer.norm, layer.bias = None, torch.nn.Parameter(hashed(2 * i + 1, (layer.weight.shape[0],), 0.1))
    return net


def smooth_image(height, width, seed):
    generator = torch.Generator().manual_seed(seed)
    coarse = torch.rand(1, 3, 6, 8, generator=generator)
    image = torch.nn.functional.interpolate(coarse, (height, width), mode="bicubic", align_corners=False)
    image = image + 0.05 * torch.rand(1, 3, height, width, generator=generator)
    return (image.clamp(0, 1) * 255).round().to(torch.uint8)


def check_windows(exists, kernel_sizes, levels=model.LEVELS):
    """Asserts that breadth-first exploration reaches every existing pixel of every window, at every level. Otherwise, a network on layered
    images would differ from one on images."""
    for level in range(levels + 1):
        height, width = exists.shape
        for y, x in zip(*np.nonzero(exists)):
            # exploration inside a pixel's 2 x 2 group must reach the group's corner
            if exists[y - y % 2, x - x % 2] and y % 2 and x % 2:
                assert exists[y - 1, x] or exists[y, x - 1], (level, y, x)
        for kernel in kernel_sizes:
            r = kernel // 2
            for y, x in zip(*np.nonzero(exists)):
                window = {(v, u) for v in range(max(y - r, 0), min(y + r + 1, height)) for u in range(max(x - r, 0), min(x + r + 1, width))
                          if exists[v, u]}
                reached, queue = {(y, x)}, [(y, x)]
                while queue:
                    v, u = queue.pop()
                    for to in ((v - 1, u), (v + 1, u), (v, u - 1), (v, u + 1)):
                        if to in window and to not in reached:
                            reached.add(to), queue.append(to)
                assert reached == window, (level, kernel, y, x)
        coarse = exists[::2, ::2]
        # adjacent coarse pixels must be linked: the fine pixel between them must exist
        assert np.all(~(coarse[:, :-1] & coarse[:, 1:]) | exists[::2, 1::2][:, :coarse.shape[1] - 1]), level
        assert np.all(~(coarse[:-1] & coarse[1:]) | exists[1::2, ::2][:coarse.shape[0] - 1]), level
        exists = coarse


def write_case(name, net, image, known, exists, with_fills=False):
    """Writes the reference file of one case. known, exists: H x W bool."""
    check_windows(exists, (3, 5, 7))
    known = known & exists
    colors = image.float() / 255 * torch.from_numpy(exists)
    as_mask = lambda mask: torch.from_numpy(mask.astype(np.float32))[None, None]  # noqa: E731
    with torch.no_grad():
        output = net(colors, as_mask(known), as_mask(exists))[0].permute(1, 2, 0).numpy()
        fill, tone = (part[0].permute(1, 2, 0).numpy() for part in model.smooth_fills(colors, as_mask(known), as_mask(exists)))
    hole = exists & ~known
    tensors = {"image": image[0].numpy(), "known": known.astype(np.uint8), "exists": exists.astype(np.uint8), "output": output[hole]}
    if with_fills:
        tensors |= {"fill": fill[exists], "tone": tone[exists]}
    path = FOLDER / f"farbrausch_{name}.safetensors"
    write_safetensors(str(path), tensors, {"format": "ldi", "layout": "image: channel, row, column; output, fill, tone: pixel, channel"})
    change = np.abs(output - fill)[hole]
    print(f"{path.name}: {path.stat().st_size} bytes, {hole.sum()} pixels in holes, output - fill up to {change.max():.2f}, mean {change.mean():.3f}")


def rectangle(mask, top, left, bottom, right, value):
    mask[top:bottom, left:right] = value
    return mask


def main():
    torch.set_num_threads(1)
    weights = FOLDER / "farbrausch_weights.safetensors"
    write_safetensors(str(weights), export.folded_tensors(random_network(1), "float16"), {
        "format": "ldi", "name": "farbrausch", "architecture": export.json.dumps(export.architecture())})
    print(f"{weights.name}: {weights.stat().st_size} bytes")
    with_channels(FEW_CHANNELS)
    few = export.network_of(str(weights))

    everywhere = np.ones((48, 64), bool)
    known = rectangle(everywhere.copy(), 10, 20, 33, 41, False)
    rectangle(known, 40, 0, 48, 9, False)
    known[np.random.default_rng(2).random(known.shape) < 0.02] = False
    write_case("whole", few, smooth_image(48, 64, 2), known, everywhere)

    exists = rectangle(np.ones((47, 61), bool), 13, 0, 36, 23, False)
    known = rectangle(np.ones((47, 61), bool), 5, 3, 47, 33, False)
    write_case("cut", few, smooth_image(47, 61, 3), known, exists, with_fills=True)

    exists = rectangle(np.ones((117, 150), bool), 31, 41, 90, 150, False)
    known = rectangle(np.ones((117, 150), bool), 18, 30, 117, 60, False)
    rectangle(known, 0, 120, 25, 150, False)
    write_case("large", hashed_network(), smooth_image(117, 150, 4), known, exists)


if __name__ == "__main__":
    main()
