"""Takes the measurements of bench/batch/run.sh.

    batch.py PHOTO3D FOLDER_OF_PHOTOS NUMBER
"""
import json
import os
import random
import resource
import shutil
import subprocess
import sys
import tempfile
import time

PROGRAM, FOLDER, NUMBER = os.path.abspath(sys.argv[1]), sys.argv[2], int(sys.argv[3])
MEMORY_MB = 250  # enough for two photographs of half a megapixel, but not for many
passed = failed = 0


def check(name, is_good):
    global passed, failed
    passed, failed = passed + bool(is_good), failed + (not is_good)
    print(("passed: " if is_good else "FAILED: ") + name, flush=True)


def content(folder):
    return {name: open(os.path.join(folder, name), "rb").read() for name in os.listdir(folder)}


def seconds_of(command, **how):
    before, begin = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    result = subprocess.run(command, capture_output=True, **how)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return result, time.monotonic() - begin, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main():
    every = sorted(name for name in os.listdir(FOLDER) if name.endswith(".jpg"))
    step = max(len(every) / NUMBER, 1)
    photos = [os.path.join(FOLDER, every[int(i * step)]) for i in range(min(NUMBER, len(every)))]
    text = "".join(json.dumps(photo) + "\n" for photo in photos).encode()
    with tempfile.TemporaryDirectory() as work:
        folder = {name: os.path.join(work, name) for name in ("loop", "batch", "one core", "bound", "reports", "kills")}
        os.mkdir(folder["loop"])

        loop = 'while read -r photo; do name=${photo##*/}; "$0" "$photo" -o "$1/${name%.*}.glb" --quiet; done'
        _, loop_seconds, loop_work = seconds_of(["bash", "-c", loop, PROGRAM, folder["loop"]], input="\n".join(photos).encode() + b"\n")
        batch = lambda *arguments: [PROGRAM, "--batch", "-", *arguments]
        result, seconds, work_seconds = seconds_of(batch("-o", folder["batch"]), input=text)
        lines = [json.loads(line) for line in result.stdout.splitlines()]
        print(f"{len(photos)} photographs, {os.cpu_count()} cores: one by one {len(photos) / loop_seconds:.1f} per second ({loop_work / len(photos) * 1000:.0f} ms of processor time each), "
              f"in a batch {len(photos) / seconds:.1f} ({work_seconds / len(photos) * 1000:.0f} ms)")
        one_core = {min(os.sched_getaffinity(0))}
        _, alone, _ = seconds_of(batch("-o", folder["one core"]), input=text, preexec_fn=lambda: os.sched_setaffinity(0, one_core))
        print(f"in a batch on one core {len(photos) / alone:.1f} per second: {os.cpu_count()} cores are {alone / seconds:.2f} times as fast")
        shares = sorted(line["hidden_share"] for line in lines if "hidden_share" in line)
        print(f"hidden shares: median {shares[len(shares) // 2]:.3f}, largest {shares[-1]:.3f}")
        check(f"the batch is {loop_seconds / seconds:.2f} times as fast as the loop (required: 1.6)", loop_seconds >= 1.6 * seconds)
        expected = content(folder["loop"])
        check("the batch converts every photo", result.returncode == 0 and len(lines) == len(expected) == len(photos))
        check("the files of the batch on one core equal those of the loop byte for byte", content(folder["one core"]) == expected)
        check("the files of the batch equal those of the loop byte for byte", content(folder["batch"]) == expected)

        result, seconds, _ = seconds_of(batch("-o", folder["bound"], "--report", folder["reports"], "--memory", f"{MEMORY_MB}MB", "--threads", "8"), input=text)
        peak = max(json.loads(report)["peak_memory_bytes"] for report in content(folder["reports"]).values()) / 1e6
        check(f"with --memory {MEMORY_MB}MB and 8 threads the peak is {peak:.0f} MB, at {len(photos) / seconds:.1f} photographs per second", result.returncode == 0 and peak <= MEMORY_MB)
        check("the files of the run with --memory equal those of the loop byte for byte", content(folder["bound"]) == expected)

        random.seed(3)
        converted, kills = [], 0
        full = seconds_of(batch("-o", folder["kills"]), input=text)[1]
        shutil.rmtree(folder["kills"])
        while True:
            process = subprocess.Popen(batch("-o", folder["kills"], "--skip-existing"), stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            if kills < 10:
                try:
                    said, _ = process.communicate(text, timeout=random.uniform(0, full / 6))
                except subprocess.TimeoutExpired:
                    process.kill()
                    said, _ = process.communicate()
                    kills += 1
            else:
                said, _ = process.communicate(text)
            lines = [json.loads(line) for line in said.splitlines() if line.endswith(b"}")]
            converted += [line["photo"] for line in lines if "skipped" not in line]
            if process.returncode == 0:
                break
        check(f"after {kills} kills, the output lists {len(converted)} converted photos, none twice", len(converted) == len(set(converted)) and kills > 0)
        check("the folder has every photo's file, equal to that of the loop, and no other file", content(folder["kills"]) == expected)
    print(f"{passed} passed, {failed} failed")
    return 1 if failed else 0


sys.exit(main())
