"""Closed plane curves of lines and circular arcs, on the length grid, checked before any kernel sees them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

GRID_PER_MM = 1024
"""Lengths live on a grid of 1/1024 mm: sums and differences are exact in binary, so faces meant to coincide do."""
FACETS = 0.01
"""Largest distance of a STEP body's facets from its surface, mm; thinner films come from facets or rounding."""

Vertex = tuple[float, float, float]
_BLOCK = 256
"""Sides of a polygon that are compared with others at once."""


def mm(length: float) -> float:
    """`length` on the grid (mm)."""
    return round(length * GRID_PER_MM) / GRID_PER_MM


class ProfileError(ValueError):
    """A curve that bounds no area: too few points, crossing itself, or running clockwise."""


@dataclass(frozen=True)
class Profile:
    """A closed curve, counter-clockwise. Each vertex is (x, y, bulge): bulge = tan(angle / 4) of the arc to the next
    vertex, 0 for a line, positive for an arc that turns left (the DXF polyline's convention).
    x and y in mm on the grid.

    Raises ProfileError if the curve crosses or touches itself, runs clockwise, or has fewer than three sides.
    """

    vertices: tuple[Vertex, ...]

    def __post_init__(self) -> None:
        snapped = tuple((mm(x), mm(y), float(bulge)) for x, y, bulge in self.vertices)
        object.__setattr__(self, "vertices", snapped)
        if len(snapped) < 3 or len({(x, y) for x, y, _ in snapped}) != len(snapped):
            raise ProfileError(f"needs three distinct vertices or more: {snapped}")
        polygon = points(self, 24)
        if self.area <= 0:
            raise ProfileError(f"runs clockwise or bounds no area: {snapped}")
        if _crosses_itself(polygon):
            raise ProfileError(f"crosses itself: {snapped}")

    @property
    def area(self) -> float:
        """Enclosed area in mm2, exact for lines and arcs (Green's theorem)."""
        total = 0.0
        for (x0, y0, bulge), (x1, y1, _) in sides(self.vertices):
            total += (x0 * y1 - x1 * y0) / 2
            if bulge:
                angle = 4 * math.atan(bulge)
                radius = math.hypot(x1 - x0, y1 - y0) / 2 / math.sin(abs(angle) / 2)
                total += math.copysign(radius**2 * (abs(angle) - math.sin(abs(angle))) / 2, bulge)
        return total

    @property
    def first_moment(self) -> float:
        """Integral of x over the area in mm3: 2 pi times it is the volume revolved about x = 0 (Pappus)."""
        total = 0.0
        for (x0, y0, bulge), (x1, y1, _) in sides(self.vertices):
            total += (x0 * y1 - x1 * y0) * (x0 + x1) / 6
            if bulge:
                angle = 4 * math.atan(bulge)
                cx, _, radius = arc_centre((x0, y0), (x1, y1), bulge)
                area = math.copysign(radius**2 * (abs(angle) - math.sin(abs(angle))) / 2, bulge)
                # A segment's centroid is 4 R sin^3(t/2) / (3 (t - sin t)) from the centre, towards the arc's middle.
                half = abs(angle) / 2
                reach = 4 * radius * math.sin(half) ** 3 / (3 * (abs(angle) - math.sin(abs(angle))))
                outward = (y1 - y0) / math.hypot(x1 - x0, y1 - y0) * math.copysign(1, bulge)
                total += area * (cx + reach * outward)
        return total

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """(x_min, y_min, x_max, y_max) in mm; arcs by their quarter points, so exact for them too."""
        xs = [x for x, _, _ in self.vertices]
        ys = [y for _, y, _ in self.vertices]
        for (x0, y0, bulge), (x1, y1, _) in sides(self.vertices):
            if bulge:
                cx, cy, radius = arc_centre((x0, y0), (x1, y1), bulge)
                start, angle = math.atan2(y0 - cy, x0 - cx), 4 * math.atan(bulge)
                for quarter in range(4):
                    along = (quarter * math.pi / 2 - start) % (2 * math.pi)
                    if (along if bulge > 0 else 2 * math.pi - along) <= abs(angle):
                        xs.append(cx + radius * (1, 0, -1, 0)[quarter])
                        ys.append(cy + radius * (0, 1, 0, -1)[quarter])
        return min(xs), min(ys), max(xs), max(ys)


def polygon(*corners: tuple[float, float]) -> Profile:
    """Return a profile of straight sides through `corners` (mm), counter-clockwise.

    Examples
    --------
    >>> from unitcad.shape import polygon
    >>> polygon((0, 0), (4, 0), (0, 2)).area
    4.0
    """
    return Profile(tuple((x, y, 0.0) for x, y in corners))


def rectangle(x0: float, y0: float, x1: float, y1: float) -> Profile:
    """Return the upright rectangle between two opposite corners (mm)."""
    return polygon((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def rounded_rectangle(half_x: float, half_y: float, radius: float, key: float = 0.0) -> Profile:
    """Return a rectangle about the origin with three or four round corners (mm); a `key` > 0 cuts the one at (+x, +y)
    straight at 45 degrees by that length, so that a counterpart fits in one attitude only.
    """
    a, b, r, quarter = half_x, half_y, radius, math.tan(math.pi / 8)
    first = [(a, b - key, 0.0), (a - key, b, 0.0)] if key else [(a, b - r, quarter), (a - r, b, 0.0)]
    return Profile(
        (
            (-a + r, -b, 0.0),
            (a - r, -b, quarter),
            (a, -b + r, 0.0),
            *first,
            (-a + r, b, quarter),
            (-a, b - r, 0.0),
            (-a, -b + r, quarter),
        )
    )


def points(profile: Profile, segments: int) -> np.ndarray:
    """Return the profile as a polygon, (n, 2) in mm: an arc gets its share of `segments` a turn, at least one side."""
    corners: list[tuple[float, float]] = []
    for (x0, y0, bulge), (x1, y1, _) in sides(profile.vertices):
        corners.append((x0, y0))
        if bulge:
            cx, cy, radius = arc_centre((x0, y0), (x1, y1), bulge)
            angle = 4 * math.atan(bulge)
            start = math.atan2(y0 - cy, x0 - cx)
            count = max(1, math.ceil(abs(angle) / (2 * math.pi) * segments - 1e-9))
            corners += [
                (
                    cx + radius * math.cos(start + angle * i / count),
                    cy + radius * math.sin(start + angle * i / count),
                )
                for i in range(1, count)
            ]
    return np.array(corners)


def arc_middle(start: Vertex, end: Vertex) -> tuple[float, float]:
    """Return the point halfway along the arc from `start` to `end` (mm)."""
    (x0, y0, bulge), (x1, y1, _) = start, end
    return (x0 + x1) / 2 + bulge * (y1 - y0) / 2, (y0 + y1) / 2 - bulge * (x1 - x0) / 2


def sides(vertices: Sequence[Vertex]) -> Iterable[tuple[Vertex, Vertex]]:
    """Start and end of each side; the start's bulge is the side's."""
    return zip(vertices, (*vertices[1:], vertices[0]), strict=True)


def arc_centre(p: tuple[float, float], q: tuple[float, float], bulge: float) -> tuple[float, float, float]:
    """Centre and radius of the arc from p to q."""
    dx, dy = q[0] - p[0], q[1] - p[1]
    away = (1 - bulge**2) / (4 * bulge)
    radius = math.hypot(dx, dy) * (1 + bulge**2) / (4 * abs(bulge))
    return (p[0] + q[0]) / 2 - away * dy, (p[1] + q[1]) / 2 + away * dx, radius


def _crosses_itself(polygon: np.ndarray) -> bool:
    """Return whether two sides of a polygon meet other than neighbours in their common vertex."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    n = len(a)
    low, high = np.minimum(a, b), np.maximum(a, b)

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        return np.sign((q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0]))

    # In this order, sides that overlap along the longer axis are neighbours.
    along, across = np.argsort(high.max(axis=0) - low.min(axis=0))[::-1]
    order = np.argsort(low[:, along], kind="stable")
    ends = np.searchsorted(low[order, along], high[order, along], side="right")
    for start in range(0, n, _BLOCK):
        ones = np.arange(start, min(start + _BLOCK, n))
        counts = ends[ones] - ones - 1
        one = np.repeat(ones, counts)
        other = one + 1 + np.arange(len(one)) - np.repeat(np.cumsum(counts) - counts, counts)
        i, j = np.sort((order[one], order[other]), axis=0)
        near = (low[i, across] <= high[j, across]) & (low[j, across] <= high[i, across])
        i, j = i[near], j[near]
        neighbours = (j == i + 1) | ((i == 0) & (j == n - 1))
        # Neighbours cross only by folding back on each other.
        after, before = np.where(j == i + 1, j, i), np.where(j == i + 1, i, j)
        onwards = np.einsum("ij,ij->i", b[before] - a[before], b[after] - a[after])
        folded = neighbours & (side(a[before], b[before], b[after]) == 0) & (onwards < 0)
        i, j = i[~neighbours], j[~neighbours]
        apart = (side(a[i], b[i], a[j]) * side(a[i], b[i], b[j]) > 0) | (
            side(a[j], b[j], a[i]) * side(a[j], b[j], b[i]) > 0
        )
        if np.any(folded) or not np.all(apart):
            return True
    return False
