"""GLB files from a document and numbers."""

import json
import struct

import numpy as np

TYPES = {
    np.dtype("<u1"): 5121,
    np.dtype("<i2"): 5122,
    np.dtype("<u2"): 5123,
    np.dtype("<u4"): 5125,
    np.dtype("<f4"): 5126,
}


def packed(document, binary=b"", *, version=2):
    """The file of a document (or of JSON as bytes) and its binary chunk."""
    text = document if isinstance(document, bytes) else json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", version, 12 + len(chunks)) + chunks


def scene(
    points,
    corners,
    nodes=None,
    *,
    mode=None,
):
    """The document and the numbers of one mesh in nodes that place it; positions as given, corners unsigned."""
    arrays = [np.ascontiguousarray(points), *([] if corners is None else [np.ascontiguousarray(corners).ravel()])]
    binary, views, accessors = b"", [], []
    for array in arrays:
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": array.nbytes})
        kind = "VEC3" if array.ndim == 2 else "SCALAR"
        accessors.append(
            {"bufferView": len(views) - 1, "componentType": TYPES[array.dtype], "count": len(array), "type": kind}
        )
        binary += array.tobytes() + bytes(-array.nbytes % 4)
    primitive = {"attributes": {"POSITION": 0}}
    primitive |= {} if corners is None else {"indices": 1}
    primitive |= {} if mode is None else {"mode": mode}
    document = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": nodes or [{"mesh": 0}],
        "meshes": [{"primitives": [primitive]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    return document, binary
