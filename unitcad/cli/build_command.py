"""unitcad build."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from unitcad.cli.output import warn
from unitcad.cli.shared_options import (
    AllowCode,
    AsJson,
    Fit,
    Formats,
    NoCheck,
    Only,
    Sets,
    allow_code,
    outputs,
    overrides,
    with_fit,
)

if TYPE_CHECKING:
    from unitcad.pipeline.manifest_records import Manifest


def build(
    specs: Annotated[list[str], typer.Argument(metavar="SPEC", help="A spec file, or the name of a template.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Where the result's folder goes.")] = Path("out"),
    fit: Fit = None,
    sets: Sets = None,
    formats: Formats = None,
    only: Only = None,
    page: Annotated[
        bool | None,
        typer.Option(
            "--report/--no-report",
            help="Write report.html, one offline page. By default without --only; a page that is there is kept up.",
        ),
    ] = None,
    no_check: NoCheck = False,
    no_slice: Annotated[
        bool, typer.Option("--no-slice", help="Leave out PrusaSlicer's print time and filament (slicer.json).")
    ] = False,
    code: AllowCode = False,
    as_json: AsJson = False,
) -> None:
    """Make a unit and its casting moulds. The last line printed is the folder."""
    from unitcad.cli.build_summary import summary
    from unitcad.cli.output import print_json, progress
    from unitcad.pipeline.build import build as run
    from unitcad.pipeline.folder import PAGE, held
    from unitcad.pipeline.slicing import slice_tools
    from unitcad.validation import load

    changes, chosen = overrides(with_fit(sets, fit), formats), outputs(only)
    allow_code(code)
    # Every spec is validated before the first one is built.
    wanted = [load(spec, changes) for spec in specs]
    results, printing = [], []
    sliced = only is None and not no_slice
    for spec in wanted:
        with progress(spec.name) as say:
            results.append(run(spec, out, only=chosen, check=not no_check, say=say))
            printing.append(slice_tools(results[-1].folder, results[-1].manifest, spec, say) if sliced else "")
            if page or (page is None and only is None) or (results[-1].folder / PAGE).is_file():
                from unitcad.report import write_report

                say("page")
                with held(results[-1].folder):
                    write_report(results[-1].folder, warn)
    if as_json:
        print_json({"variants": [{"folder": str(r.folder), "ok": r.ok, "manifest": r.manifest} for r in results]})
    else:
        for spec, result, prints in zip(wanted, results, printing, strict=True):
            _print_faults(result.manifest)
            # Standard output has the folder alone, for a script to take.
            for line in (*summary(spec, result), *([prints] if prints else ())):
                warn(f"{spec.name}: {line}")
            typer.echo(str(result.folder))
    if not all(result.ok for result in results):
        sys.exit(1)


def _print_faults(manifest: Manifest) -> None:
    """Print warnings, failed mould checks, and findings in files."""
    from unitcad.pipeline.product import NO_KERNEL

    for warning in manifest["warnings"]:
        warn(f"warning: {warning}")
    for entry in manifest["left_out"]:
        if entry["what"] == "pictures":
            typer.echo(f"warning: no pictures: {entry['why']}", err=True)
        if entry["why"] == NO_KERNEL:
            typer.echo(f"note: STEP left out: {entry['why']}", err=True)
    checks = manifest["laws"]
    for check in checks:
        if not check["ok"]:
            measured = f"{check['value']:.3g} {check['unit']}, limit {check['limit']:.3g}"
            advice = f"; {check['advice']}" if check["advice"] else ""
            typer.echo(f"{check['code']} {check['where']}: {measured}{advice}", err=True)
    for finding in manifest["check"]["findings"]:
        typer.echo(f"{finding['path']}: {finding['code']} {finding['message']}", err=True)
