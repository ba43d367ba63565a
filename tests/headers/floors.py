#!/usr/bin/env python3
"""Checks that each folder of include/ldi includes only itself, the folders that FLOORS permits, and version.hpp, and never another
folder's detail/. Checks headers outside of folders, such as photo3d.hpp, in the same way. Examples and benchmarks include no detail/,
except those in KNOW_PARTS."""

import re
import sys
from pathlib import Path

# Maps each folder, and some headers, to the folders that they may include. Users of the geometry compile no network.
FLOORS = {
    "base": "",
    "core": "base",
    "kernels": "base core",
    "nn": "base core kernels",
    "networks": "base core kernels nn",
    "depth": "base core",
    "occlusion": "base core",
    "inpaint": "base core",
    "charts": "base core",
    "texture": "base core charts",
    "mesh": "base core charts texture",
    "render": "base core mesh",
    "photo3d": "base core kernels depth occlusion inpaint charts texture mesh",
    "adapt": "base core mesh render",
    "formats": "base core mesh",
    # These decode networks from their files.
    "formats/farbrausch.hpp": "base kernels networks",
    "formats/silhouettes.hpp": "base kernels networks",
    "formats/tiefenrausch.hpp": "base kernels nn networks",
    "io": "base core nn networks formats",
    # The stages of a 3D photo compile without networks and files.
    "photo3d.hpp": "base core depth occlusion inpaint charts texture mesh photo3d",
    "version.hpp": "",
}
FLOORS["ldi.hpp"] = " ".join(FLOORS)  # everything except detail/
FOR_ALL = {"version.hpp"}
# Folders and files that may include detail/: they measure parts of a stage, draw with parts of the rasterizer, or decode files in
# memory in a browser.
KNOW_PARTS = {"bench/kernels", "bench/networks", "bench/quality/beside_silhouettes.hpp", "bench/quality/micro_polygons.hpp",
              "bench/quality/peel.hpp", "bench/quality/pixel_squares.hpp", "bench/quality/surface_walk.hpp", "bench/support", "examples/web"}

root = Path(__file__).resolve().parent.parent.parent
include = root / "include" / "ldi"
broken = []
for header in sorted(include.rglob("*.hpp")):
    name = header.relative_to(include)
    row = FLOORS.get(name.as_posix(), FLOORS.get(name.parts[0]))
    if row is None:
        broken.append(f"{name} has no row in FLOORS")
        continue
    floors = row.split()
    for included in re.findall(r"^\s*#\s*include\s*<ldi/([^>]+)>", header.read_text(encoding="utf-8"), re.MULTILINE):
        folder = included.split("/")[0]
        if included not in FOR_ALL and folder != name.parts[0] and folder not in floors:
            broken.append(f"{name} includes <ldi/{included}>, which FLOORS does not permit")
        elif "/detail/" in included and folder != name.parts[0]:
            broken.append(f"{name} includes <ldi/{included}>, which only {folder} may include")
for source in sorted(p for folder in ("examples", "bench") for p in (root / folder).rglob("*.[ch]pp")):
    name = source.relative_to(root).as_posix()
    if "node_modules" in source.parts or any(name == known or name.startswith(known + "/") for known in KNOW_PARTS):
        continue
    for number, line in enumerate(source.read_text(encoding="utf-8").splitlines(), 1):
        if re.search(r"\bldi::detail\b|<ldi/\S*/detail/", line):
            broken.append(f"{name}:{number} uses a detail of ldi")
if broken:
    sys.exit("\n".join(broken))
