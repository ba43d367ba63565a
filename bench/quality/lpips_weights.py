#!/usr/bin/env python3
"""Writes the tensors of a NumPy archive of float32 arrays as safetensors, which ldi reads: the weights of LPIPS.

    lpips_weights.py ../shared/lpips/lpips_squeeze_oihw.npz build/lpips_squeeze.safetensors

Needs only Python, not NumPy.
"""
import ast
import json
import struct
import sys
import zipfile


def array(file):
    """Returns shape and bytes of an .npy file."""
    if file[:6] != b"\x93NUMPY":
        raise SystemExit("expected an .npy file, found other data")
    size = struct.unpack("<H", file[8:10])[0] if file[6] == 1 else struct.unpack("<I", file[8:12])[0]
    start = 10 if file[6] == 1 else 12
    header = ast.literal_eval(file[start:start + size].decode("latin-1"))
    if header["descr"] != "<f4" or header["fortran_order"]:
        raise SystemExit(f"expected float32 in C order, found {header}")
    return list(header["shape"]), file[start + size:]


def main(source, target):
    header, values, at = {}, [], 0
    with zipfile.ZipFile(source) as archive:
        for name in archive.namelist():
            shape, data = array(archive.read(name))
            header[name.removesuffix(".npy")] = {"dtype": "F32", "shape": shape, "data_offsets": [at, at + len(data)]}
            values.append(data)
            at += len(data)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    with open(target, "wb") as out:
        out.write(struct.pack("<Q", len(text)) + text + b"".join(values))


if __name__ == "__main__":
    main(*sys.argv[1:])
