#!/usr/bin/env python3
"""Checks that single_include/ldi/ldi.hpp and include/ldi/ldi.hpp preprocess to the same tokens.

    same_program.py COMPILER [FLAG...]     FLAG: compiler flags, such as -I for the headers of other libraries

Tests of one header with this compiler therefore also cover the other header.
"""

import itertools
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent


def tokens(folder, flags):
    """Returns the preprocessed tokens. Assertions contain file and line, so they stay unexpanded."""
    command = [*sys.argv[1:], *flags, "-std=c++20", "-E", "-P", "-DLDI_ASSERT(condition)=ldi_assert(condition)",
               f"-I{ROOT / folder}", "-x", "c++", "-"]
    result = subprocess.run(command, input="#include <ldi/ldi.hpp>\n", capture_output=True, text=True)
    if result.returncode != 0:
        sys.exit(result.stderr)
    return result.stdout.split()


for flags in ([], ["-fno-exceptions", "-fno-rtti"]):
    separate, single = tokens("include", flags), tokens("single_include", flags)
    if "photo_layers" not in separate:
        sys.exit("expected the headers that ldi.hpp includes in the preprocessed text, found none")
    for number, (a, b) in enumerate(itertools.zip_longest(separate, single)):
        if a != b:
            around = slice(max(number - 12, 0), number + 12)
            sys.exit(f"separate headers: ... {' '.join(separate[around])} ...\nsingle header: ... {' '.join(single[around])} ...")
    print(f"{len(separate)} tokens, the same{' with ' if flags else ''}{' '.join(flags)}")
