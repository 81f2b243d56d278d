"""`unitcad fit --check`: whether a lab's file has everything that makes its units worth giving to others."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import stdtrit

from unitcad.attenuation.edge.ranges import predictive_of
from unitcad.estimate_inputs import estimate_input
from unitcad.json_text import rounded
from unitcad.lab.fitting import FitLab, LabUnit
from unitcad.lab.measuring import LEVELS
from unitcad.spec import to_data
from unitcad.validation import from_data

_FAR = 0.98
"""Part of the rule's distribution outside of which a level is worth a second look."""


@dataclass(frozen=True)
class Lack:
    """Something that a contribution lacks, or that puts it in doubt: where, and a sentence."""

    where: str
    message: str


def lacks(lab: FitLab) -> list[Lack]:
    """Return everything that the lab's file lacks as a contribution."""
    found = []
    settings = lab.settings
    if settings.instrument is None:
        found.append(Lack("instrument", "is missing: sensor, surface, axis, support and motor"))
    if settings.contributor is None:
        found.append(Lack("contributor", "is missing: name and licence"))
    for i, unit in enumerate(lab.units):
        found += [Lack(f"unit.{i}, {unit.name}", message) for message in _of_unit(unit)]
    return found + [Lack(one.where, f"{one.code} {one.message}") for one in lab.findings]


def _of_unit(unit: LabUnit) -> list[str]:
    found = []
    if unit.lab is not None:
        found.append(f"is of lab {unit.lab}: a contribution has the units of one lab")
    if unit.cast is None:
        found.append("has no cast record: nobody can tell its silicones, ratios and walls")
    elif not unit.walls_measured:
        found.append(f"{unit.cast} has no walls of this unit: cut one open, or measure it at the skin")
    if unit.level.low is None:
        found.append("its level has no 95 % interval: give low and high, or the recordings")
    if not LEVELS[0] <= unit.level.value <= LEVELS[1]:
        found.append(f"its level of {unit.level.value:g} is beyond {LEVELS[0]:g} to {LEVELS[1]:g}: is a unit wrong?")
    return found


def unit_rows(lab: FitLab) -> list[dict[str, Any]]:
    """Return each unit with its level, frequency (Hz), batch, and the 80 % range that the rule expects.

    `far`: whether the level is beyond the rule's 1 and 99 %, which is no fault: it may be the unit that teaches most.
    """
    rows = []
    for unit in lab.units:
        data = to_data(unit.built)
        data["estimate"]["moduli"] = lab.settings.moduli
        variant = estimate_input(from_data(data), unit.frequency_hz)
        expected = predictive_of([variant])
        low, _, high = (float(end[0]) for end in expected.range)
        away = abs(np.log(unit.level.value) - expected.centre[0]) / expected.scale[0]
        known = bool(np.isfinite(away))
        row = {
            "unit": unit.name, "level": unit.level.value, "low": unit.level.low, "high": unit.level.high,
            "frequency_hz": variant.frequency.middle, "batch": unit.batch, "source": unit.source,
            "expected_low": low if known else None, "expected_high": high if known else None,
            "far": known and bool(away > stdtrit(expected.degrees_of_freedom, (1 + _FAR) / 2)),
        }  # fmt: skip
        rows.append(rounded(row, 6))
    return rows
