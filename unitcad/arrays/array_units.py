"""The units of an array file as plain data: what `like` names, with the other keys in place of its own."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from unitcad.arrays.array_names import array_templates
from unitcad.errors import Refusal
from unitcad.spec import read_toml
from unitcad.spec.custom_code import with_source
from unitcad.validation import custom_templates, templates
from unitcad.validation.dotted import at
from unitcad.validation.load import changed, override
from unitcad.validation.shipped_files import named_file

_UNIT = re.compile(r"((?:place\.\d+\.)?unit)(?:\.(.+))?")
"""The path of a unit, or of a value in it."""


def with_changes(
    written: Mapping[str, Any], file: Mapping[str, Any], changes: Iterable[str | tuple[str, Any]]
) -> dict[str, Any]:
    """Return an expanded array's plain data with changes by `changes_of` put in: those of values in units last.

    `file`: the data as the file has it, of which a unit whose `like` is changed keeps its other keys.
    """
    whole, inside = override(written, ()), []
    for change in changes:
        path = (change.partition("=")[0] if isinstance(change, str) else change[0]).strip()
        unit = _UNIT.fullmatch(path)
        if unit is None:
            whole = changed(whole, [change])
        elif unit[2] in (None, "like"):
            value = at(changed({}, [change]), path)
            if unit[2]:
                own = at(file, unit[1])
                value = {**(own if isinstance(own, dict) else {}), "like": value}
            whole = changed(whole, [(unit[1], unit_data(value, unit[1], Path()))])
        else:
            inside.append(change)
    return changed(whole, inside)


def expanded(data: Mapping[str, Any], folder: Path = Path()) -> dict[str, Any]:
    """Return an array's plain data with the whole spec of each unit in it. Raises Refusal for a unit not found."""
    whole = copy.deepcopy(dict(data))
    if "unit" in whole:
        whole["unit"] = unit_data(whole["unit"], "unit", folder)
    places = whole.get("place")
    for i, place in enumerate(places if isinstance(places, list) else ()):
        if isinstance(place, dict) and "unit" in place:
            place["unit"] = unit_data(place["unit"], f"place.{i}.unit", folder)
    return whole


def unit_data(given: Any, field: str, folder: Path) -> Any:
    """Return the plain data of a unit's spec: what `like` names, with the other keys in place of its own."""
    at_field = field if isinstance(given, str) else f"{field}.like"
    if isinstance(given, str):
        given = {"like": given}
    if not isinstance(given, dict) or "like" not in given:
        return with_source(given, folder) if isinstance(given, dict) else given
    own = {key: value for key, value in given.items() if key != "like"}
    if not isinstance(given["like"], str):
        raise Refusal(at_field, given["like"], "takes a text: the name of a template, or a spec file")
    known = templates() | custom_templates()
    if given["like"] in array_templates() and given["like"] not in known:
        raise Refusal(at_field, given["like"], "is an array; a unit is a single one")
    path = named_file(given["like"], known, at_field)
    if path not in known.values():
        path = folder / path
        if not path.is_file():
            raise Refusal(at_field, given["like"], f"there is no file {path}")
    base = with_source(read_toml(path), path.parent)
    return merged(base, with_source(own, folder))


def merged(base: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Return a table with the keys of another in place of its own, and so the tables in it."""
    result = dict(base)
    for key, value in own.items():
        there = result.get(key)
        result[key] = merged(there, value) if isinstance(there, dict) and isinstance(value, dict) else value
    return result
