"""The progress of a batch: a bar on a terminal, lines for machines, nothing in a pipe."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator

from msgspec import to_builtins

from unitcad.cli.output import console, print_json_line, stage_lines
from unitcad.sweeps.batch_records import Summary
from unitcad.sweeps.run import Watch
from unitcad.sweeps.task import VariantOutcome


@contextlib.contextmanager
def watching(json_lines: bool) -> Iterator[Watch]:
    """Yield the function that a batch calls after each variant."""
    say = stage_lines()
    if json_lines:
        yield _line
    elif say:
        yield lambda summary, outcome: say(f"{summary.done} of {summary.variants} variants")
    elif sys.stderr.isatty():
        with _bar() as watch:
            yield watch
    else:
        yield lambda summary, outcome: None


def _line(summary: Summary, outcome: VariantOutcome | None) -> None:
    if outcome is None:
        event = {"event": "end", **{k: v for k, v in to_builtins(summary).items() if k != "failures"}}
    else:
        event = {
            "event": "variant",
            "index": outcome.index,
            "status": outcome.status,
            "folder": outcome.folder,
            "reason": outcome.reason,
            "seconds": round(outcome.seconds, 4),
            "done": summary.done,
            "variants": summary.variants,
        }
    print_json_line(event)


@contextlib.contextmanager
def _bar() -> Iterator[Watch]:
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[rate]:.1f}/s  reused {task.fields[reused]}  failed {task.fields[failed]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console(stderr=True)) as progress:
        shown = progress.add_task("", total=None, rate=0.0, reused=0, failed=0)

        def watch(summary: Summary, outcome: VariantOutcome | None) -> None:
            speed = progress.tasks[0].speed or 0.0
            progress.update(
                shown,
                total=summary.variants,
                completed=summary.done,
                rate=speed,
                reused=summary.reused,
                failed=summary.failed,
            )

        yield watch
