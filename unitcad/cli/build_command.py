"""unitcad build."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from unitcad.cli.build_summary import summary
from unitcad.cli.file_watcher import wait_for_saves
from unitcad.cli.output import print_json, progress, say_error, warn
from unitcad.cli.shared_options import (
    AllowCode,
    AsJson,
    Fit,
    Formats,
    NoCheck,
    Only,
    Sets,
    allow_code,
    expect_commas,
    listed,
    outputs,
    overrides,
    with_fit,
)
from unitcad.errors import UnitcadError, WrongArgument, install_command
from unitcad.pipeline import step_helper
from unitcad.pipeline.make import Subject
from unitcad.pipeline.manifest import NO_KERNEL, Manifest
from unitcad.pipeline.slicing import check_slicing, slice_tools
from unitcad.pipeline.subjects import Compound, load_subject
from unitcad.pipeline.write import PAGE, Built, held
from unitcad.pipeline.write import build as build_subject
from unitcad.report import write_report
from unitcad.spec import read_toml
from unitcad.validation import confirm_known, every_template
from unitcad.validation.suggestions import numbers


def build(
    specs: Annotated[list[str], typer.Argument(metavar="SPEC...", help="Spec or array files, or names of templates.")],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Parent of the result's folder.")] = Path(
        "out"
    ),
    fit: Fit = None,
    sets: Sets = None,
    formats: Formats = None,
    only: Only = None,
    page: Annotated[
        bool | None,
        typer.Option(
            "--report/--no-report",
            help="Write report.html, one offline page. Default: on, except with --only. An existing page is updated.",
        ),
    ] = None,
    no_check: NoCheck = False,
    slicing: Annotated[
        bool,
        typer.Option("--slice", help="Compute print time and filament of each piece with PrusaSlicer (slicer.json)."),
    ] = False,
    watch: Annotated[
        bool, typer.Option("--watch", help="Build again after every save of the spec, until Ctrl-C.")
    ] = False,
    code: AllowCode = False,
    as_json: AsJson = False,
) -> None:
    """Make a unit and its casting moulds, or an array of units. The last line printed is the folder."""
    expect_commas("SPEC", specs)
    specs = [confirm_known(spec) for spec in specs]
    once = partial(_build_all, specs, out, fit, sets, formats, only, page, no_check, slicing, code, as_json)
    if not watch:
        if not once():
            sys.exit(1)
        return

    if lacking := [spec for spec in specs if not Path(spec).is_file()]:
        why = "is no file that could be saved; unitcad init makes one from a template"
        raise WrongArgument("watch", lacking[0], why)
    with suppress(KeyboardInterrupt):
        for _ in wait_for_saves(map(Path, specs)):
            try:
                once()
            except UnitcadError as error:
                say_error(error, "object" if as_json else "text")
            warn("waiting for a save; Ctrl-C ends")


def _build_all(
    specs: list[str],
    out: Path,
    fit: Path | None,
    sets: list[str] | None,
    formats: str | None,
    only: str | None,
    page: bool | None,
    no_check: bool,
    slicing: bool,
    code: bool,
    as_json: bool,
) -> bool:
    """Build the specs and print the results; return whether every check passed."""

    outputs_asked = {"unit", "moulds"} if only is None else set(listed(only))
    if outputs_asked & {"unit", "moulds"} and (formats is None or "step" in listed(formats)):
        step_helper.start()  # first: it loads its modules while this process loads its own
    paged = only is None if page is None else page
    changes, chosen = overrides(with_fit(sets, fit), formats), outputs(only)
    allow_code(code)
    # Every spec is validated before the first one is built.
    wanted = [load_subject(spec, changes, chosen) for spec in specs]
    given = [_given_paths(spec, changes) for spec in specs]
    for spec in wanted if slicing else ():
        check_slicing(spec.unit, chosen)
    results: list[Built] = []
    printing: list[str] = []
    for spec, known in zip(wanted, given, strict=True):
        with progress(spec.name) as say:
            result = build_subject(spec.of, out, only=chosen, check=not no_check, say=say, given=known)
            if slicing:
                say("slicing")
                printing.append(slice_tools(spec.unit, result.folder, result.manifest, say))
            if paged or (result.folder / PAGE).is_file():
                say("page")
                with held(result.folder):
                    write_report(result.folder, warn)
        results.append(result)
    if as_json:
        print_json({"variants": [{"folder": str(r.folder), "ok": r.ok, "manifest": r.manifest} for r in results]})
    else:
        for i, (spec, result) in enumerate(zip(wanted, results, strict=True)):
            _print_faults(result.manifest)
            # Standard output has the folder alone, for a script to take.
            lines = [*_summary(spec, result, given[i]), *printing[i : i + 1]]
            for line in sorted(lines, key=lambda line: line.startswith("open ")):  # what to open comes last
                warn(f"{spec.name}: {line}")
            typer.echo(str(result.folder))
    return all(result.ok for result in results)


def _given_paths(source: str, changes: list[str]) -> frozenset[str]:
    """Return the paths of the numbers that a person gave, by --set or in a file that is no template and no result's."""
    shipped = source in every_template() or (Path(source).parent / "manifest.json").exists()
    own = {} if shipped else read_toml(Path(source))
    return frozenset({change.partition("=")[0].strip() for change in changes} | {path for path, _ in numbers(own)})


def _summary(of: Subject, built: Built, given: frozenset[str]) -> Iterator[str]:
    """Return the lines of a result; `given`: see `_given_paths`."""
    if isinstance(of, Compound):
        return of.summary(built.folder, built.manifest, given)
    return summary(of.unit, built, given)


def _print_faults(manifest: Manifest) -> None:
    """Print warnings, failed mould checks, and findings in files."""

    for warning in manifest["warnings"]:
        warn(f"warning: {warning}")
    for entry in manifest["skipped"]:
        if entry["reason"] == NO_KERNEL:
            warn(f"note: STEP left out: {entry['reason']}; {install_command('step')}")
    checks = manifest["mould_checks"]
    for check in checks:
        if check["ok"] and check["advice"]:
            warn(f"note: {check['code']} {check['where']}: {check['advice']}")
        if not check["ok"]:
            measured = f"{check['value']:.3g} {check['unit']}, limit {check['limit']:.3g}"
            advice = f"; {check['advice']}" if check["advice"] else ""
            typer.echo(f"{check['code']} {check['where']}: {measured}{advice}", err=True)
    for finding in manifest["check"]["findings"]:
        typer.echo(f"{finding['path']}: {finding['code']} {finding['message']}", err=True)
