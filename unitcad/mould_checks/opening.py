"""C410: the opening through which a cavity is filled and vented has a least size.

C400 asks whether air finds its way to the opening; a dome whose only opening is a point lets it, and can't be poured.
The opening is the cavity's section just under the rim, or under the lid's upper face: there sprue and vents are regions
of their own, and the widest one is filled. Narrowest width: the diameter of the largest circle that fits.
"""

from __future__ import annotations

from collections.abc import Iterator

from unitcad.kernels.sections import widest
from unitcad.mould_checks.check import MouldCheck
from unitcad.mould_checks.finding import MouldFinding, at_least
from unitcad.moulds.cavities import Cavity
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.profile import GRID_PER_MM

LEAST_AREA = 2.0
"""Of an opening that silicone is poured or injected into, mm2 (assumed): a thread or a needle of 1.6 mm."""
LEAST_WIDTH = 0.4
"""Of that opening, and of a vent, mm (assumed): less than the thinnest wall that a spec may have."""
_UNDER = 1 / 4096
"""How far under the plane of the opening the section lies, mm."""
_SNAPPED = 1 / GRID_PER_MM
"""What snapping to the grid may take from the height of that plane, mm."""


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Measure the opening of every cavity, and the narrowest of its vents under a lid."""
    for cavity in moulds.cavities:
        yield from _of_cavity(cavity)


def _of_cavity(cavity: Cavity) -> Iterator[MouldFinding]:
    step, where = cavity.step, cavity.where
    opening = "sprue" if step.lid else "opening at the rim"
    top = max(cavity.reached.bounding_box()[5], step.top - _SNAPPED)
    regions = sorted((widest(part)[0], part.area()) for part in cavity.reached.slice(top - _UNDER).decompose())
    width, area = regions[-1] if regions else (0.0, 0.0)
    advice = f"at z = {step.top:.4g} mm there is no room to pour: give the layer a flat top, or turn it over"
    yield at_least("C410", f"{where}: {opening}, area", area, LEAST_AREA, "mm2", advice)
    yield at_least("C410", f"{where}: {opening}, width", width, LEAST_WIDTH, "mm", advice)
    if step.lid:
        vent = regions[0][0] if len(regions) > 1 else 0.0
        yield at_least("C410", f"{where}: narrowest vent", vent, LEAST_WIDTH, "mm", "a lid needs vents of that width")


CHECK = MouldCheck(
    "C410", "opening: what a cavity is filled and vented through is wide enough for silicone and air", findings
)
