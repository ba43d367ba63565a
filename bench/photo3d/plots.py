"""Plots the program's time and memory over the size of the photo and over the share of hidden pixels. Needs Debian's
python3-matplotlib.

    plots.py PHOTO3D FOLDER     writes FOLDER/size.png and FOLDER/hidden.png, and prints their points as tables

The first plot shows a phone's photo of 12 megapixels in ../shared, else the sample, which the program shrinks to each size. Reading is
left out, because the file is the same for all sizes. The second plot shows the sample with more and more motion, up to the program's
limit, which uncovers more hidden pixels. Each point is the median of three runs; the runs of all points alternate. "Pixels" are those
of the shrunk photo, without hidden ones."""
import os
import statistics
import sys
import tempfile

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

from stages import COMPANIONS, SAMPLE, report_of  # noqa: E402

RUNS = 3
SIDES = (320, 640, 1024, 1536, 2048, 3072, 4032)
MOTIONS = (0, 0.02, 0.04, 0.08, 0.12, 0.2, 0.3)
STAGES = ("depth filter", "occluded geometry", "color inpainting", "chart generation", "chart padding", "meshing")


def measure(program, photo, arguments_of_points):
    """Returns, per point, the median of each stage in milliseconds of processor time, and the report of the last run."""
    runs = {arguments: [] for arguments in arguments_of_points}
    with tempfile.TemporaryDirectory() as folder:
        for _ in range(RUNS):
            for arguments, reports in runs.items():
                reports.append(report_of(program, photo, 1, folder, arguments))
    return [({stage: statistics.median(report["processor_milliseconds"].get(stage, 0) for report in reports)
              for stage in reports[0]["processor_milliseconds"] if not stage.startswith("reading")}, reports[-1]) for reports in runs.values()]


def draw(x, points, label, file, is_log):
    """Plots the time of each stage and of all stages, and the peak of memory, per pixel of the photo."""
    figure, (times, memory) = plt.subplots(1, 2, figsize=(10, 3.8), dpi=90)
    pixels = [report["width"] * report["height"] for _, report in points]
    for stage in STAGES:
        times.plot(x, [1e6 * stages[stage] / n for (stages, _), n in zip(points, pixels)], "o-", markersize=3, label=stage)
    times.plot(x, [1e6 * sum(stages.values()) / n for (stages, _), n in zip(points, pixels)], "ko-", markersize=4, label="all stages but reading")
    times.set_ylabel("nanoseconds per pixel of the photo, one thread")
    times.legend(fontsize=7)
    memory.plot(x, [report["peak_memory_bytes"] / n for (_, report), n in zip(points, pixels)], "ko-", markersize=4)
    memory.set_ylabel("peak memory, bytes per pixel of the photo")
    for panel in (times, memory):
        panel.set_xlabel(label)
        panel.set_ylim(bottom=0)
        if is_log:
            panel.set_xscale("log")
        panel.grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(file)


def print_table(x, points, label):
    print(f"\n| {label} | all stages but reading, ms | ns per pixel | of which inpainting | hidden and past the frame | peak memory, MB | bytes per pixel |\n|" + "---|" * 7)
    for value, (stages, report) in zip(x, points):
        pixels, total = report["width"] * report["height"], sum(stages.values())
        added = report["hidden_pixels"] + report.get("pixels_past_frame", 0)
        print(f"| {value:.3g} | {total:.0f} | {1e6 * total / pixels:.0f} | {1e6 * stages['color inpainting'] / pixels:.0f} | {100 * added / pixels:.1f} % | "
              f"{report['peak_memory_bytes'] / 1e6:.0f} | {report['peak_memory_bytes'] / pixels:.0f} |")


def main():
    program, folder = os.path.abspath(sys.argv[1]), sys.argv[2]
    large = os.path.join(COMPANIONS, "iphone_mpo_a.jpg")
    photo = large if os.path.exists(large) else SAMPLE
    points = measure(program, photo, [("--size", str(side), "--geometry-size", str(side)) for side in SIDES])
    megapixels = [report["width"] * report["height"] / 1e6 for _, report in points]
    draw(megapixels, points, "megapixels of the photo", os.path.join(folder, "size.png"), True)
    print_table(megapixels, points, "megapixels")
    points = measure(program, SAMPLE, [("--motion", str(motion)) for motion in MOTIONS])
    shares = [100 * report["hidden_pixels"] / (report["width"] * report["height"]) for _, report in points]
    draw(shares, points, "hidden pixels, % of the photo's pixels", os.path.join(folder, "hidden.png"), False)
    print_table(shares, points, "hidden pixels, %")


main()
