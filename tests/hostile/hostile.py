"""Runs photo3d on every file of a folder, with arguments chosen by the file's name, and checks the promises of SECURITY.md.

    hostile.py PHOTO3D FOLDER SOUND_PHOTO [PATTERN...]
"""
import fnmatch
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor

MAX_SECONDS, MAX_MEGABYTES = 10, 1000
EXIT_CODES = (0, 1, 2)  # 75 (short of memory) is a failure, because every run gets enough memory


def arguments_for(name, hostile, sound):
    """Returns the program's arguments for a file, and the names of files that it may create."""
    kind = name.split("_")[0].split(".")[0]
    if kind in ("depth", "npy", "pfm"):
        return [sound, "--depth", hostile, "-o", "out.glb"], {"out.glb"}
    if kind == "st":
        return [sound, "--inpainting-model", hostile, "-o", "out.glb"], {"out.glb"}
    if kind == "weights":
        return [sound, "--depth-model", hostile, "-o", "out.glb"], {"out.glb"}
    if kind == "keys":
        return [sound, "--video", "out.mp4", "--video-size", "96", "--path", hostile], {"out.mp4"}
    if kind in ("manifest", "manifest2"):
        return ["--batch", hostile, "-o", "results"], {"results"}
    return [hostile, "-o", "out.glb"], {"out.glb"}


# prlimit sets the limits, because code between fork and exec is not safe while other threads run.
LIMITS = ["prlimit", f"--as={6 << 30}", f"--cpu={3 * MAX_SECONDS}", "--core=0"]


def measure(command, folder):
    """Returns exit code (negative: signal), processor seconds, peak megabytes, last line of standard error."""
    with tempfile.TemporaryFile() as said:
        environment = {**os.environ, "TMPDIR": folder}
        process = subprocess.Popen([*LIMITS, *command], cwd=folder, stdout=subprocess.DEVNULL, stderr=said, env=environment)
        deadline = time.monotonic() + 30 * MAX_SECONDS  # ends only endless runs, even on a busy machine
        while True:
            ended, status, used = os.wait4(process.pid, os.WNOHANG)
            if ended:
                break
            if time.monotonic() > deadline:
                process.kill()
            time.sleep(0.005)
        process.returncode = os.waitstatus_to_exitcode(status)
        said.seek(0)
        lines = said.read().decode(errors="replace").strip().splitlines()
    return process.returncode, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, lines[-1] if lines else ""


def faults_of(code, seconds, megabytes, left, allowed):
    if code < 0:
        yield "ended by " + signal.Signals(-code).name
    elif code not in EXIT_CODES:
        yield f"exit code {code}"
    if seconds > MAX_SECONDS:
        yield f"{seconds:.1f} s"
    if megabytes > MAX_MEGABYTES:
        yield f"{megabytes:.0f} MB"
    if left - (allowed if code == 0 else allowed & {"results"}):
        yield "left " + ", ".join(sorted(left))


def run_on(file, program, sound):
    """Runs the program on a file. Returns a line of the table, and whether the run has faults."""
    name, folder = os.path.basename(file), tempfile.mkdtemp()
    try:
        arguments, allowed = arguments_for(name, file, sound)
        code, seconds, megabytes, said = measure([program, *arguments, "--quiet"], folder)
        left = set(os.listdir(folder))
        if "results" in left and os.listdir(os.path.join(folder, "results")):
            left.add("something in results")
        faults = list(faults_of(code, seconds, megabytes, left, allowed))
    finally:
        shutil.rmtree(folder)
    size = os.path.getsize(file) / 1000
    return f"{name:32}{size:8.0f}{code:6}{seconds:7.2f}{megabytes:7.0f}  {'FAILED: ' + '; '.join(faults) if faults else said[:120]}", bool(faults)


def main():
    program, files, sound = (os.path.abspath(path) for path in sys.argv[1:4])
    patterns = sys.argv[4:] or ["*"]
    names = [name for name in sorted(os.listdir(files)) if any(fnmatch.fnmatch(name, pattern) for pattern in patterns)]
    failed = 0
    print(f"{'file':32}{'kB':>8}{'exit':>6}{'s':>7}{'MB':>7}")
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for line, has_faults in pool.map(lambda name: run_on(os.path.join(files, name), program, sound), names):
            print(line, flush=True)
            failed += has_faults
    print(f"\n{len(names) - failed} passed, {failed} failed")
    return 1 if failed or not names else 0


sys.exit(main())
