"""Pairs of faces of many small shells, shell by shell.

Boxes of two shells that end where the other begins share a part of a plane square to an axis, a part of a line or a
point. Their faces can do no more than touch, and cover each other only where both lie in that plane. So of two such
shells that share a corner, which is enough to touch, other faces need no look. Of cubes that fill a block that leaves
about one in sixty pairs of faces of two cubes whose boxes meet.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Floats, Ints, among, distinct, grouped, sorted_with_order
from unitcad.geometry.ticks import Tick
from unitcad.meshcheck.geometry.contact import Contacts
from unitcad.meshcheck.geometry.topology import Topology

_MOST_FACES = 48  # of a shell
_MOST_PAIRS = 32  # for each face: with more of them a tree over the faces takes less
_BLOCK = 1 << 16  # pairs of faces at a time


@dataclass(frozen=True, eq=False)
class SmallShells:
    """What is to be compared of the faces of small shells.

    `sharing` are the pairs of shells that share a corner, each with two faces that do. `faces` lists faces by shell, of
    which shell s has `count[s]` from `first[s]` on, and behind them those that lie in a side of their shell's box. The
    faces of a shell are compared with each other, and rows of `faces` with other rows: of each where they begin and how
    many they are, `products` (p, 4). `boxes` (m, 6) are those of the faces, in steps.
    """

    sharing: Contacts
    faces: Ints
    first: Ints
    count: Ints
    products: Ints
    boxes: Ints

    def parts(self, n: int, tick: Tick) -> list[Iterator[tuple[Ints, Ints]]]:
        """Return `n` iterators that yield the pairs of faces between them, each pair once."""
        shells = np.searchsorted(self.first, np.linspace(0, len(self.boxes), n + 1))
        products = np.array_split(self.products, n)
        return [self._part(shells[k], shells[k + 1], products[k], tick) for k in range(n)]

    def _part(self, begin: int, end: int, products: Ints, tick: Tick) -> Iterator[tuple[Ints, Ints]]:
        for i, j in self._within(np.arange(begin, end)):
            tick()
            yield self._near(i, j)
        for i, j in _product(self.faces, products):
            tick()
            yield self._near(i, j)

    def _within(self, shells: Ints) -> Iterator[tuple[Ints, Ints]]:
        """Yield the pairs of faces of each shell."""
        count = self.count[shells]
        for n in range(2, _MOST_FACES + 1):
            some = shells[count == n]
            one, other = np.triu_indices(n, 1)
            at_once = max(_BLOCK // len(one), 1)
            for start in range(0, len(some), at_once):
                first = self.first[some[start : start + at_once], None]
                yield self.faces[first + one].ravel(), self.faces[first + other].ravel()

    def _near(self, i: Ints, j: Ints) -> tuple[Ints, Ints]:
        """Return the pairs of faces whose boxes meet."""
        one, other = self.boxes.take(i, axis=0), self.boxes.take(j, axis=0)
        below = ~other[:, 3:] >= one[:, :3]
        below &= ~one[:, 3:] >= other[:, :3]
        keep = np.flatnonzero(below.all(axis=1))
        return i[keep], j[keep]


def small_shells(
    topology: Topology, meeting: Ints, shell: Ints, columns: Floats, corners: Ints, places: Ints, boxes: Ints
) -> SmallShells | None:
    """Return what is to be looked at of faces that lie in many small shells; None where they do not.

    meeting (k, 2): pairs of shells whose boxes meet; shell (m,): of each face; columns (3, n): the vertices by axis;
    corners (3, m): of the faces, `places` the first vertices in the places of these; boxes (m, 6): of the faces, in
    steps.
    """
    n = topology.n_shells
    if topology.stored is not topology.mesh.faces:
        return None
    by_shell, first, count = grouped(shell, n)
    if count.max() > _MOST_FACES:
        return None
    sharing = _sharing(places, shell, n)
    if sharing is None:
        return None
    one, other = np.ascontiguousarray(meeting.T)
    flat, axis, rises = np.zeros((3, len(one)), np.int8)
    for k in range(3):
        low, high = np.ascontiguousarray(topology.low[:, k]), np.ascontiguousarray(topology.high[:, k])
        after = high.take(one) == low.take(other)
        ends = after | (high.take(other) == low.take(one))
        flat += ends
        axis[ends], rises[ends] = k, after[ends]
    known = among(sharing.keys(one, other), sharing.pairs()[0]) & (flat > 0)
    whole, level = np.flatnonzero(~known), np.flatnonzero(known & (flat == 1))
    axis, rises = axis[level].astype(np.int64), rises[level].astype(np.int64)
    side_faces, side_first, side_count = _on_sides(topology, shell, columns, corners)
    side_one = one[level] * 6 + axis * 2 + rises
    side_other = other[level] * 6 + axis * 2 + 1 - rises
    m = len(by_shell)
    products = np.concatenate(
        [
            np.stack([first[one[whole]], count[one[whole]], first[other[whole]], count[other[whole]]], axis=1),
            np.stack(
                [m + side_first[side_one], side_count[side_one], m + side_first[side_other], side_count[side_other]],
                axis=1,
            ),
        ]
    )
    products = products[(products[:, 1] * products[:, 3]) > 0]
    if (products[:, 1] * products[:, 3]).sum() > _MOST_PAIRS * m:
        return None
    faces = np.concatenate([by_shell, side_faces])
    return SmallShells(sharing, faces, first, count, products, boxes)


def _on_sides(topology: Topology, shell: Ints, columns: Floats, corners: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the faces that lie in a side of their shell's box, by shell and side, where each side's begin, how many.

    Sides are numbered by axis, the lower one first: shell times 6 plus axis times 2, plus 1 for the upper one.
    """
    faces, sides = [], []
    for axis in range(3):
        one, two, three = (columns[axis].take(corner) for corner in corners)
        level = np.flatnonzero((one == two) & (two == three))
        at, of = one[level], shell[level].astype(np.int64)
        for upper, end in enumerate((topology.low, topology.high)):
            there = at == end[of, axis]
            faces.append(level[there])
            sides.append(of[there] * 6 + (axis * 2 + upper))
    order, first, count = grouped(np.concatenate(sides), 6 * topology.n_shells)
    return np.concatenate(faces)[order], first, count


def _sharing(places: Ints, shell: Ints, n: int) -> Contacts | None:
    """Return the pairs of shells that share a corner, each with two faces that do.

    None where so many shells share one that there would be too many pairs.
    """
    m = len(shell)
    key = (places.astype(np.uint64) * np.uint64(n) + shell.astype(np.uint64)).ravel()
    ordered, order = sorted_with_order(key, int(key.max()).bit_length())
    fresh = distinct(ordered)
    place, of = np.divmod(ordered[fresh].astype(np.int64), n)
    face = order[fresh] % m
    group = distinct(place)
    begin = np.flatnonzero(group)
    size = np.diff(np.append(begin, len(place)))
    if (size * (size - 1) // 2).sum() > _MOST_PAIRS * m:
        return None
    within = np.arange(len(place)) - np.repeat(begin, size)
    left = np.repeat(size, size) - within
    found, some = Contacts(n), np.arange(len(place))
    for apart in range(1, int(size.max(initial=1))):
        some = some[left[some] > apart]
        found.noted.append((found.keys(of[some], of[some + apart]), np.stack([face[some], face[some + apart]], axis=1)))
    return found


def _product(faces: Ints, products: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Yield all pairs of a row of `faces` and another for each of `products`, in blocks."""
    size = products[:, 1] * products[:, 3]
    ends = np.cumsum(size)
    start = 0
    while start < len(products):
        before = ends[start - 1] if start else 0
        stop = max(int(np.searchsorted(ends, before + _BLOCK, "right")), start + 1)
        first, _, second, wide = np.repeat(products[start:stop], size[start:stop], axis=0).T
        at = np.arange(ends[stop - 1] - before) - np.repeat(
            ends[start:stop] - size[start:stop] - before, size[start:stop]
        )
        row, column = np.divmod(at, wide)
        yield faces[first + row], faces[second + column]
        start = stop
