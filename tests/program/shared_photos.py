"""Converts both photos of ../shared/tiefenrausch and every pair under ../shared/rgbd with its true depth, then validates each GLB.

    shared_photos.py PHOTO3D SOURCE_DIR
"""
import json
import os
import subprocess
import sys
import tempfile

PROGRAM, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
SHARED = os.path.join(SOURCE, "..", "shared")
VALIDATOR = os.path.join(SOURCE, "tests/gltf_validator")


def conversions():
    """Yields the name and arguments of every run."""
    model = os.path.join(SHARED, "tiefenrausch")
    for name in ("columns", "pumpkin"):
        yield name, [os.path.join(model, "input", name + ".jpg"), "--depth-model", os.path.join(model, "model")]
    folder = os.path.join(SHARED, "rgbd")
    with open(os.path.join(folder, "manifest.json"), encoding="utf-8") as manifest:
        for pair in json.load(manifest):
            arguments = [os.path.join(folder, pair["image"]), "--depth", os.path.join(folder, pair["map"])]
            is_metric = pair["kind"] == "depth"
            yield pair["name"], arguments + ["--depth-zero-is-unknown"] + (["--depth-kind", "meters", "--depth-scale", str(1 / pair["scale"])] if is_metric else [])


def main():
    if not os.path.isdir(os.path.join(SHARED, "rgbd")) or not os.path.isdir(os.path.join(SHARED, "tiefenrausch")):
        print("skipped: ../shared/rgbd or ../shared/tiefenrausch is absent")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        failed, written = 0, []
        for name, arguments in conversions():
            output = os.path.join(folder, name + ".glb")
            result = subprocess.run([PROGRAM, *arguments, "-o", output, "--quiet"], capture_output=True, text=True, timeout=600)
            if result.returncode != 0 or result.stderr:
                failed += 1
                print(f"FAILED {name}: exit code {result.returncode}, said: {result.stderr.strip()[:600]}")
            else:
                written.append(output)
        validation = subprocess.run(["node", os.path.join(VALIDATOR, "validate.mjs"), *written], capture_output=True, text=True, timeout=600)
        if validation.returncode != 0:  # also if the validator is missing; tests/run.sh installs it
            failed += 1
            print("FAILED validation:\n" + validation.stdout[-3000:] + validation.stderr[-3000:])
        print(f"{len(written)} photos converted, {failed} failures")
        return 1 if failed or not written else 0


sys.exit(main())
