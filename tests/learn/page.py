#!/usr/bin/env python3
"""Checks that every excerpt on the page of the lessons occurs line by line in its lesson, that the page links every lesson, that lessons
are short, and that pictures exist and are small. Checks that lessons print the output that the page shows, with numbers within 5 % (after "at most": 10 %), and
draw the page's pictures.

    page.py [FOLDER]      FOLDER: built lessons
"""

import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    from PIL import Image, ImageChops, ImageStat
except ImportError:
    Image = None

FOLDER = Path(__file__).resolve().parent.parent.parent / "examples" / "learn"
LONGEST_LESSON, LARGEST_PICTURES, LEAST_PSNR = 59, 600_000, 28

page = (FOLDER / "README.md").read_text(encoding="utf-8")
lessons = {path.name: path.read_text(encoding="utf-8") for path in sorted(FOLDER.glob("[0-9]*.cpp"))}
faults = []


def stripped(text):
    return [line.strip() for line in text.splitlines() if line.strip()]


for section in re.split(r"^## ", page, flags=re.MULTILINE)[1:]:
    linked = re.findall(r"\]\((\d\d_\w+\.cpp)\)", section)
    for name in linked:
        if name not in lessons:
            faults.append(f"the page links {name}, which does not exist")
    excerpts = re.findall(r"^```cpp\n(.*?)^```", section, flags=re.MULTILINE | re.DOTALL)
    for excerpt in excerpts:
        lines = stripped(excerpt)
        files = [stripped(lessons[name]) for name in linked if name in lessons]
        if not any(file[i:i + len(lines)] == lines for file in files for i in range(len(file))):
            faults.append(f"the page has an excerpt that is not in {' or '.join(linked)}:\n{excerpt}")


def run_lesson(name, folder):
    """Runs a built lesson in a folder, and returns its output, or None if it is not built."""
    built = Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve() / f"learn_{name}"
    if not built.exists():
        print(f"skipped: the output of {name}, which is not built")
        return None
    return subprocess.run([built], capture_output=True, text=True, check=True, cwd=folder).stdout


def psnr(shown, drawn):
    """Returns the PSNR in dB between a page's picture, which may be upsampled by a whole factor, and the lesson's picture."""
    with Image.open(shown) as a, Image.open(drawn) as b:
        a, b = a.convert("RGB"), b.convert("RGB").resize(a.size, Image.NEAREST)
        error = sum(ImageStat.Stat(ImageChops.difference(a, b)).sum2) / (3 * a.width * a.height)
        return 10 * math.log10(255 ** 2 / max(error, 1e-9))


def differences(said, printed):
    """Returns whether outputs differ. Numbers may differ by 5 %, because rounding depends on the processor and the compiler. Numbers after "at
    most" may differ by 10 %, because peak memory depends on the timing of threads."""
    number = r"(at most )?(\d+(?:\.\d+)?)"
    if re.sub(r"\s+", " ", re.sub(number, "0", said)) != re.sub(r"\s+", " ", re.sub(number, "0", printed)):
        return True
    return any(abs(float(a) - float(b)) > (0.1 if limit else 0.05) * float(b)
               for (limit, a), (_, b) in zip(re.findall(number, said), re.findall(number, printed)))


for section in re.split(r"^## ", page, flags=re.MULTILINE)[1:]:
    for said in re.findall(r"^```text\n(.*?)^```", section, flags=re.MULTILINE | re.DOTALL):
        lesson = re.search(r"\]\((\d\d_\w+)\.cpp\)", section)[1]
        with tempfile.TemporaryDirectory() as folder:
            printed = run_lesson(lesson, folder)
        if printed is not None and differences(said.strip(), printed.strip()):
            faults.append(f"{lesson} prints\n{printed}and the page says\n{said}")

for name, text in lessons.items():
    if f"]({name})" not in page:
        faults.append(f"{name} is not on the page")
    if text.count("\n") > LONGEST_LESSON:
        faults.append(f"{name} has {text.count(chr(10))} lines, more than {LONGEST_LESSON}")

pictures = set(re.findall(r"\]\((pictures/[\w.]+)\)", page))
kept = {f"pictures/{path.name}": path.stat().st_size for path in (FOLDER / "pictures").iterdir()}
if pictures != set(kept):
    faults.append(f"pictures on the page and in the folder differ: {sorted(pictures ^ set(kept))}")
if not Image:
    print("skipped: the lessons' pictures, without Pillow")
for name in sorted(kept) if Image else []:
    with tempfile.TemporaryDirectory() as folder:
        if run_lesson(Path(name).stem, folder) is not None:
            similarity = psnr(FOLDER / name, Path(folder) / f"{Path(name).stem}.png")
            if similarity < LEAST_PSNR:
                faults.append(f"{name} has a PSNR of {similarity:.1f} dB to the picture that its lesson draws, less than {LEAST_PSNR}")
if sum(kept.values()) > LARGEST_PICTURES:
    faults.append(f"pictures have {sum(kept.values())} bytes, more than {LARGEST_PICTURES}")

if faults:
    sys.exit("\n".join(faults))
print(f"{len(lessons)} lessons, {len(kept)} pictures of {sum(kept.values())} bytes")
