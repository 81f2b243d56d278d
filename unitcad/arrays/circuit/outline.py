"""The outline of a common circuit, and the circuit as it is laid on the sheet."""

from __future__ import annotations

import math
from bisect import bisect
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from manifold3d import CrossSection, JoinType, OpType

from unitcad.arrays.array import Array
from unitcad.arrays.array_tables import CircuitTable
from unitcad.arrays.circuit.wiring import Strip, Wiring, wiring
from unitcad.arrays.limb import LENGTH, at_place
from unitcad.designs import CIRCUIT_COLOUR, dimensions
from unitcad.errors import Refusal
from unitcad.shape import Common, Extrude, Profile, cylinder, moved
from unitcad.shape.body import Body
from unitcad.shape.profile import Vertex

_CHORD = 0.04
"""Of an arc while it is a polygon, mm."""
_OFF = 2e-3
"""Largest distance of a polygon's corners from the arc that replaces them, mm."""
_LEAST_SIDES = 4
"""Sides of a polygon that are taken for an arc."""
_KEPT_OFF = 0.01
"""Distance of inner corners from silicone, mm: more than the errors of polygons and meshes."""
_TOGETHER = 32
"""Runs of sides that are compared with arcs at once."""
_LEAST_AREA = 1e-6
"""Of a corner that is not rounding's, mm2."""
_MOST_TURN = math.radians(170)
"""Of one arc: a longer one is two."""


def outline(array: Array, laid: Wiring | None = None) -> Profile:
    """Return the circuit's outline, counter-clockwise: pads and strips, inner corners of `circuit.corner_mm`.

    `laid` is the array's wiring, if it is known. Raises Refusal as `wiring`, and for corners that would enclose a
    hole or reach into a unit's silicone next to its notch.
    """
    table = array.circuit or CircuitTable()
    walls = tuple(
        _Wall(
            place.name,
            (place.x, place.y),
            dimensions(place.unit).cavity_radius - _KEPT_OFF,
            place.radius + _KEPT_OFF,
            place.unit.moulds.slot_width_clearance_mm / 2 - _KEPT_OFF,
        )
        for place in array.places
    )
    return _outline(laid or wiring(array), walls, table.corner_mm)


class _Wall(NamedTuple):
    """The silicone of a unit that corners keep off: its name and middle, two radii, a notch's play at a side, mm."""

    name: str
    at: tuple[float, float]
    inner: float
    outer: float
    clearance: float


@lru_cache(maxsize=8)
def _outline(laid: Wiring, walls: tuple[_Wall, ...], corner: float) -> Profile:
    """Return the outline, kept: most changes of a sheet leave the circuit as it is. Raises Refusal."""
    closed, blocked = _rounded(laid, walls, corner)
    if blocked:
        tenths = range(2, math.ceil(10 * corner))
        # A larger corner reaches into all that a smaller one does.
        fits = bisect(tenths, False, key=lambda tenth: bool(_rounded(laid, walls, tenth / 10)[1]))
        raise Refusal("circuit.corner_mm", corner, blocked, tenths[fits - 1] / 10 if fits else None)
    return Profile(tuple(_with_arcs(_distinct(np.asarray(closed.to_polygons()[0], float)))))


def _rounded(laid: Wiring, walls: Sequence[_Wall], corner: float) -> tuple[CrossSection, str]:
    """Return the circuit as a polygon with inner corners of a radius, and the objection to it, or ""."""
    discs = [CrossSection.circle(pad.radius, _segments(pad.radius)).translate((pad.x, pad.y)) for pad in laid.pads]
    joints = [CrossSection.circle(one.half, _segments(one.half)).translate(one.end) for one in laid.spine[:-1]]
    parts = [*discs, *joints, *(_rectangle(strip) for strip in laid.strips)]
    whole = CrossSection.batch_boolean(parts, OpType.Add)
    # Outwards with sharp outer corners, back with round inner ones.
    closed = whole.offset(corner, JoinType.Miter).offset(-corner, JoinType.Round, 2.0, _segments(corner))
    if closed.num_contour() != 1:
        return closed, "the circuit's inner corners would enclose a hole between its rows or pads"
    added = closed - whole
    # One union for all walls of a clearance, and of the additions only those near a wall: with all of it for each
    # wall a large array took seconds.
    pieces = added.decompose()
    x0, y0, x1, y1 = np.array([piece.bounds() for piece in pieces], float).reshape(-1, 4).T
    notches = {
        clearance: CrossSection.batch_boolean([_rectangle(strip, clearance) for strip in laid.strips], OpType.Add)
        for clearance in {wall.clearance for wall in walls}
    }
    for wall in walls:
        (x, y), r = wall.at, wall.outer
        near = np.flatnonzero((x0 < x + r) & (x1 > x - r) & (y0 < y + r) & (y1 > y - r))
        silicone = CrossSection.circle(wall.outer, 128) - CrossSection.circle(wall.inner, 128)
        beside = (CrossSection.compose([pieces[i] for i in near]) ^ silicone.translate(wall.at)) - notches[
            wall.clearance
        ]
        if beside.area() > _LEAST_AREA:
            return closed, f"the circuit's inner corners would reach into the silicone of {wall.name} next to its notch"
    return closed, ""


def circuit_body(array: Array) -> Body:
    """Return the circuit at its place on the motors' backs."""
    laid = wiring(array)
    drawn = Extrude(outline(array, laid), laid.low, laid.high)
    return Body("circuit", "unit", "circuit", drawn, CIRCUIT_COLOUR, made="bought")


def _segments(radius: float) -> int:
    """Return the sides of a circle while it is a polygon: a multiple of four."""
    return 4 * math.ceil(max(8, min(90, 2 * math.pi * radius / _CHORD / 4)))


def _rectangle(strip: Strip, wider: float = 0.0) -> CrossSection:
    """Return a strip, on each side `wider` by so much."""
    (x0, y0), (x1, y1) = strip.start, strip.end
    length, half = math.hypot(x1 - x0, y1 - y0), strip.half + wider
    nx, ny = -(y1 - y0) / length * half, (x1 - x0) / length * half
    corners = [(x0 - nx, y0 - ny), (x1 - nx, y1 - ny), (x1 + nx, y1 + ny), (x0 + nx, y0 + ny)]
    return CrossSection([np.array(corners)])


def _distinct(corners: np.ndarray) -> np.ndarray:
    """Return a polygon's corners, of a cluster the first, from the start of its longest side."""
    away = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    kept = corners[away > _CHORD / 4]
    sides = np.linalg.norm(np.roll(kept, -1, axis=0) - kept, axis=1)
    return np.roll(kept, -int(np.argmax(np.round(sides, 6))), axis=0)


def _with_arcs(corners: np.ndarray) -> list[Vertex]:
    """Return the vertices of a polygon's outline, runs of short sides on one circle replaced by arcs."""
    n = len(corners)
    ring = np.concatenate([corners, corners[:1]])
    sides = np.linalg.norm(np.diff(ring, axis=0), axis=1)
    # Up to the side that is too long for an arc's; none has as many sides as half the finest circle.
    long = np.append(np.flatnonzero(sides >= 2.5 * _CHORD), n)
    found: list[Vertex] = []
    at = 0
    while at < n:
        end = min(int(long[np.searchsorted(long, at)]), at + _segments(math.inf) // 2)
        end = at + _arc_sides(ring[at : end + 1])
        if end - at >= _LEAST_SIDES:
            found.append((float(ring[at, 0]), float(ring[at, 1]), math.tan(_turn(ring[at : end + 1]) / 4)))
            at = end
        else:
            found.append((float(ring[at, 0]), float(ring[at, 1]), 0.0))
            at += 1
    return found


def _arc_sides(points: np.ndarray) -> int:
    """Return the number of sides, from the first point on, that are on one arc of at most `_MOST_TURN`.

    A single side, between two points, always does.
    """
    for first in range(3, len(points) + 1, _TOGETHER):
        counts = np.arange(first, min(first + _TOGETHER, len(points) + 1))
        wrong = _off_arcs(points[: counts[-1]], counts)
        if wrong.any():
            return first + int(np.argmax(wrong)) - 2
    return len(points) - 1


def _off_arcs(points: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Tell for each of some counts whether the first so many points, three or more, are not on one arc."""
    start, ends, middles = points[0], points[counts - 1], points[counts // 2]
    (ax, ay), (bx, by), (x, y) = (start - middles).T, (ends - middles).T, (ends - start).T
    seen, length = np.arctan2(ax * by - ay * bx, ax * bx + ay * by), np.hypot(x, y)
    turn = -np.copysign(2 * (math.pi - np.abs(seen)), seen)
    with np.errstate(divide="ignore", invalid="ignore"):
        radius = length / 2 / np.sin(np.abs(turn) / 2)
        away = np.copysign(np.sqrt(np.maximum(radius**2 - length**2 / 4, 0.0)), turn) / length
        middle_x, middle_y = (start[0] + ends[:, 0]) / 2 - y * away, (start[1] + ends[:, 1]) / 2 + x * away
        off = np.hypot(points[:, 0] - middle_x[:, None], points[:, 1] - middle_y[:, None]) - radius[:, None]
        near = (np.abs(off) < _OFF) | (np.arange(len(points)) >= counts[:, None])
    return ~near.all(axis=1) | (np.abs(turn) > _MOST_TURN) | (np.abs(turn) < 1e-6)


def _turn(points: np.ndarray) -> float:
    """Return by how much an arc through points turns: left is positive, from the angles its chord is seen under."""
    (x, y), (x0, y0), (x1, y1) = points[len(points) // 2].tolist(), points[0].tolist(), points[-1].tolist()
    ax, ay, bx, by = x0 - x, y0 - y, x1 - x, y1 - y
    seen = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    return -math.copysign(2 * (math.pi - abs(seen)), seen)


def laid_circuit(array: Array) -> tuple[Body, ...]:
    """Return the circuit in the frame that the silicone is cast in.

    In a curved cast its part within each unit is flat; between the units it bends freely, and is not drawn.
    """
    whole = circuit_body(array)
    if array.cast == "flat":
        return (whole,)
    return tuple(
        replace(
            whole,
            name=f"{place.name}-circuit",
            shape=at_place(
                array,
                Common((moved(whole.shape, -place.x, -place.y), cylinder(place.radius, -LENGTH, LENGTH))),
                place,
            ),
        )
        for place in array.places
    )
