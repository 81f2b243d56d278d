"""The map of the skin's motion under an array: its units at their places along the skin."""

from __future__ import annotations

import math

from unitcad.arrays.array import Array
from unitcad.skin_map import SHARE, SkinMap, skin_map


def array_map(array: Array, threshold_um: float | None = None, share: float = SHARE) -> SkinMap:
    """Return the map of an array; x is along the skin, unrolled if the array is worn around a limb.

    Raises `Refusal` as `skin_map.skin_map`.
    """
    along, turn = 1.0, None
    if array.radius_mm is not None and array.middle_radius_mm is not None:
        # Places are as far apart as they are in the sheet's middle; the skin under it has the shorter arc.
        along, turn = array.radius_mm / array.middle_radius_mm, 2.0 * math.pi * array.radius_mm
    x0, y0, x1, y1 = array.sheet.outline
    placed = [(place.name, along * place.x, place.y, place.unit) for place in array.places]
    return skin_map(array.name, placed, (along * x0, y0, along * x1, y1), turn, None, threshold_um, share)
