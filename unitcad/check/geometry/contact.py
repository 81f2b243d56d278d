"""Pairs of faces whose boxes only touch: most have no point in common, and none passes through the other.

Two boxes that share no more than a plane square to an axis hold two faces that can meet in that plane alone, where each
has a corner, a side or its whole. Comparisons of coordinates only, hence exact.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, distinct, sorted_with_order

_FACES = 1 << 14  # faces whose corners stay in the processor's cache
_RECENT = 1 << 16  # pairs of shells remembered: those found again are near each other in the order of the faces
_FIVE = np.uint16(0x333)  # added to sums of corners, four bits an axis: the fourth bit says five or more


@dataclass(frozen=True)
class RankedBoxes:
    """Boxes of faces by the ranks of their sides, words of three axes: what can only touch is told by one comparison.

    `high` are 8 times the ranks and how many corners lie there; `low` are 8 times the ranks less that number, plus 4.
    Where the boxes of two faces touch, the former is at most the latter if four corners or fewer lie in the plane.
    """

    low: Ints
    high: Ints

    def relation(self, i: Ints, j: Ints) -> tuple[Bools, Bools]:
        """Return what `FaceBoxes.relation` does for pairs of faces whose steps meet: no boxes are apart."""
        touch = self._below(i, j)
        touch |= self._below(j, i)
        return np.zeros(len(i), bool), np.asarray(touch.view(np.uint32) != 0)

    def _below(self, i: Ints, j: Ints) -> Bools:
        return self.high.take(i, mode="clip").view(np.uint16) <= self.low.take(j, mode="clip").view(np.uint16)


MOST_RANK = 8191
"""The largest rank that `RankedBoxes` has room for."""


def ranked_boxes(ranks: list[Ints], ids: Ints) -> RankedBoxes:
    """Return the boxes of faces from the ranks of the vertices along each axis, and the faces' ids (3, m)."""
    low, high = np.zeros(ids.shape[1], np.uint64), np.full(ids.shape[1], 0xFFFF, np.uint64)
    lows, highs = (words.view(np.uint16).reshape(-1, 4) for words in (low, high))
    highs[:, 3], lows[:, 3] = 0xFFFF, 0  # never touch along the axis that is not there
    for start in range(0, ids.shape[1], _FACES):
        block = slice(start, start + _FACES)
        places = [corner[block].astype(np.intp) for corner in ids]
        for axis, rank in enumerate(ranks):
            one, two, three = (rank.take(place, mode="clip") for place in places)
            least, most = np.minimum(np.minimum(one, two), three), np.maximum(np.maximum(one, two), three)
            on_low, on_high = np.zeros((2, len(one)), np.uint16)
            for corner in (one, two, three):
                on_low += corner == least
                on_high += corner == most
            highs[block, axis] = most * np.uint16(8) + on_high
            lows[block, axis] = least * np.uint16(8) + np.uint16(4) - on_low
    return RankedBoxes(low, high)


@dataclass(frozen=True)
class FaceBoxes:
    """Boxes of faces, (3, n) each, and how many corners of each face lie on their sides: four bits an axis, (n,)."""

    low: Floats
    high: Floats
    on_low: Ints
    on_high: Ints

    def relation(self, i: Ints, j: Ints) -> tuple[Bools, Bools]:
        """Return for pairs of faces whether their boxes are apart, and whether the faces can only touch.

        They can where their boxes do, and the plane between these holds no side of one and all of the other.
        """
        apart, flush = np.zeros((2, len(i)), bool)
        above, below = (
            one.take(i, mode="clip") + other.take(j, mode="clip") + _FIVE
            for one, other in ((self.on_high, self.on_low), (self.on_low, self.on_high))
        )
        for axis in range(3):
            low_a, low_b = (self.low[axis].take(f, mode="clip") for f in (i, j))
            high_a, high_b = (self.high[axis].take(f, mode="clip") for f in (i, j))
            apart |= low_a > high_b
            apart |= low_b > high_a
            for plane, other, corners in ((high_a, low_b, above), (low_a, high_b, below)):
                meets = plane == other
                if meets.any():
                    meets &= (corners & np.uint16(8 << 4 * axis)) == 0
                    flush |= meets
        return apart, flush & ~apart


def face_boxes(columns: Floats, ids: Ints) -> FaceBoxes:
    """Return the boxes of faces from vertices (3, n) and their ids (3, m)."""
    low, high = np.empty(ids.shape), np.empty(ids.shape)
    on_low, on_high = np.zeros(ids.shape[1], np.uint16), np.zeros(ids.shape[1], np.uint16)
    for start in range(0, ids.shape[1], _FACES):
        block = slice(start, start + _FACES)
        places = [corner[block].astype(np.intp) for corner in ids]
        for axis, column in enumerate(columns):
            at = [column.take(place, mode="clip") for place in places]
            for find, side, on in ((np.minimum, low, on_low), (np.maximum, high, on_high)):
                find(find(at[0], at[1]), at[2], out=side[axis, block])
                for corner in at:
                    on[block] += (corner == side[axis, block]).astype(np.uint16) << np.uint16(4 * axis)
    return FaceBoxes(low, high, on_low, on_high)


@dataclass
class Contacts:
    """Pairs of shells that meet, each with the first pair of faces found, or with `every` one.

    `noted` are pairs of faces in blocks, some of shells that were noted before. `recent_keys` has the keys of some
    shells that were, each at its own place, and `first_place` is room to find the first of several in.
    """

    shells: int
    every: bool = False
    noted: list[tuple[Ints, Ints]] = field(default_factory=list)
    recent_keys: Ints = field(default_factory=lambda: np.full(_RECENT, -1))
    first_place: Ints = field(default_factory=lambda: np.empty(_RECENT, np.int32))

    def keys(self, one: Ints, other: Ints) -> Ints:
        """Return a number for each pair of shells, in either order."""
        return np.minimum(one, other).astype(np.int64) * self.shells + np.maximum(one, other)

    def open(self, keys: Ints) -> Ints:
        """Return which keys (k,) may not be known yet: all that are not, and some others."""
        if self.every:
            return np.arange(len(keys))
        return np.flatnonzero(self.recent_keys.take(keys & (_RECENT - 1)) != keys)

    def foremost(self, keys: Ints) -> Ints:
        """Return the first place of each key in `keys` (k,). With `every`, return all places.

        Keys that share a slot with another key keep all their places.
        """
        places = np.arange(len(keys), dtype=np.int32)
        if self.every:
            return places
        slots = keys & (_RECENT - 1)
        self.first_place[slots[::-1]] = places[::-1]  # of keys that share a slot, the first one stays
        first = self.first_place.take(slots)
        return np.flatnonzero((first == places) | (keys.take(first) != keys))

    def add(self, keys: Ints, pairs: Ints) -> None:
        """Note pairs of faces that meet (k, 2), one for each pair of shells or `every` one."""
        if not self.every and len(keys):
            first = self.foremost(keys)
            keys, pairs = keys[first], pairs[first]
            self.recent_keys[keys & (_RECENT - 1)] = keys
        self.noted.append((keys, pairs))

    def pairs(self) -> tuple[Ints, Ints]:
        """Return the keys of shells that meet and pairs of their faces (k, 2), in the order of the keys."""
        if not self.noted:
            return np.empty(0, np.int64), np.empty((0, 2), np.int32)
        keys, pairs = (np.concatenate(part) for part in zip(*self.noted, strict=True))
        ordered, order = sorted_with_order(keys.astype(np.uint64), max(self.shells**2 - 1, 1).bit_length())
        if not self.every:
            fresh = distinct(ordered)
            ordered, order = ordered[fresh], order[fresh]
        keys, pairs = ordered.astype(np.int64), pairs[order]
        self.noted = [(keys, pairs)]  # sorted, the next time takes less
        return keys, pairs

    def shells_of(self, keys: Ints) -> Ints:
        """Return the pairs of shells (k, 2) of these keys, the smaller number first."""
        return np.stack(np.divmod(keys, self.shells), axis=1)
