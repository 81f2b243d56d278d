"""Arrays round a limb: the frame of the limb, and the strain of the sheet when it bends."""

from __future__ import annotations

import math
from dataclasses import dataclass

from unitcad.arrays.array import Array, Box, Placed
from unitcad.arrays.sheet import slot_profile
from unitcad.shape import Extrude, Profile, Shape, cylinder, mm, moved, polygon, rotated, turned

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
    r, far, quarter = sheet.corner_mm, 3 * array.back_radius_mm, math.tan(math.pi / 8)
    corners = [(-far, y0, 0.0), (-r, y0, quarter), (0.0, y0 + r, 0.0), (0.0, y1 - r, quarter)]
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


@dataclass(frozen=True)
class Bending:
    """An array bent round its limb; lengths in mm, strains as shares (1 is 100 %).

    middle_radius  of the sheet's middle, which keeps its length; the ring round the limb is closed at 2 pi times it
    ends           from one end of the sheet to the other, round the limb, along its middle
    strain         of the sheet's two faces if it bends equally everywhere
    strain_between the same if the units stay flat and only the sheet between them bends; None if units touch all the
    way sagitta        from the limb's skin to a unit's, at the edge of a unit that stays flat and touches in its middle
    """

    radius: float
    middle_radius: float
    closed: float
    ends: float
    strain: float
    strain_between: float | None
    sagitta: float

    @property
    def most(self) -> float:
        """The larger of the two strains."""
        return max(self.strain, self.strain_between or 0.0)


def bending(array: Array) -> Bending | None:
    """Return how an array bends round its limb; None if it is worn flat."""
    radius, middle = array.radius_mm, array.middle_radius_mm
    if radius is None or middle is None:
        return None
    sheet, widest = array.sheet, max(place.radius for place in array.places)
    strain, free = sheet.thickness_mm / 2 / middle, _free(array)
    return Bending(
        radius=radius,
        middle_radius=middle,
        closed=2 * math.pi * middle,
        ends=2 * math.pi * middle - (sheet.outline[2] - sheet.outline[0]),
        strain=strain,
        strain_between=strain / free if free else None,
        sagitta=radius - math.sqrt(radius**2 - widest**2) if widest < radius else radius,
    )


def bent_stretches(array: Array) -> tuple[tuple[str, float], ...]:
    """Return the layers of a plan that stretch as the array is bent, or laid flat, and their strains in percent."""
    bent = bending(array)
    if not bent:
        return ()
    where = f"sheet bent round {bent.radius:g} mm" if array.cast == "flat" else "sheet laid flat for its circuit"
    return ((where, 100 * bent.most),)


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
