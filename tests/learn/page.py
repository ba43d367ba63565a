#!/usr/bin/env python3
"""The page of the lessons shows what is in their files: every excerpt occurs there line by line, every lesson is on it and short, and
its pictures are there and small."""

import re
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent.parent / "examples" / "learn"
LONGEST_LESSON, LARGEST_PICTURES = 59, 600_000

page = (FOLDER / "README.md").read_text(encoding="utf-8")
lessons = {path.name: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("[0-9]*.cpp"))}
faults = []


def stripped(text):
    return [line.strip() for line in text.splitlines() if line.strip()]


for section in re.split(r"^## ", page, flags=re.MULTILINE)[1:]:
    linked = re.findall(r"\]\((\d\d_\w+\.cpp)\)", section)
    for name in linked:
        if name not in lessons:
            faults.append(f"no lesson {name}")
    excerpts = re.findall(r"^```cpp\n(.*?)^```", section, flags=re.MULTILINE | re.DOTALL)
    for excerpt in excerpts:
        lines = stripped(excerpt)
        files = [stripped(lessons[name]) for name in linked if name in lessons]
        if not any(file[i:i + len(lines)] == lines for file in files for i in range(len(file))):
            faults.append(f"not in {' or '.join(linked)}:\n{excerpt}")

for name, text in lessons.items():
    if f"]({name})" not in page:
        faults.append(f"{name} is not on the page")
    if text.count("\n") > LONGEST_LESSON:
        faults.append(f"{name} has {text.count(chr(10))} lines, more than {LONGEST_LESSON}")

pictures = set(re.findall(r"\]\((pictures/[\w.]+)\)", page))
kept = {f"pictures/{path.name}": path.stat().st_size for path in (FOLDER / "pictures").iterdir()}
if pictures != set(kept):
    faults.append(f"pictures on the page and in the folder differ: {sorted(pictures ^ set(kept))}")
if sum(kept.values()) > LARGEST_PICTURES:
    faults.append(f"pictures have {sum(kept.values())} bytes, more than {LARGEST_PICTURES}")

if faults:
    sys.exit("\n".join(faults))
print(f"{len(lessons)} lessons, {len(kept)} pictures of {sum(kept.values())} bytes")
