"""Arguments of Python functions: a wrong type is refused in one sentence."""

# pyright: strict
from __future__ import annotations

import os
from collections.abc import Iterable
from numbers import Integral, Real
from typing import cast

from unitcad.errors import WrongArgument


def texts(name: str, given: object) -> list[str]:
    """Return a list's texts; a single text is a list of one. Raises WrongArgument for anything else."""
    if isinstance(given, str):
        return [given]
    entries = list(cast("Iterable[object]", given)) if isinstance(given, Iterable) else [given]
    for entry in entries:
        if not isinstance(entry, str):
            raise WrongArgument(name, entry, f"takes a text or a list of texts, not {type(entry).__name__}")
    return cast("list[str]", entries)


def path(name: str, given: object) -> str:
    """Return the text of a path, a text or os.PathLike. Raises WrongArgument for anything else."""
    if not isinstance(given, str | os.PathLike):
        raise WrongArgument(name, given, f"takes a path, not {type(given).__name__}")
    return os.fspath(cast("str | os.PathLike[str]", given))


def check_number(name: str, given: object, least: float, most: float, whole: bool = False) -> None:
    """Check a number, which may be None. Raises WrongArgument for anything else, or a number out of range."""
    if given is None:
        return
    number = given if isinstance(given, Integral if whole else Real) else None
    if number is None or isinstance(given, bool) or not least <= cast("float", number) <= most:
        noun = "a whole number" if whole else "a number"
        raise WrongArgument(name, given, f"must be {noun} from {least:g} to {most:g}", least)


def confirm_form(text: str) -> str:
    """Return a change as it is. Raises WrongArgument for one that has another form than path=value."""
    path, equals, _ = text.partition("=")
    if not equals or not path.strip():
        raise WrongArgument("set", text, "needs the form path=value in one word, such as layers.0.wall_mm=1.0")
    return text
