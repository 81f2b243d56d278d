"""Pairs of faces whose boxes only touch: most have no point in common, and none passes through the other.

Two boxes that share no more than a plane square to an axis hold two faces that can meet in that plane alone, where each
has a corner, a side or its whole. Comparisons of coordinates only, hence exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from unitcad.geometry.arrays import Bools, Floats, Ints, distinct, sorted_with_order

_FACES = 1 << 14  # faces whose corners stay in the processor's cache
_RECENT = 1 << 16  # pairs of shells remembered: those found again are near each other in the order of the faces


@dataclass(frozen=True, eq=False)
class FaceBoxes:
    """Boxes of faces by the ranks of their sides, rows of three axes: what can only touch is told by one comparison.

    `high` (n, 4) are 8 times the ranks and how many corners lie there; `low` are 8 times the ranks less that number,
    plus 4. Where the boxes of two faces touch, the former is at most the latter if four corners or fewer lie in the
    plane: then the plane holds no side of one and all of the other. Boxes that are apart touch by this.
    """

    low: Ints
    high: Ints

    def touching(self, i: Ints, j: Ints) -> Bools:
        """Return for pairs of faces whether they can do no more than touch."""
        touch = self._below(i, j)
        touch |= self._below(j, i)
        return np.asarray(touch.view(np.uint32)[:, 0] != 0)

    def _below(self, i: Ints, j: Ints) -> Bools:
        return self.high.take(i, axis=0, mode="clip") <= self.low.take(j, axis=0, mode="clip")


MOST_RANK = 8191
"""The largest rank for which numbers of 16 bits suffice."""


def face_boxes(columns: Floats, ids: Ints) -> FaceBoxes:
    """Return the boxes of faces from vertices (3, n) and their ids (3, m)."""
    if ids.size > columns.shape[1]:
        return ranked_boxes([_numbers(column) for column in columns], ids)
    corners = np.arange(ids.size).reshape(ids.shape)
    return ranked_boxes([_numbers(column.take(ids.reshape(-1))) for column in columns], corners)


def _numbers(values: Floats) -> NDArray[np.uint64]:
    """Return whole numbers of at most 32 bits that are in the order of coordinates (n,), and equal where these are."""
    single = values.astype(np.float32) + np.float32(0)
    if not np.array_equal(single, values):
        return np.unique(values, return_inverse=True)[1].astype(np.uint64)
    bits = single.view(np.uint32)
    return np.where(bits >> np.uint32(31), ~bits, bits | np.uint32(1 << 31)).astype(np.uint64)


def ranked_boxes(ranks: Sequence[NDArray[np.unsignedinteger]], ids: Ints) -> FaceBoxes:
    """Return the boxes of faces from the ranks of the vertices along each axis, and the faces' ids (3, m)."""
    kind = ranks[0].dtype.type
    low, high = np.zeros((ids.shape[1], 4), kind), np.full((ids.shape[1], 4), np.iinfo(kind).max, kind)
    for start in range(0, ids.shape[1], _FACES):
        block = slice(start, start + _FACES)
        places = [corner[block].astype(np.intp) for corner in ids]
        for axis, rank in enumerate(ranks):  # the fourth column never touches
            one, two, three = (rank.take(place, mode="clip") for place in places)
            least, most = np.minimum(np.minimum(one, two), three), np.maximum(np.maximum(one, two), three)
            on_low, on_high = np.zeros((2, len(one)), kind)
            for corner in (one, two, three):
                on_low += corner == least
                on_high += corner == most
            high[block, axis] = most * kind(8) + on_high
            low[block, axis] = least * kind(8) + kind(4) - on_low
    return FaceBoxes(low, high)


MOST_CONTACTS = 1_000_000
"""Pairs of faces that `Contacts` holds, unless it is told another number."""


@dataclass(eq=False)
class Contacts:
    """Pairs of shells that meet, each with the first pair of faces found, or with `every` one.

    `noted` are pairs of faces in blocks, some of shells that were noted before; with more than `most` of them it is
    `full`, and takes no more. `recent_keys` has the keys of some
    shells that were, each at its own place, and `first_place` is room to find the first of several in.
    """

    shells: int
    every: bool = False
    most: int = MOST_CONTACTS
    full: bool = False
    noted: list[tuple[Ints, Ints]] = field(default_factory=list)
    recent_keys: Ints = field(default_factory=lambda: np.full(_RECENT, -1))
    first_place: Ints = field(default_factory=lambda: np.empty(_RECENT, np.int32))

    def keys(self, one: Ints, other: Ints) -> Ints:
        """Return a number for each pair of shells, in either order."""
        return np.minimum(one, other).astype(np.int64) * self.shells + np.maximum(one, other)

    def open(self, keys: Ints) -> Ints:
        """Return which keys (k,) may not be known yet: all that are not, and some others."""
        if self.full:
            return np.empty(0, np.intp)
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
        if self.full:
            return
        if not self.every and len(keys):
            first = self.foremost(keys)
            keys, pairs = keys[first], pairs[first]
            self.recent_keys[keys & (_RECENT - 1)] = keys
        self.noted.append((keys, pairs))
        self.full = sum(len(block) for block, _ in self.noted) > self.most and len(self.pairs()[0]) > self.most // 2

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
