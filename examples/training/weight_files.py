"""Weight files in the safetensors format, as the library reads them (include/ldi/formats/safetensors.hpp)."""
import json
import os

import numpy as np

CODES = {np.dtype(np.float16): "F16", np.dtype(np.float32): "F32", np.dtype(np.int32): "I32", np.dtype(np.uint8): "U8"}


def write_safetensors(path, tensors, metadata):
    """Writes eight bytes of header length, a JSON header (padded with spaces to a multiple of 8), and then all tensors, little-endian and
    row-major. tensors: {name: array}; metadata: {string: string}."""
    header, offset = {"__metadata__": metadata}, 0
    for name, tensor in tensors.items():
        header[name] = {"dtype": CODES[tensor.dtype], "shape": list(tensor.shape), "data_offsets": [offset, offset + tensor.nbytes]}
        offset += tensor.nbytes
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    with open(path + ".part", "wb") as file:
        file.write(np.array(len(text), "<u8").tobytes())
        file.write(text)
        for tensor in tensors.values():
            file.write(np.ascontiguousarray(tensor).tobytes())
    os.replace(path + ".part", path)


def read_safetensors(path):
    """Returns ({name: array}, {string: string}): tensors and metadata."""
    dtypes = {code: dtype for dtype, code in CODES.items()}
    with open(path, "rb") as file:
        header = json.loads(file.read(int(np.frombuffer(file.read(8), "<u8")[0])))
        body = file.read()
    metadata = header.pop("__metadata__", {})
    return {name: np.frombuffer(body[slice(*entry["data_offsets"])], dtypes[entry["dtype"]]).reshape(entry["shape"])
            for name, entry in header.items()}, metadata
