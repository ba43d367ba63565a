"""Tests photo3d --batch: it writes the same bytes as single runs, prints one line per photo, even for failures, stays within its memory
limit, and resumes after a kill.

    batch.py PHOTO3D SOURCE_DIR [KILLS]

KILLS (default 6): number of kills at random times.
"""
import base64
import json
import os
import pty
import random
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time

from checks import check, finish
from files import is_whole_glb, png

PROGRAM, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
KILLS = int(sys.argv[3]) if len(sys.argv) > 3 else 6
DONE, NEVER, USAGE, TRY_AGAIN = 0, 1, 2, 75
VIEWER = b"1<title>3D photo</title>2<!-- the photo goes here -->3"
NETWORK = os.path.join(SOURCE, "tests/io/files/tiefenrausch_weights.safetensors")


def photo(seed, width=60, height=80):
    rows = [bytes((60 + 120 * ((x // 5 + y) % 2) + 7 * seed) % 256 for x in range(width) for _ in range(3)) for y in range(2)]
    return png(width, height, 3, lambda y: rows[y // 5 % 2])


def depth(seed, width=60, height=80):
    row = bytes(40 if x < 20 + 3 * seed else 200 for x in range(width))
    return png(width, height, 1, lambda y: row)


class folder_of_photos:
    """A working folder of the program with photos a.png, b.png, ... in photos/ and their depth maps in depth/."""

    def __init__(self, count=5):
        self.names = [chr(ord("a") + i) for i in range(count)]

    def __enter__(self):
        self.path = tempfile.mkdtemp()
        for i, name in enumerate(self.names):
            self.write(f"photos/{name}.png", photo(i))
            self.write(f"depth/{name}.png", depth(i))
        self.write("viewer.html", VIEWER)
        return self

    def __exit__(self, *_):
        shutil.rmtree(self.path, ignore_errors=True)

    def __truediv__(self, name):
        return os.path.join(self.path, name)

    def write(self, name, content):
        os.makedirs(os.path.dirname(self / name), exist_ok=True)
        with open(self / name, "wb") as out:
            out.write(content)

    def read(self, name):
        with open(self / name, "rb") as there:
            return there.read()

    def list(self, name="."):
        return sorted(os.listdir(self / name)) if os.path.isdir(self / name) else []

    def run(self, *arguments, program=PROGRAM, **how):
        return subprocess.run([program, *arguments, "--inpaint", "diffusion", "--viewer", "viewer.html"], cwd=self.path, capture_output=True, timeout=120, **how)

    def batch(self, *arguments, given_depth=True, code=DONE, **how):
        """Returns the lines of the results by photo name."""
        result = self.run("--batch", *arguments, *(["--depth", "depth"] if given_depth else []), **how)
        check(f"--batch {arguments}: exit code {result.returncode}", code is None or result.returncode == code, result.stderr)
        lines = [json.loads(line) for line in result.stdout.decode().splitlines()]
        check(f"--batch {arguments}: indices", sorted(line["index"] for line in lines) == list(range(len(lines))), lines)
        self.said = result.stderr.decode()
        return {line["photo"]: line for line in lines}


def the_same_bytes():
    with folder_of_photos() as f:
        for name in f.names:
            f.run(f"photos/{name}.png", "--depth", f"depth/{name}.png", "-o", f"{name}.glb", "--html", f"{name}.html", "--quiet")
        lines = f.batch("photos", "-o", "out", "--html", "pages", "--report", "reports", "--threads", "3")
        check("a batch prints one line per photo", sorted(lines) == [f"photos/{name}.png" for name in f.names], lines)
        for name in f.names:
            check(f"{name}.glb has the same bytes as from a single run", f.read(f"out/{name}.glb") == f.read(f"{name}.glb"))
            check(f"{name}.html has the same bytes as from a single run", f.read(f"pages/{name}.html") == f.read(f"{name}.html"))
            line, report = lines[f"photos/{name}.png"], json.loads(f.read(f"reports/{name}.json"))
            check(f"{name}: the line lists all outputs", line["outputs"] == [f"out/{name}.glb", f"pages/{name}.html", f"reports/{name}.json"], line)
            check(f"{name}: the line has the share of hidden pixels", abs(line["hidden_share"] - report["hidden_pixels"] / (60 * 80)) < 1e-4 and line["hidden_share"] > 0, line)
            check(f"{name}: the line has the duration in the report", abs(line["milliseconds"] - report["milliseconds"]["total"]) <= 0.051 and line["milliseconds"] > 0, line)
            check(f"{name}: the line has rounded numbers", re.search(r'"milliseconds":[0-9]+\.[0-9],', json.dumps(line, separators=(",", ":"))) is not None, line)
        check("the last message counts the photos", "5 converted, 0 skipped, 0 failed" in f.said, f.said)
        check("without a terminal, no carriage return is printed", "\r" not in f.said)
    with folder_of_photos(2) as f:
        f.run("photos/a.png", "--depth-model", NETWORK, "-o", "a.glb", "--quiet")
        f.batch("photos/a.png", "photos/b.png", "--depth-model", NETWORK, "-o", "out", "--quiet", given_depth=False)
        check("with depth from a network, a batch writes the same bytes as a single run", f.read("out/a.glb") == f.read("a.glb"))
        check("with an output folder, nothing is written beside the photos", f.list("photos") == ["a.png", "b.png"] and f.said == "")
        f.batch("photos", "--depth-model", NETWORK, given_depth=False)
        check("without an output folder, outputs are beside the photos", f.list("photos") == ["a.glb", "a.html", "a.png", "b.glb", "b.html", "b.png"], f.list("photos"))


def lists():
    with folder_of_photos() as f:
        whole = [{"photo": "photos/a.png", "output": "out/1.glb", "report": "out/1.json"}, {"photo": "photos/b.png", "depth": "depth/c.png", "output": "out/2.glb"}, "photos/c.png"]
        text = "\n".join(json.dumps(line) for line in whole) + "\n\n"
        os.mkdir(f / "out")
        f.write("list.jsonl", text.encode())
        lines = f.batch("list.jsonl", "-o", "rest")
        check("a list can name outputs for some photos, and -o applies to the others", f.list("out") == ["1.glb", "1.json", "2.glb"] and f.list("rest") == ["c.glb"], lines)
        f.run("photos/b.png", "--depth", "depth/c.png", "-o", "b.glb")
        check("a list can name a depth map", f.read("out/2.glb") == f.read("b.glb"))
        f.batch("-", "photos/d.png", "-o", "again", input=b'"photos/a.png"\n{"photo": "photos/b.png"}')
        check("photos are read from standard input and from arguments", f.list("again") == ["a.glb", "b.glb", "d.glb"])
        bad = [b'"' + b"a" * 2_000_000 + b'"', b"{", b"3", b'{"output": "x.glb"}', b'{"photo": 3}', b'{"photo": ""}', b'{"photo": "-"}', b'{"photo": "photos/a.png", "outptu": "x.glb"}', b'{"photo": "photos/a.png", "output": "photos/b.png\\u0000.glb"}', b'{"photo": "photos/a.png\\u0000"}', b'{"photo": ' + b"[" * 200_000 + b"]" * 200_000 + b"}", b"[" * 1_000_000]
        lines = subprocess.run([PROGRAM, "--batch", "-", "--depth", "depth", "-o", "bad"], cwd=f.path, input=b"\n".join([*bad, b'"photos/e.png"']), capture_output=True)
        lines = [json.loads(line) for line in lines.stdout.splitlines()]
        errors = [line["error"] for line in lines if "error" in line]
        check("invalid lines have error codes", [e["code"] for e in errors] == ["too large"] + ["invalid data"] * (len(bad) - 1), str(errors)[:2000])
        check("an error message states the line number", "standard input, line 2" in errors[1]["message"], errors)
        check("error messages have less than 1000 characters", all(len(e["message"]) < 1000 for e in errors), errors)
        check("deeply nested JSON is refused as nested", all("nested" in e["message"] and len(e["message"]) < 1000 for e in errors[-2:]), str(errors)[:2000])
        check("a photo after invalid lines is converted", f.list("bad") == ["e.glb"])
        check("a null character in a name does not end the name", f.read("photos/b.png") == photo(1))


def bad_photos():
    with folder_of_photos() as f:
        f.write("photos/cut.png", photo(1)[:200])
        f.write("photos/empty.jpg", b"")
        f.write("photos/gone/hidden.png", b"")
        f.write("photos/.hidden.png", b"")
        for name in ("cut", "empty"):
            f.write(f"depth/{name}.png", depth(1))
        shutil.copy(f / "photos/a.png", f / "photos/lonely.png")
        lines = f.batch("photos", "nowhere", "none.jsonl", "-o", "out", code=NEVER)
        check("all valid photos are converted", f.list("out") == [f"{name}.glb" for name in f.names], f.list("out"))
        errors = {name: line["error"] for name, line in lines.items() if "error" in line}
        check("invalid and missing photos have error codes", {name: e["code"] for name, e in errors.items()} == {"photos/cut.png": "invalid data", "photos/empty.jpg": "invalid data", "photos/lonely.png": "file access", "nowhere": "file access", "none.jsonl": "file access"}, errors)
        check("invalid photos are not marked for another try", all(not e["try_again"] and e["exit_code"] == NEVER for e in errors.values()), errors)
        os.mkfifo(f / "pipe.png")
        f.write("listed.jsonl", b'"pipe.png"\n"/dev/zero"\n"photos/a.png"\n')
        lines = f.batch("listed.jsonl", "-o", "listed", given_depth=False, code=NEVER)
        check("pipes and devices are refused, and the batch continues", [lines[name].get("error", {}).get("code") for name in ("pipe.png", "/dev/zero", "photos/a.png")] == ["file access", "file access", None], lines)
        f.write("huge/a.png", photo(0))
        f.write("huge/a_depth.png", b"")
        os.truncate(f / "huge/a_depth.png", (1 << 30) + 1)
        models = {**os.environ, "LDI_MODELS": os.path.join(SOURCE, "examples/models")}
        said = f.run("huge/a.png", "-o", "huge.glb", env=models).stderr.decode()
        lines = f.batch("huge", "-o", "with_huge", given_depth=False, env=models)
        check("a photo is converted even if the file beside it is too large for a depth map", f.read("huge.glb") == f.read("with_huge/a.glb") and all("a_depth.png: expected at most" in text for text in (said, str(lines))), (said, lines))
        lines = f.batch("photos/a.png", "photos/b.png", "photos/../photos/a.png", "-o", "out", code=NEVER)
        check("a photo that is named twice is refused the second time", [line.get("error", {}).get("code") for line in sorted(lines.values(), key=lambda line: line["index"])] == [None, None, "invalid option"], lines)
        os.mkdir(f / "full")
        os.symlink("/dev/full", f / "full/a.glb")
        lines = f.batch("photos/a.png", "photos/b.png", "-o", "full", code=TRY_AGAIN)
        check("if the device is full, a photo is marked for another try", lines["photos/a.png"]["error"]["try_again"] and "outputs" in lines["photos/b.png"], lines)
        f.write("photos/b.html", b"another's page")
        os.rename(f / "viewer.html", f / "none.html")
        f.write("photos/c.glb", b"another's")
        lines = f.batch("photos/b.png", "photos/c.png", code=NEVER)
        check("an existing file that the program did not write is kept", "error" in lines["photos/c.png"] and f.read("photos/c.glb") == b"another's" and "error" not in lines["photos/b.png"], lines)
    with folder_of_photos(2) as f:
        for name, arguments, words in (
            ("two photos without --batch are refused", ["photos/a.png", "photos/b.png"], "--batch"),
            ("--skip-existing without --batch is refused", ["photos/a.png", "--skip-existing"], "--batch"),
            ("--stages with --batch is refused", ["--batch", "photos", "--stages", "s"], "--stages"),
            ("--video with --batch is refused", ["--batch", "photos", "--video", "v.mp4"], "--video"),
            ("standard output as the output of a batch is refused", ["--batch", "photos", "-o", "-"], "folder"),
            ("a memory limit that is not a size is refused", ["--batch", "photos", "--memory", "much"], "--memory"),
        ):
            result = f.run(*arguments, "--depth", "depth")
            check(f"{name}: exit code {result.returncode}", result.returncode == USAGE and words in result.stderr.decode() and not result.stdout, result.stderr)
        result = f.run("--batch", "photos", "--depth", "depth", "-o", "viewer.html")
        check("a file as the output folder of a batch is refused", result.returncode == NEVER, result.stderr)
        reader = subprocess.Popen(["sh", "-c", '"$@" | true', "sh", PROGRAM, "--batch", "photos", "--depth", "depth", "--inpaint", "diffusion", "-o", "out", "--quiet"], cwd=f.path, stderr=subprocess.PIPE)
        check("a reader that closes its pipe causes no crash", b"photo3d: standard output" in reader.communicate()[1] or f.list("out") == ["a.glb", "b.glb"])


def links():
    """The program refuses two outputs that are the same file, even under different names, before the second conversion."""
    def outputs(*names):
        return "\n".join(json.dumps({"photo": f"photos/{photo}.png", "output": name}) for photo, name in zip("abcde", names)).encode()

    def expect(name, f, first, second):
        lines = f.batch("-", code=NEVER, input=outputs(first, second))
        check(f"two names of one output ({name}): the first photo is written", is_whole_glb(f.read(first)), lines)
        check(f"two names of one output ({name}): the second photo is refused", lines["photos/b.png"].get("error", {}).get("code") == "invalid option", lines)

    for name in ("a link", "a link that leads nowhere yet", "a folder's link", "a hard link"):
        with folder_of_photos(2) as f:
            for folder in ("out", "real"):
                os.mkdir(f / folder)
            first, second = "out/1.glb", "out/2.glb"
            if name != "a link that leads nowhere yet":
                f.write(first, b"old")
            if name.startswith("a link"):
                os.symlink("1.glb", f / second)
            elif name == "a folder's link":
                os.symlink("out", f / "linked")
                second = "linked/1.glb"
            else:
                os.link(f / first, f / second)
            expect(name, f, first, second)
    with folder_of_photos(3) as f:
        os.mkdir(f / "out")
        os.symlink("../photos/b.png", f / "out/a.glb")
        before = f.read("photos/b.png")
        lines = f.batch("photos", "-o", "out", code=NEVER)
        check("an output that links to a photo is refused", "error" in lines["photos/a.png"] and f.read("photos/b.png") == before and "outputs" in lines["photos/b.png"], lines)
        f.batch("-", input=outputs("out/A.glb", "out/a2.glb", "out/A2.glb"))
        check("file names that differ only in case are different outputs", {"A.glb", "a2.glb", "A2.glb"} <= set(f.list("out")))


def formats():
    """A batch reads every format that a single run reads, and names the files of a folder that it skips."""
    with folder_of_photos(1) as f:
        wanted = ["a"]
        for name in ("b.webp", "c.tif", "d.bmp", "e.gif", "f.JPG"):
            made = shutil.which("ffmpeg") and subprocess.run(["ffmpeg", "-loglevel", "error", "-i", f / "photos/a.png", f / f"photos/{name}"]).returncode == 0
            if made and f.run(f"photos/{name}", "--depth", "depth/a.png", "-o", "one.glb").returncode == DONE:
                wanted.append(name[0])
                f.write(f"depth/{name[0]}.png", depth(0))
            else:
                print(f"skipped {name}: there is no ffmpeg that writes it, or the program does not read it")
                if made:
                    os.remove(f / f"photos/{name}")
        lines = f.batch("photos", "-o", "out")
        check("every readable format is converted", f.list("out") == [f"{name}.glb" for name in wanted], lines)
        f.write("photos/notes.txt", b"notes")
        f.write("photos/more/z.png", photo(1))
        f.write("photos/.hidden", b"")
        for i in range(30):
            f.write(f"photos/film{i:02}.mov", b"")
        f.batch("photos", "-o", "out")
        check("files that the batch skips are named and counted", all(word in f.said for word in ("32 left out", "film00.mov", " more", f"{len(wanted)} converted")) and ".hidden" not in f.said, f.said)
        f.batch("photos", "-o", "out", "--quiet")
        check("with --quiet, skipped files are not named", f.said == "", f.said)


def memory_of_maps():
    """The memory limit covers maps beside photos, maps inside photos, and depth with unusually many hidden pixels."""
    program = open(PROGRAM, "rb").read()
    if b"AddressSanitizer" in program or b"ThreadSanitizer" in program:
        print("skipped the memory of maps: sanitizers need additional memory")
        return
    bound = 250
    with folder_of_photos(0) as f:
        large = png(4000, 3000, 1, lambda y: bytes(4000))
        for i in range(4):
            f.write(f"beside/{i}.png", photo(i, 400, 300))
            f.write(f"beside/{i}_depth.png", large)
        f.write("beside/9.png", photo(9, 400, 300))
        f.write("beside/9_depth.png", png(8000, 6000, 1, lambda y: bytes(8000)))
        lines = f.batch("beside", "-o", "out", "--report", "reports", "--memory", f"{bound}MB", "--threads", "4", given_depth=False, code=NEVER)
        check("photos with large maps beside them are converted", f.list("out") == [f"{i}.glb" for i in range(4)], lines)
        check("a map beyond the memory limit is refused", lines["beside/9.png"]["error"]["code"] == "too large", lines)
        peak = max(json.loads(f.read(f"reports/{name}"))["peak_memory_bytes"] for name in f.list("reports"))
        check(f"photos with large maps: the peak, {peak} bytes, is within the limit", peak <= bound * 1_000_000)
    with folder_of_photos(0) as f:
        names = [f"{i}.png" for i in range(4)]
        for i, name in enumerate(names):
            f.write(f"photos/{name}", photo(i, 900, 700))
            comb = [bytes(20 if (x // 6 + k) % 2 else 235 for x in range(900)) for k in range(2)]
            f.write(f"depth/{name}", png(900, 700, 1, lambda y: comb[y // 6 % 2]) if i % 2 else depth(i, 900, 700))
        lines = f.batch("photos", "-o", "out", "--report", "reports", "--memory", f"{bound}MB", "--threads", "4", "--motion", "0.05", code=None)
        errors = {line["error"]["code"] for line in lines.values() if "error" in line}
        check("photos with many hidden pixels are converted or refused as too large", errors <= {"too large"} and {"0.glb", "2.glb"} <= set(f.list("out")), lines)
        peak = max(json.loads(f.read(f"reports/{name}"))["peak_memory_bytes"] for name in f.list("reports"))
        check(f"photos with many hidden pixels: the peak, {peak} bytes, is within the limit", peak <= bound * 1_000_000, lines)


def jpeg_with_xmp(jpeg, attributes, children=""):
    """Inserts an XMP packet of any size into a JPEG file: as Extended XMP, in segments of at most 64 kB, as phones do."""
    def segment(body):
        return b"\xff\xe1" + struct.pack(">H", len(body) + 2) + body

    def packet(attributes, children=""):
        return f'<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#"><rdf:Description {attributes}>{children}</rdf:Description></rdf:RDF></x:xmpmeta>'.encode()

    identifier, part, whole = "0" * 32, 60_000, packet(attributes, children)
    first = packet(f'xmlns:xmpNote="http://ns.adobe.com/xmp/note/" xmpNote:HasExtendedXMP="{identifier}"')
    segments = [segment(b"http://ns.adobe.com/xap/1.0/\0" + first)]
    for at in range(0, len(whole), part):
        segments.append(segment(b"http://ns.adobe.com/xmp/extension/\0" + identifier.encode() + struct.pack(">II", len(whole), at) + whole[at : at + part]))
    return jpeg[:2] + b"".join(segments) + jpeg[2:]


def memory_of_maps_inside():
    """The memory limit covers depth maps of 12 megapixels inside photos, and the XMP that contains them."""
    program = open(PROGRAM, "rb").read()
    if b"AddressSanitizer" in program or b"ThreadSanitizer" in program or "pugixml" in subprocess.run([PROGRAM, "--version"], capture_output=True, text=True).stdout:
        print("skipped the memory of maps inside photos: sanitizers need additional memory, or the program reads no XMP")
        return
    bound = 400
    with open(os.path.join(SOURCE, "examples/photo3d/sample.jpg"), "rb") as file:
        sample = file.read()
    step, noise = bytes(40 if x < 1500 else 200 for x in range(3000)), random.Random(3)
    plain = png(3000, 4000, 1, lambda y: step)
    grainy = png(3000, 4000, 1, lambda y: noise.randbytes(3000))  # can't be compressed

    def gdepth(map):
        return 'xmlns:GDepth="http://ns.google.com/photos/1.0/depthmap/" GDepth:Format="RangeInverse" GDepth:Near="1" GDepth:Far="9" GDepth:Mime="image/png" GDepth:Data="' + base64.b64encode(map).decode() + '" '

    too_large = jpeg_with_xmp(sample, gdepth(png(6000, 8000, 1, lambda y: bytes(6000))))
    for name, file in (
        ("a map of few bytes", jpeg_with_xmp(sample, gdepth(plain))),
        ("a map of many bytes", jpeg_with_xmp(sample, gdepth(grainy))),
        ("a map and the original photo", jpeg_with_xmp(sample, gdepth(plain) + 'xmlns:GImage="http://ns.google.com/photos/1.0/image/" GImage:Data="' + "A" * 12_000_000 + '" ')),
        ("a map and many elements", jpeg_with_xmp(sample, gdepth(plain), "<a/>" * 500_000)),
        ("a map and many properties", jpeg_with_xmp(sample, gdepth(plain) + 'xmlns:a="http://a/"', "".join(f"<a:p{i}>1</a:p{i}>" for i in range(100_000)))),
    ):
        with folder_of_photos(0) as f:
            for i in range(4):
                f.write(f"photos/{i}.jpg", file)
            f.write("photos/0_large.jpg", too_large)
            lines = f.batch("photos", "-o", "out", "--report", "reports", "--size", "320", "--memory", f"{bound}MB", "--threads", "4", given_depth=False, code=NEVER)
            reports = [json.loads(f.read(f"reports/{name}")) for name in f.list("reports")]
            check(f"photos with {name} inside are converted", f.list("out") == [f"{i}.glb" for i in range(4)], lines)
            check(f"photos with {name} inside: a map beyond the memory limit is refused", lines["photos/0_large.jpg"].get("error", {}).get("code") == "too large", lines)
            check(f"photos with {name} inside: the map is used", all(report["depth"] == "GDepth, RangeInverse" for report in reports), f.said)
            peak = max((report["peak_memory_bytes"] for report in reports), default=bound * 1_000_000 + 1)
            check(f"photos with {name} inside: the peak, {peak} bytes, is within the limit", peak <= bound * 1_000_000)


def reader_goes_away():
    with folder_of_photos(2) as f:
        for arguments in (["--batch", "photos", "--depth", "depth", "-o", "out"], ["photos/a.png", "--depth", "depth/a.png", "-o", "-"], ["photos/a.png", "--depth", "depth/a.png", "-o", "a.glb", "--report", "-"]):
            read, write = os.pipe()
            os.close(read)
            result = subprocess.run([PROGRAM, *arguments, "--inpaint", "diffusion"], cwd=f.path, stdout=write, stderr=subprocess.PIPE)
            os.close(write)
            check(f"without a reader of standard output, {arguments}: exit code {result.returncode}", result.returncode == TRY_AGAIN and b"standard output" in result.stderr, result.stderr)
        check("without a reader of standard output, no file is written", not os.path.exists(f / "a.glb"))


def memory():
    # The limit suffices for one photo at a time. Sanitizers need additional memory.
    program = open(PROGRAM, "rb").read()
    is_sanitized = b"AddressSanitizer" in program or b"ThreadSanitizer" in program
    bound = 700 if is_sanitized else 170
    with folder_of_photos(2) as f:
        for i in range(4):
            f.write(f"large/{i}.png", photo(i, 900, 700))
            f.write(f"depth/{i}.png", depth(i, 900, 700))
        f.write("large/7.png", png(9000, 9000, 1, lambda y: bytes(9000)))
        f.write("depth/7.png", depth(7, 100, 100))
        lines = f.batch("large", "-o", "out", "--report", "reports", "--memory", f"{bound}MB", "--threads", "4", code=NEVER)
        check("photos within the memory limit are converted", f.list("out") == [f"{i}.glb" for i in range(4)], lines)
        check("a photo beyond the memory limit is refused", lines["large/7.png"]["error"]["code"] == "too large" and f"{bound} MB" in lines["large/7.png"]["error"]["message"], lines["large/7.png"])
        peak = max(json.loads(f.read(f"reports/{i}.json"))["peak_memory_bytes"] for i in range(4))
        check(f"the peak, {peak} bytes, is within the limit", is_sanitized or peak <= bound * 1_000_000)
        if not is_sanitized:
            f.batch("large/0.png", "large/1.png", "large/2.png", "large/3.png", "-o", "free", "--report", "free", "--threads", "4")
            free = max(json.loads(f.read(f"free/{i}.json"))["peak_memory_bytes"] for i in range(4))
            check(f"without a limit, the peak is higher, {free} bytes", free > peak)


def kills():
    """Kills batches at random times and starts them again. Each photo must then have one complete result, and no other file may remain."""
    random.seed(2)
    with folder_of_photos(16) as f:
        command = ["photos", "-o", "out", "--html", "out", "--skip-existing"]
        begin = time.monotonic()
        f.batch(*command)
        duration = time.monotonic() - begin
        expected = {name: f.read(f"out/{name}") for name in f.list("out")}
        check("a batch writes all files", len(expected) == 32 and all(is_whole_glb(data) for name, data in expected.items() if name.endswith(".glb")))
        early = 0
        for i in range(KILLS):
            shutil.rmtree(f / "out")
            number = (signal.SIGKILL, signal.SIGTERM)[i % 2]
            process = subprocess.Popen([PROGRAM, "--batch", *command, "--depth", "depth", "--inpaint", "diffusion", "--viewer", "viewer.html"], cwd=f.path, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            time.sleep(random.uniform(0, 1.2 * duration))
            process.send_signal(number)
            first, said = process.communicate()
            early += process.returncode == -number
            # A signal between the last line and the end of the process leaves the last line complete.
            quiet = said == b"" or (said.startswith(b"photo3d: 16 converted") and said.endswith(b"photos/s\n"))
            check(f"kill {i}: {process.returncode}, says {said}", process.returncode in (DONE, -number) and quiet)
            left = [name for name in f.list("out") if name.startswith(".ldi")]
            check(f"kill {i}: leaves {left}", number == signal.SIGKILL or not left)
            check(f"kill {i}: existing files are complete", all(f.read(f"out/{name}") == expected[name] for name in f.list("out") if not name.startswith(".ldi")))
            lines = f.batch(*command)
            check(f"kill {i}: after the next run, all files exist", {name: f.read(f"out/{name}") for name in f.list("out")} == expected, f.list("out"))
            before = {json.loads(line)["photo"] for line in first.decode().splitlines() if line.endswith("}")}
            again = {name for name, line in lines.items() if "skipped" not in line}
            check(f"kill {i}: no photo is converted twice", len(lines) == 16 and not before & again, before & again)
        print(f"{KILLS} kills at random times of {duration:.2f} s: {early} before the end")


def terminal():
    with folder_of_photos(3) as f:
        leader, follower = pty.openpty()
        result = subprocess.Popen([PROGRAM, "--batch", "photos", "--depth", "depth", "--inpaint", "diffusion", "-o", "out"], cwd=f.path, stdout=subprocess.PIPE, stderr=follower)
        lines = result.communicate()[0]
        os.close(follower)
        said = os.read(leader, 65536).decode()
        os.close(leader)
        check("on a terminal, the batch prints its progress", "1 of 3 photos" in said and "photos/s" in said and " left" in said, said)
        check("standard output has only lines of JSON", len([json.loads(line) for line in lines.splitlines()]) == 3)


def galleries():
    with folder_of_photos(3) as f:
        f.write("gallery.html", b"before<!-- the photos go here -->after")
        f.write("photos/c.png", b"this is </script> no picture")
        arguments = ["photos", "-o", "out", "--gallery", "pages/all.html", "--formats", "png"]
        os.mkdir(f / "pages")
        lines = f.batch(*arguments, code=NEVER)
        check("posters are among the outputs", lines["photos/a.png"]["outputs"] == ["out/a.glb", "pages/all_posters/.._-out_-a.jpg"], lines)
        page = f.read("pages/all.html").decode()
        check("the gallery page contains the list of photos in place of its mark", page.startswith("before<script id=\"photos\"") and page.endswith("</script>after") and page.count("</script>") == 1, page)
        entries = json.loads(page[page.index(">") + 1 : page.rindex("</script>")])
        check("the gallery entry of a photo has a title, a file and a poster", entries[0] == {"title": "a.png", "src": "../out/a.glb", "poster": "all_posters/.._-out_-a.jpg"}, entries)
        check("the gallery entry of a failed photo has a title and an error", entries[2]["title"] == "c.png" and "error" in entries[2] and len(entries) == 3, entries)
        f.batch(*arguments, "--skip-existing", code=NEVER)
        check("a second run skips existing photos and still lists them", "0 converted, 2 skipped" in f.said and f.read("pages/all.html").decode() == page, f.said)
        names = ["g/a/b.glb", "g/a__b.glb", "g/a_-b.glb", "g/a_/b.glb"]
        for name in ("g/a", "g/a_"):
            os.makedirs(f / name)
        f.write("list.jsonl", "\n".join(json.dumps({"photo": "photos/a.png", "depth": "depth/a.png", "output": name}) for name in names).encode())
        result = f.run("--batch", "list.jsonl", "--gallery", "g/all.html")
        check("each photo of a gallery has its own poster", result.returncode == DONE and len(f.list("g/all_posters")) == len(names), result.stdout)
        f.write("gallery.html", b"another version")
        result = f.run("--batch", "photos", "--depth", "depth", "-o", "other", "--gallery", "pages/other.html")
        check("a gallery template of another version is refused", result.returncode == NEVER and b"gallery.html" in result.stderr, result.stderr)
        check("--gallery without --batch is refused", f.run("photos/a.png", "--gallery", "x.html").returncode == USAGE)


for part in (the_same_bytes, lists, galleries, bad_photos, links, formats, reader_goes_away, memory, memory_of_maps, memory_of_maps_inside, kills, terminal):
    begin = time.monotonic()
    part()
    print(f"{part.__name__}: {time.monotonic() - begin:.1f} s")
finish()
