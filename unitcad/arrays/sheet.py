"""The sheet of an array: its outline, its lengths on the bed; the frame of its limb, and the strain when it bends.

The overflow grooves round the bores of a back sheet's cups: rings that stop before a wall gets too thin.

A groove ends square to its way. So its rest has its full width, and no slit stays between two stops.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from unitcad import catalogue
from unitcad.arrays.array import Array, Box, Placed, Sheet
from unitcad.arrays.array_tables import AskedArray
from unitcad.arrays.constructions import Construction
from unitcad.arrays.layouts import Point
from unitcad.designs.design import BEYOND
from unitcad.designs.limits import down, up
from unitcad.errors import Refusal
from unitcad.geometry.segments import Point as PlanePoint
from unitcad.moulds.cuts import Feature
from unitcad.moulds.layout import groove_depth_of
from unitcad.shape import Extrude, Profile, Shape, cut, cylinder, mm, moved, polygon, ring, rotated, turned
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
    apart = ((mm(c[0]), mm(c[1])) != (mm(n[0]), mm(n[1])) for c, n in zip(corners, after, strict=True))
    return Profile(tuple(corner for corner, far in zip(corners, apart, strict=True) if corner[2] or far))


def slot_profile(box: Box) -> Profile:
    """Return a slot that fills a box, its two short ends round; one that is as long as it is wide is a circle."""
    x0, y0, x1, y1 = box
    r = min(x1 - x0, y1 - y0) / 2
    if (mm(x0 + r), mm(y0 + r)) == (mm(x1 - r), mm(y1 - r)):
        return rounded(box, r)
    if y1 - y0 >= x1 - x0:
        return Profile(((x0, y0 + r, 1.0), (x1, y0 + r, 0.0), (x1, y1 - r, 1.0), (x0, y1 - r, 0.0)))
    return Profile(((x0 + r, y0, 0.0), (x1 - r, y0, 1.0), (x1 - r, y1, 0.0), (x0 + r, y1, 1.0)))


def draw_sheet(sheet: Sheet, low: float, high: float) -> Extrude:
    """Draw a sheet from z to z, without its strap slots."""
    return Extrude(rounded(sheet.outline, sheet.corner_mm), low, high, tuple(map(slot_profile, sheet.strap_slots)))


def draw_groove(sheet: Sheet, spec: Spec, rim: float) -> Extrude:
    """Draw the overflow groove round a sheet, in a tool whose rim is at that height, mm."""
    land, width = spec.moulds.land_mm, spec.moulds.groove_width_mm
    inner, outer = (rounded(sheet.outline, sheet.corner_mm, by) for by in (land, land + width))
    return Extrude(outer, rim - groove_depth_of(spec, rim), rim + BEYOND, (inner,))


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
        stretch = catalogue.needed(known[material], "elongation_pct", "a limit of stretch")
        _check_hold(hold, distinct, float(stretch))
    elif table.hold_mm is not None:
        raise Refusal("sheet.hold_mm", table.hold_mm, f"{asked.array} has no pockets for units: leave it out")
    margin = table.margin_mm
    at, radii = np.array([(p.x, p.y) for p in points]), np.array([unit.diameter_mm / 2 for unit in units])
    x0, y0 = ((at - radii[:, None]).min(axis=0) - margin).tolist()
    x1, y1 = ((at + radii[:, None]).max(axis=0) + margin).tolist()
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
        corner_mm=_corner(table.corner_mm, float(radii.min()) + margin, outline, slots),
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
    """Raise Refusal for a sheet that is too long: for the key with most of its length."""
    for axis, ways in enumerate(zip(*((point.x, point.y) for point in points), strict=True)):
        length, span = outline[axis + 2] - outline[axis], max(ways) - min(ways)
        if length <= LONGEST + 2 / 1024:
            continue
        table = asked.sheet
        beside = [("sheet.margin_mm", table.margin_mm)]
        if table.strap_slot_mm and axis == 0:
            beside += [("sheet.strap_web_mm", table.strap_web_mm), ("sheet.strap_slot_mm.0", table.strap_slot_mm[0])]
        field, value = max(beside, key=lambda each: each[1])
        if span >= 2 * value:
            field, value = _of_layout(asked, axis, span)
        limit = f"the sheet would be {length:.5g} mm long along {'xy'[axis]}; it is at most {LONGEST:g} mm"
        raise Refusal(field, value, limit)


def _of_layout(asked: AskedArray, axis: int, span: float) -> tuple[str, float]:
    """Return the field of a layout that makes the `span` of its places along an axis, and its value."""
    layout = asked.layout
    if layout["kind"] == "list":
        return "layout.points_mm", round(span, 3)
    if layout["kind"] == "ring" and axis == 0:
        return "limb.radius_mm", asked.limb.radius_mm or 0.0
    if layout["kind"] == "ring":
        return "layout.band_pitch_mm", layout["band_pitch_mm"]
    pitch = layout["pitch_mm"]
    return ("layout.pitch_mm", pitch) if isinstance(pitch, int | float) else (f"layout.pitch_mm.{axis}", pitch[axis])


LENGTH = 1000.0
"""Of a cylinder about the limb's axis, on either side, mm: longer than any bed."""


def angle_deg(array: Array, x: float) -> float:
    """Return the angle about the limb's axis of a place of the flat frame (mm), from the top, clockwise along y."""
    return math.degrees(x / (array.middle_radius_mm or math.inf))


def axis(array: Array, x: float) -> tuple[float, float, float]:
    """Return the direction away from the limb at a place of the flat frame (mm)."""
    turn = math.radians(angle_deg(array, x))
    return math.sin(turn), 0.0, math.cos(turn)


def bent(array: Array, shape: Shape, x: float, y: float = 0.0) -> Shape:
    """Return a shape drawn about the z axis at a place of the flat frame (mm)."""
    radius = array.radius_mm or 0.0
    return moved(rotated(moved(shape, 0.0, y, radius), "y", angle_deg(array, x)), z=-radius)


def at_place(array: Array, shape: Shape, place: Placed) -> Shape:
    """Return a shape drawn about the z axis at its place in the frame of the casting."""
    if array.cast == "curved":
        return bent(array, shape, place.x, place.y)
    return moved(shape, place.x, place.y)


def barrel(array: Array, radius: float) -> Shape:
    """Return the cylinder of a radius about the limb's axis (mm)."""
    return moved(turned(cylinder(radius, -LENGTH, LENGTH), "x", 1), z=-(array.radius_mm or 0.0))


def slice_of(array: Array, first: float, last: float) -> Shape:
    """Draw all between two places of the flat frame (mm), planes through the limb's axis."""
    reach = 2 * array.back_radius_mm
    turns = (math.radians(angle_deg(array, x)) for x in (last, first))
    corners = ((reach * math.sin(turn), reach * math.cos(turn)) for turn in turns)
    drawn = Extrude(polygon((0, 0), *corners), -LENGTH, LENGTH)
    return moved(turned(drawn, "x", 1), z=-(array.radius_mm or 0.0))


def inside_of_end(array: Array, *, left: bool) -> Shape:
    """Draw all on the sheet's side of its left or right end: a plane through the axis, with round corners."""
    sheet = array.sheet
    x0, y0, x1, y1 = sheet.outline
    r, far = sheet.corner_mm, 3 * array.back_radius_mm
    corners = [(-far, y0, 0.0), (-r, y0, _QUARTER), (0.0, y0 + r, 0.0), (0.0, y1 - r, _QUARTER)]
    if mm(y0 + r) == mm(y1 - r):  # two corners that meet
        del corners[2]
    corners += [(-r, y1, 0.0), (-far, y1, 0.0)]
    if left:
        # Turned by half about the middle of the end.
        corners = [(-x, y0 + y1 - y, bulge) for x, y, bulge in corners]
    return bent(array, Extrude(Profile(tuple(corners)), -far, far), x0 if left else x1)


def strap_slot(array: Array, slot: Box, beyond: float) -> Shape:
    """Draw a strap slot's hole through the sheet, square to the limb in its middle, and `beyond` it by so much (mm)."""
    (x0, y0, x1, y1), sheet = slot, array.sheet
    half = (x1 - x0) / 2
    return bent(
        array,
        Extrude(slot_profile((-half, y0, half, y1)), sheet.low - sheet.thickness_mm - beyond, sheet.high + beyond),
        (x0 + x1) / 2,
    )


class Bending(NamedTuple):
    """An array bent round its limb; lengths in mm, strains as shares (1 is 100 %).

    middle_radius  of the sheet's middle, which keeps its length; the ring round the limb is closed at 2 pi times it
    ends           from one end of the sheet to the other, round the limb, along its middle
    strain         of the sheet's two faces if it bends equally everywhere
    strain_between the same if only the sheet between flat units bends; None if units touch all the way
    sagitta        from the limb's skin to a unit's, at the edge of a unit that stays flat and touches in its middle
    """

    middle_radius: float
    closed: float
    ends: float
    strain: float
    strain_between: float | None
    sagitta: float


def bending(array: Array) -> Bending | None:
    """Return how an array bends round its limb; None if it is worn flat."""
    radius, middle = array.radius_mm, array.middle_radius_mm
    if radius is None or middle is None:
        return None
    sheet, widest, closed = array.sheet, max(place.radius for place in array.places), 2 * math.pi * middle
    strain, free = sheet.thickness_mm / 2 / middle, _free(array)
    return Bending(
        middle_radius=middle,
        closed=closed,
        ends=closed - (sheet.outline[2] - sheet.outline[0]),
        strain=strain,
        strain_between=strain / free if free else None,
        sagitta=radius - math.sqrt(radius**2 - widest**2) if widest < radius else radius,
    )


def bent_stretches(array: Array) -> tuple[tuple[str, float], ...]:
    """Return the layers of a plan that stretch as the array is bent, or laid flat, and their strains in percent."""
    if not (bent := bending(array)):
        return ()
    flat = array.cast == "flat"
    where = f"sheet bent round {array.radius_mm:g} mm" if flat else "sheet laid flat for its circuit"
    return ((where, 100 * max(bent.strain, bent.strain_between or 0.0)),)


def bending_record(array: Array) -> dict[str, float | None] | None:
    """Return the same as JSON data, lengths in mm."""
    bent = bending(array)
    if bent is None:
        return None
    return {
        "middle_radius_mm": round(bent.middle_radius, 3),
        "closed_length_mm": round(bent.closed, 2),
        "between_ends_mm": round(bent.ends, 2),
        "strain": round(bent.strain, 4),
        "strain_units_flat": None if bent.strain_between is None else round(bent.strain_between, 4),
        "sagitta_mm": round(bent.sagitta, 3),
    }


def _free(array: Array) -> float:
    """Return the share of the way round, from the first unit's middle to the last one's, that no unit covers."""
    spans = sorted((place.x - place.radius, place.x + place.radius) for place in array.places)
    first, last = min(p.x for p in array.places), max(p.x for p in array.places)
    if last <= first:
        return 1.0
    free, reached = 0.0, first
    for low, high in spans:
        free += max(0.0, min(low, last) - reached)
        reached = max(reached, high)
    return free / (last - first)


TURN = 720
"""Sectors of a turn that a groove has or lacks."""
RINGS = 12
"""Circles on which a sector is compared with the stops."""


def stopped_ring(
    centre: PlanePoint, radii: tuple[float, float], heights: tuple[float, float], stops: Sequence[Feature]
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


def _meets(centre: PlanePoint, radii: tuple[float, float], stops: Sequence[Feature]) -> np.ndarray:
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
