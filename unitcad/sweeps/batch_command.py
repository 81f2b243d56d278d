"""unitcad batch."""

from __future__ import annotations

import contextlib
import shlex
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from msgspec import to_builtins
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from unitcad.cli.output import print_json, print_json_line, progress, stage_lines, warn
from unitcad.cli.shared_options import (
    AllowCode,
    AsJson,
    Formats,
    NoCheck,
    Only,
    Sets,
    allow_code,
    expect_commas,
    finite,
    outputs,
    overrides,
)
from unitcad.cli.tables import console
from unitcad.errors import Refusal
from unitcad.meshcheck.findings import counted
from unitcad.pipeline.manifest import PAGE
from unitcad.report import write_report
from unitcad.sweeps import load_sweep
from unitcad.sweeps.batch_call import make, place, preview
from unitcad.sweeps.journal import JournalEntry, Summary
from unitcad.sweeps.level_table import check_table, write_table
from unitcad.sweeps.object_store import is_address
from unitcad.sweeps.run import BatchOptions, Watch
from unitcad.sweeps.shard import shard_of


@contextlib.contextmanager
def watching(json_lines: bool) -> Iterator[Watch]:
    """Yield the function that a batch calls after each variant."""
    say = stage_lines()
    if json_lines:
        yield _line
    elif say:
        yield lambda summary, outcome: say(f"{summary.done} of {summary.variants} variants")
    elif not sys.stderr.isatty():
        yield lambda summary, outcome: None
    else:
        columns = (
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[rate]:.1f}/s  reused {task.fields[reused]}  failed {task.fields[failed]}"),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=console(stderr=True)) as bar:
            shown = bar.add_task("", total=None, rate=0.0, reused=0, failed=0)

            def watch(summary: Summary, outcome: JournalEntry | None) -> None:
                speed, total, failed = bar.tasks[0].speed or 0.0, summary.variants, summary.failed
                bar.update(shown, total=total, completed=summary.done, rate=speed, reused=summary.reused, failed=failed)

            yield watch


def _line(summary: Summary, outcome: JournalEntry | None) -> None:
    if outcome is None:
        event = {"event": "end", **{k: v for k, v in to_builtins(summary).items() if k != "failures"}}
    else:
        own = {key: getattr(outcome, key) for key in ("index", "status", "folder", "reason")}
        counts = {"seconds": round(outcome.seconds, 4), "done": summary.done, "variants": summary.variants}
        event = {"event": "variant", **own, **counts}
    print_json_line(event)


PAGE_UP_TO = 100
"""Variants to which a batch has a page unless asked otherwise: a page of 100 takes about 10 s."""


def batch(
    named: Annotated[
        list[str],
        typer.Argument(metavar="SWEEP", help="Sweep file, or name of a shipped one (unitcad list sweeps)."),
    ],
    out: Annotated[
        str | None,
        typer.Option(
            "-o",
            "--out",
            metavar="DIR",
            help="Parent of the batch's folder, or s3://BUCKET/PREFIX for workers that share no disk. Default: out.",
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(
            "-j", "--jobs", metavar="N", min=0, max=1024, help="Worker processes; 0: this process. Default: one a core."
        ),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(metavar="ADDRESS", help="Dask scheduler, such as tls://host:8786. Default: none.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the number of variants and geometries; make nothing.")
    ] = False,
    verify: Annotated[
        bool,
        typer.Option("--verify", help="Compare hashes of finished variants, not only sizes."),
    ] = False,
    keep_going: Annotated[bool, typer.Option("--keep-going", help="Continue after a variant that fails.")] = False,
    timeout: Annotated[
        float | None,
        typer.Option(
            metavar="SECONDS", min=0.001, max=1e7, callback=finite, help="Time limit for a variant. Default: none."
        ),
    ] = None,
    shard: Annotated[
        str | None,
        typer.Option(
            metavar="I/N",
            help="Make part I of N, for job arrays; every part takes the same folder. Default: all variants.",
        ),
    ] = None,
    limit: Annotated[
        int | None, typer.Option(metavar="N", help="Make only the first N variants. Default: all.")
    ] = None,
    cache: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Cache of distinct parts. Default: the user's cache.")
    ] = None,
    cache_limit: Annotated[
        float, typer.Option(metavar="MB", min=0, max=1e12, callback=finite, help="Maximum cache size after the batch.")
    ] = 4096,
    sets: Sets = None,
    formats: Formats = None,
    only: Only = None,
    page: Annotated[
        bool | None,
        typer.Option(
            "--report/--no-report",
            help=f"Write report.html, one offline page. Default: on without --only, for at most {PAGE_UP_TO} variants.",
        ),
    ] = None,
    table: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Table of all variants, the least level first, as FILE.csv or FILE.parquet. Default: none.",
        ),
    ] = None,
    no_check: NoCheck = False,
    code: AllowCode = False,
    as_json: AsJson = False,
    json_lines: Annotated[
        bool, typer.Option("--json-lines", help="Print one JSON object a line as variants end.")
    ] = False,
) -> None:
    """Make every variant of a sweep, each distinct part once. The last line printed is the folder."""

    sweep, *others = named
    expect_commas("SWEEP", others)
    if others:
        raise Refusal("SWEEP", others[0], "a batch takes one sweep; run a second batch for this one")
    if table is not None:
        check_table(table)
    chosen = outputs(only)
    wanted = load_sweep(sweep).overridden(overrides(sets, formats))
    allow_code(code, nothing_else=dry_run)
    part = None if shard is None else shard_of(shard)
    if page is None:
        page = (
            only is None and scheduler is None and part is None and not is_address(out) and wanted.count <= PAGE_UP_TO
        )
    folder, store = place(wanted, out)
    if store and chosen == ("estimate",):
        raise Refusal("-o", store, "estimates only are one table: name a folder")
    options = BatchOptions(chosen, not no_check, keep_going, timeout, limit, cache, cache_limit, verify, part, store)
    if dry_run:
        size = preview(wanted, options)
        print_json(size) if as_json or json_lines else _print_preview(size)
        return
    if chosen == ("estimate",) and scheduler is not None:
        raise Refusal("--scheduler", scheduler, "estimates only are computed in this process: leave it out")
    try:
        with watching(json_lines) as watch:
            summary = make(wanted, folder, options, jobs, scheduler, watch)
    except KeyboardInterrupt:
        typer.echo(f"interrupted: finished variants stay in {store or folder}; the same command resumes", err=True)
        sys.exit(130)
    if table is not None:
        write_table(table, wanted, folder)
    if page or (part is None and (folder / PAGE).is_file()):  # one that is there is kept up
        with progress(folder.name) as say:
            say("page")
            write_report(folder, warn)
    if as_json:
        print_json({"folder": str(folder), **({"store": store} if store else {}), **to_builtins(summary)})
    elif not json_lines:
        _print_summary(summary, folder, store)
    if summary.failed or summary.stopped:
        sys.exit(1)


def _print_summary(summary: Summary, folder: Path, store: str | None) -> None:

    for warning in summary.warnings:
        warn(f"warning: {warning}")
    for failure in summary.failures:
        warn(f"variant {failure.index}: {failure.status}: {failure.reason}")
    if summary.failed > len(summary.failures):
        typer.echo(f"and {summary.failed - len(summary.failures)} more: see variants.csv", err=True)
    if summary.stopped:
        warn(f"stopped: {summary.stopped}; the same command resumes")
    before = f" ({summary.resumed} from before)" if summary.resumed else ""
    left = summary.variants - summary.done
    made = f"{counted(summary.geometries, 'geometry', 'geometries')}, {counted(summary.reused, 'variant')} without a new part"
    parts = [
        f"{summary.ok} of {counted(summary.variants, 'variant')} made{before}",
        f"{summary.failed} failed",
        *([f"{left} not tried"] if left else []),
        *([made] if summary.geometries or summary.reused else []),
        f"{summary.seconds:.1f} s",
    ]
    typer.echo("; ".join(parts))
    there = (folder / PAGE).is_file()
    typer.echo(f"open {folder / PAGE}" if there else f"unitcad report {shlex.quote(str(folder))} writes its page")
    typer.echo(store or str(folder))


def _print_preview(size: Mapping[str, Any]) -> None:
    about = "" if size["exact"] else "about "
    geometries = counted(size["geometries"], "geometry", "geometries")
    typer.echo(f"{counted(size['variants'], 'variant')} of {about}{geometries}")
    for warning in size["warnings"]:
        warn(f"warning: {warning}")
    for refused in size["refused"]:
        warn(f"variant {refused['index']} is refused: {refused['reason']}")
    if (more := size["refused_count"] - len(size["refused"])) > 0:
        typer.echo(f"and {about}{more} more", err=True)
