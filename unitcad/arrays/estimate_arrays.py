"""Arrays on the terminal: the summary of a build, and the crosstalk that `unitcad estimate` prints."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import typer
from rich.text import Text

from unitcad.arrays.array_file import load_array
from unitcad.arrays.array_map import array_map
from unitcad.arrays.crosstalk import CROSSTALK, crosstalk, ratio_line, ratios
from unitcad.arrays.patch import PatchMoulds
from unitcad.casting.steps import casting_summary
from unitcad.cli.output import print_indented, print_json, progress
from unitcad.cli.tables import console, print_table
from unitcad.documents import read_json
from unitcad.errors import Refusal
from unitcad.meshcheck.findings import counted
from unitcad.moulds.heights import as_printed
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.manifest import Manifest
from unitcad.pipeline.summary import MOULDED, assumed_line, checks_text, to_open
from unitcad.report.map_file import MapFile
from unitcad.text import number
from unitcad.validation import compound_kind


def array_summary(moulds: PatchMoulds, folder: Path, manifest: Manifest) -> Iterator[str]:
    """Yield a line each: units, size and checks, lengths to measure, casting, crosstalk, the page."""
    array, moulded = moulds.array, MOULDED & set(manifest["outputs"])
    box = array.sheet.outline
    size = f"{number(box[2] - box[0], 3)} x {number(box[3] - box[1], 3)} mm"
    made = as_printed(moulds) if moulded else ""
    thick = f"{number(array.sheet.thickness_mm, 3)} mm thick{f', {made}' if made else ''}"
    yield f"{counted(len(array.places), 'unit')} on a sheet of {size}, {thick}{checks_text(manifest)}"
    for unit in array.units if moulded and moulds.construction.own_tails else ():
        if made := as_printed(MouldSet(unit)):
            yield f"unit {unit.name} is {made}"
    for unit in array.units:
        yield from assumed_line(unit, moulds.given, array.paths_of(unit)[0])
    if manifest["casting"]:
        told = {f"warning: {line}" for line in manifest["warnings"]}
        lines = casting_summary(read_json(folder / "casting.json"), manifest["files"])
        yield from (line for line in lines if line not in told)
    crosstalk = folder / CROSSTALK
    if "estimate" in manifest["outputs"] and crosstalk.is_file():
        yield from read_json(crosstalk)["answer"][:2]
    yield from to_open(folder)


_MOST_PLACES, _MOST_PAIRS = 64, 16
"""Units up to which each has a row, and each pair a cell, on the screen; the JSON has all."""


def estimate_arrays(
    names: Sequence[str],
    sets: Sequence[str],
    hertz: float | None,
    details: bool,
    as_json: bool,
    wanted_map: MapFile | None = None,
) -> None:
    """Print the crosstalk of arrays and, of several, each over the first; write the map of one if it is wanted."""
    for name in names:
        if not compound_kind(name):
            raise Refusal("SPEC", name, "is a unit, and the others are arrays: estimate them apart")
    own = [f"estimate.frequency_hz={hertz!r}"] if hertz else []
    arrays = [load_array(name, [*sets, *own], lay_tails=False) for name in names]
    with progress("crosstalk") as stage:
        every = [crosstalk(array, stage) for array in arrays]
        if wanted_map:
            stage("map")
            drawn = wanted_map.write(array_map(arrays[0], wanted_map.threshold_um, wanted_map.share))
            every[0]["map"] = drawn.figures()
    compared = ratios(every)
    if as_json:
        print_json(every[0] if len(every) == 1 else {"arrays": every, "ratios": compared})
        return
    screen = console()
    for array, data in zip(arrays, every, strict=True):
        units = ", ".join(dict.fromkeys(f"{unit.name} {number(unit.diameter_mm, 4)} mm" for unit in array.units))
        places = data["places"]
        drives = " and ".join(sorted({place["drive"] for place in places}))
        frequency = " and ".join(sorted({f"{place['frequency_hz']:g} Hz" for place in places}))
        rest = f": {counted(len(places), 'unit')} ({units}), {frequency}, {drives} drive, {data['tissue']}"
        screen.print(Text.assemble((data["array"], "bold"), rest))
        print_indented(*data["answer"])
        if wanted_map:
            print_indented(*data["map"]["lines"], f"Map: {wanted_map.path}")
        if details:
            _print_details(data)
    for one in compared:
        screen.print(ratio_line(one), soft_wrap=True)
    if not details:
        typer.echo("--details prints the sum at each unit, the pairs and the assumptions")


def _print_details(data: Mapping[str, Any]) -> None:
    names, sums, matrix = [place["name"] for place in data["places"]], data["sums"], data["matrix"]
    if len(names) <= _MOST_PLACES:
        heads = {"root_sum_of_squares": "root of squares", "in_phase": "in one phase", "worst_phases": "worst phases"}
        rows = [
            {"unit": name, **{head: number(sums[key][i], 2) for key, head in heads.items() if sums[key]}}
            for i, name in enumerate(names)
        ]
        how = "root of squares, in one phase (complex sum), at the worst phases"
        print_table(rows, f"sum of all other units there, times one unit's edge level: {how}")
    if 1 < len(names) <= _MOST_PAIRS:
        shares = [["-" if value is None else number(100 * value, 2) for value in row] for row in matrix]
        rows = [{"drives": name, **dict(zip(names, row, strict=True))} for name, row in zip(names, shares, strict=True)]
        print_table(rows, "% of a unit's motion at its edge that reaches the middle of another")
    ranges = f"In brackets: {data['range']}."
    print_indented(ranges, *data["assumptions"], f"Distances are {data['distances']}.")
