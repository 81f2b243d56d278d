"""unitcad init."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from unitcad.cli.shared_options import AsJson


def init(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the variant and of the file, NAME.toml.")],
    template: Annotated[
        str | None, typer.Option(help="What to start from: see `unitcad list templates`; else the default design's.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write a commented spec to start from. The last line printed is the file.

    Its first line names the schema that an editor checks it with; `unitcad schema -o FILE` writes that.
    """
    from unitcad.cli.output import print_json
    from unitcad.errors import Refusal, UnitcadError
    from unitcad.files import names_device, write_new
    from unitcad.validation.starter import SCHEMA, starter

    stem = name.removesuffix(".toml")
    if not re.fullmatch(r"[A-Za-z0-9]([A-Za-z0-9._-]{0,58}[A-Za-z0-9_-])?", stem):
        near = re.sub(r"[^A-Za-z0-9._-]+", "-", stem)[:60].strip("-._") or "my-unit"
        raise Refusal("NAME", name, "must be letters, digits, dots and dashes", near)
    if names_device(stem):
        raise Refusal("NAME", name, "is the name of a device on Windows", f"my-{stem}")
    path = Path(f"{stem}.toml")
    text = starter(stem, template)
    try:
        write_new(path, text.encode())
    except FileExistsError:
        raise UnitcadError(f"{path}: is there already; choose another name") from None
    except OSError as error:
        raise UnitcadError(f"{path}: {(error.strerror or 'unwritable').lower()}") from None
    if as_json:
        print_json({"spec": str(path)})
    else:
        typer.echo(f"build it with: unitcad build {path}")
        if not Path(SCHEMA).exists():
            typer.echo(f"an editor checks it as you type after: unitcad schema -o {SCHEMA}")
        typer.echo(str(path))
