"""The sheet of an array: its outline, its lengths on the bed, and outlines with rounded corners."""

from __future__ import annotations

import math
from collections.abc import Sequence

from unitcad import catalogue
from unitcad.arrays.array import Box, Sheet
from unitcad.arrays.array_tables import AskedArray
from unitcad.arrays.construction import Construction
from unitcad.arrays.layouts import Point
from unitcad.designs.limits import down, up
from unitcad.errors import Refusal
from unitcad.shape import Profile, mm
from unitcad.spec import Spec

_QUARTER = math.tan(math.pi / 8)


def rounded(box: Box, radius: float, grow: float = 0.0) -> Profile:
    """Return a box with round corners, every side moved out by `grow`."""
    x0, y0, x1, y1 = box[0] - grow, box[1] - grow, box[2] + grow, box[3] + grow
    r = radius + grow
    corners = (
        (x0 + r, y0, 0.0),
        (x1 - r, y0, _QUARTER),
        (x1, y0 + r, 0.0),
        (x1, y1 - r, _QUARTER),
        (x1 - r, y1, 0.0),
        (x0 + r, y1, _QUARTER),
        (x0, y1 - r, 0.0),
        (x0, y0 + r, _QUARTER),
    )
    # A side without length, between two corners that meet, is none.
    after = (*corners[1:], corners[0])
    return Profile(tuple(c for c, n in zip(corners, after, strict=True) if c[2] or _apart(c, n)))


def _apart(one: tuple[float, float, float], other: tuple[float, float, float]) -> bool:
    return (mm(one[0]), mm(one[1])) != (mm(other[0]), mm(other[1]))


def slot_profile(box: Box) -> Profile:
    """Return a slot that fills a box, its two short ends round; one that is as long as it is wide is a circle."""
    x0, y0, x1, y1 = box
    r = min(x1 - x0, y1 - y0) / 2
    if (mm(x0 + r), mm(y0 + r)) == (mm(x1 - r), mm(y1 - r)):
        return rounded(box, r)
    if y1 - y0 >= x1 - x0:
        return Profile(((x0, y0 + r, 1.0), (x1, y0 + r, 0.0), (x1, y1 - r, 1.0), (x0, y1 - r, 0.0)))
    return Profile(((x0 + r, y0, 0.0), (x1 - r, y0, 1.0), (x1 - r, y1, 0.0), (x0 + r, y1, 1.0)))


BESIDE_SLOT = 2.0
"""From a strap slot to a round corner, at least, mm."""

LEAST_THICKNESS = 0.5
"""Of a sheet, mm."""
HOLD_MM = 0.2
"""Default difference of the radii of unit and pocket, mm."""
MOST_HOLD = 0.25
"""Hoop strain of a pocket round its unit, at most (assumed)."""
BUCKLES = "assumed: a sheet stretched further buckles, and squeezes the unit out of round"


def middle_radius(asked: AskedArray, way: Construction, units: list[Spec]) -> float | None:
    """Return the radius of the sheet's middle round the limb, mm; None if the array is worn flat."""
    if asked.limb.radius_mm is None:
        return None
    level = way.level(_distinct(units), _thickness(asked, way, _distinct(units)), asked.limb.radius_mm)
    return asked.limb.radius_mm + (mm(level.low) + mm(level.high)) / 2


def _distinct(units: list[Spec]) -> tuple[Spec, ...]:
    return tuple({id(unit): unit for unit in units}.values())


def _thickness(asked: AskedArray, way: Construction, units: tuple[Spec, ...]) -> float:
    """Return the sheet's thickness; if none is asked for, the construction's, or as much as there is room for."""
    if asked.sheet.thickness_mm is not None:
        return asked.sheet.thickness_mm
    most = down(way.level(units, way.thickness_mm, asked.limb.radius_mm).most)
    return min(way.thickness_mm, most) if most >= LEAST_THICKNESS else way.thickness_mm


def sheet_of(asked: AskedArray, way: Construction, points: list[Point], units: list[Spec]) -> Sheet:
    """Return the sheet. Raises Refusal for a thickness, length, corner or slot that does not fit."""
    table, distinct = asked.sheet, _distinct(units)
    thickness = _thickness(asked, way, distinct)
    known = catalogue.materials({name: entry for unit in distinct for name, entry in unit.materials.items()})
    material = table.material or distinct[0].layers[-1].material
    catalogue.choose("sheet.material", material, known)
    hold = HOLD_MM if table.hold_mm is None else table.hold_mm
    level = way.level(distinct, thickness, asked.limb.radius_mm)
    if thickness > level.most + 1e-9:
        limit = f"between the units' tails and backs there is room for a sheet of {level.most:.4g} mm"
        raise Refusal(
            "sheet.thickness_mm", thickness, limit, down(level.most) if level.most >= LEAST_THICKNESS else None
        )
    if way.own_tails:
        _check_hold(hold, distinct, float(known[material].elongation_pct))
    elif table.hold_mm is not None:
        raise Refusal("sheet.hold_mm", table.hold_mm, f"{asked.array} has no pockets for units: leave it out")
    margin = table.margin_mm
    radii = [unit.diameter_mm / 2 for unit in units]
    x0 = min(p.x - r for p, r in zip(points, radii, strict=True)) - margin
    x1 = max(p.x + r for p, r in zip(points, radii, strict=True)) + margin
    y0 = min(p.y - r for p, r in zip(points, radii, strict=True)) - margin
    y1 = max(p.y + r for p, r in zip(points, radii, strict=True)) + margin
    slots: tuple[Box, ...] = ()
    if table.strap_slot_mm:
        width, length = table.strap_slot_mm
        _check_post(table.strap_slot_mm, units[0])
        most = y1 - y0 - 2 * table.strap_web_mm
        if length > most + 1e-9:
            limit = f"across the sheet of {y1 - y0:.4g} mm, with webs of {table.strap_web_mm:g} mm, a slot is at most"
            nearest = down(most) if most >= 0.1 else None
            raise Refusal("sheet.strap_slot_mm.1", length, f"{limit} {max(most, 0):.4g} mm long", nearest)
        middle = (y0 + y1) / 2
        ends = mm(middle - length / 2), mm(middle + length / 2)
        slots = (
            (mm(x0 - width), ends[0], mm(x0), ends[1]),
            (mm(x1), ends[0], mm(x1 + width), ends[1]),
        )
        x0, x1 = x0 - width - table.strap_web_mm, x1 + width + table.strap_web_mm
    outline = mm(x0), mm(y0), mm(x1), mm(y1)
    check_length(asked, points, outline)
    return Sheet(
        material=material,
        low=mm(level.low),
        high=mm(level.high),
        margin_mm=margin,
        corner_mm=_corner(table.corner_mm, min(radii) + margin, outline, slots),
        outline=outline,
        strap_slots=slots,
        hold_mm=hold,
    )


def _check_post(slot: tuple[float, float], unit: Spec) -> None:
    """Raise Refusal for a strap slot that is formed by a post thinner than the tools' least wall."""
    least = unit.moulds.least_wall_mm
    for i, size in enumerate(slot):
        if size < least - 1e-9:
            limit = f"a post of the tools forms the slot, and no wall of them is thinner than {least:g} mm "
            raise Refusal(f"sheet.strap_slot_mm.{i}", size, f"{limit}(moulds.least_wall_mm)", up(least))


def _check_hold(hold: float, units: tuple[Spec, ...], elongation_pct: float) -> None:
    """Raise Refusal for pockets that would stretch beyond the margin on the sheet's elongation."""
    for unit in units:
        torn = unit.casting.strain_margin * elongation_pct / 100
        allowed = min(torn, MOST_HOLD)
        most = unit.diameter_mm / 2 * allowed / (1 + allowed)
        if hold > most + 1e-9:
            why = "casting.strain_margin of the elongation at break" if torn <= MOST_HOLD else BUCKLES
            limit = (
                f"round a unit of {unit.diameter_mm:g} mm a pocket may stretch by {allowed:.0%} ({why}), so it is "
                f"smaller in radius by at most {down(most):g} mm"
            )
            raise Refusal("sheet.hold_mm", hold, limit, down(most))


def _corner(asked: float | None, most: float, outline: Box, slots: tuple[Box, ...]) -> float:
    """Return the radius of the corners: at most concentric with a corner's unit, and clear of a strap slot."""
    radius = min(most, asked) if asked is not None else most
    while radius > 0.5 and _to_corner(radius, outline, slots) < BESIDE_SLOT:
        radius -= 1 / 16
    radius = down(radius)
    if asked is not None and asked > radius + 1e-9:
        limit = f"keeping the margin round the units and the strap slots, corners are at most {radius:g} mm round"
        raise Refusal("sheet.corner_mm", asked, limit, radius)
    return radius


def _to_corner(radius: float, outline: Box, slots: tuple[Box, ...]) -> float:
    """Return the least distance from a strap slot's corner to a round corner of the sheet, mm."""
    least = math.inf
    for slot in slots:
        x = outline[2] - slot[2] if slot[0] > (outline[0] + outline[2]) / 2 else slot[0] - outline[0]
        y = slot[1] - outline[1]
        if x < radius and y < radius:
            least = min(least, radius - math.hypot(radius - x, radius - y))
    return least


LONGEST = 1500.0
"""Of a sheet along x and along y, mm: lines that cut its tools begin and end 1 m from its middle."""


def check_length(asked: AskedArray, points: Sequence[Point], outline: Box) -> None:
    """Raise Refusal for a sheet that is too long: for the key with most of its length, with the value that fits."""
    for axis, ways in enumerate(zip(*((point.x, point.y) for point in points), strict=True)):
        length = outline[axis + 2] - outline[axis]
        over, span = length - LONGEST, max(ways) - min(ways)
        if over <= 2 / 1024:
            continue
        limit = f"the sheet would be {length:.5g} mm long along {'xy'[axis]}; it is at most {LONGEST:g} mm"
        field, value = max(_beside(asked, axis), key=lambda each: each[1])
        if span >= 2 * value:
            field, value, more = _of_layout(asked, axis, span)
        else:
            more = 2.0
        nearest = down(value - over / more) if more else 0.0
        raise Refusal(field, value, limit, nearest if nearest > 0 else None)


def _beside(asked: AskedArray, axis: int) -> list[tuple[str, float]]:
    """Return the sheet's ends along an axis: field and value, mm."""
    sheet = asked.sheet
    found = [("sheet.margin_mm", sheet.margin_mm)]
    if sheet.strap_slot_mm and axis == 0:
        found += [("sheet.strap_web_mm", sheet.strap_web_mm), ("sheet.strap_slot_mm.0", sheet.strap_slot_mm[0])]
    return found


def _of_layout(asked: AskedArray, axis: int, span: float) -> tuple[str, float, float]:
    """Return a layout's field, its value, and how much longer (mm) a unit more of it makes the span of the places."""
    layout = asked.layout
    if layout["kind"] == "list":
        return "layout.points_mm", round(span, 3), 0.0
    if layout["kind"] == "ring":
        if axis == 0:
            return "limb.radius_mm", asked.limb.radius_mm or 0.0, 2 * math.pi * (1 - 1 / layout["count"])
        pitch, field = layout["band_pitch_mm"], "layout.band_pitch_mm"
    else:
        pitch, field = layout["pitch_mm"], "layout.pitch_mm"
        if not isinstance(pitch, int | float):
            pitch, field = pitch[axis], f"{field}.{axis}"
    return field, pitch, span / pitch
