"""Pairs of faces with a corner in common, where some corners count.

Three vertex numbers fit a word: two words, one turned three ways, tell whether any of nine pairs of corners are one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Bools, Ints

_BITS = 21  # of a corner: its vertex and, above it, a bit that only a difference of 0 clears
MOST_VERTICES = (1 << (_BITS - 1)) - 1
"""From which on no word has room for a corner that does not count."""

_TOPS = np.uint64(sum(1 << (_BITS * k + _BITS - 1) for k in range(3)))
_ONES = np.uint64(sum(1 << (_BITS * k) for k in range(3)))
_TURN, _BACK = np.uint64(_BITS), np.uint64(2 * _BITS)
_WHOLE = np.uint64((1 << 3 * _BITS) - 1)


@dataclass(frozen=True, eq=False)
class CommonCorners:
    """The corners of faces by their vertices, `every` one and those `counted`.

    Words (n,) of three corners, or (3, n) where vertices are too many for that.
    """

    counted: Ints
    every: Ints

    def of(self, i: Ints, j: Ints) -> Bools:
        """Return for pairs of faces whether a corner of i that counts is one of j."""
        if self.every.ndim > 1:
            return self._by_corner(i, j)
        mine, theirs = self.counted.take(i, mode="clip"), self.every.take(j, mode="clip")
        left = mine ^ theirs
        left -= _ONES
        for _ in range(2):
            turned = theirs >> _BACK
            theirs <<= _TURN
            theirs &= _WHOLE
            theirs |= turned
            np.bitwise_xor(mine, theirs, out=turned)
            turned -= _ONES
            left &= turned
        left &= _TOPS
        return np.asarray(left != _TOPS)

    def _by_corner(self, i: Ints, j: Ints) -> Bools:
        mine = [corner.take(i, mode="clip") for corner in self.counted]
        theirs = [corner.take(j, mode="clip") for corner in self.every]
        common, part = np.zeros(len(i), bool), np.empty(len(i), bool)
        for one in mine:
            for other in theirs:
                common |= np.equal(one, other, out=part)
        return common


def common_corners(corners: Ints, counts: Bools, n_vertices: int) -> CommonCorners:
    """Return the corners of faces (3, n), of which those count that `counts` (3, n) says."""
    if n_vertices > MOST_VERTICES:
        return CommonCorners(np.where(counts, corners, np.int32(-1)), corners)
    counted = _words(np.where(counts, corners, np.int32(MOST_VERTICES)))
    return CommonCorners(counted | _TOPS, _words(corners))


def _words(corners: Ints) -> Ints:
    words = np.zeros(corners.shape[1], np.uint64)
    for k, corner in enumerate(corners):
        words |= corner.astype(np.uint64) << np.uint64(_BITS * k)
    return words
