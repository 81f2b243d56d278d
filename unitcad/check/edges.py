"""Edges of a mesh: which faces meet at each, and what follows from that: boundaries, shells, umbrellas, winding.

A half-edge is 3 * face + side; side k runs from corner k to corner k + 1. Everything is sorting and gathering.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.check.mesh import Bools, Floats, Ints, cross, sorted_with_order

_SMALL = 60_000  # nodes
_SAME_ANGLE = 1e-7  # radian: faces nearer to each other lie in one plane


@dataclass(frozen=True)
class Edges:
    """Half-edges sorted by their undirected edge. `first` and `size` describe the groups in `order`.

    `closed` is true where every edge has exactly two faces that run along it in opposite directions.
    """

    order: Ints
    first: Ints
    size: Ints
    low: Ints
    high: Ints
    closed: bool


def half_edges(faces: Ints) -> tuple[Ints, Ints]:
    """Start and end vertex of every half-edge, (3 m,) each."""
    start = np.ascontiguousarray(faces).reshape(-1)
    end = np.ascontiguousarray(faces[:, [1, 2, 0]]).reshape(-1)
    return start, end


def edges_of(faces: Ints, n_vertices: int) -> Edges:
    """Group the half-edges of `faces` (no face may use a vertex twice)."""
    start, end = half_edges(faces)
    bits = max(n_vertices - 1, 1).bit_length()
    key = np.minimum(start, end).astype(np.uint64)
    key <<= np.uint64(bits)
    key |= np.maximum(start, end).astype(np.uint64)
    key, order = sorted_with_order(key, 2 * bits)
    n = len(key)
    if n % 2 == 0 and n and (key[0::2] == key[1::2]).all() and (key[1:-1:2] != key[2::2]).all():
        one, other = order[0::2], order[1::2]
        closed = not (start[one] == start[other]).any()
        first = np.arange(0, n, 2, dtype=np.int32)
        size = np.full(n // 2, 2, np.int32)
    else:
        closed = False
        fresh = np.empty(n, bool)
        fresh[:1] = True
        np.not_equal(key[1:], key[:-1], out=fresh[1:])
        first = np.flatnonzero(fresh).astype(np.int32)
        size = np.diff(np.append(first, n)).astype(np.int32)
    edge = key[first]
    low = (edge >> np.uint64(bits)).astype(np.int32)
    high = (edge & np.uint64((1 << bits) - 1)).astype(np.int32)
    return Edges(order, first, size, low, high, closed)


def opposite(edges: Edges, n_half: int) -> Ints:
    """For each half-edge the one across its edge; itself where an edge has other than two faces."""
    found = np.arange(n_half, dtype=np.int32)
    pairs = edges.first[edges.size == 2]
    one, other = edges.order[pairs], edges.order[pairs + 1]
    found[one] = other
    found[other] = one
    return found


def pinched_closed(faces: Ints, across: Ints, n_vertices: int) -> Ints:
    """Vertices of a closed, consistently wound mesh whose faces form more than one fan.

    The half-edges leaving a vertex are permuted by turning to the next face; a fan is one cycle. Cycles are counted
    by pointer doubling, in as many rounds as the largest valence has binary digits.
    """
    n = 3 * len(faces)
    start = faces.reshape(-1)
    turn = across.reshape(-1, 3)[:, [2, 0, 1]].reshape(-1)
    valence = np.bincount(start, minlength=n_vertices)
    label = np.arange(n, dtype=np.int32)
    rounds = int(valence.max(initial=1)).bit_length()
    for i in range(rounds):
        np.minimum(label, label[turn], out=label)
        if i < rounds - 1:
            turn = turn[turn]
    roots = label == np.arange(n, dtype=np.int32)
    if np.count_nonzero(roots) == np.count_nonzero(valence):
        return np.empty(0, np.int32)
    return np.flatnonzero(np.bincount(start[roots], minlength=n_vertices) > 1).astype(np.int32)


def pinched_open(faces: Ints, edges: Edges, n_vertices: int) -> Ints:
    """The same for any mesh: fans are joined across edges of two faces; vertices of edges with more are left out."""
    start, _ = half_edges(faces)
    n = len(start)
    pairs = edges.first[edges.size == 2]
    one, other = edges.order[pairs], edges.order[pairs + 1]
    ahead = np.arange(n, dtype=np.int32).reshape(-1, 3)[:, [1, 2, 0]].reshape(-1)
    same = start[one] == start[other]
    left = np.concatenate([one, ahead[one]])
    right = np.concatenate([np.where(same, other, ahead[other]), np.where(same, ahead[other], other)])
    fans = components(n, left, right)
    _, where = np.unique(fans, return_index=True)
    several = np.bincount(start[where], minlength=n_vertices) > 1
    many = edges.size > 2
    several[edges.low[many]] = False
    several[edges.high[many]] = False
    return np.flatnonzero(several).astype(np.int32)


def shells_of(vertices: Floats, faces: Ints, edges: Edges) -> Ints:
    """The shell of each face, numbered by their first face.

    Faces are joined across edges of two faces, and in pairs across edges of four, six and so on.
    """
    pairs = edges.first[edges.size == 2]
    left, right = edges.order[pairs], edges.order[pairs + 1]
    if not edges.closed and len(many := np.flatnonzero((edges.size > 2) & balanced(faces, edges))):
        one, other = _paired(vertices, faces, edges, many)
        left, right = np.concatenate([left, one]), np.concatenate([right, other])
    return components(len(faces), left // 3, right // 3)


def balanced(faces: Ints, edges: Edges) -> Bools:
    """For each edge, whether as many faces run along it one way as the other, as they do round a solid."""
    along = faces.reshape(-1)[edges.order] == np.repeat(edges.low, edges.size)
    return 2 * np.add.reduceat(along.astype(np.int32), edges.first) == edges.size if len(along) else along


def _paired(vertices: Floats, faces: Ints, edges: Edges, many: Ints) -> tuple[Ints, Ints]:
    """Half-edges at the balanced edges `many` in pairs that have the solid between them.

    By angle about the edge, the solid begins at faces that run from its high vertex to its low one and ends at the
    others. Where it begins twice before it ends (solids that overlap), first begun is first ended, so that faces in one
    place need no order.
    """
    size = edges.size[many]
    group = np.repeat(np.arange(len(many)), size)
    starts = np.cumsum(size) - size
    place = np.arange(len(group)) - starts[group]
    half = edges.order[edges.first[many][group] + place]
    face, side = half // 3, half % 3
    ends = faces[face, side] == edges.low[many][group]
    origin = vertices[edges.low[many]]
    axis = vertices[edges.high[many]] - origin
    axis /= np.sqrt(np.einsum("ij,ij->i", axis, axis))[:, None]
    axis = axis[group]
    out = vertices[faces[face, (side + 2) % 3]] - origin[group]
    out -= axis * np.einsum("ij,ij->i", out, axis)[:, None]
    zero = out[starts][group]
    angle = np.arctan2(np.einsum("ij,ij->i", cross(zero, out), axis), np.einsum("ij,ij->i", zero, out))
    turn = np.round(angle / _SAME_ANGLE).astype(np.int64) % round(2 * np.pi / _SAME_ANGLE)
    order = np.lexsort((half, ~ends, turn, group))
    half, ends = half[order], ends[order]
    inside = np.cumsum(np.where(ends, -1, 1))  # solids that have begun and not ended; zero at each edge's last face
    outermost = np.flatnonzero(inside == np.minimum.reduceat(inside, starts)[group])
    outermost = outermost[np.unique(group[outermost], return_index=True)[1]]
    rank = (place + starts[group] - outermost[group] - 1) % size[group]
    order = np.lexsort((rank, group))
    half, ends = half[order], ends[order]
    return half[~ends], half[ends]


def components(n: int, left: Ints, right: Ints) -> Ints:
    """The component of each of `n` nodes joined by pairs, numbered in the order of their first node."""
    if n > _SMALL:
        # scipy's search is faster on large graphs, but loading it takes longer than judging a small mesh.
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        graph = coo_array((np.ones(len(left), np.int8), (left, right)), shape=(n, n))
        return connected_components(graph, directed=False)[1]
    root = np.arange(n)
    while True:
        a, b = root[left], root[right]
        apart = a != b
        if not apart.any():
            break
        left, right, a, b = left[apart], right[apart], a[apart], b[apart]
        np.minimum.at(root, np.maximum(a, b), np.minimum(a, b))
        while True:
            above = root[root]
            if np.array_equal(above, root):
                break
            root = above
    return np.unique(root, return_inverse=True)[1].reshape(-1)
