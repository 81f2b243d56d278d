"""The prior predictive range of a unit's levels: seeded draws of everything that is not known. JSON-ready data."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, get_args

import numpy as np

from unitcad.attenuation.inputs import EstimateInput
from unitcad.attenuation.mechanics.motor_level import Drive, Reading, level
from unitcad.attenuation.mechanics.unknowns import Draw, drawn

SEED, DRAWS, FINENESS = 1, 24, 1.0
PERCENT = (5, 50, 95)
NOT_KNOWN = (
    "moduli and damping of silicones and body, thicknesses of the body, frequency, mass of the motor; whether the ring "
    "of air beside the motor is filled, silicone lies under it, the circuit stiffens the unit, and whether skin sticks "
    "to the unit or lets it slide"
)
KIND = (
    "finite elements of unit and body, the motor a rigid body driven by a force: axial (along z) and flat (sideways); "
    "amplitude along the drive over the motor's, on the skin at r = D/2 and at the unit's own outer edge, at its top"
)


def range_block(
    variant: EstimateInput, draws: int = DRAWS, seed: int = SEED, say: Callable[[str], None] = lambda line: None
) -> dict[str, Any]:
    """Return {kind, not_known, draws, seed, fineness, percent, levels}: a range for each drive and reading.

    low, median and high are percentiles of the draws; median_error is the factor by which the median of other draws
    would differ (one standard deviation, by drawing them again with replacement). `drawn_as`: the level of the unit as
    its spec draws it, bonded, all values nominal: one of many, not the estimate. A unit with a silicone of unknown
    modulus has null and a `reason`.
    """
    data: dict[str, Any] = {
        "kind": KIND,
        "not_known": NOT_KNOWN,
        "draws": draws,
        "seed": seed,
        "fineness": FINENESS,
        "percent": list(PERCENT),
    }
    reason = next((layer.youngs_modulus.note for layer in variant.layers if not layer.youngs_modulus.known), None)
    if reason:
        return {**data, "levels": [], "reason": reason}
    cases: list[tuple[Drive, Reading]] = [(drive, at) for drive in get_args(Drive) for at in get_args(Reading)]
    found: dict[tuple[Drive, Reading], list[float]] = {case: [] for case in cases}
    for index in range(draws):
        say(f"finite elements: draw {index + 1} of {draws}")
        draw = Draw(seed, index)
        frequency = drawn(variant, draw)[0].frequency.middle
        for drive, at in cases:
            found[drive, at].append(level(variant, frequency, drive, at, draw, FINENESS))
    nominal = variant.frequency.middle
    levels = []
    for (drive, at), values in found.items():
        low, median, high = (float(value) for value in np.percentile(values, PERCENT))
        levels.append(
            {
                "drive": drive,
                "reading": at,
                "low": low,
                "median": median,
                "high": high,
                "median_error": _median_error(values, seed),
                "drawn_as": level(variant, nominal, drive, at, None, FINENESS),
            }
        )
    return {**data, "levels": levels}


def _median_error(values: list[float], seed: int) -> float:
    rng = np.random.default_rng(seed)
    again = rng.choice(np.log(values), (400, len(values)))
    return float(np.exp(np.std(np.median(again, axis=1))))
