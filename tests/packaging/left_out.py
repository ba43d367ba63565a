#!/usr/bin/env python3
"""Checks that CMake leaves out each part with a missing package and prints one line with the package's name, and that it stops instead if
LDI_REQUIRED is set.

    left_out.py FOLDER COMPILER
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
folder, compiler = Path(sys.argv[1]), sys.argv[2]

# Maps the name for find_package() to the Debian package, and to a part of the project that needs the package.
PACKAGES = {
    "Catch2": ("catch2", "tests of the library's parts"),
    "TinyGLTF": ("libtinygltf-dev", "tests/formats"),
    "Eigen3": ("libeigen3-dev", "bench/quality"),
    "xtensor": ("libxtensor-dev", "examples/learn/07_charts_and_atlas"),
    "benchmark": ("libbenchmark-dev", "examples/learn/10_microbenchmark"),
    "CGAL": ("libcgal-dev", "the peer in bench/mesh"),
    "CLI11": ("libcli11-dev", "examples/photo3d and examples/service"),
    "nlohmann_json": ("nlohmann-json3-dev", "examples, tests and benchmarks"),
    "meshoptimizer": ("libmeshoptimizer-dev", "photo3d --compress"),
    "rabbitmq-c": ("librabbitmq-dev", "examples/service"),
    "prometheus-cpp": ("prometheus-cpp-dev", "examples/service"),
    "stb": ("libstb-dev", "ldi::io"),
    "PNG": ("libpng-dev", "ldi::io"),
    "protozero": ("libprotozero-dev", "ldi::io"),
    "Python3": ("python3", "tests"),
}
READERS = {"LIBHEIF": "libheif-dev", "LIBWEBP": "libwebp-dev", "LIBTIFF": "libtiff-dev", "LCMS2": "liblcms2-dev", "PUGIXML": "libpugixml-dev", "LIBJPEG": "libjpeg-dev"}


def configure(*options):
    """Configures with these options. Drops the options of the previous configuration, but reuses the results of its compiler checks."""
    command = ["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", f"-DCMAKE_CXX_COMPILER={compiler}", "-U", "CMAKE_DISABLE_FIND_PACKAGE_*",
               "-U", "LDI_*", *options]
    result = subprocess.run(command, capture_output=True, text=True)
    text = result.stdout + result.stderr
    return result.returncode, text, re.findall(r"^(?:-- )? *(Left out: .*)$", text, re.MULTILINE)


def targets():
    out = subprocess.run(["ninja", "-C", folder, "-t", "targets", "all"], capture_output=True, text=True, check=True).stdout
    return set(re.findall(r"^(\w+): phony$", out, re.MULTILINE))


faults = []


def check(good, fault):
    if not good:
        faults.append(fault)


def without(*names):
    return [f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in names]


shutil.rmtree(folder, ignore_errors=True)
for name, (package, part) in PACKAGES.items():
    code, text, lines = configure(*without(name))
    check(code == 0, f"without {name}, CMake fails:\n{text}")
    check(any(line.startswith(f"Left out: {part} ") and package in line for line in lines), f"without {name}, no line says {part} lacks {package}: {lines}")
    check(len(lines) == len(set(lines)), f"without {name}, a line is printed twice: {lines}")
    check(not re.search(r"Warning|Error", text), f"without {name}, CMake prints a warning or an error:\n{text}")
    if name == "Catch2":
        check({"photo3d", "learn_01_what_an_ldi_is", "ldi_quality"} <= targets(), f"without Catch2, programs are missing: {targets()}")

code, text, lines = configure(*[f"-DLDI_{name}_LIBRARY=" for name in READERS])
check(code == 0, f"without the readers, CMake fails:\n{text}")
for package in READERS.values():
    check(any("ldi::io's use of" in line and package in line for line in lines), f"no line names {package}: {lines}")

code, text, lines = configure(*without(*PACKAGES))
check(code == 0, f"without any package, CMake fails:\n{text}")
check({"ldi_test_core", "photo3d"}.isdisjoint(targets()), "without any package, CMake still defines programs")

code, text, lines = configure(*without("stb", "PNG", "protozero", "nlohmann_json"), "-DLDI_BUILD_IO=OFF", "-DLDI_BUILD_BENCH=OFF")
check(code == 0 and any("tests/io " in line for line in lines), f"without ldi::io, CMake fails, or no line says that tests/io is left out:\n{text}")
check({"ldi_test_core", "ldi_test_mesh"} <= targets() and "ldi_test_io" not in targets(), f"without ldi::io, the core has no tests: {targets()}")

code, text, lines = configure(*without("Catch2"), "-DLDI_REQUIRED=^tests")
check(code != 0 and "catch2" in text, f"LDI_REQUIRED does not stop CMake when tests are left out:\n{text}")

if faults:
    sys.exit("\n".join(faults))
print(f"{len(PACKAGES) + len(READERS)} packages can be missing")
