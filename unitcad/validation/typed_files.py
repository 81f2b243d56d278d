"""TOML files of one kind: every fault of a file with its line."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from unitcad.errors import Refusal, UnknownKey, WrongArgument
from unitcad.files import read_text
from unitcad.rooms import file_kinds
from unitcad.spec import read_toml
from unitcad.spec.toml_lines import line_of
from unitcad.validation.shipped_files import expect_kind, named_file, shipped_of
from unitcad.validation.suggestions import every_fault

T = TypeVar("T")


def load_file(source: str | os.PathLike[str], kind: str, judge: Callable[[dict[str, Any], Path], T]) -> T:
    """Return the result of `judge` for data and path of a TOML file of a kind: one by its path, or a shipped one.

    Raises Refusal with the file's other faults, each with file and line; WrongArgument for a file of another kind.
    """
    shipped = next(shipped_of(one) if one.plural else {} for one in file_kinds() if one.name == kind)
    path = named_file(os.fspath(source), shipped, kind, WrongArgument)
    data = read_toml(path)
    expect_kind(data, str(path), kind)
    try:
        return judge(data, path)
    except Refusal as first:
        sound = read_toml(next(iter(shipped.values()))) if shipped else {}
        every = every_fault(first, data, lambda data: judge(data, path), sound)
        text = read_text(path)
        for i, one in enumerate(every):
            if isinstance(one, UnknownKey):
                limit = one.limit.replace("`unitcad schema`", f"`unitcad schema {kind}`")
                every[i] = one = UnknownKey(one.field, one.value, limit, one.nearest)
            one.file, one.line = os.fspath(path), line_of(text, one.field)
        every[0].others = tuple(every[1:])
        raise every[0] from None
