"""unitcad fit: lab-fit.toml, fit.json and fit.svg. The same input, the same bytes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
import typer
from rich.table import Column, Table

from unitcad import files
from unitcad.attenuation.edge.models import BASELINE, RULE
from unitcad.attenuation.edge.ranges import PERCENT, ModelFit, quantiles
from unitcad.attenuation.edge.scoring import OVERTURNED, sign_flip_p
from unitcad.cli.output import print_json, progress
from unitcad.cli.shared_options import AsJson
from unitcad.cli.tables import console
from unitcad.export.chart import Series, chart
from unitcad.json_text import rounded
from unitcad.lab.fitting import Fitted, fit_lab, load_fit_lab
from unitcad.spec.convert import without_none
from unitcad.spec.toml import text_of

FIT = "lab-fit.toml"
DIFFERING = (
    "Level by each model, fitted without the unit, and the factor between the highest and the lowest. "
    "A second cast of these units decides most."
)
_MOST_DIFFERING = 5


def contents(result: Fitted) -> dict[str, str]:
    """Return the files by name."""
    return {
        FIT: fit_toml(result),
        "fit.json": json.dumps(as_data(result), indent=1, ensure_ascii=False, allow_nan=False) + "\n",
        "fit.svg": _chart(result),
    }


def fit_toml(result: Fitted) -> str:
    """Return the fit as an estimate takes it (`[estimate] fit`)."""
    return text_of(without_none(msgspec.to_builtins(result.fit)))


def as_data(result: Fitted) -> dict[str, Any]:
    """Return everything as JSON-ready data."""
    return {
        "note": result.lab.settings.note,
        "units": unit_rows(result),
        "models_differ_on": differing_units(result),
        "fit": without_none(msgspec.to_builtins(result.fit)),
        "prior": prior_text(result),
        "warnings": warnings(result),
    }


def unit_rows(result: Fitted) -> list[dict[str, Any]]:
    """Return each unit's measured level and the leading model's prediction without it."""
    name, table = result.fit.leads, result.campaigns.table
    judged = result.judged[name]
    rows = []
    for i, unit in enumerate(table.names):
        low, high = map(float, quantiles(judged.df, judged.centre[i], judged.scale[i]))
        numbers = {"predicted": float(np.exp(judged.centre[i])), "p10": low, "p90": high}
        row = {"unit": unit, "own": bool(judged.own[i]), "measured": float(table.levels[i]), "model": name, **numbers}
        rows.append(rounded(row, 6))
    return rows


def differing_units(result: Fitted) -> list[dict[str, Any]]:
    """Return the lab's own units with the level by each model, fitted without the unit, and the extremes' factor.

    The unit on which the models differ most comes first.
    """
    judged = {name: one for name, one in result.judged.items() if name != BASELINE}
    own = next(iter(judged.values())).own
    rows = []
    for i, unit in zip(np.flatnonzero(own), result.lab.units, strict=True):
        levels = {name: float(np.exp(one.centre[i])) for name, one in judged.items()}
        factor = max(levels.values()) / min(levels.values())
        rows.append(rounded({"unit": unit.name, "levels": levels, "factor": factor, "measured": unit.level.value}, 6))
    return sorted(rows, key=lambda row: -row["factor"])


def prior_text(result: Fitted) -> str:
    """State the weight of the stored constants."""
    settings = result.lab.settings
    count = int(np.sum(~result.campaigns.own))
    if not count:
        return "Only the lab's own units count: nothing is shrunk."
    weight = count / (count * settings.between_labs**2 + 1)
    return (
        f"The stored constants, of {count} units, weigh as much as {weight:.2g} of the lab's own "
        f"(between_labs {settings.between_labs:g}: assumed, not measured)."
    )


def constants_text(one: ModelFit) -> str:
    """Return stored -> fitted (90 % range) of each constant."""
    parts = []
    for name, value in one.constants.items():
        stored = f"{one.stored[name]:.3g} -> " if one.stored else ""
        parts.append(f"{name} {stored}{value:.3g} ({one.low[name]:.3g} to {one.high[name]:.3g})")
        parts[-1] += ", not determined" if name == one.at_bound else ""
    return "; ".join(parts)


def warnings(result: Fitted) -> list[str]:
    """Say which models have a constant that the units do not determine."""
    return [
        f"{name}: the units do not determine {one.at_bound} ({one.constants[one.at_bound]:.3g}); its range says "
        "nothing, so the model is listed last"
        for name, one in result.fit.model.items()
        if one.at_bound
    ]


def leads_text(result: Fitted) -> str:
    """Say which model leads, by which rule, and the test that decided."""
    judged = result.judged
    errors = {name: np.abs(one.errors[one.own]) for name, one in judged.items()}
    lead = result.fit.leads
    tests = [
        f"{other} x {judged[other].own_score:.2f}, p {sign_flip_p(errors[lead], errors[other]):.2g}"
        for other in (RULE, BASELINE)
        if other != lead
    ]
    return (
        f"{lead} leads: x {judged[lead].own_score:.2f} on the lab's own units ({'; '.join(tests)}). A model "
        f"other than {RULE} leads only if its leave-one-out error on the lab's own units is below that of {RULE} and "
        f"{BASELINE}, with p at most {OVERTURNED:g} against both."
    )


def order(result: Fitted) -> list[str]:
    """Return the model that leads, then the others by their score; those with a constant not determined last."""

    def place(name: str) -> tuple[bool, bool, float]:
        return name != result.fit.leads, bool(result.fit.model[name].at_bound), round(result.judged[name].score, 4)

    return sorted(result.judged, key=place)


def sections(result: Fitted) -> list[tuple[str, list[list[str]], list[str]]]:
    """Return title, table with its head, and remarks of each section, for the terminal."""
    names = order(result)
    models = [["model", "leave-one-out", "own units", "own, stored constants", "against the baseline", "coverage"]]
    for name in names:
        one = result.fit.model[name]
        own = ["-" if value is None else f"{value:.2f}" for value in (one.own_leave_one_out, one.own_by_stored)]
        score = f"{one.leave_one_out:.2f} ({one.leave_one_out_low:.2f} to {one.leave_one_out_high:.2f})"
        against = "-"  # of the baseline itself
        if one.against_baseline is not None:
            error, p = one.against_baseline_error, one.against_baseline_p
            against = f"{one.against_baseline:+.2f} +- {error:.2f}, p {p:.2g}"
        models.append([name, score, *own, against, one.coverage])
    units = [["unit", "measured", "predicted", "P10", "P90"]]
    for row in unit_rows(result):
        numbers = (f"{row[key]:.3g}" for key in ("measured", "predicted", "p10", "p90"))
        units.append([f"{row['unit']}{' (own)' if row['own'] else ''}", *numbers])
    rows = differing_units(result)[:_MOST_DIFFERING]
    differing = [["unit", *rows[0]["levels"], "factor"]]
    for row in rows:
        differing.append([row["unit"], *(f"{level:.2g}" for level in row["levels"].values()), f"x {row['factor']:.2f}"])
    constants = [f"{name}: {constants_text(result.fit.model[name])}." for name in names]
    return [
        (
            "Models",
            models,
            [
                leads_text(result),
                prior_text(result),
                "Constants, stored -> fitted (90 %):",
                *constants,
                *(f"Warning: {one}." for one in warnings(result)),
                "Factors are geometric means of predicted over measured, 1 is exact; in brackets 5 to 95 % over units "
                "drawn again. Against the baseline: mean difference of |ln(predicted/measured)| with its standard "
                "error, and the sign-flip test; below 0 is better than the baseline. Coverage: units within their "
                "80 % range, which was predicted without them.",
            ],
        ),
        ("Units", units, [f"Predicted without the unit by {result.fit.leads}; 80 % intervals."]),
        ("Units on which the models differ most", differing, [DIFFERING]),
    ]


def _chart(result: Fitted) -> str:
    rows = unit_rows(result)
    series = []
    for label, own in (("the paper's units", False), ("the lab's own", True)):
        there = [row for row in rows if row["own"] == own]
        if there:
            measured, predicted = ([row[key] for row in there] for key in ("measured", "predicted"))
            bars = [(row["p10"], row["p90"]) for row in there]
            series.append(Series(f"{label}, with {PERCENT[0]} to {PERCENT[1]} %", measured, predicted, True, bars=bars))
    ends = [min(row["measured"] for row in rows), max(row["measured"] for row in rows)]
    series.append(Series("predicted = measured", ends, ends, dashed=True))
    title = f"{result.fit.name}: {result.fit.leads}, leave-one-out"
    return chart(series, title, "measured level", "predicted level", log_x=True, log_y=True)


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
            help="Folder for lab-fit.toml, fit.json and fit.svg. Default: only print.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Judge the edge-level models with a lab's units, and fit them.

    Every model predicts each unit from all others, and so does the baseline, the means of four classes. The fewer
    units, the more the constants shrink towards the stored ones. `estimate --fit` and `build --fit` take lab-fit.toml.
    """

    loaded = load_fit_lab(lab)
    with progress("fit") as stage:
        result = fit_lab(loaded, stage)
        made = contents(result) if out is not None else {}
    if out is not None:
        files.replace_all(out, {name: text.encode() for name, text in made.items()}, FIT)
    if as_json:
        print_json({**as_data(result), **({"folder": str(out)} if out is not None else {})})
        return
    _print(result)
    if out is not None:
        typer.echo(str(out))


def _print(result: Fitted) -> None:
    screen, settings = console(), result.lab.settings
    screen.print(f"{settings.name}: {result.fit.units} units of its own, {settings.moduli} moduli", soft_wrap=True)
    if settings.note:
        screen.print(f"  {settings.note}", soft_wrap=True)
    for title, (head, *rows), remarks in sections(result):
        table = Table(Column(head[0], overflow="fold"), *head[1:], title=title)
        for cells in rows:
            table.add_row(*cells)
        screen.print(table)
        for remark in remarks:
            screen.print(f"  {remark}", soft_wrap=True)
