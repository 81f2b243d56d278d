"""Files that ship with the package, and what a person names: one of them, or a file by its path."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path

from unitcad.errors import Refusal, WrongArgument, unknown_name
from unitcad.rooms import FileKind, expect_none_but, file_kinds, load, of_other_kind
from unitcad.spec.custom_code import is_body_file


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


def spelled(text: str, known: Iterable[str]) -> str:
    """Return a text that names a file by its path, or one of `known`; for NAME of a file NAME.toml here, NAME.toml."""
    own = f"{text}.toml"
    return own if text not in known and not is_path(text) and os.path.isfile(own) else text


def expect_kind(data: Mapping[str, object], source: str, kind: str) -> None:
    """Raise WrongArgument for an empty file, and for one of another kind, with the command that takes it."""
    if not data:
        raise WrongArgument(kind, source, f"is empty; `unitcad schema {kind}` lists its keys")
    expect_none_but(kind, data, source, kind, WrongArgument)


def named_file(text: str, known: Mapping[str, Path], field: str, kind: type[Refusal] = Refusal) -> Path:
    """Return the file that a text names, see `spelled`, there or not. Raises `kind`, of that field, for other text."""
    text = spelled(text, known)
    if text in known:
        return known[text]
    path = Path(text)
    if os.path.isdir(text):
        own = [file for file in (path / "spec.toml", path / "array.toml") if file.is_file()]
        raise kind(field, text, "is a folder; name a TOML file in it", str(own[0]) if own else None)
    if path.suffix != ".toml" and os.path.isfile(text) and (path.suffix or not is_path(text)):
        if is_body_file(text):
            raise kind(field, text, f'is a body: write design = "{text}" in a spec')
        raise kind(field, text, "is not a TOML file, whose name ends in .toml")
    if is_path(text) or path.suffix or not known:
        return path
    for other in file_kinds():
        if other.command and other.plural and text in shipped_of(other):
            raise of_other_kind(other, field, text, kind)
    raise unknown_name(field, text, known, kind)
