"""Units of what sensors give, and of time, to SI."""

from __future__ import annotations

import re
from typing import Literal

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
OTHER_UNITS = (
    "V", "mV", "Pa", "kPa", "MPa", "GPa", "N/mm2", "psi", "N", "mN", "kN", "lbf", "gf", "kgf", "%", "mm/mm", "m/m",
    "in/in", "-", "A", "mA", "Hz", "rad/s", "deg", "rad", "min", "mm/min", "degC", "°C",
)  # fmt: skip
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
    return name in OTHER_UNITS or name in TIMES or any(name in units for units in UNITS.values())


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
