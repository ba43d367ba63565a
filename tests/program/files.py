"""Writes and reads PNG files for the tests of the program, and checks whether GLB files are complete."""
import struct
import zlib


def png(width, height, channels=3, rows=None):
    """Encodes a PNG file whose row y is rows(y); by default, row y has gray level y."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    packer, data = zlib.compressobj(1), []
    for y in range(height):
        data.append(packer.compress(b"\0" + (rows(y) if rows else bytes([y % 256]) * (width * channels))))
    data.append(packer.flush())
    header = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", b"".join(data)) + chunk(b"IEND", b"")


def pixels(data):
    """Returns the rows of an 8-bit RGB PNG file, each a bytes object."""
    width, height = struct.unpack(">II", data[16:24])
    packed, at = b"", 8
    while at < len(data):
        length = struct.unpack(">I", data[at : at + 4])[0]
        packed += data[at + 8 : at + 8 + length] if data[at + 4 : at + 8] == b"IDAT" else b""
        at += 12 + length
    raw, rows, above = zlib.decompress(packed), [], bytes(3 * width)
    for y in range(height):
        kind, row = raw[y * (3 * width + 1)], bytearray(raw[y * (3 * width + 1) + 1 : (y + 1) * (3 * width + 1)])
        for i in range(3 * width):
            left, up, corner = row[i - 3] if i >= 3 else 0, above[i], above[i - 3] if i >= 3 else 0
            nearest = min((left, up, corner), key=lambda v: abs(left + up - corner - v))
            row[i] = (row[i] + (0, left, up, (left + up) // 2, nearest)[kind]) % 256
        rows.append(bytes(row))
        above = rows[-1]
    return rows


def is_whole_glb(data):
    return data[:4] == b"glTF" and struct.unpack("<I", data[8:12])[0] == len(data)
