"""What of a unit's motion reaches a neighbour: the skin there over the skin at the unit's edge, with a range."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from unitcad.attenuation.inputs import Drive, EstimateInput, Quantity, body
from unitcad.attenuation.layered.loads import UniformDisc
from unitcad.attenuation.layered.response import components

RANGE = (
    "moduli, damping and thicknesses of the body and the frequency to either end of their ranges, one kind at a time"
)
Reading = Literal["u", "u_z"]
_RTOL = 1e-3


def crosstalk_ratio(variant: EstimateInput, pitch: float, spread: bool = True) -> Quantity:
    """Return |u| of the bare skin at `pitch` (m) from the unit's middle over |u| at its edge, under its motor's drive.

    The layered half-space's own decay; the unit and its neighbour are not on it. low and high: `RANGE`, without
    `spread` none. Raises `Refusal` for values that no body has.
    """

    def ratio(end: dict[str, int]) -> float:
        return float(decay(variant, np.array([pitch]), end=end)[0])

    value = ratio({})
    if not spread:
        return Quantity(value)
    others = [ratio(end) for end in ends(variant)]
    return Quantity(value, min(value, *others), max(value, *others))


def ends(variant: EstimateInput) -> list[dict[str, int]]:
    """Return what `RANGE` names, each kind at its low and its high end, as `decay` takes it."""
    ranged = variant.frequency.ends[0] < variant.frequency.ends[1]
    kinds = ["moduli", "damping", "thicknesses", *(["frequency"] if ranged else [])]
    return [{kind: end} for kind in kinds for end in (0, 1)]


def decay(
    variant: EstimateInput,
    radii: np.ndarray,
    drive: Drive | None = None,
    hertz: float | None = None,
    end: Mapping[str, int] | None = None,
    reading: Reading = "u",
) -> np.ndarray:
    """Return the bare skin's motion at `radii` (m, any shape) from a unit's middle, over that at its edge.

    `drive`, `hertz`: else the motor's own and the unit's frequency; `end` as `inputs.body` has it, and "frequency".
    `reading`: |u| (`curve.WHAT_U_IS`), or |u_z| alone. Radii inside the edge are given too: they are the bare skin's.
    One response serves all radii. Raises `Refusal` for values that no body has.
    """
    end = dict(end or {})
    if hertz is None:
        hertz = variant.frequency.ends[end["frequency"]] if "frequency" in end else variant.frequency.middle
    radius, wanted = variant.diameter / 2.0, np.asarray(radii, dtype=float)
    load = UniformDisc(variant.motor_diameter / 2.0, "tangential" if (drive or variant.drive) == "flat" else "normal")
    omega = 2.0 * np.pi * hertz
    found = components(body(variant.tissue, end), load, omega, np.append(wanted.ravel(), radius), _RTOL)
    size = np.abs(found[2]) if reading == "u_z" else np.linalg.norm(found, axis=0)
    return (size[:-1] / size[-1]).reshape(wanted.shape)
