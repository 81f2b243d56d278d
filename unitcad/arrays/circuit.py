"""The common circuit of an array: its wiring, its outline, and the files that a maker of flexible circuits reads."""

from __future__ import annotations

import csv
import io
import math
from bisect import bisect
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from dataclasses import replace as changed
from functools import lru_cache
from html import escape
from importlib import import_module
from itertools import chain, pairwise
from typing import Any

import numpy as np
from manifold3d import CrossSection, JoinType, OpType
from msgspec.structs import replace

from unitcad.arrays.array import Array
from unitcad.arrays.array_tables import CircuitTable
from unitcad.arrays.constructions import construction_of
from unitcad.arrays.layouts import Point as Place
from unitcad.arrays.sheet import LENGTH, at_place
from unitcad.arrays.tails import CLEAR, Strip
from unitcad.designs import CIRCUIT_COLOUR, dimensions
from unitcad.designs.dimensions import Pad
from unitcad.designs.limits import up
from unitcad.errors import Missing, Refusal
from unitcad.export.chart import coord
from unitcad.extras import missing_extra
from unitcad.geometry.segments import Point, to_box, to_segment
from unitcad.shape import Common, Extrude, Profile, cylinder, moved
from unitcad.shape.profile import Vertex, arc_centre, sides
from unitcad.shape.tree import Body
from unitcad.spec import motor_of
from unitcad.text import number

LEAST_BEND = 10.0
"""Least radius that a circuit is bent to, over its thickness: two layers of copper, bent once (IPC-2223)."""
_EPS = 1e-6
Line = tuple[float, tuple[float, ...]]
"""A row: its place across, and its units along it."""


@dataclass(frozen=True)
class Wiring:
    """Places of the pads on the motors' backs, the pad, rows, and the spine from the first row to the tail's end."""

    places: tuple[Place, ...]
    pad: Pad
    rows: tuple[Strip, ...]
    spine: tuple[Strip, ...]

    @property
    def strips(self) -> tuple[Strip, ...]:
        """Rows and spine."""
        return self.rows + self.spine


def wiring(array: Array) -> Wiring:
    """Return the common circuit of an array's motors.

    Raises Refusal, with the nearest value that fits, if a row or the spine runs into a unit or a strap slot, if no gap
    is free, or if the circuit would be bent too much round the limb.
    """
    table = array.circuit or CircuitTable()
    pad = dimensions(array.unit).pad  # a back sheet's units are of one kind
    assert pad is not None  # `back_sheet.level` refuses units without a circuit
    if table.row_width_mm > 2 * pad.radius + _EPS:
        limit = f"a row is no wider than the pads of {2 * pad.radius:g} mm"
        raise Refusal("circuit.row_width_mm", table.row_width_mm, limit, 2 * pad.radius)
    pads = [Place(place.name, place.x, place.y) for place in array.places]
    _check_bend(array, pads, pad, table)

    def free(table: CircuitTable) -> tuple[Wiring | None, str]:
        blocked = ""
        for rows, spine, own in _ways(array, table, pads):
            blocked_now = _in_the_way(array, rows, spine, own)
            if not blocked_now:
                return Wiring(tuple(pads), pad, tuple(rows), tuple(spine)), ""
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


def _ways(array: Array, table: CircuitTable, pads: Sequence[Place]) -> Iterator[tuple[list[Strip], list[Strip], bool]]:
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


def _lines(pads: Sequence[Place], turned: bool) -> list[Line]:
    """Return each row's place across and the places along it, sorted; the first row is the one farthest up."""
    lines: dict[float, list[float]] = {}
    for pad in pads:
        u, v = (pad.y, pad.x) if turned else (pad.x, pad.y)
        lines.setdefault(next((known for known in lines if abs(known - v) < _EPS), v), []).append(round(u, 6))
    return [(v, tuple(sorted(along))) for v, along in sorted(lines.items(), reverse=True)]


def _gaps(pads: Sequence[Place], table: CircuitTable) -> list[float]:
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
        through, (x0, y0), (x1, y1) = own or strip in rows, strip.start, strip.end
        for place in array.places:
            off = abs((x1 - x0) * (place.y - y0) - (y1 - y0) * (place.x - x0))
            if through and off < _EPS * math.hypot(x1 - x0, y1 - y0):
                continue
            if to_segment((place.x, place.y), strip.start, strip.end) < place.radius + strip.half + CLEAR - _EPS:
                return f"the unit {place.name}"
        if any(to_box(strip.start, strip.end, slot) < strip.half + CLEAR - _EPS for slot in array.sheet.strap_slots):
            return "a strap slot"
    return ""


def _check_bend(array: Array, pads: Sequence[Place], pad: Pad, table: CircuitTable) -> None:
    """Raise Refusal for a limb so narrow that the circuit between two pads, which stay flat, is bent too much."""
    if array.radius_mm is None or table.rows == "y":
        return
    least = LEAST_BEND * (pad.high - pad.low)
    for _, along in _lines(pads, turned=False):
        for one, other in pairwise(along):
            pitch = other - one
            free = max(pitch - 2 * pad.radius, 0.0)
            bend = array.radius_mm * free / pitch
            if bend < least * (1.0 - _EPS):
                limit = (
                    f"between two pads {pitch:.4g} mm apart, which stay flat, the circuit would be bent to a radius of "
                    f"{bend:.3g} mm; {LEAST_BEND:g} times its thickness is {least:.3g} mm"
                )
                raise Refusal("limb.radius_mm", array.radius_mm, limit, up(least * pitch / free) if free else None)


TRACK_MM = GAP_MM = 0.1
"""Least width of a track, and of the gap next to it (assumed: 4 mil, usual for flexible circuits)."""


def crowded_tracks(array: Array) -> list[str]:
    """Return a sentence if spine and tail are too narrow for the tracks of all motors; otherwise []."""
    if not has_circuit(array):
        return []
    width, motors = (array.circuit or CircuitTable()).row_width_mm, len(array.places)
    # One layer: a track a motor and a common return, a gap at both edges.
    needed = (motors + 1) * (TRACK_MM + GAP_MM) + GAP_MM
    if needed <= width + 1e-9:
        return []
    most = int((width - GAP_MM) / (TRACK_MM + GAP_MM) + 1e-9) - 1
    return [
        f"the circuit's spine and tail are {number(width, 3)} mm wide (circuit.row_width_mm), enough for {most} "
        f"motors: {motors} tracks and a common return, {TRACK_MM:g} mm wide and {GAP_MM:g} mm apart on one layer, need "
        f"{number(needed, 3)} mm"
    ]


_CHORD = 0.04
"""Of an arc while it is a polygon, mm."""
_OFF = 2e-3
"""Largest distance of a polygon's corners from the arc that replaces them, mm."""
_LEAST_SIDES = 4
"""Sides of a polygon that are taken for an arc."""
_KEPT_OFF = 0.01
"""Distance of inner corners from silicone, mm: more than the errors of polygons and meshes."""
_LEAST_AREA = 1e-6
"""Of a corner that is not rounding's, mm2."""
_MOST_TURN = math.radians(170)
"""Of one arc: a longer one is two."""


def outline(array: Array, laid: Wiring | None = None) -> Profile:
    """Return the circuit's outline, counter-clockwise: pads and strips, inner corners of `circuit.corner_mm`.

    `laid` is the array's wiring, if it is known. Raises Refusal as `wiring`, and for corners that would enclose a
    hole or reach into a unit's silicone next to its notch.
    """
    table, dims = array.circuit or CircuitTable(), dimensions(array.unit)
    ring = dims.cavity_radius - _KEPT_OFF, array.places[0].radius + _KEPT_OFF
    clearance = array.unit.moulds.slot_width_clearance_mm / 2 - _KEPT_OFF
    return _outline(laid or wiring(array), ring, clearance, table.corner_mm)


@lru_cache(maxsize=8)
def _outline(laid: Wiring, ring: tuple[float, float], clearance: float, corner: float) -> Profile:
    """Return the outline, kept: most changes of a sheet leave the circuit as it is. Raises Refusal.

    `ring`: radii of the silicone round each pad that corners keep off; `clearance`: a notch's play at a side, mm.
    """
    closed, blocked = _rounded(laid, ring, clearance, corner)
    if blocked:
        tenths = range(2, math.ceil(10 * corner))
        # A larger corner reaches into all that a smaller one does.
        fits = bisect(tenths, False, key=lambda tenth: bool(_rounded(laid, ring, clearance, tenth / 10)[1]))
        raise Refusal("circuit.corner_mm", corner, blocked, tenths[fits - 1] / 10 if fits else None)
    return Profile(tuple(_with_arcs(_distinct(np.asarray(closed.to_polygons()[0], float)))))


def _rounded(laid: Wiring, ring: tuple[float, float], clearance: float, corner: float) -> tuple[CrossSection, str]:
    """Return the circuit as a polygon with inner corners of a radius, and the objection to it, or ""."""
    disc = CrossSection.circle(laid.pad.radius, _segments(laid.pad.radius))
    discs = [disc.translate((pad.x, pad.y)) for pad in laid.places]
    joints = [CrossSection.circle(one.half, _segments(one.half)).translate(one.end) for one in laid.spine[:-1]]
    parts = [*discs, *joints, *(_rectangle(strip) for strip in laid.strips)]
    whole = CrossSection.batch_boolean(parts, OpType.Add)
    # Outwards with sharp outer corners, back with round inner ones.
    closed = whole.offset(corner, JoinType.Miter).offset(-corner, JoinType.Round, 2.0, _segments(corner))
    if closed.num_contour() != 1:
        return closed, "the circuit's inner corners would enclose a hole between its rows or pads"
    added = closed - whole
    # Of the additions only those near a unit: with all of them for each a large array took seconds.
    pieces = added.decompose()
    x0, y0, x1, y1 = np.array([piece.bounds() for piece in pieces], float).reshape(-1, 4).T
    notches = CrossSection.batch_boolean([_rectangle(strip, clearance) for strip in laid.strips], OpType.Add)
    inner, r = ring
    silicone = CrossSection.circle(r, 128) - CrossSection.circle(inner, 128)
    for pad in laid.places:
        x, y = pad.x, pad.y
        near = np.flatnonzero((x0 < x + r) & (x1 > x - r) & (y0 < y + r) & (y1 > y - r))
        beside = (CrossSection.compose([pieces[i] for i in near]) ^ silicone.translate((x, y))) - notches
        if beside.area() > _LEAST_AREA:
            return closed, f"the circuit's inner corners would reach into the silicone of {pad.name} next to its notch"
    return closed, ""


def circuit_body(array: Array) -> Body:
    """Return the circuit at its place on the motors' backs."""
    laid = wiring(array)
    drawn = Extrude(outline(array, laid), laid.pad.low, laid.pad.high)
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
        count, turn = _arc(ring[at : end + 1])
        count, bulge = (count, math.tan(turn / 4)) if count >= _LEAST_SIDES else (1, 0.0)
        found.append((float(ring[at, 0]), float(ring[at, 1]), bulge))
        at += count
    return found


def _arc(points: np.ndarray) -> tuple[int, float]:
    """Return the number of sides, from the first point on, that are on one arc of at most `_MOST_TURN`, and its turn.

    A single side, between two points, always is. The turn is positive to the left, from the angles that the chord is
    seen under.
    """
    counts = np.arange(3, len(points) + 1)
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
    wrong = ~near.all(axis=1) | (np.abs(turn) > _MOST_TURN) | (np.abs(turn) < 1e-6)
    sides = 1 + int(np.argmax([*wrong, True]))
    return sides, float(turn[sides - 2]) if sides > 1 else 0.0


def lay_circuit(array: Array) -> tuple[Body, ...]:
    """Return the circuit in the frame that the silicone is cast in.

    In a curved cast its part within each unit is flat; between the units it bends freely, and is not drawn.
    """
    whole = circuit_body(array)
    if array.cast == "flat":
        return (whole,)
    return tuple(
        changed(
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


_EDGE_MM = 5.0


def circuit_svg(laid: Wiring, outline: Profile) -> str:
    """Return the circuit as an SVG document seen from outside, a user unit a millimetre."""
    x0, y0, x1, y1 = outline.bounds
    wide, high = (coord(length + 2 * _EDGE_MM) for length in (x1 - x0, y1 - y0))
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}mm" height="{high}mm" '
        f'viewBox="{coord(x0 - _EDGE_MM)} {coord(-y1 - _EDGE_MM)} {wide} {high}">',
        f'<path id="outline" d="{outline_path(outline)}" fill="#f3cfa0" stroke="#8a4a0a" stroke-width="0.1"/>',
    ]
    for pad in laid.places:
        at = f'x="{coord(pad.x)}" y="{coord(0.5 - pad.y)}"'
        parts += [
            f'<circle class="pad" cx="{coord(pad.x)}" cy="{coord(-pad.y)}" r="{coord(laid.pad.radius)}" fill="none" '
            'stroke="#8a4a0a" stroke-width="0.1" stroke-dasharray="0.6 0.4"/>',
            f'<text {at} font-family="sans-serif" font-size="1.5" text-anchor="middle">{escape(pad.name)}</text>',
        ]
    return "\n".join([*parts, "</svg>", ""])


def outline_path(outline: Profile) -> str:
    """Return an outline as the data of an SVG path, y downwards, to a micrometre."""
    first = outline.vertices[0]
    drawn = [f"M{coord(first[0], 3)} {coord(-first[1], 3)}"]
    for start, end in sides(outline.vertices):
        to = f"{coord(end[0], 3)} {coord(-end[1], 3)}"
        if not start[2]:
            drawn.append(f"L{to}")
            continue
        radius = coord(arc_centre(start[:2], end[:2], start[2])[2], 3)
        # More than half a turn has a bulge over 1; left turns run against SVG's sweep, whose y points down.
        drawn.append(f"A{radius} {radius} 0 {int(abs(start[2]) > 1)} {int(start[2] < 0)} {to}")
    return "".join([*drawn, "Z"])


_DIGITS = 6
_TEXT_MM = 1.5
_COLOURS = {"OUTLINE": 7, "PADS": 30, "NAMES": 8}
"""Of the layers, by AutoCAD's index."""


def circuit_dxf(laid: Wiring, outline: Profile) -> bytes:
    """Return a DXF file (AC1024, AutoCAD 2010 and later). Raises Missing without ezdxf."""
    try:
        ezdxf: Any = import_module("ezdxf")
        import_module("ezdxf.enums")
    except ImportError as error:
        raise missing_extra("dxf", "ezdxf is not installed; build without dxf, or install it") from error
    with _fixed_dates(ezdxf):
        document = ezdxf.new("R2010", units=4)  # millimetres
        document.header["$MEASUREMENT"] = 1
        for name, colour in _COLOURS.items():
            document.layers.add(name, color=colour)
        space = document.modelspace()
        vertices = [(round(x, _DIGITS), round(y, _DIGITS), round(bulge, 12)) for x, y, bulge in outline.vertices]
        space.add_lwpolyline(vertices, format="xyb", close=True, dxfattribs={"layer": "OUTLINE"})
        for pad in laid.places:
            at = (round(pad.x, _DIGITS), round(pad.y, _DIGITS))
            space.add_circle(at, round(laid.pad.radius, _DIGITS), dxfattribs={"layer": "PADS"})
            name = space.add_text(pad.name, height=_TEXT_MM, dxfattribs={"layer": "NAMES"})
            name.set_placement(at, align=ezdxf.enums.TextEntityAlignment.MIDDLE_CENTER)
        for kind in sorted(document.entitydb.dxf_types_in_use()):  # ezdxf adds their classes in the order of a set
            document.classes.add_class(kind)
        stream = io.StringIO()
        document.write(stream)
    return stream.getvalue().encode("utf-8")


@contextmanager
def _fixed_dates(ezdxf: Any) -> Iterator[None]:
    """Have ezdxf write one date and one identifier for a block: its options belong to the whole process."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


def pad_table(array: Array, laid: Wiring) -> bytes:
    """Return a CSV file: a row for each motor's pad, in mm as in the array's frame, and one for the end of the tail.

    x and y from the array's middle, seen from outside; `z_mm`: the pad's face towards the motor, over the skin.
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("name", "what", "x_mm", "y_mm", "z_mm", "diameter_mm", "unit", "motor"))

    def add(name: str, what: str, at: Point, wide: float, *more: str) -> None:
        rows.writerow((name, what, *(coord(value, 4) for value in (*at, laid.pad.low, wide)), *more))

    for place in array.places:
        motor = motor_of(place.unit)
        add(place.name, "pad", (place.x, place.y), 2 * laid.pad.radius, place.unit.name, motor.name if motor else "")
    tail = laid.spine[-1]
    add("tail", "end of the tail", tail.end, 2 * tail.half, "", "")
    return text.getvalue().encode()


DXF, STEP = "circuit.dxf", "circuit.step"


def has_circuit(array: Array) -> bool:
    """Tell whether one circuit joins all motors, since the units have no tails of their own."""
    return not construction_of(array.construction, array.cast).own_tails


def circuit_files(array: Array) -> tuple[dict[str, bytes], dict[str, str]]:
    """Return the files by their names, and the reason for a missing one: DXF needs ezdxf, STEP a kernel.

    Raises Refusal as `outline`.
    """
    if not has_circuit(array):
        return {}, {}
    laid = wiring(array)
    drawn = outline(array, laid)
    files = {
        "circuit.svg": circuit_svg(laid, drawn).encode(),
        "circuit-pads.csv": pad_table(array, laid),
    }
    lacking: dict[str, str] = {}
    try:
        files[DXF] = circuit_dxf(laid, drawn)
    except Missing as missing:
        lacking[DXF] = str(missing)
    if "step" in array.unit.output.formats:
        try:
            from unitcad.export.step import content

            files[STEP] = content([circuit_body(array)], "circuit")
        except Missing as missing:
            lacking[STEP] = str(missing)
    return files, lacking
