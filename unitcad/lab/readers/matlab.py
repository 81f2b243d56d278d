"""MATLAB files of versions 4 to 7.2, by scipy; those of version 7.3 and HDF5, by h5py."""

from __future__ import annotations

from collections.abc import Iterator
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, whosmat

from unitcad.lab.readers import Channel, Layout, Unreadable

ENDINGS = (".mat", ".h5", ".hdf5")
LIBRARY = "scipy"
DEEPEST = 3
"""Structs in structs that are looked into."""


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the numeric vectors and the columns of matrices, as their longer side runs."""
    with open(path, "rb") as file:
        first = file.read(16)
    if path.suffix.lower() != ".mat" or first.startswith((b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3")):
        return _read_hdf5(path)
    kinds = ("int", "uint", "double", "single", "struct")
    names = [name for name, _, kind in whosmat(str(path)) if kind.startswith(kinds)]
    data = loadmat(str(path), variable_names=names, struct_as_record=False, squeeze_me=False)
    return [channel for name in names if name in data for channel in _columns(name, data[name], 0)]


def _columns(name: str, value: Any, depth: int) -> Iterator[Channel]:
    """Yield the columns of two numbers or more; those of a matrix are named name:1, name:2, as its longer side runs."""
    if not isinstance(value, np.ndarray) or value.ndim != 2:
        return
    if value.dtype == object:
        fields = getattr(value.flat[0], "_fieldnames", None) if value.size == 1 else None
        for field in fields or () if depth < DEEPEST else ():
            yield from _columns(f"{name}.{field}", getattr(value.flat[0], field), depth + 1)
    elif value.dtype.kind in "fiu" and max(value.shape) > 1:
        yield from _channels(name, value)


def _channels(name: str, table: np.ndarray, unit: str = "") -> Iterator[Channel]:
    """Yield the channels of a matrix along its longer side."""
    table = table if table.shape[0] >= table.shape[1] else table.T
    for i, column in enumerate(table.T, 1):
        yield Channel(column, name if table.shape[1] == 1 else f"{name}:{i}", unit)


MOST_COLUMNS = 4096
MOST_PACKED = 1100
"""Largest expansion of a compressed byte (deflate: 1,032)."""


def _read_hdf5(path: Path) -> list[Channel]:
    """Return the numeric data sets of one or two dimensions. Raises Unreadable for data in other files."""
    import h5py

    found: list[Channel] = []

    def visit(name: str, node: Any) -> None:
        if not isinstance(node, h5py.Dataset) or name.startswith("#") or node.ndim not in (1, 2):
            return
        if node.dtype.kind not in "fiu" or not node.shape or max(node.shape) < 2:
            return
        if node.is_virtual or node.external:
            raise Unreadable(str(path), None, f"{name} is in another file")
        _expect_stored(path, name, node)
        if node.id.get_type() not in (h5py.h5t.py_create(node.dtype), h5py.h5t.py_create(node.dtype.newbyteorder())):
            raise Unreadable(str(path), None, f"the numbers of {name} have no standard layout: it is damaged")
        table = node[:].reshape(len(node), -1)
        if min(table.shape) > MOST_COLUMNS:
            return
        unit = next((_text(node.attrs[key]) for key in ("unit", "units") if key in node.attrs), "")
        found.extend(_channels(name, table, unit))

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def _expect_stored(path: Path, name: str, node: Any) -> None:
    """Raise Unreadable if a data set states more than its stored bytes can expand to."""
    stated = prod(node.shape) * node.dtype.itemsize
    most = node.id.get_storage_size() * MOST_PACKED ** node.id.get_create_plist().get_nfilters()
    if stated > most:
        limit = f"{name} states {stated} bytes and stores {most} at most: it is damaged"
        raise Unreadable(str(path), None, limit)


def _text(value: Any) -> str:
    """Return an attribute's text; of an array the first one."""
    if isinstance(value, np.ndarray) and value.size:
        value = value.flat[0]
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value if isinstance(value, str) else ""
