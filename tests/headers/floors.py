#!/usr/bin/env python3
"""A folder of include/ldi includes only from those above it in this list, and of the headers beside the folders only the two that
everybody may know. It includes nobody else's detail/."""

import re
import sys
from pathlib import Path

FLOORS = ["base", "core", "kernels", "nn", "networks", "depth", "occlusion", "inpaint", "charts", "texture", "mesh", "render", "photo3d", "adapt", "formats",
          "io"]
FOR_ALL = {"version.hpp"}

include = Path(__file__).resolve().parent.parent.parent / "include" / "ldi"
broken = []
for header in sorted(include.glob("*/**/*.hpp")):
    name = header.relative_to(include)
    for included in re.findall(r"^\s*#\s*include\s*<ldi/([^>]+)>", header.read_text(encoding="utf-8"), re.MULTILINE):
        folder = included.split("/")[0]
        if included not in FOR_ALL and (folder not in FLOORS or FLOORS.index(folder) > FLOORS.index(name.parts[0])):
            broken.append(f"{name} includes <ldi/{included}>, which lies below it")
        elif "/detail/" in included and folder != name.parts[0]:
            broken.append(f"{name} includes <ldi/{included}>, which is {folder}'s own")
if broken:
    sys.exit("\n".join(broken))
