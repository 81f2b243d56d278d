"""The inventory: everything that a person can name. `python -m docs.inventory` writes docs/reference/inventory.md.

`tests/whole/test_inventory.py` compares the page with the package. A line that vanished must stand under "Removed" in
CHANGELOG.md; a line that is new may wait until a release writes the page again.
"""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import typer
from msgspec import Struct
from msgspec.structs import FieldInfo

import unitcad
from docs.generated import FILES, tables
from docs.released import PAGE
from unitcad import catalogue
from unitcad.arrays.layouts import layouts
from unitcad.checks import mould_checks
from unitcad.cli.command_line import app
from unitcad.designs import shipped
from unitcad.lab.record import RULES
from unitcad.meshcheck.rules.registry import rules
from unitcad.rooms import commands, file_kinds, load
from unitcad.spec.fields import fields_of, values_of
from unitcad.validation.load import shipped_of

MODULES = ("unitcad", "unitcad.attenuation", "unitcad.arrays", "unitcad.shape", "unitcad.meshcheck", "unitcad.sweeps")
"""Modules whose `__all__` is public."""
_FILE_NAME = re.compile(r"[\w*][\w.*-]*\.(?:csv|dxf|glb|html|json|md|parquet|pdf|png|step|stl|svg|toml|3mf)")


def inventory() -> dict[str, list[str]]:
    """Return the lines of the inventory by section."""
    return {
        "Commands and options": list(_options()),
        "Keys of files": list(_keys()),
        "Shipped files": sorted({f"{kind}: {name}" for kind, name in _shipped()}),
        "Catalogue": list(_entries()),
        "Checks and rules": [*mould_checks(), *rules(), *RULES],
        "Names of files": sorted(set(_file_names())),
        "Python": list(_python()),
    }


def page() -> str:
    """Return the inventory as a page, each number's key with its range."""
    lines = ["# Inventory", "", "Every name that a person can use. `python -m docs.inventory` writes this page."]
    of = ranges()
    for section, entries in inventory().items():
        lines += ["", f"## {section}", "", *(f"- `{one}`" + (f": {of[one]}" if one in of else "") for one in entries)]
    return "\n".join(lines) + "\n"


def _options() -> Iterator[str]:
    group = typer.main.get_command(app)
    context = typer.Context(group, info_name="unitcad")
    for name in commands():
        command: Any = group.get_command(context, name)  # type: ignore[attr-defined]
        for one in (command, *getattr(command, "commands", {}).values()):
            words = f"unitcad {name}" if one is command else f"unitcad {name} {one.name}"
            yield words
            for parameter in one.params:
                yield from (f"{words} {option}" for option in parameter.opts if option.startswith("-"))


def ranges() -> dict[str, str]:
    """Return the range of every key of a file that takes a number in one."""
    said = ((line, values_of(field.type)) for line, field in _fields())
    return {line: values for line, values in said if re.search(r"\d", values)}


def _keys() -> Iterator[str]:
    yield from (line for line, _ in _fields())


def _fields() -> Iterator[tuple[str, FieldInfo]]:
    for kind in FILES:
        for header, table in tables(load(kind.model)):
            for key, field in fields_of(table).items():
                yield f"{kind.name}: {header} {key}".replace("  ", " "), field
    for layout in layouts().values():
        for key, field in fields_of(layout.table).items():
            yield f'array: [layout] kind = "{layout.name}": {key}', field


def _shipped() -> Iterator[tuple[str, str]]:
    yield from (("design", name) for name in shipped())
    for kind in filter(lambda kind: kind.plural, file_kinds()):
        yield from ((kind.name, name) for name in shipped_of(kind))


def _entries() -> Iterator[str]:
    tables = {
        "materials": catalogue.materials,
        "motors": catalogue.motors,
        "printers": catalogue.printers,
        "tissue": catalogue.tissue,
        "touch": catalogue.touch,
    }
    for name, entries in tables.items():
        yield from (f"{name}: {entry}" for entry in sorted(getattr(one, "name", one) for one in entries()))


def _file_names() -> Iterator[str]:
    """Yield the names of files in the package's strings; * stands for the value of an f-string."""
    for module in Path(unitcad.__file__ or "").parent.rglob("*.py"):
        for node in ast.walk(ast.parse(module.read_text("utf-8"))):
            text = ""
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                text = node.value
            elif isinstance(node, ast.JoinedStr):
                text = "".join(str(part.value) if isinstance(part, ast.Constant) else "*" for part in node.values)
            if len(text) < 60 and _FILE_NAME.fullmatch(name := text.rpartition("/")[2]) and "unitcad." not in name:
                yield name


def _python() -> Iterator[str]:
    for module in MODULES:
        for name in sorted(import_module(module).__all__):
            value = getattr(import_module(module), name)
            yield f"{module}.{name}"
            if inspect.isfunction(value):
                yield from (f"{module}.{name}({parameter}=)" for parameter in inspect.signature(value).parameters)
            elif isinstance(value, type):
                fields = value.__struct_fields__ if issubclass(value, Struct) else getattr(value, "__annotations__", ())
                public = {*fields, *vars(value)}
                yield from (f"{module}.{name}.{one}" for one in sorted(public) if not one.startswith("_"))


if __name__ == "__main__":
    PAGE.write_text(page(), "utf-8")
