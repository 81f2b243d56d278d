"""The work of `unitcad check`: compare mesh files with the rules. Nothing here parses a command line."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from unitcad import catalogue, files
from unitcad.catalogue import Printer, printers
from unitcad.cli import check_settings
from unitcad.cli.check_settings import Configuration
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.export import finding_pictures
from unitcad.files import no_such_file
from unitcad.meshcheck import Limits, Options, file_checks, output
from unitcad.meshcheck import baseline as baselines
from unitcad.meshcheck import manifest as listing
from unitcad.meshcheck.findings import MOST, SHOWN
from unitcad.meshcheck.output import FORMATS, render
from unitcad.meshcheck.rules.registry import check_prefixes, rules
from unitcad.meshcheck.rules.registry import explain as explanation
from unitcad.meshcheck.rules.s_scale import unit_named
from unitcad.rooms import expect_none_but
from unitcad.spec.toml import read_toml


@dataclass(frozen=True, kw_only=True)
class CheckArguments:
    """The options of a call, as `check_command.check` explains them."""

    files: list[str] | None = None
    output_format: str = "text"
    as_json: bool = False
    report: list[str] | None = None
    select: list[str] | None = None
    ignore: list[str] | None = None
    extend_select: list[str] | None = None
    fail_on: str | None = None
    printer: str | None = None
    unit: str | None = None
    shells: int | None = None
    strict_3mf: bool | None = None
    strict: bool | None = None
    exclude: list[str] | None = None
    manifest: str | None = None
    jobs: int = 1
    max_faces: int | None = None
    timeout: float | None = None
    memory: int | None = None
    all_locations: bool = False
    baseline: str | None = None
    write_baseline: bool = False
    show: str | None = None
    diff: tuple[str, str] | None = None
    config: str | None = None
    no_config: bool = False
    statistics: bool = False
    explain: list[str] | None = None
    list_rules: bool = False


def run(arguments: CheckArguments) -> int:
    """Check the files and print or save the report; return the exit code. Raises UnitcadError or Refusal."""

    if arguments.list_rules:
        sys.stdout.write("".join(f"{rule.code} {rule.severity}: {rule.title}\n" for rule in rules().values()))
        return 0
    if arguments.explain is not None:
        sys.stdout.write(explanation(",".join(arguments.explain)) + "\n")
        return 0
    output_format = "json" if arguments.as_json else arguments.output_format
    if output_format not in FORMATS:
        raise unknown_name("--output-format", output_format, FORMATS)
    if arguments.as_json and arguments.output_format not in (CheckArguments.output_format, "json"):
        why = "--json asks for another one: leave one of them out, or have both with --report json=FILE"
        raise Refusal("--output-format", arguments.output_format, why)
    if arguments.show is not None and Path(arguments.show).exists() and not Path(arguments.show).is_dir():
        raise Refusal("--pictures", arguments.show, "must name a folder; this is a file")
    copies = [_copy(given, FORMATS) for given in arguments.report or []]
    configuration = check_settings.find(arguments.config, wanted=not arguments.no_config)
    fail_on = arguments.fail_on or configuration.value("fail_on") or "error"
    if fail_on not in ("error", "warning"):
        raise unknown_name("--fail-on", fail_on, ("error", "warning"))
    base = Path(arguments.baseline) if arguments.baseline is not None else configuration.baseline
    if arguments.write_baseline and base is None:
        raise UnitcadError("--write-baseline needs a file: --baseline FILE, or the key baseline of the settings")
    if base is not None:
        known = baselines.read(base) if base.exists() or not arguments.write_baseline else baselines.EMPTY
    selected = check_prefixes(*configuration.chosen("select", _split(arguments.select)))
    extra = check_prefixes("--extend-select", _split(arguments.extend_select) or [])
    options = Options(
        select=selected + extra if selected else (),
        ignore=check_prefixes(*configuration.chosen("ignore", _split(arguments.ignore))),
        unit=unit_named(*configuration.chosen("unit", arguments.unit)),
        printer=_printer(*configuration.chosen("printer", arguments.printer)),
        shells=arguments.shells,
        strict=bool(configuration.value("strict") if arguments.strict is None else arguments.strict),
        strict_3mf=bool(configuration.value("strict_3mf") if arguments.strict_3mf is None else arguments.strict_3mf),
        limits=_limits(
            arguments.max_faces or configuration.value("max_faces"), *configuration.chosen("timeout", arguments.timeout)
        ),
        locations=MOST if arguments.all_locations or base is not None or arguments.show is not None else SHOWN,
        draw=arguments.show is not None,
    )
    for name in arguments.files or ():
        if name.endswith(".toml") and Path(name).is_file():
            expect_none_but("", read_toml(Path(name)), name, "FILE")
    if arguments.diff is not None:
        if arguments.files or arguments.manifest is not None or base is not None:
            raise UnitcadError("--diff compares its two names alone: leave out other files, --manifest and --baseline")
        from unitcad.cli import check_diff  # with trimesh and SciPy, which no other check needs

        said, code = check_diff.run(*arguments.diff, options, fail_on, output_format, arguments.show)
        _write(said, plain=output_format == "text")
        return code
    if not arguments.files and arguments.manifest is None:
        raise UnitcadError("check needs files, folders or globs, or --manifest")
    for pattern, codes in (configuration.value("per_file_ignores") or {}).items():
        check_prefixes(configuration.name(f"per-file-ignores.{pattern}"), codes)
    draw = None
    if arguments.show is not None:
        draw = partial(finding_pictures.write, Path(arguments.show))
    memory = arguments.memory or configuration.value("memory") or 8000
    check_all = partial(file_checks.check_files, jobs=arguments.jobs, memory_mb=memory, then=draw)
    left_out = configuration.left_out(arguments.exclude or [])
    files, unread = file_checks.expand(arguments.files or [], left_out)
    faults = [
        Refusal("FILE", report.path, report.findings[0].message) for report in unread if report.verdict == "error"
    ]
    faults += [Refusal("FILE", name, no_such_file(name)) for name in files if not os.path.lexists(name)]
    if faults and arguments.manifest is None and len(faults) == len({*files, *(report.path for report in unread)}):
        faults[0].others = tuple(faults[1:])
        raise faults[0]
    of_path = partial(_options_of, configuration, options)
    if arguments.manifest is None:
        reports = unread + list(check_all([(path, of_path(path)) for path in files]))
    else:
        listed = listing.read(arguments.manifest)
        work = listing.work(listed, files, of_path, None if options.printer is not None else printers())
        compared = [listing.compare(listed, report, of_path(report.path)) for report in check_all(work)]
        reports = unread + compared + listing.unchecked(listed, [path for path, _ in work], of_path)
    shown = MOST if arguments.all_locations else SHOWN
    if base is not None:
        known = baselines.write(base, known, reports) if arguments.write_baseline else known
        reports = [baselines.apply(known, base, report) for report in reports]
    reports = [report.shortened(shown) for report in reports]
    table = output.statistics(reports) if arguments.statistics else ""
    used = None if base is None else base.as_posix()
    for format_, path in copies:
        _save(path, render(reports, format_, fail_on, configuration.shown, used))
    if arguments.statistics and output_format == "text":
        sys.stdout.write(table)
    else:
        written = render(reports, output_format, fail_on, configuration.shown, used)
        _write(written, plain=output_format == "text")
        sys.stderr.write(table)
    return 2 if faults else file_checks.worst(reports, fail_on)


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


def _options_of(configuration: Configuration, options: Options, path: str) -> Options:
    """Return the options of a file: without the codes that the settings ignore for it."""
    return replace(options, unwanted=tuple(code.strip().upper() for code in configuration.ignored(path)))


def _printer(field: str, name: str | None) -> Printer | None:
    if not name:
        return None

    return catalogue.choose(field, name, catalogue.printers())


def _limits(max_faces: int | None, field: str, seconds: float | None) -> Limits:

    default = Limits()
    if seconds is not None and not seconds < 1e7:
        raise Refusal(field, seconds, "must be a number of seconds below 1e7", default.seconds)
    return replace(default, max_faces=max_faces or default.max_faces, seconds=seconds or default.seconds)


def _split(values: list[str] | None) -> list[str] | None:
    return values and [part for value in values for part in value.split(",") if part.strip()]
