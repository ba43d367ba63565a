"""Tests the command line of photo3d: its arguments and messages. Also tests that the program loses no file, however it ends, and
leaves no temporary file, unless SIGKILL ends it.

    manners.py PHOTO3D SOURCE_DIR [KILLS]

KILLS (default 24): number of kills at random times.
"""
import base64
import json
import os
import random
import re
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import time

from checks import check, finish
from files import is_whole_glb, png

PROGRAM, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
KILLS = int(sys.argv[3]) if len(sys.argv) > 3 else 24
DONE, NEVER, USAGE, TRY_AGAIN = 0, 1, 2, 75
VIEWER = b"1<title>3D photo</title>2<!-- the photo goes here -->3"


PHOTO = png(60, 80, 3, lambda y: bytes(60 + 120 * ((x // 5 + y // 5) % 2) for x in range(60) for _ in range(3)))
DEPTH = png(60, 80, 1, lambda y: bytes(40 if x < 30 else 200 for x in range(60)))


class folder_of_files:
    """A working folder of the program with a photo, its depth map and a viewer."""

    def __enter__(self):
        self.path = tempfile.mkdtemp()
        for name, content in (("me.png", PHOTO), ("depth.png", DEPTH), ("viewer.html", VIEWER)):
            self.write(name, content)
        self.given = set(os.listdir(self.path))
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.path, ignore_errors=True)

    def __truediv__(self, name):
        return os.path.join(self.path, name)

    def write(self, name, content=b"old"):
        with open(self / name, "wb") as out:
            out.write(content)

    def read(self, name):
        with open(self / name, "rb") as there:
            return there.read()

    def made(self):
        return sorted(set(os.listdir(self.path)) - self.given)

    def state(self):
        """Returns the content of every file in the folder, by path."""
        state = {}
        for folder, folders, names in os.walk(self.path):
            for name in folders + names:
                path = os.path.join(folder, name)
                content = os.readlink(path) if os.path.islink(path) else open(path, "rb").read() if os.path.isfile(path) else "folder"
                state[os.path.relpath(path, self.path)] = content
        return state

    def command(self, *arguments):
        return [PROGRAM, *arguments, "--depth", "depth.png", "--inpaint", "diffusion"]

    def run(self, *arguments, quiet=True, stdout=subprocess.PIPE, **how):
        return subprocess.run(self.command(*arguments, *(["--quiet"] if quiet else [])), cwd=self.path, stdout=stdout, stderr=subprocess.PIPE, timeout=120, **how)


def expect(name, folder, arguments, code, words=(), made=None, quiet=True, **how):
    """Runs the program, and checks its exit code, the words of its message, and its files.

    made: files that exist afterwards in addition to the given ones; None: the run must change nothing.
    """
    before = folder.state()
    result = folder.run(*arguments, quiet=quiet, **how)
    said = result.stderr.decode(errors="replace")
    check(f"{name}: expected exit code {code}, found {result.returncode}", result.returncode == code, said)
    check(f"{name}: the message has the expected words", all(word in said for word in words), said)
    if made is None:
        check(f"{name}: no file is changed", folder.state() == before)
    else:
        check(f"{name}: the run writes exactly the expected files, found {folder.made()}", folder.made() == sorted(made))
    return result


def first_words():
    version = subprocess.run([PROGRAM, "--version"], capture_output=True, text=True)
    check("--version prints the name and the version", version.returncode == DONE and version.stdout.startswith("photo3d ") and version.stdout.count(".") == 2)
    help_text = subprocess.run([PROGRAM, "--help"], capture_output=True, text=True).stdout
    check("--help explains exit codes other than 0", "Without --batch, any code but 0 means that no file was written" in " ".join(help_text.split()))
    options = set(re.findall(r"--[a-z][a-z0-9-]+", help_text))
    for kind, lines in (("man", (".TH PHOTO3D 1", ".SH EXIT STATUS")), ("bash", ("complete ",)), ("zsh", ("#compdef photo3d",)), ("fish", ("complete -c photo3d",))):
        text = subprocess.run([PROGRAM, "--generate", kind], capture_output=True, text=True).stdout
        plain = text.replace("\\-", "-").replace(" -l ", " --")
        missing = {name for name in options - {"--generate"} if name not in plain}
        check(f"{kind} names every option: missing {missing}", not missing and len(options) > 20 and all(line in text for line in lines))
        check(f"{kind} contains no path of the machine that built it", SOURCE not in text and "/build/" not in text)
        if kind == "man":
            check("the manual lists PHOTO under Input", re.search(r"\.SS Input\n\.TP\n\.I PHOTO\n", text) and text.index(".SS Input") < text.index(".SS Output"))
            check("the manual has the same synopsis as --help", ".B photo3d\n.RI [ OPTION ...]\n.IR PHOTO ...\n" in text and "\nUsage: photo3d [OPTION...] PHOTO...\n" in help_text)
            check("the manual states what relative paths are relative to", plain.count("../share/ldi/") == plain.count(" (relative to the program)") == 2)
        if kind != "man" and shutil.which(kind):
            check(f"{kind} parses its completion script", subprocess.run([kind, "-n"], input=text, text=True, capture_output=True).returncode == 0)
    for option in ("-h", "--help", "--version", "--generate man", "--generate bash", "--generate zsh", "--generate fish"):
        read, closed = os.pipe()
        os.close(read)
        for output, place in (("a pipe without a reader", closed), ("a full device", os.open("/dev/full", os.O_WRONLY))):
            # restore_signals: as in a shell, SIGPIPE ends the program by default; Python ignores the signal.
            result = subprocess.run([PROGRAM, *option.split()], stdout=place, stderr=subprocess.PIPE, restore_signals=True)
            os.close(place)
            check(f"{option} into {output} fails with a message, exit code {result.returncode}", result.returncode == TRY_AGAIN and b"photo3d: standard output: expected a writable output, found " in result.stderr, result.stderr)


def names():
    with folder_of_files() as f:
        result = expect("a photo alone", f, ["me.png", "--viewer", "viewer.html"], DONE, made=["me.glb", "me.html"])
        check("a photo alone: GLB and page are complete", is_whole_glb(f.read("me.glb")) and b"model/gltf-binary" in f.read("me.html"))
        expect("the same command again", f, ["me.png", "--viewer", "viewer.html"], DONE, made=["me.glb", "me.html"])
        f.write("me.html", b"another's page")
        expect("an existing page that the program did not write", f, ["me.png", "--viewer", "viewer.html"], USAGE, ["me.html", "--html"])
    with folder_of_files() as f:
        result = expect("messages about written files", f, ["me.png", "-o", "a.glb", "--html", "a.html", "--viewer", "viewer.html", "--report", "a.json"], DONE, made=["a.glb", "a.html", "a.json"], quiet=False)
        end = result.stdout.decode().rstrip().splitlines()[-3:]
        stages, table = result.stderr.decode(), result.stdout.decode()
        check("each stage and the total are printed once", all((stages + table).count(name) == 1 for name in ("reading photo", "connected components", "encoding ", "\ntotal ")) and "reading photo" in stages and "\ntotal " in table, stages + table)
        with_network = subprocess.run([PROGRAM, "me.png", "--depth", "depth.png", "-o", "b.glb"], cwd=f.path, capture_output=True, text=True).stderr
        check("durations are printed in one column, even with networks", len({line.rindex(" ms") for line in with_network.splitlines() if line.endswith(" ms")}) == 1, with_network)
        os.remove(f / "b.glb")
        check("the last lines name the written files and what opens them", [line.split()[:2] for line in end] == [["writes", name] for name in ("a.html", "a.glb", "a.json")] and "browser" in end[0], end)
        for name in ("a.glb", "a.html", "a.json"):
            os.remove(f / name)
        os.mkdir(f / "photo-3d")
        f.write("photo-3d/photo-3d.js", b"the element")
        expect("--embed without a page", f, ["me.png", "-o", "a.glb", "--embed"], USAGE, ["--html"])
        f.given.add("photo-3d")
        expect("--embed", f, ["me.png", "--html", "a b.html", "--embed", "--viewer", "viewer.html"], DONE, made=["a b.html", "a b.glb", "a b.poster.jpg", "photo-3d.js"])
        page = f.read("a b.html").decode()
        check("--embed writes a page with the lines to copy", "src=&quot;a%20b.glb&quot; poster=&quot;a%20b.poster.jpg&quot; width=&quot;" in page, page[-2000:])
        check("--embed: the files", is_whole_glb(f.read("a b.glb")) and f.read("a b.poster.jpg")[:2] == b"\xff\xd8" and f.read("photo-3d.js") == b"the element")
        for name in ("a b.html", "a b.glb", "a b.poster.jpg", "photo-3d.js"):
            os.remove(f / name)
        result = expect("no viewer", f, ["me.png", "--viewer", "none.html"], DONE, ["examples/viewer/build.sh"], made=["me.glb"], quiet=False)
        check("without a terminal, no carriage return is printed", b"\r" not in result.stderr + result.stdout)
        os.mkdir(f / "fr")
        f.write("fr/frame_00002.png")
        f.given.add("fr")
        for name, arguments, words in (
            ("an empty name", ["me.png", "-o", ""], ["--output"]),
            ("an empty depth model", ["me.png", "--depth-model", ""], ["--depth-model: expected a name"]),
            ("an empty inpainting model", ["me.png", "--inpainting-model", ""], ["--inpainting-model: expected a name"]),
            ("an empty silhouette model", ["me.png", "--silhouette-model", ""], ["--silhouette-model: expected a name"]),
            ("text glTF", ["me.png", "-o", "a.gltf"], ["a.gltf", ".glb"]),
            ("a field of view out of range", ["me.png", "--fov", "4.5"], ["--fov", "5 to 150"]),
            ("a field of view that is not a number", ["me.png", "--fov", "nan"], ["--fov"]),
            ("a folder with frames of a longer video", ["me.png", "--video", "fr", "--seconds", "0.25", "--fps", "4"], ["fr: expected a folder without frames of a longer video, found frame_00002.png"]),
            ("an unsupported kind of video", ["me.png", "--video", "a.mov"], ["a.mov", ".mp4"]),
            ("two outputs to standard output", ["me.png", "-o", "-", "--html", "-", "--viewer", "viewer.html"], ["standard output"]),
            ("no photo", [], ["PHOTO: expected at least one, found none", "usage: photo3d"]),
            ("two photos", ["me.png", "depth.png"], ["PHOTO: expected one photo, found 2", "--batch"]),
            ("a photo and a folder", ["me.png", "."], [".: expected a photo, found a folder"]),
            ("an option with an empty value", ["me.png", "--fov", ""], ["--fov: expected a number, 5 to 150, found an empty text"]),
            ("an option twice", ["me.png", "--fov", "20", "--fov", "30"], ["--fov: expected one value, found 2"]),
            ("a flag with a value", ["me.png", "--no-soft-edges=much"], ["--no-soft-edges: expected no value, true or false, found much"]),
            ("an option without the one that it requires", ["me.png", "--video-size", "100"], ["--video-size: expected --video beside it, found none"]),
            ("two options that exclude each other", ["me.png", "--depth-model", "depth.png"], ["--depth: expected no --depth-model beside it, found both"]),
            ("a fraction for a whole number", ["me.png", "--quality", "85.5"], ["--quality: expected a whole number, 1 to 100, found 85.5"]),
            ("a fraction of a pixel", ["me.png", "--size", "100.5"], ["--size: expected full or a whole number, 16 to 16384, found 100.5"]),
            ("a number of threads that is too large", ["me.png", "--threads", "1025"], ["--threads: expected a whole number, 0 to 1024, found 1025"]),
            ("a scale that is not a number", ["me.png", "--depth-scale", "abc"], ["--depth-scale: expected a positive number, found abc"]),
            ("a scale of 0", ["me.png", "--depth-scale", "0"], ["--depth-scale: expected a positive number, found 0"]),
            ("a scale that is not finite", ["me.png", "--depth-scale", "inf"], ["--depth-scale: expected a positive number, found inf"]),
            *((f"a memory limit of {size}", ["--batch", "me.png", f"--memory={size}"], [f"--memory: expected a size above 0 such as 500MB or 2GB, found {size}"]) for size in ("-5", "-5GB", "0", "0.0GB", "much", "GB", "5XB", "5i", "1.2.3GB", "nan", "1e9", "10000000000GB")),
            ("an empty memory limit", ["--batch", "me.png", "--memory", ""], ["--memory: expected a size above 0", "an empty text"]),
            ("an unknown word for an option", ["me.png", "--frame", "large"], ["--frame", "expected crop or grow, found large"]),
            ("an unknown option", ["me.png", "--hlep"], ["unknown option --hlep", "--help"]),
            ("another unknown option", ["--ouptut=a.glb"], ["unknown option --ouptut", "--output"]),
            ("an unsupported kind of model", ["me.png", "-o", "a.obj"], ["a.obj", ".glb"]),
            ("a model without a file name extension", ["me.png", "-o", "a"], ["a name that ends in .glb", "found no ending"]),
            ("a page that is named .txt", ["me.png", "--html", "page.txt", "--viewer", "viewer.html"], ["page.txt", ".html"]),
            ("a depth map in a lossy format", ["me.png", "--depth-map", "map.jpg"], ["map.jpg", ".png"]),
            ("a folder as a photo", ["."], ["a folder", "--batch"]),
            ("an unknown format", ["me.png", "-o", "a.glb", "--formats", "jpeg,exe"], ["--formats", "jpeg, png", "jpeg,exe"]),
        ):
            said = expect(name, f, arguments, USAGE, words).stderr
            check(f"{name}: the message is one line of photo3d", said.startswith(b"photo3d: ") and said.count(b"\n") == 1, said)
        for option, words in (("--fov", "--fov: expected a value (NUMBER, 5 to 150), found none"), ("-o", "--output: expected a value (FILE), found none"), ("--generate", "--generate: expected man, bash, zsh or fish, found none")):
            result = subprocess.run([PROGRAM, "me.png", option], cwd=f.path, capture_output=True, text=True)
            check(f"{option} without a value is refused", result.returncode == USAGE and words in result.stderr, result.stderr)
        expect("a disabled format", f, ["me.png", "-o", "a.glb", "--formats", "jpeg,heif"], NEVER, ["me.png", "an enabled format: jpeg, heif"])
        expect("enabled formats", f, ["me.png", "-o", "b.glb", "--formats", "png"], DONE, made=["b.glb", "me.glb"])
        os.remove(f / "b.glb")
        said = expect("a missing photo", f, ["you.png", "-o", "a.glb"], NEVER, ["you.png: expected a photo, found no such file"]).stderr
        check("a missing photo: the system's message is not printed", b"No such file" not in said, said)
        f.write("text.png", b"hello")
        for photo in ("you.png", "text.png"):  # refused before reading the networks, one of which is invalid
            result = subprocess.run([PROGRAM, photo, "--depth", "depth.png", "--inpainting-model", "viewer.html", "-o", "a.glb", "--quiet"], cwd=f.path, capture_output=True, text=True)
            check(f"{photo} is refused before invalid weights are read", result.returncode == NEVER and photo in result.stderr and "viewer.html" not in result.stderr, result.stderr)
        os.remove(f / "text.png")
        # Inputs that can't be used are refused before any work, which the program would report without --quiet.
        for arguments, words in (
            (["me.png", "you.png"], "you.png: expected a photo, found no such file"),
            (["me.png", "--depth", "you.png"], "you.png: expected a depth map, found no such file"),
            (["me.png", "--depth", "empty"], "empty: expected a depth map, found a folder"),
            (["me.png", "--depth-model", "none"], "none: expected weights of the depth network, found no such file"),
            (["me.png", "--depth-model", "empty"], "empty/tiefenrausch.pb: expected weights of the depth network, found no such file"),
            (["me.png", "--inpainting-model", "none.safetensors"], "none.safetensors: expected weights of the inpainting network, found no such file"),
            (["me.png", "--inpainting-model", "empty"], "empty: expected weights of the inpainting network, found a folder"),
            (["me.png", "--silhouette-model", "no"], "no: expected weights of the silhouette network, found no such file"),
            (["me.png", "--silhouette-model", "empty"], "empty: expected weights of the silhouette network, found a folder"),
            (["me.png", "--html", "a.html", "--viewer", "no.html"], "no.html: expected the viewer, found no such file"),
            (["me.png", "--html", "a.html", "--viewer", "empty"], "empty: expected a readable file, found a folder"),
            (["me.png", "--video", "v", "--path", "keys.json"], "keys.json: expected a readable file, found no such file"),
            (["me.png", "--video", "v", "--path", "empty"], "empty: expected a readable file, found a folder"),
            (["--batch", "me.png", "--inpainting-model", "empty"], "empty: expected weights of the inpainting network, found a folder"),
            (["--batch", "me.png", "--depth-model", "none"], "none: expected weights of the depth network, found no such file"),
            (["--batch", "me.png", "--depth", "none-such"], "none-such: expected a folder of depth maps, as --batch requires, found no such folder"),
            (["--batch", "me.png", "--depth", "me.png"], "me.png: expected a folder of depth maps, as --batch requires, found a file"),
            (["--batch", "me.png", "-o", "depth.png"], "depth.png: expected a folder, as --batch requires, found a file"),
        ):
            os.makedirs(f / "empty", exist_ok=True)
            before = f.state()
            result = subprocess.run([PROGRAM, *arguments, *([] if "--html" in arguments else ["--viewer", "viewer.html"])], cwd=f.path, capture_output=True, text=True)
            check(f"{arguments}: exit code {result.returncode}", result.returncode == NEVER and result.stdout == "" and f.state() == before, result.stdout)
            check(f"{arguments}: one line says '{words}'", result.stderr.startswith(f"photo3d: {words}") and result.stderr.count("\n") == 1, result.stderr)
        os.rmdir(f / "empty")
        for arguments, words in (
            (["--depth", "none", "--depth-scale", "2"], "--depth-scale: expected no --depth none beside it, found both"),
            (["--depth", "depth.png", "--depth-kind", "meters", "--depth-near-is-black"], "--depth-near-is-black: expected no --depth-kind meters beside it, found both"),
            (["--depth", "depth.png", "--depth-kind", "meters", "--depth-is-inverse"], "--depth-is-inverse: expected no --depth-kind meters beside it, found both"),
            (["--inpaint", "diffusion", "--inpainting-model", "a.safetensors"], "--inpainting-model: expected no --inpaint diffusion beside it, found both"),
            (["--inpaint", "diffusion", "--arithmetic", "int8"], "--arithmetic: expected no --inpaint diffusion beside it, found both"),
            (["--depth", "depth.png", "--depth-scale", "0.001"], "--depth-scale: expected --depth-kind meters beside it, found disparity"),
            (["--depth", "depth.png", "--depth-is-inverse", "--depth-scale", "2"], "--depth-scale: expected --depth-kind meters beside it, found disparity"),
            (["--usdz", "a.usdz", "--compress"], "--compress: expected -o or --html beside it, found neither"),
            (["--depth-map", "a.png", "--compress", "--compressed-texture", "jpeg"], "--compress: expected -o or --html beside it, found neither"),
            (["--depth-map", "a.png", "--quality", "10"], "--quality: expected -o, --html, --usdz, or --stereo-image in JPEG beside it, found none"),
            (["--stereo-image", "a.PNG", "--video", "a.mp4", "--quality", "10"], "--quality: expected -o, --html, --usdz, or --stereo-image in JPEG beside it, found none"),
        ):
            result = subprocess.run([PROGRAM, "me.png", *arguments], cwd=f.path, capture_output=True, text=True)
            check(f"{arguments}: {result}", result.returncode == USAGE and result.stderr.startswith(f"photo3d: {words}") and result.stdout == "")
        for arguments, made in ((["--usdz", "a.usdz", "--quality", "10"], ["a.usdz"]), (["--stereo-image", "a.jps", "--quality", "10"], ["a.jps"])):
            expect(f"{arguments} have an effect", f, ["me.png", *arguments], DONE, made=["me.glb", *made] if "me.glb" in f.made() else made)
            os.remove(f / made[0])
        expect("a missing folder and an invalid output name", f, ["me.png", "-o", "no/such/a.glb", "--html", "no/page.txt"], USAGE, ["page.txt"])
        expect("a missing folder below a file", f, ["me.png", "-o", "depth.png/no/a.glb"], NEVER, ["depth.png", "expected"])
        expect("missing folders", f, ["me.png", "-o", "no/such/a.glb"], DONE, made=["me.glb", "no"])
        check("missing folders: the GLB is complete", is_whole_glb(f.read("no/such/a.glb")))
        shutil.rmtree(f / "no")
        expect("a folder as a report", f, ["me.png", "-o", "a.glb", "--report", "."], NEVER, ["folder"])
        expect("a file as the folder of stages", f, ["me.png", "--stages", "depth.png"], NEVER, ["depth.png"])
        said = expect("control characters in a name", f, ["a\x1b[31m\nb.png", "-o", "a.glb"], NEVER, ["a\\x1B[31m\\x0Ab.png"]).stderr
        check("control characters in a name: the message is one line", said.count(b"\n") == 1 and b"\x1b" not in said)
        expect("a field of view with half a degree", f, ["me.png", "--fov", "26.5", "-o", "a.GLB"], DONE, made=["a.GLB", "me.glb"])
    with folder_of_files() as f:
        through = f.run("-", "-o", "-", input=PHOTO)
        check("a photo from standard input is converted to standard output", through.returncode == DONE and is_whole_glb(through.stdout) and not f.made())
        through = f.run("-", input=PHOTO)
        check("without -o, a photo from standard input is converted to standard output", is_whole_glb(through.stdout) and not f.made())
        with open(f / "me.png", "rb") as photo:
            result = subprocess.run(f.command("-", "-o", "me.png"), cwd=f.path, stdin=photo, capture_output=True)
        check("an output to the file that is read as standard input is refused", result.returncode == USAGE and f.read("me.png") == PHOTO)
        report = f.run("me.png", "-o", "a.glb", "--report", "-")
        check("a report can be written to standard output", json.loads(report.stdout)["width"] == 60)
        odd = os.fsdecode(b"d\xff.png")
        shutil.copy(f / "depth.png", f / odd)
        result = subprocess.run([PROGRAM, "me.png", "--depth", odd, "--quiet", "-o", "a.glb", "--report", "odd.json"], cwd=f.path, capture_output=True)
        check("a depth map whose name is not UTF-8 is read", result.returncode == DONE and json.loads(f.read("odd.json"))["width"] == 60, result.stderr)


def start_script():
    """Runs examples/photo3d/run.sh with a program that only prints its output paths."""
    script = os.path.join(SOURCE, "examples/photo3d/run.sh")
    usage = subprocess.run([script, "--help"], capture_output=True, text=True)
    check("run.sh --help prints the usage", usage.returncode == DONE and "usage: " in usage.stdout and usage.stderr == "", usage)
    check("run.sh refuses the unknown option --hlep", subprocess.run([script, "--hlep"], capture_output=True).returncode == USAGE)
    with tempfile.TemporaryDirectory() as top:
        def write(name, text):
            path = os.path.join(top, name)
            os.makedirs(os.path.dirname(path), exist_ok=True)
            with open(path, "w") as out:
                out.write(text)
            os.chmod(path, 0o755)
            return path

        copy = write("examples/photo3d/run.sh", open(script).read())
        write("scripts/requirements.sh", "needs_build=() needs_io=() needs_photo3d=()\nrequire() { :; }\n")
        write("examples/viewer/build.sh", "#!/bin/sh\nexit 1\n")
        write("tools/cmake", "#!/bin/sh\n")
        write("build/photo3d/examples/photo3d", '#!/bin/sh\nprintf "%s\\n" "$1" >"$3"\n')
        photos = [write(name, "") for name in ("a/me.jpg", "b/me.jpg", "b/me.png")]
        made = []
        for photo in [*photos, *photos]:
            result = subprocess.run([copy, photo], capture_output=True, text=True, env={**os.environ, "PATH": os.path.join(top, "tools") + ":" + os.environ["PATH"]})
            check(f"run.sh converts {photo}", result.returncode == DONE, result.stderr)
            made.append(result.stdout.splitlines()[-1])
        check(f"photos with the same name get different files, and the same photo gets the same files again: {made}", len(set(made)) == 3 and made[:3] == made[3:])
        check("each of these files belongs to its photo", [open(name).read().strip() for name in made[:3]] == photos)
        check("for a folder, run.sh recommends --batch", "--batch" in subprocess.run([copy, top], capture_output=True, text=True).stderr)


def key_frames():
    good = '{"time": 0, "position": [0, 0, 0], "target": [0, 0, -2]}'
    with folder_of_files() as f:
        for name, text, words in (
            ("no JSON", "[" + good + ",\n\n x]", ["line 3", "column 2"]),
            ("no list", good, ["not a list"]),
            ("an empty list", "[]", ["empty list"]),
            ("a number", "[3]", ["key frame 1", "a number"]),
            ("lists in lists", "[" * 500_000 + "]" * 500_000, ["nested"]),
            ("a list for a number", '[{"time": %s, "position": [0, 0, 0], "target": [0, 0, -2]}]' % ("[" * 100_000 + "]" * 100_000), ["nested"]),
            ("no target", '[%s, {"time": 1, "position": [0, 0, 0]}]' % good, ["key frame 2", "target", "none"]),
            ("two numbers", '[{"time": 0, "position": [0, 0], "target": [0, 0, -2]}]', ["position", "three numbers"]),
            ("text for a number", '[{"time": "0", "position": [0, 0, 0], "target": [0, 0, -2]}]', ["a number in \"time\", found a string"]),
            ("times that do not increase", "[%s, %s]" % (good, good), ["key frame 2", "increasing times"]),
            ("a zoom of 0", '[{"time": 0, "position": [0, 0, 0], "target": [0, 0, -2], "zoom": 0}]', ["zoom", "found 0 ("]),
            ("times that decrease slightly", '[{"time": 1e-9, "position": [0, 0, 0], "target": [0, 0, -2]}, %s]' % good, ["found 1e-09, then 0 ("]),
            ("numbers too large for floats", '[{"time": 0, "position": [0, 0, 1e300], "target": [0, 0, -2]}]', ["position"]),
        ):
            f.write("keys.json", text.encode())
            said = expect(name, f, ["me.png", "--video", "frames", "--path", "keys.json"], NEVER, ["keys.json", *words]).stderr
            check(f"{name}: the message is not that of the JSON library", b"json.exception" not in said and b"[json" not in said)


def outputs_that_are_inputs():
    with folder_of_files() as f:
        os.symlink("me.png", f / "link.glb")
        os.link(f / "me.png", f / "twin.glb")
        os.symlink("absent.glb", f / "dangling.glb")
        f.write("keys.json", b'[{"time": 0, "position": [0, 0, 0], "target": [0, 0, -2]}]')
        for name in ("me.png", "link.glb", "twin.glb", "../" + os.path.basename(f.path) + "/me.png", "depth.png", "viewer.html"):
            expect(f"-o {name}", f, ["me.png", "-o", name, "--viewer", "viewer.html"], USAGE, ["same file"])
        expect("a page that would overwrite the photo", f, ["me.png", "--html", "me.png", "--viewer", "viewer.html"], USAGE, ["same file"])
        expect("a report that would overwrite the depth map", f, ["me.png", "-o", "a.glb", "--report", "depth.png"], USAGE, ["same file"])
        expect("an output depth map that would overwrite the input depth map", f, ["me.png", "--depth-map", "depth.png"], USAGE, ["same file"])
        expect("a report that would overwrite the key frames", f, ["me.png", "--video", "v", "--path", "keys.json", "--report", "keys.json"], USAGE, ["same file"])
        expect("two outputs with the same name", f, ["me.png", "-o", "a.glb", "--report", "a.glb"], USAGE, ["same file"])
        expect("two outputs with different names of the same file", f, ["me.png", "-o", "dangling.glb", "--report", "absent.glb"], USAGE, ["same file"])
        os.mkdir(f / "frames")
        os.rename(f / "me.png", f / "frames/frame_00001.png")
        expect("frames that would overwrite the photo", f, ["frames/frame_00001.png", "--video", "frames", "--seconds", "0.2", "--fps", "5"], USAGE, ["same file"])


def what_is_kept():
    with folder_of_files() as f:
        os.mkdir(f / "real")
        f.write("real/a.glb"), f.write("b.glb"), f.write("c.glb")
        os.symlink("real/a.glb", f / "a.glb")
        os.link(f / "b.glb", f / "other.glb")
        os.chmod(f / "c.glb", 0o640)
        for name in ("a.glb", "b.glb", "c.glb"):
            check(f"the program writes {name}", f.run("me.png", "-o", name).returncode == DONE)
        check("an output that is a symbolic link is written to the link's target", os.path.islink(f / "a.glb") and is_whole_glb(f.read("real/a.glb")))
        check("hard links are kept", os.path.samefile(f / "b.glb", f / "other.glb") and is_whole_glb(f.read("other.glb")))
        check("permissions are kept", stat.S_IMODE(os.stat(f / "c.glb").st_mode) == 0o640 and is_whole_glb(f.read("c.glb")))
        check(f"no other files are written, found {f.made()}", f.made() == ["a.glb", "b.glb", "c.glb", "other.glb", "real"] and os.listdir(f / "real") == ["a.glb"])
        if os.geteuid() != 0:  # root can write everywhere
            os.chmod(f / "c.glb", 0o440)
            expect("a protected file", f, ["me.png", "-o", "c.glb"], NEVER, ["c.glb", "protected"])
    with folder_of_files() as f:
        # The last output fails, so the program writes none.
        for name in ("a.glb", "a.html"):
            f.write(name)
        everything = ["me.png", "-o", "a.glb", "--html", "a.html", "--viewer", "viewer.html", "--stages", "stages", "--depth-map", "map.png"]
        expect("a full disk", f, [*everything, "--report", "/dev/full"], TRY_AGAIN, ["/dev/full"])
        with open("/dev/full", "w") as full:
            expect("a table of durations that can't be printed", f, ["me.png", "-o", "a.glb"], TRY_AGAIN, ["photo3d: standard output: "], quiet=False, stdout=full)
        read, write = os.pipe()
        os.close(read)
        expect("a table of durations without a reader", f, ["me.png", "-o", "a.glb"], TRY_AGAIN, ["photo3d: standard output: "], quiet=False, stdout=write)
        os.close(write)
        tools = f / "tools"
        os.mkdir(tools)
        with open(os.path.join(tools, "ffmpeg"), "w") as tool:
            tool.write("#!/bin/sh\nhead -c 1000 >/dev/null\nexit 1\n")
        os.chmod(os.path.join(tools, "ffmpeg"), 0o755)
        expect("a video that fails", f, [*everything, "--video", "a.mp4", "--seconds", "0.2"], TRY_AGAIN, ["ffmpeg"], env={**os.environ, "PATH": tools + ":" + os.environ["PATH"]})
    with folder_of_files() as f:
        def limited_run(*command):
            return subprocess.run(["sh", "-c", 'ulimit -v 60000; exec "$@"', "sh", *command], cwd=f.path, capture_output=True)

        if limited_run(PROGRAM, "--version").returncode != DONE:
            print("skipped running out of memory: the program itself needs more (sanitizers)")
            return
        limited = limited_run(*f.command("me.png", "-o", "a.glb"))
        check(f"no memory: exit code {limited.returncode}, {limited.stderr[:200]}", limited.returncode in (TRY_AGAIN, DONE) and len(f.made()) == (1 if limited.returncode == DONE else 0))


ALL = ("-o", "a.glb", "--html", "a.html", "--viewer", "viewer.html", "--report", "a.json", "--video", "frames", "--fps", "5", "--seconds", "1", "--depth-map", "map.png")


def is_whole(name, content):
    return {".glb": is_whole_glb(content), ".html": content.endswith(b"3"), ".json": content.endswith(b"}\n"), ".png": content[-8:-4] == b"IEND"}[os.path.splitext(name)[1]]


def kills():
    """Kills the program at random times. Every file must then be complete, either old or new. After a signal that the program can catch, no
    temporary file may remain, and either all files are old or all are new."""
    random.seed(1)
    names = ["a.glb", "a.html", "a.json", "map.png"]
    with folder_of_files() as f:
        for name in names:
            f.write(name)
        os.link(f / "a.json", f / "twin.json")
        start = time.monotonic()
        f.run("me.png", *ALL)
        duration = time.monotonic() - start
        shutil.rmtree(f / "frames")
        after_signal = []
        for i in range(KILLS):
            for name in names:
                f.write(name)
            number = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP, signal.SIGKILL)[i % 4]
            process = subprocess.Popen(f.command("me.png", *ALL, "--quiet"), cwd=f.path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
            time.sleep(random.uniform(0, 1.2 * duration))
            process.send_signal(number)
            said = process.communicate()[1]
            after_signal.append(process.returncode)
            new = [name for name in names if f.read(name) != b"old"]
            check(f"kill {i}: the program prints nothing after {number.name}", said == b"", said)
            check(f"kill {i}: {number.name} ends the program", process.returncode in (0, -number), str(process.returncode))
            check(f"kill {i}: photo, depth map and viewer are unchanged", (f.read("me.png"), f.read("depth.png"), f.read("viewer.html")) == (PHOTO, DEPTH, VIEWER))
            # A kill may leave a file incomplete only if the file has hard links. A folder *.recover beside the file then contains a copy.
            kept = [name for name in os.listdir(f.path) if name.endswith(".recover")]
            check(f"kill {i}: {number.name} leaves complete files", all(is_whole(name, f.read(name)) for name in new if not (kept and name == "a.json")))
            if number != signal.SIGKILL:
                check(f"kill {i}: either all files are new or all are old, found new {new}", len(new) in (0, len(names)))
                check(f"kill {i}: frames exist only if the other files are new", os.path.isdir(f / "frames") == bool(new))
                check(f"kill {i}: leaves {f.made()}", set(f.made()) == {*names, "twin.json"} | ({"frames"} if new else set()))
            else:
                for name in kept:
                    shutil.rmtree(f / name)
                check(f"kill {i}: the next run succeeds", f.run("me.png", *ALL).returncode == DONE)
                check(f"kill {i}: after the next run, exactly the outputs exist, found {f.made()}", set(f.made()) == {*names, "twin.json", "frames"})
                check(f"kill {i}: after the next run, all frames exist", sorted(os.listdir(f / "frames")) == [f"frame_0000{k}.png" for k in range(1, 6)])
            check(f"kill {i}: hard links are kept", os.path.samefile(f / "a.json", f / "twin.json"))
            shutil.rmtree(f / "frames", ignore_errors=True)
        early = sum(code != 0 for code in after_signal)
        print(f"{KILLS} kills at random times of {duration:.2f} s: {early} before the end")
        check("some kills happen before the run ends", early > 0)


def kill_with_video():
    if not shutil.which("ffmpeg"):
        print("skipped videos: there is no ffmpeg")
        return
    with folder_of_files() as f:
        for after in (0.1, 0.3, 0.6):
            process = subprocess.Popen(f.command("me.png", "-o", "a.glb", "--video", "a.mp4", "--seconds", "60", "--quiet"), cwd=f.path, stderr=subprocess.PIPE)
            time.sleep(after)
            process.terminate()
            said = process.communicate()[1]
            time.sleep(0.1)
            check(f"an interrupted video leaves no file and prints no message, found {f.made()} and {said}", process.returncode == -signal.SIGTERM and not f.made() and said == b"")


def waits_for_a_reader():
    """An output pipe without a reader blocks the program. A signal must still end the program, and other outputs keep their old content."""
    with folder_of_files() as f:
        os.mkfifo(f / "a.glb")
        f.write("a.json")
        for number in (signal.SIGTERM, signal.SIGINT):
            process = subprocess.Popen(f.command("me.png", "-o", "a.glb", "--report", "a.json", "--quiet"), cwd=f.path, stderr=subprocess.PIPE)
            staged = lambda: any(name.startswith(".ldi-") for name in os.listdir(f.path))
            until = time.monotonic() + 60
            while not staged() and time.monotonic() < until:
                time.sleep(0.01)
            time.sleep(1)  # until it waits in the pipe
            check(f"{number.name}: the program still waits", process.poll() is None)
            process.send_signal(number)
            try:
                said = process.communicate(timeout=30)[1]
            except subprocess.TimeoutExpired:
                process.kill()
                said = process.communicate()[1]
            check(f"{number.name} ends a program that waits for the reader of a pipe", process.returncode == -number and said == b"", f"{process.returncode} {said}")
            check(f"{number.name}: leaves {f.made()}", f.made() == ["a.glb", "a.json"] and f.read("a.json") == b"old")


def many_at_once():
    with folder_of_files() as f:
        processes = [subprocess.Popen(f.command("me.png", "-o", "a.glb", "--quality", str(10 + 10 * i), "--html", "a.html", "--viewer", "viewer.html", "--quiet"), cwd=f.path, stderr=subprocess.PIPE) for i in range(8)]
        said = [process.communicate()[1] for process in processes]
        check(f"eight simultaneous runs succeed: {[p.returncode for p in processes]} {said}", all(p.returncode == DONE for p in processes))
        check(f"eight simultaneous runs leave one GLB and one page, found {f.made()}", f.made() == ["a.glb", "a.html"] and is_whole_glb(f.read("a.glb")))
        check("after eight simultaneous runs, page and GLB are from the same run", base64.b64encode(f.read("a.glb")) in f.read("a.html"))
    with folder_of_files() as f:
        ignoring = subprocess.run(["sh", "-c", 'trap "" TERM; "$@" & sleep 0.03; kill -TERM $!; wait $!', "sh", *f.command("me.png", "-o", "a.glb")], cwd=f.path, capture_output=True)
        check(f"a signal that is ignored when the program starts stays ignored: {ignoring.returncode}", ignoring.returncode == DONE and f.made() == ["a.glb"])


for part in (first_words, names, start_script, key_frames, outputs_that_are_inputs, what_is_kept, kills, kill_with_video, waits_for_a_reader, many_at_once):
    begin = time.monotonic()
    part()
    print(f"{part.__name__}: {time.monotonic() - begin:.1f} s")
finish()
