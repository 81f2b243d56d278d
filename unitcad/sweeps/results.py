"""The batch's tables: variants.csv and batch.json, the same bytes however many workers made them."""

from __future__ import annotations

import contextlib
import csv
import io
import json
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import IO, Any

from msgspec import to_builtins

from unitcad import files
from unitcad.report.read_results import CSV, JSON, SweptLevels
from unitcad.sweeps.journal import BatchHead, Journal, JournalEntry, Summary, Values
from unitcad.sweeps.sweep import Sweep
from unitcad.text import cell

FIRST = ("index", "status", "reason", "folder")


def write_results(
    out: Path,
    columns: list[str],
    entries: Callable[[], Iterable[JournalEntry]],
    head: BatchHead,
    estimate: SweptLevels | None,
) -> None:
    """Write both tables. `entries` gives the variants in the sweep's order, one at a time. Raises OSError."""
    levels = {"estimate": to_builtins(estimate)} if estimate else {}
    _write_csv(out / CSV, columns, entries())
    _write_json(out / JSON, {**to_builtins(head), **levels, "columns": columns}, entries())


def write_timings(path: Path, summary: Summary, workers: int) -> None:
    """Write the counts and times of this run, which differ between runs."""
    timings = {key: value for key, value in to_builtins(summary).items() if key not in ("failures", "warnings")}
    fresh = summary.done - summary.resumed
    timings["variants_per_second"] = round(fresh / summary.seconds, 2) if summary.seconds else None
    files.write(path, (json.dumps({"workers": workers, **timings}, indent=1) + "\n").encode())


def columns_of(sweep: Sweep, journal: Journal) -> list[str]:
    """Return the columns: first those of every batch, then the swept paths, then the results."""
    columns: dict[str, None] = dict.fromkeys(FIRST)
    columns.update(dict.fromkeys(path for path in sweep.paths if path != "name"))
    for entry in journal.entries():
        columns.update(dict.fromkeys(entry.row))
    return list(columns)


def flat(entry: JournalEntry) -> Values:
    """Return one variant's values by column."""
    return {**{key: getattr(entry, key) for key in FIRST}, **entry.row, **entry.values}


def _write_csv(path: Path, columns: list[str], entries: Iterable[JournalEntry]) -> None:
    with _write(path) as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(columns)
        for entry in entries:
            values = flat(entry)
            table.writerow([_cell(values.get(column)) for column in columns])


def _write_json(path: Path, head: dict[str, Any], entries: Iterable[JournalEntry]) -> None:
    with _write(path) as file:
        text = json.dumps(head, indent=1, ensure_ascii=False, allow_nan=False)
        file.write(text.removesuffix("\n}") + ',\n "variants": [')
        for i, entry in enumerate(entries):
            file.write((",\n  " if i else "\n  ") + json.dumps(flat(entry), ensure_ascii=False, allow_nan=False))
        file.write("\n ]\n}\n")


@contextlib.contextmanager
def _write(path: Path) -> Iterator[IO[str]]:
    """Open a text file in UTF-8, line ends as written, that replaces `path` when the block ends without an error."""
    with files.writing(path) as file:
        text = io.TextIOWrapper(file, "utf-8", newline="")
        yield text
        text.flush()
        text.detach()


def _cell(value: Any) -> Any:
    if value is None:
        return ""
    if isinstance(value, bool | list | dict):
        return json.dumps(value, ensure_ascii=False)
    return cell(value) if isinstance(value, str) else value
