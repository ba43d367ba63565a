"""Finds the value ranges for 8-bit arithmetic on training photographs.

Every tensor between two layers is rounded to 256 even steps. The steps cover the range from the tensor's minimum to its maximum on the
photographs, times a factor. Values outside are clipped. In decoders, clipping causes far larger errors than coarse steps do. With the
ranges of minimum mean square error, the 8-bit result for a phone photo with strong contrasts has a PSNR of 40 dB relative to float32. With
1.5 times the extremes, it has 48 dB or more, while other photos lose 2 of 55 dB (weights after 7,822 steps). In encoders, few values are
near the extremes, and finer steps are better: a factor of 0.75 gains 1 to 4 dB over 1.5.

The extremes are those of the values that the library computes. Decoders are trained inside holes only; far from holes, their values are
large and meaningless, and the library never computes them.
"""
import os

import cv2
import numpy as np
import torch
import torch.nn.functional as F

import data
import masks
import model

FACTORS = {"encoder": 0.75, "decoder": 1.5}


def crops(folder, count, size, seed):
    """Returns (image, known, exists): `count` random crops of `size` x `size` pixels with random holes, as in data.to_tensors()."""
    rng = np.random.default_rng(seed)
    names = data.training_names(folder)
    photos = []
    for i in rng.choice(len(names), count, replace=count > len(names)):
        image = cv2.cvtColor(cv2.imread(os.path.join(folder, names[i]), cv2.IMREAD_COLOR), cv2.COLOR_BGR2RGB)
        photos.append(data.crop_of(rng, image, size))
    return data.to_tensors(np.stack(photos), masks.bank(count, size, seed=seed))


def decoded(hole, exists):
    """Returns a mask per level, finest first: 1 at the pixels whose decoder values affect a hole at the finest level."""
    needed = [hole]
    for _ in range(model.LEVELS):
        exists = model.coarsen_mask(exists)
        windows = F.max_pool2d(needed[-1], 3, 1, 1)
        needed.append(F.max_pool2d(windows, 2, 2, ceil_mode=True) * exists)
    return needed


def value_ranges(net, folder, count=48, size=256, seed=3):
    """Returns {"encoder.0.range": [min, max], ...}, float32."""
    image, known, exists = crops(folder, count, size, seed)
    needed = decoded((1 - known) * exists, exists)
    ranges = {"input.range": np.array([-1, 1], np.float32)}  # inputs are differences of colors in [0, 1], and 0 or 1 for known

    def keep(part, i, mask):
        def hook(_, inputs, output):
            values = output.permute(1, 0, 2, 3)[:, (inputs[1] if mask is None else mask)[:, 0] > 0]
            extremes = np.array([min(values.min(), 0), max(values.max(), 1e-3)], np.float32)
            ranges[f"{part}.{i}.range"] = FACTORS[part] * extremes
        return hook

    handles = [layer.register_forward_hook(keep("encoder", i, None)) for i, layer in enumerate(net.encoder)]
    handles += [layer.register_forward_hook(keep("decoder", j, needed[model.LEVELS - 1 - j]))
                for j, layer in enumerate(net.decoder[:-1])]
    with torch.no_grad():
        net(image, known, exists)
    for handle in handles:
        handle.remove()
    return ranges
