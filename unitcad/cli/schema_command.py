"""unitcad schema."""

from __future__ import annotations

from typing import Annotated

import typer

KINDS = ("spec", "sweep", "cast-record")


def schema(
    kind: Annotated[str, typer.Argument(help="spec, sweep or cast-record.")] = "spec",
    as_json: Annotated[bool, typer.Option("--json", help="The schema is JSON in any case.")] = False,
) -> None:
    """Print the JSON Schema of a spec file, a sweep file or a cast record."""
    import msgspec

    from unitcad.batch.sweep import SweepFile
    from unitcad.casting.cast_record import CastRecord
    from unitcad.cli.output import print_json
    from unitcad.errors import unknown_name
    from unitcad.spec.asked import AskedSpec

    if kind not in KINDS:
        raise unknown_name("schema", kind, KINDS)
    model = {"spec": AskedSpec, "sweep": SweepFile, "cast-record": CastRecord}[kind]
    document = {"$schema": "https://json-schema.org/draft/2020-12/schema", **msgspec.json.schema(model)}
    document["title"] = f"unitcad {kind.replace('-', ' ')}"
    print_json(document)
