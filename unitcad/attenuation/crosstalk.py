"""What of a unit's motion reaches a neighbour: the skin there over the skin at the unit's edge, with a range."""

from __future__ import annotations

import numpy as np

from unitcad.attenuation.inputs import EstimateInput, Quantity, body
from unitcad.attenuation.layered.loads import UniformDisc

RANGE = (
    "moduli, damping and thicknesses of the body and the frequency to either end of their ranges, one kind at a time"
)
_RTOL = 1e-3


def crosstalk_ratio(variant: EstimateInput, pitch: float, spread: bool = True) -> Quantity:
    """Return |u| of the bare skin at `pitch` (m) from the unit's middle over |u| at its edge, under its motor's drive.

    The layered half-space's own decay; the unit and its neighbour are not on it. low and high: `RANGE`, without
    `spread` none. Raises `Refusal` for values that no body has.
    """
    direction = "tangential" if variant.drive == "flat" else "normal"
    load = UniformDisc(variant.motor_diameter / 2.0, direction)
    radii = np.array([variant.diameter / 2.0, pitch])

    def ratio(end: dict[str, int]) -> float:
        hertz = variant.frequency.ends[end["frequency"]] if "frequency" in end else variant.frequency.middle
        found = body(variant.tissue, end).response(load, 2.0 * np.pi * hertz, radii, rtol=_RTOL)
        size = np.sqrt(np.abs(found.u_r) ** 2 + np.abs(found.u_theta) ** 2 + np.abs(found.u_z) ** 2)
        return float(size[1] / size[0])

    value = ratio({})
    if not spread:
        return Quantity(value)
    ranged = variant.frequency.ends[0] < variant.frequency.ends[1]
    kinds = ["moduli", "damping", "thicknesses", *(["frequency"] if ranged else [])]
    others = [ratio({kind: end}) for kind in kinds for end in (0, 1)]
    return Quantity(value, min(value, *others), max(value, *others))
