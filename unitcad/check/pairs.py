"""Pairs of faces whose boxes meet, found by a tree of boxes that is walked level by level, all nodes of it at once.

Faces are put in Morton order of their centres; every four neighbours share a box, every four of those the next. A walk
down keeps the pairs of boxes that meet. Each step gathers whole rows and compares 4 x 4 boxes by broadcasting.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from unitcad.check.limits import Deadline
from unitcad.check.mesh import Bools, Floats, Ints, extent, sorted_with_order

_FAN = 4
_STEP_BITS = 12
_STEP = 1 << _STEP_BITS  # pairs of nodes looked at together: their rows stay in the processor's cache
_BITS = 14


def morton_order(vertices: Floats, faces: Ints) -> Ints:
    """The order of faces along a space-filling curve through their first corners."""
    low, high = extent(vertices)
    scale = (2**_BITS - 1) / max(float((high - low).max()), 1e-300)
    key = np.zeros(len(vertices), np.uint64)
    for axis in range(3):
        column = ((vertices[:, axis] - low[axis]) * scale).astype(np.uint64)
        key |= _spread(column) << np.uint64(axis)
    middle = key[faces[:, 0]]
    return sorted_with_order(middle, 3 * _BITS)[1]


def _spread(value: np.ndarray) -> np.ndarray:
    """Bits of `value` (up to 16) moved three apart."""
    for shift, mask in ((16, 0xFF0000FF), (8, 0x0F00F00F00F), (4, 0xC30C30C30C3), (2, 0x249249249249)):
        value = (value | (value << np.uint64(shift))) & np.uint64(mask)
    return value


def boxes_of(at: list[list[Floats]]) -> np.ndarray:
    """Boxes of faces from their corners' coordinates at[corner][axis] (m,): low corner and negated high corner, (m, 6)
    float32, rounded outwards."""
    boxes = np.empty((len(at[0][0]), 6), np.float32)
    for axis in range(3):
        a, b, c = at[0][axis], at[1][axis], at[2][axis]
        low = np.minimum(np.minimum(a, b), c).astype(np.float32)
        high = np.maximum(np.maximum(a, b), c).astype(np.float32)
        boxes[:, axis] = np.nextafter(low, np.float32(-np.inf))
        boxes[:, axis + 3] = -np.nextafter(high, np.float32(np.inf))
    return boxes


def meeting_pairs(boxes: np.ndarray, deadline: Deadline) -> Iterator[tuple[Ints, Ints]]:
    """Blocks of pairs i < j of rows of `boxes` whose boxes meet. Rows near each other should be near in space."""
    levels = _levels(boxes, 0)
    top = np.triu_indices(len(levels[-1]))
    first, second = (side.astype(np.int32) for side in top)
    yield from _descend(levels, levels, first, second, deadline, own=True)


def meeting_between(boxes: np.ndarray, others: np.ndarray, deadline: Deadline) -> Iterator[tuple[Ints, Ints]]:
    """The same between the rows of two sets: row of `boxes`, row of `others`."""
    here, there = _levels(boxes, len(others)), _levels(others, len(boxes))
    top = np.indices((len(here[-1]), len(there[-1]))).reshape(2, -1).astype(np.int32)
    yield from _descend(here, there, top[0], top[1], deadline, own=False)


def _levels(boxes: np.ndarray, least: int) -> list[np.ndarray]:
    """The tree's levels from the leaves up, for `least` leaves or more; the uppermost has one box or four."""
    if len(boxes) < least:
        boxes = np.concatenate([boxes, np.full((least - len(boxes), 6), np.inf, np.float32)])
    levels = [_padded(boxes)]
    while len(levels) == 1 or len(levels[-1]) > _FAN:
        levels.append(_padded(_parents(levels[-1])))
    return levels


def _descend(
    here: list[np.ndarray], there: list[np.ndarray], first: Ints, second: Ints, deadline: Deadline, *, own: bool
) -> Iterator[tuple[Ints, Ints]]:
    for level in range(len(here) - 1, 0, -1):
        rows = np.ascontiguousarray(here[level - 1].reshape(-1, _FAN * 6).T)
        others = rows if here is there else np.ascontiguousarray(there[level - 1].reshape(-1, _FAN * 6).T)
        keep = first < rows.shape[1]
        keep &= second < others.shape[1]
        first, second = first[keep], second[keep]
        skip = None if not own else np.greater if level > 1 else np.greater_equal
        walk = _walk(rows, others, first, second, skip, deadline)
        if level > 1:
            blocks = list(walk)
            first = np.concatenate([block[0] for block in blocks])
            second = np.concatenate([block[1] for block in blocks])
        else:
            yield from walk


def _padded(boxes: np.ndarray) -> np.ndarray:
    """Rows up to a multiple of the fan, the added ones empty: they meet nothing."""
    more = -len(boxes) % _FAN
    return np.concatenate([boxes, np.full((more, 6), np.inf, np.float32)]) if more else boxes


def _parents(boxes: np.ndarray) -> np.ndarray:
    """The box round every four rows."""
    pair = np.minimum(boxes[0::2], boxes[1::2])
    return np.minimum(pair[0::2], pair[1::2])


def _walk(
    rows: np.ndarray,
    others: np.ndarray,
    first: Ints,
    second: Ints,
    skip: Callable[[Ints, Ints], Bools] | None,
    deadline: Deadline,
) -> Iterator[tuple[Ints, Ints]]:
    """Children of the node pairs whose boxes meet; a column of `rows` holds a node's children.

    Of a node with itself the pairs of children (p, q) for which `skip(p, q)` are left out.
    """
    column = np.arange(_FAN, dtype=np.int32)
    grid_i, grid_j = (side.reshape(-1) for side in np.meshgrid(column, column, indexing="ij"))
    left_out = np.zeros(_FAN * _FAN, bool) if skip is None else skip(grid_i, grid_j)
    empty = np.empty(0, np.int32)
    yield empty, empty
    for start in range(0, len(first), _STEP):
        deadline.tick()
        i, j = first[start : start + _STEP], second[start : start + _STEP]
        a = rows.take(i, axis=1, mode="clip").reshape(_FAN, 6, -1)
        b = others.take(j, axis=1, mode="clip").reshape(_FAN, 6, -1)
        high_a, high_b = -a[:, 3:], -b[:, 3:]
        meet = np.zeros((_FAN, _FAN, _STEP), bool)
        hit = np.empty(len(i), bool)
        part = np.empty(len(i), bool)
        for p in range(_FAN):
            for q in range(_FAN):
                np.less_equal(a[p, 0], high_b[q, 0], out=hit)
                for axis in range(3):
                    if axis:
                        hit &= np.less_equal(a[p, axis], high_b[q, axis], out=part)
                    hit &= np.less_equal(b[q, axis], high_a[p, axis], out=part)
                meet[p, q, : len(i)] = hit
        if skip is not None and len(own := np.flatnonzero(i == j)):
            meet.reshape(_FAN * _FAN, -1)[np.ix_(left_out, own)] = False
        found = np.flatnonzero(meet)
        which, pair = found >> _STEP_BITS, found & (_STEP - 1)
        yield i[pair] * _FAN + grid_i[which], j[pair] * _FAN + grid_j[which]
