"""`unitcad check`: judge mesh files by the rules of unitcad.check."""

from __future__ import annotations

import sys
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from unitcad.errors import Refusal, UnitcadError, unknown_name

if TYPE_CHECKING:
    from unitcad.check import FileReport, Options

_SHORT_UNITS = {"mm": "millimeter", "cm": "centimeter", "m": "meter", "in": "inch", "inches": "inch", "ft": "foot"}


def check(
    files: Annotated[list[str] | None, typer.Argument(help="Files, folders or globs.", show_default=False)] = None,
    output_format: Annotated[str, typer.Option(help="text, json, github, sarif or junit.")] = "text",
    as_json: Annotated[bool, typer.Option("--json", help="Short for --output-format json.")] = False,
    select: Annotated[
        list[str] | None,
        typer.Option(help="Only codes with these prefixes (comma or repeated); what ended a file's judgement stays."),
    ] = None,
    ignore: Annotated[
        list[str] | None, typer.Option(help="Not codes with these prefixes; what ended a file's judgement stays.")
    ] = None,
    extend_select: Annotated[list[str] | None, typer.Option(help="Prefixes added to --select.")] = None,
    fail_on: Annotated[str, typer.Option(help="error or warning: what makes the exit code 1.")] = "error",
    printer: Annotated[str | None, typer.Option(help="Judge fit and printability (S002, D) for this printer.")] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of files that have none: mm, cm, m, in, ft ...")] = None,
    shells: Annotated[int | None, typer.Option(min=0, help="Number of shells expected (G005).")] = None,
    strict_3mf: Annotated[
        bool, typer.Option("--3mf-strict", help="Judge 3MF by the letter: vendors' attributes, lost thumbnails fail.")
    ] = False,
    manifest: Annotated[str | None, typer.Option(help="manifest.json of a build, or its folder (M rules).")] = None,
    jobs: Annotated[int, typer.Option("--jobs", "-j", min=1, help="Processes.")] = 1,
    max_faces: Annotated[int, typer.Option(min=1, help="Faces a file may have.")] = 10_000_000,
    timeout: Annotated[float, typer.Option(min=0.001, help="Seconds a file may take.")] = 600.0,
    memory: Annotated[int, typer.Option(min=200, help="MB of address space a process may use.")] = 8000,
    statistics: Annotated[
        bool, typer.Option(help="Count findings by rule: in place of the text, beside other formats on stderr.")
    ] = False,
    explain: Annotated[
        str | None, typer.Option(help="Say what a code means, why it matters and how to fix it.")
    ] = None,
) -> None:
    """Judge mesh files as they are, before any repair: STL, 3MF, OBJ, PLY, OFF, and STEP with a B-rep extra."""
    from unitcad.check import formats, rulebook, run

    if explain is not None:
        typer.echo(rulebook.explain(explain))
        return
    output_format = "json" if as_json else output_format
    if output_format not in formats.FORMATS:
        raise unknown_name("--output-format", output_format, formats.FORMATS)
    if fail_on not in ("error", "warning"):
        raise unknown_name("--fail-on", fail_on, ("error", "warning"))
    options = _options(select, ignore, extend_select, unit, printer, shells, strict_3mf, max_faces, timeout)
    if not files and manifest is None:
        raise UnitcadError("check needs files, folders or globs, or --manifest")
    reports = _run(files or [], options, manifest, printer is not None, jobs, memory)
    table = formats.statistics(reports) if statistics else ""
    if statistics and output_format == "text":
        sys.stdout.write(table)
    else:
        sys.stdout.write(formats.render(reports, output_format, fail_on))
        sys.stderr.write(table)
    raise typer.Exit(run.worst(reports, fail_on))


def _run(
    names: list[str], options: Options, manifest: str | None, printer_named: bool, jobs: int, memory: int
) -> list[FileReport]:
    from unitcad.check import run

    paths, reports = run.expand(names)
    if manifest is None:
        work = [(path, options) for path in paths]
        return reports + list(run.check_files(work, jobs, memory))
    from unitcad.check import manifest as listing

    listed = listing.read(manifest)
    work = listing.work(listed, paths, options, printer_named)
    judged = list(run.check_files(work, jobs, memory))
    compared = [listing.compare(listed, report, options) for report in judged]
    return reports + compared + listing.unjudged(listed, [path for path, _ in work], options)


def _options(
    select: list[str] | None,
    ignore: list[str] | None,
    extend_select: list[str] | None,
    unit: str | None,
    printer: str | None,
    shells: int | None,
    strict_3mf: bool,
    max_faces: int,
    timeout: float,
) -> Options:
    from unitcad import catalogue
    from unitcad.check import Limits, Options
    from unitcad.check.rulebook import check_prefixes
    from unitcad.check.scale import UNITS_MM

    if unit is not None:
        unit = _SHORT_UNITS.get(unit.lower(), unit.lower())
        if unit not in UNITS_MM:
            raise unknown_name("--unit", unit, UNITS_MM)
    if not timeout < 1e7:
        raise Refusal("--timeout", timeout, "must be a number of seconds below 1e7", 600)
    chosen = Options(
        unit=unit,
        printer=None if printer is None else catalogue.choose("--printer", printer, catalogue.printers()),
        shells=shells,
        strict_3mf=strict_3mf,
        limits=replace(Limits(), max_faces=max_faces, seconds=timeout),
    )
    wanted = check_prefixes("--select", _split(select))
    extra = check_prefixes("--extend-select", _split(extend_select))
    return replace(chosen, select=wanted + extra if wanted else (), ignore=check_prefixes("--ignore", _split(ignore)))


def _split(values: list[str] | None) -> list[str]:
    return [part for value in values or [] for part in value.split(",") if part.strip()]
