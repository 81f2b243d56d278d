"""unitcad list."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer
from msgspec import to_builtins

from unitcad import catalogue
from unitcad.cli.output import print_json
from unitcad.cli.shared_options import AsJson
from unitcad.designs import shipped as designs
from unitcad.errors import unknown_name
from unitcad.meshcheck.rules.registry import rules
from unitcad.rooms import file_kinds
from unitcad.validation.shipped_files import shipped_of


def _kinds() -> dict[str, Callable[[], dict[str, Any]]]:
    """Return the kinds in the order of the list, each with the function that returns its entries by name."""
    return {
        **{kind.plural: lambda kind=kind: _first_comments(shipped_of(kind)) for kind in file_kinds() if kind.plural},
        "designs": lambda: {name: design.about for name, design in designs().items()},
        "materials": lambda: _values(catalogue.materials()),
        "motors": lambda: _values(catalogue.motors()),
        "printers": lambda: _values(catalogue.printers()),
        "rules": lambda: {code: rule.title for code, rule in rules().items()},
    }


def list_(
    kind: Annotated[
        str, typer.Argument(help=f"Kind to list: {', '.join(_kinds())}. Default: the kinds.", metavar="[KIND]")
    ] = "",
    as_json: AsJson = False,
) -> None:
    """List the shipped entries, each value with its source and status."""
    kinds = _kinds()
    if not kind:
        print_json({"kinds": list(kinds)}) if as_json else typer.echo("\n".join(kinds))
        return
    if kind not in kinds:
        raise unknown_name("KIND", kind, kinds)
    entries = kinds[kind]()
    if as_json:
        print_json({kind: entries})
        return
    for name, entry in entries.items():
        if isinstance(entry, str):
            typer.echo(f"{name}\t{entry}" if entry else name)
            continue
        typer.echo(name)
        for key, value in entry.items():
            how = f"; {value['method']}" if "method" in value else ""
            bounds = f" ({value['low']:g} to {value['high']:g})" if "low" in value else ""
            typer.echo(f"  {key} = {value['value']}{bounds}  [{value['status']}] {value['source']}{how}")


def _values(entries: dict[str, Any]) -> dict[str, Any]:
    return {
        name: {key: value for key, value in to_builtins(entry).items() if isinstance(value, dict)}
        for name, entry in entries.items()
    }


def _first_comments(shipped: dict[str, Path]) -> dict[str, str]:
    lines = {name: path.read_text("utf-8").partition("\n")[0] for name, path in shipped.items()}
    return {name: line.lstrip("# ") if line.startswith("#") else "" for name, line in lines.items()}
