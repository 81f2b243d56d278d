"""Pairs of faces whose boxes only touch: most have no point in common, and none passes through the other.

Two boxes that share no more than a plane square to an axis hold two faces that can meet in that plane alone, where each
has a corner, a side or its whole. Comparisons of coordinates only, hence exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints

_TRIES = 3  # pairs of faces tried one by one for each pair of shells before all are
_BLOCK = 1 << 12  # pairs whose corners stay in the processor's cache


def by_boxes(a: Floats, b: Floats) -> tuple[Bools, Bools]:
    """For pairs of triangles (n, 3, 3): whether they are apart, and whether all they can do is touch.

    The first by their boxes, or those of the parts that they have in the plane where these touch; the second where such
    a plane holds neither.
    """
    apart, flush = np.zeros((2, len(a)), bool)
    for start in range(0, len(a), _BLOCK):
        block = slice(start, start + _BLOCK)
        apart[block], flush[block] = _by_boxes(
            np.ascontiguousarray(a[block].transpose(1, 2, 0)), np.ascontiguousarray(b[block].transpose(1, 2, 0))
        )
    return apart, flush


def _by_boxes(a: Floats, b: Floats) -> tuple[Bools, Bools]:
    """The same for corners (corner, axis, n)."""
    (low_a, high_a), (low_b, high_b) = _box(a), _box(b)
    apart = np.asarray(((low_a > high_b) | (low_b > high_a)).any(axis=0))
    flush = np.zeros(a.shape[2], bool)
    for axis in range(3):
        for plane, touch in (
            (high_a[axis], high_a[axis] == low_b[axis]),
            (low_a[axis], low_a[axis] == high_b[axis]),
        ):
            rows = np.flatnonzero(touch)
            if not len(rows):
                continue
            parts = []
            for corners in (a, b):
                some = corners.take(rows, axis=2)
                out = some[:, axis] != plane[rows]
                parts.append((some, out))
            (one, out_one), (other, out_other) = parts
            flush[rows] |= out_one.any(axis=0) & out_other.any(axis=0)
            (low_one, high_one), (low_other, high_other) = _box(one, out_one), _box(other, out_other)
            apart[rows] |= ((low_one > high_other) | (low_other > high_one)).any(axis=0)
    return apart, flush


def _box(corners: Floats, out: Bools | None = None) -> tuple[Floats, Floats]:
    """Low and high corner (axis, n) of the corners' box, without those that are `out`."""
    low = high = corners
    if out is not None:
        low, high = np.where(out[:, None], np.inf, corners), np.where(out[:, None], -np.inf, corners)
    return np.minimum(np.minimum(low[0], low[1]), low[2]), np.maximum(np.maximum(high[0], high[1]), high[2])


@dataclass
class Contacts:
    """Pairs of shells that meet, each with the first pair of faces found (k, 2), or with `every` one."""

    shells: int
    every: bool = False
    known: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    pairs: list[Ints] = field(default_factory=list)

    def keys(self, one: Ints, other: Ints) -> Ints:
        """A number for each pair of shells, in either order."""
        return np.minimum(one, other).astype(np.int64) * self.shells + np.maximum(one, other)

    def fresh(self, keys: Ints) -> Ints:
        """Rows of the first of each key that is not known."""
        rows = np.flatnonzero(~np.isin(keys, self.known))
        return rows[np.unique(keys[rows], return_index=True)[1]]

    def add(self, keys: Ints, pairs: Ints) -> None:
        """Note pairs of faces that meet, one for each pair of shells that is not known."""
        rows = self.fresh(keys)
        if len(rows):
            self.known = np.sort(np.concatenate([self.known, keys[rows]]))
        if len(rows) or self.every:
            self.pairs.append(pairs if self.every else pairs[rows])

    def look(self, keys: Ints, pairs: Ints, meet: Callable[[Ints], Bools]) -> None:
        """Note which of many pairs meet, with few calls of `meet` (rows to whether they do): most shells meet often."""
        for _ in range(0 if self.every else _TRIES):
            rows = self.fresh(keys)
            if not len(rows):
                return
            met = rows[meet(rows)]
            self.add(keys[met], pairs[met])
            left = ~np.isin(keys, self.known)
            left[rows] = False
            keys, pairs, meet = keys[left], pairs[left], _of(np.flatnonzero(left), meet)
        met = np.flatnonzero(meet(np.arange(len(keys))))
        self.add(keys[met], pairs[met])


def _of(which: Ints, meet: Callable[[Ints], Bools]) -> Callable[[Ints], Bools]:
    return lambda rows: meet(which[rows])
