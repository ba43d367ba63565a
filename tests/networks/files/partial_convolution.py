#!/usr/bin/env python3
"""Writes the PartialConv reference files of tests/networks/farbrausch.cpp to its own folder: results of the PyTorch network of
examples/training/partial_convolution.py for images with holes. Needs Debian's python3-torch and python3-opencv.

    partial_convolution.py

partial_convolution_weights.safetensors   a network of all eight levels with few channels, random weights and random statistics in
                                          its normalization, exported like a trained network
partial_convolution_*.safetensors         same as those of farbrausch.py; the weights of `full` are hashes of all 32.85 M indices
"""
import farbrausch
import numpy as np
import torch

import partial_convolution as model  # noqa: E402  (farbrausch.py adds its folder to the path)

FEW_CHANNELS = (4, 5, 6, 7, 8, 7, 6, 5)


def random_network(seed):
    torch.manual_seed(seed)
    net = model.PartialConvolutionNetwork(FEW_CHANNELS).eval()
    for _, layer in net.layers():
        torch.nn.init.normal_(layer.bias, std=0.1)
        if layer.norm is not None:
            torch.nn.init.uniform_(layer.norm.weight, 0.5, 1.5)
            torch.nn.init.normal_(layer.norm.bias, std=0.2)
            layer.norm.running_mean.normal_(std=0.3)
            layer.norm.running_var.uniform_(0.3, 2.0)
    return net


def hashed_network():
    net = model.PartialConvolutionNetwork().eval()
    for i, (_, layer) in enumerate(net.layers()):
        layer.weight.data = farbrausch.hashed(2 * i, layer.weight.shape, 2.0 / layer.weight[0].numel() ** 0.5)
        layer.norm, layer.bias = None, torch.nn.Parameter(farbrausch.hashed(2 * i + 1, (layer.weight.shape[0],), 0.1))
    return net


def write_case(name, net, image, known, exists):
    """Writes the reference file of one case. known, exists: H x W bool."""
    farbrausch.check_windows(exists, (3, 5, 7), len(model.CHANNELS))
    known = known & exists
    as_mask = lambda mask: torch.from_numpy(mask.astype(np.float64))[None, None]  # noqa: E731
    with torch.no_grad():
        output = net.double()(image.double() / 255, as_mask(known), as_mask(exists))[0].permute(1, 2, 0).float().numpy()
    hole = exists & ~known
    path = farbrausch.FOLDER / f"partial_convolution_{name}.safetensors"
    farbrausch.write_safetensors(str(path), {"image": image[0].numpy(), "known": known.astype(np.uint8), "exists": exists.astype(np.uint8),
                                             "output": output[hole]},
                                 {"format": "ldi", "layout": "image: channel, row, column; output: pixel, channel"})
    print(f"{path.name}: {path.stat().st_size} bytes, {hole.sum()} pixels in holes, output up to {np.abs(output[hole]).max():.2f}, "
          f"mean {np.abs(output[hole]).mean():.3f}")


def main():
    torch.set_num_threads(1)
    everywhere = np.ones((47, 61), bool)
    known = farbrausch.rectangle(everywhere.copy(), 5, 17, 40, 50, False)
    known[np.random.default_rng(2).random(known.shape) < 0.02] = False
    few = random_network(1)
    path = farbrausch.FOLDER / "partial_convolution_weights.safetensors"
    model.write(few, str(path))
    print(f"{path.name}: {path.stat().st_size} bytes")
    write_case("whole", few, farbrausch.smooth_image(47, 61, 5), known, everywhere)
    exists = farbrausch.rectangle(everywhere.copy(), 13, 0, 36, 23, False)
    write_case("cut", few, farbrausch.smooth_image(47, 61, 6), known, exists)
    write_case("full", hashed_network(), farbrausch.smooth_image(47, 61, 5), farbrausch.rectangle(everywhere.copy(), 16, 24, 30, 44, False), exists)


if __name__ == "__main__":
    main()
