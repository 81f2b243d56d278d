"""unitcad fit."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.table import Column, Table

from unitcad import files
from unitcad.cli.output import console, print_json, progress
from unitcad.cli.shared_options import AsJson
from unitcad.lab import fit_files
from unitcad.lab.fitting import Fitted, fit_lab, load_fit_lab


def fit(
    lab: Annotated[
        str, typer.Argument(metavar="LAB", help="File of the units that a lab measured, or name of a shipped one.")
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            metavar="DIR",
            help="Folder for lab-fit.toml, fit.json, fit.md and fit.svg. Default: only print.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Judge the edge-level models with a lab's units, and fit them.

    Each unit is predicted from all others, by every model and by a baseline of four class means. The fewer units, the
    more the constants shrink towards the stored ones. `estimate --fit` and `build --fit` take lab-fit.toml.
    """

    loaded = load_fit_lab(lab)
    with progress("fit") as stage:
        result = fit_lab(loaded, stage)
        made = fit_files.contents(result) if out is not None else {}
    if out is not None:
        files.replace_all(out, {name: text.encode() for name, text in made.items()}, fit_files.FIT)
    if as_json:
        print_json({**fit_files.as_data(result), **({"folder": str(out)} if out is not None else {})})
        return
    _print(result)
    if out is not None:
        typer.echo(str(out))


def _print(result: Fitted) -> None:

    screen, chosen, settings = console(), result.chosen, result.lab.settings
    screen.print(f"{settings.name}: {result.fit.units} units of its own, {settings.moduli} moduli", soft_wrap=True)
    if settings.note:
        screen.print(f"  {settings.note}", soft_wrap=True)
    table = Table("model", "leave-one-out", "own: stored -> fitted", "against the baseline", "80 %")
    for name in chosen.order:
        one = result.fit.model[name]
        own = "-" if one.own_left_out is None else f"x {one.own_left_out:.2f}"
        if one.own_by_stored is not None:
            own = f"{one.own_by_stored:.2f} -> {one.own_left_out:.2f}"
        score = f"x {one.left_out:.2f} ({one.left_out_low:.2f} to {one.left_out_high:.2f})"
        table.add_row(name, score, own, fit_files.against_text(one), one.held)
    screen.print(table)
    screen.print(f"  {fit_files.leads_text(result)}", soft_wrap=True)
    screen.print("constants, stored -> fitted (90 %):")
    for name in chosen.order:
        screen.print(f"  {name}: {fit_files.constants_text(result.fit.model[name])}", soft_wrap=True)
    for one in fit_files.warnings(result):
        screen.print(f"  warning: {one}", soft_wrap=True)
    by_source = Table("moduli", *chosen.judged, title="leave-one-out error, by source of the moduli")
    for source, compared in result.by_source.items():
        by_source.add_row(
            source, *[f"{compared.judged[n].score:.2f}" if compared.judged else "-" for n in chosen.judged]
        )
    screen.print(by_source)
    for source, compared in result.by_source.items():
        if compared.reason:
            screen.print(f"  {source}: {compared.reason}", soft_wrap=True)
    head, *rows = fit_files.differing_table(result)
    differing = Table(Column("unit", overflow="fold"), *head[1:], title="units on which the models differ most")
    for cells in rows:
        differing.add_row(*cells)
    screen.print(differing)
    screen.print(f"  {fit_files.DIFFERING}.", soft_wrap=True)
    screen.print(f"  {fit_files.prior_text(result)}", soft_wrap=True)
    screen.print(
        "  against the baseline (four class means): difference of |ln(predicted/measured)|, below 0 is better; 80 %: "
        "units in their range",
        soft_wrap=True,
    )
