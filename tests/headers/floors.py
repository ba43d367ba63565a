#!/usr/bin/env python3
"""A folder of include/ldi includes only from the folders before it in FLOORS, and version.hpp. It never includes another folder's
detail/. Examples and benchmarks use no detail/ at all, except those in KNOW_PARTS."""

import re
import sys
from pathlib import Path

FLOORS = ["base", "core", "kernels", "nn", "networks", "depth", "occlusion", "inpaint", "charts", "texture", "mesh", "render", "photo3d",
          "adapt", "formats", "io"]
FOR_ALL = {"version.hpp"}
# Measure parts of a stage, or decode files in memory in a browser.
KNOW_PARTS = {"bench/kernels", "bench/networks", "bench/quality/beside_silhouettes.hpp", "bench/support", "examples/web"}

root = Path(__file__).resolve().parent.parent.parent
include = root / "include" / "ldi"
broken = []
for header in sorted(include.glob("*/**/*.hpp")):
    name = header.relative_to(include)
    for included in re.findall(r"^\s*#\s*include\s*<ldi/([^>]+)>", header.read_text(encoding="utf-8"), re.MULTILINE):
        folder = included.split("/")[0]
        if included not in FOR_ALL and (folder not in FLOORS or FLOORS.index(folder) > FLOORS.index(name.parts[0])):
            broken.append(f"{name} includes <ldi/{included}>, which lies below it")
        elif "/detail/" in included and folder != name.parts[0]:
            broken.append(f"{name} includes <ldi/{included}>, which is {folder}'s own")
for source in sorted(p for folder in ("examples", "bench") for p in (root / folder).rglob("*.[ch]pp")):
    name = source.relative_to(root).as_posix()
    if "node_modules" in source.parts or any(name == known or name.startswith(known + "/") for known in KNOW_PARTS):
        continue
    for number, line in enumerate(source.read_text(encoding="utf-8").splitlines(), 1):
        if re.search(r"\bldi::detail\b|<ldi/\S*/detail/", line):
            broken.append(f"{name}:{number} uses ldi's detail")
if broken:
    sys.exit("\n".join(broken))
