#!/usr/bin/env python3
"""Writes single_include/ldi/ldi.hpp: include/ldi/ldi.hpp with every reachable <ldi/...> header pasted in once,
and those in generic/ wherever an instruction set includes them.

    amalgamate.py                  writes the file
    amalgamate.py --check          fails if the committed file is out of date
    amalgamate.py --forward DIR    writes DIR/ldi/**/*.hpp instead, each of which includes the committed file, so that a
                                   test suite written for the separate headers runs against it

Fails if there is a header that include/ldi/ldi.hpp includes neither directly nor indirectly.
"""

import argparse
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
INCLUDE = ROOT / "include"
UMBRELLA = "ldi/ldi.hpp"
RESULT = ROOT / "single_include" / UMBRELLA

# Headers that ldi.hpp omits on purpose: those that need files or other libraries, and the forward declarations.
LEFT_OUT = re.compile(r"ldi/(adapt/.*|io/.*|ldi\.hpp)")

INCLUDE_LINE = re.compile(r"\s*#\s*include\s*<([^>]+)>")
QUOTED_INCLUDE = re.compile(r'\s*#\s*include\s*"')
OPENS = re.compile(r"\s*#\s*if")
TURNS = re.compile(r"\s*#\s*el(if|se)\b")
CLOSES = re.compile(r"\s*#\s*endif\b")
PRAGMA_ONCE = re.compile(r"\s*#\s*pragma\s+once\b")


class Header:
    """A header's lines, each with the header that it includes and the conditions (#if ...) around it."""

    def __init__(self, name):
        self.name = name
        self.lines = (INCLUDE / name).read_text(encoding="utf-8").splitlines()
        self.included = []
        self.conditions = []
        open_conditions = []
        for number, line in enumerate(self.lines, 1):
            if QUOTED_INCLUDE.match(line):
                sys.exit(f"{name}:{number}: write #include <ldi/...>, not quotes")
            if CLOSES.match(line):
                open_conditions.pop()
            elif TURNS.match(line):
                open_conditions[-1] += " " + line.strip()
            elif OPENS.match(line):
                open_conditions.append(line.strip())
            match = INCLUDE_LINE.match(line)
            self.included.append(match.group(1) if match else None)
            self.conditions.append(tuple(open_conditions))
        if self.is_generic():
            if any(self.included) or any(PRAGMA_ONCE.match(line) for line in self.lines):
                sys.exit(f"{name}: a header pasted once per instruction set must have no #include and no #pragma once")
        elif not any(PRAGMA_ONCE.match(line) for line in self.lines):
            sys.exit(f"{name}: has no #pragma once")

    def is_generic(self):
        """Returns whether each instruction set includes the header inside its own namespace and target region."""
        return "/generic/" in self.name

    def ldi_includes(self):
        return [(i, c) for i, c in zip(self.included, self.conditions) if i and i.startswith("ldi/") and "/generic/" not in i]


class Amalgamation:
    def __init__(self):
        self.headers = {}
        self.done = {}  # name -> conditions around the pasted header
        self.system = set()

    def header(self, name):
        if name not in self.headers:
            if not (INCLUDE / name).is_file():
                sys.exit(f"<{name}> is included but does not exist")
            self.headers[name] = Header(name)
        return self.headers[name]

    def paste(self, name, conditions, output):
        """Appends a header to output, after the headers that it includes. Hoists the includes of a header under #if as well, so that
        the preprocessor does not skip them for other headers."""
        if name in self.done:
            if self.done[name] not in ((), conditions):
                sys.exit(f"<{name}> is included under {self.done[name]}, but also under {conditions or 'no condition'}")
            return
        self.done[name] = conditions
        header = self.header(name)
        self.paste_needs(header, conditions, output)
        body = []
        for line, included, here in zip(header.lines, header.included, header.conditions):
            if PRAGMA_ONCE.match(line) or (included and included in self.system):
                continue
            if included and "/generic/" in included:
                self.done[included] = ()
                body += self.header(included).lines
                continue
            if included and included.startswith("ldi/"):
                if here:
                    self.paste(included, conditions + here, body)
                continue
            if included and not conditions and not here:
                self.system.add(included)
            body.append(line)
        output += ["", f"// ---- {name}"] + body

    def paste_needs(self, header, conditions, output):
        for included, here in header.ldi_includes():
            if not here:
                self.paste(included, conditions, output)
            elif included not in self.done:
                self.paste_needs(self.header(included), conditions, output)

    def text(self):
        output = []
        self.paste(UMBRELLA, (), output)
        forgotten = sorted(
            name
            for name in (str(path.relative_to(INCLUDE)) for path in INCLUDE.rglob("*.hpp"))
            if name not in self.done and not LEFT_OUT.fullmatch(name)
        )
        if forgotten:
            sys.exit("include/ldi/ldi.hpp reaches neither of: " + " ".join(forgotten))
        lines = ["// ldi in one header. Generated by single_include/amalgamate.py: edit the headers in include/, not this file.",
                 "#pragma once", "", "// The headers in include/ldi/adapt/ need no other header once this one is included.",
                 "#define LDI_SINGLE_HEADER 1", ""]
        for line in output:
            if line or lines[-1]:
                lines.append(line.rstrip())
        return "\n".join(lines).rstrip() + "\n"


def write_if_changed(path, text):
    if path.is_file() and path.read_text(encoding="utf-8") == text:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    mode = parser.add_mutually_exclusive_group()
    mode.add_argument("--check", action="store_true")
    mode.add_argument("--forward", type=Path, metavar="DIR")
    arguments = parser.parse_args()

    amalgamation = Amalgamation()
    text = amalgamation.text()
    if arguments.check:
        if not RESULT.is_file() or RESULT.read_text(encoding="utf-8") != text:
            sys.exit("single_include/ldi/ldi.hpp is not current: run single_include/amalgamate.py")
    elif arguments.forward:
        for name in amalgamation.done:
            write_if_changed(arguments.forward / name, f'#pragma once\n#include "{RESULT.as_posix()}"\n')
    else:
        write_if_changed(RESULT, text)


if __name__ == "__main__":
    main()
