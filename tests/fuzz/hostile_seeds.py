"""Runs the scripts in ../shared/hostile, if present, and copies the files that they create to the fuzzers' seeds: FOLDER/photo,
FOLDER/depth_map and so on.

    hostile_seeds.py SOURCE_DIR FOLDER
"""
import os
import shutil
import subprocess
import sys
import tempfile

MAX_BYTES = 150_000  # larger files test only memory limits
SOURCE, FOLDER = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
MAKERS = os.path.join(SOURCE, "..", "shared", "hostile")
FUZZERS = {"depth": "depth_map", "npy": "depth_map", "pfm": "depth_map", "keys": "key_frames", "st": "safetensors", "manifest": None, "manifest2": None}


def main():
    if not os.path.isdir(MAKERS):
        print("skipped: ../shared/hostile is absent")
        return 0
    added = 0
    with tempfile.TemporaryDirectory() as work:
        files = os.path.join(work, "files")
        environment = {**os.environ, "BOMBS": files, "SAMPLE": os.path.join(SOURCE, "examples/photo3d/sample.jpg")}
        for maker in ("bombs.py", "heif.py", "scan.py"):  # a script that lacks a library does not write its last files
            made = subprocess.run(["/usr/bin/python3", os.path.join(MAKERS, maker)], env=environment, capture_output=True, text=True)
            if made.returncode != 0:
                print(f"skipped the rest of {maker}: {made.stderr.strip().splitlines()[-1]}")
        for name in sorted(os.listdir(files)) if os.path.isdir(files) else []:
            path = os.path.join(files, name)
            fuzzer = FUZZERS.get(name.split("_")[0].split(".")[0], "photo")
            if fuzzer is None or os.path.getsize(path) > MAX_BYTES:
                continue
            os.makedirs(os.path.join(FOLDER, fuzzer), exist_ok=True)
            shutil.copy(path, os.path.join(FOLDER, fuzzer, name))
            added += 1
    print(f"{added} seeds added")
    return 0


sys.exit(main())
