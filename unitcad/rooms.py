"""The rooms: packages of unitcad that the core works without.

The core names no room. A room states its additions in files of known names, which this module finds:
`commands.py` defines COMMANDS (the function of each command, as "module:name") and FILE_KINDS.
"""

from __future__ import annotations

import runpy
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

_CORE = "cli"
"""The package whose additions come first."""


@dataclass(frozen=True)
class FileKind:
    """A kind of TOML file: `unitcad list PLURAL`, `unitcad schema NAME`, and a start for `unitcad init`."""

    name: str
    plural: str = ""
    """The name in `unitcad list`; empty if none is shipped."""
    shipped: str = ""
    """"module:name" of the function that returns the shipped files by name."""
    model: str = ""
    """"module:name" of the msgspec Struct of the file; empty for a kind without a schema."""
    schema: str = ""
    """"module:name" of the function that returns the JSON Schema; default: the schema of `model`."""
    command: str = ""
    """The command that takes the file; empty if `unitcad init` does not write one."""


def load(reference: str) -> Any:
    """Return the object that "module:name" refers to."""
    module, _, name = reference.partition(":")
    return getattr(import_module(module), name)


def provided(file: str) -> list[dict[str, Any]]:
    """Return the names that each room's file of this name defines: the core first, then the rooms by name.

    The file is run by itself, so that finding an addition does not load its room.
    """
    found = sorted(Path(__file__).parent.glob(f"*/{file}"), key=lambda path: (path.parent.name != _CORE, path))
    return [runpy.run_path(str(path)) for path in found]


@cache
def _commands_files() -> list[dict[str, Any]]:
    return provided("commands.py")


def commands() -> dict[str, str]:
    """Return the function of each command of the command line, as "module:name"."""
    return {name: reference for file in _commands_files() for name, reference in file["COMMANDS"].items()}


def file_kinds() -> tuple[FileKind, ...]:
    """Return the kinds of TOML files."""
    return tuple(kind for file in _commands_files() for kind in file["FILE_KINDS"])
