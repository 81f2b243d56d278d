"""A silicone's moduli by the method of each, and how far two methods are apart."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping
from functools import cache
from typing import Any

from unitcad.catalogue import Material, Value, materials
from unitcad.text import number

PAPER = "as printed by the paper"


def readings(material: Material) -> dict[str, Value[Any]]:
    """Return a silicone's moduli (kPa) by the method of each."""
    dynamic, slow = material.youngs_modulus_kpa, material.quasistatic_modulus_kpa
    found: dict[str, Value[Any]] = {}
    if dynamic is not None:
        found[PAPER if dynamic.status == "paper" else dynamic.method or "dynamic"] = dynamic
    return found if slow is None else {**found, slow.method or "quasi-static": slow}


@cache
def printed_over_slow() -> Mapping[str, float]:
    """Return the paper's modulus over that of other labs' slow pulls, of each silicone that has both, by its name."""
    found = {}
    for name, one in materials().items():
        printed, slow = readings(one).get(PAPER), one.quasistatic_modulus_kpa
        if printed and slow:
            found[name] = float(printed) / float(slow)
    return found


@cache
def method_spread() -> float:
    """Return the standard deviation of ln(paper's modulus / other labs') over the silicones that have both."""
    return statistics.stdev(map(math.log, printed_over_slow().values()))


def moduli_note(material: Material) -> str:
    """Return how the printed modulus of a silicone compares with a slow pull's; "" without both."""
    printed, slow = material.youngs_modulus_kpa, material.quasistatic_modulus_kpa
    if not (printed and slow):
        return ""
    ends = f" ({number(slow.low, 3)} to {number(slow.high, 3)})" if slow.low and slow.high else ""
    below = float(printed) < float(slow.low or slow)
    odd = ": no viscoelastic solid is softer at 125 Hz than in a slow pull" if below else ""
    return (
        f"printed {number(printed, 3)} kPa, slow pull {number(slow, 3)}{ends} kPa{odd}. Methods differ by a factor of "
        f"{number(math.exp(method_spread()), 2)} (one standard deviation), which the range of a level holds"
    )
