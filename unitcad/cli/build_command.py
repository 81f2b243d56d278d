"""The commands build and report."""

from __future__ import annotations

import json
import shlex
import sys
import time
import tomllib
from collections.abc import Container, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Annotated, Any

import typer

from unitcad.casting.steps import casting_summary
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
    overrides,
    with_fit,
)
from unitcad.designs import widths
from unitcad.designs.printed import OVER_ALL
from unitcad.errors import UnitcadError, WrongArgument, install_step
from unitcad.meshcheck.findings import counted
from unitcad.moulds.heights import NEAR
from unitcad.pipeline import step_helper
from unitcad.pipeline.manifest import NO_KERNEL, Manifest, PartRecord, row
from unitcad.pipeline.optional import UNMADE
from unitcad.pipeline.subjects import Compound, load_subject
from unitcad.pipeline.write import BENCH, PAGE, Built, hold_folder
from unitcad.pipeline.write import build as build_subject
from unitcad.report import write_report
from unitcad.report.read_results import check_casts
from unitcad.spec import Spec, assumed_lengths, length_text, read_toml
from unitcad.spec.custom_code import files_named
from unitcad.text import join_words, number
from unitcad.validation import confirm_known, every_template
from unitcad.validation.suggestions import numbers

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
        data = tomllib.loads(spec.read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return
    named = files_named(data)
    design = named.pop("design", "")
    unit = data.get("unit")
    for text in (design.rpartition(".py:")[0] + ".py" if ".py:" in design else design, *named.values(), unit):
        if isinstance(text, str) and text.rpartition(".")[2] in ("py", "toml", "stl", "3mf", "step", "stp"):
            yield spec.parent / text


def summary(spec: Spec, built: Built, given: Container[str] = ()) -> Iterator[str]:
    """Yield a line each: size and mass, times, grams, checks, the edge level, the page. Skipped outputs have no line.

    A length that is `given`, by its path, counts as measured.
    """
    manifest = built.manifest
    columns = row(spec, manifest)
    parts = [part for part in manifest["parts"] if part["role"] == "unit"]
    if parts:
        high, alone = _height(parts), _height([part for part in parts if part["made"] != "bought"])
        circuit = f" with its circuit, {alone} without" if alone != high and spec.fpcb else ""
        mass = columns.get("silicone_mass_g")
        silicone = f", {number(mass, 3)} g of silicone" if isinstance(mass, float) else ""
        cells = json.loads((built.folder / "casting.json").read_bytes())["cells"] if manifest["casting"] else 1
        each = f"{cells} units, each " if cells > 1 else ""
        cast = [part["bbox_mm"] for part in parts if part["made"] != "bought"]  # without motor, circuit and wires
        across = " x ".join(number(width, 3) for width in widths(spec, cast))
        made = _as_printed(json.loads((built.folder / "casting.json").read_bytes())) if manifest["casting"] else ""
        yield f"{each}{across} mm across, {made or f'{high} mm high'}{circuit}{silicone}"
    yield from assumed_line(spec, given)
    if manifest["casting"]:
        yield from casting_summary(json.loads((built.folder / "casting.json").read_bytes()))
    yield from checks_line(manifest)
    if level := manifest["estimate"]:
        yield from level["lines"]
    yield from to_open(built.folder)


def _as_printed(casting: dict[str, Any]) -> str:
    """Write the height over all and the caps as the printer makes them; "" if it makes what is drawn."""
    heights = casting["unit_heights"]
    total = next((each for each in heights if each["what"] == OVER_ALL), None)
    caps = [each for each in heights if each["what"].endswith("'s cap")]
    near = NEAR * casting["printing"]["layer_mm"]
    if total is None or all(abs(each["printed_mm"] - each["asked_mm"]) <= near for each in (total, *caps)):
        return ""
    drawn, printed = (number(total[key], 3) for key in ("asked_mm", "printed_mm"))
    thick = join_words(number(each["printed_mm"], 3) for each in caps) if caps else ""
    named = f", cap{'s' * (len(caps) > 1)} {thick}" if caps else ""
    return f"{printed} mm high (drawn {drawn}){named}"


def assumed_line(spec: Spec, given: Container[str], path: str = "") -> Iterator[str]:
    """Yield a line of the lengths that nobody measured, if there are any; `path`: of the spec in its file."""
    if assumed := assumed_lengths(spec, given, path):
        lengths = join_words(f"{path}{length_text(spec, key)} ({how})" for key, how in assumed.items())
        yours = f"; build with yours: --set {path}{next(iter(assumed))}=MM" if path else ""
        yield f"measure first; assumed: {lengths}{yours}"


def checks_line(manifest: Manifest) -> Iterator[str]:
    """Yield a line of the mould checks and of the faults in files, if they were checked."""
    checks, check = manifest["mould_checks"], manifest["check"]
    if checks:
        passed = sum(entry["ok"] for entry in checks)
        files = f"{counted(check['errors'], 'error')} and {counted(check['warnings'], 'warning')} in the files"
        yield f"{len(manifest['parts'])} bodies, {passed} of {len(checks)} mould checks passed, {files}"


def to_open(folder: Path) -> Iterator[str]:
    """Yield a line for each page of a result's folder."""
    for name, use in ((BENCH, " to cast"), (PAGE, "")):
        if (folder / name).is_file():
            yield f"open {shlex.quote(str(folder / name))}{use}"


def _height(parts: list[PartRecord]) -> str:
    boxes = [part["bbox_mm"] for part in parts]
    return number(max((box[5] for box in boxes), default=0.0) - min((box[2] for box in boxes), default=0.0), 3)


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
    changes, chosen = overrides(with_fit(sets, fit), formats), outputs(only)
    allow_code(code)

    def once() -> bool:
        """Build the specs and print the results; return whether every check passed."""
        # Every spec is validated before the first one is built.
        wanted = [(load_subject(spec, changes, chosen), _given_paths(spec, changes)) for spec in specs]
        results: list[Built] = []
        for spec, given in wanted:
            with progress(spec.name) as say:
                result = build_subject(spec.of, out, only=chosen, check=not no_check, say=say, given=given)
                if paged or (result.folder / PAGE).is_file():
                    say("page")
                    with hold_folder(result.folder):
                        write_report(result.folder, warn)
            results.append(result)
        if as_json:
            print_json({"variants": [{"folder": str(r.folder), "ok": r.ok, "manifest": r.manifest} for r in results]})
        else:
            for (spec, given), result in zip(wanted, results, strict=True):
                _print_faults(result.manifest)
                # Standard output has the folder alone, for a script to take.
                if isinstance(spec, Compound):
                    lines = spec.summary(result.folder, result.manifest, given)
                else:
                    lines = summary(spec.unit, result, given)
                for line in lines:
                    warn(f"{spec.name}: {line}")
                typer.echo(str(result.folder))
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


def _given_paths(source: str, changes: list[str]) -> frozenset[str]:
    """Return the paths of the numbers that a person gave, by --set or in a file that is no template and no result's."""
    shipped = source in every_template() or (Path(source).parent / "manifest.json").exists()
    own = {} if shipped else read_toml(Path(source))
    return frozenset({change.partition("=")[0].strip() for change in changes} | {path for path, _ in numbers(own)})


def _print_faults(manifest: Manifest) -> None:
    """Print warnings, failed mould checks, and findings in files."""

    for warning in manifest["warnings"]:
        warn(f"warning: {warning}")
    for entry in manifest["skipped"]:
        if entry["reason"] == NO_KERNEL:
            warn(f"note: STEP left out: {entry['reason']}; {install_step()}")
        if entry["reason"].startswith(UNMADE):
            warn(f"warning: {entry['output']} {entry['reason']}")
    checks = manifest["mould_checks"]
    for check in checks:
        if check["ok"] and check["advice"] and check["advice"] not in manifest["warnings"]:
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
