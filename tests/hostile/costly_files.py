"""Writes a sound photo, and small files that would take long to process if ldi did not limit its work per file.

    costly_files.py FOLDER SOUND_PHOTO

A file's name starts with its kind. hostile.py chooses the program's arguments by this kind.
"""
import io
import json
import os
import struct
import subprocess
import sys
import tempfile
import zlib

from PIL import Image

PHOTO = Image.open("examples/photo3d/sample.jpg").convert("RGB").resize((160, 120))


def jpeg():
    written = io.BytesIO()
    PHOTO.save(written, "JPEG", quality=85)
    return written.getvalue()


def segment(marker, content):
    return bytes([0xFF, marker]) + struct.pack(">H", len(content) + 2) + content


def with_segments(segments):
    return jpeg()[:2] + segments + jpeg()[2:]


def extended_xmp(packet):
    identifier = b"A" * 32
    note = b'<r xmlns:n="http://ns.adobe.com/xmp/note/" n:HasExtendedXMP="' + identifier + b'"/>'
    result = segment(0xE1, b"http://ns.adobe.com/xap/1.0/\0" + note)
    for place in range(0, len(packet), 65_000):
        fields = identifier + struct.pack(">II", len(packet), place)
        result += segment(0xE1, b"http://ns.adobe.com/xmp/extension/\0" + fields + packet[place:place + 65_000])
    return result


def xmp_namespaces():
    """16 appended pictures, each with 4,900 properties inside 20 elements that declare 250 namespaces each."""
    declarations = " ".join(f'xmlns:n{i:03}="u"' for i in range(250))
    packet = f"<r {declarations}>" * 20 + "<q:p/>" * 4900 + "</r>" * 20
    picture = with_segments(extended_xmp(packet.encode()))
    directory_size = 4 + 8 + 2 + 12 + 16 * 16
    first = len(with_segments(segment(0xE2, bytes(directory_size))))
    entries = b"".join(struct.pack(">IIIHH", 0, len(picture), first + i * len(picture) - 10, 0, 0) for i in range(16))
    directory = b"MM\0*" + struct.pack(">IHHHII", 8, 1, 0xB002, 7, len(entries), 22) + entries
    return with_segments(segment(0xE2, b"MPF\0" + directory)) + picture * 16


def tiff(tile, width, height, tiles):
    """A picture of PackBits tiles of which only a small part is visible."""
    numbers = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, 1, 1 << 16), (259, 3, 1, 32773 << 16), (262, 3, 1, 1 << 16),
               (277, 3, 1, 1 << 16), (322, 4, 1, tile[0]), (323, 4, 1, tile[1]), (324, 4, tiles, 400), (325, 4, tiles, 400 + 4 * tiles)]
    start = 400 + 8 * tiles
    if tiles == 1:
        numbers[-2:], start = [(324, 4, 1, 400), (325, 4, 1, 100_000)], 400
    file = b"MM\0*" + struct.pack(">IH", 8, len(numbers)) + b"".join(struct.pack(">HHII", *entry) for entry in numbers)
    file = file.ljust(400, b"\0")
    if tiles > 1:
        file += struct.pack(f">{tiles}I", *[start] * tiles) + struct.pack(f">{tiles}I", *[100_000] * tiles)
    return file + b"\x81\xAA" * 50_000


def tiff_of_fax(width):
    """One row of Group 4 fax codes, for which libtiff allocates large tables."""
    entries = [(256, 4, 1, width), (257, 4, 1, 1), (258, 3, 1, 1 << 16), (259, 3, 1, 4 << 16), (262, 3, 1, 0),
               (273, 4, 1, 400), (277, 3, 1, 1 << 16), (278, 4, 1, 1), (279, 4, 1, 100_000)]
    file = b"MM\0*" + struct.pack(">IH", 8, len(entries)) + b"".join(struct.pack(">HHII", *entry) for entry in entries)
    return file.ljust(400, b"\0") + b"\x81\xAA" * 50_000


def tiff_strips(height, size):
    """Strips of one row, each of which contains all of the picture data."""
    places = 8 + 2 + 9 * 12 + 4
    sizes, data = places + 4 * height, places + 8 * height
    entries = [(256, 4, 1, 16), (257, 4, 1, height), (258, 3, 1, 8 << 16), (259, 3, 1, 32773 << 16), (262, 3, 1, 1 << 16),
               (273, 4, height, places), (277, 3, 1, 1 << 16), (278, 4, 1, 1), (279, 4, height, sizes)]
    file = b"MM\0*" + struct.pack(">IH", 8, len(entries)) + b"".join(struct.pack(">HHII", *entry) for entry in entries) + bytes(4)
    return file + struct.pack(">I", data) * height + struct.pack(">I", size) * height + b"\x81\xAA" * (size // 2)


def profile(elements):
    """A color profile whose transform has many elements, all of which refer to the same bytes."""
    matrix = b"matf" + bytes(4) + struct.pack(">HH", 3, 3) + struct.pack(">12f", 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.001, 0, 0)
    place = 16 + 8 * elements
    tag = b"mpet" + bytes(4) + struct.pack(">HHI", 3, 3, elements) + struct.pack(">II", place, len(matrix)) * elements + matrix
    start = 128 + 4 + 12
    header = struct.pack(">I4xI4s4s4s6H4s", start + len(tag), 0x04300000, b"mntr", b"RGB ", b"XYZ ", 2020, 1, 1, 0, 0, 0, b"acsp")
    header = header.ljust(68, b"\0") + struct.pack(">3I", 0xF6D6, 0x10000, 0xD32D)
    return header.ljust(128, b"\0") + struct.pack(">I", 1) + b"D2B1" + struct.pack(">II", start, len(tag)) + tag


def png_with_profile(content):
    written = io.BytesIO()
    PHOTO.save(written, "PNG", icc_profile=content)
    return written.getvalue()


def png_of_empty_blocks(millions):
    """One pixel, after empty blocks of compressed data of 10 bits each."""
    def chunk(kind, content):
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    data = b"\x78\x01" + b"\x02\x08\x20\x80\0" * (250_000 * millions) + zlib.compress(b"\0\x80")[2:]
    header = struct.pack(">IIBBBBB", 1, 1, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def heic(size):
    """Returns a HEIC file of this size, and the places of its item's location, its data, its last slice, and its end."""
    with tempfile.TemporaryDirectory() as folder:
        picture, coded = os.path.join(folder, "a.png"), os.path.join(folder, "a.heic")
        PHOTO.resize(size).save(picture)
        subprocess.run(["heif-enc", "-q", "1", picture, "-o", coded], check=True, capture_output=True)
        with open(coded, "rb") as file:
            content = bytearray(file.read())
    box = content.index(b"iloc") + 4
    assert content[box] == 0 and content[box + 4] == 0x44 and content[box + 5] == 0x40, "offsets and lengths of 4 bytes"
    base, _, offset, length = struct.unpack_from(">IHII", content, box + 12)
    begin = last = base + offset
    while (after := last + 4 + struct.unpack_from(">I", content, last)[0]) < begin + length:
        last = after
    return content, box + 12, begin, last, after


def heic_of_repeated_slice(times):
    """A HEIC picture whose only slice is there many times; a decoder decodes all of them."""
    content, location, begin, last, end = heic((1920, 1440))
    data = content[begin:last] + content[last:end] * times
    struct.pack_into(">IHII", content, location, len(content) + 8, 1, 0, len(data))
    return content + struct.pack(">I", 8 + len(data)) + b"mdat" + data


def damaged_heic_of_stated_size(side):
    """A small HEIC file that states a large picture, and whose slice is noise."""
    content, _, _, last, end = heic((64, 64))
    content[last + 6:end] = bytes(i * 193 % 251 for i in range(end - last - 6))
    struct.pack_into(">II", content, content.index(b"ispe") + 8, side, side)
    return content


def safetensors(tensors):
    with open("examples/models/tiefenrausch_small.safetensors", "rb") as sound:
        header, data = {"__metadata__": json.loads(sound.read(struct.unpack("<Q", sound.read(8))[0]))["__metadata__"]}, b""
    for name, (kind, shape, content) in tensors.items():
        header[name] = {"dtype": kind, "shape": shape, "data_offsets": [len(data), len(data) + len(content)]}
        data += content
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + data


def additions(count):
    """Weights of a depth network of one convolution and many additions."""
    rows = struct.pack("<5i", 0, 0, 0, 1, 1) + struct.pack("<5i", 2, 1, 1, 0, 0) * count
    operators = count + 1
    return safetensors({
        "operators": ("I32", [operators, 5], rows),
        "scales": ("F32", [operators + 1], struct.pack("<f", 0.02) * (operators + 1)),
        "weight_scales": ("F32", [operators], struct.pack("<f", 0.01) * operators),
        "zero_points": ("U8", [operators + 1], bytes(operators + 1)),
        "weight_zero_points": ("U8", [operators], bytes(operators)),
        "0.weight": ("U8", [1, 1, 1, 3], bytes(3)),
        "0.bias": ("I32", [1], bytes(4)),
    })


def main():
    folder, sound = sys.argv[1:3]
    PHOTO.save(sound, "JPEG", quality=85)
    files = {
        "xmp_namespaces_in_16_pictures.jpg": xmp_namespaces(),
        "tiff_one_huge_tile.tif": tiff((65536, 65536), 64, 64, 1),
        "tiff_many_high_tiles.tif": tiff((16, 2_000_000), 1024, 1, 64),
        "tiff_strips_of_the_same_bytes.tif": tiff_strips(1_000_000, 1_000_000),
        "png_profile_of_26000_elements.png": png_with_profile(profile(26_000)),
        "png_of_8_million_empty_blocks.png": png_of_empty_blocks(8),
        "tiff_one_row_of_fax_codes.tif": tiff_of_fax(40_000_000),
        "heic_of_a_slice_450_times.heic": heic_of_repeated_slice(450),
        "heic_damaged_of_58_megapixels.heic": damaged_heic_of_stated_size(7600),
        "weights_65535_additions.safetensors": additions(65_535),
    }
    for name, content in files.items():
        with open(os.path.join(folder, name), "wb") as file:
            file.write(content)


main()
