"""Units of recordings and of mechanical tests: how they are written, and their factors to SI."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Literal

import numpy as np

from unitcad.errors import Refusal, unknown_name

Quantity = Literal["displacement", "velocity", "acceleration"]

GRAVITY = 9.80665
"""m/s2, the standard acceleration of free fall (CGPM 1901)."""
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254}
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
UNITS: dict[str, dict[str, float]] = {
    "displacement": LENGTHS,
    "velocity": {f"{name}/s": factor for name, factor in LENGTHS.items()},
    "acceleration": {**{f"{name}/s2": factor for name, factor in LENGTHS.items()}, "g": GRAVITY},
}
"""Factors to m, m/s and m/s2, by quantity and unit."""
ELECTRICAL = (
    {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "kV": 1e3},
    {"A": 1.0, "mA": 1e-3, "uA": 1e-6},
    {"C": 1.0, "nC": 1e-9, "pC": 1e-12},
)
"""Factors between units of a sensor's output: voltage, current, charge."""
_OTHER = ("rad", "deg", "degC", "°C", "mm/min")
_WORDS = {"volt": "V", "volts": "V", "sec": "s", "second": "s", "seconds": "s", "metre": "m", "meter": "m"}


def plain(unit: str) -> str:
    """Return a unit as this program spells it: um for both signs of micro, m/s2 for m/s² and m/s^2."""
    text = unit.strip().strip("[]()").strip()
    text = text.replace("µ", "u").replace("μ", "u").replace("²", "2").replace("^", "").replace("**", "")
    text = re.sub(r"/s/s\b|/sec2\b|/sec\^2", "/s2", text.replace(" ", ""))
    return _WORDS.get(text.lower(), text)


def known(unit: str) -> bool:
    """Tell whether a text is a unit that this program knows by name."""
    name = plain(unit)
    return name in _OTHER or (
        name != "1" and any(name in units for units in (TIMES, *ELECTRICAL, *UNITS.values(), *COLUMN_UNITS.values()))
    )


def ratio(unit: str, other: str) -> float | None:
    """Return how many of the second unit one of the first is; None if they measure different quantities."""
    both = next((units for units in (*ELECTRICAL, *UNITS.values()) if unit in units and other in units), None)
    return both[unit] / both[other] if both else 1.0 if unit == other else None


def to_si(unit: str, quantity: Quantity, field: str) -> float:
    """Return the factor from a unit to m, m/s or m/s2. Raises Refusal for a unit of another quantity."""
    units = UNITS[quantity]
    if plain(unit) not in units:
        raise unknown_name(field, unit, units)
    return units[plain(unit)]


def seconds(unit: str, field: str) -> float:
    """Return the factor from a unit of time to s. Raises Refusal for any other unit."""
    if plain(unit) not in TIMES:
        raise Refusal(field, unit, f"is no unit of time; known: {', '.join(TIMES)}", "s")
    return TIMES[plain(unit)]


_PRESSURE = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm2": 1e6, "psi": 6894.757293168}
_STRAIN = {"1": 1.0, "%": 1e-2, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0, "-": 1.0}
COLUMN_UNITS: Mapping[str, Mapping[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0},
    "strain": _STRAIN,
    "true_strain": _STRAIN,
    "stress": _PRESSURE,
    "true_stress": _PRESSURE,
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605, "gf": 9.80665e-3, "kgf": 9.80665},
    "travel": {"mm": 1e-3, "um": 1e-6, "cm": 1e-2, "m": 1.0, "in": 0.0254},
    "frequency": {"Hz": 1.0, "rad/s": 1.0 / (2.0 * np.pi)},
    "storage": _PRESSURE,
    "loss": _PRESSURE,
    "tan_delta": {"1": 1.0, "-": 1.0},
}
"""Factors to SI by quantity and unit; frequency to Hz."""
