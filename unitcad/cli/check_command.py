"""`unitcad check`: mesh files against the rules of unitcad.check."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from unitcad.errors import Refusal, UnitcadError, unknown_name

if TYPE_CHECKING:
    from unitcad.catalogue import Printer
    from unitcad.check import FileReport, Limits, Options
    from unitcad.cli.check_settings import Configuration


def check(
    files: Annotated[list[str] | None, typer.Argument(help="Files, folders or globs.", show_default=False)] = None,
    output_format: Annotated[str, typer.Option(help="text, json, github, sarif, junit or markdown.")] = "text",
    as_json: Annotated[bool, typer.Option("--json", help="Short for --output-format json.")] = False,
    report: Annotated[
        list[str] | None,
        typer.Option(
            metavar="FORMAT=FILE", help="Also write the report in a format to a file, such as sarif=out.sarif."
        ),
    ] = None,
    select: Annotated[
        list[str] | None,
        typer.Option(help="Only codes with these prefixes (comma or repeated); errors that ended a file's check stay."),
    ] = None,
    ignore: Annotated[
        list[str] | None, typer.Option(help="Not codes with these prefixes; errors that ended a file's check stay.")
    ] = None,
    extend_select: Annotated[list[str] | None, typer.Option(help="Prefixes added to --select.")] = None,
    fail_on: Annotated[str | None, typer.Option(help="error (default) or warning: what makes the exit code 1.")] = None,
    printer: Annotated[str | None, typer.Option(help="Check fit and printability (S002, D) for this printer.")] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of files that have none: mm, cm, m, in, ft and so on")] = None,
    shells: Annotated[int | None, typer.Option(min=0, help="Number of shells expected (G005).")] = None,
    strict_3mf: Annotated[
        bool | None,
        typer.Option(
            "--3mf-strict/--no-3mf-strict",
            help="Follow the 3MF specification strictly: vendors' attributes, lost thumbnails fail.",
        ),
    ] = None,
    manifest: Annotated[str | None, typer.Option(help="manifest.json of a build, or its folder (M rules).")] = None,
    jobs: Annotated[int, typer.Option("--jobs", "-j", min=1, help="Processes.")] = 1,
    max_faces: Annotated[int | None, typer.Option(min=1, help="Faces a file may have (default 10000000).")] = None,
    timeout: Annotated[float | None, typer.Option(min=0.001, help="Seconds a file may take (default 600).")] = None,
    memory: Annotated[
        int | None, typer.Option(min=200, help="MB of address space a process may use (default 8000).")
    ] = None,
    all_locations: Annotated[bool, typer.Option(help="List every location of a finding, up to 10000.")] = False,
    baseline: Annotated[str | None, typer.Option(help="File of known findings; they do not fail.")] = None,
    write_baseline: Annotated[bool, typer.Option(help="Write the findings to the baseline.")] = False,
    show: Annotated[
        str | None,
        typer.Option(help="Folder for pictures: each finding near and on the whole part, and coloured 3MF files."),
    ] = None,
    config: Annotated[
        str | None, typer.Option(help="Settings: a TOML file with a table [check]; else from the nearest such file.")
    ] = None,
    no_config: Annotated[bool, typer.Option("--no-config", help="Read no settings.")] = False,
    statistics: Annotated[
        bool, typer.Option(help="Count findings by rule: in place of the text, beside other formats on stderr.")
    ] = False,
    explain: Annotated[
        str | None, typer.Option(help="Print what a code means, why it matters and how to fix it.")
    ] = None,
) -> None:
    """Check mesh files as they are, before any repair.

    Reads STL, 3MF, OBJ, PLY, OFF and GLB, and STEP where an extra with a B-rep kernel is installed.
    """
    from unitcad.check import Options, detail, many_files
    from unitcad.check.output import as_text
    from unitcad.check.output.render import FORMATS, render
    from unitcad.check.rules.registry import check_prefixes
    from unitcad.check.rules.registry import explain as explanation
    from unitcad.check.units import unit_named
    from unitcad.cli import check_settings

    if explain is not None:
        typer.echo(explanation(explain))
        return
    output_format = "json" if as_json else output_format
    if output_format not in FORMATS:
        raise unknown_name("--output-format", output_format, FORMATS)
    copies = [_copy(given, FORMATS) for given in report or []]
    configuration = check_settings.find(config, wanted=not no_config)
    settings = configuration.settings
    fail_on = fail_on or settings.fail_on or "error"
    if fail_on not in ("error", "warning"):
        raise unknown_name("--fail-on", fail_on, ("error", "warning"))
    base = Path(baseline) if baseline is not None else configuration.baseline
    if write_baseline and base is None:
        raise UnitcadError("--write-baseline needs a file: --baseline FILE, or the key baseline of the settings")
    if base is not None:
        from unitcad.check import baseline as baselines

        known = baselines.read(base) if base.exists() or not write_baseline else baselines.EMPTY
    selected = check_prefixes(*configuration.chosen("select", _split(select)))
    extra = check_prefixes("--extend-select", _split(extend_select) or [])
    options = Options(
        select=selected + extra if selected else (),
        ignore=check_prefixes(*configuration.chosen("ignore", _split(ignore))),
        unit=unit_named(*configuration.chosen("unit", unit)),
        printer=_printer(*configuration.chosen("printer", printer)),
        shells=shells,
        strict_3mf=bool(settings.strict_3mf if strict_3mf is None else strict_3mf),
        limits=_limits(max_faces or settings.max_faces, *configuration.chosen("timeout", timeout)),
        locations=detail.MOST if all_locations or base is not None or show is not None else detail.SHOWN,
        draw=show is not None,
    )
    if not files and manifest is None:
        raise UnitcadError("check needs files, folders or globs, or --manifest")
    for pattern, codes in settings.per_file_ignores.items():
        check_prefixes(configuration.name(f"per-file-ignores.{pattern}"), codes)
    draw = None
    if show is not None:
        from unitcad.export import finding_pictures

        draw = partial(finding_pictures.write, Path(show))
    check_all = partial(many_files.check_files, jobs=jobs, memory_mb=memory or settings.memory or 8000, then=draw)
    reports = _reports(files or [], configuration, options, manifest, check_all)
    shown = detail.MOST if all_locations else detail.SHOWN
    if base is not None:
        known = baselines.write(base, known, reports) if write_baseline else known
        reports = [baselines.apply(known, base, report) for report in reports]
    reports = [report.shortened(shown) for report in reports]
    table = as_text.statistics(reports) if statistics else ""
    used = None if base is None else base.as_posix()
    for format_, path in copies:
        _save(path, render(reports, format_, fail_on, configuration.shown, used))
    if statistics and output_format == "text":
        sys.stdout.write(table)
    else:
        written = render(reports, output_format, fail_on, configuration.shown, used)
        _write(written, plain=output_format == "text")
        sys.stderr.write(table)
    raise typer.Exit(many_files.worst(reports, fail_on))


def _copy(given: str, formats: Sequence[str]) -> tuple[str, Path]:
    """Return format and path of `--report FORMAT=FILE`."""
    name, equals, path = given.partition("=")
    if not equals or not path:
        raise Refusal("--report", given, "must be FORMAT=FILE", "sarif=report.sarif")
    if name not in formats:
        raise unknown_name("--report", name, formats)
    if Path(path).is_dir():
        raise Refusal("--report", given, "must name a file; this is a folder", f"{name}={path.rstrip('/')}/report")
    return name, Path(path)


def _save(path: Path, text: str) -> None:
    """Write a report to a file, whole or not at all; its folder is made."""
    from unitcad import files

    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        files.write(path, text.encode("utf-8"))
    except OSError as error:
        raise UnitcadError(f"--report: {path}: {error.strerror}") from None


def _write(text: str, *, plain: bool) -> None:
    """Write a report. What programs read is UTF-8 with LF line ends, whatever the terminal's encoding is."""
    raw = None if plain else getattr(sys.stdout, "buffer", None)  # which a stream in memory has not
    if raw is None:
        sys.stdout.write(text)
        return
    sys.stdout.flush()
    raw.write(text.encode("utf-8"))
    raw.flush()


def _reports(
    names: list[str],
    configuration: Configuration,
    options: Options,
    manifest: str | None,
    check_all: Callable[[list[tuple[str, Options]]], Iterator[FileReport]],
) -> list[FileReport]:
    """Return the reports of all files, compared with a manifest if there is one."""
    from unitcad.check import many_files

    def of_path(path: str) -> Options:
        """Return the options of a file: without what the settings ignore for it."""
        return replace(options, unwanted=tuple(code.strip().upper() for code in configuration.ignored(path)))

    paths, reports = many_files.expand(names)
    if manifest is None:
        return reports + list(check_all([(path, of_path(path)) for path in paths]))
    from unitcad.check import manifest as listing

    listed = listing.read(manifest)
    work = listing.work(listed, paths, of_path, options.printer is not None)
    compared = [listing.compare(listed, report, of_path(report.path)) for report in check_all(work)]
    return reports + compared + listing.unchecked(listed, [path for path, _ in work], of_path)


def _printer(field: str, name: str | None) -> Printer | None:
    if not name:
        return None
    from unitcad import catalogue

    return catalogue.choose(field, name, catalogue.printers())


def _limits(max_faces: int | None, field: str, seconds: float | None) -> Limits:
    from unitcad.check import Limits

    default = Limits()
    if seconds is not None and not seconds < 1e7:
        raise Refusal(field, seconds, "must be a number of seconds below 1e7", default.seconds)
    return replace(default, max_faces=max_faces or default.max_faces, seconds=seconds or default.seconds)


def _split(values: list[str] | None) -> list[str] | None:
    return values and [part for value in values for part in value.split(",") if part.strip()]
