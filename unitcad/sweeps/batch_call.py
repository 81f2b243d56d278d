"""`batch` as a function, and its result."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from unitcad import text
from unitcad.arguments import check_number, path, texts
from unitcad.errors import UnitcadError
from unitcad.pipeline.plan import check_outputs
from unitcad.report import write_report
from unitcad.report.read_results import read_batch
from unitcad.spec.raw import OUTPUTS, Format
from unitcad.sweeps.estimate_table import write_estimates
from unitcad.sweeps.executors import open_executor
from unitcad.sweeps.insensitive_keys import swept_estimate
from unitcad.sweeps.insensitive_keys import warnings as insensitive_warnings
from unitcad.sweeps.journal import Summary
from unitcad.sweeps.object_store import confirm_address, is_address
from unitcad.sweeps.run import BatchOptions, Watch, indices_of, run, trim
from unitcad.sweeps.shard import shard_of
from unitcad.sweeps.sweep import Sweep, load_sweep
from unitcad.validation import Changes
from unitcad.validation.plain_data import changes_of

LOOKED_AT = 20_000
"""Variants whose geometry is worked out; of a larger sweep the rest is estimated in proportion."""
MOST_REFUSED = 20


def preview(sweep: Sweep, options: BatchOptions) -> dict[str, Any]:
    """Count variants and distinct geometries, as data; `exact`: whether every variant was looked at.

    Every counted variant is validated; `refused` has the first refusals. Raises UnitcadError if all are.
    """
    only = check_outputs(options.only)
    indices = indices_of(sweep, options)
    count = len(indices)
    looked = min(count, LOOKED_AT)
    geometries: set[str] = set()
    refused: list[dict[str, Any]] = []
    for index in indices[:looked]:
        try:
            variant = sweep.subject(index)
        except UnitcadError as error:
            refused.append({"index": index, "reason": sweep.faults(index, error)})
            continue
        geometries.add(variant.key(only, options.check))
    if refused and not geometries:
        raise UnitcadError(f"every variant is refused, the first: {refused[0]['reason']}")
    share = count / max(looked, 1)
    return {
        "variants": count,
        "geometries": round(len(geometries) * share),
        "exact": looked == count,
        "refused_count": round(len(refused) * share),
        "refused": refused[:MOST_REFUSED],
        "warnings": insensitive_warnings(swept_estimate(sweep, count)) if "estimate" in only else [],
    }


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

        Raises UnitcadError if the folder or its batch.json has gone.
        """
        table = read_batch(self.folder)
        if table is None:
            raise UnitcadError(f"{self.folder}: has no batch.json")
        return table["variants"]

    def __repr__(self) -> str:
        s = self.summary
        stopped = f", stopped: {text.shorten(s.stopped, 60)}" if s.stopped else ""
        return f"BatchResult({s.ok} of {s.variants} made, {s.failed} failed{stopped}; {self.folder.name})"

    def _repr_html_(self) -> str:
        rows, shown = self.rows, self.rows[:_MOST_ROWS]
        head = list(dict.fromkeys(key for row in shown for key in row))
        left = f" (the first {_MOST_ROWS} of {len(rows)})" if len(rows) > _MOST_ROWS else ""
        return text.table(head, [[row.get(key) for key in head] for row in shown], f"{self.folder.name}{left}")


_MOST_ROWS = 20
"""Variants that a notebook's cell lists."""


def place(sweep: Sweep, out: str | None) -> tuple[Path, str | None]:
    """Return the folder of a batch's journal and tables, and the address of the store of its variants, if it has one.

    `out` receives the folder, as that of a build does. Raises UnitcadError for an address of no such store.
    """
    if out is not None and is_address(out):
        confirm_address(out)
        return Path("out") / sweep.slug, f"{out}{'' if str(out).endswith('/') else '/'}{sweep.slug}"
    return Path("out" if out is None else out) / sweep.slug, None


def make(
    sweep: Sweep,
    folder: Path,
    options: BatchOptions,
    jobs: int | None,
    scheduler: str | None = None,
    watch: Watch = lambda summary, outcome: None,
) -> Summary:
    """Make a sweep's variants in `folder`: only estimates as one table in this process, otherwise by workers.

    Raises Refusal or UnitcadError if nothing can be run.
    """
    if options.only == ("estimate",) and not sweep.of_compounds:
        return write_estimates(sweep, folder, options, watch)
    with open_executor(jobs, scheduler, options.timeout) as (executor, number):
        summary = run(sweep, folder, options, executor, workers=number, remote=scheduler is not None, watch=watch)
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
    shard: str | None = None,
    cache: str | os.PathLike[str] | None = None,
    report: bool = False,
) -> BatchResult:
    """Make every variant of a sweep, each distinct part once. The same call again resumes an interrupted one.

    Parameters
    ----------
    sweep : str, path or Sweep
        A file, or the name of a shipped sweep.
    out : path or str, optional
        Parent of the batch's folder, which has the sweep's name; or ``"s3://bucket/prefix"`` for the variants of workers
        that share no disk: the tables are then in the default folder too. Default: out.
    set, formats, only, check
        As for `unitcad.build`; they apply to every variant.
    jobs : int, optional
        Worker processes; 0: this process. Default: one a core.
    limit : int, optional
        Make only the first variants.
    timeout : float, optional
        Time limit for a variant, s.
    keep_going : bool, default False
        Continue after a variant that fails.
    shard : str, optional
        Part of the sweep to make, such as "3/16". All parts take the same folder; the last one completes the tables.
    cache : path, optional
        Folder of the cache. Default: the user's.
    report : bool, default False
        Write report.html.

    Returns
    -------
    BatchResult
        Folder, and the outcome of each variant.

    Raises
    ------
    Refusal, UnitcadError
        If nothing can be run.

    Examples
    --------
    >>> from unitcad.sweeps import batch
    >>> batch("published", only="estimate", limit=2, jobs=0).ok
    True
    """
    check_number("jobs", jobs, 0, 1024, whole=True)
    check_number("timeout", timeout, 0.001, 1e9)
    check_number("limit", limit, 1, 1e9, whole=True)
    chosen = sweep if isinstance(sweep, Sweep) else load_sweep(path("sweep", sweep))
    own = {} if formats is None else {"output.formats": texts("formats", formats)}
    wanted = chosen.overridden({**changes_of(set), **own})
    folder, store = place(wanted, None if out is None else path("out", out))
    where = None if cache is None else Path(path("cache", cache))
    part = None if shard is None else shard_of(shard)
    options = BatchOptions(
        tuple(texts("only", only)), check, keep_going, timeout, limit, where, shard=part, store=store
    )
    summary = make(wanted, folder, options, jobs)
    if report:
        write_report(folder)
    return BatchResult(folder, summary)
