"""Options that several commands share, and output: one JSON object or lines for a person; errors on standard error."""

from __future__ import annotations

import contextlib
import io
import json
import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from rich.console import Console
from rich.text import Text

from unitcad.errors import Refusal, UnitcadError, WrongArgument, confirm_form, unknown_name
from unitcad.spec import design_files
from unitcad.spec.raw import FORMATS, OUTPUTS
from unitcad.text import printable
from unitcad.workers import STAGES


def print_json(data: Any) -> None:
    """Write `data` as the one JSON object on standard output. Raises ValueError for NaN and infinity."""
    sys.stdout.write(json.dumps(data, indent=2, allow_nan=False, ensure_ascii=not _unicode(sys.stdout)) + "\n")


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


def _unicode(stream: Any) -> bool:
    return (getattr(stream, "encoding", None) or "").lower().replace("-", "") in ("utf8", "utf16", "utf32")


def say_error(error: UnitcadError, form: Form) -> None:
    """Print an error: a line for each fault on standard error and, but for a person, JSON on standard output."""
    if isinstance(error, WrongArgument):
        name, value = _ARGUMENTS.get(error.field, f"--{error.field}"), error.value
        if isinstance(value, bool):  # an option without a value
            name, value = f"--{'' if value else 'no-'}{error.field}", None
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
    "spec": "SPEC", "sweep": "SWEEP", "phantom": "PHANTOM", "target": "TARGET", "hash": "HASH", "tables": "--table",
    "campaign": "CAMPAIGN", "fit": "LAB",
}  # fmt: skip
"""What the command line calls parameters that are no options, or options of another name."""


def warn(line: str) -> None:
    """Print a line on standard error; control characters are written as escapes."""
    sys.stderr.write(printable(line) + "\n")


def console(stderr: bool = False) -> Console:
    """Return a rich console. Text is shown as it is: a name may hold square brackets, or colons that spell an emoji.

    Only a terminal's width crops a table.
    """
    made = Console(markup=False, emoji=False, highlight=False, stderr=stderr)
    if not made.is_terminal:
        made.width = _NO_TERMINAL
    return made


_NO_TERMINAL = 10_000
"""Characters in a line of a file or pipe."""


def stage_lines() -> Callable[[str], None] | None:
    """Return the function that prints a stage as a line for the program that started this one; None where none reads.

    The environment variable UNITCAD_STAGES holds the text that such a line begins with.
    """

    mark = os.environ.get(STAGES)
    return (lambda stage: warn(f"{mark}{stage}")) if mark else None


@contextlib.contextmanager
def progress(name: str) -> Iterator[Callable[[str], None]]:
    """Show a spinner with the stage on a terminal, nothing in a pipe; yield the function that sets the stage."""
    lines = stage_lines()
    if lines or not sys.stderr.isatty():
        yield lines or (lambda stage: None)
        return

    # As Text: a spinner reads markup whatever its console's setting.
    with console(stderr=True).status(Text(name)) as status:
        yield lambda stage: status.update(Text(f"{name}: {stage}"))


AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object on standard output.")]
Sets = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="PATH=VALUE",
        callback=lambda sets: [confirm_form(text) for text in sets or ()],
        help="Change a value of the spec, such as diameter_mm=15. May be repeated.",
    ),
]
Fit = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="A lab-fit.toml of unitcad fit. Default: the shipped models' constants."),
]
Formats = Annotated[
    str | None,
    typer.Option(metavar="NAMES", help="Formats of the files: stl,3mf,step,svg,png,glb,pdf. Default: the spec's."),
]
Only = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES",
        callback=lambda names: None if names == "all" else names,
        help="Outputs: unit,moulds,estimate,casting. Default: all. In a batch, estimate makes one table.",
    ),
]
NoCheck = Annotated[bool, typer.Option("--no-check", help="Skip the mould checks and the mesh checks.")]
AllowCode = Annotated[
    bool, typer.Option("--allow-code", help="Run Python code that came with a spec (design_source), not from a file.")
]


def finite(value: float | None) -> float | None:
    """Return an option's number. Raises BadParameter for nan and infinity: a range of Typer's lets nan through."""
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"{value} is not a finite number.")
    return value


def with_fit(sets: list[str] | None, fit: Path | None) -> list[str]:
    """Return the overrides of --set and --fit."""

    return [*(sets or ()), *([] if fit is None else [f"estimate.fit={json.dumps(str(fit))}"])]


def overrides(sets: list[str] | None, formats: str | None) -> list[str]:
    """Return the overrides of --set and --formats. Raises Refusal for an unknown format."""

    names = names_in(formats)
    for name in names or ():
        if name not in FORMATS:
            raise unknown_name("--formats", name, FORMATS)
    return [*(sets or ()), *([] if formats is None else [f"output.formats={names}"])]


def outputs(only: str | None) -> tuple[str, ...]:
    """Return the outputs of --only; default: all."""

    return OUTPUTS if only is None else tuple(name for name in names_in(only) if name)


def expect_commas(field: str, words: Iterable[str]) -> None:
    """Raise Refusal for an argument that belongs to an option's list: --formats stl step."""
    for word in words:
        if word in FORMATS:
            raise Refusal(field, word, "is a format; several take commas: --formats stl,step")
        if word in OUTPUTS:
            raise Refusal(field, word, "is an output; several take commas: --only unit,moulds")


def names_in(text: str | None) -> list[str]:
    """Return the parts of a comma-separated list."""
    return [] if text is None else [part.strip() for part in text.split(",")]


def allow_code(wanted: bool, nothing_else: bool = False) -> None:
    """Let this process run the code inside a spec; with `nothing_else`, no design's code at all."""

    if wanted:
        design_files.allow({design_files.ANY})
    elif nothing_else:
        design_files.allow_nothing()
