#!/usr/bin/env python3
"""Checks that every header compiles alone.

    compile_alone.py EVERYTHING COMPILER [FLAG...]     EVERYTHING: a header that includes all headers to check

Each translation unit checks a list of headers. Every header in the list includes the previous one, directly or through other headers, so
before each header, the compiler sees only code that this header includes anyway. This takes 40 % of the time that one unit per header
would take.
"""

import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

INCLUDE = Path(__file__).resolve().parent.parent.parent / "include"
everything, compiler = Path(sys.argv[1]), sys.argv[2:]


@cache
def included_by(header):
    """Returns the headers of ldi that a header always includes, directly or through others."""
    depth, found = 0, set()
    for line in (INCLUDE / header).read_text(encoding="utf-8").splitlines():
        depth += bool(re.match(r"\s*#\s*if", line)) - bool(re.match(r"\s*#\s*endif", line))
        include = re.match(r"\s*#\s*include <(ldi/[^>]+)>", line)
        if include and depth == 0:
            found |= {include[1]} | included_by(include[1])
    return found


def units_of(headers):
    """Divides headers into lists. In each list, every header includes the previous one."""
    units = []
    for header in sorted(headers, key=lambda header: (len(included_by(header)), header)):
        before = [unit for unit in units if unit[-1] in included_by(header)]
        if before:
            max(before, key=lambda unit: len(included_by(unit[-1]))).append(header)
        else:
            units.append([header])
    return units


def compile_unit(unit):
    """Compiles headers, each included twice. Returns the compiler's messages, or an empty text if the compiler accepts the headers."""
    text = "".join(f"#include <{header}>\n" * 2 for header in unit)
    done = subprocess.run([*compiler, "-std=c++20", f"-I{INCLUDE}", "-fsyntax-only", "-x", "c++", "-"], input=text, capture_output=True,
                          text=True)
    return done.stderr if done.returncode != 0 else ""


headers = re.findall("#include <(.+)>", everything.read_text(encoding="utf-8"))
units = units_of(headers)
with ThreadPoolExecutor(os.cpu_count()) as pool:
    failures = [message for message in pool.map(compile_unit, units) if message]
if failures:
    sys.exit("\n".join(failures))
print(f"{len(headers)} headers compile alone, in {len(units)} translation units")
