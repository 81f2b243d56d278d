"""`unitcad.build`."""

# pyright: strict
from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path

from unitcad.pipeline.build import OUTPUTS, Built
from unitcad.pipeline.build import build as build_spec
from unitcad.pipeline.folder import PAGE, held
from unitcad.spec.asked import Format
from unitcad.validation import Changes, Source, load


def build(
    source: Source,
    out: str | os.PathLike[str] = "out",
    *,
    set: Changes = (),
    formats: Sequence[Format] | None = None,
    only: Sequence[str] = OUTPUTS,
    check: bool = True,
    report: bool = False,
    progress: Callable[[str], None] | None = None,
) -> Built:
    """Build a unit and its moulds into a folder below `out`, and return what was built.

    `source` and `set` are as for `unitcad.load`. `formats` ("stl", "3mf", "step", "svg", "png", "glb") and `only`
    ("unit", "moulds", "estimate", "casting") choose what is made. Without `check` mould checks and mesh checks are
    left out. `report` writes report.html, one offline page. `progress` is called with the name of each step.
    `Built.ok` tells whether every check passed; `Built.manifest` holds figures in mm, mm3 and mm2.
    Raises Refusal or UnitcadError before anything is written.
    """
    spec = load(source, set)
    if formats is not None:
        spec = load(spec, {"output.formats": list(formats)})
    built = build_spec(spec, Path(out), only=only, check=check, say=progress or _silent)
    if report or (built.folder / PAGE).is_file():  # a page that is there would show the result before this one
        from unitcad.report import write_report

        with held(built.folder):
            write_report(built.folder)
    return built


def _silent(step: str) -> None:
    """Say nothing."""
