"""A commented spec to start from: a template, and below it every further key with its default, commented out."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from msgspec import NODEFAULT, UNSET, Struct
from msgspec.structs import FieldInfo

from unitcad.documents import read_toml
from unitcad.spec.fields import entry_in, fields_of, is_value, meaning, table_in

_NOT_OFFERED = ("design_source", "file_source", "fit_source")
_ABOUT_TABLES = (
    "# The tables below show the defaults; ... stands for a value from the catalogue.",
    "# To change a value, remove the # from its line and from its table's header.",
)


def comment_template(template: Path, name: str, model: type[Struct], schema: str) -> str:
    """Return a template's text under another name, with the further keys of its `model` commented out below.

    Its first line names the `schema` file for an editor.
    """
    there = read_toml(template)
    named = f"name = {json.dumps(name)}"
    text = re.sub(r"^name = .*$", named, template.read_text("utf-8"), count=1, flags=re.MULTILINE)
    sections = re.split(r"\n(?=\[)", text)
    tables = [section.rstrip() + "\n" + _further_keys(section, there, model) for section in sections]
    told = {*there, *re.findall(r"^# \[+(\w+)", text, re.MULTILINE)}
    return "\n".join([f"#:schema ./{schema}", *tables, _further_tables(told, model)])


def _further_keys(section: str, there: dict[str, Any], model: type[Struct]) -> str:
    """Return the keys that a table of the template leaves out, commented out."""
    if not section.startswith("["):
        tables = {name for name, field in fields_of(model).items() if not is_value(field.type)}
        return "".join(f"{line}\n" for line in _keys(model, {*there, *tables, *_describe(section)}))
    header = re.match(r"\[(\w+)\]", section)
    field = fields_of(model).get(header[1]) if header else None
    table = table_in(field.type) if field else None
    if not field or not table:
        return ""
    told = {*there[field.name], *_describe(section)}
    return "".join(f"{line}\n" for line in _keys(table, told))


def _describe(section: str) -> list[str]:
    return re.findall(r"^# (\w+) =", section, re.MULTILINE)


def _further_tables(told: set[str], model: type[Struct]) -> str:
    lines: list[str] = []
    for name, field in fields_of(model).items():
        if name in told or name in _NOT_OFFERED or is_value(field.type):
            continue
        table = table_in(field.type) or table_in(entry_in(field.type))
        about = f"  # {(table.__doc__ or '').partition(chr(10))[0]}" if table else _note(field)
        head = f"[[{name}]]" if table_in(entry_in(field.type)) else f"[{name}]"
        lines += ["", f"# {head}{about}", *(_keys(table, set()) if table else ())]
    if not lines:
        return ""
    return "\n".join([*_ABOUT_TABLES, *lines]) + "\n"


def _keys(table: type[Struct], given: set[str]) -> list[str]:
    return [
        f"# {key} = {'...' if field.required else _shown(field)}{_note(field)}"
        for key, field in fields_of(table).items()
        if key not in given and key not in _NOT_OFFERED
    ]


def _note(field: FieldInfo) -> str:
    text = meaning(field.type)
    return f"  # {text}" if text else ""


def _shown(field: FieldInfo) -> str:
    value = field.default if field.default is not NODEFAULT else field.default_factory()
    if value is UNSET:
        return "..."
    return json.dumps(list(value) if isinstance(value, tuple) else value).replace("null", "...")
