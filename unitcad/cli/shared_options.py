"""Options that several commands share."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from unitcad.arguments import confirm_form
from unitcad.errors import Refusal, unknown_name
from unitcad.spec import custom_code
from unitcad.spec.raw import FORMATS, OUTPUTS

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
Specs = Annotated[list[str], typer.Argument(metavar="SPEC...", help="Spec or array files, or names of templates.")]
Out = Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Parent of the result's folder.")]
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
        custom_code.allow({custom_code.ANY})
    elif nothing_else:
        custom_code.allow_nothing()
