"""Where a unit stands round the limb as the array is worn, and as a curved mould casts it.

The limb's axis lies along y, at z = -R: z = 0 is the skin on top. What is drawn about the z axis, with the skin at
z = 0, is turned as a whole about the limb's axis: x of the flat frame becomes the angle x over the radius of the
sheet's middle.
"""

from __future__ import annotations

import math

from unitcad.arrays.array import Array, Box, Placed
from unitcad.arrays.outlines import slot_profile
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
    """Return what is drawn about the z axis as it stands at a place of the flat frame (mm)."""
    radius = array.radius_mm or 0.0
    return moved(rotated(moved(shape, 0.0, y, radius), "y", angle_deg(array, x)), z=-radius)


def at_place(array: Array, shape: Shape, place: Placed) -> Shape:
    """Return what is drawn about the z axis at its place in the frame that the silicone is cast in."""
    if array.cast == "curved":
        return bent(array, shape, place.x, place.y)
    return moved(shape, place.x, place.y)


def barrel(array: Array, radius: float) -> Shape:
    """Return the cylinder of a radius about the limb's axis (mm)."""
    return moved(turned(cylinder(radius, -LENGTH, LENGTH), "x", 1), z=-(array.radius_mm or 0.0))


def slice_of(array: Array, first: float, last: float) -> Shape:
    """Draw all that lies between two places of the flat frame (mm), planes through the limb's axis."""
    reach = 2 * array.back_radius_mm
    turns = (math.radians(angle_deg(array, x)) for x in (last, first))
    corners = ((reach * math.sin(turn), reach * math.cos(turn)) for turn in turns)
    drawn = Extrude(polygon((0, 0), *corners), -LENGTH, LENGTH)
    return moved(turned(drawn, "x", 1), z=-(array.radius_mm or 0.0))


def inside_of_end(array: Array, *, left: bool) -> Shape:
    """Draw all that lies on the sheet's side of its left or right end: a plane through the axis, with round corners."""
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
