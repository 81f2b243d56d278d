"""unitcad score: a digitised figure against every model, blind. Constants are those of the catalogue's nine levels."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from unitcad.attenuation.curve import layered_block
from unitcad.attenuation.edge.estimates import rounded
from unitcad.attenuation.edge.measured import CONTROL, measured_table, nominal
from unitcad.attenuation.edge.models import COMPARED
from unitcad.attenuation.edge.ranges import predictive_of
from unitcad.attenuation.inputs import EstimateInput
from unitcad.catalogue import figures, measurements
from unitcad.cli.output import print_json, print_table, progress
from unitcad.cli.shared_options import AsJson
from unitcad.designs import estimated_designs
from unitcad.errors import Refusal, unknown_name
from unitcad.estimate_inputs import estimate_input
from unitcad.files import read_text
from unitcad.validation import from_data

COLUMNS = ("unit", "distance_mm", "value", "error", "source")
FAR_MM = 30.0
"""As far as the estimate's curve goes, mm."""


@dataclass(frozen=True)
class Point:
    """A digitised point: amplitude on the skin over the motor's, at a distance (mm) from the unit's edge."""

    unit: str
    distance_mm: float
    value: float
    error: float | None
    source: str


def load_figure(source: str) -> tuple[Point, ...]:
    """Return the points of a CSV file, or of a figure in the catalogue. Raises Refusal with every fault."""
    known = figures()
    path = known.get(source) or Path(source)
    if source not in known and not source.endswith(".csv"):
        if Path(source).exists():
            raise Refusal("FIGURE", source, "is not a CSV file")
        raise unknown_name("FIGURE", source, known)
    numbered = enumerate(read_text(path).splitlines(), 1)
    lines = {i: line for i, line in numbered if line.strip() and not line.startswith("#")}
    rows = csv.reader(lines.values())
    head = next(rows, [])
    points: dict[int, Point] = {}
    faults: dict[int, Refusal] = {}
    if tuple(head) != COLUMNS:
        faults[next(iter(lines), 1)] = Refusal("header", ",".join(head), f"must be {','.join(COLUMNS)}")
    for cells in rows if not faults else ():
        line = list(lines)[rows.line_num - 1]
        try:
            points[line] = _point(cells)
        except Refusal as fault:
            faults[line] = fault
    at_edge = {point.unit for point in points.values() if point.distance_mm == 0.0}
    for line, point in points.items() if not faults else ():
        if point.unit not in at_edge:
            limit = f"{point.unit} needs a row at 0 mm to compare with"
            faults[line] = Refusal("distance_mm", point.distance_mm, limit)
    for line, fault in faults.items():
        fault.file, fault.line = str(path), line
    if faults:
        first, *others = faults.values()
        first.others = tuple(others)
        raise first
    if not points:
        raise Refusal("FIGURE", source, "has no points")
    return tuple(points.values())


def _point(cells: list[str]) -> Point:
    if len(cells) != len(COLUMNS):
        raise Refusal("row", ",".join(cells), f"must have {len(COLUMNS)} cells")
    unit, *numbers, source = (cell.strip() for cell in cells)
    _layers("unit", unit)
    limits = (("distance_mm", 0.0, FAR_MM), ("value", 1e-6, 3.0), ("error", 0.0, 3.0))
    distance, value, error = (_number(text, *limit) for text, limit in zip(numbers, limits, strict=True))
    return Point(unit, distance, value, error if numbers[2] else None, source)


def _number(text: str, name: str, least: float, most: float) -> float:
    """Return the number in a cell; 0 for an error that is not given."""
    try:
        number = float(text or "0" if name == "error" else text)
    except ValueError:
        raise Refusal(name, text, "must be a number") from None
    if not least <= number <= most:
        hint = "; a fraction of the motor's amplitude, not per cent" if name == "value" and number > most else ""
        raise Refusal(name, number, f"must be from {least:g} to {most:g}{hint}")
    return number


def _layers(field: str, unit: str) -> tuple[str, list[str]]:
    """Return design and silicones of a name like DESIGN E10/D30."""
    design, _, pair = unit.partition(" ")
    known = (CONTROL, *estimated_designs())
    if design not in known:
        raise unknown_name(field, design, known)
    short = measurements().names
    for name in pair.split("/"):
        if name not in short:
            raise unknown_name(field, name, short)
    layers = [short[name] for name in pair.split("/")]
    if (design == CONTROL) != (len(layers) == 1):
        raise Refusal(field, unit, f"{CONTROL} has one silicone, a design two or more")
    if design != CONTROL and len(set(layers)) == 1:
        raise Refusal(field, unit, f"all layers are one silicone: name it {CONTROL} {pair.split('/')[0]}")
    return design, layers


def variants_of(unit: str) -> list[EstimateInput]:
    """Return a unit at the measured units' lengths, in each design that it may be of."""
    design, layers = _layers("unit", unit)
    shared = measurements().unit
    wall = 2 * shared.wall_mm / len(layers)
    chosen = [name for name in estimated_designs() if design in (CONTROL, name)]
    made = []
    for name in chosen:
        cap = {"cap_mm": wall} if estimated_designs()[name].caps else {}
        table = [{"material": material, "wall_mm": wall, **cap} for material in layers]
        data = {"name": unit, "design": name, "diameter_mm": shared.diameter_mm, "fpcb": {}, "layers": table}
        made.append(estimate_input(from_data(data)))
    return made


def score_figure(points: tuple[Point, ...]) -> dict[str, Any]:
    """Return {units, scores, decay, decay_scores} as JSON-ready data.

    `units`: each measured level, at 0 mm, with every model's, the 80 % range, and `blind`: whether the constants were
    fitted without it. `scores`: each model's geometric-mean factor error over the blind units. `decay`: each point
    farther out over its unit's own level. It has the skin's curve and range under either drive, and the paper's
    exponential; `decay_scores` has their factor errors.
    """
    table = measured_table()
    everyone = np.ones((1, len(table.names)))
    constants = {name: model.fit(table, everyone)[0] for name, model in COMPARED.items()}
    levels = {point.unit: point for point in points if point.distance_mm == 0.0}
    units = [_unit(point, constants) for point in levels.values()]
    blind = [one for one in units if one["blind"]]
    outside = [point for point in points if point.distance_mm > 0.0 and point.unit in levels]
    skins = {unit: layered_block(variants_of(unit)[0]) for unit in dict.fromkeys(point.unit for point in outside)}
    decay = [_decay(point, point.value / levels[point.unit].value, skins[point.unit]) for point in outside]
    return rounded(
        {
            "units": units,
            "scores": {name: _factor([(one["levels"][name], one["measured"]) for one in blind]) for name in COMPARED},
            "coverage": f"{sum(one['in_range'] for one in blind)} of {len(blind)}",
            "decay": decay,
            "decay_scores": {
                name: _factor([(one[name]["value"], one["measured"]) for one in decay])
                for name in ("flat", "axial", "published")
            },
        },
        6,
    )


def _unit(point: Point, constants: Mapping[str, np.ndarray]) -> dict[str, Any]:
    variants = variants_of(point.unit)
    levels = {
        name: float(np.exp(np.mean([model.logs(nominal(one), constants[name])[0] for one in variants])))
        for name, model in COMPARED.items()
    }
    low, _, high = (float(end[0]) for end in predictive_of(variants[:1]).range)
    return {
        "unit": point.unit,
        "measured": point.value,
        "error": point.error,
        "source": point.source,
        "blind": point.unit not in measured_table().names,
        "levels": levels,
        "p10": low,
        "p90": high,
        "in_range": low <= point.value <= high,
    }


def _decay(point: Point, measured: float, layered: Mapping[str, Any]) -> dict[str, Any]:
    mm = layered["r_mm"]

    def at(curve: Mapping[str, Any]) -> dict[str, float]:
        return {key: float(np.interp(point.distance_mm, mm, values)) for key, values in curve.items()}

    exponential = layered["published_curves"]["exponential"]["loss_modulus"]
    return {
        "unit": point.unit,
        "distance_mm": point.distance_mm,
        "measured": measured,
        **{drive: at(block["u"]) for drive, block in layered["drives"].items()},
        "published": at({"value": exponential}),
    }


def _factor(pairs: list[tuple[float, float]]) -> float | None:
    """Return the geometric-mean factor between predicted and measured values."""
    return float(np.exp(np.mean([abs(np.log(one / other)) for one, other in pairs]))) if pairs else None


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
        data = score_figure(points)
    if as_json:
        print_json(data)
        return
    rows = [
        {
            "unit": one["unit"] + ("" if one["blind"] else " *"),
            "measured %": f"{100 * one['measured']:.3g}",
            "80 % range": f"{100 * one['p10']:.2g} to {100 * one['p90']:.2g}",
            **{model: f"{100 * one['levels'][model]:.2g}" for model in data["scores"]},
        }
        for one in data["units"]
    ]
    factors = {model: _factor_text(score) for model, score in data["scores"].items()}
    blind = {"unit": "factor error, blind", "measured %": "", "80 % range": f"coverage {data['coverage']}", **factors}
    print_table([*rows, blind], "level at the edge, %; *: fitted to it, not blind")
    if data["decay"]:
        print_table(_decay_rows(data), "on the skin, % of the unit's own level at the edge")


def _decay_rows(data: dict[str, Any]) -> list[dict[str, str]]:
    scores = data["decay_scores"]
    rows = []
    for one in data["decay"]:
        row = {"unit": one["unit"], "mm": f"{one['distance_mm']:g}", "measured %": f"{100 * one['measured']:.2g}"}
        for name in scores:
            ends = [f"{100 * one[name][key]:.2g}" for key in ("low", "high") if key in one[name]]
            row[name] = f"{100 * one[name]['value']:.2g}" + (f" ({' to '.join(ends)})" if ends else "")
        rows.append(row)
    factors = {name: _factor_text(score) for name, score in scores.items()}
    return [*rows, {"unit": "factor error", "mm": "", "measured %": "", **factors}]


def _factor_text(value: float | None) -> str:
    return "-" if value is None else f"x {value:.2f}"
