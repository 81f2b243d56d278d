"""C410: the opening through which a cavity is filled and vented has a least size.

C400 asks whether air finds its way to the opening; a dome whose only opening is a point lets it, and can't be poured.
The opening is the cavity's section just under the rim, or under the lid's upper face: there sprue and vents are regions
of their own, and the widest one is filled. Narrowest width: the diameter of the largest circle that fits.
"""

from __future__ import annotations

from collections.abc import Iterator

from unitcad.checks.finding import MouldCheck, MouldFinding, at_least
from unitcad.moulds.cavities import Cavity
from unitcad.moulds.complement import LEAST_AREA, LEAST_WIDTH, regions
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.profile import GRID_PER_MM

_SNAPPED = 1 / GRID_PER_MM
"""Height that snapping to the grid may take from that plane, mm."""


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Measure the opening of every cavity, and the narrowest of its vents under a lid."""
    return (finding for cavity in moulds.cavities for finding in _of_cavity(cavity))


def _of_cavity(cavity: Cavity) -> Iterator[MouldFinding]:
    step, where = cavity.step, cavity.where
    closed = step.injected
    opening = "sprue" if closed else "opening at the rim"
    top = max(cavity.reached.bounding_box()[5], step.top - _SNAPPED)
    openings = regions(cavity.reached, top)
    width, area = openings[-1] if openings else (0.0, 0.0)
    advice = f"at z = {step.top:.4g} mm there is no room to pour: give the layer a flat top, or turn it over"
    yield at_least("C410", f"{where}: {opening}, area", area, LEAST_AREA, "mm2", advice)
    yield at_least("C410", f"{where}: {opening}, width", width, LEAST_WIDTH, "mm", advice)
    if closed:
        vent = openings[0][0] if len(openings) > 1 else 0.0
        yield at_least(
            "C410", f"{where}: narrowest vent", vent, LEAST_WIDTH, "mm", "a closed mould needs vents of that width"
        )


CHECK = MouldCheck("C410", "opening: sprues, vents and open rims are wide enough for silicone and air", findings)
