"""HDF5, and MATLAB files of version 7.3, which are HDF5, by h5py."""

from __future__ import annotations

from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from unitcad.lab.readers import MOST_NUMBERS, Channel, Layout, Unreadable, expect_held

ENDINGS = (".h5", ".hdf5")
LIBRARY = "h5py"
MOST_COLUMNS = 4096
MOST_PACKED = 1100
"""Largest expansion of a compressed byte (deflate: 1,032)."""


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the numeric data sets of one or two dimensions; those of two give a channel per line of the shorter side.

    Data in other files is refused. Raises Unreadable.
    """
    _expect_whole(path)
    found = channels(path)
    if not found:
        raise Unreadable(str(path), None, "has no data set of numbers")
    return found


def channels(path: Path) -> list[Channel]:
    """Return a file's columns. Data in other files is refused."""
    import h5py

    sizes = [("STD_I", bits) for bits in (8, 16, 32, 64)] + [("STD_U", bits) for bits in (8, 16, 32, 64)]
    sizes += [("IEEE_F", bits) for bits in (16, 32, 64)]
    plain = [getattr(h5py.h5t, f"{start}{bits}{order}") for start, bits in sizes for order in ("LE", "BE")]
    found: list[Channel] = []
    counts: list[int] = []

    def visit(name: str, node: Any) -> None:
        if not isinstance(node, h5py.Dataset) or name.startswith("#") or node.ndim not in (1, 2):
            return
        if node.dtype.kind not in "fiu" or not node.shape or max(node.shape) < 2:
            return
        if node.is_virtual or node.external:
            raise Unreadable(str(path), None, f"{name} is in another file")
        _expect_stored(path, name, node)
        if not any(node.id.get_type() == kind for kind in plain):
            raise Unreadable(str(path), None, f"the numbers of {name} have no standard layout: it is damaged")
        counts.append(prod(node.shape))
        expect_held(path, "the file", sum(counts), MOST_NUMBERS)
        table = node[:].reshape(len(node), -1)
        table = table if table.shape[0] >= table.shape[1] else table.T
        if table.shape[1] > MOST_COLUMNS:
            return
        unit = next((_text(node.attrs[key]) for key in ("unit", "units") if key in node.attrs), "")
        for i, column in enumerate(table.T, 1):
            found.append(Channel(column, name if table.shape[1] == 1 else f"{name}:{i}", unit))

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def _expect_whole(path: Path) -> None:
    """Raise Unreadable if the file does not end at the byte that its superblock states."""
    size = path.stat().st_size
    with open(path, "rb") as file:
        base = 0
        while base < size and file.read(8) != b"\x89HDF\r\n\x1a\n":
            base = 2 * base or 512
            file.seek(base)
        rest = file.read(64)
    if len(rest) < 64:
        raise Unreadable(str(path), None, "is no HDF5 file")
    at = {0: 32, 1: 36}.get(rest[0], 20)
    lengths = rest[5] if rest[0] < 2 else rest[1]
    end = int.from_bytes(rest[at : at + 8], "little")
    if lengths == 8 and end not in (size, size - base):
        raise Unreadable(str(path), None, f"states {end} bytes and has {size}: it was not closed, or is damaged")


def _expect_stored(path: Path, name: str, node: Any) -> None:
    """Raise Unreadable if a data set states more than its stored bytes can expand to, or has chunks beyond memory."""
    stored = node.id.get_storage_size()
    if not stored:
        raise Unreadable(str(path), None, f"{name} has no samples stored")
    if stored > path.stat().st_size:
        limit = f"{name} states {stored} stored bytes in a file of {path.stat().st_size}: it is damaged"
        raise Unreadable(str(path), None, limit)
    packed = MOST_PACKED ** node.id.get_create_plist().get_nfilters()
    expect_held(path, name, prod(node.shape), stored * packed, node.dtype.itemsize)
    if node.chunks:
        expect_held(path, f"a chunk of {name}", prod(node.chunks), stored * packed, node.dtype.itemsize)


def _text(value: Any) -> str:
    """Return an attribute's text; of an array the first one."""
    if isinstance(value, np.ndarray) and value.size:
        value = value.flat[0]
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value if isinstance(value, str) else ""
