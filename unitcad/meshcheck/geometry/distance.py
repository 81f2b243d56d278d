"""Distances between two surfaces of triangles: the largest one (Hausdorff's), and from points to the nearest face."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.geometry.boxes import Tick, frame_of, morton_order

_FAN = 8  # nodes below one, and faces of a leaf
_BLOCK = 2048  # points looked for together
_MOST = 100_000  # pieces of a surface: the last ones are as large as they are, and the error says so
_PASSES = ((0.01, _MOST), (0.001, 10_000))
"""Tolerances of the largest distance, as parts of the diagonal, and the most pieces looked at for each."""


@dataclass(frozen=True)
class Farthest:
    """Largest distance found, mm, and how much larger the true one may be, mm."""

    distance: float
    error: float


@dataclass(frozen=True, eq=False)
class Nearest:
    """A tree of boxes over triangles, to find the nearest one: `corners` (3, 3, n) by corner and axis, `middles` (n, 3).

    `levels` from the root's down have low and high ends of the boxes, (3, k) each.
    """

    corners: Floats
    middles: Floats
    levels: list[tuple[Floats, Floats]]

    def distances(self, points: Floats, tick: Tick = lambda: None) -> Floats:
        """Return the distances (n,) of points (n, 3) to the surface, mm."""
        columns = np.ascontiguousarray(points.T)
        found = self._guess(columns)
        for start in range(0, len(points), _BLOCK):
            tick()
            block = slice(start, start + _BLOCK)
            self._search(columns[:, block], found[block])
        return np.sqrt(found)

    def _guess(self, points: Floats) -> Floats:
        """Return squares of the distances to the faces before and after each point on a space-filling curve."""
        n = len(self.middles)
        both = np.concatenate([self.middles, points.T])
        order = morton_order(frame_of(both).steps(both))
        faces = np.where(order < n, order, -1)
        before = np.maximum.accumulate(np.where(faces >= 0, np.arange(len(order)), -1))
        after = np.minimum.accumulate(np.where(faces >= 0, np.arange(len(order)), len(order))[::-1])[::-1]
        found = np.full(len(order), np.inf)
        asked = np.flatnonzero(order >= n)
        for beside in (before[asked], after[asked]):
            there = (beside >= 0) & (beside < len(order))
            which = order[asked[there]]
            here = squares(points[:, which - n], self.corners[:, :, order[beside[there]]])
            found[which] = np.minimum(found[which], here)
        return found[n:]

    def _search(self, points: Floats, found: Floats) -> None:
        """Go down the tree with all points, and lower the squares `found`; nodes farther than that are left out."""
        of, node = (part.ravel() for part in np.indices((points.shape[1], self.levels[0][0].shape[1])))
        for depth, (low, high) in enumerate(self.levels):
            if depth:
                of, node = _below(of, node, low.shape[1])
            here = points.take(of, axis=1)
            away = np.maximum(low.take(node, axis=1) - here, here - high.take(node, axis=1))
            np.maximum(away, 0, out=away)
            keep = np.flatnonzero(np.einsum("ij,ij->j", away, away) < found[of])
            of, node = of[keep], node[keep]
        of, face = _below(of, node, self.corners.shape[2])
        np.minimum.at(found, of, squares(points.take(of, axis=1), self.corners.take(face, axis=2)))


def _below(of: Ints, node: Ints, there: int) -> tuple[Ints, Ints]:
    """Return the points and nodes of the next level, which has so many, for those of pairs."""
    node = (node[:, None] * _FAN + np.arange(_FAN)).ravel()
    kept = np.flatnonzero(node < there)
    return np.repeat(of, _FAN)[kept], node[kept]


def nearest_of(corners: Floats) -> Nearest:
    """Return the tree over triangles (n, 3, 3), one at least."""
    middles = corners.mean(axis=1)
    order = morton_order(frame_of(middles).steps(middles))
    columns = np.ascontiguousarray(corners[order].transpose(1, 2, 0))
    low, high = columns.min(axis=0), columns.max(axis=0)
    levels = []
    while not levels or low.shape[1] > _FAN:
        starts = np.arange(0, low.shape[1], _FAN)
        low, high = np.minimum.reduceat(low, starts, axis=1), np.maximum.reduceat(high, starts, axis=1)
        levels.append((low, high))
    return Nearest(columns, middles[order], levels[::-1])


def squares(points: Floats, faces: Floats) -> Floats:
    """Return the squares of the distances of points (3, n) to triangles (3, 3, n): to the inside, or else to a side."""
    a, b, c = faces
    normal = _cross(b - a, c - a)
    size = _dot(normal, normal)
    inside, found = size > 0, np.full(points.shape[1], np.inf)
    for start, end in ((a, b), (b, c), (c, a)):
        along, off = end - start, points - start
        inside &= _dot(_cross(along, off), normal) >= 0
        share = np.clip(_dot(off, along) / np.maximum(_dot(along, along), 1e-300), 0, 1)
        away = off - share * along
        np.minimum(found, _dot(away, away), out=found)
    height = _dot(points - a, normal)
    return np.where(inside, np.minimum(found, height * height / np.maximum(size, 1e-300)), found)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("ij,ij->j", a, b)


def _cross(a: Floats, b: Floats) -> Floats:
    return np.stack([a[k - 2] * b[k - 1] - a[k - 1] * b[k - 2] for k in range(3)])


def halved(faces: Floats) -> Floats:
    """Return the triangles (2n, 3, 3) that a cut through the middle of the longest side makes."""
    sides = np.square(faces - np.roll(faces, -1, axis=1)).sum(axis=2)
    first = np.argmax(sides, axis=1)
    rows = np.arange(len(faces))
    a, b, c = (faces[rows, (first + k) % 3] for k in range(3))
    middle = (a + b) / 2
    return np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])


def refined(corners: Floats, side: float) -> Floats:
    """Return triangles (n, 3, 3) in pieces with no side longer than `side` (mm), or as many pieces as are allowed."""
    done, count = [], 0
    while len(corners):
        large = np.square(corners - np.roll(corners, -1, axis=1)).sum(axis=2).max(axis=1) > side * side
        if count + len(corners) > _MOST:
            large[:] = False
        done.append(corners[~large])
        count += len(done[-1])
        corners = halved(corners[large])
    return np.concatenate(done) if done else corners


def largest_distance(one: Floats, other: Floats, tick: Tick = lambda: None) -> Farthest:
    """Return how far a point of one surface may be from another, from either to the other: triangles (n, 3, 3), mm.

    From the middle of a piece, the distance to the other surface changes by no more than the way walked. Pieces that
    might reach farther than the largest distance found, by more than a tolerance, are halved.
    """
    size = float(np.linalg.norm(np.ptp(np.concatenate([one, other]).reshape(-1, 3), axis=0)))
    sides = [(one, nearest_of(other)), (other, nearest_of(one))]
    corners = [np.unique(pieces.reshape(-1, 3), axis=0) for pieces, _ in sides]
    best = max(float(surface.distances(some, tick).max()) for some, (_, surface) in zip(corners, sides, strict=True))
    found = Farthest(best, np.inf)
    for within, most in _PASSES:
        closer = _bounded(sides, found.distance, size * within, most, tick)
        found = closer if closer.error < found.error else Farthest(max(closer.distance, found.distance), found.error)
    return found


def _bounded(sides: list[tuple[Floats, Nearest]], best: float, within: float, most: int, tick: Tick) -> Farthest:
    """Return the largest distance if it is more than `best`, with an error of `within`, or more if pieces are many."""
    error = 0.0
    for pieces, surface in sides:
        count, worst = 0, np.inf
        while len(pieces):
            count += len(pieces)
            if count > most and count > len(pieces):
                error = max(error, worst - best)
                break
            middle = pieces.mean(axis=1)
            distance = surface.distances(middle, tick)
            best = max(best, float(distance.max()))
            reach = distance + np.sqrt(np.square(pieces - middle[:, None]).sum(axis=2).max(axis=1))
            worst = float(reach.max())
            pieces = halved(pieces[reach > best + within])
    return Farthest(best, max(within, error))
