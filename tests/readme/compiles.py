#!/usr/bin/env python3
"""Compiles the C++ of README.md: the first block is a program, which must write a GLB; the other blocks are lines of one function.

    compiles.py COMPILER [FLAG...]
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent

page = (ROOT / "README.md").read_text(encoding="utf-8")
first, *blocks = re.findall(r"^```cpp\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
if len(first.splitlines()) > 15:
    sys.exit("README.md: expected a first program of at most 15 lines, found a longer one")
with tempfile.TemporaryDirectory() as folder:
    (Path(folder) / "square.cpp").write_text(first, encoding="utf-8")
    subprocess.run([*sys.argv[1:], "-std=c++20", "-Wall", "-Wextra", "-Werror", f"-I{ROOT / 'single_include'}", "square.cpp", "-o", "square"],
                   cwd=folder, check=True)
    subprocess.run(["./square"], cwd=folder, check=True)
    if (Path(folder) / "square.glb").read_bytes()[:4] != b"glTF":
        sys.exit("README.md: expected a first program that writes a GLB file, found none written")

lines = [line for block in blocks for line in block.splitlines() if line]
includes = [line for line in lines if line.startswith("#include")]
tags = [line for line in lines if line.startswith("struct")]
statements = [line for line in lines if not line.startswith(("#include", "struct"))]
if len(includes) < 2 or len(statements) < 6:
    sys.exit("README.md: expected more blocks of C++, found none")

program = "\n".join([
    *includes, "#include <span>",
    *tags,
    "struct cv_mat { const std::uint8_t* data; int rows, cols; std::size_t step; };  // members of OpenCV's cv::Mat",
    "void readme(const cv_mat& mat, ldi::image<float> map, ldi::image_view<const float> disparity,",
    "            ldi::image_view<const float> normals) {", *statements, "(void)result, (void)made, (void)options, (void)disparity;", "}", ""])
flags = ["-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", f"-I{ROOT / 'include'}", "-x", "c++", "-"]
result = subprocess.run([*sys.argv[1:], *flags], input=program, capture_output=True, text=True)
if result.returncode != 0:
    sys.exit(result.stderr + "\n" + program)
print(f"{len(includes)} includes and {len(statements)} lines compile")
