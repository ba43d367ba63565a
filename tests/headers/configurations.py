#!/usr/bin/env python3
"""Checks that translation units with different compiler flags work in one program and share no function of ldi. If two units
define a function of the same name, the linker keeps only one of the two functions. The kept one might round differently, or use
instructions that the processor lacks.

    configurations.py FOLDER COMPILER [FLAG...]     builds in FOLDER
"""

import itertools
import platform
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
# Without optimization, the compiler inlines nothing, so the symbols of an object include every function that it shares.
SETTINGS = {"plain": ["-O0"], "without_exceptions": ["-O0", "-fno-exceptions"], "ndebug": ["-O0", "-DNDEBUG"],
            "own_assert": ["-O0", "-DLDI_ASSERT(condition)=static_cast<void>(condition)"],
            "standard": ["-O0", "-DLDI_STANDARD_ONLY"], "without_rtti": ["-O0", "-fno-rtti"],
            "finite_math": ["-O0", "-ffinite-math-only"]}
if platform.machine() in ("x86_64", "AMD64"):
    SETTINGS |= {"avx2": ["-O0", "-mavx2"], "avx2_fma": ["-O3", "-mavx2", "-mfma"], "sse4": ["-O0", "-msse4.2"]}

folder, compiler = Path(sys.argv[1]), sys.argv[2:]
folder.mkdir(parents=True, exist_ok=True)


def compile_unit(setting):
    """Compiles configuration.cpp with the flags of a setting. Returns the path of the object file."""
    unit = folder / f"{setting}.o"
    subprocess.run([*compiler, "-std=c++20", f"-I{ROOT / 'include'}", f"-DLDI_UNIT=unit_{setting}", *SETTINGS[setting], "-c",
                    HERE / "configuration.cpp", "-o", unit], check=True)
    return unit


def shared_symbols(unit):
    """Returns the functions and variables that an object shares with others: weak (W, V) and unique (u) symbols."""
    lines = subprocess.run(["nm", "-C", unit], check=True, capture_output=True, text=True).stdout.splitlines()
    return {line.split(maxsplit=2)[2] for line in lines if re.match(r"[0-9a-f]+ [WVu] ", line)}


def configuration(*flags):
    """Returns the name of ldi's inline namespace when compiled with these flags."""
    text = "#include <ldi/base/config.hpp>\nLDI_CONFIGURATION\n"
    done = subprocess.run([*compiler, "-std=c++20", f"-I{ROOT / 'include'}", *flags, "-E", "-P", "-x", "c++", "-"], input=text,
                          check=True, capture_output=True, text=True)
    return done.stdout.split()[-1]


# Every flag that enables instructions of newer processors, changes rounding, or removes exceptions, RTTI or assertions must change the
# namespace's name.
for flag in ("-ffast-math", "-ffinite-math-only", "-fno-rtti", "-fno-exceptions", "-DNDEBUG"):
    if configuration(flag) == configuration():
        sys.exit(f"{flag} does not change the name of the namespace")
if platform.machine() in ("x86_64", "AMD64"):
    for flag in ("sse3", "ssse3", "sse4.1", "sse4.2", "popcnt", "avx", "avx2", "fma", "bmi", "bmi2", "lzcnt", "avx512f", "avx512vl",
                 "avx512vbmi", "avx512vnni"):
        if configuration(f"-m{flag}") == configuration():
            sys.exit(f"-m{flag} does not change the name of the namespace")

with ThreadPoolExecutor(2) as pool:
    units = dict(zip(SETTINGS, pool.map(compile_unit, SETTINGS)))
symbols = {setting: shared_symbols(unit) for setting, unit in units.items()}
if not any("ldi::" in name for name in symbols["plain"]):
    sys.exit("nm shows none of ldi's functions")
for first, second in itertools.combinations(SETTINGS, 2):
    common = sorted(name for name in symbols[first] & symbols[second] if "ldi::" in name)
    if common:
        sys.exit(f"{first} and {second} share " + ", ".join(common[:10]))

# Objects may share the standard library's functions. Those instantiated with ldi's types have the configuration in their names.
for setting, unit in units.items():
    if setting == "plain":
        continue
    program = folder / f"plain_and_{setting}"
    names = ["-Dfirst_unit=unit_plain", f"-Dsecond_unit=unit_{setting}"]
    for order in ([units["plain"], unit], [unit, units["plain"]]):
        subprocess.run([*compiler, "-std=c++20", *names, HERE / "configurations.cpp", *order, "-pthread", "-o", program], check=True)
        subprocess.run([program], check=True, stdout=subprocess.DEVNULL)
print(f"{len(units)} configurations: {len(units) - 1} pairs work, and no two share a function of ldi")
