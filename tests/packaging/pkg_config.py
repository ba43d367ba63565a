#!/usr/bin/env python3
"""Checks that a compiler finds an installed ldi through pkg-config, even after the tree is moved and with folders other than the defaults, that
CMake writes only to the build folder, and that license and single header exist.

    pkg_config.py PREFIX FOLDER COMPILER
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

prefix, folder, compiler = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
consumer = Path(__file__).with_name("consumer.cpp")
moved = folder / "moved"
shutil.rmtree(folder, ignore_errors=True)
for part in ("include", "share/pkgconfig", "share/licenses", "share/ldi"):
    shutil.copytree(prefix / part, moved / part)

environment = os.environ | {"PKG_CONFIG_PATH": str(moved / "share/pkgconfig")}
flags = subprocess.run(["pkg-config", "--cflags", "--libs", "ldi >= 0.1"], env=environment, check=True, capture_output=True, text=True).stdout.split()
subprocess.run([compiler, "-std=c++20", consumer, *flags, "-o", folder / "consumer"], check=True)
subprocess.run([folder / "consumer"], check=True)

single = folder / "single.cpp"
program = consumer.read_text(encoding="utf-8")
single.write_text("#include <ldi/ldi.hpp>\n" + "".join(line for line in program.splitlines(True) if not line.startswith("#include")), encoding="utf-8")
subprocess.run([compiler, "-std=c++20", "-fsyntax-only", f"-I{moved / 'share/ldi/single_include'}", single], check=True)
if "MIT" not in (moved / "share/licenses/ldi/LICENSE").read_text(encoding="utf-8"):
    sys.exit("share/licenses/ldi/LICENSE: expected the MIT license, found another text")

with tempfile.TemporaryDirectory() as outside:  # CMake refuses to install headers inside the source folder
    outside = Path(outside).resolve()
    away, installed, headers = outside / "away", outside / "installed", outside / "headers"
    subprocess.run(["cmake", "-S", Path(__file__).resolve().parents[2], "-B", away / "build", "-G", "Ninja", f"-DCMAKE_CXX_COMPILER={compiler}",
                    "-DLDI_BUILD_TESTS=OFF", "-DLDI_BUILD_BENCH=OFF", f"-DCMAKE_INSTALL_PREFIX={installed}",
                    "-DCMAKE_INSTALL_DATADIR=share/deep", f"-DCMAKE_INSTALL_BINDIR={outside / 'bin/deep'}", f"-DCMAKE_INSTALL_INCLUDEDIR={headers}"],
                   check=True, stdout=subprocess.DEVNULL)
    if [path.name for path in away.iterdir()] != ["build"]:
        sys.exit(f"expected files only in the build folder, found others: {list(away.iterdir())}")
    subprocess.run(["cmake", "--install", away / "build"], check=True, stdout=subprocess.DEVNULL)
    environment["PKG_CONFIG_PATH"] = str(installed / "share/deep/pkgconfig")
    stated = [subprocess.run(["pkg-config", what, "ldi"], env=environment, check=True, capture_output=True, text=True).stdout.strip()
              for what in ("--cflags-only-I", "--variable=prefix")]
    if stated[0] != f"-I{headers}" or Path(stated[1]).resolve() != installed:
        sys.exit(f"ldi.pc states {stated} with folders other than the defaults")
