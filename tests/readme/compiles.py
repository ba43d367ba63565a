#!/usr/bin/env python3
"""The C++ lines of README.md compile as they stand.

    compiles.py COMPILER [FLAG...]
"""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent

includes, statements, inside = [], [], False
for line in (ROOT / "README.md").read_text(encoding="utf-8").splitlines():
    if line.startswith("## "):
        inside = line == "## Use it from C++"
    elif inside and line.startswith("    ") and not line.startswith("    find_package") and not line.startswith("    target_"):
        (includes if line.strip().startswith("#include") else statements).append(line)
statements = [line for line in statements if not line.strip().startswith("# ")]
if len(includes) < 3 or len(statements) < 6:
    sys.exit("README.md has no C++ lines under '## Use it from C++' any more")

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
