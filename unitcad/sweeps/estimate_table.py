"""The estimate-only sweep: no folders, one table of each variant's edge level by model."""

from __future__ import annotations

import time
from pathlib import Path

from msgspec import structs

from unitcad.attenuation.edge.level import edge_level
from unitcad.errors import UnitcadError
from unitcad.estimate_inputs import closed_forms, estimate_input, fit_of
from unitcad.spec import Spec
from unitcad.sweeps import task as tasks
from unitcad.sweeps.journal import Journal, JournalEntry, Summary
from unitcad.sweeps.run import BatchOptions, Watch, batch_head, count_entry, finish, indices_of
from unitcad.sweeps.sweep import Sweep


def write_estimates(
    sweep: Sweep, out: Path, options: BatchOptions, watch: Watch = lambda summary, outcome: None
) -> Summary:
    """Write `variants.csv`, `batch.json` and `timings.json` of every variant's edge level by model into `out`.

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
    """Return a spec's edge level by each of its models, without ranges; None if there is no number.

    Raises Refusal as `estimate_spec`.
    """
    asked, fit = estimate_input(spec), fit_of(spec)
    found = {model: edge_level(asked, model, fit)["value"] for model in closed_forms(spec.estimate.models)}
    return {f"edge_{model}": level and float(f"{level:.6g}") for model, level in found.items()}
