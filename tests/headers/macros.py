#!/usr/bin/env python3
"""Checks that the single header compiles after macros that Qt, Windows and X11 define.

    macros.py COMPILER [FLAG...]
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
MACROS = """
#define slots
#define signals public
#define emit
#define small char
#define near
#define far
#define interface struct
#define min(a, b) (((a) < (b)) ? (a) : (b))
#define max(a, b) (((a) > (b)) ? (a) : (b))
#define ERROR 0
#define None 0L
#define Bool int
"""

header = ROOT / "single_include/ldi/ldi.hpp"
# The standard library does not compile after min and max, so it comes first.
standard = sorted(set(re.findall(r"^#include <([a-z_]+)>", header.read_text(encoding="utf-8"), re.MULTILINE)))
program = "".join(f"#include <{name}>\n" for name in standard)
program += "#if defined(__x86_64__)\n#include <immintrin.h>\n#endif\n" + MACROS + f'#include "{header}"\n'
result = subprocess.run([*sys.argv[1:], "-std=c++20", "-fsyntax-only", "-x", "c++", "-"], input=program, capture_output=True, text=True)
if result.returncode != 0:
    sys.exit(result.stderr)
