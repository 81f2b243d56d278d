"""unitcad check.

Its settings are the table [check] of the nearest unitcad.toml with one, from the working directory upwards.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from msgspec import Meta, Struct, field

from unitcad import catalogue, files
from unitcad.catalogue import Printer, printers
from unitcad.cli.output import progress
from unitcad.documents import parse_toml, read_toml
from unitcad.errors import Refusal, UnitcadError, unknown_key, unknown_name
from unitcad.files import no_such_file, path_seen_from
from unitcad.meshcheck import FileReport, Limits, Options, file_checks
from unitcad.meshcheck import baseline as baselines
from unitcad.meshcheck import manifest as listing
from unitcad.meshcheck.output import FORMATS, failing, render
from unitcad.meshcheck.rules.registry import check_prefixes
from unitcad.meshcheck.rules.registry import explain as explanation
from unitcad.meshcheck.rules.s_scale import unit_named
from unitcad.rooms import expect_none_but, load
from unitcad.text import printable


class Settings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, rename="kebab"):
    """Keys of a settings file, by the options' names; None or empty for a missing key."""

    select: list[str] = []
    ignore: list[str] = []
    per_file_ignores: dict[str, list[str]] = {}
    fail_on: Literal["error", "warning"] | None = None
    printer: str | None = None
    unit: str | None = None
    strict: bool | None = None
    exclude: list[str] = []
    strict_3mf: bool | None = field(default=None, name="3mf-strict")
    max_faces: Annotated[int, Meta(ge=1)] | None = None
    timeout: Annotated[float, Meta(ge=0.001)] | None = None
    memory: Annotated[int, Meta(ge=200)] | None = None
    baseline: str | None = None


NAME = "unitcad.toml"


class Configuration(Struct, frozen=True, kw_only=True):
    """Settings with the file they come from, None for none."""

    settings: Settings = Settings()
    path: Path | None = None

    def name(self, key: str) -> str:
        """Name a key in an error: file, table and key."""
        return f"{self.shown}: check.{key}"

    def chosen(self, key: str, given: Any) -> tuple[str, Any]:
        """Return an option's name and the value `given` to it; without one, the name and the value of its setting."""
        return (f"--{key}", given) if given is not None else (self.name(key), getattr(self.settings, key))

    @property
    def shown(self) -> str | None:
        """Path of the file from the working directory."""
        return None if self.path is None else path_seen_from(self.path)

    @property
    def baseline(self) -> Path | None:
        """The file of known findings that the settings name, from their folder."""
        if self.path is None or self.settings.baseline is None:
            return None
        return Path(path_seen_from(self.path.parent / self.settings.baseline))

    def ignored(self, path: str) -> list[str]:
        """Return prefixes of codes that per-file-ignores drops for a file; patterns start at the settings' folder."""
        if self.path is None:
            return []
        below = path_seen_from(path, self.path.parent)
        return [
            code for pattern, codes in self.settings.per_file_ignores.items() if _fits(below, pattern) for code in codes
        ]

    def left_out(self, given: Sequence[str]) -> Callable[[str], bool]:
        """Return whether `exclude` or one of the patterns `given` on the command line names a path or a folder of it.

        Patterns start at the folder of the settings, and those given at the working directory.
        """
        sets = [(Path.cwd() if self.path is None else self.path.parent, self.settings.exclude), (Path.cwd(), given)]

        def named(path: str) -> bool:
            for folder, patterns in sets:
                below = Path(path_seen_from(path, folder)) if patterns else Path()
                for pattern in patterns:
                    if any(_fits(part.as_posix(), pattern.rstrip("/")) for part in (below, *below.parents)):
                        return True
            return False

        return named


def _fits(path: str, pattern: str) -> bool:
    return fnmatchcase(path, pattern) or ("/" not in pattern and fnmatchcase(Path(path).name, pattern))


def find(named: str | None = None) -> Configuration:
    """Read the settings of the file `named`, else of the nearest one that has any.

    Raises UnitcadError for a file that can't be read, Refusal for a key or value that can't be.
    """
    if named is not None:
        configuration = _read(Path(named))
        if configuration is None:
            raise UnitcadError(f"--config {named}: has no table [check]")
        return configuration
    here = Path.cwd()
    for folder in (here, *here.parents):
        if (folder / NAME).is_file() and (configuration := _read(folder / NAME)):
            return configuration
    return Configuration()


def _read(path: Path) -> Configuration | None:
    """Read the settings of a file; None without such a table. A unit's spec named unitcad.toml has none."""
    shown = path_seen_from(path.absolute())
    data: Any = parse_toml(files.read_text(path), shown)
    if "design" in data:
        return None
    try:
        for key in data if path.name == NAME else ():
            if key != "check":
                raise unknown_key(key, data[key], ["check"])
        if "check" not in data:
            return None
        from unitcad.spec.convert import convert

        settings = convert(data["check"], Settings, "check")
    except Refusal as error:
        raise Refusal(f"{shown}: {error.field}", error.value, error.limit, error.nearest) from None
    return Configuration(settings=settings, path=path.absolute())


def check(
    files: Annotated[
        list[str] | None, typer.Argument(metavar="[FILE]...", help="Mesh files, folders or globs.", show_default=False)
    ] = None,
    output_format: Annotated[
        str, typer.Option(metavar="FORMAT", help="Report: text, json, github, sarif, junit or markdown.")
    ] = "text",
    as_json: Annotated[bool, typer.Option("--json", help="Short for --output-format json.")] = False,
    report: Annotated[
        list[str] | None,
        typer.Option(metavar="FORMAT=FILE", help="Also write a report to a file, such as sarif=out.sarif."),
    ] = None,
    select: Annotated[
        list[str] | None,
        typer.Option(metavar="CODES", help="Only rules whose code begins so, such as T,M001. Default: all rules."),
    ] = None,
    ignore: Annotated[
        list[str] | None,
        typer.Option(metavar="CODES", help="Rules to leave out. Errors that ended a file's check stay."),
    ] = None,
    fail_on: Annotated[
        str | None,
        typer.Option(metavar="LEVEL", help="Findings that make the exit code 1: error or warning. Default: error."),
    ] = None,
    printer: Annotated[
        str | None,
        typer.Option(
            metavar="PRINTER", help="Check size and printability (S002, D) for a printer. Default: no printer's rules."
        ),
    ] = None,
    unit: Annotated[
        str | None,
        typer.Option(metavar="UNIT", help="Unit of files that name none: mm, cm, m, in, ft or micron. Default: mm."),
    ] = None,
    shells: Annotated[
        int | None, typer.Option(metavar="N", min=0, help="Expected number of shells (G005). Default: any.")
    ] = None,
    strict_3mf: Annotated[
        bool | None,
        typer.Option(
            "--3mf-strict/--no-3mf-strict",
            help="Follow the 3MF specification strictly: vendors' attributes and lost thumbnails fail. Default: off.",
        ),
    ] = None,
    strict: Annotated[
        bool | None,
        typer.Option(
            "--strict/--no-strict",
            help="Treat crossings and folds too shallow for any printer as errors. Default: warnings.",
        ),
    ] = None,
    exclude: Annotated[
        list[str] | None,
        typer.Option(metavar="PATTERN", help="Leave out files by a pattern of their path, or of a name in it."),
    ] = None,
    manifest: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="manifest.json of a build, or its folder (M rules). Default: none."),
    ] = None,
    jobs: Annotated[int, typer.Option("--jobs", "-j", metavar="N", min=1, help="Worker processes.")] = 1,
    max_faces: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Most faces in a file. Default: 10,000,000.")
    ] = None,
    timeout: Annotated[
        float | None, typer.Option(metavar="SECONDS", min=0.001, help="Time limit for a file. Default: 600.")
    ] = None,
    memory: Annotated[
        int | None, typer.Option(metavar="MB", min=200, help="Most address space of a process. Default: 8000.")
    ] = None,
    pictures: Annotated[
        str | None,
        typer.Option(metavar="DIR", help="Folder for pictures of findings. Default: none."),
    ] = None,
    diff: Annotated[
        tuple[str, str] | None,
        typer.Option(
            metavar="OLD NEW", help="Compare two versions of a file or a folder; only new findings fail. Default: none."
        ),
    ] = None,
    baseline: Annotated[
        str | None,
        typer.Option(
            metavar="FILE", help="Known findings, which do not fail. Default: those of the settings, or none."
        ),
    ] = None,
    write_baseline: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Write the findings of this run to a file as known. Default: none."),
    ] = None,
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="Print the findings that fail, and one line of sums.")
    ] = False,
    config: Annotated[
        str | None,
        typer.Option(metavar="FILE", help="Settings: a TOML file with a [check] table. Default: the nearest one."),
    ] = None,
    hook: Annotated[
        bool,
        typer.Option("--hook", help="Take words from a hook runner: options, then existing files of any name."),
    ] = False,
    explain: Annotated[
        list[str] | None,
        typer.Option(metavar="CODES", help="Explain mesh rules and mould checks (C...). No file is checked."),
    ] = None,
) -> None:
    """Check mesh files as they are, before any repair.

    Reads STL, 3MF, OBJ, PLY and OFF, and STEP if an extra with a B-rep kernel is installed.
    """
    if explain is not None:
        sys.stdout.write(_explained([part.strip() for part in ",".join(explain).split(",")]) + "\n")
        return
    if as_json and output_format not in ("text", "json"):
        why = "--json asks for another one: leave one of them out, or have both with --report json=FILE"
        raise Refusal("--output-format", output_format, why)
    output_format = "json" if as_json else output_format
    if output_format not in FORMATS:
        raise unknown_name("--output-format", output_format, FORMATS)
    if pictures is not None and Path(pictures).exists() and not Path(pictures).is_dir():
        raise Refusal("--pictures", pictures, "must name a folder; this is a file")
    if quiet and output_format != "text":
        raise Refusal(
            "--quiet", output_format, "shortens the text report; --report FORMAT=FILE writes another one, too"
        )
    copies = [_copy(given, FORMATS) for given in report or []]
    configuration = find(config)
    settings = configuration.settings
    level = fail_on or settings.fail_on or "error"
    if level not in ("error", "warning"):
        raise unknown_name("--fail-on", level, ("error", "warning"))
    base = configuration.baseline if baseline is None else Path(baseline)
    writes = None if write_baseline is None else Path(write_baseline)
    options = Options(
        select=check_prefixes(*configuration.chosen("select", _split(select))),
        ignore=check_prefixes(*configuration.chosen("ignore", _split(ignore))),
        unit=unit_named(*configuration.chosen("unit", unit)),
        printer=_printer(*configuration.chosen("printer", printer)),
        shells=shells,
        strict=bool(settings.strict if strict is None else strict),
        strict_3mf=bool(settings.strict_3mf if strict_3mf is None else strict_3mf),
        limits=_limits(max_faces or settings.max_faces, *configuration.chosen("timeout", timeout)),
        draw=pictures is not None and diff is None,
        every_place=base is not None or writes is not None,
    )
    for name in files or ():
        if name.endswith(".toml") and Path(name).is_file():
            expect_none_but("", read_toml(Path(name)), name, "FILE")
    if diff is not None and (files or manifest is not None or baseline is not None or writes is not None):
        raise UnitcadError("--diff compares its two names: leave out other files, --manifest and the baselines")
    if not files and manifest is None and diff is None:
        raise UnitcadError(
            "FILE...: is required: mesh files, folders or globs, or --manifest; see unitcad check --help"
        )
    for pattern, codes in settings.per_file_ignores.items():
        check_prefixes(configuration.name(f"per-file-ignores.{pattern}"), codes)
    known: baselines.Baseline = {}
    if base is not None and diff is None and writes is None:
        if not base.exists():
            field = "--baseline" if baseline is not None else configuration.name("baseline")
            raise Refusal(field, base.as_posix(), f"{no_such_file(base)}; --write-baseline {base.as_posix()} writes it")
        known = baselines.read(base)
    draw = drawn = None
    if pictures is not None:
        from unitcad.export import finding_pictures  # loads Pillow

        draw, drawn = (
            partial(finding_pictures.write, Path(pictures)),
            partial(finding_pictures.versions, Path(pictures)),
        )
    memory = memory or settings.memory or 8000

    def check_all(work: Sequence[tuple[str, Options]]) -> Iterator[FileReport]:
        """Yield the reports, and show on a terminal how many there are."""
        every = file_checks.check_files(work, jobs=jobs, memory_mb=memory, then=draw if diff is None else None)
        with progress("check") as say:
            failed = 0
            for k, one in enumerate(every, 1):
                failed += bool(failing(one, level))
                say(f"{k} of {len(work)} files, {failed} with findings that fail; {printable(one.path)}")
                yield one

    left_out = configuration.left_out(exclude or [])
    paths, unread = file_checks.expand(files or [], left_out)
    faults = [
        Refusal("FILE", report.path, report.findings[0].message) for report in unread if report.verdict == "error"
    ]
    faults += [Refusal("FILE", name, no_such_file(name)) for name in paths if not os.path.lexists(name)]
    if faults and manifest is None and len(faults) == len({*paths, *(report.path for report in unread)}):
        faults[0].others = tuple(faults[1:])
        raise faults[0]

    def of_path(path: str) -> Options:
        """Return the options without the codes that the settings ignore for a file."""
        return replace(options, unwanted=tuple(code.strip().upper() for code in configuration.ignored(path)))

    if diff is not None:
        from unitcad.meshcheck import compare

        reports = list(compare.compare(compare.pairs(*diff, left_out), of_path, check_all, drawn))
    elif manifest is None:
        reports = unread + list(check_all([(path, of_path(path)) for path in paths]))
    else:
        listed = listing.read(manifest)
        work = listing.work(listed, paths, of_path, None if options.printer is not None else printers())
        compared = [listing.compare(listed, report, of_path(report.path)) for report in check_all(work)]
        reports = unread + compared + listing.check_unread(listed, [path for path, _ in work], of_path)
    if writes is not None:
        known, base = baselines.write(writes, reports), writes
    if base is not None and diff is None:
        reports = [baselines.apply(known, base, report) for report in reports]
    reports = [report.shortened() for report in reports]
    named = None if base is None or diff is not None else base.as_posix()
    for format_, path in copies:
        _save(path, render(reports, format_, level, configuration.shown, named))
    written = render(reports, output_format, level, configuration.shown, named, quiet=quiet)
    _write(written, plain=output_format == "text")
    raise typer.Exit(2 if faults else file_checks.worst(reports, level))


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


def _printer(field: str, name: str | None) -> Printer | None:
    return catalogue.choose(field, name, catalogue.printers()) if name else None


def _limits(max_faces: int | None, field: str, seconds: float | None) -> Limits:

    default = Limits()
    if seconds is not None and not seconds < 1e7:
        raise Refusal(field, seconds, "must be a number of seconds below 1e7", default.seconds)
    return replace(default, max_faces=max_faces or default.max_faces, seconds=seconds or default.seconds)


def _split(values: list[str] | None) -> list[str] | None:
    return values and [part for value in values for part in value.split(",") if part.strip()]


def _explained(codes: list[str]) -> str:
    """Explain codes; those of mould checks begin with C. Raises Refusal for an unknown one."""
    moulds = [code.upper() for code in codes if code[:1].upper() == "C"]
    meshes = [code for code in codes if code.upper() not in moulds]
    texts = [load("unitcad.checks:explain")(code) for code in moulds]
    return "\n\n".join([*texts, *([explanation(",".join(meshes))] if meshes else [])])
