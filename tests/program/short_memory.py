"""Runs the program with decreasing memory: it must end with a result or with exit code 75, never with a code for permanent failure.

    short_memory.py PHOTO3D SOURCE_DIR
"""
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile

from checks import check, finish
from files import is_whole_glb, png

PROGRAM, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
DONE, TRY_AGAIN = 0, 75
SAMPLE, MODELS = os.path.join(SOURCE, "examples/photo3d/sample.jpg"), os.path.join(SOURCE, "examples/models")


def run(folder, megabytes, *arguments):
    limit = megabytes * 1_000_000
    return subprocess.run([PROGRAM, *arguments], cwd=folder, capture_output=True, text=True, errors="replace", timeout=300,
                          env={**os.environ, "LDI_MODELS": MODELS}, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, (limit, limit)))


def least_memory(folder):
    """Returns the megabytes that the program needs to load its libraries and start."""
    return next((megabytes for megabytes in range(30, 400, 2) if run(folder, megabytes, "--version").returncode == DONE), None)


def write_photos(folder):
    """Writes the sample in every format for which this machine has a writer."""
    names = ["photo.jpg"]
    shutil.copy(SAMPLE, os.path.join(folder, "photo.jpg"))
    for name, options in (("photo.png", []), ("photo.webp", []), ("photo.tif", ["-compression_algo", "deflate"]), ("photo.bmp", []), ("photo.gif", [])):
        if shutil.which("ffmpeg") and subprocess.run(["ffmpeg", "-loglevel", "error", "-i", SAMPLE, *options, os.path.join(folder, name)]).returncode == 0:
            names.append(name)
        else:
            print(f"skipped {name}: there is no ffmpeg that writes it")
    for name, options in (("photo.heic", []), ("photo.avif", ["-A"])):
        if shutil.which("heif-enc") and subprocess.run(["heif-enc", *options, SAMPLE, "-o", os.path.join(folder, name)], capture_output=True).returncode == 0:
            names.append(name)
        else:
            print(f"skipped {name}: there is no heif-enc that writes it")
    return names


def runs(photos):
    depth = ["--depth", "depth.png"]
    for name in photos:
        yield name, [name, *depth, "--inpaint", "diffusion", "-o", "out/a.glb"]
    photo = ["photo.jpg", *depth, "--inpaint", "diffusion", "-o", "out/a.glb"]
    yield "networks", ["photo.jpg", "-o", "out/a.glb"]
    yield "a page", [*photo, "--html", "out/a.html", "--viewer", "viewer.html"]
    yield "a compressed file", [*photo, "--compress"]
    yield "USDZ", [*photo, "--usdz", "out/a.usdz"]
    yield "two pictures", [*photo, "--stereo-image", "out/a.png"]
    yield "frames", [*photo, "--video", "out/frames", "--seconds", "0.1"]
    yield "stages", [*photo, "--stages", "out/stages"]
    yield "a larger texture", [*photo, "--size", "full", "--geometry-size", "600"]


def one_by_one(folder, least):
    codes = {}
    for name, arguments in runs(write_photos(folder)):
        for megabytes in [round(least * 1.3**i) for i in range(10)]:
            shutil.rmtree(os.path.join(folder, "out"), ignore_errors=True)
            os.mkdir(os.path.join(folder, "out"))
            result = run(folder, megabytes, *arguments, "--quiet", "--threads", "2")
            codes[result.returncode] = codes.get(result.returncode, 0) + 1
            left = os.listdir(os.path.join(folder, "out"))
            check(f"{name} with {megabytes} MB: the run succeeds or ends with exit code {TRY_AGAIN}, found {result.returncode}", result.returncode in (DONE, TRY_AGAIN), result.stderr)
            check(f"{name} with {megabytes} MB: a failed run leaves no file, found {left}", ("a.glb" in left) if result.returncode == DONE else not left)
            if result.returncode == DONE:
                break
    print("exit codes:", codes)
    check("some runs fail for lack of memory, and some succeed", codes.get(TRY_AGAIN, 0) > 50 and codes.get(DONE, 0) > 5)


def a_batch(folder, least):
    """Converts a large photo among small ones. The small photos must be converted, and the large one must be marked for another try."""
    with open(os.path.join(folder, "large.png"), "wb") as out:
        out.write(png(5000, 4000, 3))
    for name in ("a", "b", "c"):
        with open(os.path.join(folder, name + ".png"), "wb") as out:
            out.write(png(120, 160, 3))
    os.mkdir(os.path.join(folder, "maps"))
    for name in ("a", "b", "c", "large"):
        shutil.copy(os.path.join(folder, "depth.png"), os.path.join(folder, "maps", name + ".png"))
    result = run(folder, least + 90, "--batch", "a.png", "large.png", "b.png", "c.png", "--depth", "maps", "--inpaint", "diffusion", "--threads", "1", "-o", "batch")
    lines = {line["photo"]: line for line in map(json.loads, result.stdout.splitlines())}
    check(f"a batch: exit code {result.returncode}", result.returncode == TRY_AGAIN, result.stderr)
    check("a batch: the small photos are converted", all("outputs" in lines.get(name + ".png", {}) for name in ("a", "b", "c")), lines)
    check("a batch: the large photo is marked for another try", lines.get("large.png", {}).get("error", {}).get("try_again") is True, lines)
    check("a batch: its GLB files are complete", all(is_whole_glb(open(os.path.join(folder, "batch", name + ".glb"), "rb").read()) for name in ("a", "b", "c")))


def main():
    with tempfile.TemporaryDirectory() as folder:
        least = least_memory(folder)
        if least is None:
            print("skipped: the program needs more memory to start (sanitizers)")
            return 0
        with open(os.path.join(folder, "depth.png"), "wb") as out:
            out.write(png(300, 400, 1, lambda y: bytes(40 if x < 150 else 200 for x in range(300))))
        with open(os.path.join(folder, "viewer.html"), "wb") as out:
            out.write(b"1<title>3D photo</title>2<!-- the photo goes here -->3")
        one_by_one(folder, least)
        a_batch(folder, least)
    finish()


main()
