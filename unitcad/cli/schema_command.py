"""unitcad schema."""

from __future__ import annotations

from typing import Annotated

import typer

KINDS = ("spec", "sweep")


def schema(
    kind: Annotated[str, typer.Argument(help="spec or sweep.")] = "spec",
    as_json: Annotated[bool, typer.Option("--json", help="The schema is JSON in any case.")] = False,
) -> None:
    """Print the JSON Schema of a spec or sweep file."""
    import msgspec

    from unitcad.batch.sweep import SweepFile
    from unitcad.cli.output import print_json
    from unitcad.errors import unknown_name
    from unitcad.spec.asked import AskedSpec

    if kind not in KINDS:
        raise unknown_name("schema", kind, KINDS)
    model = AskedSpec if kind == "spec" else SweepFile
    document = {"$schema": "https://json-schema.org/draft/2020-12/schema", **msgspec.json.schema(model)}
    document["title"] = f"unitcad {kind}"
    print_json(document)
