#!/usr/bin/env python3
"""Checks that include/ldi/kernels/README.md, the folders, the families' tables and isa.hpp agree on the kernels per instruction set."""

import re
import sys
from pathlib import Path

kernels = Path(__file__).resolve().parent.parent.parent / "include" / "ldi" / "kernels"
lines = (kernels / "README.md").read_text(encoding="utf-8").splitlines()
rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| ")]
(_, *names), rows = rows[0], rows[1:]

isa = (kernels / "isa.hpp").read_text(encoding="utf-8")
sets = re.findall(r'instruction_set\{\s*isa::(\w+),\s*"(\w+)",\s*\{[^}]*\},\s*isa::(\w+)\}', isa)
name_of = {identifier: name for identifier, name, _ in sets}
wrong = []
if names != [name for _, name, _ in sets]:
    wrong.append(f"the matrix has the instruction sets {names}, but isa.hpp has {[name for _, name, _ in sets]}")

families = {}
for first, *cells in rows:
    if first == "fallback":
        expected = ["" if identifier == "scalar" else name_of[otherwise] for identifier, _, otherwise in sets]
        if cells != expected:
            wrong.append(f"the matrix has the fallbacks {cells}, but isa.hpp has {expected}")
    else:
        families[re.match(r"`(\w+)`", first).group(1)] = {name for name, cell in zip(names, cells) if cell}

# Files whose names differ from LDI_ISA. x86.hpp contains two instruction sets.
FILES = {"avx2": {"avx2", "x86"}, "avxvnni": {"avx_vnni"}, "avx512vnni": {"avx512vnni", "x86"}}
for folder in sorted(path.name for path in kernels.iterdir() if path.is_dir() and path.name != "detail"):
    if folder not in families:
        wrong.append(f"{folder}/ is not in the matrix")
for family, claimed in families.items():
    files = {path.stem for path in (kernels / family).glob("*.hpp")}
    table = re.search(r"_kernels\[\] = \{(.*?)\n\};", (kernels / f"{family}.hpp").read_text(encoding="utf-8"), re.DOTALL).group(1)
    tabled = {name_of[identifier] for identifier in re.findall(r"\{isa::(\w+)", table)}
    for name in names:
        has_file = bool(FILES.get(name, {name}) & files)
        if len({name in claimed, name in tabled, has_file}) != 1:
            wrong.append(f"{family}, kernel for {name}: in the matrix {name in claimed}, in the table {name in tabled}, a file {has_file}")
if wrong:
    sys.exit("\n".join(wrong))
