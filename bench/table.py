#!/usr/bin/env python3
"""Writes the Markdown table of a JSON file of ldi_bench.

    table.py RESULTS.json                    all rows, to standard output
    table.py RESULTS.json --readme FILE.md   the rows that fit a page, between the markers of FILE.md
    table.py --processor                     the name of this processor, which bench/run.sh stores with the results
    table.py RESULTS.json --same BEFORE.json a warning unless both were measured on the same processor

Time is the median processor time of the repetitions, except for steps/, whose time is elapsed time. The table names the processor, the
revision and the date of the measurement. A spread above 10 % is bold."""

import json
import re
import statistics
import sys
from pathlib import Path

BEGIN, END = "<!-- bench/run.sh: begin -->", "<!-- bench/run.sh: end -->"


def zen(info):
    """Returns the generation of an AMD processor, which virtual machines omit from the name. Returns an empty text for other processors."""
    if info.get("vendor_id") != "AuthenticAMD":
        return ""
    family, model = int(info["cpu family"]), int(info["model"])
    if family == 26:
        return " Zen 5"
    if family == 25:  # models 0 to 15, 32 to 95: Zen 3
        return " Zen 4" if model // 16 in (1, 6, 7, 10) else " Zen 3"
    return ""


def processor():
    """Returns the name of this processor, with generation, family and model if /proc/cpuinfo has them, and without commas, at which Google
    Benchmark would split it."""
    try:
        info = dict(re.findall(r"^([^\t:]+)\s*: (.*)$", Path("/proc/cpuinfo").read_text(), re.MULTILINE))
    except OSError:
        info = {}
    name = info.get("model name", "unknown processor").replace(",", "")
    return f"{name}{zen(info)} (family {info['cpu family']} model {info['model']})" if "cpu family" in info else name


def measured_on(context):
    return context.get("processor", "processor not recorded")


def read(path):
    """Returns the machine's description, and per benchmark the medians over its repetitions."""
    content = json.loads(Path(path).read_text())
    runs = {}
    for b in content["benchmarks"]:
        if b.get("run_type") == "iteration" and not b.get("error_occurred"):
            runs.setdefault(b["run_name"], []).append(b)
    rows = []
    for name, repeated in runs.items():
        row = dict(repeated[0])
        times = [r["real_time" if name.endswith("/manual_time") else "cpu_time"] for r in repeated]
        row["time"], row["spread"] = statistics.median(times), max(times) / min(times) - 1
        for rate in ("GMAC/s", "GB/s", "Mpixel/s", "share_of_peak"):
            if rate in row:
                row[rate] = statistics.median([r[rate] for r in repeated])
        row["name"], row["runs"] = name.removesuffix("/manual_time").split("/iterations:")[0], len(repeated)
        rows.append(row)
    return content["context"], rows


def number(value):
    """Formats a number with three significant digits, without an exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def time_text(microseconds):
    for limit, unit, factor in ((1, "ns", 1e3), (1000, "µs", 1), (float("inf"), "ms", 1e-3)):
        if microseconds < limit:
            return f"{number(microseconds * factor)} {unit}"


def spread_text(row):
    if row["runs"] < 2:
        return ""
    text = f"{100 * row['spread']:.0f} %"
    return f"**{text}**" if row["spread"] > 0.1 else text


def rate_text(row):
    for rate in ("GMAC/s", "GB/s", "Mpixel/s"):
        if rate in row:
            return f"{number(row[rate])} {rate}"
    return ""


def share_text(row):
    """Returns the share of the peak, or "> peak" for a rate in GB/s above the measured peak of a pass over memory. Returns an empty text for
    rates in GB/s of kernels/, whose data is in caches."""
    if "share_of_peak" not in row or "GB/s" in row and row["name"].startswith("kernels/"):
        return ""
    return "> peak" if "GB/s" in row and row["share_of_peak"] > 1 else f"{row['share_of_peak']:.2f}"


def rate_and_share(row):
    return ", ".join(filter(None, (rate_text(row), share_text(row))))


def allocations_text(row):
    count = round(row.get("allocations", 0))
    if count == 0:
        return "0" if "allocations" in row else ""
    megabytes = row["peak_bytes"] / 1e6
    return f"{count}, {number(megabytes)} MB" if megabytes >= 0.001 else str(count)


def heading(context, rows):
    peaks = [f"{name[5:]}: {float(value):.0f}" for name, value in context.items() if name.startswith("peak ")]
    build = f"{context['compiler'].strip()}, release preset" if "compiler" in context else "compiler unknown"
    load = f", load {context['load_avg'][0]:.1f} at the start" if context.get("load_avg") else ""
    return (f"{measured_on(context)}{load}; {build}; revision {context.get('revision', 'unknown')}, {context['date'][:10]}. Processor time on one thread "
            f"(elapsed time for steps/), medians of {max(r['runs'] for r in rows)} runs; spread: how much the longest exceeds the "
            "shortest. Measured peaks: " + "; ".join(peaks) + ".")


def peer_text(row, rows):
    """Returns a peer's time relative to ours in the row of the same variant; an empty text for other rows."""
    if row["name"].startswith("peers/"):
        variant = row["name"].rpartition("/")[2]
        for ours in rows:
            if ours["name"].rpartition("/")[2] == variant and not ours["name"].startswith("peers/"):
                return f"{number(row['time'] / ours['time'])} x {ours['name'].rpartition('/')[0]}"
    return ""


def table(rows):
    lines = ["| benchmark | size | time | spread | rate, share of peak | allocations |", "|---|---|---|---|---|---|"]
    for r in rows:
        lines.append(f"| {r['name']} | {r.get('label', '')} | {time_text(r['time'])} | {spread_text(r)} | "
                     f"{rate_and_share(r) or peer_text(r, rows)} | {allocations_text(r)} |")
    return lines


def by_instruction_set(rows, sets):
    """Returns the table of kernels: one line per kernel, for its first shapes; one column per instruction set."""
    cells = {}
    for r in rows:
        name, _, last = r["name"].rpartition("/")
        if last in sets and r["name"].startswith("kernels/"):
            cells.setdefault(name, {})[last] = rate_and_share(r)
    shown = set()
    lines = ["| kernel | " + " | ".join(sets) + " |", "|---" * (len(sets) + 1) + "|"]
    for name, row in cells.items():
        family = name.split("/")[1]
        if sum(family == s for s in (n.split("/")[1] for n in shown)) < {"gemm_u8": 4, "add_u8": 1}.get(family, 2):
            shown.add(name)
            lines.append(f"| {name[8:]} | " + " | ".join(row.get(s, "") for s in sets) + " |")
    return lines


# Rows omitted from the page: kernels have their own table; steps and scaling laws are left to other pages; the rest are variants
# or take microseconds.
LEFT_OUT = re.compile("|".join((
    "^(steps|scaling|kernels)/", "read and pack",
    "^core/(layered_view|single_layer|link_editor|graph_builder|pixel_region|for_each_run|runs_of|reordered|halved|parents|pixels_below)",
    "^core/validate_canonical", "image, orphans", "^depth/level_dips",
    "^nn/(pack|renumber|restrict|mark|needed|on_subsets|pixel_subset|convolution_layer|dequantize|max_pool)", "squares of (96|8) ", "partial [57]x",
    "^texture/(pack|lay_out)", "^mesh/(move_to_sheets|check_mesh|gather|simplified_boundary)", "^networks/(quantized|read)", "rims$",
    "^render/(has_gaps|side_by_side|disparity_map|anaglyph)", "^formats/", "fill_invalid")))
# Functions with several rows on the page.
COMPLETE = ("nn/convolve/", "nn/convolve_partially/", "networks/farbrausch/", "core/coarsen/", "mesh/build_mesh")


def short(rows, sets):
    """Returns the page's rows: the first of each function, and all rows of functions in COMPLETE."""
    kept, seen = [], set()
    for r in rows:
        function = "/".join(r["name"].split("/")[:2])
        if LEFT_OUT.search(r["name"]) or r["name"].rpartition("/")[2] in sets:
            continue
        if function not in seen or r["name"].startswith(COMPLETE):
            kept.append(r)
        seen.add(function)
    return kept


def main(arguments):
    if arguments == ["--processor"]:
        print(processor())
        return
    context, rows = read(arguments[0])
    if arguments[1:2] == ["--same"]:
        here, before = measured_on(context), measured_on(read(arguments[2])[0])
        if here != before:
            print(f"warning: these results were measured on {here}, the earlier ones on {before}; their ratio does not compare the code", file=sys.stderr)
        return
    sets = [s for s in ("scalar", "avx2", "avxvnni", "avx512vnni", "neon", "wasm")
            if any(r["name"].endswith("/" + s) for r in rows)]
    if len(arguments) == 1:
        print(heading(context, rows), "", *table(rows), sep="\n")
        return
    page = Path(arguments[2])
    before, rest = page.read_text().split(BEGIN)
    after = rest.split(END)[1]
    made = [heading(context, rows), "", *by_instruction_set(rows, sets), "", *table(short(rows, sets))]
    page.write_text(before + BEGIN + "\n" + "\n".join(made) + "\n" + END + after)


main(sys.argv[1:])
