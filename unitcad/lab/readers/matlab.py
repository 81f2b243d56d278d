"""MATLAB files of versions 4 to 7.2, by scipy: vectors, and the columns of matrices. Version 7.3 is HDF5."""

from __future__ import annotations

import struct
import warnings
import zlib
from collections.abc import Iterator
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, whosmat

from unitcad.lab.readers import Channel, Layout, Unreadable, expect_held

ENDINGS = (".mat",)
LIBRARY = "scipy"
MOST_BYTES = 2**27
"""Bytes of the decompressed file; a byte may expand to a number of eight."""
DEEPEST = 3
"""Structs in structs that are looked into."""


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the numeric vectors and columns of a file; a struct's field x is named struct.x. Raises Unreadable."""

    _expect_small(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        listed = whosmat(str(path))
        stated = sum(prod(shape) for _, shape, _ in listed)
        expect_held(path, "the file", stated, 8 * MOST_BYTES)
        names = [
            name for name, _, kind in listed if kind.removeprefix("u").startswith(("int", "double", "single", "struct"))
        ]
        data = loadmat(str(path), variable_names=names, struct_as_record=False, squeeze_me=False)
    found = [channel for name in names if name in data for channel in _columns(name, data[name], 0)]
    if not found:
        raise Unreadable(str(path), None, "has no vector and no matrix of numbers")
    return found


def _expect_small(path: Path) -> None:
    """Raise Unreadable if the elements of a version 5 file take more than MOST_BYTES: whosmat looks into no struct."""
    with open(path, "rb") as file:
        order = {b"IM": "<", b"MI": ">"}.get(file.read(128)[126:])
        size, total = path.stat().st_size, 0
        while order and len(tag := file.read(8)) == 8:
            kind, length = struct.unpack(f"{order}II", tag)
            if length > size - file.tell():
                raise Unreadable(str(path), None, f"an element states {length} bytes beyond the end: it is damaged")
            if kind != _COMPRESSED:
                total += length
                file.seek(length, 1)
            else:
                packed, unpack = file.read(length), zlib.decompressobj()
                while packed and not unpack.eof and total <= MOST_BYTES:
                    total += len(unpack.decompress(packed, 2**20))
                    packed = unpack.unconsumed_tail
            if total > MOST_BYTES:
                limit = f"states more than {MOST_BYTES} bytes of numbers; cut the record, or save it with -v7.3"
                raise Unreadable(str(path), None, limit)


_COMPRESSED = 15
"""The type of a compressed element."""


def _columns(name: str, value: Any, depth: int) -> Iterator[Channel]:
    """Yield the columns of two numbers or more; those of a matrix are named name:1, name:2, as its longer side runs."""
    if not isinstance(value, np.ndarray) or value.ndim != 2:
        return
    if value.dtype == object:
        fields = getattr(value.flat[0], "_fieldnames", None) if value.size == 1 else None
        for field in fields or () if depth < DEEPEST else ():
            yield from _columns(f"{name}.{field}", getattr(value.flat[0], field), depth + 1)
    elif value.dtype.kind in "fiu" and max(value.shape) > 1:
        matrix = value if value.shape[0] >= value.shape[1] else value.T
        for i, column in enumerate(matrix.T, 1):
            yield Channel(column, name if matrix.shape[1] == 1 else f"{name}:{i}")
