"""Units of recordings: their spellings, their factors to SI, and the keys by which files state them.

A file states a unit in a text next to the numbers: an attribute, a property, a line of the header, brackets behind a
name. `Stated` is that text as the file has it. A text that is no unit, or two texts that differ, are a doubt. Whoever
needs the numbers must then ask: no unit and an unclear unit are two things.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from unitcad.errors import Refusal, unknown_name
from unitcad.text import some

Quantity = Literal["displacement", "velocity", "acceleration"]

GRAVITY = 9.80665
"""m/s2, the standard acceleration of free fall (CGPM 1901)."""
LENGTHS = {
    "m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "pm": 1e-12, "in": 0.0254, "mil": 2.54e-5, "ft": 0.3048,
}  # fmt: skip
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
UNITS: dict[str, dict[str, float]] = {
    "displacement": LENGTHS,
    "velocity": {f"{name}/s": factor for name, factor in LENGTHS.items()},
    "acceleration": {
        **{f"{name}/s2": factor for name, factor in LENGTHS.items()},
        "g": GRAVITY, "mg": 1e-3 * GRAVITY, "ug": 1e-6 * GRAVITY,
    },
}  # fmt: skip
"""Factors to m, m/s and m/s2, by quantity and unit."""
ELECTRICAL = (
    {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "nV": 1e-9, "kV": 1e3},
    {"A": 1.0, "mA": 1e-3, "uA": 1e-6},
    {"C": 1.0, "nC": 1e-9, "pC": 1e-12},
    {"FS": 1.0, "%FS": 1e-2},
)
"""Factors between units of a sensor's output: voltage, current, charge, parts of full scale."""
_OTHER = ("rad", "deg", "degC", "°C", "mm/min", "Hz", "dB")
_PRESSURE = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm2": 1e6, "psi": 6894.757293168}
_STRAIN = {"1": 1.0, "%": 1e-2, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0, "-": 1.0}
COLUMN_UNITS: Mapping[str, Mapping[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0},
    "strain": _STRAIN,
    "stress": _PRESSURE,
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605, "gf": 9.80665e-3, "kgf": 9.80665},
    "travel": {"mm": 1e-3, "um": 1e-6, "cm": 1e-2, "m": 1.0, "in": 0.0254},
    "frequency": {"Hz": 1.0, "rad/s": 1.0 / (2.0 * np.pi)},
    "storage": _PRESSURE,
    "loss": _PRESSURE,
    "tan_delta": {"1": 1.0, "-": 1.0},
}
"""Factors to SI by quantity and unit; frequency to Hz."""


# Spellings.

_SIGNS = str.maketrans(
    {"µ": "u", "μ": "u", "Â": "", "·": "*", "⋅": "*", "×": "*", "∙": "*", "−": "-", "–": "-", "⁻": "-"}
    | {superscript: str(digit) for digit, superscript in enumerate("⁰¹²³⁴⁵⁶⁷⁸⁹")}
)
_PREFIXES = {"": "", "nano": "n", "micro": "u", "milli": "m", "centi": "c", "kilo": "k", "pico": "p"}
_BASES = {
    "metre": "m", "meter": "m", "volt": "V", "second": "s", "sec": "s", "ampere": "A", "amp": "A", "coulomb": "C",
}  # fmt: skip
_WORDS = {
    **{
        prefix + base + plural: short + symbol
        for prefix, short in _PREFIXES.items()
        for base, symbol in _BASES.items()
        for plural in ("", "s")
    },
    "msec": "ms", "usec": "us", "nsec": "ns", "micron": "um", "microns": "um", "mu": "um", "inch": "in",
    "inches": "in", "foot": "ft", "feet": "ft", "mils": "mil", "thou": "mil", "g's": "g", "gn": "g", "g0": "g",
    "g_n": "g", "g_0": "g", "grav": "g", "gravity": "g", "gravities": "g", "fullscale": "FS",
    "lbf": "lbf", "kgf": "kgf", "kn": "kN", "kpa": "kPa", "psi": "psi", "in": "in", "hz": "Hz",
}  # fmt: skip
"""Words and symbols that mean one unit in any case: none has a prefix whose other case is another one."""
_CAPITALS = {name.upper(): name for name in ("m", "cm", "mm", "um", "in", "ft", "mil", "s", "ms", "us", "g")}
"""Symbols that capital letters can't make another unit's: NM is a newton metre, and M is mega before V and A."""
_WHOLE = {
    "mps": "m/s", "mps2": "m/s2", "m/s/s": "m/s2", "mmps": "mm/s", "umps": "um/s", "ips": "in/s", "fps": "ft/s",
    "gal": "cm/s2", "%fs": "%FS", "%fullscale": "%FS", "in/in": "in/in",
}  # fmt: skip
"""Spellings of a whole unit, in small letters."""
_FACTOR = re.compile(r"([A-Za-z'_°%]+(?:_?0)?)(?:\^?\(?([+-]?\d)\)?)?")


def plain(unit: str) -> str:
    """Return a unit as this program spells it; the text without spaces if it is none that it knows.

    >>> plain("µm·s⁻¹"), plain("Millimeters per Second"), plain("m/sec^2"), plain("[ g ]")
    ('um/s', 'mm/s', 'm/s2', 'g')
    """
    text = re.sub(r"^[\[({](.*)[\])}]$", r"\1", unit.translate(_SIGNS).strip()).strip().replace("**", "^")
    short = re.sub(r"\s", "", text)
    if (known := _WHOLE.get(short.lower())) is not None:
        return known
    text = re.sub(r"\s*(?:/|\bper\b|\bin each\b)\s*", "/", text, flags=re.IGNORECASE)
    text = re.sub(r"\b(second|sec|s) ?(?:squared|square)|\b(?:squared|square) (second|sec|s)", r"\1\2^2", text)
    powers: dict[str, int] = {}
    for i, part in enumerate(text.split("/")):
        for factor in re.split(r"[*.\s]+", part.strip("() ")):
            found = _FACTOR.fullmatch(factor)
            if found is None:
                return short
            name = _symbol(found[1])
            powers[name] = powers.get(name, 0) + (-1 if i else 1) * int(found[2] or 1)
    second = powers.pop("s", 0)
    if second == 1 and not powers:
        return "s"
    if len(powers) == 1 and next(iter(powers.values())) == 1 and second in (0, -1, -2):
        (name,) = powers
        made = name + {0: "", -1: "/s", -2: "/s2"}[second]
        if second == 0 or made in UNITS["velocity"] or made in UNITS["acceleration"]:
            return made
    return short


def _symbol(word: str) -> str:
    """Return the symbol of a word, which is itself if no table has it."""
    return _WORDS.get(word.lower(), _CAPITALS.get(word, word))


def is_known_unit(unit: str) -> bool:
    """Tell whether a text is a unit that this program knows by name."""
    name = plain(unit)
    return name in _OTHER or (
        name != "1" and any(name in units for units in (TIMES, *ELECTRICAL, *UNITS.values(), *COLUMN_UNITS.values()))
    )


def is_signal_unit(unit: str) -> bool:
    """Tell whether a text is a unit of a motion or of a sensor's output."""
    name = plain(unit)
    return any(name in units for units in (*ELECTRICAL, *UNITS.values()))


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


# The keys by which files state a unit.


@dataclass(frozen=True)
class Stated:
    """The unit of a channel as its file states it, "" if it states none.

    `doubt` says why it is not clear, and `likely` is the unit that it may be.
    """

    unit: str = ""
    doubt: str = ""
    likely: str = ""


@dataclass(frozen=True)
class Scope:
    """Properties near a channel, by key: texts, lists or tables of texts; `names`: the channel's names there."""

    place: str
    properties: Mapping[str, Any]
    names: tuple[str, ...] = ()


_KIND = (
    "ni|wf|y|v|vertical|phys(?:ical)?|eng(?:ineering)?|ordinate|axis|data|ch(?:annel)?|sig(?:nal)?|sensor|raw|"
    "measure(?:d|ment)?|values?|samples?|amplitude|output|displacement|velocity|acceleration"
)
_LABEL = "strings?|labels?|lab|names?|symbols?|text|desc(?:ription)?|y|ofmeasure(?:ment)?"
_UNIT_KEY = re.compile(rf"(?:{_KIND})*(?:units?|einheit(?:en)?)(?:{_LABEL})*|eu")
"""The usual names of the samples' unit, as `folded` leaves them."""
_WITHIN = ("label", "symbol", "name", "unit", "units", "text", "quantity")
"""Keys of the text in a table that is a unit."""
_NONE = ("", "none", "n/a", "na", "null", "undefined", "unknown", "unspecified", "not set", "[]")


def folded(key: str) -> str:
    """Return a key in small letters without spaces and signs."""
    return re.sub(r"[\W_]", "", key.casefold())


def is_unit_key(key: str) -> bool:
    """Tell whether a key is one of the usual names of the samples' unit, in any case."""
    return _UNIT_KEY.fullmatch(folded(key)) is not None


def stated(scopes: Iterable[Scope], count: int = 1) -> list[Stated]:
    """Return the units of a channel's `count` columns by the properties near it, the nearest scope first.

    A key counts that is a usual name of a unit in any case, or has one with the channel's name: edge_unit, units.edge.
    A list, or a text with commas, of as many parts as columns states each one's. Two keys of one scope that differ, a
    value that is no text, and a unit under an unusual key are a doubt.
    """
    doubt = ""
    for scope in scopes:
        said = [(key, _columns(value, count)) for key, value in _statements(scope)]
        columns = [_agreed(scope.place, [(key, each[i]) for key, each in said]) for i in range(count)]
        if any(one != Stated() for one in columns):
            return columns
        for key, value in scope.properties.items():
            if isinstance(value, str) and "unit" in folded(key) and is_signal_unit(value):
                doubt = doubt or f"{scope.place} {key} = {value}: of the samples, or of something else?"
    return [Stated(doubt=doubt)] * count


def _statements(scope: Scope) -> Iterator[tuple[str, Any]]:
    """Yield the keys of a scope that state the unit of its samples, or of the channel that it names, with the value."""
    names = [folded(name) for name in scope.names if folded(name)]
    named = {form.format(name) for name in names for form in ("{}unit", "{}units", "unit{}", "units{}", "unitof{}")}
    for key, value in scope.properties.items():
        if folded(key) in named:
            yield key, value
        elif is_unit_key(key) and isinstance(value, Mapping):
            inner = {folded(each): one for each, one in value.items() if isinstance(one, str | list | Mapping)}
            known = next((each for each in (*names, *_WITHIN) if each in inner), None)
            if known is not None:
                deeper = isinstance(inner[known], Mapping)
                yield from _statements(Scope(scope.place, {"unit": inner[known]})) if deeper else [(key, inner[known])]
        elif is_unit_key(key):
            yield key, value


def _columns(value: Any, count: int) -> list[str | None]:
    """Return a value's text for each of `count` columns, None for one that has none."""
    parts: list[Any] = value if isinstance(value, list) else [value]
    if len(parts) == 1 and isinstance(parts[0], str) and count > 1:
        several = re.split(r"[,;|\t]", parts[0])
        parts = several if len(several) == count else parts
    if len(set(map(str, parts))) == 1:
        parts = parts[:1] * count
    texts = [one.strip() if isinstance(one, str) else None for one in parts]
    return texts if len(texts) == count else [None] * count


def _agreed(place: str, said: list[tuple[str, str | None]]) -> Stated:
    """Return the unit that the keys of one place state for a column."""
    said = [(key, text) for key, text in said if text is None or text.casefold() not in _NONE]
    for key, text in said:
        if text is None:
            return Stated(doubt=f"{place} {key} is no text of a unit")
    if len({plain(text) for _, text in said if text}) > 1:
        return Stated(doubt=f"{place} differ: {some(f'{key} = {text}' for key, text in said)}")
    return Stated(said[0][1] or "") if said else Stated()


def text_of(value: Any) -> Any:
    """Return a property with text for bytes and for arrays of text; numbers as they are."""
    if isinstance(value, bytes):
        try:
            value = value.decode("utf-8")
        except UnicodeDecodeError:
            value = value.decode("latin-1")
    if isinstance(value, np.ndarray) and value.dtype.kind in "OSU":
        texts = [text_of(one) for one in value.ravel()]
        return texts[0] if len(texts) == 1 else texts
    return value.replace("\0", "").strip() if isinstance(value, str) else value


# A unit in a name.

_BRACKETS = re.compile(r"\s*[\[(]([^\[\]()]*(?:\([^()]*\))?[^\[\]()]*)[\])]\s*")
_ENDING = re.compile(r"(.*?[A-Za-z\])])[\s_,;:-]+(?:in[\s_])?([^\s_,;:]+|[a-zµμ]+_(?:per_)?s2?)$", re.IGNORECASE)
_RATIO = re.compile(r".*(?:strain|dehnung|tan|loss factor)", re.IGNORECASE)
_QUANTITY = re.compile(r"displ|posi|defl|veloc|speed|accel|\bacc\b|volt|time|travel", re.IGNORECASE)


def in_name(name: str) -> tuple[str, Stated]:
    """Return a channel's name without its unit in brackets, and that unit. Other brackets and endings are a doubt.

    >>> in_name("Velocity [um/s] CH2")
    ('Velocity CH2', Stated(unit='um/s', doubt='', likely=''))
    >>> in_name("edge_um")
    ('edge_um', Stated(unit='', doubt='its name ends with um', likely='um'))
    """
    found = [one for one in _BRACKETS.finditer(name) if not one[1].isdecimal() or _RATIO.match(name)]
    if known := [one for one in found if is_known_unit(one[1]) or plain(one[1]) == "1"]:
        last = known[-1]
        return " ".join((name[: last.start()] + " " + name[last.end() :]).split()) or name, Stated(last[1].strip())
    if found and found[-1].end() == len(name) and found[-1].start():
        return name, Stated(doubt=f"its name ends with {found[-1][0].strip()}, which is no unit that unitcad knows")
    ending = _ENDING.fullmatch(name.strip())
    if ending is not None:
        unit = re.sub(r"_(?:per_)?", "/", ending[2])
        if is_signal_unit(unit) and (len(unit) > 1 or _QUANTITY.search(ending[1])):
            return name, Stated(doubt=f"its name ends with {ending[2]}", likely=plain(unit))
    return name, Stated()
