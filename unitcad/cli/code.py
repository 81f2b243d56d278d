"""The option --allow-code."""

from __future__ import annotations

from typing import Annotated

import typer

AllowCode = Annotated[
    bool, typer.Option("--allow-code", help="Run Python code that came with a spec (design_source), not from a file.")
]


def allow_code(wanted: bool, nothing_else: bool = False) -> None:
    """Let this process run the code inside a spec; with `nothing_else`, no design's code at all."""
    from unitcad.spec import custom_code

    if wanted:
        custom_code.allow({custom_code.ANY})
    elif nothing_else:
        custom_code.allow_nothing()
