"""Plane outlines of a sheet: rounded boxes and slots (mm)."""

from __future__ import annotations

import math

from unitcad.arrays.array import Box
from unitcad.shape import Profile, mm

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
    """Return a slot that fills a box, its two short ends round."""
    x0, y0, x1, y1 = box
    if mm(x1 - x0) == mm(y1 - y0):
        return rounded(box, (x1 - x0) / 2)
    if y1 - y0 >= x1 - x0:
        r = (x1 - x0) / 2
        return Profile(((x0, y0 + r, 1.0), (x1, y0 + r, 0.0), (x1, y1 - r, 1.0), (x0, y1 - r, 0.0)))
    r = (y1 - y0) / 2
    return Profile(((x0 + r, y0, 0.0), (x1 - r, y0, 1.0), (x1 - r, y1, 0.0), (x0 + r, y1, 1.0)))
