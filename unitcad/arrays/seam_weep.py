"""The silicone that the seams of an array's tool take from its sheet, worked out before a tool is drawn.

Mould check C250 measures it on the meshes. An array that would break its limit is refused with the bed that would do.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from unitcad.arrays.array import Array, Box
from unitcad.arrays.outlines import rounded, slot_profile
from unitcad.checks.seam import WEEP
from unitcad.moulds.dovetails import Seam, length

ROUNDING = 0.97
"""Of the limit, at most: lengths stand for what the check measures on the meshes, which is within 3 % of it."""


def sheet_mm2(array: Array) -> float:
    """Return the area of a sheet without its strap slots, mm2."""
    sheet = array.sheet
    return rounded(sheet.outline, sheet.corner_mm).area - sum(slot_profile(slot).area for slot in sheet.strap_slots)


def weep(array: Array, seams: Sequence[Seam], outline: Box, heights: tuple[float, float]) -> float:
    """Return what a tool's seams hold, mm3. `heights` of what is cut within the sheet and beside it, mm."""
    x0, y0, x1, y1 = array.sheet.outline
    total = 0.0
    for seam in seams:
        low, high = (y0, y1) if seam.across == "x" else (-x1, -x0)
        whole = outline[3] - outline[1] if seam.across == "x" else outline[2] - outline[0]
        total += seam.play * (heights[0] * length(seam, low, high) + heights[1] * (whole - (high - low)))
    return total


def too_much(
    array: Array, outline: Box, heights: tuple[float, float], layer_mm3: float
) -> Callable[[Sequence[Seam]], str]:
    """Return what says why seams take more of a layer's volume than C250 lets them, "" where they do not.

    `outline` and `heights` as those of `weep`.
    """

    def fault(seams: Sequence[Seam]) -> str:
        taken, limit = weep(array, seams, outline, heights), ROUNDING * WEEP * layer_mm3
        text = f"the seams of so many pieces would take {taken:.0f} mm3 of silicone; at most {limit:.0f} mm3 may"
        return text if taken > limit else ""

    return fault
