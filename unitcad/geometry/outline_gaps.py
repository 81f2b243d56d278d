"""The least distance between closed outlines of straight sides in the plane."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unitcad.geometry.arrays import Floats
from unitcad.geometry.boxes import boxes_of, frame_of, meeting_between, morton_order


def between_outlines(one: Sequence[Floats], other: Sequence[Floats], most: float) -> float:
    """Return the least distance of any corner of either from any side of the other, mm, and `most` if none is less.

    Each loop is (n, 2). Between outlines that do not cross, a corner is an end of every shortest way.
    """
    (corners, after), (others, others_after) = _sides(one), _sides(other)
    least = _to_sides(corners, others, others_after, most)
    return _to_sides(others, corners, after, least)


def _sides(loops: Sequence[Floats]) -> tuple[Floats, Floats]:
    """Return the starts and the ends of all sides, (n, 2) each."""
    return np.concatenate(loops), np.concatenate([np.roll(loop, -1, axis=0) for loop in loops])


def _to_sides(points: Floats, starts: Floats, ends: Floats, most: float) -> float:
    """Return the least distance of points from sides, mm, `most` at most."""
    low, high = np.minimum(starts, ends) - most, np.maximum(starts, ends) + most
    frame = frame_of(np.pad(np.concatenate([low, high, points]), ((0, 0), (0, 1))))
    of_points, of_sides = (frame.steps(np.pad(at, ((0, 0), (0, 1)))) for at in (points, np.concatenate([low, high])))
    nearby, order = morton_order(of_points), morton_order(of_sides, np.arange(len(low)))
    boxes, grown = boxes_of(of_points, nearby), boxes_of(of_sides, order, order + len(low))
    along = ends - starts
    square = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    least = most
    for i, k in meeting_between(boxes, grown):
        side = order[k]
        off, way = points[nearby[i]] - starts[side], along[side]
        share = np.clip(np.einsum("ij,ij->i", off, way) / square[side], 0.0, 1.0)
        least = min(least, float(np.hypot(*(off - share[:, None] * way).T).min(initial=least)))
    return least
