"""Open edges: whether welding closes them (T006), and which are T-junctions (T005)."""

from __future__ import annotations

import numpy as np

from unitcad.check.edges import components
from unitcad.check.mesh import Bools, Floats, Ints, diagonal, float32_step, weld_exact

WELD = 1e-5  # of the bounding box's diagonal; six-digit text rounds coordinates by a tenth of this
_CROWD = 30  # pairs within reach a vertex: more means points that lie everywhere, not a seam


def tolerance(vertices: Floats) -> float:
    """How near two vertices must lie to count as one, mm: 1e-5 of the diagonal, or two float32 steps."""
    return max(WELD * diagonal(vertices), 2 * float32_step(vertices))


def welded(vertices: Floats, faces: Ints, loose: Ints) -> Ints:
    """The faces with the vertices `loose` joined where they lie within the tolerance; faces may then collapse."""
    places = vertices[loose]
    _, same = weld_exact(places.reshape(-1, 1, 3).repeat(3, axis=1))
    rank = same[:, 0]
    unique, back = np.unique(rank, return_index=True)
    new_id = np.searchsorted(unique, rank)
    points = places[back]
    joined = _close_groups(points, tolerance(vertices))
    target = np.arange(len(vertices), dtype=np.int32)
    group = joined[new_id]
    _, first = np.unique(group, return_index=True)
    target[loose] = loose[first[np.searchsorted(np.unique(group), group)]]
    return target[faces]


def _close_groups(points: Floats, reach: float) -> Ints:
    from scipy.spatial import cKDTree  # pyright: ignore[reportAttributeAccessIssue]

    n = len(points)
    if n < 2:
        return np.arange(n)
    tree = cKDTree(points)
    if tree.count_neighbors(tree, reach) > _CROWD * n:
        return np.arange(n)
    pairs = tree.query_pairs(reach, output_type="ndarray")
    return components(n, pairs[:, 0], pairs[:, 1])


def t_junctions(vertices: Floats, low: Ints, high: Ints, reach: float) -> Bools:
    """Which open edges (low, high) have another vertex of the open border on them.

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
            origin = vertices[here[a]]
            along = vertices[there[a]] - origin
            other = vertices[there[b]] - origin
            length = np.linalg.norm(along, axis=1)
            part = np.einsum("ij,ij->i", along, other) / np.maximum(length, 1e-300)
            off = np.linalg.norm(other - along * (part / np.maximum(length, 1e-300))[:, None], axis=1)
            on = (off <= reach) & (part > reach) & (part < length - reach)
            hit[edge[a[on]]] = True
    return hit
