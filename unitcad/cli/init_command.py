"""unitcad init."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from unitcad.cli.output import print_json
from unitcad.cli.shared_options import AsJson
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.files import names_device, write_new
from unitcad.rooms import file_kinds, load
from unitcad.validation import default_template
from unitcad.validation.shipped_files import shipped_of
from unitcad.validation.starter import commented


def init(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Name of the variant, and of its file NAME.toml.")],
    template: Annotated[
        str | None,
        typer.Option(
            metavar="TEMPLATE",
            help=f"Shipped file to start from (unitcad list templates). Default: {default_template()}.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write a commented file to start from. The last line printed is the file.

    Its first line names the schema that an editor checks it with; `unitcad schema -o FILE` writes that.
    """
    kinds = [kind for kind in file_kinds() if kind.starts]
    starts = {shipped: (kind, file) for kind in reversed(kinds) for shipped, file in shipped_of(kind).items()}
    template = template or default_template()
    if template not in starts:
        raise unknown_name("--template", template, starts)
    stem = name.removesuffix(".toml")
    if not re.fullmatch(r"[A-Za-z0-9]([A-Za-z0-9._-]{0,58}[A-Za-z0-9_-])?", stem):
        near = re.sub(r"[^A-Za-z0-9._-]+", "-", stem)[:60].strip("-._") or "my-unit"
        raise Refusal("NAME", name, "must be letters, digits, dots and dashes", near)
    if Path(stem).suffix in (".txt", ".json", ".yaml", ".yml"):
        raise Refusal("NAME", name, "is the name of a TOML file", f"{Path(stem).stem}.toml")
    if names_device(stem):
        raise Refusal("NAME", name, "is the name of a device on Windows", f"my-{stem}")
    path = Path(f"{stem}.toml")
    kind, start = starts[template]
    schema = f"unitcad-{kind.name}.schema.json"
    try:
        write_new(path, commented(start, stem, load(kind.model), schema).encode())
    except FileExistsError:
        raise UnitcadError(f"{path}: is there already; choose another name") from None
    except OSError as error:
        raise UnitcadError(f"{path}: {(error.strerror or 'unwritable').lower()}") from None
    if as_json:
        print_json({kind.name: str(path)})
        return
    typer.echo(f"then: {kind.command} {path}")
    if not Path(schema).exists():
        typer.echo(f"an editor checks it as you type after: unitcad schema {kind.name} -o {schema}")
    typer.echo(str(path))
