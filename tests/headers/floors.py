#!/usr/bin/env python3
"""Checks that each folder of include/ldi includes only itself, the folders that FLOORS permits, and version.hpp. It must not include
another folder's detail/ or use names of another folder's namespace detail, except those in SHARED. Checks headers outside of folders, such
as photo3d.hpp, in the same way. Examples and benchmarks include no detail/, except those in KNOW_PARTS."""

import re
import sys
from pathlib import Path

# Maps each folder, and some headers, to the folders that they may include. Programs that use only the geometry compile no network.
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
FLOORS["ldi.hpp"] = " ".join(FLOORS.keys() - {"io", "adapt"})  # everything that needs only the standard library
FOR_ALL = {"version.hpp"}
# Folders and files that may include detail/: they measure parts of a stage, draw with parts of the rasterizer, or decode files in
# memory in a browser.
KNOW_PARTS = {"bench/kernels", "bench/networks", "bench/quality/beside_silhouettes.hpp", "bench/quality/micro_polygons.hpp",
              "bench/quality/peel.hpp", "bench/quality/pixel_squares.hpp", "bench/quality/surface_walk.hpp", "bench/support", "examples/web"}
# Folders, and names of namespace detail, that other folders may use, with the reason.
SHARED = {
    "base": "helpers for numbers and messages, which are too small for a user's notice",
    "formats to io": "formats recognizes files and reads their headers; io decodes the same files with libraries",
    "curves": "depth and occlusion each have a namespace detail::curves of their own",
    "unchecked": "skips the validation of a graph that a stage of ldi has just built; users must not skip it",
    "expansion_access": "only expand() may turn a single layer into a layered image",
}

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
    if re.search(r'^\s*#\s*include\s*("|<[^>]*[.][.])', header.read_text(encoding="utf-8"), re.MULTILINE):
        broken.append(f"{name} includes a header by a relative path")
    for included in re.findall(r"^\s*#\s*include\s*<ldi/([^>]+)>", header.read_text(encoding="utf-8"), re.MULTILINE):
        folder = included.split("/")[0]
        if included not in FOR_ALL and folder != name.parts[0] and folder not in floors:
            broken.append(f"{name} includes <ldi/{included}>, which FLOORS does not permit")
        elif "/detail/" in included and folder != name.parts[0]:
            broken.append(f"{name} includes <ldi/{included}>, which only {folder} may include")


def code_of(header):
    """Returns a header without comments and string literals."""
    return re.sub(r'"(\\.|[^"\\\n])*"|//[^\n]*', '""', header.read_text(encoding="utf-8"))


def details_of(code):
    """Yields the contents of each namespace detail."""
    for found in re.finditer(r"namespace detail(?:::\w+)* \{", code):
        depth, end = 1, found.end()
        while depth > 0:
            depth += {"{": 1, "}": -1}.get(code[end], 0)
            end += 1
        yield code[found.end() : end - 1]


def names_in(detail):
    """Returns the types, functions and constants that a namespace declares."""
    while re.search(r"\{[^{}]*\}", detail):
        detail = re.sub(r"\{[^{}]*\}", ";", detail)
    detail = re.sub(r"template\s*<[^;]*?>\s*(?=\w+[ \n])", "", detail)
    names = re.findall(r"\b(?:struct|class|concept|using|namespace)\s+(\w+)", detail)
    names += re.findall(r"^(?:\[\[\w+\]\] )?(?!return|else|static_assert)[\w:][\w:<>*&, ]*? [*&]?(\w+)(?:\(|\[| =)", detail, re.MULTILINE)
    return set(names)


def uses(code, name):
    """Whether code uses a name of namespace detail. A single word without "detail::" does not count: it may name a variable."""
    if re.search(rf"\bdetail::{name}\b", code):
        return True
    is_variable = re.search(rf"\b(?!return\b)[\w>]+[&*]* [&*]?{name}\b\W|[&*] {name}\b", code)
    return "_" in name and not is_variable and any(re.search(rf"(?<!\.)(?<!->)(?<!::)\b{name}\b", d) for d in details_of(code))


codes = {header.relative_to(include): code_of(header) for header in sorted(include.rglob("*.hpp"))}
owners = {}
for header, code in codes.items():
    for detail in details_of(code):
        for name in names_in(detail):
            owners.setdefault(name, set()).add(header.parts[0])
for header, code in codes.items():
    user = header.parts[0]
    for name in sorted(set(re.findall(r"\w+", code)) & owners.keys() - SHARED.keys()):
        exempt = {user, *(owner for owner in owners[name] if owner in SHARED or f"{owner} to {user}" in SHARED)}
        if not exempt & owners[name] and uses(code, name):
            broken.append(f"{header} uses detail::{name}, which belongs to {' and '.join(sorted(owners[name]))}")
for source in sorted(p for folder in ("examples", "bench") for p in (root / folder).rglob("*.[ch]pp")):
    name = source.relative_to(root).as_posix()
    if "node_modules" in source.parts or any(name == known or name.startswith(known + "/") for known in KNOW_PARTS):
        continue
    for number, line in enumerate(source.read_text(encoding="utf-8").splitlines(), 1):
        if re.search(r"\bldi::detail\b|<ldi/\S*/detail/", line):
            broken.append(f"{name}:{number} uses a detail of ldi")
if broken:
    sys.exit("\n".join(broken))
