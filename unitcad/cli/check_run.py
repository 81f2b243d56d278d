"""What `unitcad check` does: mesh files against the rules of unitcad.check. Nothing here parses a command line."""

from __future__ import annotations

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
class Asked:
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


def run(asked: Asked) -> int:
    """Check the files and print or save the report; return the exit code. Raises UnitcadError or Refusal."""

    if asked.list_rules:
        sys.stdout.write("".join(f"{rule.code} {rule.severity}: {rule.title}\n" for rule in rules().values()))
        return 0
    if asked.explain is not None:
        sys.stdout.write(explanation(",".join(asked.explain)) + "\n")
        return 0
    output_format = "json" if asked.as_json else asked.output_format
    if output_format not in FORMATS:
        raise unknown_name("--output-format", output_format, FORMATS)
    if asked.as_json and asked.output_format not in (Asked.output_format, "json"):
        why = "--json asks for another one: leave one of them out, or have both with --report json=FILE"
        raise Refusal("--output-format", asked.output_format, why)
    if asked.show is not None and Path(asked.show).exists() and not Path(asked.show).is_dir():
        raise Refusal("--pictures", asked.show, "must name a folder; this is a file")
    copies = [_copy(given, FORMATS) for given in asked.report or []]
    configuration = check_settings.find(asked.config, wanted=not asked.no_config)
    fail_on = asked.fail_on or configuration.value("fail_on") or "error"
    if fail_on not in ("error", "warning"):
        raise unknown_name("--fail-on", fail_on, ("error", "warning"))
    base = Path(asked.baseline) if asked.baseline is not None else configuration.baseline
    if asked.write_baseline and base is None:
        raise UnitcadError("--write-baseline needs a file: --baseline FILE, or the key baseline of the settings")
    if base is not None:
        known = baselines.read(base) if base.exists() or not asked.write_baseline else baselines.EMPTY
    selected = check_prefixes(*configuration.chosen("select", _split(asked.select)))
    extra = check_prefixes("--extend-select", _split(asked.extend_select) or [])
    options = Options(
        select=selected + extra if selected else (),
        ignore=check_prefixes(*configuration.chosen("ignore", _split(asked.ignore))),
        unit=unit_named(*configuration.chosen("unit", asked.unit)),
        printer=_printer(*configuration.chosen("printer", asked.printer)),
        shells=asked.shells,
        strict=bool(configuration.value("strict") if asked.strict is None else asked.strict),
        strict_3mf=bool(configuration.value("strict_3mf") if asked.strict_3mf is None else asked.strict_3mf),
        limits=_limits(
            asked.max_faces or configuration.value("max_faces"), *configuration.chosen("timeout", asked.timeout)
        ),
        locations=MOST if asked.all_locations or base is not None or asked.show is not None else SHOWN,
        draw=asked.show is not None,
    )
    for name in asked.files or ():
        if name.endswith(".toml") and Path(name).is_file():
            expect_none_but("", read_toml(Path(name)), name, "FILE")
    if asked.diff is not None:
        if asked.files or asked.manifest is not None or base is not None:
            raise UnitcadError("--diff compares its two names alone: leave out other files, --manifest and --baseline")
        from unitcad.cli import check_diff  # with trimesh and SciPy, which no other check needs

        said, code = check_diff.run(*asked.diff, options, fail_on, output_format, asked.show)
        _write(said, plain=output_format == "text")
        return code
    if not asked.files and asked.manifest is None:
        raise UnitcadError("check needs files, folders or globs, or --manifest")
    for pattern, codes in (configuration.value("per_file_ignores") or {}).items():
        check_prefixes(configuration.name(f"per-file-ignores.{pattern}"), codes)
    draw = None
    if asked.show is not None:
        draw = partial(finding_pictures.write, Path(asked.show))
    memory = asked.memory or configuration.value("memory") or 8000
    check_all = partial(file_checks.check_files, jobs=asked.jobs, memory_mb=memory, then=draw)
    left_out = configuration.left_out(asked.exclude or [])
    files, unread = file_checks.expand(asked.files or [], left_out)
    of_path = partial(_options_of, configuration, options)
    if asked.manifest is None:
        reports = unread + list(check_all([(path, of_path(path)) for path in files]))
    else:
        listed = listing.read(asked.manifest)
        work = listing.work(listed, files, of_path, None if options.printer is not None else printers())
        compared = [listing.compare(listed, report, of_path(report.path)) for report in check_all(work)]
        reports = unread + compared + listing.unchecked(listed, [path for path, _ in work], of_path)
    shown = MOST if asked.all_locations else SHOWN
    if base is not None:
        known = baselines.write(base, known, reports) if asked.write_baseline else known
        reports = [baselines.apply(known, base, report) for report in reports]
    reports = [report.shortened(shown) for report in reports]
    table = output.statistics(reports) if asked.statistics else ""
    used = None if base is None else base.as_posix()
    for format_, path in copies:
        _save(path, render(reports, format_, fail_on, configuration.shown, used))
    if asked.statistics and output_format == "text":
        sys.stdout.write(table)
    else:
        written = render(reports, output_format, fail_on, configuration.shown, used)
        _write(written, plain=output_format == "text")
        sys.stderr.write(table)
    return file_checks.worst(reports, fail_on)


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
