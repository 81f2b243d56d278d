"""The rooms: packages of unitcad that the core works without.

The core names no room. A room states its additions in its `room.toml`: the functions of its commands as "module:name",
the kinds of TOML files that it knows, and a function that makes moulds (`moulds.plan`).
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from unitcad.documents import read_toml
from unitcad.errors import Refusal
from unitcad.text import with_article

_CORE = "cli"
"""The package whose additions come first."""


@dataclass(frozen=True)
class Command:
    """A command of the command line, with its line in `unitcad --help`."""

    run: str
    """"module:name" of its function, or of its Typer application."""
    group: str
    help: str
    examples: tuple[str, ...] = ()
    """Command lines at the end of its help."""


@dataclass(frozen=True)
class FileKind:
    """A kind of TOML file: `unitcad list PLURAL`, `unitcad schema NAME`, and a start for `unitcad init`."""

    name: str
    plural: str = ""
    """The name in `unitcad list`, and the folder of templates; empty if none is shipped."""
    shipped: str = ""
    """"module:name" of the function that returns the shipped files by name; default: those of the folder."""
    model: str = ""
    """"module:name" of the msgspec Struct of the file; empty for a kind without a schema."""
    schema: str = ""
    """"module:name" of the function that returns the JSON Schema; default: the schema of `model`."""
    command: str = ""
    """The command that takes the file; empty if none does."""
    starts: bool = False
    """Whether `unitcad init` writes one."""
    keys: tuple[str, ...] = ()
    """The top-level keys by which a file is known to be of this kind."""
    estimate: str = ""
    """"module:name" of the function that prints the file's estimate, if it is not a unit's."""
    subject: str = ""
    """"module:name" of the `pipeline.subject.Compound` that the file describes, if it describes one."""
    page: str = ""
    """The module with the file's part of the live page, if it has one."""


@cache
def _rooms() -> list[dict[str, Any]]:
    """Return the additions of the core, then those of the rooms by name."""
    paths = sorted(Path(__file__).parent.glob("*/room.toml"), key=lambda path: (path.parent.name != _CORE, path))
    return [read_toml(path) for path in paths]


def _with_tuples(table: dict[str, Any]) -> dict[str, Any]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in table.items()}


def load(reference: str) -> Any:
    """Return the object that "module:name" refers to."""
    module, _, name = reference.partition(":")
    return getattr(import_module(module), name)


@cache
def commands() -> dict[str, Command]:
    """Return the commands of the command line by name."""
    every = (pair for room in _rooms() for pair in room.get("commands", {}).items())
    return {name: Command(**_with_tuples(table)) for name, table in every}


@cache
def file_kinds() -> tuple[FileKind, ...]:
    """Return the kinds of TOML files."""
    return tuple(FileKind(**_with_tuples(table)) for room in _rooms() for table in room.get("files", ()))


@cache
def mould_makers() -> tuple[str, ...]:
    """Return "module:name" of each room's function that makes moulds for a body by more ways than the core's."""
    return tuple(room["moulds"] for room in _rooms() if "moulds" in room)


def kind_of(data: Mapping[str, object]) -> FileKind | None:
    """Return the kind of a TOML file, known by the keys of its data."""
    return next((kind for kind in file_kinds() if kind.keys and all(key in data for key in kind.keys)), None)


def expect_none_but(
    wanted: str, data: Mapping[str, object], source: str, field: str, refused: type[Refusal] = Refusal
) -> None:
    """Raise `refused`, of a field, for a file of another kind than `wanted`, known by the keys of its data."""
    found = kind_of(data)
    if found and found.name != wanted and found.command:
        raise of_other_kind(found, field, source, refused)


def of_other_kind(found: FileKind, field: str, source: str, refused: type[Refusal]) -> Refusal:
    """Return the refusal of a file by its kind, with the command that takes it."""
    return refused(field, source, f"is {with_article(found.name)}: run {found.command} {shlex.quote(source)}")
