"""The cupboard on the live page: pickers offer what a person has, and his own entries go into the spec that names one.

A value that the text has, and entries of the spec itself, stay in the list.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from typing import Any

import tomlkit
from msgspec import structs, to_builtins

from unitcad.documents import editable_toml
from unitcad.serve.form import OF_SPEC
from unitcad.serve.messages import Group, Held
from unitcad.validation.cupboard import held, read_cupboard

KINDS = {"material": "materials", "part": "motors", "printer": "printers"}
"""Kinds of entries by the last key of a path that names one."""
OF_CUPBOARD = "of your cupboard"


def held_in(path: str | os.PathLike[str]) -> Held:
    """Return what a cupboard holds. Raises Refusal or UnitcadError as `read_cupboard`."""
    cupboard = read_cupboard(path)
    own = {kind: to_builtins(getattr(cupboard, kind)) for kind in KINDS.values()}
    return Held({kind: list(entries) for kind, entries in held(path).items()}, own)


def offered(groups: Sequence[Group], known: Held, unit: bool) -> list[Group]:
    """Return a form whose pickers offer only what is held; own entries only for a `unit`, whose text takes them."""
    if known.names is None:
        return list(groups)
    made = []
    for group in groups:
        fields = []
        for field in group.fields:
            kind = KINDS.get(field.path.rpartition(".")[2])
            if kind and field.choices:
                names, own = known.names[kind], known.own[kind]
                kept = [one for one in field.choices if one[0] in names or one[1] == OF_SPEC or one[0] == field.value]
                there = {name for name, _ in kept}
                kept += [(name, OF_CUPBOARD) for name in own if unit and name not in there]
                fields.append(structs.replace(field, choices=kept))
            else:
                fields.append(field)
        made.append(structs.replace(group, fields=fields))
    return made


def with_entries(text: str, data: Mapping[str, Any], known: Held) -> str:
    """Return a unit's text with the cupboard's entries that it names and lacks."""
    if known.names is None:
        return text
    layers = data.get("layers")
    tables = [*(layers if isinstance(layers, list) else []), data.get("motor"), data.get("moulds")]
    wanted = list[tuple[str, str]]()
    for table in tables:
        for key, kind in KINDS.items():
            name = table.get(key) if isinstance(table, Mapping) else None
            present = data.get(kind)
            if isinstance(name, str) and name in known.own[kind] and name not in (present or {}):
                wanted.append((kind, name))
    if not wanted:
        return text
    document = editable_toml(text, "spec")
    for kind, name in dict.fromkeys(wanted):
        if kind not in document:
            document.append(kind, tomlkit.table(is_super_table=True))
        document[kind][name] = known.own[kind][name]  # type: ignore[index]
    return tomlkit.dumps(document)
