#!/usr/bin/env python3
"""A program that includes nothing but the single header, and links nothing, makes a 3D photo from pixels in memory.

    whole_way.py FOLDER COMPILER [FLAG...]     what is built lies in FOLDER
"""

import json
import struct
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
MODELS = ROOT / "examples/models"

folder = Path(sys.argv[1])
folder.mkdir(parents=True, exist_ok=True)
program, result = folder / "whole_way", folder / "whole_way.glb"
source = Path(__file__).with_suffix(".cpp")
subprocess.run([*sys.argv[2:], "-std=c++20", "-O1", "-Wall", "-Wextra", "-Werror", f"-I{ROOT / 'single_include'}", source, "-o", program],
               check=True)
subprocess.run([program, MODELS / "tiefenrausch_small.safetensors", MODELS / "farbrausch.safetensors", result], check=True)

file = result.read_bytes()
magic, version, length, json_length, json_type = struct.unpack("<4sIII4s", file[:20])
scene = json.loads(file[20:20 + json_length])
if (magic, version, length, json_type) != (b"glTF", 2, len(file), b"JSON") or scene["images"][0]["mimeType"] != "image/png":
    sys.exit("this is no GLB file with a PNG texture")
texture = scene["bufferViews"][scene["images"][0]["bufferView"]]
begin = 20 + json_length + 8 + texture["byteOffset"]
if file[begin:begin + 8] != b"\x89PNG\r\n\x1a\n":
    sys.exit("the texture is not where the file says")
print(f"{len(file)} bytes, {scene['accessors'][2]['count'] // 3} triangles")
