"""What a suite hands back: tables, plots and promises, on what they were measured; as data and as Markdown."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

Cell = str | float | int | None
Say = Callable[[str], None]


@dataclass(frozen=True)
class Table:
    """Rows under columns; a number is shown with three significant digits, None as a dash. Without columns each row is
    a line of text, shown as it stands.
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
    series: dict[str, tuple[tuple[float, float], ...]]
    lines: bool = True
    curves: tuple[str, ...] = ()
    linear_x: bool = False
    frontier: bool = False


@dataclass(frozen=True)
class Promise:
    """An error that may not exceed its limit: what CI fails on. A time is never one."""

    what: str
    value: float
    limit: float

    @property
    def ok(self) -> bool:
        """Within the limit; a value that is no number is not."""
        return self.value <= self.limit


@dataclass(frozen=True)
class Result:
    """One suite's findings. `measured` says on what: machine, versions, size of the run; `options` are the words after
    the suite's name in the command that makes it again.
    """

    suite: str
    title: str
    text: str
    tables: tuple[Table, ...] = ()
    plots: tuple[Plot, ...] = ()
    promises: tuple[Promise, ...] = ()
    measured: dict[str, Any] = field(default_factory=dict)
    options: str = ""

    @property
    def ok(self) -> bool:
        """No promise broken."""
        return all(promise.ok for promise in self.promises)

    def as_dict(self) -> dict[str, Any]:
        """Return JSON-ready data; NaN and infinity become null, in a table their name."""
        data = asdict(self)
        for table in data["tables"]:
            table["rows"] = [[shown(cell) if _endless(cell) else cell for cell in row] for row in table["rows"]]
        for promise, there in zip(data["promises"], self.promises, strict=True):
            promise["ok"] = there.ok
        return _finite(data)


def from_dict(data: dict[str, Any]) -> Result:
    """Return the result of which `as_dict` gave `data`."""
    return Result(
        suite=data["suite"],
        title=data["title"],
        text=data["text"],
        tables=tuple(
            Table(t["title"], tuple(t["columns"]), tuple(map(tuple, t["rows"])), t["note"]) for t in data["tables"]
        ),
        plots=tuple(
            Plot(
                **{
                    **p,
                    "series": {k: tuple(map(tuple, v)) for k, v in p["series"].items()},
                    "curves": tuple(p["curves"]),
                }
            )
            for p in data["plots"]
        ),
        promises=tuple(
            Promise(p["what"], math.nan if p["value"] is None else p["value"], p["limit"]) for p in data["promises"]
        ),
        measured=data["measured"],
        options=data.get("options", ""),
    )


def frontier(points: Sequence[tuple[float, float]]) -> list[bool]:
    """Tell which (cost, error) no other point beats in both: what to pick for a given error."""
    return [
        math.isfinite(c) and math.isfinite(e) and not any((x <= c and y < e) or (x < c and y <= e) for x, y in points)
        for c, e in points
    ]


def fastest(points: Sequence[tuple[str, float, float]], error: float) -> str | None:
    """Return the name of the cheapest (name, cost, error) whose error is at most `error`; None if there is none."""
    return min(((cost, name) for name, cost, found in points if found <= error), default=(0.0, None))[1]


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


def markdown(result: Result, picture: Sequence[str] | None = None) -> str:
    """Return the suite's section; `picture[i]` is the file of plot i, None links no pictures."""
    lines = [f"## {result.title}", "", result.text, ""]
    size = ", ".join(f"{k} {v}" for k, v in result.measured.items())
    command = f"unitcad accuracy {result.suite} {result.options}".strip()
    lines += [f"`{command}`; measured on: {size}.", ""]
    for table in result.tables:
        lines += [f"**{table.title}**", "", *table_lines(table), ""]
        if table.note:
            lines += [table.note, ""]
    for plot, file in zip(result.plots, picture, strict=True) if picture is not None else ():
        lines += [f"![{plot.title}]({file})", ""]
    if result.promises:
        rows = tuple((p.what, p.value, p.limit, "kept" if p.ok else "BROKEN") for p in result.promises)
        lines += ["**Promises (CI fails when one is broken)**", ""]
        lines += [*table_lines(Table("", ("what", "value", "limit", ""), rows)), ""]
    return "\n".join(lines)


def table_lines(table: Table) -> list[str]:
    """Return a table in Markdown."""
    if not table.columns:
        return ["```text", *(str(line) for (line,) in table.rows), "```"]
    rows = ["| " + " | ".join(shown(cell) for cell in row) + " |" for row in table.rows]
    return ["| " + " | ".join(table.columns) + " |", "|" + " --- |" * len(table.columns), *rows]


def _endless(value: Any) -> bool:
    return isinstance(value, float) and not math.isfinite(value)


def _finite(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _finite(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_finite(value) for value in data]
    if hasattr(data, "item"):
        data = data.item()
    return None if _endless(data) else data
