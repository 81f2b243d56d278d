"""The light commands: schema and cache. They load no spec, catalogue or kernel."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import msgspec
import typer

from unitcad import files
from unitcad.cache import collect, default_root, usage
from unitcad.cli.output import print_json
from unitcad.cli.shared_options import AsJson, finite
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


cache = typer.Typer(
    help="Show or shrink the cache of distinct parts.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)
Where = Annotated[Path | None, typer.Option("--cache", metavar="DIR", help="Folder of the cache. Default: the user's.")]


@cache.command("ls")
def ls(where: Where = None, as_json: AsJson = False) -> None:
    """Print the content of the cache. The last line printed is its folder."""

    root = where or default_root()
    used = usage(root)
    _print_usage(f"{used.entries} entries, {used.contents} files, {used.bytes / 1e6:.1f} MB", root, vars(used), as_json)


@cache.command("gc")
def gc(
    where: Where = None,
    limit: Annotated[
        float,
        typer.Option(
            metavar="MB", min=0, max=1e12, callback=finite, help="Maximum size afterwards; 0 empties the cache."
        ),
    ] = 4096,
    as_json: AsJson = False,
) -> None:
    """Remove the parts that were used longest ago, down to a size. Results keep their files: they are links."""

    root = where or default_root()
    gone = collect(root, int(limit * 1e6))
    text = f"{gone.entries} entries, {gone.contents} files, {gone.bytes / 1e6:.1f} MB removed"
    _print_usage(text, root, vars(gone), as_json)


def _print_usage(text: str, root: Path, data: dict, as_json: bool) -> None:

    if as_json:
        print_json({"cache": str(root), **data})
    else:
        typer.echo(text)
        typer.echo(str(root))
