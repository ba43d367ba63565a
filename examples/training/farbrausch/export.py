"""Writes trained weights as a safetensors file that the library loads, and prints the difference between the file's results and the trained
network's.

    python3 export.py --checkpoint FOLDER/checkpoint.pt --photos PHOTOS --out farbrausch.safetensors [--type float16|float32]

Exports the running average of the weights. The normalization is folded in, so the file has ten convolutions, encoder.0 to encoder.4 and
decoder.0 to decoder.4, each with `weight` (out x in x height x width) and `bias`. For 8-bit arithmetic, it also has `input.range`,
`encoder.I.range` and, except for the last layer, `decoder.I.range`; calibrate.py finds these ranges on 48 of the photographs.
"""
import argparse
import hashlib
import json
import os
import sys

import numpy as np
import torch

import calibrate
import data
import model

sys.path.append(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from weight_files import read_safetensors, write_safetensors  # noqa: E402


def layers(net):
    for part in ("encoder", "decoder"):
        for i, layer in enumerate(getattr(net, part)):
            yield f"{part}.{i}", layer


def folded_tensors(net, dtype):
    tensors = {}
    for name, layer in layers(net):
        weight, bias = layer.folded()
        tensors[name + ".weight"] = weight.contiguous().numpy().astype(dtype)
        tensors[name + ".bias"] = bias.numpy().astype(dtype)
    return tensors


def network_of(path):
    """Reads the network of an exported file, in evaluation mode."""
    tensors, _ = read_safetensors(path)
    net = model.Farbrausch().eval()
    for name, layer in layers(net):
        weight, bias = (torch.from_numpy(tensors[f"{name}.{part}"].astype(np.float32)) for part in ("weight", "bias"))
        layer.weight.data, layer.norm, layer.bias = weight, None, torch.nn.Parameter(bias)
    return net


def architecture():
    return {
        "name": "farbrausch", "version": 1, "layout": "out,in,height,width", "inputs": "red, green, blue of fill - tone, known",
        "output": "red, green, blue, to be added to fill", "colour_range": 1.0, "channels": list(model.CHANNELS),
        "kernels": list(model.KERNELS), "decoder_kernel": 3, "decoder_inputs": "upsampled, skip", "encoder_activation": "relu",
        "decoder_activation": f"leaky_relu {model.LEAK}, none in the last", "levels": model.LEVELS, "growth": model.GROWTH,
    }


def provenance(folder, state, note):
    names = data.training_names(folder)
    digest = hashlib.sha256("\n".join(names).encode()).hexdigest()
    return {"photographs": len(names), "photograph_names_sha256": digest, "steps": state["step"],
            "processor_hours": round(state["seconds"] / 3600, 2), "recipe": "examples/training/farbrausch", "note": note}


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("--checkpoint", required=True)
    p.add_argument("--photos", required=True, help="folder of training photographs, for the provenance")
    p.add_argument("--out", required=True)
    p.add_argument("--type", choices=("float16", "float32"), default="float16")
    p.add_argument("--note", default="", help="text for the provenance, such as licenses")
    p.add_argument("--example", help="also write a small input and its output as safetensors, for tests of readers")
    a = p.parse_args()
    state = torch.load(a.checkpoint)
    net = model.Farbrausch().eval()
    net.load_state_dict(state["average"])
    tensors = folded_tensors(net, a.type) | calibrate.value_ranges(net, a.photos)
    write_safetensors(a.out, tensors, {
        "format": "ldi", "name": "farbrausch", "architecture": json.dumps(architecture()), "provenance": json.dumps(provenance(a.photos, state, a.note))})

    # A picture of odd size on which all pixels exist, so operators for images and for layered depth images have the same result.
    generator = torch.Generator().manual_seed(1)
    image = torch.rand(1, 3, 7, 9, generator=generator)
    image = torch.nn.functional.interpolate(image, (75, 97), mode="bilinear", align_corners=False)
    known, exists = torch.ones(1, 1, 75, 97), torch.ones(1, 1, 75, 97)
    known[:, :, 20:55, 30:62] = 0
    known[:, :, 60:, :12] = 0
    with torch.no_grad():
        written = network_of(a.out)
        before, after = net(image, known, exists), written(image, known, exists)
        fill, tone = model.smooth_fills(image, known, exists)
    if a.example:
        example = {"image": image[0], "known": known[0], "fill": fill[0], "tone": tone[0], "output": after[0]}
        write_safetensors(a.example, {name: t.contiguous().numpy() for name, t in example.items()},
                          {"format": "ldi", "name": "farbrausch example", "layout": "channel,row,column", "weights": os.path.basename(a.out)})
    print(f"{a.out}: {os.path.getsize(a.out)} bytes; largest difference to the trained network {(before - after).abs().max():.2e} "
          f"of an output up to {before.abs().max():.2f}")


if __name__ == "__main__":
    main()
