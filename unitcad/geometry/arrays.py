"""Arrays of numbers and points: their types, faster versions of some numpy functions.

numpy's own generic types make every sum and mask a union that a type checker cannot follow.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[Any]
Ints = NDArray[Any]
Bools = NDArray[Any]
_BLOCK = 1 << 15  # numbers that stay in the processor's cache


def open_edges(faces: Ints) -> Ints:
    """Return the directed edges (n, 2) of faces (m, 3) that no other of them has the other way."""
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64)
    many = int(edges.max(initial=0)) + 1
    open_: Ints = edges[~np.isin(edges @ (many, 1), edges @ (1, many))]
    return open_


def sorted_with_order(key: NDArray[np.unsignedinteger], bits: int) -> tuple[NDArray[np.uint64], Ints]:
    """Sort `key` (its low `bits` bits); return it and the order that sorts it.

    If key and position fit into 64 bits together, unitcad sorts plain integers, four times faster.
    """
    room = max(len(key) - 1, 1).bit_length()
    if bits + room > 64:
        order = np.argsort(key, kind="stable")
        return key[order], order.astype(np.int32)
    packed = key << np.uint64(room)
    return packed, order_of_packed(packed, room)


def order_of_packed(key: NDArray[np.uint64], room: int) -> Ints:
    """Sort `key` in place and return the order that does it; its low `room` bits are free, and are gone afterwards."""
    for start in range(0, len(key), _BLOCK):
        key[start : start + _BLOCK] |= np.arange(start, min(start + _BLOCK, len(key)), dtype=np.uint64)
    key.sort()
    order = np.empty(len(key), np.int32)
    np.bitwise_and(key, np.uint64((1 << room) - 1), out=order, casting="unsafe")
    key >>= np.uint64(room)
    return order


def distinct(ordered: Ints) -> Bools:
    """Return the indices at which a new value begins in sorted numbers."""
    fresh = np.ones(len(ordered), bool)
    np.not_equal(ordered[1:], ordered[:-1], out=fresh[1:])
    return fresh


def by_appearance(first: Ints, n: int) -> tuple[Ints, Ints]:
    """Return the places among `first`, of `n`, in their order, and the index of each of `first` in it."""
    appears = np.zeros(n, bool)
    appears[first] = True
    return np.flatnonzero(appears), np.cumsum(appears, dtype=np.int32).take(first) - np.int32(1)


def among(numbers: Ints, known: Ints) -> Bools:
    """Return which numbers are among the `known` ones, which are sorted."""
    if not len(known):
        return np.zeros(len(numbers), bool)
    return np.asarray(known.take(np.searchsorted(known, numbers), mode="clip") == numbers)


def extent(points: Floats) -> tuple[Floats, Floats]:
    """Return low and high corner of the box round (n, 3) points.

    By columns, which is five times faster than along an axis.
    """
    columns = [points[:, axis] for axis in range(3)]
    return np.array([c.min() for c in columns]), np.array([c.max() for c in columns])


def extents(points: Floats, label: Ints, n: int) -> tuple[Floats, Floats]:
    """Return low and high corners (n, 3) of the boxes round each label's points; inf and -inf if it has none.

    By columns, which is six times faster than by points.
    """
    low, high, label = np.full((3, n), np.inf), np.full((3, n), -np.inf), label.astype(np.intp)
    for axis in range(3):
        column = np.ascontiguousarray(points[:, axis])
        np.minimum.at(low[axis], label, column)
        np.maximum.at(high[axis], label, column)
    return low.T, high.T


def columns_of(rows: Floats, order: Ints) -> Floats:
    """Return some rows of (n, k) numbers, by their places (m,), as columns (k, m)."""
    columns = np.empty((rows.shape[1], len(order)), rows.dtype)
    for start in range(0, len(order), _BLOCK):
        columns[:, start : start + _BLOCK] = rows.take(order[start : start + _BLOCK], axis=0).T
    return columns


def cross(a: Floats, b: Floats) -> Floats:
    """Return the row-wise cross product of (n, 3) arrays; several times faster than numpy.cross on long arrays."""
    product = np.empty_like(a)
    for axis in range(3):
        i, j = (axis + 1) % 3, (axis + 2) % 3
        np.subtract(a[:, i] * b[:, j], a[:, j] * b[:, i], out=product[:, axis])
    return product


def unique_rows(rows: Floats) -> tuple[Floats, Ints]:
    """Return the distinct rows of (n, m) numbers in their order, and the place among them of each row, (n,).

    As numpy.unique along an axis, which compares rows as bytes and takes several times as long.
    """
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    first = np.ones(len(rows), bool)
    first[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    place = np.empty(len(rows), np.int64)
    place[order] = np.cumsum(first) - 1
    return ordered[first], place
