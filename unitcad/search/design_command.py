"""unitcad design."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from unitcad.cli.output import print_indented, print_json, progress
from unitcad.cli.shared_options import AsJson, Out
from unitcad.cli.tables import console
from unitcad.files import path_seen_from
from unitcad.search import design_files
from unitcad.search.proposals import invert
from unitcad.search.target_file import load_target


def design(
    target: Annotated[
        str, typer.Argument(metavar="TARGET", help="Target file, or name of a shipped one (unitcad list targets).")
    ],
    out: Out = Path("out"),
    no_check: Annotated[
        bool, typer.Option("--no-check", help="Skip the moulds: the best unit may not be castable.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Rank all available designs for a target.

    Each proposal has its probability of meeting the level at the edge, with a range, and the inputs that no measurement
    covers. The last line printed is the folder: the page design.html, ranking.csv, and specs to build.
    """

    asked = load_target(target)
    design_files.check_out(out)
    with progress("design") as stage:
        made = invert(asked, check=not no_check, say=stage)
        folder = design_files.folder_of(asked.name, out)
        design_files.write(folder, design_files.contents(made, path_seen_from(folder), stage))
    data = design_files.with_files(made.data, path_seen_from(folder))
    if as_json:
        print_json({"folder": str(folder), **data})
        return
    bold = partial(console().print, soft_wrap=True, style="bold")
    bold(f"{data['name']}: {design_files.target_line(data['target'])}")
    print_indented(*design_files.head_lines(data))
    for one in data["proposals"]:
        bold(design_files.title(one))
        print_indented(f" {design_files.level_line(one)}", *(f" - {line}" for line in design_files.lines(one)))
    for line in design_files.skipped_lines(data):
        console().print(line, soft_wrap=True)
    typer.echo(str(folder))
