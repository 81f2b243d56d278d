"""unitcad schema."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from unitcad import files
from unitcad.cli.output import print_json
from unitcad.errors import unknown_name
from unitcad.rooms import file_kinds, load


def schema(
    kind: Annotated[
        str,
        typer.Argument(
            metavar="[KIND]", help=f"Kind of file: {', '.join(one.name for one in file_kinds() if one.model)}."
        ),
    ] = "spec",
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="File for an editor. Default: print the schema.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object; the schema always is one.")] = False,
) -> None:
    """Print the JSON Schema of a spec, or of another kind of file.

    An editor checks a TOML file against it whose first line is `#:schema FILE`, as `unitcad init` writes it.
    """
    kinds = {known.name: known for known in file_kinds() if known.model}
    if kind not in kinds:
        raise unknown_name("KIND", kind, kinds)
    chosen = kinds[kind]
    found = load(chosen.schema)() if chosen.schema else msgspec.json.schema(load(chosen.model))
    document = {"$schema": "https://json-schema.org/draft/2020-12/schema", **found}
    document["title"] = f"unitcad {kind.replace('-', ' ')}"
    if out is None:
        print_json(document)
        return
    files.write(out, (json.dumps(document, indent=2) + "\n").encode())
    print_json({"schema": str(out)}) if as_json else typer.echo(str(out))
