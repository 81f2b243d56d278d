"""The wiring of a common circuit: pads, rows, and tracks that are too crowded."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, pairwise

from msgspec.structs import replace

from unitcad.arrays.array import Array, Placed
from unitcad.arrays.array_tables import CircuitTable
from unitcad.arrays.tails import CLEAR
from unitcad.designs import dimensions
from unitcad.designs.limits import up
from unitcad.errors import Refusal
from unitcad.geometry.segments import Point, to_box, to_segment
from unitcad.text import number

LEAST_BEND = 10.0
"""Least radius that a circuit is bent to, over its thickness: two layers of copper, bent once (IPC-2223)."""
_EPS = 1e-6
Line = tuple[float, tuple[float, ...]]
"""A row: its place across, and its units along it."""


@dataclass(frozen=True)
class Strip:
    """A straight strip between two points of its middle line, with square ends; `half` of its width."""

    start: Point
    end: Point
    half: float


@dataclass(frozen=True)
class CircuitPad:
    """A round pad on the back of a place's motor."""

    name: str
    x: float
    y: float
    radius: float


@dataclass(frozen=True)
class Wiring:
    """Pads, rows, and the spine from the first row to the end of the tail. `low` to `high`: its faces over the skin."""

    pads: tuple[CircuitPad, ...]
    rows: tuple[Strip, ...]
    spine: tuple[Strip, ...]
    low: float
    high: float

    @property
    def strips(self) -> tuple[Strip, ...]:
        """Rows and spine."""
        return self.rows + self.spine

    @property
    def end(self) -> Point:
        """The middle of the tail's end."""
        return self.spine[-1].end

    @property
    def thickness(self) -> float:
        """The circuit's, mm."""
        return self.high - self.low


def wiring(array: Array) -> Wiring:
    """Return the common circuit of an array's motors.

    Raises Refusal, with the nearest value that fits, if a row or the spine runs into a unit or a strap slot, if no gap
    is free, or if the circuit would be bent too much round the limb.
    """
    table = array.circuit or CircuitTable()
    pads, low, high = _pads(array, table)
    _check_bend(array, pads, high - low, table)

    def free(table: CircuitTable) -> tuple[Wiring | None, str]:
        blocked = ""
        for rows, spine, own in _ways(array, table, pads):
            blocked_now = _in_the_way(array, rows, spine, own)
            if not blocked_now:
                return Wiring(tuple(pads), tuple(rows), tuple(spine), low, high), ""
            blocked = blocked or blocked_now
        return None, blocked

    found, blocked = free(table)
    if found:
        return found
    if table.spine_mm is not None:
        fits = [at for at in _gaps(pads, table) if free(replace(table, spine_mm=at))[0]]
        nearest = min(fits, key=lambda at: abs(at - (table.spine_mm or 0.0)), default=None)
        raise Refusal("circuit.spine_mm", table.spine_mm, f"the circuit runs into {blocked}", nearest)
    other = "y" if table.rows == "x" else "x"
    if free(replace(table, rows=other))[0]:
        limit = f"with rows along {table.rows} the circuit runs into {blocked}"
        raise Refusal("circuit.rows", table.rows, limit, other)
    tenths = range(math.ceil(10 * table.row_width_mm) - 1, 9, -1)
    narrower = next((w / 10 for w in tenths if free(replace(table, row_width_mm=w / 10))[0]), None)
    limit = f"no way for the spine is free, it runs into {blocked}"
    raise Refusal("circuit.row_width_mm", table.row_width_mm, limit, narrower)


def _ways(
    array: Array, table: CircuitTable, pads: Sequence[CircuitPad]
) -> Iterator[tuple[list[Strip], list[Strip], bool]]:
    """Yield rows and spine of each possible circuit, and whether the spine passes through its units."""
    turned, half = table.rows == "y", table.row_width_mm / 2
    lines = _lines(pads, turned)
    single = len({u for _, along in lines for u in along}) == 1
    least = array.sheet.outline[0 if turned else 1] - table.tail_mm
    if table.spine_mm is not None:
        ways: Iterator[list[float]] = iter([[table.spine_mm] * len(lines)])
    else:
        ways = chain(([at] * len(lines) for at in _gaps(pads, table)), _stepped(lines))
    for at in ways:
        rows = []
        for (v, along), u in zip(lines, at, strict=True):
            ends = min(*along, u), max(*along, u)
            if ends[1] - ends[0] > _EPS:
                rows.append(_strip((ends[0], v), (ends[1], v), half, turned))
        # From the far edge of the first row to the end of the tail; a straight spine is one strip.
        corners = [(at[0], lines[0][0] + half)]
        corners += [(u, v) for (v, _), u in zip(lines, at, strict=True)] if len(set(at)) > 1 else []
        corners.append((at[-1], least))
        yield rows, [_strip(p, q, half, turned) for p, q in pairwise(corners)], single and at[0] == lines[0][1][0]


def _pads(array: Array, table: CircuitTable) -> tuple[list[CircuitPad], float, float]:
    """Return the pads and the circuit's faces. Raises Refusal for units without a circuit, or with unlike ones."""
    faces: set[tuple[float, float]] = set()
    found = []
    for place in array.places:
        pad = dimensions(place.unit).pad
        if pad is None:
            raise Refusal("circuit", None, f"joins the circuits of the units, and {place.name} has none (fpcb)")
        faces.add((pad.low, pad.high))
        found.append(CircuitPad(place.name, place.x, place.y, pad.radius))
    if len(faces) > 1:
        raise Refusal("circuit", None, "one circuit is flat, and the units' motors or circuits differ in height")
    narrowest = 2 * min(pad.radius for pad in found)
    if table.row_width_mm > narrowest + _EPS:
        limit = f"a row is no wider than the pads of {narrowest:g} mm"
        raise Refusal("circuit.row_width_mm", table.row_width_mm, limit, narrowest)
    low, high = faces.pop()
    return found, low, high


def _lines(pads: Sequence[CircuitPad], turned: bool) -> list[Line]:
    """Return each row's place across and the places along it, sorted; the first row is the one farthest up."""
    lines: dict[float, list[float]] = {}
    for pad in pads:
        u, v = (pad.y, pad.x) if turned else (pad.x, pad.y)
        lines.setdefault(next((known for known in lines if abs(known - v) < _EPS), v), []).append(round(u, 6))
    return [(v, tuple(sorted(along))) for v, along in sorted(lines.items(), reverse=True)]


def _gaps(pads: Sequence[CircuitPad], table: CircuitTable) -> list[float]:
    """Return the possible places of a straight spine, the middle's nearest first: between columns, or through one."""
    columns = sorted({u for _, along in _lines(pads, table.rows == "y") for u in along})
    if len(columns) == 1:
        return columns
    return sorted(((a + b) / 2 for a, b in pairwise(columns)), key=lambda at: (round(abs(at), 6), -at))


def _stepped(lines: Sequence[Line]) -> Iterator[list[float]]:
    """Yield ways of a spine that goes from a gap of one row to the nearest gap of the next."""
    gaps = [[(a + b) / 2 for a, b in pairwise(along)] for _, along in lines]
    if not all(gaps):
        return
    for first in sorted(gaps[0], key=lambda at: (round(abs(at), 6), -at)):
        way = [first]
        for row in gaps[1:]:
            way.append(min(row, key=lambda at: (round(abs(at - way[-1]), 6), round(abs(at), 6), -at)))
        yield way


def _strip(start: Point, end: Point, half: float, turned: bool) -> Strip:
    return Strip((start[1], start[0]), (end[1], end[0]), half) if turned else Strip(start, end, half)


def _in_the_way(array: Array, rows: Sequence[Strip], spine: Sequence[Strip], own: bool) -> str:
    """Return the name of the obstacle of rows or spine; "" for none.

    A row passes through its units, so does an `own` spine.
    """
    for strip in (*rows, *spine):
        through = own or strip in rows
        for place in array.places:
            if through and _on_line(strip, place):
                continue
            if to_segment((place.x, place.y), strip.start, strip.end) < place.radius + strip.half + CLEAR - _EPS:
                return f"the unit {place.name}"
        if any(to_box(strip.start, strip.end, slot) < strip.half + CLEAR - _EPS for slot in array.sheet.strap_slots):
            return "a strap slot"
    return ""


def _on_line(strip: Strip, place: Placed) -> bool:
    (x0, y0), (x1, y1) = strip.start, strip.end
    return abs((x1 - x0) * (place.y - y0) - (y1 - y0) * (place.x - x0)) < _EPS * math.hypot(x1 - x0, y1 - y0)


def _check_bend(array: Array, pads: Sequence[CircuitPad], thickness: float, table: CircuitTable) -> None:
    """Raise Refusal for a limb so narrow that the circuit between two pads, which stay flat, is bent too much."""
    if array.radius_mm is None or table.rows == "y":
        return
    least = LEAST_BEND * thickness
    pad = pads[0].radius
    for _, along in _lines(pads, turned=False):
        for one, other in pairwise(along):
            pitch = other - one
            free = max(pitch - 2 * pad, 0.0)
            bend = array.radius_mm * free / pitch
            if bend < least * (1.0 - _EPS):
                limit = (
                    f"between two pads {pitch:.4g} mm apart, which stay flat, the circuit would be bent to a radius of "
                    f"{bend:.3g} mm; {LEAST_BEND:g} times its thickness is {least:.3g} mm"
                )
                raise Refusal("limb.radius_mm", array.radius_mm, limit, up(least * pitch / free) if free else None)


TRACK_MM = GAP_MM = 0.1
"""Least width of a track, and of the gap next to it (assumed: 4 mil, usual for flexible circuits)."""


def width_needed(motors: int) -> float:
    """Return how wide one layer of a track a motor and a common return is, mm, a gap at both edges."""
    return (motors + 1) * (TRACK_MM + GAP_MM) + GAP_MM


def crowded_tracks(array: Array) -> list[str]:
    """Return a sentence if spine and tail are too narrow for the tracks of all motors; otherwise []."""
    width, motors = (array.circuit or CircuitTable()).row_width_mm, len(array.places)
    needed = width_needed(motors)
    if needed <= width + 1e-9:
        return []
    most = int((width - GAP_MM) / (TRACK_MM + GAP_MM) + 1e-9) - 1
    return [
        f"the circuit's spine and tail are {number(width, 3)} mm wide (circuit.row_width_mm), enough for {most} "
        f"motors: {motors} tracks and a common return, {TRACK_MM:g} mm wide and {GAP_MM:g} mm apart on one layer, need "
        f"{number(needed, 3)} mm"
    ]
