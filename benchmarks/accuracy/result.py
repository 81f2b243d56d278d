"""A suite's result: tables, plots and promises, and what they were measured on; as data and as Markdown."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import msgspec
import numpy as np

Cell = str | float | int | None
Say = Callable[[str], None]


@dataclass(frozen=True)
class Table:
    """Rows under columns; a number is shown with three significant digits, None as a dash.

    Without columns each row is a line of text, shown unchanged.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""


@dataclass(frozen=True)
class Plot:
    """Series of (x, y) points over logarithmic axes, or x over a linear one; `curves` are lines without points.

    `frontier`: markers are hollow unless no other point is lower in both.
    """

    title: str
    x_label: str
    y_label: str
    series: dict[str, tuple[tuple[float | int, float | int], ...]]
    lines: bool = True
    curves: tuple[str, ...] = ()
    linear_x: bool = False
    frontier: bool = False


@dataclass(frozen=True)
class Promise:
    """An error that may not exceed its limit: what CI fails on. A time is never one."""

    what: str
    value: float | int
    limit: float | int

    @property
    def ok(self) -> bool:
        """Within the limit; a value that is no number is not."""
        return bool(self.value <= self.limit)


@dataclass(frozen=True)
class Summary:
    """A suite on the front page.

    picks: rows (for what, error, what to pick). worst: its worst case, a sentence. plot: the number of the plot that
    the front page shows.
    """

    picks: tuple[tuple[str, str, str], ...] = ()
    worst: str = ""
    plot: int | None = None


@dataclass(frozen=True)
class Result:
    """One suite's tables, plots and promises, and what of it stands on the front page.

    `measured` says on what: machine, versions, date, size of the run. `options` are the options of the command that
    makes it again.
    """

    suite: str
    title: str
    text: str
    tables: tuple[Table, ...] = ()
    plots: tuple[Plot, ...] = ()
    promises: tuple[Promise, ...] = ()
    measured: dict[str, str | int] = field(default_factory=dict)
    options: str = ""
    summary: Summary = Summary()

    @property
    def ok(self) -> bool:
        """No promise broken."""
        return all(promise.ok for promise in self.promises)

    def as_dict(self) -> dict[str, Any]:
        """Return JSON-ready data; NaN and infinity become null, in a table their name.

        Raises TypeError for a cell that `from_dict` would not read: a truth value.
        """
        for table in self.tables:
            if any(isinstance(cell, bool | np.bool_) for row in table.rows for cell in row):
                raise TypeError(f"Table {table.title}: a cell is a truth value; write a word")
        tables = [replace(t, rows=tuple(tuple(map(_with_names, row)) for row in t.rows)) for t in self.tables]
        text = msgspec.json.encode(replace(self, tables=tuple(tables)), enc_hook=lambda number: number.item())
        data = msgspec.json.decode(text)  # JSON has no NaN and no infinity: both are null
        for written, promise in zip(data["promises"], self.promises, strict=True):
            written["ok"] = promise.ok
        return data


def from_dict(data: dict[str, Any]) -> Result:
    """Return the result of which `as_dict` gave `data`."""
    promises = [{**p, "value": math.nan if p["value"] is None else p["value"]} for p in data["promises"]]
    return msgspec.convert({**data, "promises": promises}, Result)


def frontier(points: Sequence[tuple[float, float]]) -> list[bool]:
    """Tell which (cost, error) no other point beats in both: what to pick for a given error."""
    return [
        math.isfinite(c) and math.isfinite(e) and not any((x <= c and y < e) or (x < c and y <= e) for x, y in points)
        for c, e in points
    ]


def stars(points: Sequence[tuple[float, float]], most: float = math.inf) -> list[str]:
    """Return a star for each point on the frontier whose error is at most `most`, for a column of a table."""
    return ["*" if best else "" for best in frontier([(c, e if e <= most else math.inf) for c, e in points])]


def fastest(points: Sequence[tuple[str, float, float]], error: float) -> str | None:
    """Return the name of the cheapest (name, cost, error) whose error is at most `error`; None if there is none."""
    return min(((cost, name) for name, cost, own in points if own <= error), default=(0.0, None))[1]


def shown(value: Cell) -> str:
    """Return a cell as text."""
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        if not math.isfinite(value):
            return str(value)
        return f"{value:.3g}" if value == 0 or 1e-3 <= abs(value) < 1e5 else f"{value:.1e}"
    return str(value)


def measured_on(result: Result) -> str:
    """Return machine, versions and date of a measurement, in a line."""
    return ", ".join(f"{name} {value}" for name, value in result.measured.items())


def kept(promises: Sequence[Promise]) -> str:
    """Return a line on promises: how many, whether all are kept, and the one that uses most of its limit."""
    number = f"{len(promises)} promise{'s' if len(promises) > 1 else ''}"
    broken = [promise for promise in promises if not promise.ok]
    if broken:
        return f"{number}, **{len(broken)} broken**"
    limited = [promise for promise in promises if promise.limit > 0]
    if not limited:
        return f"{number}, all kept"
    tightest = max(limited, key=lambda promise: promise.value / promise.limit)
    return f"{number}, all kept; the tightest: {tightest.what} ({shown(tightest.value)}, limit {shown(tightest.limit)})"


def table_lines(table: Table) -> list[str]:
    """Return a table in Markdown."""
    if not table.columns:
        return ["```text", *(str(line) for (line,) in table.rows), "```"]
    rows = ["| " + " | ".join(shown(cell) for cell in row) + " |" for row in table.rows]
    return ["| " + " | ".join(table.columns) + " |", "|" + " --- |" * len(table.columns), *rows]


def _with_names(cell: Cell) -> Cell:
    return shown(cell) if isinstance(cell, float) and not math.isfinite(cell) else cell
