"""Takes the measurements of bench/photo3d/run.sh and bench/compare.sh.

    stages.py [--runs N] PHOTO3D                              every stage, beside the paper
    stages.py [--runs N] --beside OTHER --name NAME PHOTO3D   ratio of every stage's time to that of another program

The stages' times are those of `photo3d --report`. For one thread, they are processor times, which other programs on the machine
hardly change. If the other program does not report processor times, the elapsed times of both are compared.
"""
import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
COMPANIONS = os.path.join(ROOT, "..", "shared", "depth_companions")
SAMPLE = os.path.join(ROOT, "examples", "photo3d", "sample.jpg")
OF_SHARED = ("iphone_mpo_a.jpg", "iphone_portrait_pug.heic", "gdepth_cafe.jpg", "pair_flowers.jpg", "pair_mango.jpg", "pair_shelf.jpg")

# Milliseconds of the paper's table (section "Performance") on an iPhone 11 Pro, 1152 x 1536.
PAPER = {"depth estimation": 230, "depth filter": 51, "connected components": 12, "occluded geometry": 31, "color inpainting": 540,
         "chart generation": 72, "chart padding": 151, "meshing": 11}


def photos():
    """Returns the photos to measure, the sample first."""
    shared = [os.path.join(COMPANIONS, name) for name in OF_SHARED]
    return [SAMPLE] + [photo for photo in shared if os.path.exists(photo)]


def depth_beside(photo):
    """Returns the arguments that name the depth map beside the photo, if any: earlier revisions do not look for it."""
    stem, _ = os.path.splitext(photo)
    return next((["--depth", stem + "_depth" + ending] for ending in (".png", ".jpg") if os.path.exists(stem + "_depth" + ending)), [])


def report_of(program, photo, threads, folder, arguments=()):
    """Runs the program and returns its report, or None if it refuses the photo."""
    report = os.path.join(folder, "report.json")
    models = os.path.join(os.path.dirname(os.path.abspath(program)), "..", "..", "..", "examples", "models")
    ran = subprocess.run(
        [program, photo, "--threads", str(threads), "-o", os.path.join(folder, "out.glb"), "--report", report, "--quiet", *depth_beside(photo),
         *arguments],
        capture_output=True, text=True, env={**os.environ, "LDI_MODELS": models})
    if ran.returncode == 1:
        print(f"{name_of(photo)} left out, because {program} refuses it: {ran.stderr.strip()}", flush=True)
        return None
    if ran.returncode != 0:
        sys.exit(f"{program} {photo} ends with code {ran.returncode}: {ran.stderr.strip()}")
    with open(report, encoding="utf-8") as file:
        facts = json.load(file)
    facts["milliseconds"].pop("total")
    for clock in ("milliseconds", "processor_milliseconds"):  # earlier revisions have British names
        if clock in facts:
            facts[clock] = {stage.replace("colour", "color"): time for stage, time in facts[clock].items()}
    return facts


def stages_of(runs, clock):
    """Returns the median of each stage, in the order in which they ran. clock: "milliseconds" or "processor_milliseconds"."""
    return {stage: statistics.median(run[clock].get(stage, 0) for run in runs) for stage in runs[0][clock]}


def name_of(photo):
    return os.path.basename(photo)


def print_table(header, rows):
    print("\n| " + " | ".join(header) + " |\n|" + "---|" * len(header))
    for row in rows:
        print("| " + " | ".join(row) + " |")


def measure(program, number):
    """Prints the stages of each photo."""
    sums = []
    with tempfile.TemporaryDirectory() as folder:
        for photo in photos():
            runs = {threads: [] for threads in (1, 2)}
            for _ in range(number):  # alternates, so that other load affects both
                for threads, reports in runs.items():
                    reports.append(report_of(program, photo, threads, folder))
            facts = runs[1][0]
            pixels = facts["width"] * facts["height"]
            hidden, peak = 100 * facts["hidden_pixels"] / pixels, max(run["peak_memory_bytes"] for run in runs[1]) / 1e6
            one, two = stages_of(runs[1], "processor_milliseconds"), stages_of(runs[2], "milliseconds")
            print(f"\n{name_of(photo)}, {facts['width']} x {facts['height']}, {hidden:.1f} % hidden, peak {peak:.0f} MB, "
                  f"{1e6 * peak / pixels:.0f} bytes per pixel")
            rows = [[stage, f"{one[stage]:.1f}", f"{two.get(stage, 0):.1f}", str(PAPER.get(stage, ""))] for stage in one]
            sums.append((sum(one.values()), sum(two.values()), hidden, peak))
            rows.append(["sum", f"{sums[-1][0]:.0f}", f"{sums[-1][1]:.0f}", ""])
            print_table(["stage", "one thread, processor time, ms", "two threads, ms", "paper, ms"], rows)
    one, two, hidden, peak = sums[0]
    print(f"\nwhole photo {one:.0f} ms at {hidden:.1f} % hidden, one thread; two threads {two:.0f}; peak {peak:.0f} MB")


def compare(program, other, name, number):
    """Prints, for each photo, the times of this program's stages divided by the other's, and the ratio of the peaks of memory."""
    ratios, pairs, rows, stages = [], [], [], []
    with tempfile.TemporaryDirectory() as folder:
        for photo in photos():
            runs = {program: [], other: []}
            if any(report_of(which, photo, 1, folder) is None for which in (program, other)):
                continue
            for i in range(number):
                for which in (program, other) if i % 2 == 0 else (other, program):
                    runs[which].append(report_of(which, photo, 1, folder))
            clock = "processor_milliseconds" if "processor_milliseconds" in runs[other][0] else "milliseconds"
            here, there = stages_of(runs[program], clock), stages_of(runs[other], clock)
            peaks = [statistics.median(run["peak_memory_bytes"] for run in runs[which]) for which in (program, other)]
            ratios.append(sum(here.values()) / sum(there.values()))
            for pair in zip(runs[program], runs[other]):
                pairs.append(sum(stages_of([pair[0]], clock).values()) / sum(stages_of([pair[1]], clock).values()))
            stages = stages or [stage for stage in there if there[stage] >= 1]  # stages of the other program; this program may lack some of them
            cells = [f"{here.get(s, 0) / there[s]:.2f}" if there.get(s, 0) >= 1 else "" for s in stages]
            rows.append([name_of(photo), *cells, f"{ratios[-1]:.3f}", f"{sum(here.values()):.0f}", f"{sum(there.values()):.0f}",
                         f"{peaks[0] / peaks[1]:.2f}"])
            print(".", end="", flush=True)
    print_table(["photo", *stages, "sum", "here, ms", "there, ms", "peak memory"], rows)
    print(f"\nthis tree takes {statistics.geometric_mean(ratios):.3f} of {name}; single pairs of runs: {min(pairs):.3f} to {max(pairs):.3f}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--beside")
    parser.add_argument("--name", default="the other")
    parser.add_argument("program")
    a = parser.parse_args()
    if a.beside:
        compare(os.path.abspath(a.program), os.path.abspath(a.beside), a.name, a.runs)
    else:
        measure(os.path.abspath(a.program), a.runs)


if __name__ == "__main__":
    main()
