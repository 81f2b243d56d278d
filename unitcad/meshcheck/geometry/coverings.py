"""Faces that cover each other in one plane, and shells that pass through themselves along their edges.

Where no two faces cross, the winding number can take a value other than 0 and 1 within one shell only if the shell goes
through itself along edges that four or more of its faces share. Between the faces round such an edge, sorted by angle,
the winding number goes up where the solid begins and down where it ends: three values or more are one too many.
"""

from __future__ import annotations

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, distinct_values, sorted_with_order
from unitcad.meshcheck.geometry.edges import Edges, Turns
from unitcad.meshcheck.geometry.predicates import orient3d
from unitcad.meshcheck.geometry.topology import Topology, max_side_squared
from unitcad.meshcheck.geometry.triangle_mesh import area_vectors, float32_steps
from unitcad.meshcheck.geometry.volumes import side_by_side

_BLOCK = 1 << 14  # pairs of faces that stay in the processor's cache
_FLAT = 2.0  # float32 steps: a fold thinner than that has no thickness
_WIDE = 64.0  # float32 steps: a face lower than that may be thin by rounding


def kinds(topology: Topology, shells: Ints, opposite: Bools) -> tuple[Bools, Bools]:
    """Return which pairs that cover each other in one plane double a shell (G008), and which leave no room (G009).

    `shells` (n, 2) are theirs; `opposite`: they look opposite ways. The others belong to two shells side by side, or to
    one within the other, which G003 and G002 report.
    """
    volume, closed = topology.volumes[shells], topology.closed[shells].all(axis=1)
    apart = shells[:, 0] != shells[:, 1]
    bare = apart & closed & ~side_by_side(volume[:, 0], volume[:, 1])
    return ~opposite & ~apart, opposite & (~apart | bare)


def run_alike(a: Ints, b: Ints) -> Bools:
    """Return which pairs of faces (n, 3) run along a common edge in one direction: they lie on one side of it."""
    ends = [np.roll(face, -1, axis=1) for face in (a, b)]
    same = (a[:, :, None] == b[:, None, :]) & (ends[0][:, :, None] == ends[1][:, None, :])
    return np.asarray(same.any(axis=(1, 2)))


def wide(a: Floats, b: Floats) -> Bools:
    """Return which coplanar pairs that overlap are higher than four float32 steps both. Rounding makes lower ones."""
    high = np.ones(len(a), bool)
    least = 4 * float32_steps(np.concatenate([a, b], axis=1))
    for corners in (a, b):
        double = area_vectors(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
        height = np.sqrt(np.einsum("ij,ij->i", double, double)) / np.sqrt(max_side_squared(corners))
        high &= height > least
    return high


def through_edges(turns: Turns | None, shells: Ints) -> Ints:
    """Return edges round which the winding number of one shell takes three values or more."""
    if turns is None:
        return np.empty(0, np.int64)
    group, ends, turn = turns.group, turns.ends, turns.turn
    shell = shells[turns.half // 3]
    n = int(shell.max()) + 1  # the half-edges are in the order of turns already
    bits = (len(turns.many) * n).bit_length()
    order = sorted_with_order(group.astype(np.uint64) * np.uint64(n) + shell.astype(np.uint64), bits)[1]
    group, ends, turn, shell = group[order], ends[order], turn[order], shell[order]
    own = np.append(True, (group[1:] != group[:-1]) | (shell[1:] != shell[:-1]))
    start = np.flatnonzero(own)
    change = np.where(ends, -1, 1)
    level = np.cumsum(change)
    level -= np.repeat(level[start] - change[start], np.diff(np.append(start, len(level))))
    last = np.append((turn[1:] != turn[:-1]) | own[1:], True)
    between = np.flatnonzero(last)  # values in sectors that have a width, one shell of one edge after the other
    of = (np.cumsum(own) - 1)[between]
    low, high = np.full(len(start), 10**9), np.full(len(start), -(10**9))
    np.minimum.at(low, of, level[between])
    np.maximum.at(high, of, level[between])
    evenly = np.add.reduceat(change, start) == 0
    return turns.many[distinct_values(group[start][(high - low > 1) & evenly])]


def folded_edges(vertices: Floats, faces: Ints, edges: Edges, areas: Floats) -> tuple[Ints, Floats, Floats]:
    """Return edges of two faces that look opposite ways and are in one plane as float32 has it, though not exactly.

    And for each of them the heights of its two faces, mm, the lower one first.
    """
    two = edges.size == 2
    if not edges.closed:  # two faces that run alike are turned over, not folded
        two &= edges.balanced
    pair = edges.first[two]
    left, right = edges.order[pair] // 3, edges.order[pair + 1] // 3
    facing = np.empty(len(pair))
    for start in range(0, len(pair), _BLOCK):
        block = slice(start, start + _BLOCK)
        one, other = areas.take(left[block], axis=0), areas.take(right[block], axis=0)
        facing[block] = np.einsum("ij,ij->i", one, other)
    against = np.flatnonzero(facing < 0)
    if not len(against):
        return against, np.empty(0), np.empty(0)
    pair, left, right, facing = pair[against], left[against], right[against], facing[against]
    square = [np.einsum("ij,ij->i", areas[face], areas[face]) for face in (left, right)]
    flat = facing * facing > (1 - 1e-6) * square[0] * square[1]
    pair, left, square = pair[flat], left[flat], [values[flat] for values in square]
    ends = [faces[edges.order[pair] // 3, (edges.order[pair] % 3 + k) % 3] for k in range(3)]
    tip = faces[edges.order[pair + 1] // 3, (edges.order[pair + 1] % 3 + 2) % 3]
    corners = vertices[np.stack([*ends, tip], axis=1)]
    step = float32_steps(corners)
    length = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    height, higher = (np.sqrt(of(*square)) / length for of in (np.minimum, np.maximum))
    apart = np.abs(np.einsum("ij,ij->i", areas[left], corners[:, 3] - corners[:, 0])) / np.sqrt(square[0])
    thin = np.flatnonzero((height > _WIDE * step) & (apart <= _FLAT * step))
    exact = orient3d(*(corners[thin, k] for k in range(4))) == 0
    thin = thin[~exact]
    return np.flatnonzero(two)[against][flat][thin], height[thin], higher[thin]
