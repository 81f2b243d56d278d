"""unitcad report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from unitcad.cli.output import print_json, progress, warn
from unitcad.cli.shared_options import AllowCode, AsJson, allow_code
from unitcad.report import write_report
from unitcad.report.read_results import check_casts


def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a variant, or of several.")],
    code: AllowCode = False,
    as_json: AsJson = False,
) -> None:
    """Write one offline page for a folder of results. The last line printed is the page."""

    allow_code(code)
    with progress(str(folder)) as say:
        check_casts(folder)
        say("page")
        page = write_report(folder, warn)
    if as_json:
        print_json({"page": str(page), "bytes": page.stat().st_size})
    else:
        typer.echo(str(page))
