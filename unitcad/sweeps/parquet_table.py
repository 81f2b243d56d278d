"""A batch's rows as Parquet: a column each with one type, strings by dictionary, the batch's head in the metadata."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator
from importlib.util import find_spec
from itertools import islice
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.errors import missing_extra
from unitcad.report.batch_table import HEAD
from unitcad.sweeps.batch_records import Values

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
            data = {column: [_cell(row.get(column), chosen[column]) for row in group] for column in columns}
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


def _cell(value: Any, kind: str) -> Any:
    if value is None or kind in ("bool", "int", "text"):
        return value
    return float(value) if kind == "float" else json.dumps(value, ensure_ascii=False)
