"""Runs photo3d on valid input and on invalid files of all kinds.

    photo3d.py PHOTO3D SOURCE_DIR

Every run must write a GLB file, or write nothing and print a message with the expected and the actual value.
"""
import base64
import json
import os
import re
import resource
import shutil
import struct
import subprocess
import sys
import tempfile
import zipfile
from random import Random

from checks import check, finish
from files import is_whole_glb, pixels, png

PROGRAM, SOURCE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
SAMPLE, SAMPLE_DEPTH = (os.path.join(SOURCE, "examples/photo3d", name) for name in ("sample.jpg", "sample_depth.png"))
SHARED = os.path.join(SOURCE, "..", "shared")
MODELS = {"depth": "tiefenrausch_small.safetensors", "inpainting": "farbrausch.safetensors"}
WITHOUT_MODELS = {name: value for name, value in os.environ.items() if name != "LDI_MODELS"}


def check_written_files(folder):
    """Tests compressed GLB files, stereo pictures and USDZ of a photo with a far red line and a near green line."""
    def write(name, *options):
        path = os.path.join(folder, name)
        kind = {".glb": "-o", ".usdz": "--usdz"}.get(os.path.splitext(name)[1], "--stereo-image")
        said = subprocess.run([PROGRAM, photo, *depth, kind, path, *options, "--quiet"], capture_output=True, text=True, env=WITHOUT_MODELS).stderr
        return open(path, "rb").read() if os.path.exists(path) else said.encode()

    lines = bytes(v for x in range(300) for v in ((250, 0, 0) if 60 <= x < 64 else (0, 250, 0) if 220 <= x < 224 else (90, 90, 90)))
    photo = file(folder, "li\"nes.png", png(300, 200, 3, lambda y: lines))
    depth = ["--depth", file(folder, "lines_depth.png", png(300, 200, 1, lambda y: bytes(40 if x < 150 else 200 for x in range(300))))]

    def content(glb):
        return json.loads(glb[20 : 20 + struct.unpack("<I", glb[12:16])[0]])

    plain = write("plain.glb")
    extras = content(plain)["scenes"][0]["extras"]
    check(f"a GLB file names its source and states motion, depth range and focal length: {extras}", extras.get("source") == "li\"nes.png" and extras.keys() >= {"motion", "nearest", "farthest", "focal_length_35mm"})
    cropped = content(write("cropped.glb", "--frame", "crop"))
    check("a GLB file states whether surfaces continue past the frame", extras.get("past_frame") is True and "past_frame" not in cropped["scenes"][0]["extras"])
    check("the camera of a GLB file is the same with each frame", cropped["cameras"] == content(plain)["cameras"])
    paper = content(write("paper.glb", "--preset", "paper"))["scenes"][0]["extras"]
    check("with the paper's preset, surfaces end at the border", "past_frame" not in paper and paper["motion"] <= extras["motion"])
    run("an unknown preset is refused", [photo, *depth, "--preset", "papers"], ["--preset", "paper"])
    run("an unknown frame is refused", [photo, *depth, "--frame", "round"], ["--frame", "round"])
    compressed = write("compressed.glb", "--compress")
    if b"built without" in compressed:
        print("skipped compressed files: the program was built without meshoptimizer or libwebp")
    else:
        json_of = content(compressed)
        check("a compressed GLB file requires its extensions", is_whole_glb(compressed) and {"EXT_meshopt_compression", "EXT_texture_webp"} <= set(json_of["extensionsRequired"]))
        check("a compressed GLB file has the same scene and camera", json_of["scenes"] == content(plain)["scenes"] and json_of["cameras"] == content(plain)["cameras"])
        check("a compressed GLB file with a JPEG texture does not use WebP", "EXT_texture_webp" not in content(write("jpeg.glb", "--compress", "--compressed-texture", "jpeg"))["extensionsUsed"])
        both = content(write("both.glb", "--compress", "--compressed-texture", "both"))
        check("a compressed GLB file with both textures has a JPEG and a WebP file", [image["mimeType"] for image in both["images"]] == ["image/jpeg", "image/webp"])
    run("--compressed-texture without --compress is refused", [photo, *depth, "--compressed-texture", "jpeg"], ["--compress"])

    rows = pixels(write("pair.png"))

    def middle(color, first, last):
        """Returns the mean column of the pixels of a color in row 100, between two columns, relative to the first one."""
        seen = [x for x in range(first, last) if rows[100][3 * x + color] > rows[100][3 * x + 1 - color] + 60]
        return sum(seen) / max(len(seen), 1) - first

    check("a stereo picture is two pictures wide", len(rows) == 200 and len(rows[0]) == 3 * 600)
    far, near = (middle(color, 300, 600) - middle(color, 0, 300) for color in (0, 1))
    check(f"the nearest surface has no parallax between both pictures, and the farthest lies behind it: {near}, {far}", abs(near) < 1 and 3 < far < 12)
    place = middle(1, 0, 300)
    check(f"the window is as large as the photo: {place}", abs(place - 221.5) < 1)
    rows = pixels(write("cropped_pair.png", "--frame", "crop"))
    check(f"with a cropped frame, the window is smaller: {middle(1, 0, 300)}", middle(1, 0, 300) > place + 1)
    jps = write("pair.JPS")
    check("a JPS file is a JPEG with a marker for stereo", jps[:4] == b"\xff\xd8\xff\xe0" and b"\xff\xe3\0\x12_JPSJPS_\0\4\0\0\2\1\0\0" in jps)
    mpo = write("pair.mpo")
    index = mpo.find(b"MPF\0") + 4
    entries = struct.unpack("<8I", mpo[index + 50 : index + 82])
    second = mpo[index + entries[6] :][: entries[5]]
    check("an MPO file has two complete JPEGs at the offsets of its index", entries[1] + entries[5] == len(mpo) and second[:2] == b"\xff\xd8" and second[-2:] == b"\xff\xd9" and mpo[: entries[1]][-2:] == b"\xff\xd9")
    run("a stereo picture in an unsupported format is refused", [photo, *depth, "--stereo-image", os.path.join(folder, "pair.gif")], [".gif", ".mpo"])

    usdz = zipfile.ZipFile(os.path.join(folder, "photo.usdz")) if is_written(write("photo.usdz")) else None
    names = usdz.namelist() if usdz else []
    check("a USDZ file is an intact archive of a scene and a texture", names == ["photo.usda", "textures/photo.jpg"] and usdz.testzip() is None)
    for item in usdz.infolist() if usdz else []:
        header = open(usdz.filename, "rb").read()[item.header_offset :][:30]
        start = item.header_offset + 30 + sum(struct.unpack("<HH", header[26:30]))
        check(f"{item.filename} is stored at a multiple of 64 bytes: {start}", item.compress_type == zipfile.ZIP_STORED and start % 64 == 0)
    scene = usdz.read("photo.usda").decode() if usdz else ""
    indices = [int(i) for i in (re.search(r"faceVertexIndices = \[([^]]*)", scene) or [0, "-1"])[1].split(",")]
    points = len(re.findall(r"\(", (re.search(r"points = \[([^]]*)", scene) or [0, ""])[1]))
    check("the scene of a USDZ file uses every point and names its source", scene.startswith("#usda 1.0\n") and max(indices) == points - 1 and 'string source = "li\\"nes.png"' in scene)
    run("a USDZ path without an extension is refused", [photo, *depth, "--usdz", os.path.join(folder, "photo")], ["a name that ends in .usdz, found no ending (photo3d writes a USDZ file)"])
    run("a USDZ path with another extension is refused", [photo, *depth, "--usdz", os.path.join(folder, "photo.zip")], [".zip", ".usdz"])


def jpeg_size(data):
    """Returns width and height of a JPEG file that the program wrote."""
    at = data.index(b"\xff\xc0")
    return struct.unpack(">HH", data[at + 5 : at + 9])[::-1]


def check_full_size(folder):
    """Tests a photo with a texture larger than its working size in every output format at once, and the memory for 12 megapixels."""
    # The left half is far, the right half near. Lines two pixels wide vanish at the working size, a twentieth of the photo's.
    lines = bytes(v for x in range(4400) for v in ((250, 0, 0) if x in (1200, 1201) else (0, 250, 0) if x in (3000, 3001) else (90, 90, 90)))
    photo = file(folder, "wide.png", png(4400, 800, 3, lambda y: lines))
    depth = ["--depth", file(folder, "wide_depth.png", png(440, 80, 1, lambda y: bytes(40 if x < 220 else 200 for x in range(440))))]
    large = ["--size", "full", "--geometry-size", "220", "--quiet"]
    out = os.path.join(folder, "large")
    os.mkdir(out)
    path = lambda name: os.path.join(out, name)
    files = ["-o", path("wide.glb"), "--usdz", path("wide.usdz"), "--stereo-image", path("wide.png"), "--report", path("wide.json"), "--depth-map", path("depth.png")]
    video = ["--video", path("frames"), "--video-size", "2200", "--seconds", "0.1", "--fps", "10", "--path", "dolly-zoom"]
    result = subprocess.run([PROGRAM, photo, *depth, *large, *files, *video], capture_output=True, text=True, env=WITHOUT_MODELS)
    check(f"a photo at its full size is written in every format: {result.stderr}", result.returncode == 0 and len(os.listdir(out)) == 6)
    if result.returncode != 0:
        return
    glb = open(path("wide.glb"), "rb").read()
    content = json.loads(glb[20 : 20 + struct.unpack("<I", glb[12:16])[0]])
    binary = glb[28 + struct.unpack("<I", glb[12:16])[0] :]
    views = [content["bufferViews"][image["bufferView"]] for image in content["images"]]
    sizes = [jpeg_size(binary[v["byteOffset"] :]) for v in views]
    check(f"full size: the GLB has several textures of at most 4096 texels per side: {sizes}", is_whole_glb(glb) and len(sizes) >= 2 and max(max(s) for s in sizes) <= 4096)
    check("full size: the textures have at least as many texels as the photo has pixels", sum(w * h for w, h in sizes) > 4400 * 800)
    report = json.load(open(path("wide.json")))
    check(f"full size: the report states the sizes of photo, layers and textures: {report}", (report["width"], report["texture_width"], report["texture_height"]) == (220, 4400, 800) and report["textures"] >= len(sizes))
    pair = pixels(open(path("wide.png"), "rb").read())
    check(f"full size: the stereo picture has the photo's size per eye: {len(pair[0]) / 3} x {len(pair)}", len(pair) == 800 and len(pair[0]) == 3 * 8800)
    is_line = lambda row, x, color: row[3 * x + color] > 150 and row[3 * x + 1 - color] < 90
    check("full size: the stereo picture shows the thin lines of the photo", all(any(is_line(pair[400], x, color) for x in range(4400)) for color in (0, 1)))
    frame = open(os.path.join(path("frames"), "frame_00001.png"), "rb").read()
    check("full size: frames of a video have the requested size", struct.unpack(">II", frame[16:24]) == (2200, 400))
    with zipfile.ZipFile(path("wide.usdz")) as usdz:
        scene, textures = usdz.read("photo.usda").decode(), [n for n in usdz.namelist() if n.endswith(".jpg")]
        check(f"full size: the USDZ file has a mesh for each texture: {textures}", usdz.testzip() is None and len(textures) >= 2 and scene.count("def Mesh") == len(textures) and all(f"@{t}@" in scene for t in textures))
    shutil.copy(os.path.join(folder, "wide_depth.png"), os.path.join(path("frames"), "wide.png"))
    batch = subprocess.run([PROGRAM, "--batch", photo, "-o", out, "--depth", path("frames"), *large], capture_output=True, text=True, env=WITHOUT_MODELS)
    check(f"full size: a batch writes the same GLB file: {batch.stdout}", batch.returncode == 0 and open(path("wide.glb"), "rb").read() == glb)
    if subprocess.run([PROGRAM, photo, *depth, *large, "--compress", "-o", path("compressed.glb")], capture_output=True, env=WITHOUT_MODELS).returncode == 0:
        compressed = open(path("compressed.glb"), "rb").read()
        packed = json.loads(compressed[20 : 20 + struct.unpack("<I", compressed[12:16])[0]])
        check("full size: the compressed GLB has as many textures as the uncompressed one, all WebP", is_whole_glb(compressed) and [i["mimeType"] for i in packed["images"]] == ["image/webp"] * len(sizes))
    else:
        print("skipped a compressed file of several textures: the program was built without meshoptimizer or libwebp")
    run("a size that is neither a number nor full is refused", [photo, *depth, "--size", "whole"], ["--size", "full or a whole number"])

    program = open(PROGRAM, "rb").read()
    if b"AddressSanitizer" in program or b"ThreadSanitizer" in program:
        print("skipped the memory for 12 megapixels: sanitizers need additional memory")
        return
    photo = file(folder, "large.png", png(4000, 3000, 3, lambda y: bytes((x // 2 + y // 3 + 20 * (x // 40 + y // 40 & 1)) % 256 for x in range(4000) for _ in range(3)) if y % 40 == 0 else lines[:12000]))
    step = file(folder, "large_depth.png", png(400, 300, 1, lambda y: bytes(220 if 120 < x < 280 and y > 90 else 30 for x in range(400))))
    subprocess.run([PROGRAM, photo, "--depth", step, "--size", "full", "-o", path("large.glb"), "--report", path("large.json"), "--quiet"], env=WITHOUT_MODELS)
    report = json.load(open(path("large.json")))
    check(f"12 megapixels need at most 24 bytes per pixel: {report['peak_memory_bytes'] / 12e6}", report["texture_width"] == 4000 and report["peak_memory_bytes"] <= 24 * 12e6)


def is_written(data):
    return data[:2] == b"PK"


def npy(width, height, value):
    header = ("{'descr': '<f4', 'fortran_order': False, 'shape': (%d, %d), }" % (height, width)).ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + struct.pack("<f", value) * (width * height)


def run(name, arguments, expect=None, environment=None, program=PROGRAM):
    """Runs the program, and checks that it refuses its input with a message that contains the words of `expect`; None: that it succeeds."""
    with tempfile.TemporaryDirectory() as folder:
        output = os.path.join(folder, "out.glb")
        result = subprocess.run([program, *arguments, "-o", output, "--quiet"], capture_output=True, text=True, errors="replace", timeout=600, env=environment or WITHOUT_MODELS)
        written = os.listdir(folder)
        if expect is None:
            good = result.returncode == 0 and written == ["out.glb"] and open(output, "rb").read(4) == b"glTF" and result.stderr == ""
        else:
            # CLI11's own exit codes are above 100; a crash is negative.
            good = result.returncode >= 1 and not written and all(word in result.stderr for word in expect)
        check(name, good, f"exit code {result.returncode}, wrote {written}, said: {result.stderr.strip()[:600]}")


def check_report(name, arguments, expect, environment=None, program=PROGRAM):
    """Runs the program, and checks that the run succeeds and that its report contains the entries of `expect`."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "report.json")
        run(name, [*arguments, "--report", path], None, environment, program)
        report = json.load(open(path)) if os.path.exists(path) else {}
        check(f"{name}: {expect} in {report}", expect.items() <= report.items())


def check_notes(folder, small, small_depth):
    """Tests that the program prints unusual properties of a photo, and that its report and its line in a batch contain the same sentences."""
    random, width, height = Random(3), 384, 288
    photo = file(folder, "noted.png", png(width, height))
    maps = {"noise": lambda y: bytes(random.randrange(256) for _ in range(width)), "stairs": lambda y: bytes(20 + 18 * (x // 6 % 12) for x in range(width))}
    expected = {"noise": "the shortest silhouettes", "stairs": "the parallax is at most"}
    for name, row in maps.items():
        depth, report = file(folder, f"{name}.png", png(width, height, 1, row)), os.path.join(folder, "noted.json")
        said = subprocess.run([PROGRAM, photo, "--depth", depth, "-o", os.path.join(folder, "noted.glb"), "--report", report], capture_output=True, text=True).stderr
        lines = [line for line in said.splitlines() if line.startswith("photo3d: ")]
        facts = json.load(open(report))
        check(f"{name}: the program prints all notes of the report, found {lines}", lines == [f"photo3d: {photo}: {note}" for note in facts["notes"]] and any(expected[name] in line for line in lines))
        shutil.copy(depth, os.path.join(folder, "noted_depth.png"))
        line = json.loads(subprocess.run([PROGRAM, "--batch", photo, "-o", folder], capture_output=True, text=True).stdout)
        count = len(line.get("notes", []))
        check(f"{name}: the line of a batch has the notes of the report, found {line}", count == len(facts["notes"]) > 0 and expected[name] in "".join(line["notes"]))
        os.remove(os.path.join(folder, "noted_depth.png"))
    for arguments in [small, "--depth", small_depth], [SAMPLE]:
        said = subprocess.run([PROGRAM, *arguments, "-o", os.path.join(folder, "noted.glb"), "--report", report], capture_output=True, text=True).stderr
        check(f"an ordinary photo has no notes: {said}", "photo3d: " not in said and json.load(open(report))["notes"] == [])


def file(folder, name, content):
    path = os.path.join(folder, name)
    with open(path, "wb") as out:
        out.write(content)
    return path


def shortened_heic(heic):
    """Returns a HEIC file whose coded picture ends after a tenth of its data."""
    box = heic.index(b"iloc") + 4
    assert heic[box] < 2 and heic[box + 4] == 0x44, "lengths and offsets of 4 bytes"
    base_bytes = heic[box + 5] >> 4
    item = box + (12 if heic[box] == 0 else 14)  # the base offset of the first item; its extent follows
    offset, length = struct.unpack_from(">II", heic, item + base_bytes + 2)
    begin = last = int.from_bytes(heic[item : item + base_bytes], "big") + offset
    while (after := last + 4 + struct.unpack_from(">I", heic, last)[0]) < begin + length:
        last = after
    left, cut = (after - last - 4) // 10, bytearray(heic)
    struct.pack_into(">I", cut, last, left)
    struct.pack_into(">I", cut, item + base_bytes + 6, last + 4 + left - begin)
    return bytes(cut)


def check_cut_heic(folder):
    """Tests that the missing part of a HEIC picture does not show what was in memory before."""
    whole = os.path.join(folder, "whole.heic")
    if not shutil.which("heif-enc") or subprocess.run(["heif-enc", SAMPLE, "-o", whole], capture_output=True).returncode != 0:
        print("skipped a HEIC picture that ends early: there is no heif-enc that writes HEIC")
        return
    if b"Sanitizer" in open(PROGRAM, "rb").read() or os.confstr("CS_GNU_LIBC_VERSION") is None:
        print("skipped a HEIC picture that ends early: the program does not use malloc() of glibc")
        return
    cut, results = file(folder, "cut.heic", shortened_heic(open(whole, "rb").read())), []
    for fill in ("0", "1", "85"):  # glibc fills freed memory with this value, and allocated memory with its complement
        output = os.path.join(folder, f"cut{fill}.glb")
        said = subprocess.run([PROGRAM, cut, "-o", output, "--quiet", "--inpaint", "diffusion"], capture_output=True, text=True,
                              env={**os.environ, "LDI_MODELS": os.path.join(SOURCE, "examples/models"), "MALLOC_PERTURB_": fill})
        results.append(open(output, "rb").read() if said.returncode == 0 else said.stderr.encode())
    if b"this build cannot read" in results[0]:
        print("skipped a HEIC picture that ends early: the program was built without libheif")
        return
    check("a HEIC picture that ends early is the same, whatever was in memory before", len(set(results)) == 1 and is_whole_glb(results[0]), results[0][:300])


def main():
    with tempfile.TemporaryDirectory() as folder:
        sample = open(SAMPLE, "rb").read()
        small = file(folder, "small.png", png(60, 80))
        small_depth = file(folder, "step.png", png(60, 80, 1, lambda y: bytes(40 if x < 30 else 200 for x in range(60))))
        depth = ["--depth", small_depth]

        run("a photo with its depth map is converted", [small, *depth])
        run("a gray photo is converted", [file(folder, "gray.png", png(60, 80, 1)), *depth])
        run("a photo of one pixel is converted", [file(folder, "one.png", png(1, 1)), "--depth", file(folder, "one_depth.png", png(1, 1, 1))])
        run("a photo of one row is converted", [file(folder, "row.png", png(300, 1)), "--depth", file(folder, "row_depth.png", png(300, 1, 1))])
        run("a photo with a depth map of another size is converted", [SAMPLE, "--depth", file(folder, "d.npy", npy(96, 128, 1.0)), "--size", "256"])
        run("a CMYK photo is converted", [os.path.join(SOURCE, "tests/io/files/cmyk.jpg"), "--depth", file(folder, "c.npy", npy(24, 16, 1.0))])
        run("a photo of 100 megapixels is converted", [file(folder, "large.png", png(10000, 10000, 1)), "--depth", file(folder, "l.npy", npy(10, 10, 1.0)), "--size", "512"])

        for name, map_file, is_sheet in (("flat", file(folder, "flat.npy", npy(60, 80, 1.0)), True), ("stepped", small_depth, False)):
            said = subprocess.run([PROGRAM, small, "--depth", map_file, "-o", os.path.join(folder, "said.glb")], capture_output=True, text=True).stderr
            check(f"the program reports a single sheet for a {name} photo: {is_sheet}", ("single sheet" in said) == is_sheet)
        check_notes(folder, small, small_depth)

        run("a missing photo is refused", [os.path.join(folder, "none.jpg"), *depth], ["none.jpg", "expected", "found"])
        run("an empty photo is refused", [file(folder, "empty.jpg", b""), *depth], ["empty.jpg", "expected", "found"])
        run("a truncated photo is refused", [file(folder, "cut.jpg", sample[: len(sample) // 2]), *depth], ["cut.jpg", "expected", "found"])
        large, little_memory = file(folder, "large.png", png(9000, 9000, 1)), lambda: resource.setrlimit(resource.RLIMIT_AS, (200 << 20, 200 << 20))
        said = subprocess.run([PROGRAM, large, *depth, "-o", os.path.join(folder, "out.glb")], capture_output=True, text=True, preexec_fn=little_memory)
        check(f"short memory: {said.returncode}, {said.stderr}", said.returncode == 75 and "memory" in said.stderr)
        run("a GIF of one pixel with a depth map of other proportions is refused", [file(folder, "a.gif", b"GIF89a\1\0\1\0\x80\0\0\0\0\0\xff\xff\xff,\0\0\0\0\1\0\1\0\0\2\2D\1\0;"), *depth], ["step.png", "proportions", "1 x 1"])
        check_cut_heic(folder)
        run("a text file as a photo is refused", [file(folder, "a.txt", b"hello"), *depth], ["a.txt", "expected", "found"])
        run("a photo without a depth map is converted", [small])
        with_companion, models = shutil.copy(small, os.path.join(folder, "pair.png")), {"LDI_MODELS": os.path.join(SOURCE, "examples/models")}
        companion = shutil.copy(small_depth, os.path.join(folder, "pair_depth.png"))
        check_report("the program uses a depth map beside the photo", [with_companion], {"depth": companion})
        network = os.path.join(models["LDI_MODELS"], MODELS["depth"])
        check_report("--depth none selects the network despite a depth map beside the photo", [with_companion, "--depth", "none"], {"depth": network}, models)
        check_report("--depth-model has priority over a depth map beside the photo", [with_companion, "--depth-model", network], {"depth": network})
        os.mkdir(os.path.join(folder, "bin"))  # the program searches the folder's own share/ldi, which this test does not create
        alone = shutil.copy(PROGRAM, os.path.join(folder, "bin"))
        run("a photo without any source of depth is refused", [small], ["--depth FILE", "tiefenrausch_small.safetensors"], program=alone)
        file(folder, "odd_depth.png", png(30, 30, 1))
        said = subprocess.run([PROGRAM, shutil.copy(small, os.path.join(folder, "odd.png")), "-o", os.path.join(folder, "odd.glb")], capture_output=True, text=True, env=models)
        check(f"a depth map beside the photo with other proportions is not used: {said.stderr}", said.returncode == 0 and "odd_depth.png" in said.stderr and "proportions" in said.stderr)
        said = subprocess.run([PROGRAM, "--batch", os.path.join(folder, "odd.png"), "-o", folder, "--report", folder, "--quiet"], capture_output=True, text=True, env=models)
        notes = json.loads(said.stdout).get("notes", [])
        check(f"a batch states in its line and in the report that the map is not used, and --quiet suppresses other messages: {said}", said.stderr == "" and any(note.startswith("the depth map was not used: ") and "odd_depth.png" in note for note in notes) and json.load(open(os.path.join(folder, "odd.json")))["notes"] == notes)
        shutil.copy(small, os.path.join(folder, "torn.png")), file(folder, "torn_depth.png", b"no map")
        said = subprocess.run([PROGRAM, "--batch", os.path.join(folder, "torn.png"), "-o", folder], capture_output=True, text=True, env=models)
        check(f"a batch also ignores a file beside the photo that is not a depth map: {said}", said.returncode == 0 and "torn_depth.png" in "".join(json.loads(said.stdout).get("notes", [])))
        run("a photo whose only source of depth is an unusable map is refused", [os.path.join(folder, "odd.png")], ["odd.png: expected --depth FILE, --depth-model PATH", "none of these", "odd_depth.png", "proportions"], program=alone)
        run("a depth map of other proportions is refused", [small, "--depth", file(folder, "wide.npy", npy(80, 60, 1.0))], ["wide.npy", "proportions"])
        run("a depth map without valid values is refused", [small, "--depth", file(folder, "nan.npy", npy(60, 80, float("nan")))], ["nan.npy", "valid"])
        run("a depth map with impossibly large distances is refused", [small, "--depth", file(folder, "far.npy", npy(60, 80, 1e10)), "--depth-kind", "meters"], ["far.npy: expected", "meters"])
        run("a truncated depth map is refused", [small, "--depth", file(folder, "cut.npy", npy(60, 80, 1.0)[:5000])], ["cut.npy", "expected", "found"])
        run("a report path below a file is refused", [small, *depth, "--report", os.path.join(small, "no/folder.json")], ["small.png", "expected"])
        run("a size of 0 is refused", [small, *depth, "--size", "0"], ["--size"])
        run("a photo is converted without texture and grain", [small, *depth, "--texture", "0", "--grain", "0"])
        run("a negative strength of texture is refused", [small, *depth, "--texture", "-1"], ["--texture"])
        run("a negative strength of grain is refused", [small, *depth, "--grain", "-1"], ["--grain"])
        run("an unknown inpainting method is refused", [small, *depth, "--inpaint", "magic"], ["--inpaint", "diffusion", "network"])
        weights = os.path.join(SOURCE, "tests/networks/files/farbrausch_weights.safetensors")
        run("a photo is converted with an inpainting network", [small, *depth, "--inpainting-model", weights])
        run("a photo is converted with a PartialConv network", [small, *depth, "--inpainting-model", os.path.join(SOURCE, "tests/networks/files/partial_convolution_weights.safetensors")])
        run("8-bit arithmetic is refused if the weights have no ranges", [small, *depth, "--inpainting-model", weights, "--arithmetic", "int8"], ["int8", "export.py"])
        run("an unknown arithmetic is refused", [small, *depth, "--inpainting-model", weights, "--arithmetic", "float16"], ["--arithmetic", "int8"])
        run("an inpainting network together with --inpaint diffusion is refused", [small, *depth, "--inpainting-model", weights, "--inpaint", "diffusion"], ["--inpainting-model", "--inpaint diffusion"])
        run("a truncated inpainting network is refused", [small, *depth, "--inpainting-model", file(folder, "cut.safetensors", open(weights, "rb").read()[:9000])], ["cut.safetensors", "tensor", "expected"])
        run("a photo as an inpainting network is refused", [small, *depth, "--inpainting-model", SAMPLE], ["sample.jpg", "expected"])

        decider = os.path.join(SOURCE, "examples/models/silhouettes.safetensors")
        coarse = ["--depth", file(folder, "coarse.png", png(30, 40, 1, lambda y: bytes(40 if x < 15 else 200 for x in range(30))))]
        found = {"LDI_MODELS": os.path.dirname(decider)}
        check_report("a silhouette network determines the silhouettes of a photo with a coarse depth map", [small, *coarse, "--silhouette-model", decider], {"silhouettes": decider})
        check_report("the program uses the silhouette network that it finds", [small, *coarse], {"silhouettes": decider}, found)
        check_report("alignment determines the silhouettes of a photo with a depth map of its size", [small, *depth], {"silhouettes": "alignment"}, found)
        check_report("alignment determines the silhouettes with --silhouette-model none", [small, *coarse, "--silhouette-model", "none"], {"silhouettes": "alignment"}, found)
        run("a silhouette network is refused beside --preset paper", [small, *coarse, "--preset", "paper", "--silhouette-model", decider], ["--silhouette-model", "--preset paper"])
        check_report("--preset paper aligns silhouettes", [small, *coarse, "--preset", "paper"], {"silhouettes": "alignment"}, found)
        run("an inpainting network as a silhouette network is refused", [small, *depth, "--silhouette-model", weights], ["farbrausch_weights.safetensors", "a silhouette network", "found farbrausch"])
        run("a truncated silhouette network is refused", [small, *depth, "--silhouette-model", file(folder, "cut.safetensors", open(decider, "rb").read()[:9000])], ["cut.safetensors", "tensor", "expected"])

        student = os.path.join(SOURCE, "tests/io/files/tiefenrausch_weights.safetensors")
        run("a photo is converted with a depth network in one file", [small, "--depth-model", student])
        run("an inpainting network as a depth network is refused", [small, "--depth-model", weights], ["farbrausch_weights.safetensors", "a depth network", "found farbrausch"])
        run("a depth network as an inpainting network is refused", [small, *depth, "--inpainting-model", student], ["tiefenrausch_weights.safetensors", "an inpainting network", "found tiefenrausch_small"])
        run("a truncated depth network is refused", [small, "--depth-model", file(folder, "cut.safetensors", open(student, "rb").read()[:9000])], ["cut.safetensors", "tensor", "expected"])

        # Tests the search for weights without an option, after moving the program with and without its data.
        models, alone, other = os.path.join(SOURCE, "examples/models"), os.path.join(folder, "alone"), os.path.join(folder, "other")
        os.mkdir(alone), os.mkdir(other)
        moved, both = shutil.copy(PROGRAM, alone), {"LDI_MODELS": models}
        shutil.copy(weights, os.path.join(other, "farbrausch.safetensors"))
        run("a photo without a depth map is refused if the program finds no weights", [small], ["--depth-model", "tiefenrausch_small.safetensors", "share/ldi/models"], program=moved)
        check_report("without its weights, the program converts a photo with a depth map", [small, *coarse], {"depth": coarse[1], "silhouettes": "alignment", "inpainting": "diffusion"}, program=moved)
        run("--inpaint network is refused if the program finds no weights", [small, *depth, "--inpaint", "network"], ["--inpainting-model", "farbrausch.safetensors", "share/ldi/models"], program=moved)
        check_report("the program finds weights through LDI_MODELS", [small], {name: os.path.join(models, file) for name, file in MODELS.items()}, both, moved)
        run("a missing folder in LDI_MODELS is refused", [small], ["LDI_MODELS", "no/such"], {"LDI_MODELS": "no/such"})
        share = os.path.join(folder, "share/ldi/models")
        shutil.copytree(models, share)
        check_report("the program finds weights in its own share folder", [small], {name: os.path.join(share, file) for name, file in MODELS.items()}, program=moved)
        check_report("weights that are missing in LDI_MODELS are found in the share folder", [small], {"depth": os.path.join(share, MODELS["depth"]), "inpainting": os.path.join(other, MODELS["inpainting"])}, {"LDI_MODELS": other}, moved)
        check_report("an option has priority over LDI_MODELS", [small, "--depth-model", student, "--inpaint", "diffusion"], {"depth": student, "inpainting": "diffusion"}, both)
        help_text = subprocess.run([moved, "--help"], capture_output=True, text=True).stdout
        check("the help names the places that are searched for weights", "LDI_MODELS" in help_text and share in help_text)

        # A page for a browser; tests/viewer opens it in real browsers.
        viewer = file(folder, "viewer.html", b"1<title>3D photo</title>2<!-- the photo goes here -->3")
        page, odd_name = os.path.join(folder, "page.html"), file(folder, "a<b&c.png", png(60, 80))
        run("a page is written", [odd_name, *depth, "--html", page, "--viewer", viewer])
        text = open(page, encoding="utf-8").read() if os.path.exists(page) else ""
        parts = re.fullmatch(r'1<title>(.*)</title>2<photo-3d .*width="60" height="80">\s*<img .*base64,([^"]*)">\s*</photo-3d>\s*<script .*>([^<]*)</script>3\s*', text)
        check("a page has the title, a JPEG poster and a complete GLB file", parts and parts[1] == "a&lt;b&amp;c" and base64.b64decode(parts[2])[:2] == b"\xff\xd8" and is_whole_glb(base64.b64decode(parts[3])))
        run("a page is refused if the viewer is missing", [small, *depth, "--html", page, "--viewer", os.path.join(folder, "none.html")], ["none.html", "examples/viewer/build.sh"])
        run("a file that is not a viewer is refused", [small, *depth, "--html", page, "--viewer", SAMPLE], ["sample.jpg", "examples/viewer/build.sh"])
        run("a page path below a file is refused", [small, *depth, "--html", os.path.join(small, "no/page.html"), "--viewer", viewer], ["small.png", "expected"])

        check_written_files(folder)
        check_full_size(folder)

        # Videos.
        frames, depth_map = os.path.join(folder, "frames"), os.path.join(folder, "map.png")
        # A checkerboard with squares five pixels wide, so that all frames differ.
        checks = file(folder, "checks.png", png(60, 80, 3, lambda y: bytes(60 + 120 * ((x // 5 + y // 5) % 2) for x in range(60) for _ in range(3))))
        video = [checks, *depth, "--fps", "4", "--seconds", "1", "--video"]
        run("a stereo video on a circular path is written as frames", [*video, frames, "--path", "circle", "--stereo", "side-by-side", "--depth-map", depth_map])
        run("a written depth map is read again", [small, "--depth", depth_map, "--depth-zero-is-unknown"])
        run("a video is refused if ffmpeg is missing", [*video, os.path.join(folder, "a.mp4")], ["a.mp4", "ffmpeg", "PNG"], {"PATH": folder})
        run("an unknown path is refused", [*video, frames, "--path", "spiral"], ["spiral", "expected", "found"])
        keys = '[{"time": %d, "position": [0, 0, 0], "target": [0, 0, -2]}, {"time": 1, "position": [0.1, 0, 0], "target": [0, 0, -2], "zoom": 1.2}]'
        run("a video follows a custom path", [*video, frames, "--path", file(folder, "keys.json", (keys % 0).encode())])
        wide = json.dumps([{"time": t, "position": [0, 0, 0], "target": [0, 0, -2], "zoom": 0.3} for t in (0, 1)])
        far_frames = os.path.join(folder, "far_frames")
        run("a video can show the photo from afar", [*video[:-1], "--video", far_frames, "--path", file(folder, "wide.json", wide.encode())])
        darkest = min(min(row) for name in os.listdir(far_frames) for row in pixels(open(os.path.join(far_frames, name), "rb").read()))
        check(f"seen from afar, surfaces continue past the photo's border: {darkest}", darkest > 40)  # the squares of the checkerboard have gray levels 60 and 180
        run("key frames in the wrong order are refused", [*video, frames, "--path", file(folder, "late.json", (keys % 2).encode())], ["increasing times"])
        run("key frames that are not JSON are refused", [*video, frames, "--path", file(folder, "text.json", b"hello")], ["text.json", "key frames"])
        if shutil.which("ffmpeg"):
            for name in ("a.mp4", "a.webp", "a.gif", "$(touch x) '.mp4"):
                run(f"the video {name} is written", [*video, os.path.join(folder, name), "--stereo", "anaglyph"])
            run("a video path below a file is refused", [*video, os.path.join(small, "no/a.mp4")], ["small.png", "expected"])
            for name, mark in (("a.mp4", b"moov"), ("a.webp", b"ANMF"), ("a.gif", b"NETSCAPE2.0"), ("$(touch x) '.mp4", b"moov")):
                check(f"{name} is a video or animation", mark in open(os.path.join(folder, name), "rb").read())
            check("no unfinished video is left", not [name for name in os.listdir(folder) if name.endswith(".part")])
        else:
            print("skipped videos: there is no ffmpeg")
        check("a video of one second at 4 frames per second has 4 frames", len(os.listdir(frames)) == 4)

        model = os.path.join(SHARED, "tiefenrausch/model")
        if os.path.isdir(model):
            network, weights = (open(os.path.join(model, n), "rb").read() for n in ("tiefenrausch.pb", "tiefenrausch_init.pb"))
            for name, first, second in (("cut", network, weights[:1000000]), ("swapped", weights, network), ("empty", b"", b"")):
                broken = os.path.join(folder, name)
                os.mkdir(broken)
                file(broken, "tiefenrausch.pb", first), file(broken, "tiefenrausch_init.pb", second)
                run(f"a depth network whose files are {name} is refused", [small, "--depth-model", broken], ["expected", "found"])
        else:
            print("skipped the damaged depth network: ../shared/tiefenrausch is absent")

        report = os.path.join(folder, "report.json")
        run("a report is written", [small, *depth, "--report", report, "--fov", "60", "--threads", "2", "--stages", os.path.join(folder, "stages")])
        figures = json.load(open(report))
        missing = {"depth filter", "connected components", "occluded geometry", "color inpainting", "chart generation", "chart padding", "meshing"} - set(
            figures["milliseconds"]) | {"pixels", "layers", "charts", "triangles", "glb_bytes", "peak_memory_bytes"} - set(figures)
        pictures = sorted(os.listdir(os.path.join(folder, "stages")))
        check(f"the report is complete and the pictures of the stages exist: missing {missing}, pictures {pictures}", not missing and len(pictures) >= 12)
    finish()


main()
