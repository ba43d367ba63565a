#!/usr/bin/env python3
"""Checks that a program which includes only the single header, and links no library, makes a 3D photo from pixels in memory. It must
write the same bytes without compiler extensions (LDI_STANDARD_ONLY), because other compilers lack them.

    whole_way.py FOLDER COMPILER [FLAG...]     FOLDER: for the built programs
"""

import json
import os
import struct
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
MODELS = ROOT / "examples/models"

folder = Path(sys.argv[1])
folder.mkdir(parents=True, exist_ok=True)
source = Path(__file__).with_suffix(".cpp")


def compile_program(name, *flags):
    program = folder / name
    subprocess.run([*sys.argv[2:], "-std=c++20", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", *flags, f"-I{ROOT / 'single_include'}",
                    source, "-o", program], check=True)
    return program


def run(program, **environment):
    """Returns the GLB file that the program writes."""
    result = folder / "whole_way.glb"
    subprocess.run([program, MODELS / "tiefenrausch_small.safetensors", MODELS / "farbrausch.safetensors", result], check=True,
                   env=os.environ | environment)
    return result.read_bytes()


program = compile_program("whole_way")
file = run(program)
magic, version, length, json_length, json_type = struct.unpack("<4sIII4s", file[:20])
scene = json.loads(file[20:20 + json_length])
if (magic, version, length, json_type) != (b"glTF", 2, len(file), b"JSON") or scene["images"][0]["mimeType"] != "image/png":
    sys.exit("expected a GLB file with a PNG texture, found other data")
texture = scene["bufferViews"][scene["images"][0]["bufferView"]]
begin = 20 + json_length + 8 + texture["byteOffset"]
if file[begin:begin + 8] != b"\x89PNG\r\n\x1a\n":
    sys.exit("expected a PNG file at the offset of the texture, found other data")
print(f"{len(file)} bytes, {scene['accessors'][2]['count'] // 3} triangles")
if run(compile_program("whole_way_standard", "-DLDI_STANDARD_ONLY", "-pedantic-errors")) != run(program, LDI_ISA="scalar"):
    sys.exit("expected the same bytes without compiler extensions, found others")
