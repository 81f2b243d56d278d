"""How the silicone of a curved mould is peeled off its base: each unit along its own axis, then the sheet between."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from unitcad.arrays.array import Array
from unitcad.arrays.limb_frame import axis, bent, slice_of
from unitcad.designs import dimensions
from unitcad.moulds.removal import CAST, Removal
from unitcad.shape import cylinder

BESIDE = 1 / 4
"""How far the space about a unit reaches beyond it, mm."""


def parts_out(array: Array) -> Iterator[Removal]:
    """Yield the removals of the silicone: each unit along its axis, then the sheet in slices about the limb.

    A slice is that part of the sheet that is nearest to a column of units, or to a strap slot.
    """
    sheet = array.sheet
    outer = dimensions(array.unit).outer_radius + BESIDE
    for place in array.places:
        about = bent(array, cylinder(outer, -1.0, sheet.high + outer), place.x, place.y)
        yield Removal(CAST, axis(array, place.x), f"at {place.name}", about)
    middles = sorted({place.x for place in array.places} | {(slot[0] + slot[2]) / 2 for slot in sheet.strap_slots})
    between = [(a + b) / 2 for a, b in pairwise(middles)]
    bounds = [2 * sheet.outline[0] - middles[0], *between, 2 * sheet.outline[2] - middles[-1]]
    for i, (x, ends) in enumerate(zip(middles, pairwise(bounds), strict=True)):
        # The last one takes what rounding leaves.
        space = slice_of(array, *ends) if i + 1 < len(middles) else None
        yield Removal(CAST, axis(array, x), f"between the units, {x:+.4g} mm round", space)
