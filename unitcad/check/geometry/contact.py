"""Pairs of faces whose boxes only touch: most have no point in common, and none passes through the other.

Two boxes that share no more than a plane square to an axis hold two faces that can meet in that plane alone, where each
has a corner, a side or its whole. Comparisons of coordinates only, hence exact.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints


def by_boxes(a: Floats, b: Floats) -> tuple[Bools, Bools]:
    """Return for pairs of triangles (corner, axis, n) whether their boxes are apart, and whether they can only touch.

    They can where their boxes do, and the plane between these holds no side of one and all of the other.
    """
    (low_a, high_a), (low_b, high_b) = _box(a), _box(b)
    apart = np.asarray(((low_a > high_b) | (low_b > high_a)).any(axis=0))
    flush = np.zeros(a.shape[2], bool)
    for axis in range(3):
        for plane, other in ((high_a[axis], low_b[axis]), (low_a[axis], high_b[axis])):
            rows = np.flatnonzero((plane == other) & ~(apart | flush))
            if len(rows):
                at = plane[rows]
                one, two = ((corners[:, axis].take(rows, axis=1) == at).sum(axis=0) for corners in (a, b))
                flush[rows] = one + two < 5
    return apart, flush


def _box(corners: Floats) -> tuple[Floats, Floats]:
    """Return low and high corner (axis, n) of the corners' box."""
    a, b, c = corners
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


@dataclass
class Contacts:
    """Pairs of shells that meet, each with the first pair of faces found (k, 2), or with `every` one."""

    shells: int
    every: bool = False
    known: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    pairs: list[Ints] = field(default_factory=list)

    def keys(self, one: Ints, other: Ints) -> Ints:
        """Return a number for each pair of shells, in either order."""
        return np.minimum(one, other).astype(np.int64) * self.shells + np.maximum(one, other)

    def open(self, keys: Ints) -> Bools:
        """Return which keys are still asked for."""
        return np.ones(len(keys), bool) if self.every else ~self._knows(keys)

    def _knows(self, keys: Ints) -> Bools:
        """Return which keys are known, by bisection: `numpy.isin` hashes all that are known at each call."""
        if not len(self.known):
            return np.zeros(len(keys), bool)
        return self.known.take(np.searchsorted(self.known, keys), mode="clip") == keys

    def add(self, keys: Ints, pairs: Ints) -> None:
        """Note pairs of faces that meet, one for each pair of shells that is not known."""
        rows = np.unique(keys, return_index=True)[1]
        rows = rows[~self._knows(keys[rows])]
        if len(rows):
            self.known = np.sort(np.concatenate([self.known, keys[rows]]), kind="stable")  # merges
        if len(rows) or self.every:
            self.pairs.append(pairs if self.every else pairs[rows])
