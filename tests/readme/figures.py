#!/usr/bin/env python3
"""Compares files, options, defaults, sizes and numbers on the pages with the project.

    figures.py PHOTO3D      the built program; without it, options and sizes of its output are not compared
"""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
program = sys.argv[1] if len(sys.argv) > 1 else None
faults, checked = [], 0


def check(good, fault):
    global checked
    checked += 1
    if not good:
        faults.append(fault)


def read(path):
    return (ROOT / path).read_text(encoding="utf-8")


def found(pattern, text, what, page="README.md"):
    """Returns the groups of a pattern's first match in a page. Records a fault if there is none."""
    match = re.search(pattern, re.sub(r"\s+", " ", text))
    check(match, f"{page}: no {what} as in '{pattern}'")
    return match.groups() if match else None


def near(said, computed, share):
    return abs(said - computed) <= share * computed


def numbers(text):
    return [float(number.replace(",", "")) for number in re.findall(r"\d[\d,]*(?:\.\d+)?", text)]


tracked = subprocess.run(["git", "-C", ROOT, "ls-files", "*.md"], capture_output=True, text=True)
pages = tracked.stdout.split() or [str(p.relative_to(ROOT)) for p in ROOT.rglob("*.md") if "node_modules" not in p.parts and "build" not in p.parts]
readme = read("README.md")
PROGRAM_PAGE = "examples/photo3d/README.md"  # lists the program's options
program_page = read(PROGRAM_PAGE)

# Every linked file, and every path in code that begins with one of our folders, exists.
FOLDERS = r"(?:bench|cmake|examples|include|packaging|scripts|single_include|tests)/"
for page in pages:
    text, folder = read(page), (ROOT / page).parent
    for target in re.findall(r"\]\((?!https?:|#|mailto:)([^)#\s]+)", text):
        check((folder / target).exists(), f"{page}: no {target}")
    for path in re.findall(rf"(?<![\w./]){FOLDERS}[\w./*-]*[\w*/]", text):
        places = (ROOT, folder, ROOT / "include" / "ldi", ROOT / "bench" if page.startswith("bench") else ROOT)
        check(any(any(place.glob(path.rstrip("/"))) for place in places), f"{page}: no {path}")

# The library defines every name that the pages use.
headers = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "include").rglob("*.hpp"))
for name in set(re.findall(r"\bldi::(\w+)(?!\w|::)", readme)) - {"ldi", "io"}:
    check(re.search(rf"\b{name}\b", headers), f"README.md: no ldi::{name}")

# Libraries that ldi::io needs.
cmake = read("cmake/library.cmake") + read("cmake/FindLdiReaders.cmake")
for libraries in found(r"writes files. It requires ([^;]*); ([^;]*) add formats", readme, "what ldi::io needs") or ():
    for library in re.split(", | and ", libraries):
        check(re.search(rf"\b{library}\b", cmake), f"README.md: ldi::io does not use {library}")
for target in re.findall(r"(\w+)::\w+=lib", cmake):
    check(target.lower().replace("png", "libpng") in readme, f"README.md: ldi::io also needs {target}")

# Sizes of the shipped files.
weights = {path.name: path.stat().st_size for path in (ROOT / "examples/models").glob("*.safetensors")}
both = found(r"networks of our own, ([\d.]+) MB together", readme, "size of the networks")
if both:
    check(near(float(both[0]), sum(weights.values()) / 1e6, 0.02), f"README.md: the networks have {sum(weights.values())} bytes, not {both[0]} MB")
one = found(r"our depth network, ([\d.]+) MB", readme, "size of the depth network")
if one:
    check(near(float(one[0]), weights["tiefenrausch_small.safetensors"] / 1e6, 0.02), f"README.md: the depth network does not have {one[0]} MB")
words = ["Nine", "Ten", "Eleven", "Twelve", "Thirteen"]
lessons = len(list((ROOT / "examples/learn").glob("[0-9]*.cpp")))
for page in ("README.md", "examples/learn/README.md"):
    count = re.search(rf"\b({'|'.join(words)}) lessons", read(page))
    check(count and words.index(count[1]) + 9 == lessons, f"{page}: there are {lessons} lessons")

# The paper's numbers, and the exceptions that the README names.
check(re.search(r"50 pixels", readme), "README.md does not say that surfaces do not grow by the paper's 50 pixels")


def options_of(page):
    """Returns the options of photo3d on a page, without those on lines and in sentences about other programs."""
    others = r"cmake|pkg-config|git |tests/\S*run\.sh|sbatch|pip|apt-get|photo3d_|npm|--bench|bench/|conan|vcpkg|g\+\+|train\.py|start\.sh|venv|ctest|style\.css"
    kept = [line for line in read(page).split("\n") if not re.search(others, line)]
    return set(re.findall(r"(?<![\w-])--[a-z][a-z0-9-]+", "\n".join(kept)))


if program:
    help_text = subprocess.run([program, "--help"], capture_output=True, text=True, check=True).stdout
    known = set(re.findall(r"--[a-z][a-z0-9-]+", help_text))
    for page in ("README.md", "examples/photo3d/README.md", "examples/viewer/README.md"):
        for option in sorted(options_of(page) - known):
            check(False, f"{page}: photo3d has no {option}")
        checked += len(options_of(page))

    # The help has a paragraph per option: "  --NAME VALUE  description (...; default: ...; ...)".
    paragraphs = re.findall(r"^  (?:-\w, )?--([a-z0-9-]+)(?: (\S+))?((?:.*\n)(?: {10}.*\n)*)", help_text, re.MULTILINE)
    defaults = {name: match[1] for name, _, text in paragraphs if (match := re.search(r"(?:\(|;\s)default:\s([^;)]*)[;)]", re.sub(r"\s+", " ", text)))}
    for option in ("texture", "grain", "motion"):
        said = found(rf"`--{option} ([\d.]+)`", program_page, f"default of --{option}", PROGRAM_PAGE)
        if said:
            check(defaults.get(option) == said[0], f"{PROGRAM_PAGE}: --{option} is {defaults.get(option)}, not {said[0]}")
    size = re.search(r"the default is (\d+)", program_page)
    check(size and defaults.get("size") == size[1], f"examples/photo3d/README.md: --size is {defaults.get('size')}")
    for option, values in ((name, value) for name, value, _ in paragraphs if "|" in value):
        for page, text in (("README.md", readme), (PROGRAM_PAGE, program_page)):
            for value in re.findall(rf"(?<!cmake )(?<!build )`?--{option} ([a-z0-9-]+)", text):
                check(value in values.split("|"), f"{page}: --{option} has no {value}")
    for path in re.findall(r"`([\w-]+)`", (found(r"`--path` is ((?:`[\w-]+`, )+)", program_page, "values of --path", PROGRAM_PAGE) or [""])[0]):
        check(path in help_text, f"{PROGRAM_PAGE}: --path has no {path}")

    # The sample, with its depth map.
    said = found(r"GLB of the sample is (\d+) kB with ([\d,]+) triangles, (\d+) kB with `--compress`", readme, "size of a GLB")
    if said:
        with tempfile.TemporaryDirectory() as folder:
            glb, report = Path(folder, "a.glb"), Path(folder, "a.json")
            sizes = []
            for more in ([], ["--compress"]):
                subprocess.run([program, ROOT / "examples/photo3d/sample.jpg", "-o", glb, "--report", report, "--quiet", *more], check=True)
                sizes.append(glb.stat().st_size / 1000)
            triangles = json.loads(report.read_text())["triangles"]
        computed = (sizes[0], triangles, sizes[1])
        for figure, value in zip(numbers(" ".join(said)), computed):
            check(near(figure, value, 0.1), f"README.md: the sample makes {value:.0f}, not {figure:.0f} (GLB in kB, triangles, kB compressed: {computed})")

if faults:
    sys.exit("\n".join(faults))
print(f"{checked} statements hold")
