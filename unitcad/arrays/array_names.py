"""Which names and files mean an array: all that a command needs to know to leave the rest of the arrays alone."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from unitcad.errors import Refusal, UnitcadError, WrongArgument
from unitcad.spec import read_toml
from unitcad.validation import custom_templates, templates
from unitcad.validation.shipped_files import is_path, named_file, shipped_files


def array_templates() -> dict[str, Path]:
    """Return the shipped arrays by name."""
    return shipped_files("arrays")


def is_array(source: object) -> bool:
    """Tell whether a name, a file or plain data means an array. A file that can't be read means none."""
    if isinstance(source, Mapping):
        return "array" in source
    if not isinstance(source, str | os.PathLike):
        from unitcad.arrays.array import Array

        return isinstance(source, Array)
    text = os.fspath(source)
    if text in array_templates():
        return text not in templates()
    if not is_path(text):
        return False
    try:
        return "array" in read_toml(Path(text))
    except (UnitcadError, OSError):
        return False


def confirm_known(name: str, field: str = "spec", kind: type[Refusal] = WrongArgument) -> None:
    """Raise `kind`, of that field, for a name of neither a unit's template nor an array's, and no file's path."""
    named_file(name, templates() | custom_templates() | array_templates(), field, kind)
