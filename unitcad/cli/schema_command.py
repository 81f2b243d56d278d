"""unitcad schema."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

KINDS = ("spec", "array", "sweep", "cast-record", "target")


def schema(
    kind: Annotated[str, typer.Argument(help="spec, array, sweep, cast-record or target.")] = "spec",
    out: Annotated[
        Path | None, typer.Option("-o", "--out", metavar="FILE", help="Write it there, for an editor; else print it.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="The schema is JSON in any case.")] = False,
) -> None:
    """Print the JSON Schema of a spec, a sweep or another file.

    An editor checks a TOML file against it whose first line is `#:schema FILE`, as `unitcad init` writes it.
    """
    import json

    import msgspec

    from unitcad import files
    from unitcad.arrays.array_schema import with_kinds
    from unitcad.arrays.array_tables import AskedArray
    from unitcad.casting.cast_record import CastRecord
    from unitcad.cli.output import print_json
    from unitcad.errors import unknown_name
    from unitcad.search.target_file import TargetFile
    from unitcad.spec.asked import AskedSpec
    from unitcad.sweeps.sweep import SweepFile

    if kind not in KINDS:
        raise unknown_name("schema", kind, KINDS)
    model = {
        "spec": AskedSpec,
        "array": AskedArray,
        "sweep": SweepFile,
        "cast-record": CastRecord,
        "target": TargetFile,
    }[kind]
    document = {"$schema": "https://json-schema.org/draft/2020-12/schema", **msgspec.json.schema(model)}
    if kind == "array":
        document = with_kinds(document)
    document["title"] = f"unitcad {kind.replace('-', ' ')}"
    if out is None:
        print_json(document)
        return
    files.write(out, (json.dumps(document, indent=2) + "\n").encode())
    print_json({"schema": str(out)}) if as_json else typer.echo(str(out))
