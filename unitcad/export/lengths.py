"""The lengths of a solid that a caliper reaches: between upright or level faces of a section, of holes, from above."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold

from unitcad.export.chart import coord
from unitcad.export.svg import Point, Region, Side, loops_of
from unitcad.kernels.mesh import arrays, bounds

LEAST_EDGE_MM = 0.45
"""A face that is shorter than this in the section gets no dimension."""
LEAST_SIDE_MM = 1.5
"""A side of an outline from above that is shorter than this gets no dimension: a facet of a circle is."""
LEAST_HOLE_MM = 0.7
"""A hole is listed from this diameter."""
LEAST_BORE_MM = 4.0
"""The jaws of a caliper go into a hole of this diameter."""
LEAST_ROD_MM = 3.0
"""A depth rod reaches a face of this width."""
TAPER = 0.15
"""Slope of a face that still counts as upright."""
SAME_MM = 0.02
"""Lengths this close are one: a caliper shows 0.01 mm."""
ROUND_MM = 0.03
"""Corners on one circle are this far off it, at most."""
LEAST_CORNERS = 12
"""Corners of a circle, at least."""
Loop = Sequence[Point]
_UPRIGHT = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0]])
"""Turns (x, y, z) to (x, z, -y)."""


@dataclass(frozen=True)
class Length:
    """A dimension between two points of a view, mm: along its first axis if it is `below`, otherwise along its second.

    `name`: as a list of checks names it, "" for a length that a caliper does not reach. `check`: its number there, or
    0. `running`: one of several heights from one face.
    """

    text: str
    start: Point
    end: Point
    side: Side
    name: str = ""
    check: int = 0
    running: bool = False

    @property
    def value(self) -> float:
        """The length, mm."""
        axis = self.side != "below"
        return self.end[axis] - self.start[axis]


@dataclass(frozen=True)
class Hole:
    """A round hole or post, or a slot, of a table: its middle from above, its size in words, its diameters, mm."""

    name: str
    x: float
    y: float
    size: str
    diameters: tuple[float, ...] = ()


def section(solid: Manifold, y: float) -> tuple[tuple[Point, ...], ...]:
    """Return the loops (x, z) of the section of a solid by the plane at `y`, without corners between equal sides."""
    flat: CrossSection = solid.transform(_UPRIGHT).slice(-y + 1 / 3000)
    return loops_of(flat.simplify(SAME_MM / 4))


def beyond(solid: Manifold, y: float) -> tuple[tuple[Point, ...], ...]:
    """Return the loops (x, z) of the outline of the part of a solid behind the plane at `y`, seen along y.

    Of the whole solid, if the part in front is lower or higher.
    """
    half = solid.trim_by_plane((0, 1, 0), y)
    x0, _, z0, x1, _, z1 = bounds(solid)
    flat: CrossSection = half.transform(_UPRIGHT).project()
    left, low, right, high = flat.bounds()
    if max(abs(left - x0), abs(low - z0), abs(right - x1), abs(high - z1)) > SAME_MM / 4:
        flat = solid.transform(_UPRIGHT).project()
    return loops_of(flat.simplify(SAME_MM / 4))


def from_above(solid: Manifold) -> list[Region]:
    """Return the flat faces that are seen from above over the outline, each height a region, higher ones lighter."""
    vertices, faces = arrays(solid)
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    level = corners[:, :, 2].mean(axis=1).round(3)
    flat = across[:, 2] > 0.9999 * np.linalg.norm(across, axis=1)
    heights = sorted({float(z) for z in level[flat]})
    regions = [_region(solid.project(), 0.55)]
    for i, z in enumerate(heights):
        top = CrossSection([triangle[:, :2] for triangle in corners[flat & (level == z)]])
        seen = top - solid.trim_by_plane((0, 0, 1), z + 2e-3).project()
        regions.append(_region(seen, 0.6 + 0.38 * (i + 1) / len(heights)))
    return [region for region in regions if region.loops]


def _region(flat: CrossSection, grey: float) -> Region:
    return Region("", (grey, grey, grey), loops_of(flat))


def across(
    loops: Sequence[Loop],
    centre: float,
    round_at: Callable[[float, float, float], bool] = lambda *_: False,
    least: float = LEAST_EDGE_MM,
) -> list[Length]:
    """Return the widths between upright faces of a section that are alike on both sides of a `centre`.

    A tapered face is measured at its lower end; one shorter than `least` (mm) is left out. `round_at(half, centre, z)`
    tells whether faces are on a circle there.
    """
    feet: dict[float, tuple[float, float, bool]] = {}
    for (x0, z0), (x1, z1) in _sides(loops):
        if abs(z1 - z0) >= least and abs(x1 - x0) < TAPER * abs(z1 - z0):
            z, x = min((z0, x0), (z1, x1))
            # Counter-clockwise: the material is on the left of a side.
            foot = z, x, z1 > z0
            feet[round(x, 2)] = min(foot, feet.get(round(x, 2), foot))
    found = list[Length]()
    for z1, right, outside in sorted(feet.values(), key=lambda foot: foot[1]):
        half = right - centre
        z0, left, _ = min(feet.values(), key=lambda foot: abs(centre - half - foot[1]))
        if half > SAME_MM > abs(centre - half - left):
            is_round = round_at(half, centre, max(z0, z1) + LEAST_EDGE_MM / 2)
            words = ("outside" if outside else "inside") + (" diameter" if is_round else " width")
            named = words if outside or right - left >= LEAST_BORE_MM else ""
            text = f"{'Ø' * is_round}{coord(right - left, 2)}"
            found.append(Length(text, (left, z0), (right, z1), "below", named))
    return found


def between_faces(loops: Sequence[Loop]) -> list[Length]:
    """Return the longest flat face at each of the four ends of an outline, if sharp corners end it before the outline."""
    points = np.array([point for loop in loops for point in loop])
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    found: dict[tuple[float, float], Length] = {}
    sides: tuple[Side, Side] = "below", "left"
    for axis, side in enumerate(sides):
        for level in (low[1 - axis], high[1 - axis]):
            faces = [
                tuple(sorted((a, b), key=lambda point: point[axis]))
                for before, a, b, after in _corners(loops)
                if max(abs(a[1 - axis] - level), abs(b[1 - axis] - level)) < SAME_MM / 2
                and min(math.dist(before, a), math.dist(b, after)) > LEAST_SIDE_MM
            ]
            start, end = max(faces, key=lambda face: face[1][axis] - face[0][axis], default=((0.0, 0.0), (0.0, 0.0)))
            long = end[axis] - start[axis]
            if LEAST_EDGE_MM <= long < high[axis] - low[axis] - SAME_MM:
                at = round(start[axis], 2), round(end[axis], 2)
                found.setdefault(at, Length(coord(long, 2), start, end, side, "length of the face"))
    return list(found.values())


def _corners(loops: Sequence[Loop]) -> Iterator[tuple[Point, Point, Point, Point]]:
    """Yield each side of the loops between the corners before and after it."""
    for loop in loops:
        yield from (
            (loop[i - 1], loop[i], loop[(i + 1) % len(loop)], loop[(i + 2) % len(loop)]) for i in range(len(loop))
        )


def windows(loops: Sequence[Loop], width_at: Callable[[float, float], float | None]) -> list[Length]:
    """Return the openings in the outer faces of a section; `width_at(x, z)` is an opening's width, None without one.

    Two that are alike on both sides are one length.
    """
    found: dict[tuple[float, float, str], list[float]] = {}
    for end in (min, max):
        edge = end(x for loop in loops for x, _ in loop)
        walls = sorted(sorted((a[1], b[1])) for a, b in _sides(loops) if abs(a[0] - edge) + abs(b[0] - edge) < SAME_MM)
        for (_, low), (high, _) in pairwise(walls):
            wide = width_at(edge, (low + high) / 2) if high - low > SAME_MM else None
            if wide is not None:
                text = f"{coord(wide, 2)} x {coord(high - low, 2)}"
                found.setdefault((round(low, 2), round(high, 2), text), []).append(edge)
    return [
        Length(f"{'2× ' if len(edges) > 1 else ''}{text}", (edges[-1], low), (edges[-1], high), "right")
        for (low, high, text), edges in sorted(found.items())
    ]


def heights(loops: Sequence[Loop], outline: Sequence[Loop]) -> list[Length]:
    """Return the heights of the level faces of a section, and of the outline behind it, above the lowest one.

    Jaws reach the top of the outline, and of each end of the section; a depth rod a wide face that is open from below.
    """
    long: defaultdict[float, float] = defaultdict(float)
    feet: dict[float, Point] = {}
    left, right = (end(x for loop in loops for x, _ in loop) for end in (min, max))
    edges = [max(z for loop in loops for x, z in loop if abs(x - end) < SAME_MM) for end in (left, right)]
    ends = []
    for end, sign in ((min, -1), (max, 1)):
        (own, x), (z, behind) = (end((z, x) for loop in each for x, z in loop) for each in (loops, outline))
        ends.append((behind, z) if sign * (z - own) > SAME_MM else (x, own))
    for a, b in (*_sides(loops), *((end, end) for end in ends)):
        if abs(b[1] - a[1]) < SAME_MM / 4:
            level, foot = round(a[1], 2), min(a, b)
            long[level] += abs(b[0] - a[0]) + (a == b) * LEAST_EDGE_MM
            feet[level] = min(foot, feet.get(level, foot))
    found = sorted(z for z, length in long.items() if length >= LEAST_EDGE_MM)
    found = [feet[z] for i, z in enumerate(found) if not i or z - found[i - 1] > SAME_MM]
    (_, low), (_, high) = found[0], found[-1]

    def name(z: float) -> str:
        at_edge = min(abs(z - edge) for edge in edges) < SAME_MM
        if z > low and (z == high or at_edge):
            return "height" if z == high else "height of the edge"
        return "depth from below" if any(_open_below(a, b, loops) for a, b in _sides(loops) if a[1] == z > low) else ""

    return [Length(coord(z - low, 2), found[0], (x, z), "left", name(z), running=True) for x, z in found]


def _open_below(a: Point, b: Point, loops: Sequence[Loop]) -> bool:
    """Return whether a side is a level face with its material above, wide, and with nothing under its middle."""
    x, z = (a[0] + b[0]) / 2, a[1]
    under = any(min(c[0], d[0]) <= x <= max(c[0], d[0]) and min(c[1], d[1]) < z - SAME_MM for c, d in _sides(loops))
    return abs(b[1] - z) < SAME_MM / 4 and b[0] - a[0] >= LEAST_ROD_MM and not under


class Slices:
    """The outlines of a solid between its levels, as they are from above."""

    def __init__(self, solid: Manifold) -> None:
        vertices, faces = arrays(solid)
        corners = vertices[faces][:, :, 2]
        level = np.unique(corners[np.ptp(corners, axis=1) < 1e-6].round(2))
        self.x0, self.y0, _, self.x1, self.y1, _ = bounds(solid)
        middles = [(a + b) / 2 for a, b in pairwise(level.tolist()) if b - a > 4 * SAME_MM]
        self.loops = [(z, [np.asarray(loop) for loop in solid.slice(z).to_polygons()]) for z in middles]

    def diameters(self, x: float, y: float, reach: float = math.inf) -> tuple[float, ...]:
        """Return the diameters of the circles about a point that are nearly whole, mm, ascending; radii up to `reach`."""
        found = list[float]()
        for _, loops in self.loops:
            starts = np.vstack(loops) - (x, y)
            ends = np.vstack([np.roll(loop, -1, axis=0) for loop in loops]) - (x, y)
            # Both ends of a side are on the circle: holes in a ring have corners there, and few sides.
            radii, far = np.hypot(*starts.T), np.hypot(*ends.T)
            side = (abs(radii - far) < ROUND_MM) & (radii < reach)
            starts, ends, radii = starts[side], ends[side], radii[side]
            turns = np.arctan2(starts[:, 0] * ends[:, 1] - starts[:, 1] * ends[:, 0], (starts * ends).sum(axis=1))
            # Corners are on the circle and others of its polygon inside it: the largest first.
            for radius in np.unique(radii.round(3))[::-1].tolist():
                near = abs(radii - radius) < ROUND_MM
                if radius < 0.3 or abs(turns[near]).sum() < math.pi:
                    continue
                if all(abs(2 * radius - d) > 2 * ROUND_MM for d in found) and on_circle(starts[near], radius):
                    found.append(2 * radius)
        return tuple(sorted(found))

    def others(self, taken: Sequence[Hole]) -> list[Hole]:
        """Return round holes and pins, and slots, that are nowhere near those already named."""
        pins, slots = dict[Point, float](), dict[Point, str]()
        for _, loops in self.loops:
            for loop in loops:
                (x0, y0), (x1, y1) = loop.min(axis=0), loop.max(axis=0)
                x, y, wide, deep = (x0 + x1) / 2, (y0 + y1) / 2, x1 - x0, y1 - y0
                within = min(wide, deep) > LEAST_HOLE_MM and max(wide, deep) < (self.x1 - self.x0) / 2
                near = any(math.hypot(x - one.x, y - one.y) < max(one.diameters, default=8) / 2 for one in taken)
                if not within or near:
                    continue
                at = round(float(x), 2), round(float(y), 2)
                outline = CrossSection([loop], FillRule.EvenOdd)
                area = outline.area()
                if outline.hull().area() - area > 0.01 * area:  # a letter
                    continue
                if on_circle(loop - (x, y), float(wide) / 2) and abs(area - math.pi / 4 * wide * deep) < 0.02 * area:
                    pins[at] = max(pins.get(at, 0.0), float(wide))
                else:
                    short, long = sorted((float(wide), float(deep)))
                    rounded = short * (long - short) + math.pi / 4 * short**2
                    if short > LEAST_SIDE_MM and long > 1.5 * short and abs(area - rounded) < 0.02 * area:
                        slots[at] = f"{coord(wide, 2)} x {coord(deep, 2)}"
        found = [
            Hole(f"P{i}", *at, f"Ø{coord(wide, 2)}", (wide,)) for i, (at, wide) in enumerate(_rows(pins.items()), 1)
        ]
        return found + [Hole(f"S{i}", *at, size) for i, (at, size) in enumerate(_rows(slots.items()), 1)]


def _rows(items: Iterable[tuple[Point, Any]]) -> list[tuple[Point, Any]]:
    """Sort by place as a page is read: from the top, then from the left."""
    return sorted(items, key=lambda item: (-item[0][1], item[0][0]))


def on_circle(points: np.ndarray, radius: float) -> bool:
    """Return whether corners are on a circle about the origin, without a gap of 2 radians or more."""
    x, y = points.T
    angles = np.sort(np.arctan2(y, x)[abs(np.hypot(x, y) - radius) < ROUND_MM])
    return len(angles) >= LEAST_CORNERS and max(np.diff(angles).max(), angles[0] - angles[-1] + 2 * np.pi) < 2


def working(diameters: Sequence[float]) -> float:
    """Return the diameter that a caliper checks: the least that its jaws go into, else the largest."""
    return next((d for d in diameters if d >= LEAST_BORE_MM), max(diameters))


def numbered(found: Sequence[Length], most: int = 5) -> dict[Length, int]:
    """Return the first lengths that a caliper reaches by their numbers from 1; every name comes once before it is again."""
    seen, ranked = defaultdict[str, int](int), list[tuple[int, int]]()
    for i, one in enumerate(found):
        if one.name:
            ranked.append((seen[one.name], i))
            seen[one.name] += 1
    return {found[i]: n for n, (_, i) in enumerate(sorted(sorted(ranked)[:most], key=lambda at: at[1]), 1)}


def _sides(loops: Sequence[Loop]) -> Iterator[tuple[Point, Point]]:
    for loop in loops:
        yield from pairwise((*loop, loop[0]))
