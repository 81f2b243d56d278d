"""unitcad score."""

from __future__ import annotations

from typing import Annotated, Any

import typer
from rich.table import Table

from unitcad.cli.output import console, print_json, progress
from unitcad.cli.shared_options import AsJson
from unitcad.lab.scoring import load_figure
from unitcad.lab.scoring import score as scored


def score(
    figure: Annotated[
        str,
        typer.Argument(metavar="FIGURE", help="CSV file of a digitised figure, or name of a shipped one."),
    ],
    as_json: AsJson = False,
) -> None:
    """Score every model on a digitised figure, blind.

    The constants are those of the nine measured levels. Columns: unit, distance_mm, value, error, source.
    Points at 0 mm are levels at the edge, farther points are on the skin.
    """
    points = load_figure(figure)
    with progress("score"):
        data = scored(points)
    if as_json:
        print_json(data)
        return
    screen = console()
    models = list(data["scores"])
    table = Table("unit", "measured %", "80 % range", *models, title="level at the edge, %; *: fitted to it, not blind")
    for one in data["units"]:
        name = one["unit"] + ("" if one["blind"] else " *")
        ends = f"{100 * one['p10']:.2g} to {100 * one['p90']:.2g}"
        levels = [f"{100 * one['levels'][model]:.2g}" for model in models]
        table.add_row(name, f"{100 * one['measured']:.3g}", ends, *levels)
    table.add_section()
    table.add_row(
        "factor error, blind", "", f"held {data['held']}", *[_factor(data["scores"][model]) for model in models]
    )
    screen.print(table)
    if data["decay"]:
        screen.print(_decay(data))


def _decay(data: dict[str, Any]) -> Table:
    curves = list(data["decay_scores"])
    table = Table("unit", "mm", "measured %", *curves, title="on the skin, % of the unit's own level at the edge")
    for one in data["decay"]:
        cells = []
        for name in curves:
            ends = [f"{100 * one[name][key]:.2g}" for key in ("low", "high") if key in one[name]]
            cells.append(f"{100 * one[name]['value']:.2g}" + (f" ({' to '.join(ends)})" if ends else ""))
        table.add_row(one["unit"], f"{one['distance_mm']:g}", f"{100 * one['measured']:.2g}", *cells)
    table.add_section()
    table.add_row("factor error", "", "", *[_factor(data["decay_scores"][name]) for name in curves])
    return table


def _factor(value: float | None) -> str:
    return "-" if value is None else f"x {value:.2f}"
