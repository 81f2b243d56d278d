"""A run of the check by its arguments: settings, options, files, reports, exit code."""

from __future__ import annotations

import contextlib
import os
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path

from unitcad import files
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.files import no_such_file
from unitcad.meshcheck import baseline as baselines
from unitcad.meshcheck import compare, file_checks
from unitcad.meshcheck import manifest as listing
from unitcad.meshcheck.arguments import Arguments
from unitcad.meshcheck.findings import FileReport
from unitcad.meshcheck.output import FORMATS, failing, render
from unitcad.meshcheck.rules.f_file import Limits
from unitcad.meshcheck.rules.inspection import Options, Printer
from unitcad.meshcheck.rules.registry import check_prefixes
from unitcad.meshcheck.rules.s_scale import unit_named
from unitcad.meshcheck.settings import LEVELS, Configuration, find
from unitcad.text import printable

Say = Callable[[str], None]


def _silent() -> AbstractContextManager[Say]:
    return contextlib.nullcontext(lambda _: None)


def _no_printers() -> Mapping[str, Printer]:
    return {}


@dataclass(frozen=True)
class Tools:
    """The parts of a program that a run uses beside the check; by default it does without.

    `printer` returns the printer of a name, which an option or a setting of that name gives; `printers` returns all.
    `pictures` returns, for a folder, the function that draws a report's findings and the one that draws two versions.
    `expect_mesh` raises for a file that another command takes. `progress` shows a line while the run goes on.
    """

    printer: Callable[[str, str], Printer] | None = None
    printers: Callable[[], Mapping[str, Printer]] = _no_printers
    pictures: Callable[[Path], tuple[file_checks.Then, compare.Draw]] | None = None
    expect_mesh: Callable[[str], None] = lambda _: None
    progress: Callable[[], AbstractContextManager[Say]] = _silent


def run(given: Arguments, tools: Tools) -> int:
    """Check files, write the reports, and return the exit code. Raises UnitcadError for a wrong argument."""
    form = _format(given)
    copies = [_copy(report) for report in given.report or []]
    configuration = find(given.config)
    settings = configuration.settings
    level = given.fail_on or settings.fail_on or LEVELS[0]
    if level not in LEVELS:
        raise unknown_name("--fail-on", level, LEVELS)
    options = _options(given, configuration, tools)
    for name in given.files or ():
        tools.expect_mesh(name)
    _expect_one_task(given)
    base, known = _known(given, configuration)
    drawn = tools.pictures(Path(given.pictures)) if given.pictures is not None and tools.pictures else (None, None)
    memory = given.memory or settings.memory or 8000

    def check_all(work: Sequence[tuple[str, Options]]) -> Iterator[FileReport]:
        """Yield the reports, and say how many there are."""
        then = None if given.diff is not None else drawn[0]
        with tools.progress() as say:
            failed = 0
            for k, one in enumerate(file_checks.check_files(work, jobs=given.jobs, memory_mb=memory, then=then), 1):
                failed += bool(failing(one, level))
                say(f"{k} of {len(work)} files, {failed} with findings that fail; {printable(one.path)}")
                yield one

    def of_path(path: str) -> Options:
        """Return the options without the codes that the settings ignore for a file."""
        return replace(options, unwanted=tuple(code.strip().upper() for code in configuration.ignored(path)))

    left_out, faults = configuration.left_out(given.exclude or []), False
    if given.diff is not None:
        reports = list(compare.compare(compare.pairs(*given.diff, left_out), of_path, check_all, drawn[1]))
    else:
        reports, faults = _checked(given, left_out, of_path, check_all, options, tools)
    if given.write_baseline is not None:
        base = Path(given.write_baseline)
        known = baselines.write(base, reports)
    if base is not None:
        reports = [baselines.apply(known, base, report) for report in reports]
    reports = [report.shortened() for report in reports]
    named = None if base is None else base.as_posix()
    for format_, path in copies:
        _save(path, render(reports, format_, level, configuration.shown, named))
    written = render(reports, form, level, configuration.shown, named, quiet=given.quiet)
    _write(written, plain=form == "text")
    return 2 if faults else file_checks.worst(reports, level)


def _format(given: Arguments) -> str:
    """Return the format of the output."""
    if given.as_json and given.output_format not in ("text", "json"):
        why = "--json asks for another one: leave one of them out, or have both with --report json=FILE"
        raise Refusal("--output-format", given.output_format, why)
    form = "json" if given.as_json else given.output_format
    if form not in FORMATS:
        raise unknown_name("--output-format", form, FORMATS)
    if given.pictures is not None and Path(given.pictures).exists() and not Path(given.pictures).is_dir():
        raise Refusal("--pictures", given.pictures, "must name a folder; this is a file")
    if given.quiet and form != "text":
        raise Refusal("--quiet", form, "shortens the text report; --report FORMAT=FILE writes another one, too")
    return form


def _options(given: Arguments, configuration: Configuration, tools: Tools) -> Options:
    """Return the options of the check, those of the command line before the settings."""
    settings = configuration.settings
    field, name = configuration.chosen("printer", given.printer)
    if name and tools.printer is None:
        raise Refusal(field, name, "needs the package unitcad, which has the printers")
    options = Options(
        select=check_prefixes(*configuration.chosen("select", _split(given.select))),
        ignore=check_prefixes(*configuration.chosen("ignore", _split(given.ignore))),
        unit=unit_named(*configuration.chosen("unit", given.unit)),
        printer=tools.printer(field, name) if name and tools.printer else None,
        shells=given.shells,
        strict=bool(settings.strict if given.strict is None else given.strict),
        strict_3mf=bool(settings.strict_3mf if given.strict_3mf is None else given.strict_3mf),
        limits=_limits(given.max_faces or settings.max_faces, *configuration.chosen("timeout", given.timeout)),
        draw=given.pictures is not None and given.diff is None,
        every_place=any((given.baseline, given.write_baseline, configuration.baseline)),
    )
    for pattern, codes in settings.per_file_ignores.items():
        check_prefixes(configuration.name(f"per-file-ignores.{pattern}"), codes)
    return options


def _expect_one_task(given: Arguments) -> None:
    others = (given.files, given.manifest, given.baseline, given.write_baseline)
    if given.diff is not None and any(others):
        raise UnitcadError("--diff compares its two names: leave out other files, --manifest and the baselines")
    if not given.files and given.manifest is None and given.diff is None:
        raise UnitcadError(
            "FILE...: is required: mesh files, folders or globs, or --manifest; see unitcad check --help"
        )


def _known(given: Arguments, configuration: Configuration) -> tuple[Path | None, baselines.Baseline]:
    """Return the baseline that the findings are compared with: its path and its findings."""
    base = configuration.baseline if given.baseline is None else Path(given.baseline)
    if base is None or given.diff is not None or given.write_baseline is not None:
        return None, {}
    if not base.exists():
        field = "--baseline" if given.baseline is not None else configuration.name("baseline")
        raise Refusal(field, base.as_posix(), f"{no_such_file(base)}; --write-baseline {base.as_posix()} writes it")
    return base, baselines.read(base)


def _checked(
    given: Arguments,
    left_out: Callable[[str], bool],
    of_path: Callable[[str], Options],
    check_all: compare.Check,
    options: Options,
    tools: Tools,
) -> tuple[list[FileReport], bool]:
    """Return the reports, and whether some names are no files. Raises Refusal if all of them are none."""
    paths, unread = file_checks.expand(given.files or [], left_out)
    faults = [
        Refusal("FILE", report.path, report.findings[0].message) for report in unread if report.verdict == "error"
    ]
    faults += [Refusal("FILE", name, no_such_file(name)) for name in paths if not os.path.lexists(name)]
    if faults and given.manifest is None and len(faults) == len({*paths, *(report.path for report in unread)}):
        faults[0].others = tuple(faults[1:])
        raise faults[0]
    if given.manifest is None:
        return unread + list(check_all([(path, of_path(path)) for path in paths])), bool(faults)
    listed = listing.read(given.manifest)
    work = listing.work(listed, paths, of_path, None if options.printer is not None else tools.printers())
    compared = [listing.compare(listed, report, of_path(report.path)) for report in check_all(work)]
    return unread + compared + listing.check_unread(listed, [path for path, _ in work], of_path), bool(faults)


def _copy(given: str) -> tuple[str, Path]:
    """Return format and path of `--report FORMAT=FILE`."""
    name, equals, path = given.partition("=")
    if not equals or not path:
        raise Refusal("--report", given, "must be FORMAT=FILE", "sarif=report.sarif")
    if name not in FORMATS:
        raise unknown_name("--report", name, FORMATS)
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


def _limits(max_faces: int | None, field: str, seconds: float | None) -> Limits:

    default = Limits()
    if seconds is not None and not seconds < 1e7:
        raise Refusal(field, seconds, "must be a number of seconds below 1e7", default.seconds)
    return replace(default, max_faces=max_faces or default.max_faces, seconds=seconds or default.seconds)


def _split(values: list[str] | None) -> list[str] | None:
    return values and [part for value in values for part in value.split(",") if part.strip()]
