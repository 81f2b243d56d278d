"""How deep faces pass through or cover each other: rounding in a file makes crossings that no printer can make."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from unitcad.geometry.arrays import Floats, Ints, cross, sorted_with_order
from unitcad.meshcheck.geometry.topology import max_side_squared
from unitcad.meshcheck.geometry.triangle_mesh import float32_steps

MOST = 20_000
"""Pairs whose depth is worked out; more of them are no rounding."""
_MOST_NEIGHBOURS = 4_000_000
_STEPS = 4  # float32 steps: no less is told from rounding
_SEEN = 3  # pairs in which one fold shows
_PART = 0.1  # of a face: of finer faces none reaches deep, though all of them together do


def crossing_depths(vertices: Floats, corners: Ints, pairs: Ints, least: float) -> Floats:
    """Return how deep pairs of faces (n, 2) that cross reach through each other, mm; infinity if that is not shallow.

    A face reaches through another's plane as far as the neighbours of its corners there do. `corners` (3, m) are the
    faces' vertices. No depth above `least` (mm) or a tenth of the face is shallow, unless float32 steps are larger.
    """
    depth = np.full(len(pairs), np.inf)
    for face, holder in (pairs.T, pairs.T[::-1]) if 0 < len(pairs) <= MOST else ():
        a, b = (vertices[corners[:, f].T] for f in (face, holder))
        depth = np.minimum(
            depth, _shallow(_beyond(vertices, corners, face, a, b), a, b, np.sqrt(max_side_squared(a)), least)
        )
    return depth


def _shallow(depth: Floats, a: Floats, b: Floats, size: Floats, least: float) -> Floats:
    steps = float32_steps(np.concatenate([a, b], axis=1))
    return np.where(depth <= np.maximum(_STEPS * steps, np.minimum(least, _PART * size)), depth, np.inf)


def _beyond(vertices: Floats, corners: Ints, face: Ints, a: Floats, b: Floats) -> Floats:
    """Return how far the surface round each face (n,), with corners `a`, reaches to the nearer side of b's plane.

    It is without end if vertices have too many neighbours to look at.
    """
    normal = cross(b[:, 1] - b[:, 0], b[:, 2] - b[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    near, first, count = _neighbours(corners, np.unique(corners[:, face]), len(vertices))
    seeds = corners[:, face].T.reshape(-1)
    if int(count[seeds].sum()) > _MOST_NEIGHBOURS:
        return np.full(len(face), np.inf)
    row = np.repeat(np.arange(len(seeds)), count[seeds])
    place = np.arange(len(row)) - np.repeat(np.cumsum(count[seeds]) - count[seeds], count[seeds])
    pair = row // 3
    away = np.einsum("ij,ij->i", vertices[near[first[seeds][row] + place]] - b[pair, 0], normal[pair])
    own = np.einsum("ikj,ij->ik", a - b[:, :1], normal)
    step = float32_steps(np.concatenate([a, b], axis=1))[:, None]
    reach = np.zeros((2, len(face)))
    for side, sign in enumerate((1.0, -1.0)):
        there = (sign * own >= -step).reshape(-1)[row]
        np.maximum.at(reach[side], pair[there], sign * away[there])
    return reach.min(axis=0)


def _neighbours(corners: Ints, asked: Ints, n: int) -> tuple[Ints, Ints, Ints]:
    """Return the vertices that share a face with those `asked`, themselves included; of each the first, how many."""
    wanted = np.zeros(n, bool)
    wanted[asked] = True
    some = corners[:, wanted[corners].any(axis=0)]
    start = np.concatenate([np.repeat(corner, 3) for corner in some])
    end = np.concatenate([some.T.reshape(-1)] * 3)
    order = sorted_with_order(start.astype(np.uint64), max(n, 1).bit_length())[1]
    count = np.bincount(start, minlength=n)
    return end[order], np.cumsum(count) - count, count


def covering_depths(vertices: Floats, corners: Ints, pairs: Ints, least: float) -> Floats:
    """Return how deep pairs of faces (n, 2) in one plane cover each other, mm; infinity if that is not shallow.

    A pair's depth is the way in the plane by which the faces come apart, or the mean
    width that all faces together cover of one of the two, by fold, if that is more. The others are as in
    `crossing_depths`.
    """
    if not 0 < len(pairs) <= MOST:
        return np.full(len(pairs), np.inf)
    a, b = (vertices[corners[:, f].T] for f in pairs.T)
    normals = [cross(of[:, 1] - of[:, 0], of[:, 2] - of[:, 0]) for of in (a, b)]
    double = [np.linalg.norm(normal, axis=1) for normal in normals]
    normal = np.where((double[0] >= double[1])[:, None], *normals)
    depth = np.min([_overlap(a, b, axis) for axis in _across(a, b, normal)], axis=0)
    longest = [np.sqrt(max_side_squared(of)) for of in (a, b)]
    strip, both = depth * np.minimum(*longest), pairs.T.reshape(-1)
    covered = np.bincount(both, np.concatenate([strip, strip]))[pairs] / _SEEN
    depth = np.max([depth, covered[:, 0] / longest[0], covered[:, 1] / longest[1]], axis=0)
    height = np.maximum(double[0] / longest[0], double[1] / longest[1])
    return _shallow(depth, a, b, height, least)


def folded(low: Floats, high: Floats, least: float) -> Floats:
    """Return `low`, the lesser height of two faces that fold onto each other, or infinity if that is not shallow."""
    return np.where(low <= np.minimum(least, _PART * high), low, np.inf)


def _across(a: Floats, b: Floats, normal: Floats) -> Iterator[Floats]:
    """Yield unit vectors in the plane square to each side of both faces."""
    for of in (a, b):
        for k in range(3):
            axis = cross(of[:, k] - of[:, k - 1], normal)
            yield axis / np.maximum(np.linalg.norm(axis, axis=1), 1e-300)[:, None]


def _overlap(a: Floats, b: Floats, axis: Floats) -> Floats:
    one, other = (np.einsum("ikj,ij->ik", of - a[:, :1], axis) for of in (a, b))
    return np.minimum(one.max(axis=1) - other.min(axis=1), other.max(axis=1) - one.min(axis=1))
