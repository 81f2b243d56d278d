"""Which limbs a curved mould can be made for: it prints without support, units stand apart, air finds the vents."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import combinations

from unitcad.arrays.array import Array
from unitcad.errors import Refusal
from unitcad.moulds.dents import TILT_DEG
from unitcad.spec import printer_of

MOST_DEG = 75.0
"""Of the sheet's ends from the top, at most (assumed): beyond it lid and base slide on each other as they close."""
LARGEST = 1000.0
"""Radius of a limb, at most, mm."""
_STEP = 0.1


def check_limb(array: Array, apart: float, middle: Callable[[float], float]) -> None:
    """Raise Refusal for a limb too small or too large, with the nearest radius that fits.

    `apart`: between two units' feet, mm. `middle`: from the limb's radius to that of the sheet's middle, mm.
    """
    radius = array.radius_mm or 0.0
    _check_vents(array, radius, middle)
    if not (why := _too_small(array, radius, apart, middle(radius))):
        return
    radii = (tenth * _STEP for tenth in range(math.ceil(radius / _STEP + 1e-9), round(LARGEST / _STEP) + 1))
    fits = next((each for each in radii if not _too_small(array, each, apart, middle(each))), None)
    if fits is None or middle(fits) > _largest_middle(array) or array.layout["kind"] == "ring":
        raise Refusal("body.cast", "curved", f"{why}; cast it flat and bend it", "flat")
    raise Refusal("body.radius_mm", radius, why, round(fits, 1))


def _check_vents(array: Array, radius: float, middle: Callable[[float], float]) -> None:
    """Raise Refusal for a limb so large that a tilt of the mould brings the highest line off the sheet, and its vents.

    `middle` as in `check_limb`.
    """
    largest = _largest_middle(array)
    if middle(radius) <= largest:
        return
    end = math.degrees(largest / middle(radius)) * math.radians(TILT_DEG)
    why = (
        f"the sheet reaches {end:.3g} degrees from the top, and a mould tilted by {TILT_DEG:g} degrees keeps air at "
        "its ends; cast it flat and bend it"
    )
    fits = math.floor(min(radius, largest) / _STEP)
    while middle(fits * _STEP) > largest:
        fits -= 1
    raise Refusal("body.radius_mm", radius, why, round(fits * _STEP, 1))


def _largest_middle(array: Array) -> float:
    """Return the radius of the sheet's middle with which its nearer end lies in the tilt from the top, mm."""
    return min(-array.sheet.outline[0], array.sheet.outline[2]) / math.radians(TILT_DEG)


def _too_small(array: Array, radius: float, apart: float, middle: float) -> str:
    """Return what speaks against a limb of a radius, where the sheet's middle has the radius `middle` (mm), or ""."""
    sheet = array.sheet
    steepest = float(printer_of(array.unit).overhang_deg)
    places = [place.x for place in array.places] + [(slot[0] + slot[2]) / 2 for slot in sheet.strap_slots]
    tilt = math.degrees(max(map(abs, places)) / middle)
    if tilt > steepest + 1e-9:
        return f"the outermost unit or slot is tilted by {tilt:.3g} degrees; from {steepest:g} on it needs support"
    end = math.degrees(max(-sheet.outline[0], sheet.outline[2]) / middle)
    if end > MOST_DEG + 1e-9:
        return f"the sheet reaches {end:.3g} degrees from the top; lid and base close up to {MOST_DEG:g}"
    for one, other in combinations(array.places, 2):
        outer, turn = one.radius + other.radius, abs(other.x - one.x) / middle / 2
        if turn >= math.pi / 2 or abs(other.y - one.y) > outer + apart:
            continue
        across, along = 2 * radius * math.sin(turn), other.y - one.y
        distance = math.hypot(across, along)
        # Seen along the axis between the two, each unit's foot is an ellipse.
        gap = distance - outer * math.hypot(math.cos(turn) * across, along) / distance
        if gap < apart - 2 / 1024:
            there = f"{gap:.3g}" if gap < apart - 0.05 else f"{gap:.5g}"
            return f"at the skin {one.name} and {other.name} stand {there} mm apart and need {apart:.4g} mm"
    return ""
