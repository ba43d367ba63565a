"""Takes the measurements of bench/photo3d/full_size.sh.

    full_size.py PHOTO3D PHOTO
"""
import json
import os
import statistics
import subprocess
import sys
import tempfile

PROGRAM, PHOTO = os.path.abspath(sys.argv[1]), sys.argv[2]
MEGAPIXELS, RUNS = (12, 24, 48), 5
passed = failed = 0


def check(name, is_good):
    global passed, failed
    passed, failed = passed + bool(is_good), failed + (not is_good)
    print(("passed: " if is_good else "FAILED: ") + name, flush=True)


def enlarged(folder, megapixels):
    """Resizes a photo to a number of pixels, with the same aspect ratio."""
    path = os.path.join(folder, f"{megapixels}.jpg")
    size = f"scale='2*trunc(sqrt({megapixels}e6*iw/ih)/2)':'2*trunc(sqrt({megapixels}e6*ih/iw)/2)':flags=lanczos"
    subprocess.run(["ffmpeg", "-v", "error", "-y", "-i", PHOTO, "-frames:v", "1", "-vf", size, "-q:v", "2", path], check=True)
    return path


def main():
    validator = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../tests/gltf_validator/run.sh")
    with tempfile.TemporaryDirectory() as folder:
        glb, report_file = os.path.join(folder, "out.glb"), os.path.join(folder, "out.json")
        photos = {m: enlarged(folder, m) for m in MEGAPIXELS}
        runs = {m: [] for m in MEGAPIXELS}
        for _ in range(RUNS):  # alternates sizes, so that other load affects all of them
            for m in MEGAPIXELS:
                subprocess.run([PROGRAM, photos[m], "--depth", "none", "--size", "full", "-o", glb, "--report", report_file, "--quiet"], check=True)
                runs[m].append(json.load(open(report_file)))
        print("| megapixels | peak MB | bytes per pixel | reading, s | encoding, s | the rest, s | textures | GLB, MB |\n|---|---|---|---|---|---|---|---|")
        seconds, peaks = {}, {}
        for m in MEGAPIXELS:
            facts = runs[m][0]
            pixels = facts["texture_width"] * facts["texture_height"]
            median = lambda stages: statistics.median(sum(ms for name, ms in run["milliseconds"].items() if stages(name)) for run in runs[m]) / 1000
            reading, encoding = median(lambda name: name == "reading photo"), median(lambda name: name == "encoding")
            rest = median(lambda name: name not in ("reading photo", "encoding", "total"))
            peak = max(run["peak_memory_bytes"] for run in runs[m])
            seconds[m], peaks[m] = (reading + encoding) / pixels, peak / pixels
            print(f"| {pixels / 1e6:.1f} | {peak / 1e6:.0f} | {peaks[m]:.1f} | {reading:.2f} | {encoding:.2f} | {rest:.2f} | {facts['textures']} | {facts['glb_bytes'] / 1e6:.1f} |")
        for m in MEGAPIXELS:
            check(f"{m} megapixels take at most 24 bytes per pixel: {peaks[m]:.1f}", peaks[m] <= 24)
        check(f"reading and encoding take {seconds[48] / seconds[12]:.2f} times as long per pixel at 48 megapixels as at 12 (required: at most 1.2)", seconds[48] <= 1.2 * seconds[12])
        subprocess.run([PROGRAM, photos[48], "--depth", "none", "--size", "full", "-o", glb, "--quiet"], check=True)
        check("the validator finds no error and no warning in the GLB file of the 48-megapixel photo", subprocess.run([validator, glb], stdout=subprocess.DEVNULL).returncode == 0)
    print(f"{passed} passed, {failed} failed")
    sys.exit(failed > 0)


main()
