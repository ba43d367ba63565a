#!/usr/bin/env python3
"""Checks that the lessons' pictures equal the output of learn_make_crops from the sample.

    crops.py PROGRAM
"""

import subprocess
import sys
import tempfile
from pathlib import Path

LESSONS = Path(__file__).resolve().parent.parent.parent / "examples" / "learn"

with tempfile.TemporaryDirectory() as folder:
    subprocess.run([sys.argv[1], folder], check=True)
    made = sorted(Path(folder).iterdir())
    if len(made) != 4:
        sys.exit(f"expected 4 files, found {[path.name for path in made]}")
    for path in made:
        if path.read_bytes() != (LESSONS / path.name).read_bytes():
            sys.exit(f"{path.name} differs from the output of learn_make_crops: run it again with {LESSONS}")
