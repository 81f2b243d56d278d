"""unitcad measure."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from unitcad.cli.output import print_json, progress, warn
from unitcad.cli.shared_options import AsJson
from unitcad.files import sha256
from unitcad.lab import measured_files, measuring
from unitcad.lab.campaign import read_campaign


def measure(
    campaign: Annotated[
        Path, typer.Argument(metavar="CAMPAIGN", help="File of the units, their recordings and the sensor.")
    ],
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="DIR", help="Folder for the results. Default: out/measure-CAMPAIGN."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Measure units from recordings in a lab.

    Reads a vibrometer, a displacement sensor or an accelerometer. Gives the level at the edge and along the skin,
    normalised by the motor, with an interval of 95 % from the repeats.
    Exit 1 if a finding puts a record or a level in doubt. The last line printed is the folder.
    """

    asked = read_campaign(campaign)
    folder = out or Path("out") / f"measure-{campaign.stem}"
    with progress(asked.name) as say:
        result = measuring.measure(asked, campaign.parent, say)
        result = replace(result, specs={campaign.name: sha256(campaign), **result.specs})
        say("files")
        measured_files.write(result, folder)
    for finding in result.findings:
        warn(f"{finding.code} {finding.severity}: {finding.where}: {finding.message}")
    if as_json:
        print_json({"folder": str(folder), **measured_files.as_data(result)})
    else:
        for line in measured_files.lines(result):
            typer.echo(line)
        typer.echo(str(folder))
    if result.findings:
        sys.exit(1)
