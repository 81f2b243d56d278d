"""The outline of an array's common circuit: one closed curve of lines and arcs with rounded inner corners (mm)."""

from __future__ import annotations

import math

import numpy as np
from manifold3d import CrossSection, JoinType, OpType

from unitcad.arrays.array import Array
from unitcad.arrays.array_tables import CircuitTable
from unitcad.arrays.circuit.wiring import Strip, Wiring, wiring
from unitcad.designs import CIRCUIT_COLOUR, dimensions
from unitcad.errors import Refusal
from unitcad.shape import Extrude, Profile
from unitcad.shape.body import Body
from unitcad.shape.profile import Vertex

_CHORD = 0.04
"""Of an arc while it is a polygon, mm."""
_OFF = 2e-3
"""How far a polygon's corners may lie off the arc that takes their place, mm."""
_LEAST_SIDES = 4
"""Sides of a polygon that are taken for an arc."""
_KEPT_OFF = 0.01
"""What inner corners keep off silicone, mm: more than polygons and meshes are off."""
_LEAST_AREA = 1e-6
"""Of a corner that is not rounding's, mm2."""
_MOST_TURN = math.radians(170)
"""Of one arc: a longer one is two."""


def outline(array: Array, laid: Wiring | None = None) -> Profile:
    """Return the circuit's outline, counter-clockwise: pads and strips, inner corners of `circuit.corner_mm`.

    `laid` is the array's wiring, where it is known. Raises Refusal as `wiring`, and for corners that would enclose a
    hole or reach into a unit's silicone beside its notch.
    """
    laid, table = laid or wiring(array), array.circuit or CircuitTable()
    closed, blocked = _rounded(array, laid, table.corner_mm)
    if blocked:
        tenths = range(math.ceil(10 * table.corner_mm) - 1, 1, -1)
        fits = next((tenth / 10 for tenth in tenths if not _rounded(array, laid, tenth / 10)[1]), None)
        raise Refusal("circuit.corner_mm", table.corner_mm, blocked, fits)
    return Profile(tuple(_with_arcs(_distinct(np.asarray(closed.to_polygons()[0], float)))))


def _rounded(array: Array, laid: Wiring, corner: float) -> tuple[CrossSection, str]:
    """Return the circuit as a polygon with inner corners of a radius, and what speaks against it, or ""."""
    discs = [CrossSection.circle(pad.radius, _segments(pad.radius)).translate((pad.x, pad.y)) for pad in laid.pads]
    joints = [CrossSection.circle(one.half, _segments(one.half)).translate(one.end) for one in laid.spine[:-1]]
    parts = [*discs, *joints, *(_rectangle(strip) for strip in laid.strips)]
    whole = CrossSection.batch_boolean(parts, OpType.Add)
    # Outwards with sharp outer corners, back with round inner ones.
    closed = whole.offset(corner, JoinType.Miter).offset(-corner, JoinType.Round, 2.0, _segments(corner))
    if closed.num_contour() != 1:
        return closed, "the circuit's inner corners would enclose a hole between its rows or pads"
    added = closed - whole
    for place in array.places:
        clearance = place.unit.moulds.slot_width_clearance_mm / 2 - _KEPT_OFF
        inner, outer = dimensions(place.unit).cavity_radius - _KEPT_OFF, place.radius + _KEPT_OFF
        notch = [_rectangle(strip, clearance) for strip in laid.strips]
        wall = CrossSection.circle(outer, 128) - CrossSection.circle(inner, 128)
        beside = (added ^ wall.translate((place.x, place.y))) - CrossSection.batch_boolean(notch, OpType.Add)
        if beside.area() > _LEAST_AREA:
            return closed, f"the circuit's inner corners would reach into the silicone of {place.name} beside its notch"
    return closed, ""


def circuit_body(array: Array) -> Body:
    """Return the circuit as it lies on the motors' backs."""
    laid = wiring(array)
    drawn = Extrude(outline(array, laid), laid.low, laid.high)
    return Body("circuit", "unit", "circuit", drawn, CIRCUIT_COLOUR, made="bought")


def _segments(radius: float) -> int:
    """Return the sides of a circle while it is a polygon: a multiple of four."""
    return 4 * max(8, min(90, math.ceil(2 * math.pi * radius / _CHORD / 4)))


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
    found: list[Vertex] = []
    at = 0
    while at < n:
        end = at
        while end < n and sides[end] < 2.5 * _CHORD and _on_arc(ring[at : end + 2]):
            end += 1
        if end - at >= _LEAST_SIDES:
            found.append((float(ring[at, 0]), float(ring[at, 1]), math.tan(_turn(ring[at : end + 1]) / 4)))
            at = end
        else:
            found.append((float(ring[at, 0]), float(ring[at, 1]), 0.0))
            at += 1
    return found


def _on_arc(points: np.ndarray) -> bool:
    """Return whether points lie on one arc of at most `_MOST_TURN`; three points or fewer always do."""
    if len(points) < 3:
        return True
    turn = _turn(points)
    x, y = float(points[-1, 0] - points[0, 0]), float(points[-1, 1] - points[0, 1])
    length = math.hypot(x, y)
    if abs(turn) > _MOST_TURN or abs(turn) < 1e-6:
        return False
    radius = length / 2 / math.sin(abs(turn) / 2)
    away = math.copysign(math.sqrt(max(radius**2 - length**2 / 4, 0.0)), turn) / length
    away_x = points[:, 0] - ((points[0, 0] + points[-1, 0]) / 2 - y * away)
    away_y = points[:, 1] - ((points[0, 1] + points[-1, 1]) / 2 + x * away)
    return bool(np.abs(np.hypot(away_x, away_y) - radius).max() < _OFF)


def _turn(points: np.ndarray) -> float:
    """Return by how much an arc through points turns: left is positive, from the angles its chord is seen under."""
    (x, y), (x0, y0), (x1, y1) = points[len(points) // 2].tolist(), points[0].tolist(), points[-1].tolist()
    ax, ay, bx, by = x0 - x, y0 - y, x1 - x, y1 - y
    seen = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
    return -math.copysign(2 * (math.pi - abs(seen)), seen)
