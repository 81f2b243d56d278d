"""`unitcad.batch` as a function, and what it returns."""

# pyright: strict
from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from unitcad import notebook
from unitcad.arguments import check_number, path, texts
from unitcad.batch.batch_records import Summary
from unitcad.batch.estimate_table import write_estimates
from unitcad.batch.executors import Workers
from unitcad.batch.run import BatchOptions, Watch, run, trim
from unitcad.batch.sweep import Sweep, load_sweep
from unitcad.pipeline.artifacts import OUTPUTS
from unitcad.spec.asked import Format
from unitcad.text import toml
from unitcad.validation import Changes
from unitcad.validation.tables import changes_of


@dataclass(frozen=True, repr=False)
class BatchResult:
    """A sweep's folder, and the result of each variant."""

    folder: Path
    summary: Summary

    @property
    def ok(self) -> bool:
        """Whether every variant was made and every check passed."""
        return not self.summary.failed and not self.summary.stopped

    @property
    def rows(self) -> list[dict[str, Any]]:
        """A row a variant, as in batch.json: what was swept, volumes in mm3, masses in g, edge levels.

        Raises OSError where the folder has gone.
        """
        return json.loads((self.folder / "batch.json").read_text("utf-8"))["variants"]

    def __repr__(self) -> str:
        s = self.summary
        stopped = f", stopped: {notebook.shortened(s.stopped, 60)}" if s.stopped else ""
        return f"BatchResult({s.ok} of {s.variants} made, {s.failed} failed{stopped}; {self.folder.name})"

    def _repr_html_(self) -> str:
        rows, shown = self.rows, self.rows[:_MOST_ROWS]
        head = list(dict.fromkeys(key for row in shown for key in row))
        left = f" (the first {_MOST_ROWS} of {len(rows)})" if len(rows) > _MOST_ROWS else ""
        return notebook.table(head, [[row.get(key) for key in head] for row in shown], f"{self.folder.name}{left}")


_MOST_ROWS = 20
"""Variants that a notebook's cell lists."""


def make(
    sweep: Sweep, folder: Path, options: BatchOptions, workers: Workers, watch: Watch = lambda summary, outcome: None
) -> Summary:
    """Make a sweep's variants in `folder`: estimates alone as one table in this process, all else by `workers`.

    Raises Refusal or UnitcadError where nothing can be run.
    """
    if options.only == ("estimate",) and not sweep.of_arrays:
        return write_estimates(sweep, folder, options)
    with workers.executor(options.timeout) as (executor, number):
        remote = workers.scheduler is not None
        summary = run(sweep, folder, options, executor, workers=number, remote=remote, watch=watch)
    trim(options)  # once the workers have let go of it
    return summary


def batch(
    sweep: str | os.PathLike[str] | Sweep,
    out: str | os.PathLike[str] | None = None,
    *,
    set: Changes = (),
    formats: Sequence[Format] | Format | None = None,
    only: Sequence[str] | str = OUTPUTS,
    check: bool = True,
    jobs: int | None = None,
    limit: int | None = None,
    timeout: float | None = None,
    keep_going: bool = False,
    cache: str | os.PathLike[str] | None = None,
    report: bool = False,
) -> BatchResult:
    """Make every variant of a sweep in the folder `out` (out/<name> by default), each distinct part once.

    `sweep` is a file, the name of a shipped sweep, or a `unitcad.batch.Sweep`. `set` changes values of every variant,
    `formats` and `only` choose what is made, as for `unitcad.build`. `jobs` is the number of worker processes, one a
    core by default, with 0 this process. `limit` makes the first variants only; `timeout` is in seconds a variant. The
    same call again goes on where an earlier one ended. What becomes of a variant is in the result. Raises Refusal or
    UnitcadError where nothing can be run.
    """
    check_number("jobs", jobs, 0, 1024, whole=True)
    check_number("timeout", timeout, 0.001, 1e9)
    check_number("limit", limit, 1, 1e9, whole=True)
    chosen = sweep if isinstance(sweep, Sweep) else load_sweep(path("sweep", sweep))
    overrides = [
        change if isinstance(change, str) else "=".join((change[0], toml(change[1]))) for change in changes_of(set)
    ]
    wanted = chosen.overridden(
        [*overrides, *([] if formats is None else [f"output.formats={texts('formats', formats)}"])]
    )
    folder = Path("out") / wanted.slug if out is None else Path(path("out", out))
    where = None if cache is None else Path(path("cache", cache))
    options = BatchOptions(tuple(texts("only", only)), check, keep_going, timeout, limit, where)
    summary = make(wanted, folder, options, Workers(jobs))
    if report:
        from unitcad.report import write_report

        write_report(folder)
    return BatchResult(folder, summary)
