"""The prior predictive range of a unit's levels: seeded draws of everything that is not known. JSON-ready data."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from statistics import NormalDist
from typing import Any, get_args

import numpy as np
from scipy.stats import binom

from unitcad.attenuation.edge.level import unknown
from unitcad.attenuation.edge.variant_units import merged
from unitcad.attenuation.fem.harmonic_response import Contact
from unitcad.attenuation.fem.motor_level import Drive, Reading, level
from unitcad.attenuation.fem.unknowns import Draw, drawn
from unitcad.attenuation.inputs import EstimateInput

SEED, DRAWS, FINENESS = 1, 32, 1.0
"""Twice every combination of the choices."""
PERCENT = (5, 50, 95)
ALIKE = 0.01
"""Layers whose properties differ by less are one layer: the mesh's own error is as large."""
WITHIN = NormalDist().cdf(1.0) - NormalDist().cdf(-1.0)
"""How often a value lies within one standard error."""
MEDIAN_ERROR = (
    "a factor: the median of all possible draws lies between the median divided by it and times it in two of three "
    "cases or more; wide where bonded and resting levels lie far apart, since the median then falls between them"
)
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

    The draws are spread evenly (`Draw.of`). low, median and high are percentiles; `by_contact` has them for bonded and
    for resting skin apart. median_error: `MEDIAN_ERROR`; None below three draws. `drawn_as`: the level of the unit as
    its spec draws it, bonded, all values nominal: one of many, not the estimate. `skin_over_edge`: the level on the
    skin over that of the unit's own edge, both as drawn, by drive. A unit with a silicone of unknown modulus has an
    empty `levels` and a `reason`.
    """
    data: dict[str, Any] = {
        "kind": KIND,
        "not_known": NOT_KNOWN,
        "draws": draws,
        "seed": seed,
        "fineness": FINENESS,
        "percent": list(PERCENT),
        "median_error": MEDIAN_ERROR,
    }
    variant = merged(variant, ALIKE)
    if reason := unknown(variant):
        return {**data, "levels": [], "reason": reason}
    cases: list[tuple[Drive, Reading]] = [(drive, at) for drive in get_args(Drive) for at in get_args(Reading)]
    found: dict[tuple[Drive, Reading], list[float]] = {case: [] for case in cases}
    contacts: list[Contact] = []
    for index in range(draws):
        say(f"finite elements: draw {index + 1} of {draws}")
        draw = Draw(seed, index, draws)
        made, setting = drawn(variant, draw)
        contacts.append(setting.contact)
        for drive, at in cases:
            found[drive, at].append(level(variant, made.frequency.middle, drive, at, draw, FINENESS))
    nominal = variant.frequency.middle
    levels = [
        {
            "drive": drive,
            "reading": at,
            **spread(values),
            "drawn_as": level(variant, nominal, drive, at, None, FINENESS),
            "by_contact": {
                contact: spread([value for value, one in zip(values, contacts, strict=True) if one == contact])
                for contact in dict.fromkeys(contacts)
            },
        }
        for (drive, at), values in found.items()
    ]
    drawn_as = {(one["drive"], one["reading"]): one["drawn_as"] for one in levels}
    ratios = {drive: drawn_as[drive, "skin"] / drawn_as[drive, "edge"] for drive in get_args(Drive)}
    return {**data, "levels": levels, "skin_over_edge": ratios}


def spread(values: Sequence[float]) -> dict[str, float | None]:
    """Return low, median, high of draws and the median's error, a factor.

    The error spans the narrowest pair of ordered draws, as far from either end, between which the median of
    independent draws of any distribution lies with the probability `WITHIN`: its rank is binomial.
    """
    low, median, high = (float(value) for value in np.percentile(values, PERCENT))
    ordered, n = np.sort(values), len(values)
    ranks = [k for k in range(n // 2) if 1 - 2 * binom.cdf(k, n, 0.5) >= WITHIN]
    error = None
    if ranks:
        error = float(max(ordered[n - 1 - ranks[-1]] / median, median / ordered[ranks[-1]]))
    return {"low": low, "median": median, "high": high, "median_error": error}
