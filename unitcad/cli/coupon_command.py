"""unitcad coupon."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from unitcad import catalogue
from unitcad.casting.coupon import Coupon, write
from unitcad.cli.output import print_json
from unitcad.cli.shared_options import AsJson


def coupon(
    printer: Annotated[
        str, typer.Argument(metavar="PRINTER", help="A printer of the catalogue (unitcad list printers).")
    ],
    out: Annotated[Path, typer.Option("-o", "--out", metavar="DIR", help="Parent of the coupon's folder.")] = Path(
        "out"
    ),
    as_json: AsJson = False,
) -> None:
    """Write a fit coupon to print first, and how to read it. The last line printed is the folder."""

    chosen = catalogue.choose("PRINTER", printer, catalogue.printers())
    folder = write(chosen, out)
    if as_json:
        fits = {
            fit.key: {"feature": fit.feature, "choose": fit.choose, "values_mm": list(fit.values_mm)}
            for fit in Coupon(chosen).fits.values()
        }
        print_json({"folder": str(folder), "printer": printer, "fits": fits})
    else:
        typer.echo(Coupon(chosen).markdown())
        typer.echo(str(folder))
