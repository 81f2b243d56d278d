"""Units of length that files name, or a person for files that name none."""

from __future__ import annotations

from unitcad.errors import WrongArgument, unknown_name

UNITS_MM = {"micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}
_SHORT = {"mm": "millimeter", "cm": "centimeter", "m": "meter", "in": "inch", "inches": "inch", "ft": "foot"}


def unit_named(field: str, unit: str | None) -> str | None:
    """Return the long name of a unit of length. Raises Refusal, naming `field`, for an unknown one."""
    if unit is None:
        return None
    if not isinstance(unit, str):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise WrongArgument(field, unit, "takes a unit's name, such as mm")
    known = _SHORT.get(unit.lower(), unit.lower())
    if known not in UNITS_MM:
        raise unknown_name(field, unit, UNITS_MM)
    return known
