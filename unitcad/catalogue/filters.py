"""Filters of a list of entries: ranges such as "10..60kPa", "20.." and "8..10", and words such as "lra".

A filter asks for a value of each entry. An entry whose value no source gives is left out, and named.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

from msgspec import Struct

from unitcad.catalogue.entries import Material, Motor, Printer, Value, kinds_of
from unitcad.errors import WrongArgument, unknown_name

_Entry = TypeVar("_Entry", Material, Motor, Printer)

SHORT: dict[str, tuple[str, ...]] = {
    "soft": ("quasistatic_modulus_kpa", "youngs_modulus_kpa", "modulus_100pct_kpa"),
    "pot_life": ("pot_life_min",),
    "cure": ("cure_h",),
    "diameter": ("diameter_mm",),
    "thickness": ("thickness_mm",),
    "frequency": ("frequency_hz", "rpm"),
    "bed": ("bed_x_mm", "bed_y_mm"),
}
"""Short names of filters, each with its keys: of several, the first that an entry has; of a bed, the shorter side.

A frequency is that of the drive, otherwise the speed over 60.
"""
_SUFFIXES = {
    "kpa": "kPa",
    "mpa": "MPa",
    "hz": "Hz",
    "pct": "%",
    "percent": "%",
    "cps": "cps",
    "cm3": "g/cm3",
    "v": "V",
    "ma": "mA",
}
_UNITS: dict[str, dict[str, float]] = {
    "kPa": {"Pa": 1e-3, "kPa": 1.0, "MPa": 1e3},
    "MPa": {"kPa": 1e-3, "MPa": 1.0},
    "mm": {"um": 1e-3, "mm": 1.0, "cm": 10.0},
    "um": {"um": 1.0, "mm": 1e3},
    "min": {"s": 1 / 60, "min": 1.0, "h": 60.0},
    "h": {"min": 1 / 60, "h": 1.0, "d": 24.0},
    "Hz": {"Hz": 1.0, "kHz": 1e3},
    "cps": {"cps": 1.0, "mPas": 1.0, "Pas": 1e3},
    "g": {"mg": 1e-3, "g": 1.0},
    "mA": {"mA": 1.0, "A": 1e3},
    "V": {"mV": 1e-3, "V": 1.0},
    "%": {"%": 1.0},
    "g/cm3": {"g/cm3": 1.0},
    "us": {"us": 1.0},
    "deg": {"deg": 1.0},
}
"""Units by that of a key, with their factors to it."""


@dataclass(frozen=True)
class Range:
    """Values from `low` to `high`, in the key's unit."""

    low: float
    high: float

    def __contains__(self, value: object) -> bool:
        return isinstance(value, int | float) and self.low <= value <= self.high


def unit_of(key: str) -> str:
    """Return the unit that a key's name ends in; empty if it has none."""
    suffix = _SUFFIXES.get(key.rpartition("_")[2], key.rpartition("_")[2])
    return suffix if suffix in _UNITS else ""


def range_of(option: str, text: str, unit: str) -> Range:
    """Return the range of a text: "10..60", "10..", "..60" or "10", with a unit at its end if it has one.

    Raises `WrongArgument`, at `option`, for another text, for a unit of something else, and for ends in the wrong
    order.
    """
    low, dots, high = text.partition("..")
    ends = [_END.fullmatch(end) for end in (low, high)]
    numbers, units = zip(*(end.groups() if end else (None, None) for end in ends), strict=True)
    if not all(ends) or not any(numbers):
        raise WrongArgument(option, text, "is a range such as 10..60, 10.. or ..60, with or without a unit")
    last = units[1] or units[0]
    factors, values = _UNITS.get(unit, {}), list[float | None]()
    for number, own in zip(numbers, units, strict=True):
        given = own or last or unit
        if given and given not in factors:
            limit = f"is in {' or '.join(factors)}" if factors else "has no unit"
            raise WrongArgument(option, text, limit, f"{numbers[0] or ''}{dots}{numbers[1] or ''}{unit}")
        values.append(float(number) * factors.get(given, 1.0) if number else None)
    least = -math.inf if values[0] is None else values[0]
    most = (math.inf if dots else least) if values[1] is None else values[1]
    if least > most:
        raise WrongArgument(option, text, "begins above its end", f"{high.strip()}..{low.strip()}")
    return Range(least, most)


_END = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)?\s*([A-Za-z%][A-Za-z/%3]*)?\s*")
"""One end of a range: a number, a unit, both or nothing."""


def keep(
    entries: Mapping[str, _Entry], wanted: Mapping[str, str], option: str = "where"
) -> tuple[dict[str, _Entry], dict[str, list[str]]]:
    """Return the entries that meet all filters, and by filter those without a value for it.

    Parameters
    ----------
    entries : mapping of str to entry
        The entries by name.
    wanted : mapping of str to str
        Ranges or words by key, or by short name (`SHORT`).
    option : str, default "where"
        The option that a refusal of an unknown key names.

    Returns
    -------
    tuple of dict
        The entries that are kept; and by filter the names of those that lack its value.

    Raises
    ------
    WrongArgument
        For an unknown key, and for a range or a word that can't be.

    Examples
    --------
    >>> from unitcad import catalogue
    >>> kept, lacking = keep(catalogue.materials(), {"soft": "10..60kPa", "pot_life": "20.."})
    >>> list(kept)
    ['ecoflex-00-10', 'ecoflex-00-20', 'ecoflex-00-30']
    """
    if not entries:
        return {}, {}
    kinds = dict(kinds_of(type(next(iter(entries.values())))))
    kept, lacking = dict(entries), dict[str, list[str]]()
    for name, text in wanted.items():
        keys = SHORT.get(name, (name,))
        known = [key for key in keys if key in kinds]
        if not known and name in SHORT:
            of = next(each.__name__ for each in (Material, Motor, Printer) if keys[0] in dict(kinds_of(each)))
            raise WrongArgument(name, text, f"filters the entries of another kind, {of.lower()}s")
        if not known:
            raise unknown_name(
                option, name, [*kinds, *(one for one, of in SHORT.items() if of[0] in kinds)], WrongArgument
            )
        accepted = _accepted(name if name in SHORT else option, text, known[0], kinds[known[0]])
        values = {each: _value(entry, name, known) for each, entry in kept.items()}
        if missing := [each for each, value in values.items() if value is None]:
            lacking[name] = missing
        kept = {each: entry for each, entry in kept.items() if values[each] is not None and values[each] in accepted}
    return kept, lacking


def _accepted(option: str, text: str, key: str, kind: Any) -> Range | set[str]:
    """Return the accepted numbers or words of a key. Raises `WrongArgument`."""
    args = kind.__args__ if hasattr(kind, "__args__") else (kind,)
    if args[0] is float or args[0] is int:
        return range_of(option, text, unit_of(key))
    words = getattr(args[0], "__args__", ())
    if words and text not in words:
        raise unknown_name(option, text, words, WrongArgument)
    return {text}


def _value(entry: Struct, name: str, keys: list[str]) -> float | str | None:
    """Return the value of an entry that a filter asks for; None if it has none."""
    found: list[Value[Any]] = [value for key in keys if (value := getattr(entry, key)) is not None]
    if not found:
        return None
    if name == "bed":
        return min(each.value for each in found)
    value = found[0].value
    return value / 60 if name == "frequency" and getattr(entry, keys[0]) is None else value
