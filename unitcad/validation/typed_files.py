"""TOML files of one kind: every fault of a file with its line."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from unitcad.errors import Refusal, UnknownKey
from unitcad.files import read_text
from unitcad.rooms import file_kinds
from unitcad.spec import read_toml
from unitcad.spec.toml_lines import line_of
from unitcad.validation.shipped_files import expect_kind, shipped_of
from unitcad.validation.suggestions import every_fault

T = TypeVar("T")


def load_file(path: Path, kind: str, judge: Callable[[dict[str, Any]], T]) -> T:
    """Return the result of `judge` for the data of a TOML file of a kind.

    Raises Refusal with the file's other faults, each with file and line; WrongArgument for a file of another kind.
    """
    data = read_toml(path)
    expect_kind(data, str(path), kind)
    try:
        return judge(data)
    except Refusal as first:
        every = every_fault(first, data, judge, _sound(kind))
        text = read_text(path)
        for i, one in enumerate(every):
            if isinstance(one, UnknownKey):
                limit = one.limit.replace("`unitcad schema`", f"`unitcad schema {kind}`")
                every[i] = one = UnknownKey(one.field, one.value, limit, one.nearest)
            one.file, one.line = os.fspath(path), line_of(text, one.field)
        every[0].others = tuple(every[1:])
        raise every[0] from None


def _sound(kind: str) -> dict[str, Any]:
    """Return the data of a shipped file of a kind; {} if none is shipped."""
    shipped = [file for one in file_kinds() if one.name == kind and one.plural for file in shipped_of(one).values()]
    return read_toml(shipped[0]) if shipped else {}
