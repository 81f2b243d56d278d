"""Crosstalk, a unit's motion at a neighbour: the skin there over the skin at the unit's edge, with a range."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from unitcad.attenuation.inputs import Drive, EstimateInput, Quantity, body
from unitcad.attenuation.layered.loads import UniformDisc
from unitcad.attenuation.layered.response import components

RANGE = (
    "moduli, damping and thicknesses of the body and the frequency to either end of their ranges, one kind at a time; "
    "and what a unit on the skin changes, bonded or resting, by finite elements (`CONTACT`)"
)
CONTACT_MM = (0.0, 2.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0)
CONTACT: dict[Drive, tuple[tuple[float, ...], tuple[float, ...]]] = {
    "flat": ((1.0, 0.82, 0.66, 0.48, 0.34, 0.23, 0.19, 0.14), (1.0,) * 8),
    "axial": ((1.0, 0.83, 0.84, 0.9, 0.9, 0.9, 0.9, 0.9), (1.0, 1.0, 1.05, 1.47, 1.5, 1.5, 1.58, 2.14)),
}
"""Factors between |u| over that at the edge and bare skin's, least and largest, at `CONTACT_MM` from the edge.

Finite elements of the paper's two designs with four pairs of silicones each, skin that sticks to the unit or lets it
slide, 100 to 150 Hz, against the layered solver (`python -m benchmarks.accuracy skin` makes them again).
"""
Reading = Literal["u", "u_z"]
_RTOL = 1e-3


def crosstalk_ratio(variant: EstimateInput, pitch: float, spread: bool = True) -> Quantity:
    """Return |u| of the bare skin at `pitch` (m) from the unit's middle over |u| at its edge, under its motor's drive.

    The layered half-space's own decay. low and high: `RANGE`, without `spread` none. Raises `Refusal` for values that
    no body has.
    """

    def ratio(end: dict[str, int]) -> float:
        return float(decay(variant, np.array([pitch]), end=end)[0])

    value = ratio({})
    if not spread:
        return Quantity(value)
    every = [value, *(ratio(end) for end in ends(variant))]
    low, high = (float(factor) for factor in contact(variant.drive, 1e3 * (pitch - variant.diameter / 2.0)))
    return Quantity(value, low * min(every), high * max(every))


def contact(drive: Drive, mm: float | np.ndarray) -> tuple[Any, Any]:
    """Return the least and the largest factor of `CONTACT` at distances from a unit's edge, mm; 1 inside it."""
    low, high = (np.interp(mm, CONTACT_MM, factors) for factors in CONTACT[drive])
    return low, high


def ends(variant: EstimateInput) -> list[dict[str, int]]:
    """Return the inputs that `RANGE` names, each kind at its low and its high end, as `decay` takes it."""
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
