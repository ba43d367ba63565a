#!/usr/bin/env python3
"""The C++ lines of README.md compile as they stand.

    compiles.py COMPILER [FLAG...]
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent

page = (ROOT / "README.md").read_text(encoding="utf-8")
lines = [line for block in re.findall(r"^```cpp\n(.*?)^```", page, re.MULTILINE | re.DOTALL) for line in block.splitlines() if line]
includes = [line for line in lines if line.startswith("#include")]
statements = [line for line in lines if not line.startswith("#include")]
if len(includes) < 3 or len(statements) < 6:
    sys.exit("README.md has no C++ lines any more")

program = "\n".join([
    *includes, "#include <span>",
    "struct normal { using scalar = float; static constexpr std::size_t channels = 3; };",
    "void readme(ldi::image_view<const std::uint8_t> photo, ldi::image<float> map, ldi::image_view<const float> disparity,",
    "            std::span<const float> normals) {", *statements, "(void)result, (void)layer;", "}", ""])
flags = ["-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror", f"-I{ROOT / 'include'}", "-x", "c++", "-"]
result = subprocess.run([*sys.argv[1:], *flags], input=program, capture_output=True, text=True)
if result.returncode != 0:
    sys.exit(result.stderr + "\n" + program)
print(f"{len(includes)} includes and {len(statements)} lines compile")
