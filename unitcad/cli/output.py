"""Output of the commands: one JSON object on standard output, or lines for a person; errors on standard error."""

from __future__ import annotations

import contextlib
import io
import json
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Literal

import typer

from unitcad.errors import Refusal, UnitcadError, WrongArgument
from unitcad.text import printable


def print_json(data: Any) -> None:
    """Write `data` as the one JSON object on standard output. Raises ValueError for NaN and infinity."""
    encoding = (getattr(sys.stdout, "encoding", None) or "").lower().replace("-", "")
    ascii_only = encoding not in ("utf8", "utf16", "utf32")
    sys.stdout.write(json.dumps(data, indent=2, allow_nan=False, ensure_ascii=ascii_only) + "\n")


def print_json_line(data: Any) -> None:
    """Write `data` as one line of JSON on standard output, at once."""
    sys.stdout.write(json.dumps(data) + "\n")
    sys.stdout.flush()


Form = Literal["text", "object", "lines"]
"""What a command writes on standard output: for a person, one JSON object, or one a line."""


def form_of(words: Sequence[str]) -> Form:
    """Return the requested form of the output."""
    if "--json-lines" in words:
        return "lines"
    return "object" if "--json" in words else "text"


def speak_anywhere() -> None:
    """Make standard output and error write the code of a character that their encoding lacks."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def say_error(error: UnitcadError, form: Form) -> None:
    """Print an error: a line for each fault on standard error and, but for a person, JSON on standard output."""
    if isinstance(error, WrongArgument):
        option = error.field.replace("_", "-")
        name, value = _ARGUMENTS.get(error.field, f"--{option}"), error.value
        if isinstance(value, bool):  # an option without a value
            name, value = f"--{'' if value else 'no-'}{option}", None
        error = Refusal(name, value, error.limit, error.nearest)
    if isinstance(error, Refusal):
        every = sorted((error, *error.others), key=lambda one: one.line or sys.maxsize)
        lines = [one.located for one in every]
    else:
        lines = [str(error)]
    for line in lines:
        more = f"... ({len(line) - _LONGEST} more characters)" if len(line) > _LONGEST else ""
        sys.stderr.write(f"error: {printable(line[:_LONGEST])}{more}\n")
    if form == "object":
        print_json({"error": error.as_dict()})
    elif form == "lines":
        print_json_line({"event": "error", "error": error.as_dict()})


_LONGEST = 2000
"""Characters of an error that are printed."""
_ARGUMENTS = {
    "spec": "SPEC", "sweep": "SWEEP", "phantom": "PHANTOM", "target": "TARGET", "hash": "HASH",
    "campaign": "CAMPAIGN", "fit": "LAB",
}  # fmt: skip
"""What the command line calls parameters that are no options, or options of another name."""


def warn(line: str) -> None:
    """Print a line on standard error; control characters are written as escapes."""
    sys.stderr.write(printable(line) + "\n")


def print_indented(*lines: str) -> None:
    """Print each line below its head or its table."""
    for line in lines:
        typer.echo(f"  {printable(line)}")


def print_head(name: str, rest: str) -> None:
    """Print a name, bold on a terminal, and the rest of its line."""
    typer.echo(f"{typer.style(printable(name), bold=True)}{printable(rest)}")


def level(quantity: dict[str, Any] | None, factor: float = 1.0, digits: int = 3) -> str:
    """Format a value with its range, or the one of the two that there is; a level next to nothing as below 0.01 %."""
    if not quantity:
        return "-"
    scaled = [None if quantity.get(key) is None else factor * quantity[key] for key in ("value", "low", "high")]
    value, low, high = (
        one if one is None else "below 0.01" if factor == 100 and one < 0.01 else f"{one:.{digits}g}" for one in scaled
    )
    spread = f"{low} to {high}" if low and high and low != high else ""
    if value:
        return f"{value} ({spread})" if spread else value
    return spread or "not known"


STAGES = "UNITCAD_STAGES"
"""Environment variable: the text with which a command begins a line on standard error for each stage of its work."""


def stage_lines() -> Callable[[str], None] | None:
    """Return the function that prints a stage as a line for the program that started this one; None if none reads."""
    mark = os.environ.get(STAGES)
    return (lambda stage: warn(f"{mark}{stage}")) if mark else None


@contextlib.contextmanager
def progress(name: str) -> Iterator[Callable[[str], None]]:
    """Show a spinner with the stage on a terminal, nothing in a pipe; yield the function that sets the stage."""
    lines = stage_lines()
    if lines or not sys.stderr.isatty():
        yield lines or (lambda stage: None)
        return
    from unitcad.cli.tables import spinner

    with spinner(name) as say:
        yield say
