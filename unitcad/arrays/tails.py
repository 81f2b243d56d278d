"""The ways of the circuits' tails between the units, and tails that the sheet covers."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from typing import NamedTuple

from unitcad.arrays.array import Array, Placed, Sheet
from unitcad.arrays.constructions import construction_of
from unitcad.designs import dimensions
from unitcad.designs.dimensions import WIRE_GAP
from unitcad.designs.limits import EPS
from unitcad.geometry.segments import Point, between_segments, to_box, to_segment
from unitcad.spec import Spec
from unitcad.text import join_words

CLEAR = 0.5
"""From a tail to a unit, a strap slot or another tail, at least, mm (assumed: a hand lays the tails)."""
STEP_DEG = 15


class Strip(NamedTuple):
    """A straight strip between two points of its middle line, with square ends; `half` of its width, mm."""

    start: Point
    end: Point
    half: float


class Blocked(Exception):
    """A unit whose tail finds no way: its number, and the longest tail that would find one (mm beyond its edge).

    `turned`: the nearest angle, in whole degrees from the one asked for, at which it would; None for none.
    """

    def __init__(self, owner: int, longest: float, by: str, turned: float | None = None) -> None:
        super().__init__(by)
        self.owner, self.longest, self.by, self.turned = owner, longest, by, turned


def tails(place: Placed, angle_deg: float, length: float | None = None) -> list[Strip]:
    """Return a unit's tails at an angle; `length` in place of its own, mm beyond its edge."""
    dims, half = dimensions(place.unit), tail_half_width(place.unit)
    reach = dims.outer_radius + (tail_length(place.unit) if length is None else length)
    found = []
    for side in dims.sides if half else ():
        turn = math.radians(angle_deg + (0 if side > 0 else 180))
        end = place.x + reach * math.cos(turn), place.y + reach * math.sin(turn)
        found.append(Strip((place.x, place.y), end, half))
    return found


def tail_half_width(unit: Spec) -> float:
    """Return half the width of a unit's tail or bundle of wires, mm; 0 without one."""
    if unit.fpcb:
        return max(unit.fpcb.tail_width_mm, unit.fpcb.tail_end_width_mm) / 2
    return (unit.wires.count * (unit.wires.diameter_mm + WIRE_GAP) - WIRE_GAP) / 2 if unit.wires else 0.0


def tail_length(unit: Spec) -> float:
    """Return the length of a unit's tail or wires outside it, mm."""
    return unit.fpcb.tail_length_mm if unit.fpcb else unit.wires.length_mm if unit.wires else 0.0


def length_field(unit: Spec) -> str:
    """Return the spec's key of that length."""
    return "fpcb.tail_length_mm" if unit.fpcb else "wires.length_mm"


class Ways:
    """The places of units, the tails that are laid there so far, and for each place those that its tail could meet."""

    def __init__(self, places: Sequence[Placed], sheet: Sheet, laid: list[list[Strip]]) -> None:
        self.places, self.sheet, self.laid = places, sheet, laid
        self.near: dict[int, Sequence[int]] = {}

    def blocked(self, i: int, angle: float, length: float | None = None) -> str:
        """Return the obstacle of a unit's tails at an angle; "" for none."""
        for tail in tails(self.places[i], angle, length):
            near = [self.places[j] for j in self.near[i]]
            for place in near:
                if to_segment((place.x, place.y), tail.start, tail.end) < place.radius + tail.half + CLEAR - 1e-9:
                    return f"the unit {place.name}"
            for j in self.near[i]:
                for other in self.laid[j]:
                    apart = between_segments(tail.start, tail.end, other.start, other.end)
                    if apart < tail.half + other.half + CLEAR - 1e-9:
                        return f"the tail of {self.places[j].name}"
            for slot in self.sheet.strap_slots:
                if to_box(tail.start, tail.end, slot) < tail.half + CLEAR - 1e-9:
                    return "a strap slot"
        return ""

    def longest(self, i: int, tried: Sequence[float]) -> float:
        """Return the longest tail that finds a way at one of the angles, mm in steps of 0.1; 0 if none does."""
        low, high = 0, int(tail_length(self.places[i].unit) * 10)
        while low < high:
            middle = (low + high + 1) // 2
            fits = any(not self.blocked(i, angle, middle / 10) for angle in tried)
            low, high = (middle, high) if fits else (low, middle - 1)
        return low / 10


def angles(places: Sequence[Placed], asked: Collection[int], sheet: Sheet) -> list[float]:
    """Return each unit's angle, degrees: its own if it is `asked` for by its number, or the nearest free way.

    Raises Blocked for the first unit whose tail finds none.
    """
    try:
        return _laid(places, asked, sheet, out=True)
    except Blocked:
        # A tail that was turned to come out may block another.
        return _laid(places, asked, sheet, out=False)


def _laid(places: Sequence[Placed], asked: Collection[int], sheet: Sheet, *, out: bool) -> list[float]:
    """Return the angles; with `out` a quarter turn whose tail comes out from under the sheet is preferred."""
    chosen = [place.angle_deg for place in places]
    ways = Ways(places, sheet, [tails(place, place.angle_deg) if i in asked else [] for i, place in enumerate(places)])
    reach = max(place.radius + tail_length(place.unit) for place in places)
    far = 2 * reach + 2 * max(tail_half_width(place.unit) for place in places) + CLEAR
    for i, p in enumerate(places):
        ways.near[i] = [j for j, q in enumerate(places) if j != i and abs(q.x - p.x) <= far and abs(q.y - p.y) <= far]
    for i in asked:
        if why := ways.blocked(i, chosen[i]):
            by = (chosen[i] + sign * turn for turn in range(1, 181) for sign in (1, -1))
            turned = next((angle for angle in by if abs(angle) <= 360 and not ways.blocked(i, angle)), None)
            raise Blocked(i, ways.longest(i, (chosen[i],)), why, turned)
    for i, place in enumerate(places):
        if i in asked:
            continue
        why, free = "", None
        for angle in candidates(place):
            if free is not None and angle % 90:
                break
            why = ways.blocked(i, angle)
            covered = out and _ends_under(place, angle, sheet)
            if not why and (free is None or not covered):
                free = angle
                if not covered:
                    break
        if free is None:
            raise Blocked(i, ways.longest(i, candidates(place)), why)
        chosen[i], ways.laid[i] = free, tails(place, free)
    return chosen


def candidates(place: Placed) -> list[float]:
    """Return the angles to try, degrees: quarter turns first, each group from the way outwards on."""
    outwards = math.degrees(math.atan2(place.y, place.x)) if math.hypot(place.x, place.y) > 1e-6 else 0.0

    def away(angle: float) -> float:
        return round(abs((angle - outwards + 180) % 360 - 180), 6)

    every = [float(angle) for angle in range(0, 360, STEP_DEG)]
    return sorted(every, key=lambda angle: (angle % 90 != 0, angle % 45 != 0, away(angle), angle))


def _ends_under(place: Placed, angle_deg: float, sheet: Sheet) -> bool:
    """Tell whether a unit's tails at an angle end under the sheet: a corner or the middle of an end is."""
    exit = dimensions(place.unit).exit
    if exit is None or exit.high > sheet.low + EPS:
        return False  # the tail is on the sheet
    (x0, y0, x1, y1), r = sheet.outline, sheet.corner_mm
    for (xa, ya), (xb, yb), half in tails(place, angle_deg):
        long = math.hypot(xb - xa, yb - ya)
        ux, uy = (xb - xa) / long, (yb - ya) / long
        ends = [(xb + EPS * ux - side * uy, yb + EPS * uy + side * ux) for side in (-half, 0.0, half)]
        if any(to_box(at, at, (x0 + r, y0 + r, x1 - r, y1 - r)) <= r for at in ends):
            return True
    return False


MOST_NAMES = 12
"""Places that a text names before it counts the others."""


def covered_tails(array: Array) -> tuple[str, ...]:
    """Return the places whose tail, or bundle of wires, ends under the sheet."""
    if not construction_of(array.construction, array.cast).own_tails:
        return ()
    return tuple(place.name for place in array.places if _ends_under(place, place.angle_deg, array.sheet))


def named(places: Sequence[str]) -> str:
    """Return places in words: some by name, the others by their number."""
    more = len(places) - MOST_NAMES
    return join_words([*places[:MOST_NAMES], *([f"{more} others"] if more > 0 else [])])


def covered_tails_warning(array: Array) -> list[str]:
    """Return the warning of tails that end under the sheet; [] if none does."""
    if not (covered := covered_tails(array)):
        return []
    return [
        f"tails end under the sheet at {named(covered)}: solder wires to them before their units go in, or take longer "
        "tails, or another angle_deg there"
    ]
