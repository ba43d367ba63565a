"""Writes trained weights as a safetensors file that the library can load. Prints the difference between the file's results in 8 bits and
the checkpoint's.

    python3 export.py --checkpoint FOLDER/final.pt --photos PHOTOS --out silhouettes.safetensors [--data DATA] [--example FILE]

The file has NAME.weight (out x in x 3 x 3) and NAME.bias of every convolution in model.LAYERS, as float16, with the normalization folded in.
For 8-bit arithmetic, it also has input.range and NAME.range of every tensor that a layer reads. A checkpoint that was trained with rounded
values contains these ranges. For other checkpoints, DATA must be an output folder of prepare.py. The weights in the file are not rounded to
8 bits, so that training can resume from the file. The library rounds them.
"""
import argparse
import hashlib
import json
import os
import sys

import cv2
import numpy as np
import torch

import band as bands
import composites
import model
import quantize

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from weight_files import write_safetensors  # noqa: E402


def architecture():
    return {
        "name": "silhouettes", "version": 1, "layout": "out,in,height,width",
        "inputs": "red, green, blue, share of the front by the estimate, by the prepared disparity, step, signed distance, sample size",
        "output": "logit of alpha to be added to the prior, logit of the probability that its side is right", "prior": model.PRIOR, "activation": "relu, none in the last",
        "kernel": 3, "max_step": bands.MAX_STEP, "min_step": bands.MIN_STEP, "sides_radius": bands.SIDES_RADIUS,
        "band_radius": bands.BAND_RADIUS, "region_radius": bands.REGION_RADIUS,
        "layers": [{"name": name, "reads": list(reads), "level": level, "stride": stride} for name, reads, _, _, level, stride in model.LAYERS],
    }


def provenance(folder, state, note):
    names = [n for i, n in enumerate(sorted(os.listdir(folder))) if i % composites.HELD_OUT != 0]
    digest = hashlib.sha256("\n".join(names).encode()).hexdigest()
    return {"photographs": len(names), "photograph_names_sha256": digest, "steps": state["step"], "processor_hours": round(state["seconds"] / 3600, 2),
            "recipe": "examples/training/silhouettes", "note": note}


def example_scene():
    """Returns (photo, estimate, prepared disparity) of a synthetic scene of odd size: a tilted foreground with a hole, a second foreground, smooth colors."""
    height, width = 93, 107
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)
    first = ((x - 42) ** 2 + (y - 48) ** 2 < 30 ** 2) & ((x - 38) ** 2 + (y - 42) ** 2 > 8 ** 2)
    second = (np.abs(x - 80) < 9) & (y > 25)
    photo = np.stack([127 + 90 * np.sin(x / 7 + y / 19), 127 + 80 * np.cos(x / 13 - y / 5), 100 + x], -1)
    photo[first] = np.stack([60 + y, 200 - x, 90 + 60 * np.sin(x * y / 300)], -1)[first]
    photo[second] = np.stack([230 - y, 40 + x, 0 * x + 70], -1)[second]

    def disparity(shift):
        a, b = np.roll(first, shift, 1), np.roll(second, shift, 0)
        return np.where(b, 0.75 + 0.001 * y, np.where(a, 0.5 + 0.0007 * x, 0.15 + 0.0005 * y)).astype(np.float32)

    estimated = cv2.GaussianBlur(cv2.resize(disparity(3), (48, 42), interpolation=cv2.INTER_AREA), (0, 0), 1.5)
    return photo.clip(0, 255).astype(np.uint8), estimated, disparity(2)


def write_example(path, weights):
    net, observe = quantize.in_bytes(*quantize.network_of(weights))
    photo, estimated, prepared = example_scene()
    band = bands.Band(prepared)
    x = bands.quantized(band.features(photo, estimated))
    region = torch.from_numpy(band.region[None, None].astype(np.float32))
    with torch.no_grad():
        logits = net(model.padded((torch.from_numpy(x[None]).float() - 128) / 127), model.padded(region), observe)
    logits = logits[0, :, :photo.shape[0], :photo.shape[1]].numpy() * band.region
    write_safetensors(path, {
        "photo": photo, "estimate": estimated, "prepared": prepared, "input": x, "logits": logits.astype(np.float32)},
        {"format": "ldi", "name": "silhouettes example", "weights": os.path.basename(weights),
         "layout": "photo, maps: row,column[,channel]; input, logits: channel,row,column; logits 0 outside the region"})


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--checkpoint", required=True)
    p.add_argument("--photos", required=True, help="folder of training photographs, for the provenance")
    p.add_argument("--out", required=True)
    p.add_argument("--data", help="folder of prepare.py, for ranges if the checkpoint has none")
    p.add_argument("--note", default="", help="text for the provenance, such as licenses")
    p.add_argument("--example", help="also write a small input and its output as safetensors, for tests of readers")
    a = p.parse_args()
    state, (net, ranges) = torch.load(a.checkpoint), quantize.network_of(a.checkpoint)
    if not ranges:
        import train
        crops = train.Crops([a.data])
        ranges = quantize.value_ranges(net, [crops.batch(np.random.default_rng(5), 32) for _ in range(20)])
    tensors = {}
    for layer, (name, *_) in zip(net.layers, model.LAYERS):
        tensors[name + ".weight"] = layer.weight.detach().contiguous().numpy().astype(np.float16)
        tensors[name + ".bias"] = layer.bias.detach().numpy().astype(np.float16)
    tensors |= {name + ".range": np.array(ends, np.float32) for name, ends in ranges.items()}
    write_safetensors(a.out, tensors, {"format": "ldi", "name": "silhouettes", "architecture": json.dumps(architecture()),
                                       "provenance": json.dumps(provenance(a.photos, state, a.note))})
    photo, estimated, prepared = example_scene()
    band = bands.Band(prepared)
    x = (torch.from_numpy(bands.quantized(band.features(photo, estimated))[None]).float() - 128) / 127
    region = torch.from_numpy(band.region[None, None].astype(np.float32))
    with torch.no_grad():
        before = net(model.padded(x), model.padded(region))
        written, observe = quantize.in_bytes(*quantize.network_of(a.out))
        after = written(model.padded(x), model.padded(region), observe)
    difference = (torch.sigmoid(before[:, :1]) - torch.sigmoid(after[:, :1]))[model.padded(region) > 0].abs()
    print(f"{a.out}: {os.path.getsize(a.out)} bytes; in 8 bits alpha differs from the checkpoint's in floats by {difference.mean():.4f} on average, "
          f"by {difference.max():.4f} at most")
    if a.example:
        write_example(a.example, a.out)


if __name__ == "__main__":
    main()
