"""How an array that is cast flat bends round a limb: the length that it keeps, its strain, a flat unit's sagitta.

The sheet bends about its own middle, which keeps its length: at the limb's radius plus the middle's height over the
skin. The skin's own arc under it is shorter by the ratio of the two radii.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from unitcad.arrays.array import Array


@dataclass(frozen=True)
class Bending:
    """An array bent round its limb; lengths in mm, strains as shares (1 is 100 %).

    middle_radius  of the sheet's middle, which keeps its length; the ring round the limb is closed at 2 pi times it
    ends           from one end of the sheet to the other, round the limb, along its middle
    strain         of the sheet's two faces where it bends alike everywhere
    strain_between the same where the units stay flat and the sheet between them bends alone; None where units lie
                   side by side all the way
    sagitta        from the limb's skin to a unit's, at the edge of a unit that stays flat and touches in its middle
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
    """Return how an array bends round its limb; None where it is worn flat."""
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
    """Return where a plan's silicone stretches as the array is bent, or laid flat, and by how many percent."""
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
