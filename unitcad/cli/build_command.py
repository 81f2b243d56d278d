"""unitcad build."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from unitcad.cli.code import AllowCode, allow_code
from unitcad.cli.output import warn

Specs = Annotated[list[str], typer.Argument(metavar="SPEC", help="A spec file, or the name of a template.")]
Sets = Annotated[list[str] | None, typer.Option("--set", metavar="PATH=VALUE", help="Override a value of the spec.")]


def build(
    specs: Specs,
    out: Annotated[Path, typer.Option("-o", "--out", help="Where the result's folder goes.")] = Path("out"),
    sets: Sets = None,
    formats: Annotated[str | None, typer.Option(help="stl,3mf,step,svg,png,glb; else the spec's.")] = None,
    only: Annotated[str | None, typer.Option(help="unit,moulds,estimate,casting; else all.")] = None,
    page: Annotated[
        bool, typer.Option("--report", help="Write report.html, one offline page, into the folder.")
    ] = False,
    no_check: Annotated[
        bool, typer.Option("--no-check", help="Leave out the mould checks and the mesh checks.")
    ] = False,
    no_slice: Annotated[
        bool, typer.Option("--no-slice", help="Leave out PrusaSlicer's print time and filament (slicer.json).")
    ] = False,
    code: AllowCode = False,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on standard output.")] = False,
) -> None:
    """Make a unit and its casting moulds. The last line printed is the folder."""
    from unitcad.cli.formats import chosen_formats
    from unitcad.cli.output import print_json, progress
    from unitcad.pipeline.artifacts import OUTPUTS
    from unitcad.pipeline.build import build as run
    from unitcad.pipeline.folder import PAGE, held
    from unitcad.pipeline.slicing import slice_tools
    from unitcad.validation import load

    overrides = [*(sets or []), *chosen_formats(formats)]
    chosen = OUTPUTS if only is None else tuple(name.strip() for name in only.split(",") if name.strip())
    allow_code(code)
    # Every spec is validated before the first one is built.
    wanted = [load(spec, overrides) for spec in specs]
    results, printing = [], []
    sliced = only is None and not no_slice
    for spec in wanted:
        with progress(spec.name) as say:
            results.append(run(spec, out, only=chosen, check=not no_check, say=say))
            printing.append(slice_tools(results[-1].folder, results[-1].manifest, spec, say) if sliced else "")
            if page or (results[-1].folder / PAGE).is_file():
                from unitcad.report import write_report

                say("page")
                with held(results[-1].folder):
                    write_report(results[-1].folder, warn)
    if as_json:
        print_json({"variants": [{"folder": str(r.folder), "ok": r.ok, "manifest": r.manifest} for r in results]})
    else:
        for result, prints in zip(results, printing, strict=True):
            _print_result(result.manifest)
            if prints:
                typer.echo(f"{result.manifest['name']}: {prints}")
            typer.echo(str(result.folder))
    if not all(result.ok for result in results):
        sys.exit(1)


def _print_result(manifest: dict) -> None:
    """Print what a person should know of a result: warnings, broken mould checks, bad files."""
    for warning in manifest["warnings"]:
        warn(f"warning: {warning}")
    for entry in manifest["left_out"]:
        if entry["what"] == "pictures":
            typer.echo(f"warning: no pictures: {entry['why']}", err=True)
    checks = manifest["laws"]
    for check in checks:
        if not check["ok"]:
            measured = f"{check['value']:g} {check['unit']}, limit {check['limit']:g}"
            typer.echo(f"{check['code']} {check['where']}: {measured}", err=True)
    for finding in manifest["check"]["findings"]:
        typer.echo(f"{finding['path']}: {finding['code']} {finding['message']}", err=True)
    if checks:
        held = sum(check["ok"] for check in checks)
        typer.echo(f"{manifest['name']}: {len(manifest['parts'])} bodies, {held} of {len(checks)} mould checks hold")
