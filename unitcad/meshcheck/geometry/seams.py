"""Open edges: whether welding closes them (T006), and which are T-junctions (T005).

How near two vertices must lie to count as one depends on their own shell and edges, never on what else is in the file.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, distinct_values, extents
from unitcad.geometry.boxes import box_pairs
from unitcad.geometry.components import components
from unitcad.meshcheck.geometry.edges import half_edges
from unitcad.meshcheck.geometry.triangle_mesh import float32_steps, same_place

WELD = 1e-5  # of the shell's diagonal
NARROW = 0.1  # of the shortest edge at a vertex
_CROWD = 30  # points within reach of a vertex, itself too: more means points that lie everywhere, not a seam
_BLOCK = 1024  # pairs of boxes looked at: of so many for each of a crowd the rest is not looked at
_BLOCKS = 64  # blocks that a few points may take


@dataclass(frozen=True)
class Seams:
    """Faces with vertices joined: in `stored` those in one place, in `joined` also those within reach.

    `whole` are the faces that keep three vertices in `stored`. `reach`: how near to a vertex another one counts as the
    same, mm; 0 where the vertex is on no open edge.
    """

    stored: Ints
    joined: Ints
    whole: Bools
    reach: Floats


def join(vertices: Floats, faces: Ints, loose: Ints) -> Seams:
    """Join the vertices `loose` (those of open edges).

    Two are joined where they are nearer than a tenth of the shortest edge at either, and than 1e-5 of the diagonal of
    their shell (or two float32 steps). A shell is here what faces and these joins connect: of all ways to choose it the
    largest that agrees with itself. No face collapses: joins that would do that are left out.
    """
    n = len(vertices)
    place = np.arange(n, dtype=np.int32)
    place[loose] = loose[same_place(vertices[loose])]
    stored = place[faces]
    whole = _three(stored)
    points = distinct_values(place[loose])
    short = _shortest_edges(vertices, stored[whole], points)
    step = 2 * float32_steps(vertices[points])
    part = connected(stored, n)
    boxes = extents(vertices, part, int(part.max()) + 1)
    mine = part[points]

    def reaches(shell: Ints) -> Floats:
        low = extents(boxes[0][mine], shell[mine], len(shell))[0]
        high = extents(boxes[1][mine], shell[mine], len(shell))[1]
        size = np.linalg.norm((high - low)[shell[mine]], axis=1)
        return np.minimum(NARROW * short, np.maximum(WELD * size, step))

    reach = reaches(np.zeros(len(boxes[0]), np.int64))
    pairs, distance = _near(vertices[points], reach)
    while True:
        reach = reaches(components(len(boxes[0]), mine[pairs[:, 0]], mine[pairs[:, 1]]))
        fits = distance <= reach[pairs].min(axis=1, initial=np.inf)
        if fits.all():
            break
        pairs, distance = pairs[fits], distance[fits]
    everywhere = np.zeros(n)
    everywhere[points] = reach
    return Seams(stored, _joined(place, stored, points, pairs), whole, everywhere)


def _three(faces: Ints) -> Bools:
    return (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])


def connected(faces: Ints, n: int) -> Ints:
    """Return for each of `n` vertices which part of the mesh it belongs to: faces connect their vertices."""
    spokes = np.concatenate([faces[:, 0], faces[:, 0]]), np.concatenate([faces[:, 1], faces[:, 2]])
    return components(n, *spokes)


def _shortest_edges(vertices: Floats, faces: Ints, points: Ints) -> Floats:
    """Return the length of the shortest edge at each of `points`, mm."""
    asked = np.zeros(len(vertices), bool)
    asked[points] = True
    start, end = half_edges(faces[asked[faces].any(axis=1)])
    length = np.linalg.norm(vertices[end] - vertices[start], axis=1)
    short = np.full(len(vertices), np.inf)
    np.minimum.at(short, start, length)
    np.minimum.at(short, end, length)
    return short[points]


def _near(points: Floats, reach: Floats) -> tuple[Ints, Floats]:
    """Return pairs of points within both their reaches, and their distances.

    Points of like reach are searched together, so that a coarse shell does not make a fine one a crowd.
    """
    near = [np.empty((0, 2), np.int64)]
    level = np.ceil(np.log2(np.maximum(reach, 1e-300)) / 2)
    for size in distinct_values(level):
        some = np.flatnonzero(level >= size)
        if len(some) > 1:
            pairs = some[_within(points[some], float(4.0**size))]
            near.append(pairs[level[pairs].min(axis=1, initial=np.inf) == size])
    pairs = np.concatenate(near)
    distance = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    fits = distance <= reach[pairs].min(axis=1, initial=np.inf)
    return pairs[fits], distance[fits]


class _Crowd(Exception):
    """Points that lie close on the scale of all of them."""


def _within(points: Floats, reach: float) -> Ints:
    """Return pairs (k, 2) of points no farther from each other than `reach`; none of a crowd."""
    n = len(points)
    blocks = iter(range(_BLOCKS + _CROWD * n // _BLOCK))

    def tick() -> None:
        if next(blocks, None) is None:
            raise _Crowd

    try:
        half = 0.5000001 * reach
        pairs = box_pairs(points - half, points + half, tick)
    except _Crowd:
        # The boxes' steps are too coarse for them.
        from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

        tree = cKDTree(points)
        if tree.count_neighbors(tree, reach) > _CROWD * n:
            return np.empty((0, 2), np.int64)
        return tree.query_pairs(reach, output_type="ndarray")
    pairs = pairs[np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1) <= reach]
    return pairs if n + 2 * len(pairs) <= _CROWD * n else pairs[:0]


def _joined(place: Ints, stored: Ints, points: Ints, pairs: Ints) -> Ints:
    """Return the faces with the points of each group of pairs made one, but for groups that would collapse a face."""
    group = components(len(points), pairs[:, 0], pairs[:, 1])
    _, first = np.unique(group, return_index=True)
    target = np.arange(len(place), dtype=np.int32)
    target[points] = points[first[group]]
    joined = target[stored]
    spoilt = joined[_three(stored) & ~_three(joined)].reshape(-1)
    if len(spoilt):
        back = np.isin(target, spoilt)
        target[back] = np.flatnonzero(back)
        joined = target[stored]
    return joined


def t_junctions(vertices: Floats, low: Ints, high: Ints, reach: Floats) -> Bools:
    """Return which open edges (low, high) have another vertex of the open border on them, within its `reach`.

    Where a long open edge meets a chain of short ones, the first short one starts at an end of the long one and lies
    along it; so only open edges that share a vertex are compared.
    """
    n = len(low)
    here = np.concatenate([low, high])
    there = np.concatenate([high, low])
    edge = np.concatenate([np.arange(n), np.arange(n)])
    order = np.argsort(here, kind="stable")
    here, there, edge = here[order], there[order], edge[order]
    hit = np.zeros(n, bool)
    for shift in range(1, 9):
        if shift >= len(here):
            break
        together = np.flatnonzero(here[shift:] == here[:-shift])
        if not len(together):
            break
        for a, b in ((together, together + shift), (together + shift, together)):
            near = reach[here[a]]
            origin = vertices[here[a]]
            along = vertices[there[a]] - origin
            other = vertices[there[b]] - origin
            length = np.linalg.norm(along, axis=1)
            part = np.einsum("ij,ij->i", along, other) / np.maximum(length, 1e-300)
            off = np.linalg.norm(other - along * (part / np.maximum(length, 1e-300))[:, None], axis=1)
            on = (off <= near) & (part > near) & (part < length - near)
            hit[edge[a[on]]] = True
    return hit
