"""The form of a spec: a group for each table of its schema, with documented ranges, choices and current values."""

from __future__ import annotations

import re
import typing
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal

import msgspec
import tomlkit
from msgspec.structs import replace
from tomlkit.items import AoT, InlineTable

from unitcad.catalogue import Material, materials, motors, printers, tissues
from unitcad.designs import shipped
from unitcad.documents import editable_toml, parse_value
from unitcad.errors import Refusal, UnitcadError
from unitcad.serve.messages import Edit, Field, Group
from unitcad.spec import MOTOR_SIZES, Spec, to_data
from unitcad.spec.fields import alternatives, entry_in, fields_of, index_in, meaning, notes, title_of
from unitcad.spec.raw import (
    CastingTable,
    EstimateTable,
    FpcbTable,
    LayerTable,
    MotorTable,
    MouldsTable,
    OutputTable,
    RawSpec,
    WiresTable,
)
from unitcad.text import number, toml
from unitcad.validation.plain_data import ABSENT, at, no_entry

Choices = Mapping[str, list[tuple[str, str]]]
_TABLES = (
    ("motor", "Motor", MotorTable),
    ("fpcb", "Circuit", FpcbTable),
    ("wires", "Wires", WiresTable),
)
LAST_TABLES = (
    ("moulds", "Moulds", MouldsTable),
    ("casting", "Casting", CastingTable),
    ("estimate", "Estimate", EstimateTable),
    ("output", "Output", OutputTable),
)
_OPTIONAL = {"fpcb": "wires", "wires": "fpcb"}
"""Optional tables, each with the one that it replaces."""
_NEEDS = {"wires": {"diameter_mm": 0.3}}
"""Values of a new table: the wire of a small motor, across its insulation."""
_USE = {
    "diameter_mm": (5, 50),
    "layers.wall_mm": (0.5, 5),
    "layers.cap_mm": (0.5, 5),
    "motor.diameter_mm": (4, 15),
    "motor.thickness_mm": (1.5, 6),
    "motor.lip_mm": (0, 1.5),
    "fpcb.thickness_mm": (0.05, 0.3),
    "fpcb.tail_width_mm": (0.6, 8),
    "fpcb.tail_length_mm": (2, 50),
    "fpcb.pad_diameter_mm": (2, 20),
    "fpcb.tail_end_width_mm": (0.6, 12),
    "wires.diameter_mm": (0.1, 1),
    "wires.length_mm": (2, 50),
    "layout.pitch_mm": (8, 60),
    "sheet.thickness_mm": (0.5, 5),
    "sheet.margin_mm": (1, 20),
}
"""Ranges of use, which sliders have in place of the possible range; a value beyond widens its own."""
_UNITS = ("mm", "hz", "um", "g", "c", "kpa")
OF_SPEC = "of this spec"
"""Remark on an entry that the spec has itself."""
_TEXTS_OF_FILES = ("estimate.fit_source",)


def groups(data: Mapping[str, Any], spec: Spec | None) -> list[Group]:
    """Return the form of a spec's plain data; `spec` is the resolved one, None if the data is refused."""
    settled = to_data(spec) if spec else {}
    named = at(data, "motor.part")
    if not spec and isinstance(named, str) and (entry := motors().get(named)):  # which a refused spec has not settled
        sizes = {size: float(getattr(entry, size)) for size in MOTOR_SIZES}
        settled["motor"] = sizes | ({"drive": entry.drive.value} if entry.drive else {})
    choices = choices_of(data)
    made = [Group("", "Unit", [*fields(RawSpec, "", data, settled, choices, ("name", "design", "diameter_mm"))])]
    layers = data.get("layers")
    for i in range(len(layers) if isinstance(layers, list) else 0):
        made.append(
            Group(f"layers.{i}", f"Layer {i + 1}", [*fields(LayerTable, f"layers.{i}", data, settled, choices)])
        )
    return [*made, *table_groups((*_TABLES, *LAST_TABLES), data, settled, choices)]


def table_groups(
    tables: Sequence[tuple[str, str, type[msgspec.Struct]]],
    data: Mapping[str, Any],
    settled: Mapping[str, Any],
    choices: Choices,
) -> Iterator[Group]:
    """Yield a group for each of the tables (path, title, type); arguments as of `fields`."""
    for path, title, table in tables:
        optional = path in _OPTIONAL or data.get(path) is False  # motor = false
        present = not optional or isinstance(data.get(path), dict)
        shown = [*fields(table, path, data, settled, choices)] if present else []
        yield Group(path, title, shown, present, optional, _NEEDS.get(path, {}), _OPTIONAL.get(path, ""))


def fields(
    table: type[msgspec.Struct],
    path: str,
    data: Mapping[str, Any],
    settled: Mapping[str, Any],
    choices: Choices,
    only: tuple[str, ...] = (),
) -> Iterator[Field]:
    """Yield a field for each key of a table at a path.

    `data` is the text's data, `settled` the resolved data, `choices` the words by path, `only` the chosen keys.
    """
    for name, info in fields_of(table).items():
        where = f"{path}.{name}" if path else name
        if (only and name not in only) or where in _TEXTS_OF_FILES:
            continue
        given = at(data, where)
        default = None if info.default is msgspec.NODEFAULT else info.default
        value = next((one for one in (given, at(settled, where)) if one is not ABSENT and one is not None), default)
        entries = _numbers_of(info.type, value)
        if entries and value is not None:
            for i, (kind, one) in enumerate(zip(entries, value, strict=True)):
                label = f"{_label(name)} {title_of(kind) or i + 1}"
                made = _field(f"{where}.{i}", label, kind, one, given is not ABSENT, [])
                yield replace(made, required=info.required, meaning=meaning(info.type))
            continue
        made = _field(where, _label(name), info.type, value, given is not ABSENT, choices.get(_place(where), []))
        yield replace(made, required=info.required)


def _numbers_of(kind: Any, value: Any) -> tuple[Any, ...]:
    """Return the kinds of a list's entries if it has a fixed number of numbers; else none."""
    if not isinstance(value, list | tuple):
        return ()
    tuples = (typing.get_args(one) for one in alternatives(kind) if typing.get_origin(one) is tuple)
    fits = (one for one in tuples if len(one) == len(value) and Ellipsis not in one)
    entries = next(fits, ())
    numbers = all(isinstance(one, int | float) for one in value)
    return entries if numbers and all(float in alternatives(entry) for entry in entries) else ()


def _label(name: str) -> str:
    """Return a key in words, without its unit, which the page sets next to it."""
    words, _, last = name.rpartition("_")
    return (words if words and last in _UNITS else name).replace("_", " ")


def _place(path: str) -> str:
    """Return a path without its indices: layers.0.material as layers.material."""
    return ".".join(step for step in path.split(".") if not step.isdigit())


def _field(path: str, label: str, kind: Any, value: Any, given: bool, choices: list[tuple[str, str]]) -> Field:
    members = [one for one in alternatives(kind) if one is not type(None)]
    words = _words(kind)
    # One number for all entries of a list has their range.
    limits = [*notes(kind), *notes(entry_in(kind))]
    low = next((float(note.ge) for note in limits if note.ge is not None), None)
    high = next((float(note.le) for note in limits if note.le is not None), None)
    if (place := re.sub(r"\.\d+$", "", _place(path))) in _USE and low is not None and high is not None:
        now = [float(value)] if isinstance(value, int | float) else []
        low, high = max(low, min([_USE[place][0], *now])), min(high, max([_USE[place][1], *now]))
    how: Literal["number", "integer", "word", "words", "text", "switch", "toml"]
    listed = any(typing.get_origin(one) in (tuple, list, dict) for one in members)
    several = _words(entry_in(kind)) if listed and len(members) == 1 else []
    single = float in members and isinstance(value, int | float)
    mixed = str in members and bool({int, float} & set(members))
    if several:
        how, words = "words", several
    elif mixed or (listed and not single):
        # Lists, and values that may be a word or a number, are typed as TOML.
        how, value = "toml", None if value is None else toml(value)
    elif bool in members:
        how = "switch"
    elif float in members:
        how = "number"
    elif int in members:
        how = "integer"
    else:
        how = "word" if choices or words else "text"
    return Field(path, label, how, value, given, low, high, choices or words, meaning(kind))


def _words(kind: Any) -> list[tuple[str, str]]:
    """Return the words of which a value is one."""
    return [
        (word, "") for one in alternatives(kind) if typing.get_origin(one) is Literal for word in typing.get_args(one)
    ]


def choices_of(data: Mapping[str, Any]) -> Choices:
    """Return the words of each field that the catalogue or the shipped designs give."""
    own = {
        name: data[name] for name in ("materials", "motors", "printers", "tissue") if isinstance(data.get(name), dict)
    }

    def names(name: str) -> list[tuple[str, str]]:
        return [(each, OF_SPEC) for each in own.get(name, {})]

    return {
        "design": [(name, design.about) for name, design in shipped().items()],
        "layers.material": [*((name, _modulus(entry)) for name, entry in materials().items()), *names("materials")],
        "motor.part": [*((name, f"{number(entry.diameter_mm, 3)} mm across") for name, entry in motors().items()),
                       *names("motors")],
        "moulds.printer": [*((name, str(entry.technology.value)) for name, entry in printers().items()),
                           *names("printers")],
        "estimate.tissue": [*((name, "") for name in tissues()), *names("tissue")],
    }  # fmt: skip


def _modulus(entry: Material) -> str:
    """Return the remark on a material in the list: its small-strain modulus."""
    modulus = entry.youngs_modulus_kpa
    return f"{number(modulus.value, 3)} kPa" if modulus else "no modulus at small strain"


def edited(text: str, edits: Sequence[Edit]) -> str:
    """Return a TOML text after `edits`.

    Raises UnitcadError for a text that is no TOML, Refusal for a path through a missing key.
    """
    if not edits:
        return text
    document = editable_toml(text, "the text")
    for edit in edits:
        _apply(document, edit)
    return tomlkit.dumps(document)


def _apply(document: Any, edit: Edit) -> None:
    *way, last = edit.path.split(".")
    node = document
    for step in way:
        if not isinstance(node, dict):
            node = node[_index(node, step, edit)]
            continue
        if step == "unit" and isinstance(node.get(step), str):
            # A unit that an array names is the `like` of the table that changes it.
            named = tomlkit.inline_table()
            named["like"] = str(node[step])
            named.comment(node[step].trivia.comment)
            node[step] = named
        if step not in node:
            if edit.remove:
                return
            node[step] = tomlkit.inline_table() if isinstance(node, InlineTable) else tomlkit.table()
        node = node[step]
    if isinstance(node, dict):
        if edit.remove:
            node.pop(last, None)
        else:
            node[last] = _item(_value(edit))
    elif edit.remove:
        del node[_index(node, last, edit)]
    elif isinstance(node, AoT) and not isinstance(edit.value, dict):
        raise Refusal(edit.path, edit.value, "the entries of this list are tables")
    elif isinstance(node, list) and last == str(len(node)):
        node.append(_item(_value(edit)))
    else:
        node[_index(node, last, edit)] = _value(edit)


def _index(node: Any, step: str, edit: Edit) -> int:
    if not isinstance(node, list):
        raise Refusal(edit.path, edit.value, "the path runs through a value, not a table")
    index = index_in(step, len(node))
    if index is None:
        raise no_entry(edit.path, edit.value, step, len(node))
    return index


def _value(edit: Edit) -> Any:
    """Return an edit's value, parsed if it is a text in TOML syntax."""
    if not edit.toml:
        return edit.value
    try:
        return parse_value(str(edit.value))
    except UnitcadError:
        raise Refusal(edit.path, edit.value, "is no TOML value; a list is [2, 3], a word in quotes") from None


def _item(value: Any) -> Any:
    """Return a value as TOML has it; a table comes on lines of its own."""
    if isinstance(value, dict):
        table = tomlkit.table()
        for key, each in value.items():
            table[key] = _item(each)
        return table
    return value
