"""The ways of the circuits' tails between the units, and tails that the sheet covers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

from unitcad.arrays.array import Array, Box, Placed, Sheet
from unitcad.arrays.constructions import construction_of
from unitcad.arrays.layouts import Point
from unitcad.designs import dimensions
from unitcad.designs.dimensions import WIRE_GAP
from unitcad.designs.limits import EPS
from unitcad.geometry.segments import between_segments, to_box, to_segment
from unitcad.spec import Spec
from unitcad.text import join_words, number

CLEAR = 0.5
"""From a tail to a unit, a strap slot or another tail, at least, mm (assumed: a hand lays the tails)."""
STEP_DEG = 15


class Tail(NamedTuple):
    """A straight strip from (x0, y0) to (x1, y1), mm, of half the width `half`; `owner` is its unit's number."""

    x0: float
    y0: float
    x1: float
    y1: float
    half: float
    owner: int


class Blocked(Exception):
    """A unit whose tail finds no way: its number, and the longest tail that would find one (mm beyond its edge).

    `turned`: the nearest angle, in whole degrees from the one asked for, at which it would; None for none.
    """

    def __init__(self, owner: int, longest: float, by: str, turned: float | None = None) -> None:
        super().__init__(by)
        self.owner, self.longest, self.by, self.turned = owner, longest, by, turned


def tails(unit: Spec, x: float, y: float, angle_deg: float, owner: int, length: float | None = None) -> list[Tail]:
    """Return the tails of a unit at its place; `length` in place of its own, mm beyond its edge."""
    dims, half = dimensions(unit), tail_half_width(unit)
    reach = dims.outer_radius + (tail_length(unit) if length is None else length)
    found = []
    for side in dims.sides if half else ():
        turn = math.radians(angle_deg + (0 if side > 0 else 180))
        found.append(Tail(x, y, x + reach * math.cos(turn), y + reach * math.sin(turn), half, owner))
    return found


def tail_half_width(unit: Spec) -> float:
    """Return half the width of a unit's tail or bundle of wires, mm; 0 without one."""
    if unit.fpcb:
        return max(unit.fpcb.tail_width_mm, unit.fpcb.tail_end_width_mm) / 2
    return (unit.wires.count * (unit.wires.diameter_mm + WIRE_GAP) - WIRE_GAP) / 2 if unit.wires else 0.0


def tail_length(unit: Spec) -> float:
    """Return the length of a unit's tail or wires outside it, mm."""
    return unit.fpcb.tail_length_mm if unit.fpcb else unit.wires.length_mm if unit.wires else 0.0


def angles(points: Sequence[Point], units: Sequence[Spec], asked: Mapping[int, float], sheet: Sheet) -> list[float]:
    """Return each unit's angle, degrees: the `asked` one, by its number, or the nearest free way.

    Raises Blocked for the first unit whose tail finds none.
    """
    try:
        return _laid(points, units, asked, sheet, out=True)
    except Blocked:
        # A tail that was turned to come out may block another.
        return _laid(points, units, asked, sheet, out=False)


def _laid(
    points: Sequence[Point], units: Sequence[Spec], asked: Mapping[int, float], sheet: Sheet, *, out: bool
) -> list[float]:
    """Return the angles; with `out` a quarter turn whose tail comes out from under the sheet is preferred."""
    radii = [unit.diameter_mm / 2 for unit in units]
    near = _neighbours(points, units, radii)
    laid: list[list[Tail]] = [[] for _ in points]
    chosen = [asked.get(i, 0.0) for i in range(len(points))]
    slots = sheet.strap_slots
    for i in asked:
        laid[i] = tails(units[i], points[i].x, points[i].y, chosen[i], i)
    for i in asked:
        if why := in_the_way(laid[i], i, points, radii, near[i], laid, slots):
            longest = _longest(i, (chosen[i],), points, units, radii, near[i], laid, slots)

            def clear(angle: float, i: int = i) -> bool:
                drawn = tails(units[i], points[i].x, points[i].y, angle, i)
                return not in_the_way(drawn, i, points, radii, near[i], laid, slots)

            by = (chosen[i] + sign * turn for turn in range(1, 181) for sign in (1, -1))
            raise Blocked(i, longest, why, next((angle for angle in by if abs(angle) <= 360 and clear(angle)), None))
    for i in (i for i in range(len(points)) if i not in asked):
        why, free = "", None
        for angle in candidates(points[i]):
            if free is not None and angle % 90:
                break
            drawn = tails(units[i], points[i].x, points[i].y, angle, i)
            why = in_the_way(drawn, i, points, radii, near[i], laid, slots)
            if not why and (free is None or not ends_covered(units[i], drawn, sheet)):
                free = angle, drawn
                if not (out and ends_covered(units[i], drawn, sheet)):
                    break
        if free is None:
            longest = _longest(i, candidates(points[i]), points, units, radii, near[i], laid, slots)
            raise Blocked(i, longest, why)
        chosen[i], laid[i] = free
    return chosen


def _neighbours(points: Sequence[Point], units: Sequence[Spec], radii: Sequence[float]) -> list[list[int]]:
    """Return for each unit the numbers of those that its tail, or a tail of theirs, could meet."""
    reach = [radius + tail_length(unit) for unit, radius in zip(units, radii, strict=True)]
    far = 2 * max(reach) + 2 * max(tail_half_width(unit) for unit in units) + CLEAR
    return [
        [j for j, q in enumerate(points) if j != i and abs(q.x - p.x) <= far and abs(q.y - p.y) <= far]
        for i, p in enumerate(points)
    ]


def candidates(point: Point) -> list[float]:
    """Return the angles to try, degrees: quarter turns first, each group from the way outwards on."""
    outwards = math.degrees(math.atan2(point.y, point.x)) if math.hypot(point.x, point.y) > 1e-6 else 0.0

    def away(angle: float) -> float:
        return round(abs((angle - outwards + 180) % 360 - 180), 6)

    every = [float(angle) for angle in range(0, 360, STEP_DEG)]
    return sorted(every, key=lambda angle: (angle % 90 != 0, angle % 45 != 0, away(angle), angle))


def in_the_way(
    drawn: Sequence[Tail],
    owner: int,
    points: Sequence[Point],
    radii: Sequence[float],
    near: Sequence[int],
    laid: Sequence[Sequence[Tail]],
    slots: Sequence[Box],
) -> str:
    """Return the obstacle of a unit's tails; "" for none."""
    for tail in drawn:
        start, end = (tail.x0, tail.y0), (tail.x1, tail.y1)
        for j in near:
            if to_segment((points[j].x, points[j].y), start, end) < radii[j] + tail.half + CLEAR - 1e-9:
                return f"the unit {points[j].name}"
        for j in near:
            for other in laid[j]:
                apart = between_segments(start, end, (other.x0, other.y0), (other.x1, other.y1))
                if apart < tail.half + other.half + CLEAR - 1e-9:
                    return f"the tail of {points[j].name}"
        for slot in slots:
            if to_box(start, end, slot) < tail.half + CLEAR - 1e-9:
                return "a strap slot"
    return ""


def _longest(
    owner: int,
    tried: Sequence[float],
    points: Sequence[Point],
    units: Sequence[Spec],
    radii: Sequence[float],
    near: Sequence[int],
    laid: Sequence[Sequence[Tail]],
    slots: Sequence[Box],
) -> float:
    """Return the longest tail that finds a way at one of the angles, mm in steps of 0.1; 0 if none does."""
    free = [tails_of if j != owner else [] for j, tails_of in enumerate(laid)]

    def fits(tenths: int) -> bool:
        return any(
            not in_the_way(
                tails(units[owner], points[owner].x, points[owner].y, angle, owner, tenths / 10),
                owner, points, radii, near, free, slots,
            )
            for angle in tried
        )  # fmt: skip

    low, high = 0, int(tail_length(units[owner]) * 10)
    while low < high:
        middle = (low + high + 1) // 2
        low, high = (middle, high) if fits(middle) else (low, middle - 1)
    return low / 10


def ends_covered(unit: Spec, drawn: Sequence[Tail], sheet: Sheet) -> bool:
    """Tell whether a unit's tails end under the sheet."""
    exit = dimensions(unit).exit
    if exit is None or exit.high > sheet.low + EPS:
        return False  # the tail is on the sheet
    return any(_way_out(start, along, sheet, EPS) > 0 for tail in drawn for start, along in _end(tail))


def to_edge(drawn: Sequence[Tail], sheet: Sheet) -> float:
    """Return how far tails have to go on until all of their width is out of the sheet's outline, mm."""
    return max(_way_out(start, along, sheet) for tail in drawn for start, along in _end(tail))


def _end(tail: Tail) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return the corners and the middle of a tail's end, each with the direction of the tail."""
    long = math.hypot(tail.x1 - tail.x0, tail.y1 - tail.y0)
    along = (tail.x1 - tail.x0) / long, (tail.y1 - tail.y0) / long
    aside = -along[1] * tail.half, along[0] * tail.half
    return [((tail.x1 + side * aside[0], tail.y1 + side * aside[1]), along) for side in (-1, 0, 1)]


def _way_out(start: tuple[float, float], along: tuple[float, float], sheet: Sheet, beyond: float = 0.0) -> float:
    """Return the way from a point along a direction out of the sheet's outline, mm; 0 from a point outside.

    With `beyond` only whether the way is longer than that: 0 or the most that it can be. The outline is convex, so the
    way is halved until it is known.
    """
    x0, y0, x1, y1 = sheet.outline
    r = sheet.corner_mm
    inner = x0 + r, y0 + r, x1 - r, y1 - r

    def inside(way: float) -> bool:
        at = start[0] + way * along[0], start[1] + way * along[1]
        return to_box(at, at, inner) <= r

    low, high = beyond, math.hypot(x1 - x0, y1 - y0)
    if not inside(low):
        return 0.0
    while not beyond and high - low > EPS / 2:
        middle = (low + high) / 2
        low, high = (middle, high) if inside(middle) else (low, middle)
    return high


MOST_NAMES = 12
"""Places that a warning names before it counts the others."""


@dataclass(frozen=True)
class CoveredTail:
    """A tail, or a bundle of wires, whose end the sheet covers.

    short_mm    from its end to the place at which all of its width is out, along it
    length_mm   of the tail that would come out, beyond the unit's edge
    field       the spec's key of that length
    blocked_by  the obstacle of the straight way there; "" if it is free
    angle_deg   at which the tail as it is would come out; None if none of the angles that are tried is free
    """

    place: str
    short_mm: float
    length_mm: float
    field: str
    blocked_by: str
    angle_deg: float | None


def covered_tails(array: Array) -> tuple[CoveredTail, ...]:
    """Return the tails that end under the sheet, in the order of places; () if the sheet covers none."""
    if not construction_of(array.construction, array.cast).own_tails:
        return ()
    points = [Point(place.name, place.x, place.y) for place in array.places]
    radii = [place.radius for place in array.places]
    laid = [_tails(place, i) for i, place in enumerate(array.places)]
    found = []
    for i, place in enumerate(array.places):
        if not ends_covered(place.unit, laid[i], array.sheet):
            continue
        short = to_edge(laid[i], array.sheet)
        length = tail_length(place.unit) + short
        near = sorted(
            (j for j in range(len(points)) if j != i), key=lambda j: math.dist(points[i][1:3], points[j][1:3])
        )
        blocked = in_the_way(_tails(place, i, length), i, points, radii, near, laid, array.sheet.strap_slots)
        field = "fpcb.tail_length_mm" if place.unit.fpcb else "wires.length_mm"

        def free(angle: float, place: Placed = place, i: int = i, near: Sequence[int] = near) -> bool:
            """Tell whether the tail as it is comes out at an angle."""
            turned = tails(place.unit, place.x, place.y, angle, i)
            if ends_covered(place.unit, turned, array.sheet):
                return False
            return not in_the_way(turned, i, points, radii, near, laid, array.sheet.strap_slots)

        turn = next((angle for angle in candidates(points[i]) if free(angle)), None)
        found.append(CoveredTail(place.name, round(short, 2), _typed(length), field, blocked, turn))
    return tuple(found)


def where_they_end(covered: Sequence[CoveredTail], most_names: int = 0) -> str:
    """Say how far before the sheet's edge tails end, measured along them, the farthest last."""

    def short(tail: CoveredTail) -> float:
        return float(number(tail.short_mm, 2))

    groups = groupby(sorted(covered, key=short), key=short)
    first, *others = (f"{number(way)} mm%s at {_names(same, most_names)}" for way, same in groups)
    return join_words([first % " before its edge, measured along the tail,", *(other % "" for other in others)])


def longer_tails(covered: Sequence[CoveredTail], most_names: int = 0) -> str:
    """Say which tails would come out turned, which if they were longer, and which have no straight way there."""

    def wanted(tail: CoveredTail) -> tuple[str, float]:
        return tail.field, tail.length_mm

    turned = [(tail.angle_deg, tail) for tail in covered if tail.angle_deg is not None]
    said = [
        f"With angle_deg = {number(angle)} {_names((tail for _, tail in same), most_names)} would come out as it is."
        for angle, same in groupby(sorted(turned, key=lambda pair: pair[0]), key=lambda pair: pair[0])
    ]
    straight = [tail for tail in covered if tail.angle_deg is None]
    free = sorted((tail for tail in straight if not tail.blocked_by), key=wanted)
    said += [
        f"With {field} = {number(length)} {_names(same, most_names)} would reach the edge."
        for (field, length), same in groupby(free, key=wanted)
    ]
    if stopped := [tail for tail in straight if tail.blocked_by]:
        said.append(f"No straight way out is free at {_names(stopped, most_names)}.")
    return " ".join(said)


def covered_tails_warning(array: Array) -> list[str]:
    """Return the warning of tails that end under the sheet; [] if none does."""
    covered = covered_tails(array)
    if not covered:
        return []
    return [
        f"tails end under the sheet, {where_they_end(covered, MOST_NAMES)}. {longer_tails(covered, MOST_NAMES)} "
        "Solder wires to a tail that stays under the sheet before its unit goes in"
    ]


def _tails(place: Placed, owner: int, length: float | None = None) -> list[Tail]:
    return tails(place.unit, place.x, place.y, place.angle_deg, owner, length)


def _typed(length: float) -> float:
    """Return a length to type, mm: the next tenth that is not shorter."""
    return math.ceil(length * 10 - 1e-3) / 10


def _names(tails: Iterable[CoveredTail], most: int) -> str:
    """Return the tails' places in words; with a `most` only so many, and the number of the others."""
    names = [tail.place for tail in tails]
    return join_words([*names[:most], f"{len(names) - most} others"] if 0 < most < len(names) else names)
