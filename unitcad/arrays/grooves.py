"""The overflow grooves round the bores of a back sheet's cups: rings that stop before a wall gets too thin.

A groove ends square to its way. So its rest has its full width, and no slit stays between two stops.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from unitcad.designs.parts import BEYOND
from unitcad.geometry.segments import Point
from unitcad.moulds.cuts import Feature
from unitcad.shape import Extrude, Shape, cut, moved, polygon, ring

TURN = 720
"""Sectors of a turn that a groove has or lacks."""
RINGS = 12
"""Circles on which a sector is compared with the stops."""


def stopped_ring(
    centre: Point, radii: tuple[float, float], heights: tuple[float, float], stops: Sequence[Feature]
) -> Shape | None:
    """Draw a groove between two radii and two heights (mm), without the sectors that meet a stop; None if all do."""
    inner, outer = radii
    kept = ~_meets(centre, radii, stops)
    least = math.ceil(TURN * (outer - inner) / (2 * math.pi * inner))
    for start, end in _runs(kept):
        if end - start < min(least, TURN):  # shorter than it is wide
            kept[np.arange(start, end) % TURN] = False
    if not kept.any():
        return None
    low, high = heights
    gone = [_sector(start, end, 2 * outer, low - BEYOND, high + BEYOND) for start, end in _runs(~kept)]
    return moved(cut(ring(inner, outer, low, high), gone), *centre)


def _meets(centre: Point, radii: tuple[float, float], stops: Sequence[Feature]) -> np.ndarray:
    """Return which sectors meet a stop (TURN): a point of them is in it, or nearly."""
    angles = (np.arange(TURN) + 0.5) * (2 * math.pi / TURN)
    across = np.linspace(*radii, RINGS)
    slack = math.hypot(radii[1] * math.pi / TURN, (across[1] - across[0]) / 2)
    x = centre[0] + np.multiply.outer(np.cos(angles), across)
    y = centre[1] + np.multiply.outer(np.sin(angles), across)
    met = np.zeros(TURN, bool)
    for corners, radius in stops:
        if len(corners) == 1:
            (x0, y0), *_ = corners
            inside = np.hypot(x - x0, y - y0) <= radius + slack
        else:
            # Counter-clockwise: the inside is on the left of every side.
            ends = [*corners[1:], corners[0]]
            beyond = [
                ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / math.hypot(bx - ax, by - ay)
                for (ax, ay), (bx, by) in zip(corners, ends, strict=True)
            ]
            inside = np.min(beyond, axis=0) >= -radius - slack
        met |= inside.any(axis=1)
    return met


def _runs(marked: np.ndarray) -> Iterator[tuple[int, int]]:
    """Yield the runs of marked sectors, from and to, counted on past a turn."""
    if marked.all():
        yield 0, TURN
        return
    first = int(np.flatnonzero(~marked)[0])
    turned = np.concatenate([[False], np.roll(marked, -first), [False]])
    changes = np.flatnonzero(turned[1:] != turned[:-1])
    yield from ((first + int(start), first + int(end)) for start, end in changes.reshape(-1, 2))


def _sector(start: int, end: int, radius: float, low: float, high: float) -> Shape:
    """Draw a sector that reaches beyond a radius, mm."""
    quarters = math.ceil((end - start) / (TURN // 6))
    angles = np.linspace(start, end, quarters + 1) * (2 * math.pi / TURN)
    return Extrude(polygon((0.0, 0.0), *((radius * math.cos(a), radius * math.sin(a)) for a in angles)), low, high)
