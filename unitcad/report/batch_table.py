"""Reading a batch's table: batch.json, otherwise variants.parquet, with the same content."""

from __future__ import annotations

import csv
import io
import json
import os
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.errors import UnitcadError, missing_extra
from unitcad.report.records import BatchFile, expect

JSON, PARQUET, CSV = TABLES = ("batch.json", "variants.parquet", "variants.csv")
HEAD = b"unitcad"
"""Key of a Parquet file's metadata with the content of batch.json except its rows, as JSON."""


def read_batch(folder: Path) -> dict[str, Any] | None:
    """Read the table of a batch's folder; None without one. Raises UnitcadError if it can't be read."""
    try:
        batch, path = files.read_json(folder / JSON, largest=files.LARGEST_TABLE, links=False), folder / JSON
    except files.NotThere:
        try:
            batch, path = read_parquet(folder / PARQUET), folder / PARQUET
        except files.NotThere:
            return None
    expect(batch, BatchFile, path)
    return batch


def name_in(folder: Path) -> str:
    """Return the name of the table that `read_batch` reads in a folder."""
    return JSON if os.path.lexists(folder / JSON) else PARQUET


def read_parquet(path: Path) -> dict[str, Any]:
    """Return the head of a Parquet table with its rows, as batch.json has them.

    Raises NotThere, Missing without the extra, UnitcadError for another file.
    """
    content = files.read(path, largest=files.LARGEST_TABLE, links=False)
    try:
        import pyarrow as pa
        from pyarrow import parquet
    except ImportError:
        raise missing_extra("parquet", f"{path}: needs pyarrow") from None
    try:
        table = parquet.read_table(pa.BufferReader(content))
        return {**json.loads((table.schema.metadata or {})[HEAD]), "variants": table.to_pylist()}
    except (pa.ArrowException, OSError, KeyError, ValueError, TypeError) as error:
        raise UnitcadError(f"{path}: is not the table of a batch, or damaged ({type(error).__name__})") from None


def rows_of_csv(folder: Path) -> int | None:
    """Count the variants in the CSV table of a folder, None without one. Raises UnitcadError."""
    try:
        text = files.read_text(folder / CSV, largest=files.LARGEST_TABLE, links=False)
    except files.NotThere:
        return None
    return sum(1 for row in csv.reader(io.StringIO(text)) if row) - 1
