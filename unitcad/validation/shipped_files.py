"""Files that ship with the package, and what a person names: one of them, or a file by its path."""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

from unitcad.errors import Refusal, unknown_name
from unitcad.rooms import FileKind, load


def shipped_files(kind: str = "") -> dict[str, Path]:
    """Return the TOML files in the templates' folder, or in its folder `kind`, by name."""
    package = Path(str(files("unitcad")))
    folder = next((f for f in (package / "templates", package.parent / "templates") if f.is_dir()), package)
    return {file.stem: file for file in sorted((folder / kind).glob("*.toml"))}


def shipped_of(kind: FileKind) -> dict[str, Path]:
    """Return the shipped files of a kind by name."""
    return load(kind.shipped)() if kind.shipped else shipped_files(kind.plural)


def is_path(text: str) -> bool:
    """Whether a text names a file by its path (a path separator in it, or .toml at its end), not by a bare name."""
    return os.sep in text or "/" in text or text.endswith(".toml")


def named_file(text: str, known: Mapping[str, Path], field: str, kind: type[Refusal] = Refusal) -> Path:
    """Return the file that a text names: one of `known`, or a path. Raises `kind`, of that field, for neither."""
    if text in known:
        return known[text]
    if is_path(text):
        return Path(text)
    if Path(text).is_dir():
        raise kind(field, text, "is a folder; name a TOML file in it")
    if Path(text).is_file():
        raise kind(field, text, "is not a TOML file, whose name ends in .toml")
    raise unknown_name(field, text, known, kind)
