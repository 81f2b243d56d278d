"""The commands build and report."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from unitcad.api.build_call import BuildResult, build_each
from unitcad.cli.output import print_json, progress, say_error, warn
from unitcad.cli.shared_options import (
    AllowCode,
    AsJson,
    Fit,
    Formats,
    NoCheck,
    Only,
    Out,
    Sets,
    Specs,
    allow_code,
    expect_commas,
    names_in,
    outputs,
)
from unitcad.documents import read_toml
from unitcad.errors import UnitcadError, WrongArgument
from unitcad.extras import install_step
from unitcad.pipeline import step_helper
from unitcad.pipeline.manifest import NO_KERNEL, Manifest
from unitcad.pipeline.optional import UNMADE
from unitcad.report import write_report
from unitcad.report.read_results import check_casts
from unitcad.spec.custom_code import files_named
from unitcad.validation import confirm_known

EVERY_S = 0.25
"""Seconds between two looks at the files."""


def wait_for_saves(specs: Iterable[Path]) -> Iterator[None]:
    """Yield at once, and then after every save of a spec or a file that it names: a design's, a fit, an array's unit.

    A save counts once the file has not changed for `EVERY_S`: editors write in several steps.
    """
    specs = list(specs)
    while True:
        seen = _states(specs)
        yield
        while (now := _states(specs)) == seen:
            time.sleep(EVERY_S)
        while True:
            time.sleep(EVERY_S)
            if (later := _states(specs)) == now:
                break
            now = later


def _states(specs: list[Path]) -> dict[Path, tuple[int, int, int] | None]:
    """Return time, size and inode of each file, which a save changes; None for a missing file."""
    found = {}
    for path in [*specs, *(named for spec in specs for named in _files_of(spec))]:
        try:
            state = path.stat()
            found[path] = state.st_mtime_ns, state.st_size, state.st_ino
        except OSError:
            found[path] = None
    return found


def _files_of(spec: Path) -> Iterator[Path]:
    """Yield the files that a spec or an array names; none for a text that can't be read."""
    try:
        data = read_toml(spec)
    except UnitcadError:
        return
    named = files_named(data)
    design = named.pop("design", "")
    unit = data.get("unit")
    for text in (design.rpartition(".py:")[0] + ".py" if ".py:" in design else design, *named.values(), unit):
        if isinstance(text, str) and text.rpartition(".")[2] in ("py", "toml", "stl", "3mf", "step", "stp"):
            yield spec.parent / text


def build(
    specs: Specs,
    out: Out = Path("out"),
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
    watch: Annotated[
        bool, typer.Option("--watch", help="Build again after every save of the spec, until Ctrl-C.")
    ] = False,
    code: AllowCode = False,
    as_json: AsJson = False,
) -> None:
    """Make a unit and its casting moulds, or an array of units. The last line printed is the folder."""
    expect_commas("SPEC", specs)
    specs = [confirm_known(spec) for spec in specs]
    drawn = only is None or not {"unit", "moulds"}.isdisjoint(names_in(only))
    if drawn and (formats is None or "step" in names_in(formats)):
        step_helper.start()  # first: it loads its modules while this process loads its own
    paged = only is None if page is None else page
    allow_code(code)

    def once() -> bool:
        """Build the specs and print the results; return whether every check passed."""
        results = build_each(
            specs,
            out,
            set=sets or (),
            formats=None if formats is None else names_in(formats),
            only=outputs(only),
            check=not no_check,
            report=paged,
            fit=fit,
            shown=progress,
            warn=warn,
        )
        if as_json:
            print_json({"variants": [{"folder": str(r.folder), "ok": r.ok, "manifest": r.manifest} for r in results]})
        else:
            for result in results:
                _print_faults(result.manifest)
                # Standard output has the folder alone, for a script to take.
                for line in result.lines:
                    warn(f"{result.manifest['name']}: {line}")
                typer.echo(str(result.folder))
            if len(results) > 1:
                _print_differences(results)
        return all(result.ok for result in results)

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


def _print_differences(results: Sequence[BuildResult]) -> None:
    """Print how results differ, on standard error."""
    from unitcad.cli.tables import print_table  # loads rich, which one result does not need
    from unitcad.pipeline.differences import differences

    if rows := differences(results):
        print_table(rows, "What differs", stderr=True)
    else:
        warn("The results do not differ.")


def _print_faults(manifest: Manifest) -> None:
    """Print warnings, failed mould checks, and findings in files."""

    for warning in manifest["warnings"]:
        warn(f"warning: {warning}")
    for entry in manifest["skipped"]:
        if entry["reason"] == NO_KERNEL:
            warn(f"note: STEP left out: {entry['reason']}; {install_step()}")
        if entry["reason"].startswith(UNMADE):
            warn(f"warning: {entry['output']} {entry['reason']}")
    checks, warned = manifest["mould_checks"], tuple(manifest["warnings"])
    for check in checks:
        if check["ok"] and check["advice"] and not any(line.endswith(check["advice"]) for line in warned):
            warn(f"note: {check['code']} {check['where']}: {check['advice']}")
        if not check["ok"]:
            measured = f"{check['value']:.3g} {check['unit']}".rstrip() + f", limit {check['limit']:.3g}"
            advice = f"; {check['advice']}" if check["advice"] else ""
            typer.echo(f"{check['code']} {check['where']}: {measured}{advice}", err=True)
    for finding in manifest["check"]["findings"]:
        typer.echo(f"{finding['path']}: {finding['code']} {finding['message']}", err=True)


def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a variant, or of several.")],
    code: AllowCode = False,
    as_json: AsJson = False,
) -> None:
    """Write one offline page for a folder of results. The last line printed is the page."""

    allow_code(code)
    with progress(str(folder)) as say:
        check_casts(folder)
        say("page")
        page = write_report(folder, warn)
    if as_json:
        print_json({"page": str(page), "bytes": page.stat().st_size})
    else:
        typer.echo(str(page))
