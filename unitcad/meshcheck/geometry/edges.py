"""Edges of a mesh: which faces meet at each, and what follows from that: boundaries, shells, umbrellas, winding.

A half-edge is 3 * face + side; side k runs from corner k to corner k + 1. Everything is sorting and gathering.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from unitcad.geometry.arrays import (
    Bools,
    Floats,
    Ints,
    by_appearance,
    cross,
    distinct,
    distinct_values,
    order_of_packed,
)
from unitcad.geometry.components import components, scipy_pays
from unitcad.lean_import import postpone_tools

_BLOCK = 1 << 14  # faces that stay in the processor's cache
_SAME_ANGLE = 1e-7  # radian: faces nearer to each other lie in one plane


@dataclass(frozen=True, eq=False)
class Edges:
    """Half-edges of `faces` sorted by their undirected edge. `first` and `size` describe the groups in `order`.

    `closed` is true where every edge has exactly two faces that run along it in opposite directions.
    """

    faces: Ints
    order: Ints
    first: Ints
    size: Ints
    low: Ints
    high: Ints
    closed: bool

    @cached_property
    def balanced(self) -> Bools:
        """Whether at each edge as many faces run one way as the other, as they do round a solid."""
        last = self.first + self.size - 1
        count = np.cumsum(self.faces.reshape(-1)[self.order] == np.repeat(self.low, self.size), dtype=np.int32)[last]
        return 2 * np.diff(count, prepend=np.int32(0)) == self.size


@dataclass(frozen=True, eq=False)
class Turns:
    """The half-edges of the edges `many` by edge and angle, and what is known of each.

    `group` is the place of its edge in `many`, `ends` whether the solid ends at its face, `turn` the rank of its angle,
    the same for faces in one plane. By angle about the edge, the solid begins at faces that run from its high vertex to
    its low one and ends at the others.
    """

    many: Ints
    half: Ints
    group: Ints
    ends: Bools
    turn: Ints


def half_edges(faces: Ints) -> tuple[Ints, Ints]:
    """Return start and end vertex of every half-edge, (3 m,) each."""
    start = np.ascontiguousarray(faces).reshape(-1)
    end = np.ascontiguousarray(faces[:, [1, 2, 0]]).reshape(-1)
    return start, end


def edges_of(faces: Ints, n_vertices: int) -> Edges:
    """Group the half-edges of `faces` (no face may use a vertex twice)."""
    start = np.ascontiguousarray(faces).reshape(-1)
    order, low, high = _sorted_edges(faces, n_vertices)
    n = len(order)
    fresh = np.empty(n, bool)
    fresh[:1] = True
    np.not_equal(low[1:], low[:-1], out=fresh[1:])
    fresh[1:] |= high[1:] != high[:-1]
    first = np.flatnonzero(fresh).astype(np.int32)
    size = np.diff(np.append(first, np.int32(n)))
    closed = n > 0 and bool((size == 2).all()) and not (start[order[0::2]] == start[order[1::2]]).any()
    return Edges(faces, order, first, size, low[first], high[first], bool(closed))


def _sorted_edges(faces: Ints, n_vertices: int) -> tuple[Ints, Ints, Ints]:
    """Return half-edges in the order of (low, high, half-edge), and these two ends in that order."""
    n, bits = 3 * len(faces), max(n_vertices - 1, 1).bit_length()
    room = max(n - 1, 1).bit_length()
    if scipy_pays(n) or 2 * bits + room > 64:
        return _by_transposing(faces, n_vertices)
    key = np.empty((len(faces), 3), np.uint64)
    for first in range(0, len(faces), _BLOCK):
        some = faces[first : first + _BLOCK]
        for side in range(3):
            start, end = some[:, side], some[:, (side + 1) % 3]
            ends = np.minimum(start, end).astype(np.uint64)
            ends <<= np.uint64(bits)
            ends |= np.maximum(start, end).astype(np.uint64)
            np.left_shift(ends, np.uint64(room), out=key[first : first + _BLOCK, side])
    ends = key.reshape(-1)
    order = order_of_packed(ends, room)
    low, high = np.empty((2, n), np.int32)
    np.right_shift(ends, np.uint64(bits), out=low, casting="unsafe")
    np.bitwise_and(ends, np.uint64((1 << bits) - 1), out=high, casting="unsafe")
    return order, low, high


def _by_transposing(faces: Ints, n_vertices: int) -> tuple[Ints, Ints, Ints]:
    """Return what `_sorted_edges` does, of many half-edges: to transpose a sparse matrix is a counting sort.

    First by the high end, then by the low one.
    """
    postpone_tools()
    from scipy.sparse import csr_array

    start, end = half_edges(faces)
    n, low, high = len(start), np.minimum(start, end), np.maximum(start, end)
    by_high = csr_array((low, high, np.arange(n + 1, dtype=np.int32)), shape=(n, n_vertices)).tocsc()
    by_low = csr_array((by_high.indices, by_high.data, by_high.indptr), shape=(n_vertices, n_vertices)).tocsc()
    return by_low.data, np.repeat(np.arange(n_vertices, dtype=np.int32), np.diff(by_low.indptr)), by_low.indices


def opposite(edges: Edges, n_half: int) -> Ints:
    """Return for each half-edge the one across its edge; itself where an edge has other than two faces."""
    across = np.arange(n_half, dtype=np.int32)
    pairs = edges.first[edges.size == 2]
    one, other = edges.order[pairs], edges.order[pairs + 1]
    across[one] = other
    across[other] = one
    return across


def surrounded(edges: Edges, n_vertices: int) -> Bools:
    """Return which vertices have two faces, wound alike, at all their edges."""
    whole = np.ones(n_vertices, bool)
    if not edges.closed:
        wrong = (edges.size != 2) | ~edges.balanced
        whole[edges.low[wrong]] = whole[edges.high[wrong]] = False
    return whole


def pinched_closed(faces: Ints, across: Ints, n_vertices: int) -> Ints:
    """Return vertices of a closed, consistently wound mesh whose faces form more than one fan."""
    return np.flatnonzero(_fans(faces, across, np.ones(n_vertices, bool)) > 1).astype(np.int32)


def pinched_open(faces: Ints, edges: Edges, n_vertices: int) -> Ints:
    """Return such vertices of any mesh, without those of edges that have more than two faces.

    Fans are joined across edges of two faces.
    """
    whole = surrounded(edges, n_vertices)
    rest, many = ~whole, edges.size > 2
    rest[edges.low[many]] = rest[edges.high[many]] = False
    several = _fans(faces, opposite(edges, 3 * len(faces)), whole) > 1
    if rest.any():
        first = edges.first[(edges.size == 2) & (rest[edges.low] | rest[edges.high])]
        start = np.ascontiguousarray(faces).reshape(-1)
        several |= _joined_fans(start, edges.order[first], edges.order[first + 1], rest) > 1
    return np.flatnonzero(several).astype(np.int32)


def _fans(faces: Ints, across: Ints, asked: Bools) -> Ints:
    """Return how many fans the faces of each vertex form, of those that are `asked`, where all edges have two faces.

    The half-edges leaving a vertex are permuted by turning to the next face; a fan is one cycle. Cycles are counted
    by pointer doubling, in as many rounds as the largest valence has binary digits.
    """
    start, places = np.ascontiguousarray(faces).reshape(-1), np.arange(3 * len(faces), dtype=np.int32)
    turn = across.reshape(-1, 3)[:, [2, 0, 1]].reshape(-1)
    valence = np.bincount(start, minlength=len(asked))
    if not asked.all():
        turn = np.where(asked.take(start), turn, places)
    label = places.copy()
    rounds = int(valence.max(initial=1, where=asked)).bit_length()
    for i in range(rounds):
        np.minimum(label, label.take(turn), out=label)
        if i < rounds - 1:
            turn = turn.take(turn)
    fresh = label == places
    if np.count_nonzero(fresh) == np.count_nonzero(valence):
        return np.minimum(valence, 1)
    fans = np.bincount(start[fresh], minlength=len(asked))
    fans[~asked] = 0
    return fans


def _joined_fans(start: Ints, one: Ints, other: Ints, asked: Bools) -> Ints:
    """Return how many fans the faces of each vertex form, of those that are `asked`.

    `one` and `other` are half-edges in pairs, at least all of edges of two faces at these vertices.
    """
    half = np.flatnonzero(asked.take(start))
    number = np.full(len(start), -1)
    number[half] = np.arange(len(half))
    one_on, other_on = (side // 3 * 3 + (side + 1) % 3 for side in (one, other))  # the next half-edge of its face
    alike = start[one] == start[other]
    left = number[np.concatenate([one, one_on])]
    right = number[np.concatenate([np.where(alike, other, other_on), np.where(alike, other_on, other)])]
    kept = left >= 0
    fans = components(len(half), left[kept], right[kept])
    _, where = np.unique(fans, return_index=True)
    return np.bincount(start[half[where]], minlength=len(asked))


def shells_of(faces: Ints, edges: Edges, turns: Turns | None) -> Ints:
    """Return the shell of each face, numbered by their first face.

    Faces are joined across edges of two faces, and in pairs across edges of four, six and so on, by their `turns`.
    """
    pairs = edges.first[edges.size == 2]
    left, right = edges.order[pairs], edges.order[pairs + 1]
    if turns is not None:
        one, other = _paired(edges, turns)
        left, right = np.concatenate([left, one]), np.concatenate([right, other])
    return components(len(faces), left // 3, right // 3)


def shells_by_vertex(faces: Ints, edges: Edges, n_vertices: int) -> Ints:
    """Return the same where no vertex has faces of two shells."""
    shells = components(n_vertices, edges.low, edges.high).take(faces[:, 0])
    n = int(shells.max(initial=0)) + 1
    if n == 1:
        return shells
    first = np.full(n, len(shells))  # of a vertex that no face uses: after all
    first[shells[::-1]] = np.arange(len(shells))[::-1]
    return by_appearance(first, len(shells) + 1)[1].take(shells)


def turns_of(vertices: Floats, faces: Ints, edges: Edges) -> Turns | None:
    """Return the turns at the edges of four, six and so on faces that are balanced; None where there are none."""
    if edges.closed:
        return None
    many = np.flatnonzero((edges.size > 2) & edges.balanced)
    return _around(vertices, faces, edges, many) if len(many) else None


def _around(vertices: Floats, faces: Ints, edges: Edges, many: Ints) -> Turns:
    size = edges.size[many]
    group = np.repeat(np.arange(len(many), dtype=np.int32), size)
    starts = np.cumsum(size) - size
    half = edges.order[edges.first[many][group] + np.arange(len(group)) - starts[group]]
    face, side = half // 3, half % 3
    ends = faces[face, side] == edges.low[many][group]
    origin = vertices[edges.low[many]]
    axis = vertices[edges.high[many]] - origin
    length = np.sqrt(np.einsum("ij,ij->i", axis, axis))
    axis /= np.where(length > 0, length, 1.0)[:, None]  # two vertices of one place have an edge without direction
    axis = axis[group]
    out = vertices[faces[face, (side + 2) % 3]] - origin[group]
    out -= axis * np.einsum("ij,ij->i", out, axis)[:, None]
    zero = out[starts][group]
    angle = np.arctan2(np.einsum("ij,ij->i", cross(zero, out), axis), np.einsum("ij,ij->i", zero, out))
    angle[angle < -_SAME_ANGLE] += 2 * np.pi
    angle[angle > 2 * np.pi - _SAME_ANGLE] -= 2 * np.pi
    order = _order_within(size, starts, angle)
    angle, half, ends = angle[order], half[order], ends[order]
    fresh = np.diff(angle, prepend=-np.inf) > _SAME_ANGLE
    fresh[starts] = True
    return Turns(many, half, group, ends, np.cumsum(fresh, dtype=np.int32) - np.int32(1))


def _order_within(size: Ints, starts: Ints, values: Floats) -> Ints:
    """Return the order of values by size within each of some groups that follow each other; equal ones stay."""
    order = np.arange(len(values))
    for n in distinct_values(size).tolist():
        places = starts[size == n][:, None] + np.arange(n)
        order[places] = np.take_along_axis(places, np.argsort(values[places], axis=1, kind="stable"), axis=1)
    return order


def _paired(edges: Edges, turns: Turns) -> tuple[Ints, Ints]:
    """Return half-edges at the edges of `turns` in pairs that have the solid between them.

    Where it begins twice before it ends (solids that overlap), first begun is first ended, so that faces in one place
    need no order. Where it begins and ends in one plane, one solid ends and the next one begins.
    """
    half, group, ends, turn = turns.half, turns.group, turns.ends, turns.turn
    size = edges.size[turns.many]
    starts = np.cumsum(size) - size
    place = np.arange(len(group)) - starts[group]
    bits = int(half.max()).bit_length()
    key = (turn.astype(np.uint64) * np.uint64(2) + ~ends) << np.uint64(bits)  # an edge has no turn of another
    key |= half.astype(np.uint64)
    key.sort()
    half, ends = (key & np.uint64((1 << bits) - 1)).astype(half.dtype), (key >> np.uint64(bits)) % 2 == 0
    inside = np.cumsum(np.where(ends, -1, 1))  # solids that have begun and not ended; zero at each edge's last face
    outermost = np.flatnonzero(inside == np.minimum.reduceat(inside, starts)[group])
    outermost = outermost[distinct(group[outermost])]
    rank = (place + starts[group] - outermost[group] - 1) % size[group]
    order = np.empty(len(group), np.int64)
    order[starts[group] + rank] = np.arange(len(group))
    half, ends = half[order], ends[order]
    return half[~ends], half[ends]
