"""Materials, motors, printers, tissue and the paper's measurements: every value with its source and status.

The data are TOML files next to this module, read on first use; `entries` has the kinds of their values. A value that
nobody has measured for us is "assumed" and carries a range. A spec may bring entries of its own (`own`): the same
tables, in which a plain number has the status "spec".

Examples
--------
>>> from unitcad import catalogue
>>> modulus = catalogue.materials()["ecoflex-00-10"].youngs_modulus_kpa
>>> modulus.value, modulus.status
(15.0, 'paper')
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from difflib import SequenceMatcher, get_close_matches
from functools import cache
from importlib.resources import files
from typing import Any, TypeVar

import msgspec
from msgspec import Struct

from unitcad.catalogue.entries import (
    CHEMISTRIES,
    FREQUENCIES_HZ,
    Contact,
    Material,
    MaterialEntry,
    Measurements,
    Motor,
    MotorEntry,
    Printer,
    PrinterEntry,
    Tissue,
    TissueEntry,
    Touch,
    Value,
    kinds_of,
    required_of,
)
from unitcad.documents import parse_toml
from unitcad.errors import Refusal, unknown_name
from unitcad.text import measured, some

__all__ = [
    "FREQUENCIES_HZ",
    "RESIN",
    "Contact",
    "Material",
    "MaterialEntry",
    "Measurements",
    "Motor",
    "MotorEntry",
    "Printer",
    "PrinterEntry",
    "Tissue",
    "TissueEntry",
    "Touch",
    "Value",
    "choose",
    "contact",
    "contacts",
    "inhibitors",
    "materials",
    "measurements",
    "motors",
    "needed",
    "printers",
    "surface_contact",
    "tissue",
    "tissues",
    "touch",
]

_Entry = TypeVar("_Entry", Material, Motor, Printer)
_KINDS: dict[type, tuple[str, str]] = {
    Material: ("materials.toml", "materials"),
    Motor: ("motors.toml", "motors"),
    Printer: ("printers.toml", "printers"),
}


def materials(own: Mapping[str, MaterialEntry] | None = None) -> dict[str, Material]:
    """Return the silicones of the catalogue, with those of a spec.

    Parameters
    ----------
    own : mapping of str to entry, optional
        Entries of a spec; they replace shipped ones of the same name.

    Returns
    -------
    dict of str to Material
        The entries by name. Each value has a unit in its name, a status and a source.

    Raises
    ------
    Refusal
        For an invalid entry.

    Examples
    --------
    >>> import unitcad
    >>> ecoflex = unitcad.materials()["ecoflex-00-10"]
    >>> float(ecoflex.density_g_cm3), ecoflex.density_g_cm3.status
    (1.04, 'datasheet')
    """
    return _entries(Material, own)


def motors(own: Mapping[str, MotorEntry] | None = None) -> dict[str, Motor]:
    """Return the motors of the catalogue, with those of a spec.

    Parameters
    ----------
    own : mapping of str to entry, optional
        Entries of a spec; they replace shipped ones of the same name.

    Returns
    -------
    dict of str to Motor
        The entries by name. Each value has a unit in its name, a status and a source.

    Raises
    ------
    Refusal
        For an invalid entry.

    Examples
    --------
    >>> import unitcad
    >>> thickness = unitcad.motors()["LCM0720A3463F"].thickness_mm
    >>> thickness.value, thickness.low, thickness.high, thickness.status
    (2.0, 2.0, 2.65, 'assumed')
    """
    return _entries(Motor, own)


def printers(own: Mapping[str, PrinterEntry] | None = None) -> dict[str, Printer]:
    """Return the printers of the catalogue, with those of a spec.

    Parameters
    ----------
    own : mapping of str to entry, optional
        Entries of a spec; they replace shipped ones of the same name.

    Returns
    -------
    dict of str to Printer
        The entries by name. Each value has a unit in its name, a status and a source.

    Raises
    ------
    Refusal
        For an invalid entry.

    Examples
    --------
    >>> import unitcad
    >>> float(unitcad.printers()["fdm-0.4"].layer_mm)
    0.2
    """
    return _entries(Printer, own)


def tissue(name: str = "forearm", own: Mapping[str, Mapping[str, TissueEntry]] | None = None) -> tuple[Tissue, ...]:
    """Return the layers of the tissue under the unit.

    Parameters
    ----------
    name : str, default "forearm"
        Name of the tissue.
    own : mapping of str to mapping of str to entry, optional
        Tissues of a spec, each with its layers by name, skin first.

    Returns
    -------
    tuple of Tissue
        The layers from the skin down; the last one is a half-space without thickness.

    Raises
    ------
    Refusal
        For an unknown name, and for an invalid tissue.

    Examples
    --------
    >>> import unitcad
    >>> [layer.name for layer in unitcad.tissue()]
    ['skin', 'hypodermis', 'muscle', 'bone']
    """
    known: dict[str, Mapping[str, Any]] = {**_raw("tissue.toml"), **(own or {})}
    if name not in known:
        raise unknown_name("estimate.tissue", name, known)
    layers = [_entry(Tissue, layer, _plain(table), f"tissue.{name}.{layer}") for layer, table in known[name].items()]
    for layer in layers:
        path = f"tissue.{name}.{layer.name}"
        if layer.shear_modulus_kpa is None and layer.youngs_modulus_kpa is None:
            raise Refusal(f"{path}.youngs_modulus_kpa", None, "is required, or shear_modulus_kpa")
        if layer is not layers[-1] and layer.thickness_mm is None:
            raise Refusal(f"{path}.thickness_mm", None, "is required: only the last layer is a half-space")
        if layer is layers[-1] and layer.thickness_mm is not None:
            raise Refusal(
                f"{path}.thickness_mm", float(layer.thickness_mm), "the last layer is a half-space; leave it out"
            )
    return tuple(layers)


@cache
def tissues() -> Mapping[str, tuple[Tissue, ...]]:
    """Return the shipped tissues by name, each with its layers from the skin down.

    Examples
    --------
    >>> from unitcad import catalogue
    >>> list(catalogue.tissues())
    ['forearm', 'forearm-elastography', 'upper-arm', 'palm', 'rigid-plate', 'gel-50kpa']
    """
    return {name: tissue(name) for name in _raw("tissue.toml")}


@cache
def touch() -> Mapping[str, Touch]:
    """Return the thresholds of touch by the name of the tissue.

    Examples
    --------
    >>> from unitcad import catalogue
    >>> forearm = catalogue.touch()["forearm"]
    >>> forearm.site.value, [round(um, 2) for um in forearm.at(220)], forearm.threshold_um.status
    ('volar forearm, hairy skin', [1.0, 0.3, 3.0], 'assumed')
    """
    return {name: _entry(Touch, name, table, f"touch.{name}") for name, table in _raw("touch.toml").items()}


@cache
def measurements() -> Measurements:
    """Return the paper's measured amplitudes at the edge, as printed."""
    return msgspec.convert(_raw("measurements.toml"), Measurements)


def choose(kind: str, name: str, known: Mapping[str, _Entry]) -> _Entry:
    """Return `known[name]`. Raises `Refusal` with the field `kind` and the closest names."""
    if name not in known:
        motors = {each: entry for each, entry in known.items() if isinstance(entry, Motor)}
        raise _unknown_motor(kind, name, motors) if motors else unknown_name(kind, name, known)
    return known[name]


_MOST_MOTORS = 8
"""Motors that a refusal lists."""


def _unknown_motor(field: str, name: str, known: Mapping[str, Motor]) -> Refusal:
    """Return the refusal of a motor by its name, with those of like size.

    Part numbers of coin motors begin with diameter and thickness: LCM1020 is one of 10 x 2.0 mm.
    """
    sizes = {each: (float(entry.diameter_mm), float(entry.thickness_mm)) for each, entry in known.items()}
    digits, wide = re.search(r"(\d\d)(\d\d)", name), measured(name, "mm")
    typed = get_close_matches(name.lower(), {each.lower(): each for each in known}, n=1, cutoff=_TYPED)
    meant = (float(digits[1]), float(digits[2]) / 10) if digits else (wide, None) if wide else None

    def off(each: str) -> tuple[float, float]:
        if typed and each.lower() == typed[0]:
            return -1.0, 0.0
        if not meant:
            return -SequenceMatcher(None, name.lower(), each.lower()).ratio(), 0.0
        return abs(sizes[each][0] - meant[0]), abs(sizes[each][1] - meant[1]) if meant[1] is not None else 0.0

    order = sorted(known, key=off)
    listed = some((f"{each} ({sizes[each][0]:g} x {sizes[each][1]:g} mm)" for each in order), _MOST_MOTORS)
    limit = f"unknown name; known: {listed} (`unitcad list motors` lists all); for another motor leave part out"
    limit += " and give diameter_mm and thickness_mm"
    return Refusal(field, name, limit, order[0] if typed or meant else None)


_TYPED = 0.85
"""Least likeness of a name with the one that was meant, such as one with a wrong letter."""


@cache
def contacts() -> tuple[Contact, ...]:
    """Return the pairs of a fresh silicone and a surface of which a source is known.

    Examples
    --------
    >>> from unitcad import catalogue
    >>> [one.on for one in catalogue.contacts() if one.poured == "tin" and one.result == "inhibited"]
    ['platinum', 'sulphur clay']
    """
    return msgspec.convert(_raw("compatibility.toml")["contacts"], tuple[Contact, ...])


def contact(poured: Material, on: Material) -> Contact | None:
    """Return what a fresh silicone does on a cured one; None if no source says, or a chemistry is not known."""
    if poured.chemistry is None or on.chemistry is None:
        return None
    pair = poured.chemistry.value, on.chemistry.value
    return next((one for one in contacts() if (one.poured, one.on) == pair), None)


RESIN = "printed resin"
"""The surface of tools from a printer of resin: a printer's choice, so no item to keep away."""


def surface_contact(poured: Material, surface: str) -> Contact | None:
    """Return what a fresh silicone does on a surface that is no silicone; None if no source says.

    Examples
    --------
    >>> from unitcad import catalogue
    >>> catalogue.surface_contact(catalogue.materials()["ecoflex-00-30"], catalogue.RESIN).result
    'inhibited'
    """
    chemistry = poured.chemistry and poured.chemistry.value
    return next((one for one in contacts() if (one.poured, one.on) == (chemistry, surface)), None)


def inhibitors(silicones: Iterable[Material]) -> tuple[str, ...]:
    """Return the surfaces, other than silicones, on which one of these silicones does not cure."""
    chemistries = {each.chemistry.value for each in silicones if each.chemistry}
    found = [one for one in contacts() if one.result == "inhibited" and one.on not in (*CHEMISTRIES, RESIN)]
    return tuple(dict.fromkeys(one.on for one in found if one.poured in chemistries))


def needed(material: Material, key: str, use: str) -> Value[float]:
    """Return a value that a use can't do without; `use`: its subject, such as "casting".

    Raises `Refusal` if no source gives the value.
    """
    value: Value[float] | None = getattr(material, key)
    if value is None:
        raise Refusal(f"materials.{material.name}.{key}", None, f"no source gives it, and {use} needs it; {_OWN_ENTRY}")
    return value


_OWN_ENTRY = "give it in an entry of your own that is like this one"


def _entries(kind: type[_Entry], own: Mapping[str, Struct] | None) -> dict[str, _Entry]:
    file, field = _KINDS[kind]
    entries = dict(_read_shipped(kind))
    for name, table in (own or {}).items():
        given = _plain(table)
        base = given.get("like")
        if base is not None and base not in _raw(file):
            raise unknown_name(f"{field}.{name}.like", base, _raw(file))
        entries[name] = _entry(kind, name, _after(kind, given), f"{field}.{name}")
    return entries


def _after(kind: type[_Entry], table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a table, those of the shipped entry that it is `like`, if any, before its own."""
    base = table.get("like")
    if not base:
        return _with_sources(kind, table)
    return {**_after(kind, _raw(_KINDS[kind][0])[base]), **_with_sources(kind, table), "like": base}


@cache
def _read_shipped(kind: type[_Entry]) -> dict[str, _Entry]:
    file, field = _KINDS[kind]
    return {name: _entry(kind, name, _after(kind, table), f"{field}.{name}") for name, table in _raw(file).items()}


@cache
def _raw(file: str) -> dict[str, Any]:
    return parse_toml((files("unitcad.catalogue") / file).read_text("utf-8"), file)


def _plain(table: Any) -> dict[str, Any]:
    return msgspec.to_builtins(table)


def _with_sources(kind: type[Struct], table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a table, each with status and source."""
    default = {key: table[key] for key in ("status", "source") if key in table}
    return {
        key: {**default, **(raw if isinstance(raw, dict) else {"value": raw})}
        for key, raw in table.items()
        if key not in ("like", "status", "source")
    }


def _entry(kind: type[Struct], name: str, table: Mapping[str, Any], path: str) -> Any:
    """Return an entry from its table. Raises `Refusal` for missing values, or values outside their own range."""
    missing = [key for key in required_of(kind) if key not in ("name", *table)]
    if missing:
        others = f" with {', '.join(missing[1:])}" if missing[1:] else ""
        like = "" if kind is Tissue else ", or like with the name of a shipped entry"
        raise Refusal(f"{path}.{missing[0]}", None, f"is required{others}{like}")
    entry = msgspec.convert({"name": name, "like": table.get("like"), **_with_sources(kind, table)}, kind)
    for key, _ in kinds_of(kind):
        value = getattr(entry, key)
        if value is not None:
            _check_range(value, f"{path}.{key}")
    return entry


def _check_range(value: Value[Any], path: str) -> None:
    for end, wrong in (("low", lambda end: end > value.value), ("high", lambda end: end < value.value)):
        limit = getattr(value, end)
        if limit is not None and wrong(limit):
            most = "most" if end == "low" else "least"
            raise Refusal(f"{path}.{end}", limit, f"must be at {most} the value, {value.value}", value.value)
