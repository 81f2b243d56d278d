"""Pairs of boxes that meet, by a tree of boxes whose levels are walked one after the other, all nodes at once.

Boxes are put in Morton order; every four neighbours share a box, every four of those the next. A walk down keeps the
pairs of nodes that meet. Coordinates are 16-bit steps of a common frame: rounding keeps their order, so no pair is
lost, four children's boxes are 48 bytes in a row, and a block of node pairs stays in the processor's cache.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache, reduce
from operator import ge, gt

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, extent, sorted_with_order

Tick = Callable[[], object]
"""A function that a long computation calls now and then; it may raise `Interrupted`."""


class Interrupted(Exception):
    """A computation that a tick has ended; its results so far may still be of use."""


class TooMany(Interrupted):
    """A computation that would have to look at more pairs than there is time or memory for."""

    def __init__(self, most: int, noun: str) -> None:
        super().__init__(f"more than {most} pairs of {noun} lie at each other; not all are compared")


MOST_PAIRS = 10_000_000

_FAN = 4
_ROOTS = 64  # boxes of the uppermost level at most: all their pairs are looked at
_WIDE = 1 << 18  # pairs of nodes whose children are held together
_STEP_BITS = 13
_STEP = 1 << _STEP_BITS  # pairs of nodes looked at together
_TOP = 65_534  # largest step; 65,535 is an empty box's low corner
_FACES = 1 << 14  # faces whose corners stay in the processor's cache
_BITS = 14  # of each axis in a Morton key


@dataclass(frozen=True, eq=False)
class Frame:
    """The origin of steps, and steps per mm of each axis."""

    origin: Floats
    scale: Floats

    def steps(self, points: Floats) -> list[Ints]:
        """Return the coordinates of (n, 3) points in steps, 1 to 65,534, clipped to the frame; order is kept."""
        values = ((points[:, axis] - self.origin[axis]) * self.scale[axis] for axis in range(3))
        return [np.clip(value, 0, _TOP - 1).astype(np.uint16) + np.uint16(1) for value in values]

    def even(self, steps: list[Ints]) -> list[Ints]:
        """Return steps of about one length, by powers of two, so that a space-filling curve's cells are near cubes."""
        shift = np.round(np.log2(self.scale) - np.log2(self.scale.min())).clip(0, 15).astype(np.uint16)
        return [step >> bits for step, bits in zip(steps, shift, strict=True)]


def frame_of(points: Floats) -> Frame:
    """Return a frame round (n, 3) points."""
    low, high = extent(points)
    return Frame(low, (_TOP - 1) / np.maximum(high - low, 1e-300))


def morton_order(steps: list[Ints], corner: Ints | None = None) -> Ints:
    """Return the order of points along a space-filling curve.

    With `corner`: of faces, by `corner[i]`, the first point of each.
    """
    if corner is None:
        return _curve_order(len(steps[0]), lambda block: [step[block] for step in steps])
    return _curve_order(len(corner), lambda block: [step.take(corner[block]) for step in steps])


def box_order(boxes: Ints, frame: Frame) -> Ints:
    """Return the order of boxes by their middles, along a space-filling curve whose cells are near cubes."""

    def middles(block: slice) -> list[Ints]:
        some = boxes[block]
        return frame.even([some[:, axis] // 2 + (np.uint16(65_535) - some[:, axis + 3]) // 2 for axis in range(3)])

    return _curve_order(len(boxes), middles)


def _curve_order(n: int, steps_of: Callable[[slice], list[Ints]]) -> Ints:
    """Return the order of `n` places along a space-filling curve; `steps_of` gives the steps of a block of them."""
    key, spread = np.zeros(n, np.uint64), _spread()
    for start in range(0, n, _FACES):
        block = slice(start, start + _FACES)
        for axis, step in enumerate(steps_of(block)):
            key[block] |= spread.take(step >> np.uint16(16 - _BITS)) << np.uint64(axis)
    return sorted_with_order(key, 3 * _BITS)[1]


@cache
def _spread() -> np.ndarray:
    """Return all numbers of `_BITS` bits with their bits moved three apart."""
    value = np.arange(1 << _BITS, dtype=np.uint64)
    for shift, mask in ((16, 0xFF0000FF), (8, 0x0F00F00F00F), (4, 0xC30C30C30C3), (2, 0x249249249249)):
        value = (value | (value << np.uint64(shift))) & np.uint64(mask)
    return value


def boxes_of(steps: list[Ints], *corners: Ints) -> Ints:
    """Return boxes (m, 6) round the points of each row of corners: low corner, 65,535 less high corner."""
    boxes = np.empty((len(corners[0]), 6), np.uint16)
    for start in range(0, len(boxes), _FACES):
        block = slice(start, start + _FACES)
        places = [corner[block].astype(np.intp) for corner in corners]
        for axis, step in enumerate(steps):
            at = [step.take(place) for place in places]
            boxes[block, axis] = reduce(np.minimum, at)
            np.subtract(np.uint16(65_535), reduce(np.maximum, at), out=boxes[block, axis + 3])
    return boxes


@dataclass(frozen=True, eq=False)
class Slabs:
    """The range of steps of each face along each diagonal of space: words of four low ones, of four high ones."""

    low: Ints
    high: Ints

    def meeting(self, i: Ints, j: Ints) -> tuple[Ints, Ints]:
        """Return the pairs i, j of faces whose slabs meet along all diagonals."""
        meet = self._reach(i, j)
        meet &= self._reach(j, i)
        keep = np.flatnonzero(meet.view(np.uint32) == 0x01010101)
        return i[keep], j[keep]

    def _reach(self, i: Ints, j: Ints) -> Bools:
        return self.low.take(i, mode="clip").view(np.uint16) <= self.high.take(j, mode="clip").view(np.uint16)


def slabs_of(steps: list[Ints], *corners: Ints) -> Slabs:
    """Return the slabs of faces, by the steps of their corners along the axes, as `boxes_of` makes their boxes.

    A sum of three steps is off by less than three of them, a fourth of it by one at most: so much are they wider.
    """
    x, y, z = (step.astype(np.int32) for step in steps)
    along = np.empty((len(x), 4), np.uint16)
    for k, value in enumerate((x + y + z, x + y - z + _TOP, x - y + z + _TOP, y + z - x + _TOP)):
        np.right_shift(value, 2, out=along[:, k], casting="unsafe")
    words = along.view(np.uint64)[:, 0]
    low, high = np.empty((2, len(corners[0])), np.uint64)
    for start in range(0, len(low), _FACES):
        block = slice(start, start + _FACES)
        one, two, three = (words.take(corner[block], mode="clip").view(np.uint16) for corner in corners)
        np.minimum(np.minimum(one, two), three, out=low[block].view(np.uint16))
        np.maximum(np.maximum(one, two), three, out=high[block].view(np.uint16))
    high.view(np.uint16)[:] += np.uint16(1)
    return Slabs(low, high)


def meeting_pairs(boxes: Ints, tick: Tick = lambda: None, alike: Ints | None = None) -> Iterator[tuple[Ints, Ints]]:
    """Yield blocks of pairs i, j of different rows of `boxes` whose boxes meet, each pair once.

    Rows near each other should be near in space. Most pairs of rows with one number in `alike` (n,) are left out; -1 is
    for rows that are like no other.
    """
    tree = _tree(boxes, 0, alike)
    yield from _descend(tree, tree, len(tree.rows), *np.triu_indices(tree.roots), tick, own=True)


def meeting_between(boxes: Ints, others: Ints, tick: Tick = lambda: None) -> Iterator[tuple[Ints, Ints]]:
    """Yield the same between the rows of two sets in one frame: row of `boxes`, row of `others`."""
    here, there = _tree(boxes, len(others)), _tree(others, len(boxes))
    top = np.indices((here.roots, there.roots)).reshape(2, -1)
    yield from _descend(here, there, len(here.rows), top[0], top[1], tick, own=False)


def box_pairs(low: Floats, high: Floats, tick: Tick) -> Ints:
    """Return pairs of boxes that meet (k, 2), the smaller number first, sorted; low and high corners (n, 3).

    Raises `TooMany` beyond MOST_PAIRS.
    """
    n, found = len(low), 0
    corners = np.concatenate([low, high])
    steps = frame_of(corners).steps(corners)
    order = morton_order(steps, np.arange(n))
    sides = [(np.ascontiguousarray(low[:, axis]), np.ascontiguousarray(high[:, axis])) for axis in range(3)]
    half, keys = np.uint64(32), [np.empty(0, np.uint64)]
    for i, j in meeting_pairs(boxes_of(steps, order, order + n), tick):
        i, j = order.take(i), order.take(j)
        meet = np.ones(len(i), bool)
        for least, most in sides:
            meet &= least.take(i) <= most.take(j)
            meet &= least.take(j) <= most.take(i)
        i, j = i[meet], j[meet]
        found += len(i)
        if found > MOST_PAIRS:
            raise TooMany(MOST_PAIRS, "boxes")
        keys.append(np.minimum(i, j).astype(np.uint64) << half | np.maximum(i, j).astype(np.uint64))
    key = np.concatenate(keys)
    del keys
    key.sort()
    pairs = np.empty((len(key), 2), np.int64)
    pairs[:, 0], pairs[:, 1] = key >> half, key & np.uint64(0xFFFFFFFF)
    return pairs


@dataclass(frozen=True, eq=False)
class _Tree:
    """The nodes of each level but the uppermost, which has `roots`, four to a row (`_packed`), leaves first.

    `alike` has for each row the number that all below it have in common, -1 for none; empty if none have any.
    """

    rows: list[Ints]
    roots: int
    alike: list[Ints]


def _tree(boxes: Ints, least: int, alike: Ints | None = None) -> _Tree:
    """Return the tree over boxes, for `least` leaves or more."""
    level, rows = _padded(boxes, max(least - len(boxes), 0)), list[Ints]()
    numbers = list[Ints]()
    while not rows or len(level) > _ROOTS:
        rows.append(_packed(level))
        if alike is not None:
            four = np.concatenate([alike, np.full(len(level) - len(alike), -1)]).reshape(-1, _FAN)
            alike = np.where((four == four[:, :1]).all(axis=1), four[:, 0], -1)
            numbers.append(alike)
        pair = np.minimum(level[0::2], level[1::2])
        level = _padded(np.minimum(pair[0::2], pair[1::2]), 0)
    return _Tree(rows, len(level), numbers)


def _padded(boxes: Ints, more: int) -> Ints:
    """Return rows up to a multiple of the fan, the added ones empty: they meet nothing."""
    more += -(len(boxes) + more) % _FAN
    return np.concatenate([boxes, np.full((more, 6), 65_535, np.uint16)]) if more else boxes


def _packed(boxes: Ints) -> Ints:
    """Return every four boxes as a row of 24 numbers: of each the low corner, then the high one.

    They are signed, less half their range: such comparisons are the fastest.
    """
    flip = np.array([0x8000] * 3 + [0x7FFF] * 3, np.uint16)
    return (boxes ^ flip).view(np.int16).reshape(-1, _FAN * 6)


def _descend(
    here: _Tree, there: _Tree, level: int, first: Ints, second: Ints, tick: Tick, *, own: bool
) -> Iterator[tuple[Ints, Ints]]:
    """Yield the pairs of leaves below pairs of nodes of a level; `own`: of one tree, each pair once."""
    for above in range(level, 1, -1):
        if len(first) > _WIDE:  # one part after the other, since all of the next level would take too much memory
            for start in range(0, len(first), _WIDE):
                part = slice(start, start + _WIDE)
                yield from _descend(here, there, above, first[part], second[part], tick, own=own)
            return
        first, second = _joined(_below(here, there, above, first, second, tick, own=own))
    yield from _below(here, there, 1, first, second, tick, own=own)


def _joined(blocks: Iterator[tuple[Ints, Ints]]) -> tuple[Ints, Ints]:
    kept = [(i.astype(np.int32), j.astype(np.int32)) for i, j in blocks]
    return np.concatenate([block[0] for block in kept]), np.concatenate([block[1] for block in kept])


def _below(
    here: _Tree, there: _Tree, level: int, first: Ints, second: Ints, tick: Tick, *, own: bool
) -> Iterator[tuple[Ints, Ints]]:
    """Return blocks of the pairs of children that meet, of pairs of nodes of a level."""
    rows, others = here.rows[level - 1], there.rows[level - 1]
    keep = first < len(rows)
    keep &= second < len(others)
    if own and here.alike:
        number = here.alike[level - 1]
        one, other = number.take(first, mode="clip"), number.take(second, mode="clip")
        keep &= (one != other) | (one < 0)
    skip = None if not own else gt if level > 1 else ge
    return _walk(rows, others, first[keep], second[keep], skip, tick)


def _children(rows: Ints, which: Ints) -> tuple[Ints, Ints]:
    """Return low and high corners of the children of some nodes: (child, axis, node) each."""
    corners = np.ascontiguousarray(rows.take(which, axis=0, mode="clip").T).reshape(_FAN, 6, -1)
    return corners[:, :3], corners[:, 3:]


def _walk(
    rows: Ints,
    others: Ints,
    first: Ints,
    second: Ints,
    skip: Callable[[int, int], bool] | None,
    tick: Tick,
) -> Iterator[tuple[Ints, Ints]]:
    """Yield children of the node pairs whose boxes meet.

    A node with itself skips the pairs of children (p, q) with `skip(p, q)`.
    """
    left_out = [pair for pair in np.ndindex(_FAN, _FAN) if skip is not None and skip(*pair)]
    empty = np.empty(0, np.intp)
    yield empty, empty
    for start in range(0, len(first), _STEP):
        tick()
        i, j = (side[start : start + _STEP].astype(np.intp) for side in (first, second))
        low_a, high_a = _children(rows, i)
        low_b, high_b = _children(others, j)
        meet = np.zeros((_FAN, _FAN, _STEP), bool)
        hit = np.empty((_FAN, len(i)), bool)
        part = np.empty((_FAN, len(i)), bool)
        for p in range(_FAN):
            np.less_equal(low_a[p, 0], high_b[:, 0], out=hit)
            for axis in range(3):
                if axis:
                    hit &= np.less_equal(low_a[p, axis], high_b[:, axis], out=part)
                hit &= np.less_equal(low_b[:, axis], high_a[p, axis], out=part)
            meet[p, :, : len(i)] = hit
        if skip is not None and len(own := np.flatnonzero(i == j)):
            for p, q in left_out:
                meet[p, q, own] = False
        hits = np.flatnonzero(meet)
        which, pair = hits >> _STEP_BITS, hits & (_STEP - 1)
        i, j = (i * _FAN).take(pair), (j * _FAN).take(pair)
        i += which >> 2
        j += which & 3
        yield i, j
