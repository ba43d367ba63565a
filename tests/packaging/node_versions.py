#!/usr/bin/env python3
"""Checks that all npm packages of the project, at their locked versions, accept Debian 12's version of node."""

import json
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
DEBIAN = 18


def accepts(versions):
    """Whether a range such as "^18.12 || >=20" includes a version with the major version number of Debian's node."""
    for alternative in versions.split("||"):
        bounds = re.findall(r"([<>=^~]*)\s*v?(\d+)", re.sub(r"\.[\dx*.]+", "", alternative))
        if all(int(number) <= DEBIAN if ">" in sign else DEBIAN <= int(number) if "<" in sign else int(number) == DEBIAN
               for sign, number in bounds):
            return True
    return False


locks = subprocess.run(["git", "-C", ROOT, "ls-files", "*package-lock.json"], check=True, capture_output=True, text=True).stdout.split()
if not locks:
    sys.exit("expected package-lock.json files, found none")
wrong = []
for lock in locks:
    for name, package in json.loads((ROOT / lock).read_text(encoding="utf-8"))["packages"].items():
        versions = package.get("engines", {}).get("node", "*") if isinstance(package.get("engines"), dict) else "*"
        if not accepts(versions):
            wrong.append(f"{lock}: {name} needs node {versions}, and Debian 12 has {DEBIAN}")
if wrong:
    sys.exit("\n".join(wrong))
print(f"all packages of {len(locks)} files run on node {DEBIAN}")
