"""The batch's tables: variants.csv, batch.json, variants.parquet, the same bytes however many workers made them."""

from __future__ import annotations

import contextlib
import csv
import io
import json
from collections.abc import Callable, Collection, Iterable, Iterator
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import IO, Any

from msgspec import to_builtins

from unitcad import files
from unitcad.errors import missing_extra
from unitcad.report.read_results import CSV, HEAD, JSON, PARQUET
from unitcad.sweeps.insensitive_keys import SweptEstimate
from unitcad.sweeps.journal import BatchHead, Journal, JournalEntry, Summary, Values
from unitcad.sweeps.sweep import Sweep
from unitcad.text import cell

GROUP = 1 << 15
"""Rows of a row group: as many are in memory while a table is written."""
_INTEGERS = range(-(1 << 63), 1 << 63)


def can_write() -> bool:
    """Tell whether the extra is installed."""
    return find_spec("pyarrow") is not None


def write_parquet(path: Path, head: Values, columns: list[str], rows: Callable[[], Iterable[Values]]) -> None:
    """Write rows, read twice: a column's type is that of all its values, text (JSON) if they have several.

    Raises Missing without the extra, OSError.
    """
    if not can_write():
        raise missing_extra("parquet", "a Parquet table needs pyarrow")
    import pyarrow as pa
    from pyarrow import parquet

    kinds: dict[str, set[str]] = {column: set() for column in columns}
    for row in rows():
        for column, value in row.items():
            if value is not None:
                kinds[column].add(_kind(value))
    types = {"bool": pa.bool_(), "int": pa.int64(), "float": pa.float64()}
    chosen = {column: _of(kinds[column]) for column in columns}
    text = json.dumps(head, ensure_ascii=False, allow_nan=False).encode()
    schema = pa.schema([(column, types.get(chosen[column], pa.string())) for column in columns], metadata={HEAD: text})
    with files.writing(path) as file, parquet.ParquetWriter(file, schema, compression="zstd") as writer:
        for group in _groups(iter(rows())):
            data = {column: [_parquet_cell(row.get(column), chosen[column]) for row in group] for column in columns}
            writer.write_table(pa.Table.from_pydict(data, schema))


def _groups(rows: Iterator[Values]) -> Iterator[list[Values]]:
    while group := list(islice(rows, GROUP)):
        yield group


def _kind(value: Any) -> str:
    if isinstance(value, bool):
        return "bool"
    if isinstance(value, int):
        return "int" if value in _INTEGERS else "other"
    return "float" if isinstance(value, float) else "text" if isinstance(value, str) else "other"


def _of(kinds: set[str]) -> str:
    """Return the one kind of a column's values; "other" if there is none."""
    if kinds == {"int", "float"}:
        return "float"
    return next(iter(kinds)) if len(kinds) == 1 else "text" if not kinds else "other"


def _parquet_cell(value: Any, kind: str) -> Any:
    if value is None or kind in ("bool", "int", "text"):
        return value
    return float(value) if kind == "float" else json.dumps(value, ensure_ascii=False)


TABLES = {"csv": CSV, "json": JSON, "parquet": PARQUET}
MOST_ROWS = 10_000
"""Rows from which on CSV and JSON are written only if asked for."""
FIRST = ("index", "status", "reason", "folder")


def write_results(
    out: Path,
    columns: list[str],
    entries: Callable[[], Iterable[JournalEntry]],
    head: BatchHead,
    estimate: SweptEstimate | None,
    asked: Collection[str] | None = None,
    variants: int = 0,
) -> None:
    """Write the tables `asked` for (names of TABLES), and those that are there from before.

    With None these are CSV and JSON below MOST_ROWS `variants`, otherwise Parquet if its extra is installed. `entries`
    gives the variants in the sweep's order, one at a time. Raises Missing for Parquet without the extra, OSError.
    """
    asked = tables_of(variants, asked)
    wanted = {name for name, file in TABLES.items() if name in asked or (out / file).is_file()}
    levels = {"estimate": to_builtins(estimate)} if estimate else {}
    whole = {**to_builtins(head), **levels, "columns": columns}
    if "parquet" in wanted:
        write_parquet(out / TABLES["parquet"], whole, columns, lambda: map(flat, entries()))
    if "csv" in wanted:
        _write_csv(out / TABLES["csv"], columns, entries())
    if "json" in wanted:
        _write_json(out / TABLES["json"], whole, entries())


def tables_of(variants: int, asked: Collection[str] | None) -> Collection[str]:
    """Return the names of a batch's tables: those `asked` for; with None by the number of variants."""
    if asked is not None:
        return asked
    return ("csv", "json") if variants < MOST_ROWS or not can_write() else ("parquet",)


def write_timings(out: Path, summary: Summary, workers: int) -> None:
    """Write the counts and times of this run, which differ between runs."""
    timings = {key: value for key, value in to_builtins(summary).items() if key not in ("failures", "warnings")}
    fresh = summary.done - summary.resumed
    timings["variants_per_second"] = round(fresh / summary.seconds, 2) if summary.seconds else None
    files.write(out / "timings.json", (json.dumps({"workers": workers, **timings}, indent=1) + "\n").encode())


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
