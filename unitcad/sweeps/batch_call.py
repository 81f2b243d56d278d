"""`batch` as a function, and its result."""

# pyright: strict
from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from unitcad import notebook
from unitcad.arguments import check_number, path, texts
from unitcad.errors import UnitcadError, WrongArgument, unknown_name
from unitcad.pipeline.plan import checked_outputs
from unitcad.report import write_report
from unitcad.report.batch_table import read_batch
from unitcad.spec.raw import OUTPUTS, Format
from unitcad.sweeps.batch_options import BatchOptions
from unitcad.sweeps.batch_records import Summary
from unitcad.sweeps.estimate_table import write_estimates
from unitcad.sweeps.executors import Workers
from unitcad.sweeps.results import TABLES
from unitcad.sweeps.run import Watch, batch_head, counted, run, trim
from unitcad.sweeps.shards import shard_of, store_of
from unitcad.sweeps.sweep import Sweep, load_sweep
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
        """A row a variant, as in batch.json: the swept values, volumes in mm3, masses in g, edge levels.

        Raises UnitcadError if the folder has gone, or has neither batch.json nor variants.parquet.
        """
        table = read_batch(self.folder)
        if table is None:
            raise UnitcadError(f"{self.folder}: has neither batch.json nor variants.parquet")
        return table["variants"]

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
    """Make a sweep's variants in `folder`: only estimates as one table in this process, otherwise by `workers`.

    Raises Refusal or UnitcadError if nothing can be run.
    """
    if options.folders is False and workers.scheduler is not None and options.store is None and not options.shard:
        why = "results of a cluster go to folders here, or with --store to a store: name one, or leave it out"
        raise WrongArgument("folders", False, why)
    if options.folders and options.only == ("estimate",) and not sweep.of_compounds:
        raise WrongArgument("folders", True, "estimates only are one table: leave it out")
    if options.shard:
        if options.only == ("estimate",):
            raise WrongArgument("shard", str(options.shard), "estimates only are one table: leave it out")
        whole = batch_head(sweep, checked_outputs(options.only), replace(options, shard=None))
        variants = counted(sweep, options.limit)
        store = store_of(folder, options.shard, whole.batch, variants, options.store)
        folder, options = folder / options.shard.folder, replace(options, store=store)
    if options.only == ("estimate",) and not sweep.of_compounds:
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
    store: str | os.PathLike[str] | None = None,
    folders: bool | None = None,
    tables: Sequence[str] | str | None = None,
    shard: str | None = None,
) -> BatchResult:
    """Make every variant of a sweep in the folder `out` (out/<name> by default), each distinct part once.

    `sweep` is a file, the name of a shipped sweep, or a `unitcad.sweeps.Sweep`. `set` changes values of every variant,
    `formats` and `only` choose the outputs, as for `unitcad.build`. `jobs` is the number of worker processes, one a
    core by default, with 0 this process. `limit` makes the first variants only; `timeout` is in seconds a variant.
    `store` is a folder or an address (s3://bucket/path) that workers put content into; `folders` says whether each
    variant has a folder, by default below 1,000 variants. `tables` are any of csv, json, parquet; by default the
    first two, from 10,000 variants on the last one. `shard`, such as "3/16", makes one part of the sweep. The same call
    again resumes an interrupted one. The result has the outcome of each variant. Raises Refusal or UnitcadError if
    nothing can be run.
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
    stored = None if store is None else os.fspath(store)
    chosen_outputs = tuple(texts("only", only))
    options = BatchOptions(
        chosen_outputs,
        check,
        keep_going,
        timeout,
        limit,
        where,
        store=stored,
        folders=folders_for(report, folders, chosen_outputs),
        tables=checked_tables(None if tables is None else texts("tables", tables), report),
        shard=None if shard is None else shard_of(shard),
    )
    summary = make(wanted, folder, options, Workers(jobs))
    if report:
        write_report(folder)
    return BatchResult(folder / options.shard.folder if options.shard else folder, summary)


def folders_for(report: bool, asked: bool | None, only: Sequence[str] = OUTPUTS) -> bool | None:
    """Return whether each variant has a folder: a page links to them, unless they are declined or have nothing in."""
    return True if report and asked is None and tuple(only) != ("estimate",) else asked


def checked_tables(names: Sequence[str] | None, report: bool = False) -> tuple[str, ...] | None:
    """Return names of tables; with `report` the page's is among them. Raises WrongArgument for an unknown one."""
    for name in names or ():
        if name not in TABLES:
            raise unknown_name("tables", name, TABLES, WrongArgument)
    return None if names is None and not report else (*(names or ("csv",)), *(("json",) if report else ()))
