"""Tests the command lines of the worker and of photo3d_queue: invalid options end both with exit code 2 and a message of one line.

    options.py WORKER QUEUE
"""
import os
import re
import subprocess
import sys
import tempfile

from checks import check, finish

WORKER, QUEUE = (os.path.abspath(name) for name in sys.argv[1:3])
DONE, USAGE = 0, 2


def refused(command, words, folder):
    """Runs a program, and checks that it exits with code 2 and prints one line that starts with `words`."""
    name = " ".join([os.path.basename(command[0]), *command[1:]])
    try:
        result = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL)
    except subprocess.TimeoutExpired:
        return check(f"{name}: the program ends within a minute", False)
    check(f"{name}: expected exit code {USAGE}, found {result.returncode}", result.returncode == USAGE, result.stderr)
    check(f"{name}: one line says '{words}'", result.stderr.startswith(f"{os.path.basename(command[0])}: {words}") and result.stderr.count("\n") == 1, result.stderr)


with tempfile.TemporaryDirectory() as top:
    for program in (WORKER, QUEUE):
        said = subprocess.run([program, "--help"], capture_output=True, text=True)
        check(f"{program} --help lists --broker", said.returncode == DONE and "--broker" in said.stdout, said)
    said = subprocess.run([QUEUE, "submit", "--help"], capture_output=True, text=True)
    check("submit --help lists the options of submit", said.returncode == DONE and "--photos-per-message" in said.stdout, said)

    folders = ["--photos", top, "--outputs", top]
    for options, words in (
        ([], "--photos: expected a value (TEXT), found none (photo3d_worker --help lists all options)"),
        ([*folders, "--prefetch", "0"], "--prefetch: expected a whole number, 1 to 1000, found 0 (photo3d_worker --help"),
        ([*folders, "--prefetch", "1.5"], "--prefetch: expected a whole number, 1 to 1000, found 1.5"),
        ([*folders, "--queue"], "--queue: expected a value (TEXT), found none"),
        ([*folders, "--ptohos", "a"], "unknown option --ptohos; did you mean --photos?"),
        ([*folders, "--broker", "amqps://x/"], "--broker: expected amqp://USER:PASSWORD@HOST:PORT/VIRTUAL_HOST, found a different address"),
        ([*folders, "--http", "127.0.0.1:29101zz"], "--http: expected HOST:PORT, found 127.0.0.1:29101zz"),
        *(([*folders, "--http", address], f"--http: expected HOST:PORT, found {address}") for address in ("127.0.0.1", "127.0.0.1:", "[::1]", "127.0.0.1:0", "127.0.0.1:65536", "127.0.0.1:-1")),
        ([*folders, "--", "--fov", "500"], "--fov: expected a number, 5 to 150, found 500 (photo3d --help lists all options)"),
        ([*folders, "--", "--compres"], "unknown option --compres; did you mean --compress?"),
        ([*folders, "--", "--depth", "none", "--depth-scale", "2"], "--depth-scale: expected "),
        ([*folders, "--", "--help"], "options after --: expected neither --help nor --version, found one of them"),
        ([*folders, "--", "me.jpg"], "me.jpg: expected no photo, because messages name the photos, found one"),
        *(([*folders, "--", *option], f"{option[0]}: expected an option of the conversion after --, found one for files or threads, which the worker determines")
          for option in (["--output", "a"], ["--html", "a"], ["--report", "a"], ["--depth", "a"], ["--gallery", "a.html"], ["--skip-existing"], ["--threads", "2"])),
    ):
        refused([WORKER, *options], words, top)
    # The worker accepts the memory limit that its error message names.
    said = subprocess.run([WORKER, *folders, "--", "--memory", "1MB"], capture_output=True, text=True, timeout=60).stderr
    least = re.match("photo3d_worker: --memory: expected at least ([0-9]+MB), which the worker and a small photo need, found 1MB", said)
    check("the worker refuses a memory limit that is too small for every photo", least, said)
    if least:
        worker = subprocess.Popen([WORKER, "--broker", "amqp://127.0.0.1:1", *folders, "--", "--memory", least[1]], stdout=subprocess.PIPE, text=True)
        line = worker.stdout.readline()
        worker.kill()
        worker.communicate()
        check(f"the worker accepts --memory {least[1]}", '"broker lost"' in line, line)
    for options, words in (
        ([], "command line: expected submit or collect, found neither (photo3d_queue --help lists all options)"),
        (["send"], "command line: expected submit or collect, found neither"),
        (["collect", "--dead", "a"], "--results: expected a value ("),
        (["collect", "--results", "a", "--dead", "b", "--expected", "many"], "--expected: expected a whole number, 0 to "),
        (["submit", "--photos-per-message", "65"], "--photos-per-message: expected a whole number, 1 to 64, found 65"),
        (["submit", "--job", ""], "--job: expected 1 to 200 bytes, found 0"),
        (["submit", "--jobb", "a"], "unknown option --jobb; did you mean --job?"),
        (["submit", "--job"], "--job: expected a value (TEXT), found none"),
        (["submit", "more"], "command line: expected no further word, found more"),
    ):
        refused([QUEUE, *options], words, top)
    folder = os.open(top, os.O_RDONLY)
    said = subprocess.run([QUEUE, "submit"], stdin=folder, capture_output=True, text=True, timeout=60)
    os.close(folder)
    check("submit fails if standard input can't be read", said.returncode == 1 and "Is a directory" in said.stderr and said.stdout == "", said)
    check("invalid options cause no files to be written", os.listdir(top) == [])
finish()
