"""unitcad list."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from unitcad.cli.shared_options import AsJson

KINDS = (
    "templates", "arrays", "designs", "materials", "motors", "printers", "phantoms", "sweeps", "targets",
    "rules",
)  # fmt: skip


def list_(
    kind: Annotated[str, typer.Argument(help=f"{', '.join(KINDS)}; none: these.", metavar="[KIND]")] = "",
    as_json: AsJson = False,
) -> None:
    """List what is shipped, each value with its source and status."""
    from unitcad.cli.output import print_json
    from unitcad.errors import unknown_name

    if not kind:
        print_json({"kinds": KINDS}) if as_json else typer.echo("\n".join(KINDS))
        return
    if kind not in KINDS:
        raise unknown_name("list", kind, KINDS)
    entries = _entries(kind)
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


def _entries(kind: str) -> dict[str, Any]:
    import msgspec

    from unitcad import catalogue
    from unitcad.designs import shipped
    from unitcad.validation import custom_templates, templates

    if kind == "templates":
        return {
            name: _first_comment(path.read_text("utf-8")) for name, path in (templates() | custom_templates()).items()
        }
    if kind == "arrays":
        from unitcad.arrays.array_names import array_templates

        return {name: _first_comment(path.read_text("utf-8")) for name, path in array_templates().items()}
    if kind == "designs":
        return {name: design.about for name, design in shipped().items()}
    if kind == "phantoms":
        from unitcad.lab.phantom.recipe import phantoms

        return {name: _first_comment(path.read_text("utf-8")) for name, path in phantoms().items()}
    if kind == "sweeps":
        from unitcad.sweeps.sweep import shipped as sweeps

        return {name: _first_comment(path.read_text("utf-8")) for name, path in sweeps().items()}
    if kind == "targets":
        from unitcad.search.target_file import shipped as targets

        return {name: _first_comment(path.read_text("utf-8")) for name, path in targets().items()}
    if kind == "rules":
        from unitcad.meshcheck.rules.registry import rules

        return {code: rule.title for code, rule in rules().items()}
    entries = {"materials": catalogue.materials, "motors": catalogue.motors, "printers": catalogue.printers}[kind]()
    return {
        name: {key: value for key, value in msgspec.to_builtins(entry).items() if isinstance(value, dict)}
        for name, entry in entries.items()
    }


def _first_comment(text: str) -> str:
    line = text.partition("\n")[0]
    return line.lstrip("# ") if line.startswith("#") else ""
