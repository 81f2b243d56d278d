"""unitcad init."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from unitcad.cli.shared_options import AsJson

ARRAY_SCHEMA = "unitcad-array.schema.json"
"""The file that a new array's first line names for editors."""
TARGET_SCHEMA = "unitcad-target.schema.json"
"""The file that a new target's first line names for editors."""


def init(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the variant and of the file, NAME.toml.")],
    template: Annotated[
        str | None,
        typer.Option(
            help="What to start from: see `unitcad list templates` and `list arrays`; else the default design's."
        ),
    ] = None,
    target: Annotated[
        str | None,
        typer.Option(help="Write a target of `unitcad design` in its place, from one of `unitcad list targets`."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write a commented spec, array or target to start from. The last line printed is the file.

    Its first line names the schema that an editor checks it with; `unitcad schema -o FILE` writes that.
    """
    from unitcad.arrays.array_names import array_templates
    from unitcad.arrays.array_tables import AskedArray
    from unitcad.cli.output import print_json
    from unitcad.errors import Refusal, UnitcadError, unknown_name
    from unitcad.files import names_device, write_new
    from unitcad.validation import templates
    from unitcad.validation.starter import SCHEMA, commented, starter

    stem = name.removesuffix(".toml")
    if not re.fullmatch(r"[A-Za-z0-9]([A-Za-z0-9._-]{0,58}[A-Za-z0-9_-])?", stem):
        near = re.sub(r"[^A-Za-z0-9._-]+", "-", stem)[:60].strip("-._") or "my-unit"
        raise Refusal("NAME", name, "must be letters, digits, dots and dashes", near)
    if names_device(stem):
        raise Refusal("NAME", name, "is the name of a device on Windows", f"my-{stem}")
    path = Path(f"{stem}.toml")
    of_array = target is None and template in array_templates() and template not in templates()
    if of_array:
        text = commented(array_templates()[str(template)], stem, AskedArray, ARRAY_SCHEMA)
    elif target is None:
        text = starter(stem, template)
    else:
        from unitcad.search.target_file import shipped

        if template is not None:
            raise Refusal("--target", target, "is for a target file, --template for a spec: leave one out")
        if target not in shipped():
            raise unknown_name("--target", target, shipped())
        text = f"#:schema ./{TARGET_SCHEMA}\n{shipped()[target].read_text('utf-8')}"
    try:
        write_new(path, text.encode())
    except FileExistsError:
        raise UnitcadError(f"{path}: is there already; choose another name") from None
    except OSError as error:
        raise UnitcadError(f"{path}: {(error.strerror or 'unwritable').lower()}") from None
    if as_json:
        print_json({"spec" if target is None else "target": str(path)})
    else:
        schema, kind = (SCHEMA, "") if target is None else (TARGET_SCHEMA, "target ")
        schema, kind = (ARRAY_SCHEMA, "array ") if of_array else (schema, kind)
        typer.echo(f"build it with: unitcad build {path}" if target is None else f"then: unitcad design {path}")
        if not Path(schema).exists():
            typer.echo(f"an editor checks it as you type after: unitcad schema {kind}-o {schema}")
        typer.echo(str(path))
