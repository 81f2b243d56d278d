"""Files that ship with the package, and what a person names: one of them, or a file by its path."""

from __future__ import annotations

import os
import shlex
from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path

from unitcad.errors import Refusal, WrongArgument, unknown_name
from unitcad.rooms import FileKind, file_kinds, load


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


def kind_of(data: Mapping[str, object]) -> FileKind | None:
    """Return the kind of a TOML file by its top-level keys."""
    return next((kind for kind in file_kinds() if kind.keys and all(key in data for key in kind.keys)), None)


def expect_kind(data: Mapping[str, object], source: str, kind: str) -> None:
    """Raise WrongArgument for an empty file, and for one of another kind, with the command that takes it."""
    if not data:
        raise WrongArgument(kind, source, f"is empty; `unitcad schema {kind}` lists its keys")
    found = kind_of(data)
    if found and found.name != kind and found.command:
        raise _other_kind(found, kind, source, WrongArgument)


def _other_kind(found: FileKind, field: str, source: str, kind: type[Refusal]) -> Refusal:
    article = "an" if found.name[0] in "aeiou" else "a"
    return kind(field, source, f"is {article} {found.name}: run {found.command} {shlex.quote(source)}")


def named_file(text: str, known: Mapping[str, Path], field: str, kind: type[Refusal] = Refusal) -> Path:
    """Return the file that a text names, see `spelled`. Raises `kind`, of that field, for any other text."""
    text = spelled(text, known)
    if text in known:
        return known[text]
    if is_path(text):
        return Path(text)
    for other in file_kinds():
        if other.command and other.plural and text in shipped_of(other):
            raise _other_kind(other, field, text, kind)
    if Path(text).is_dir():
        raise kind(field, text, "is a folder; name a TOML file in it")
    if Path(text).is_file():
        raise kind(field, text, "is not a TOML file, whose name ends in .toml")
    raise unknown_name(field, text, known, kind)
