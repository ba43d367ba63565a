#!/usr/bin/env python3
"""Compares files, options, defaults, sizes and numbers in the Markdown pages with the project. Checks that pages which state the same number
agree.

    figures.py PHOTO3D      the built program; without it, options and sizes of its output are not compared
"""

import json
import re
import subprocess
import sys
import tempfile
from decimal import Decimal
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
        check(any(any(place.glob(path.rstrip("/"))) for place in places), f"{page}: expected an existing file or folder, found no {path}")

# Every ldi:: name in README.md occurs in a header.
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
    check(near(float(both[0]), sum(weights.values()) / 1e6, 0.02), f"README.md: expected {sum(weights.values())} bytes as the size of the networks, found {both[0]} MB")
one = found(r"our depth network, ([\d.]+) MB", readme, "size of the depth network")
if one:
    check(near(float(one[0]), weights["tiefenrausch_small.safetensors"] / 1e6, 0.02), f"README.md: expected {weights['tiefenrausch_small.safetensors']} bytes as the size of the depth network, found {one[0]} MB")
words = ["Nine", "Ten", "Eleven", "Twelve", "Thirteen"]
lessons = len(list((ROOT / "examples/learn").glob("[0-9]*.cpp")))
for page in ("README.md", "examples/learn/README.md"):
    count = re.search(rf"\b({'|'.join(words)}) lessons", read(page))
    check(count and words.index(count[1]) + 9 == lessons, f"{page}: there are {lessons} lessons")

# Pages that state the same measurement must agree. Each entry lists pages, and a pattern that finds the numbers on the page. Every number must
# equal that of the first page, rounded to the same digits. A page may state only the first of these numbers. A third item is the factor from
# the page's unit to that of the first page.
QUALITY, BENCH, PAPER, STAGES, SCALING = (f"bench/{folder}README.md" for folder in ("quality/", "", "paper/", "photo3d/", "scaling/"))
TRAINING, STUDENT, SILHOUETTES, FARBRAUSCH, SEARCH = (f"examples/training/{folder}README.md" for folder in ("", "tiefenrausch_small/", "silhouettes/", "farbrausch/", "search/"))
N = r"\**(\d[\d,]*(?:\.\d+)?)\**"  # a number, which may be bold
MEASUREMENTS = {
    "quality of our depth network": (
        (QUALITY, rf"tiefenrausch_small \| {N} \| {N} \| [\d.]+ \| {N} \|"),
        ("README.md", rf"our depth network, [\d.]+ MB \| {N} \| {N} \| {N} \|"),
        (STUDENT, rf"gives {N}, {N} and {N}, the figures on the front page"),
        (PAPER, rf"report {N} and {N} for the same weights")),
    "quality of the published depth network": (
        (QUALITY, rf"Tiefenrausch, published \| {N} \| {N} \| [\d.]+ \| {N} \|"),
        ("README.md", rf"the paper authors' \| {N} \| {N} \| {N} \|"),
        (PAPER, rf"by the recipe; {N}, {N} by bench/quality")),
    "quality of the published depth network by the recipe": (
        (STUDENT, rf"\| published \| {N} \| {N} \| [\d.]+ \| [\d.]+ \|"), (PAPER, rf"by bench/quality\) \| \| \| {N}, {N} \|")),
    "quality before quantization": ((STUDENT, rf"student, float \| {N} \| {N} \|"), (PAPER, rf"before quantization \|[^|]*\|[^|]*\| {N}, {N} \|")),
    "quality rounded to 8 bits": (
        (STUDENT, rf"student before training in 8 bits, rounded to 8 bits \| {N} \| {N} \|"),
        (PAPER, rf"rounded to 8 bits after training \|[^|]*\|[^|]*\| {N}, {N} \|")),
    "quality after training in 8 bits": ((STUDENT, rf"\| student \| {N} \| {N} \| [\d.]+ \| [\d.]+ \|"), (PAPER, rf"trained with quantization \|[^|]*\|[^|]*\| {N}, {N} \|")),
    "people and animals that are separate, published network": (
        (STUDENT, rf"In [\d.]+ % of {N} photographs of people and animals.*?published: {N} %\)"),
        ("README.md", rf"\| [\d.]+ % of {N} \| \| the paper authors'.*?\| {N} % \|")),
    "people and animals that are separate, our network": ((STUDENT, rf"At two sizes it is {N} %"), ("README.md", rf"\| {N} % of \d+ \|")),
    "time of the depth network": ((BENCH, rf"networks/tiefenrausch/disparity of a photo \| [^|]* \| {N} ms"), ("README.md", rf"depth network takes {N} ms on one core")),
    "time of the program": ((STAGES, rf"\| sample.jpg \|(?: [\d.]+ \|){{8}} {N} \|", "0.001"), ("README.md", rf"program takes {N} s on one core")),
    "lead of layers over screen space": (
        (QUALITY, rf"ldi over screen space \+{N} dB"), (QUALITY, rf"lead of \+{N} dB is the mean"),
        ("README.md", rf"on layers has a PSNR {N} dB higher"), (PAPER, rf"layers lead screen space by {N} dB there")),
    "lead of layers over screen space in the paper": ((QUALITY, rf"and the paper's data \+{N}"), (PAPER, rf"dB there, {N} dB in the paper")),
    "views in search of holes": (
        (QUALITY, rf"no hole in {N} views of the forty photographs"), (QUALITY, rf"draws each from {N} camera positions", "40"),
        ("README.md", rf"in 40 photographs, seen from {N} viewpoints each", "40"), (PAPER, rf"over the {N} views of", "40")),
    "photographs with measured depth": (
        (QUALITY, rf"on {N} photographs with measured depth"), ("README.md", rf"8 bits, {N} photographs with measured depth"), (PAPER, rf"tiefenrausch_small, {N} pairs"),
        (STUDENT, rf"\| {N} pairs outside the training"), (TRAINING, rf"`rgbd` \({N} photographs with measured depth\)"), ("bench/data.md", rf"`rgbd` \| {N} photographs with depth")),
    "size of our depth network": (
        (STUDENT, rf"\| student \| {N} M \| {N} G \|"), ("examples/models/README.md", rf"depth from one photo: {N} M weights of 8 bits, {N} G multiplications"),
        (PAPER, rf"tiefenrausch_small {N} M;")),
    "size of our depth network in the search": ((STUDENT, rf"\| student \| [\d.]+ M \| {N} G \|"), (SEARCH, rf"\| the student \|[^|]*\|[^|]*\|[^|]*\| {N} \|")),
    "multiplications of the published network": ((STUDENT, rf"\| published \| [\d.]+ M \| {N} G \|"), (SEARCH, rf"parameters, {N} GMAC at 384 x 288")),
    "file of our depth network": ((STUDENT, rf"\| student \| [\d.]+ M \| [\d.]+ G \| {N} MB"), ("README.md", rf"our depth network, {N} MB")),
    "size of the inpainting network": ((FARBRAUSCH, rf"{N} M parameters"), ("examples/models/README.md", rf"hidden surfaces: {N} M weights"), (PAPER, rf"in the paper, here {N} M and")),
    "training of the inpainting network": ((FARBRAUSCH, rf"was trained for {N} steps"), (QUALITY, rf"farbrausch.safetensors` \({N} steps")),
    "size of the silhouette network": (
        (SILHOUETTES, rf"network has {N} weights and computes {N} multiplications"), ("examples/models/README.md", rf"{N} weights as float16, for arithmetic of 8 bits; {N} multiplications")),
    "photographs for training": (("bench/data.md", rf"`photos/train` \| {N} photographs"), (TRAINING, rf"whose licenses allow it: {N} \(CC0")),
    "photographs without a license": (
        ("bench/data.md", rf"`photos/train_research` \| {N} photographs \| \[[^)]*\) \({N}\), \[[^)]*\) \({N}\), Urban100 \({N}\) and Sun & Hays 80 \({N}\)"),
        (TRAINING, rf"There are {N} more photographs without a license.*?BSDS500 \({N}\), stock photographs of offices \({N}\), Urban100 \({N}\) and Sun & Hays 80 \({N}\)")),
    "pictures with depth for training": (
        (STUDENT, rf"of {N} pictures \({N} measured or rendered; {N} by Depth Anything"), ("examples/models/README.md", rf"on {N} pictures with depth of their own \({N} measured or rendered, {N} by")),
    "quality of reprojected pairs": (
        (QUALITY, rf"stereo pairs: Farbrausch \| [^|]* \| {N} \|.*?stereo pairs: Farbrausch and texture \| [^|]* \|(?: [\d.]+ \|){{5}} {N} \|"),
        (FARBRAUSCH, rf"stereo pairs, reprojected; LPIPS where inpainted, with texture \| {N}; {N} \|")),
    "quality of reprojected scenes": (
        (QUALITY, rf"ray-cast scenes: Farbrausch \| [^|]* \| {N} \|.*?ray-cast scenes: Farbrausch and texture \| [^|]* \|(?: [\d.]+ \|){{5}} {N} \|"),
        (FARBRAUSCH, rf"ray-cast scenes, the same \| {N}; {N} \|")),
    "LPIPS of novel views of pairs": (
        (QUALITY, rf"stereo pairs, mean LPIPS \| \|(?: [\d.]+ / [\d.]+ \|){{2}} [\d.]+ / {N} \| [\d.]+ / {N} \|"),
        (FARBRAUSCH, rf"pairs, novel views, LPIPS where the photo did not see: network, with texture \| {N}, {N} \|")),
    "LPIPS of novel views of scenes": (
        (QUALITY, rf"ray-cast scenes, mean LPIPS \| \|(?: [\d.]+ / [\d.]+ \|){{2}} [\d.]+ / {N} \| [\d.]+ / {N} \|"), (FARBRAUSCH, rf"\| scenes, the same \| {N}, {N} \|")),
    "sizes of files": (
        (PROGRAM_PAGE, rf"the sample with its depth map, 1152 x 1536 \| {N} \| {N} \|"), ("examples/service/README.md", rf"GLB file, kB \| [\d.]+ \| {N} \(the sample\) \| {N} \|")),
    "hidden pixels of photographs": ((PROGRAM_PAGE, rf"\| {N} % in 100 photographs", "0.01"), ("SECURITY.md", rf"up to {N} hidden pixels per pixel")),
    "error of 8 bits": ((PROGRAM_PAGE, rf"a PSNR of {N} dB relative to"), ("examples/photo3d/options.hpp", rf"colors have a PSNR of {N} dB")),
    "motion of a cropped photo": (
        (PROGRAM_PAGE, rf"sideways by at most {N} % of the short side, which is {N} %"), ("examples/viewer/README.md", rf"they move by {N} % of the shorter side, or {N} % of the longer"),
        ("examples/photo3d/options.hpp", rf"of the view to {N} % of the short side")),
    "download of the page": (("examples/web/README.md", rf"page \d+ kB \| {N} MB \|"), ("README.md", rf"download is {N} MB")),
    "time of the paper's photos": ((PAPER, rf"\*\*total\*\* \| \d+ \| {N} \|", "0.001"), (PAPER, rf"`--preset paper` \| {N} s of processor time")),
}


def scaled(groups, factor):
    return [Decimal(group.replace(",", "")) * Decimal(factor) for group in groups]


def agree(a, b):
    """Whether two numbers are equal after rounding to the digits of the less precise number."""
    return abs(a - b) <= Decimal(10) ** max(a.as_tuple().exponent, b.as_tuple().exponent) / 2


for what, statements in MEASUREMENTS.items():
    stated = [(page, found(pattern, read(page), what, page), *factor) for page, pattern, *factor in statements]
    stated = [(page, scaled(groups, *(factor or ("1",)))) for page, groups, *factor in stated if groups]
    for page, figures in stated[1:]:
        for first, figure in zip(stated[0][1], figures):
            check(agree(first, figure), f"{page}: {what}: {figure}, but {first} in {stated[0][0]}")


def computed(what, page, pattern, values):
    """Compares the numbers of a statement with values computed from the figures of another page."""
    for said, value in zip(scaled(found(pattern, read(page), what, page) or (), "1"), values):
        check(agree(said, Decimal(f"{value:.6f}")), f"{page}: {what}: expected {value:.4f}, as in the tables, found {said}")


def column(page, row, index=0, scale=1.0):
    """Returns a column of all rows of a table that match."""
    cells = re.findall(row, read(page), re.MULTILINE)
    check(cells, f"{page}: expected table rows that match '{row}', found none")
    return [float(cell if isinstance(cell, str) else cell[index]) * scale for cell in cells] or [1.0]


estimates = column("README.md", r"takes ([\d.]+) ms with it and\s+([\d.]+) ms", 1)[0] / column("README.md", r"takes ([\d.]+) ms with it and\s+([\d.]+) ms", 0)[0]
computed("time of the published depth network, relative to ours", "README.md", rf"with the authors', {N} times as long", [estimates])
sizes = column(PAPER, r"^\| kodim\d+ \| (\d+) \| \d+ \| \d+ \| \d+ \| \d+ \|")
computed("sizes of the paper's photos", PAPER, rf"processor time, {N} to {N} kB", [min(sizes), max(sizes)])
noise = r"^\| (?:checkerboard|comb|noise), [^|]* \| \d+ \| [\d.]+ \| (\d+) \| (\d+) \|"
seconds, memory = column(STAGES, noise, 1), column(STAGES, noise, 0, 0.001)
computed("photos of noise", PAPER, rf"pixels of noise \| {N} to {N} s of processor time, {N} to {N} GB", [min(seconds), max(seconds), min(memory), max(memory)])
milliseconds = {name: float(time) for name, time in re.findall(r"^\| nn/convolve/(.*?) \|[^|]*\| ([\d.]+) ms", read(BENCH), re.MULTILINE)}
irregular = {name: float(share) / 100 for name, share in re.findall(r"^\| nn/convolve/(.*?) \|[^|]*?([\d.]+) % irregular", read(BENCH), re.MULTILINE)}


def ratio(name, size, kind):
    return milliseconds[f"{name} 3x3 {size}, {kind}"] / milliseconds[f"image 3x3 {size}, {kind}"]


def added(name, kind):
    """Returns the additional time of an irregular pixel, as a multiple of the time per pixel of an image."""
    more = irregular[f"{name} 3x3 16->16, {kind}"] - irregular[f"image 3x3 16->16, {kind}"]
    return (ratio(name, "16->16", kind) - 1) / more


computed("layered images beside images", SCALING, rf"the convolution takes {N} times as long as on an image with as many pixels in float32, {N} times in 8 bits, and {N} and {N} times with 32",
         [ratio("ldi", size, kind) for size in ("16->16", "32->32") for kind in ("float32", "int8")])
computed("irregular pixels", SCALING, rf"adds {N} pixels in squares of 24 \([\d.]+ %\), and {N} in squares of 4 \(100 %\). In 8 bits, it adds {N} and {N}\.",
         [added(name, kind) for kind in ("float32", "int8") for name in ("squares of 24", "squares of 4")])

# The paper's numbers, and the exceptions that the README names.
check(re.search(r"50 pixels", readme), "README.md: expected a statement that surfaces do not grow by the paper's 50 pixels, found none")


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
            check(False, f"{page}: expected options of photo3d, found {option}")
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
        check(path in help_text, f"{PROGRAM_PAGE}: expected values of --path, found {path}")

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
            check(near(figure, value, 0.1), f"README.md: the sample: expected {value:.0f}, found {figure:.0f} (GLB in kB, triangles, kB compressed: {computed})")

if faults:
    sys.exit("\n".join(faults))
print(f"{checked} statements hold")
