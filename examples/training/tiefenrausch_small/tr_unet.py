"""The paper's own depth network: a U-Net of TR blocks (1 x 1 convolution, ReLU, depthwise 3 x 3, 1 x 1), as published.

    python3 tr_unet.py --published FILE.safetensors --golden FOLDER [--check-training DATA]

FILE is the published network, written by convert.cpp. FOLDER has photographs, NAME_384x288_rgb.npy, and the results that the published
network computes for them, NAME_384x288_log_disparity_u8.npy. Loads the weights and prints the differences from these results: with exact
integers, in float, and in the 8 bits of this recipe's training (weights with zero point 128). With --check-training, also trains a few
steps in 8 bits on DATA, an output folder of prepare.py.

train.py --network paper trains this network, from random weights or from FILE (--weights).
"""
import argparse
import functools
import glob
import os

from model import Builder, Convolution, Student, key

# Channels and expansion per level, from full resolution to 1/32 (layers of the published files). Every stage has 3 blocks.
DOWN = ((48, None), (40, 1), (56, 4), (80, 5), (64, 9), (96, 9))  # encoder; level 0 is a single convolution
ACROSS = ((32, 1), (8, 1), (56, 4), (96, 5), (96, 9), (96, 9))  # skip connections
UP = ((32, 1), (8, 4), (56, 5), (96, 9), (96, 9))  # decoder, levels 0 to 4
BLOCKS = 3


def tr_block(b, name, x, outputs, expansion, stride=1, enlarge=False):
    y = b.convolution(name + ".expand", x, b.channels[x] * expansion, relu=True)
    if enlarge:
        y = b.enlargement(name + ".enlarge", y)
    y = b.convolution(name + ".depthwise", y, None, 3, stride, depthwise=True)
    y = b.convolution(name + ".project", y, outputs)
    return b.addition(name + ".sum", x, y) if not enlarge and stride == 1 and outputs == b.channels[x] else y


def stage(b, name, x, outputs, expansion, stride=1, enlarge=False):
    """Appends three blocks; the first one changes resolution and channels. Expansion multiplies a block's input channels."""
    for i in range(BLOCKS):
        first = i == 0
        x = tr_block(b, f"{name}.{i}", x, outputs, expansion, stride if first else 1, enlarge and first)
    return x


def operators():
    """Returns the operators in the order of the published files."""
    b = Builder()
    levels = [b.convolution("first", "photo", DOWN[0][0], 3, relu=True)]
    for level in range(1, 6):
        levels.append(stage(b, f"encode{level}", levels[-1], *DOWN[level], stride=2))
    across = [stage(b, f"across{level}", levels[level], *ACROSS[level]) for level in range(5, -1, -1)][::-1]
    y = across[5]
    for level in range(4, -1, -1):
        y = stage(b, f"decode{level}", y, *UP[level], enlarge=True)
        y = b.addition(f"merge{level}", across[level], y)
    b.convolution("disparity", y, 1, 3, normalized=False)
    return b.operators


def clipped(scale, zero_point, layer, inputs, output):
    return output.clamp(-zero_point * scale, (255 - zero_point) * scale)


def main():
    import numpy as np
    import torch

    import data
    import export
    from losses import losses
    from quantize import Quantized
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--published", required=True)
    p.add_argument("--golden", required=True)
    p.add_argument("--check-training", metavar="DATA")
    p.add_argument("--steps", type=int, default=20)
    p.add_argument("--photos", type=int, default=2, help="number of golden photographs")
    a = p.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(0)
    tensors, _ = export.read_safetensors(a.published)
    ops = operators()
    ranges = export.ranges_of(tensors, ops)
    print(f"{len(ops)} operators, as published")
    scale, zero_point = ranges["disparity"]
    student, net = Student(ops, True), None
    for path in sorted(glob.glob(os.path.join(a.golden, "*_384x288_rgb.npy")))[:a.photos]:
        photo, golden = np.load(path), np.load(path.replace("rgb", "log_disparity_u8")).squeeze().astype(int)
        color = torch.from_numpy(photo).permute(2, 0, 1)[None].float() / 255
        if net is None:  # the photograph only initializes normalization, which is folded into the weights; results do not depend on it
            export.start_from(student, a.published, [color])
            student.eval()
            net = Quantized(ranges, ops=ops, logarithmic=True).take(student)
        photo_scale, photo_zero_point = ranges["photo"]
        input_bytes = np.clip(np.rint(photo / 255 / photo_scale) + photo_zero_point, 0, 255).astype(np.uint8)
        results = {"exact integers": export.Integers(tensors)(input_bytes).astype(int)}
        with torch.no_grad():
            for name, network in (("float", student), ("the recipe's 8 bits", net)):
                results[name] = (network(color)[0, 0].log() / scale).numpy() + zero_point
            clips = [student.layers[key(op.name)].register_forward_hook(functools.partial(clipped, *ranges[op.name]))
                     for op in ops if isinstance(op, Convolution)]
            results["float, clipped to the ranges of 8 bits"] = (student(color)[0, 0].log() / scale).numpy() + zero_point
            for clip in clips:
                clip.remove()
        for name, levels in results.items():
            off = np.abs(levels - golden)
            print(f"{os.path.basename(path).split('_')[0]}, {name}: {off.mean():.3f} of 256 levels apart on average, at most {off.max():.1f}; "
                  f"{100 * (off <= 1).mean():.1f} % within 1; correlation {np.corrcoef(levels.ravel(), golden.ravel())[0, 1]:.5f}", flush=True)
    if a.check_training:
        photographs, rng = data.Photographs(a.check_training), np.random.default_rng(0)
        batches = [photographs.batch(rng, 2, (64, 96)) for _ in range(4)]
        optimizer, seen = torch.optim.AdamW(net.parameters(), 1e-4), []
        for step in range(a.steps):
            color, truth, known = batches[step % len(batches)]
            total = sum(losses(net(color), truth, known).values())
            optimizer.zero_grad(set_to_none=True)
            total.backward()
            torch.nn.utils.clip_grad_norm_(net.parameters(), 1.0)
            optimizer.step()
            seen.append(total.item())
        first, last = np.mean(seen[:4]), np.mean(seen[-4:])
        export.Integers(export.tensors_of(net))  # raises an error if the library would refuse the file
        print(f"training in 8 bits, {a.steps} steps on four batches: loss {first:.4f} before, {last:.4f} after")
        assert last < first


if __name__ == "__main__":
    main()
