"""The estimate-only sweep: no folders, one table of each variant's level at the edge."""

from __future__ import annotations

import time
from pathlib import Path

from msgspec import structs

from unitcad.errors import UnitcadError
from unitcad.estimate_inputs import answer_spec
from unitcad.json_text import rounded
from unitcad.pipeline.manifest import level_columns
from unitcad.spec import Spec
from unitcad.sweeps import task as tasks
from unitcad.sweeps.journal import Journal, JournalEntry, Summary
from unitcad.sweeps.run import BatchOptions, Watch, batch_head, count_entry, finish, indices_of
from unitcad.sweeps.sweep import Sweep


def write_estimates(
    sweep: Sweep, out: Path, options: BatchOptions, watch: Watch = lambda summary, outcome: None
) -> Summary:
    """Write `variants.csv`, `batch.json` and `timings.json` of every variant's level at the edge into `out`.

    Variants that an earlier run in `out` finished are not evaluated again. Raises UnitcadError for a folder that isn't
    ours.
    """
    head = batch_head(sweep, ("estimate",), options)
    indices = indices_of(sweep, options)
    summary, start = Summary(len(indices)), time.perf_counter()
    with Journal(out, head, options.shard) as journal:
        for index in indices:
            entry = journal.entry(index)
            summary.resumed += entry is not None
            if entry is None:
                entry = _entry(sweep, index)
                journal.add(entry)
            count_entry(summary, entry.status, lambda entry=entry: entry)
            watch(summary, JournalEntry(index, entry.status, entry.reason))
        finish(sweep, journal, head, options, summary, start, 1)
    watch(summary, None)
    return summary


def _entry(sweep: Sweep, index: int) -> JournalEntry:
    """Return the row of one variant, or the reason why it is refused."""
    _, values = sweep.values(index)
    try:
        spec = sweep.spec(index)
        row = {"name": spec.name, "design": spec.design, "diameter_mm": spec.diameter_mm, **levels(spec)}
    except UnitcadError as error:
        return structs.replace(tasks.failure(index, error), values=values)
    return JournalEntry(index, tasks.OK, values=values, row=row)


def levels(spec: Spec) -> dict[str, float | None]:
    """Return the columns of a spec's level at the edge, to nine digits. Raises Refusal as `answer_spec`."""
    one = answer_spec(spec)
    measured = one.measured[0].level if one.measured else None
    return rounded(level_columns({"level": one.level, "low": one.low, "high": one.high, "measured": measured}))
