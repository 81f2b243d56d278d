"""unitcad phantom."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from unitcad.cli.output import console, print_json, progress, warn
from unitcad.cli.shared_options import AsJson
from unitcad.lab.phantom import PhantomSet, phantom_files, phantom_set
from unitcad.lab.phantom.recipe import load_phantom


def phantom(
    source: Annotated[
        str, typer.Argument(metavar="[PHANTOM]", help="Phantom file, or name of a shipped one (unitcad list phantoms).")
    ] = "skin",
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Parent of the phantom's folder.")] = Path(
        "out"
    ),
    png: Annotated[bool, typer.Option("--png", help="Also draw the box taken apart, box.png.")] = False,
    as_json: AsJson = False,
) -> None:
    """Make a skin phantom to cast, and its response.

    Recipe, box with a screed frame a layer, lid, stage holder, procedure, bench sheet, the tissue for
    an estimate, and the response to expect. The last line printed is the folder.
    """

    table = load_phantom(source)
    with progress("phantom") as stage:
        stage("response")
        made = phantom_set(table)
        found = phantom_files.contents(made, stage)
        if png:
            stage("picture")
            found["box.png"] = phantom_files.box_picture(made)
        stage("checks")
        folder = out / f"phantom-{table.name}"
        faults = phantom_files.write(folder, found, made.printer.name)
    if as_json:
        print_json(
            {
                "folder": str(folder),
                "findings": faults,
                "response": asdict(made.expected),
                **phantom_files.casting_data(made),
            }
        )
    else:
        _print(made)
        typer.echo(str(folder))
    for fault in faults:
        warn(f"finding: {fault}")
    if faults:
        raise typer.Exit(1)


def _print(made: PhantomSet) -> None:

    screen, e = console(), made.expected
    layers = Table("layer", "silicone", "thinner", "kPa", "mm", "0.1 mm thinner")
    for layer, one in zip(made.table.layers, made.recipes, strict=True):
        change = f"{100 * e.sensitivity[layer.name]:+.2g} %"
        modulus = f"{one.modulus_kpa:.3g}"
        thinner = f"{one.thinner_pct:g} %"
        layers.add_row(layer.name, one.silicone.name, thinner, modulus, f"{layer.thickness_mm:g}", change)
    screen.print(layers)
    response = Table("mm", *(f"{d:g}" for d in e.distances_mm))
    response.add_row("expected", *(f"{v:.3f}" for v in e.value))
    response.add_row("forearm", *(f"{v:.3f}" for v in e.forearm))
    screen.print(response)
    screen.print(
        f"  inside {made.inside_mm:g} mm: an echo of {e.echo_pct:.2g} % at {e.distances_mm[-1]:g} mm; "
        f"{made.table.most_echo_pct:g} % "
        f"need walls {e.wall_mm:g} mm from the unit's centre",
        soft_wrap=True,
    )
    screen.print(f"  repeatable, not skin-like: off the forearm template by a factor of {e.factor:.2g}", soft_wrap=True)
