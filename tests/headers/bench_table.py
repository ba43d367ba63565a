#!/usr/bin/env python3
"""Checks that the table of bench/run.sh names the processor of the measurement, not that of this machine, and marks rows with a large
spread. Also checks that the committed tables mark rows with a large spread, and that pages cite only revisions of this repository."""

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path

TABLE = Path(__file__).resolve().parent.parent.parent / "bench/table.py"


def results(folder, name, processor, times, benchmark="nn/add", **rates):
    """Writes results of one benchmark, with one repetition per time."""
    context = {"date": "2026-01-02T03:04:05", "revision": "abc"} | ({"processor": processor} if processor else {})
    runs = [{"name": benchmark, "run_name": benchmark, "run_type": "iteration", "cpu_time": t, "real_time": t} | rates for t in times]
    path = Path(folder) / name
    path.write_text(json.dumps({"context": context, "benchmarks": runs}), encoding="utf-8")
    return path


def table(*arguments):
    done = subprocess.run([sys.executable, TABLE, *arguments], check=True, capture_output=True, text=True)
    return done.stdout + done.stderr


with tempfile.TemporaryDirectory() as folder:
    even = results(folder, "even.json", "some processor", [1000, 1040, 1060, 1090])
    noisy = results(folder, "noisy.json", "other processor", [1000, 1200, 1300])
    unnamed = results(folder, "unnamed.json", None, [1000])
    streamed = results(folder, "streamed.json", None, [1000], **{"GB/s": 10, "share_of_peak": 0.5})
    cached = results(folder, "cached.json", None, [1000], **{"GB/s": 50, "share_of_peak": 1.5})
    kernel = results(folder, "kernel.json", None, [1000], "kernels/add_u8", **{"GB/s": 10, "share_of_peak": 0.5})
    products = results(folder, "products.json", None, [1000], "kernels/gemm_u8", **{"GMAC/s": 10, "share_of_peak": 0.5})
    checks = {"the processor is that of the measurement": table(even).startswith("some processor;"),
              "a missing processor is not replaced by that of this machine": table(unnamed).startswith("processor not recorded;"),
              "the median of an even number of runs is the mean of the two middle times": "| 1.05 ms | 9 % |" in table(even),
              "a spread above 10 % is bold": "| 1.2 ms | **30 %** |" in table(noisy),
              "comparing two processors prints a warning": "warning" in table(even, "--same", noisy) and not table(even, "--same", even),
              "a rate in GB/s below the peak is followed by its share of the peak": "| 10 GB/s, 0.50 |" in table(streamed),
              "a rate in GB/s above the peak is followed by '> peak'": "| 50 GB/s, > peak |" in table(cached),
              "a kernel's rate in GB/s has no share of the peak, because its data stays in caches": "| 10 GB/s |" in table(kernel),
              "a kernel's rate in GMAC/s is followed by its share of the peak": "| 10 GMAC/s, 0.50 |" in table(products),
              "the processor's name has no commas": "," not in table("--processor")}
ROOT = TABLE.parent.parent
for page in ("README.md", "notes/table.md"):
    spreads = re.findall(r"^\|(?:[^|]*\|){3} (\**)(\d+) %", (TABLE.parent / page).read_text(encoding="utf-8"), re.MULTILINE)
    checks[f"bench/{page} marks spreads above 10 %"] = spreads and all(bold == "**" for bold, spread in spreads if int(spread) > 10)
    rows = re.findall(r"^\| (?!kernels/)[^|]*\|[^|]*\|[^|]*\|[^|]*\| [\d.]+ GB/s(.*?) \| \d", (TABLE.parent / page).read_text(encoding="utf-8"), re.MULTILINE)
    checks[f"bench/{page} has a share, or '> peak', in all rows with GB/s"] = rows and all(rows)


def git(*arguments):
    return subprocess.run(["git", "-C", ROOT, *arguments], capture_output=True, text=True)


if git("rev-parse", "--is-shallow-repository").stdout.strip() == "false":
    for page in git("ls-files", "*.md").stdout.split():
        for revision in re.findall(r"\brevision ([0-9a-f]{7,40})\b", (ROOT / page).read_text(encoding="utf-8")):
            checks[f"{page} cites {revision}, a revision of this repository"] = git("cat-file", "-e", revision).returncode == 0
else:
    print("cited revisions were not checked: this clone has no history")

wrong = [fact for fact, holds in checks.items() if not holds]
if wrong:
    sys.exit("wrong: " + "; ".join(wrong))
print(f"{len(checks)} facts hold")
