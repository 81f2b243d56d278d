"""MATLAB files of versions 4 to 7.2, by scipy: vectors, and the columns of matrices. Version 7.3 is HDF5."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from unitcad.lab.readers import Channel, Layout, Unreadable

ENDINGS = (".mat",)
LIBRARY = "scipy"
MOST_NUMBERS = 2**26
"""Numbers that a file's variables may have together: compressed, a small file can state many."""
DEEPEST = 3
"""Structs in structs that are looked into."""


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the numeric vectors and columns of a file; a struct's field x is named struct.x. Raises Unreadable."""
    from scipy.io import loadmat, whosmat

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        listed = whosmat(str(path))
        if sum(prod(shape) for _, shape, _ in listed) > MOST_NUMBERS:
            raise Unreadable(str(path), None, "states more numbers than can be read whole; save it with -v7.3")
        names = [
            name for name, _, kind in listed if kind.removeprefix("u").startswith(("int", "double", "single", "struct"))
        ]
        data = loadmat(str(path), variable_names=names, struct_as_record=False, squeeze_me=False)
    found = [channel for name in names if name in data for channel in _columns(name, data[name], 0)]
    if not found:
        raise Unreadable(str(path), None, "holds no vector and no matrix of numbers")
    return found


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
