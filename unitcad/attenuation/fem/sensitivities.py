"""Which inputs the finite elements of a unit see, on the skin and at the unit's own edge, under its motor's drive."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, get_args

import numpy as np

from unitcad.attenuation.edge.level import unknown
from unitcad.attenuation.edge.sensitivities import sensitivities
from unitcad.attenuation.edge.variant_units import merged
from unitcad.attenuation.fem.motor_level import Reading, amplitude, motion
from unitcad.attenuation.fem.prior_range import ALIKE
from unitcad.attenuation.fem.unknowns import Setting
from unitcad.attenuation.inputs import EstimateInput

STEP, FINENESS = 0.01, 0.5
"""The step is wide enough that the mesh's own changes do not show; differences are off by about 1 % of a slope."""


def fem_sensitivities(
    variant: EstimateInput, say: Callable[[str], None] = lambda line: None, step: float = STEP
) -> list[dict[str, Any]]:
    """Return `sensitivities` of each reading, of the unit as drawn, bonded, all values nominal; [] without a level.

    One finite-element solution for each end of each input serves both readings.
    """
    variant = merged(variant, ALIKE)
    if unknown(variant):
        return []
    drive = variant.drive
    levels: dict[Reading, list[float]] = {reading: [] for reading in get_args(Reading)}

    def solve(variants: Sequence[EstimateInput]) -> np.ndarray:
        for i, one in enumerate(variants):
            say(f"finite elements: input {i // 2 + 1} of {len(variants) // 2}")
            moved = motion(one, drive, Setting(), FINENESS)
            for reading in levels:
                shown = moved.skin if reading == "skin" else moved.edge
                levels[reading].append(amplitude(shown, drive, "along") / abs(moved.motor))
        return np.ones(len(variants))

    sensitivities(variant, solve, step)
    return [
        {"drive": drive, "reading": reading, **sensitivities(variant, lambda _, own=own: own, step)}
        for reading, own in levels.items()
    ]
