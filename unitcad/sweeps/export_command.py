"""unitcad export."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from unitcad.cache import DiskStore, default_root
from unitcad.cli.output import print_json
from unitcad.cli.shared_options import AsJson
from unitcad.sweeps.result_folders import export_variants


def export(
    hashes: Annotated[
        list[str],
        typer.Argument(metavar="HASH...", help="Hash at the end of a variant's folder, or its beginning."),
    ],
    batch: Annotated[Path, typer.Option("--batch", metavar="DIR", help="Folder of the batch.")] = Path(),
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="DIR", help="Parent of the folders. Default: the batch's folder."),
    ] = None,
    store: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Store of the content. Default: the batch's.")
    ] = None,
    where: Annotated[
        Path | None, typer.Option("--cache", metavar="DIR", help="Folder of the cache. Default: the user's.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Make the folders of some variants of a batch, from its store. Each is a line printed."""

    kept = DiskStore(where or default_root())
    try:
        made = []
        for folder in export_variants(batch, hashes, out or batch, kept, store):
            made.append(str(folder))
            if not as_json:
                typer.echo(made[-1])
    finally:
        kept.close()
    if as_json:
        print_json({"folders": made})
