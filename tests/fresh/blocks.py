#!/usr/bin/env python3
"""Extracts the command blocks of the project's Markdown pages: every indented block, and every block fenced as sh.

    blocks.py list [PAGE...]         a line per block: PAGE, LINE, WHEN (now or late), REASON to skip it or -; separated by tabs
    blocks.py script PAGE LINE       a block as a script for bash, after the commands that prepare it
    blocks.py pages                  the pages with such blocks, cheap pages first, each after the page whose machine it reuses

Comments, which are invisible to readers, control how tests/fresh/run.sh runs a block. Above the block:

    <!-- fresh: skip REASON -->      not run, because it needs something that a fresh machine lacks, or takes hours
    <!-- fresh: late -->             run after the blocks, on all pages, that are not marked late
    <!-- fresh: in FOLDER -->        run in FOLDER instead of the top folder
    <!-- fresh: first COMMANDS -->   run before the block: provides the reader's own files, such as photo.jpg

In the first lines of a page:

    <!-- fresh: after PAGE -->       the page runs on the machine of PAGE; other pages start on a new machine

Blocks in other languages are fenced with the language's name.
"""

import re
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parent.parent.parent
COMMENT = re.compile(r"<!-- fresh: (skip|late|in|first|after)\b\s*(.*?)\s*-->", re.DOTALL)


class Block(NamedTuple):
    page: str
    line: int  # number of the first line, from 1
    text: str
    comments: dict


def pages():
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "*.md"], capture_output=True, text=True)
    if listed.returncode == 0:
        return listed.stdout.split()
    return sorted(str(path.relative_to(ROOT)) for path in ROOT.rglob("*.md"))  # a copy without git


def comments_in(text, where):
    if text.count("<!-- fresh:") != len(COMMENT.findall(text)):
        sys.exit(f"{where}: expected skip, late, in, first or after in a comment for tests/fresh, found another word")
    return dict(COMMENT.findall(text))


def indent_of(line):
    return len(line) - len(line.lstrip(" "))


def blocks_of(page):
    lines = (ROOT / page).read_text(encoding="utf-8").split("\n")
    at, above, item = 0, [], 0  # above: comments directly before a block; item: indentation of a list item's text
    while at < len(lines):
        line, start = lines[at], at
        fence = re.match(r" *```(\w*)", line)
        if fence:
            at += 1
            while not lines[at].lstrip().startswith("```"):
                at += 1
            at += 1
            if fence[1] == "sh":
                yield Block(page, start + 2, "\n".join(lines[start + 1:at - 1]), comments_in("\n".join(above), f"{page}:{start + 1}"))
            above = []
        elif line.lstrip().startswith("<!--"):
            while "-->" not in lines[at]:
                at += 1
            at += 1
            above += lines[start:at]
        elif line.strip() and indent_of(line) >= item + 4 and (start == 0 or not lines[start - 1].strip() or above):
            while at < len(lines) and (not lines[at].strip() or indent_of(lines[at]) >= item + 4):
                at += 1
            text = "\n".join(row[item + 4:] for row in lines[start:at]).rstrip()
            yield Block(page, start + 1, text, comments_in("\n".join(above), f"{page}:{start + 1}"))
            above = []
        else:
            marker = re.match(r"( *(?:[-*]|\d+\.) +)\S", line)
            if marker:
                item = len(marker[1])
            elif line.strip() and indent_of(line) < item:
                item = 0
            if line.strip():
                above = []
            at += 1


def page_before(page):
    head = "\n".join((ROOT / page).read_text(encoding="utf-8").split("\n")[:6])
    return comments_in(head, page).get("after")


def ordered_pages():
    """Returns the pages that have blocks, grouped by machine, each after the page that it follows. The machine whose first page has the fewest
    blocks to run comes first."""
    having = [page for page in pages() if any(True for _ in blocks_of(page))]
    first = lambda page: first(page_before(page)) if page_before(page) else page
    depth = lambda page: depth(page_before(page)) + 1 if page_before(page) else 0
    cost = lambda page: sum("skip" not in block.comments for block in blocks_of(page))
    return sorted(having, key=lambda page: (cost(first(page)), first(page), depth(page), page))


def main():
    if sys.argv[1] == "pages":
        for page in ordered_pages():
            print(page, page_before(page) or "-", sep="\t")
    elif sys.argv[1] == "list":
        for page in sys.argv[2:] or ordered_pages():
            for block in blocks_of(page):
                print(page, block.line, "late" if "late" in block.comments else "now",
                      re.sub(r"\s+", " ", block.comments.get("skip", "-")), sep="\t")
    elif sys.argv[1] == "script":
        block = next((b for b in blocks_of(sys.argv[2]) if b.line == int(sys.argv[3])), None)
        if block is None:
            sys.exit(f"{sys.argv[2]} has no block in line {sys.argv[3]}")
        print("set -euo pipefail")
        print(block.comments.get("first", ""))
        print("cd", block.comments.get("in", "."))
        print("set -x")
        print(block.text)


if __name__ == "__main__":
    main()
