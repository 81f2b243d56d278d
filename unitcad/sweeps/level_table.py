"""The table of a batch as one file, CSV or Parquet: a row a variant, the least level at the edge first."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from unitcad.errors import Missing, Refusal, UnitcadError
from unitcad.extras import pip_install
from unitcad.files import with_ending, write
from unitcad.pipeline.manifest import LEVEL_COLUMNS
from unitcad.report.read_results import cell, in_order, read_batch, swept_columns
from unitcad.spec import Spec
from unitcad.sweeps.estimate_table import levels
from unitcad.sweeps.sweep import Sweep
from unitcad.text import cell as csv_text

ENDINGS = (".csv", ".parquet")
_EDGE = tuple(f"edge_{key}" for key in LEVEL_COLUMNS)
_FOLDER = "folder"


def check_table(path: Path) -> None:
    """Raise Refusal for a file of another ending than .csv or .parquet, and Missing for Parquet without pyarrow."""
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise Refusal("--table", str(path), "takes a file that ends in .csv or .parquet", with_ending(path, ".csv"))
    if ending == ".parquet" and find_spec("pyarrow") is None:
        raise Missing(f"--table {path}: Parquet needs pyarrow: {' '.join(pip_install())} pyarrow")


def write_table(path: Path, sweep: Sweep, folder: Path) -> None:
    """Write the table of a batch's folder: name, level with its range and measurement, swept values, the rest.

    A batch without estimates gets the levels here. Texts, lists and tables are text. Raises UnitcadError, OSError.
    """
    batch = read_batch(folder)
    if batch is None:
        raise UnitcadError(f"{folder}: has no batch.json")
    rows: list[dict[str, Any]] = batch["variants"]
    columns = [name for name in batch["columns"] if name != _FOLDER]
    if not set(_EDGE) & set(columns) and not sweep.of_compounds:
        rows = [{**row, **_levels(sweep, row["index"])} for row in rows]
        columns += _EDGE
    columns = [*in_order(columns, swept_columns(columns)), _FOLDER]
    lead = _EDGE[0]
    rows = sorted(rows, key=lambda row: (row.get(lead) is None, row.get(lead) or 0.0, row["index"]))
    table = {name: [cell(row.get(name)) for row in rows] for name in columns}
    write(path, _parquet(table) if path.suffix.lower() == ".parquet" else _csv(table))


def _levels(sweep: Sweep, index: int) -> Mapping[str, float | None]:
    """Return the columns of a variant's level; none for one that is refused or has no level."""
    try:
        spec = sweep.spec(index)
        return levels(spec) if isinstance(spec, Spec) else {}
    except UnitcadError:
        return {}


def _csv(table: Mapping[str, Sequence[Any]]) -> bytes:
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(table)
    for row in zip(*table.values(), strict=True):
        writer.writerow(["" if one is None else csv_text(one) if isinstance(one, str) else one for one in row])
    return text.getvalue().encode()


def _parquet(table: Mapping[str, Sequence[Any]]) -> bytes:
    import pyarrow  # type: ignore[import-not-found]
    from pyarrow import parquet  # type: ignore[import-not-found]

    def column(values: Sequence[Any]) -> Any:
        """Return values of one kind: all numbers, or all texts."""
        known = [value for value in values if value is not None]
        if not known or any(isinstance(value, str) for value in known):
            return pyarrow.array([None if one is None else str(one) for one in values], pyarrow.string())
        kind = pyarrow.float64() if any(isinstance(value, float) for value in known) else pyarrow.int64()
        return pyarrow.array(values, kind)

    file = io.BytesIO()
    parquet.write_table(pyarrow.table({name: column(values) for name, values in table.items()}), file)
    return file.getvalue()
