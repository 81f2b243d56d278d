"""`unitcad experiments`: what to measure next, as tables for a person, as JSON or as a folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from unitcad.cli.output import console, print_json, progress
from unitcad.cli.shared_options import AsJson, listed

if TYPE_CHECKING:
    from rich.table import Table

    from unitcad.experiments.lab_file import Lab

_COLUMNS = 4
"""Experiments whose predictions fit a terminal of 80 characters."""


def experiments(
    lab: Annotated[str, typer.Argument(metavar="LAB", help="a TOML file of what a lab has, or a shipped one's name")],
    rivals: Annotated[
        str | None, typer.Option(help="names separated by commas, or all; else the file's, or the usual ones")
    ] = None,
    compare: Annotated[
        str | None, typer.Option(help="what the readings of a ratio differ in: unit,frequency,body; else the file's")
    ] = None,
    draws: Annotated[int | None, typer.Option(help="of what is not known, for each rival; else the file's")] = None,
    element_draws: Annotated[
        int | None, typer.Option(help="the same for finite elements, which cost more: 10 to 2000")
    ] = None,
    held: Annotated[
        bool | None,
        typer.Option("--held-to-levels/--prior", help="weigh the draws by the nine measured levels, or not"),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="of the draws; else the file's")] = None,
    out: Annotated[
        Path | None, typer.Option("-o", "--out", help="Write experiments.json, .md and .svg into this folder.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Rank what a lab can measure next.

    The order is by what a measurement would say about rival models of the level at the edge. Each experiment is a ratio
    of two readings. Its bits are the expected information about which rival holds, with the error of that figure.
    """
    from unitcad.cache import DiskStore, default_root
    from unitcad.experiments.lab_file import load_lab
    from unitcad.experiments.study import study
    from unitcad.experiments.study_files import write_study

    asked = {
        "rivals": None if rivals is None else listed(rivals),
        "compare": None if compare is None else listed(compare),
        "draws": draws,
        "element_draws": element_draws,
        "held_to_levels": held,
        "seed": seed,
    }
    loaded = load_lab(lab, {key: value for key, value in asked.items() if value is not None})
    with progress("experiments") as stage:
        data = study(loaded, stage, DiskStore(default_root()))
    folder = write_study(data, out) if out else None
    if as_json:
        print_json(data)
        return
    _print(data, loaded, folder is not None)
    if folder:
        typer.echo(str(folder))


def _print(data: dict[str, Any], lab: Lab, saved: bool) -> None:
    from unitcad.experiments.range_plot import BELOW
    from unitcad.experiments.study_files import A_BIT, draws_text, left_out, shown, telling

    screen = console()
    names = [rival["name"] for rival in data["rivals"]]
    found = shown(data)
    screen.print(
        f"{lab.name}: {len(data['experiments'])} ratios of {len(lab.conditions)} readings, {len(names)} rivals, "
        f"{data['most_bits']:.2f} bits to know",
        soft_wrap=True,
    )
    for line in left_out(data):
        screen.print(f"  left out, {line}", soft_wrap=True)
    screen.print(A_BIT, soft_wrap=True)
    if found:
        screen.print(_best(found))
        screen.print(_ranges(found, names))
        if len(found) > _COLUMNS:
            where = "experiments.json" if saved else "experiments.json of -o FOLDER"
            screen.print(f"  Predictions of the first {_COLUMNS}; all ratios stand in {where}.", soft_wrap=True)
    if sets := telling(data["sets"]):
        screen.print(_sets(sets))
    for rival in data["rivals"]:
        facts = [f"probability {rival['probability']:.2f}"] if data["measured"] else []
        if rival["held"]:
            facts.append(f"misses the nine levels by a factor of {rival['held']['misses']:.2f}")
        known = f" ({', '.join(facts)})" if facts else ""
        screen.print(f"  {rival['name']}{known}: {rival['says']}", soft_wrap=True)
    screen.print(
        f"  A reading scatters by {100 * data['noise']:g} %, a rival that holds misses a ratio by "
        f"{100 * data['discrepancy']:g} %. Ranges: 10 to 90 % of {draws_text(data)}, without that scatter; "
        f"{BELOW}: so for half of the draws or more. ±: the error of the bits.",
        soft_wrap=True,
    )
    for line in data["few_draws"]:
        screen.print(f"  {line}", soft_wrap=True)
    screen.print(data["settles"], soft_wrap=True)


def _best(found: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    table = Table("", "ratio; of each comparison the best one", "bits")
    for number, one in enumerate(found, 1):
        table.add_row(str(number), one["experiment"], f"{one['bits']:.2f} ± {one['error']:.2f}")
    return table


def _ranges(found: list[dict[str, Any]], names: list[str]) -> Table:
    from rich.table import Table

    from unitcad.experiments.study import span_text

    table = Table(title="predicted ratio (10 to 90 % of the draws)")
    table.add_column("rival", no_wrap=True)
    for number, _ in enumerate(found[:_COLUMNS], 1):
        table.add_column(str(number))
    for name in names:
        table.add_row(name, *[span_text(one["predicted"][name]) for one in found[:_COLUMNS]])
    return table


def _sets(sets: list[dict[str, Any]]) -> Table:
    from rich.table import Table

    table = Table("measured together", "bits", "not told apart")
    for one in sets:
        pairs = "\n".join(" and ".join(pair["rivals"]) for pair in one["not_told_apart"]) or "none"
        table.add_row("\n".join(one["experiments"]), f"{one['bits']:.2f} ± {one['error']:.2f}", pairs)
    return table
