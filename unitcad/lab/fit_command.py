"""unitcad fit: lab-fit.toml, fit.json and fit.svg, and the check of a contribution. The same input, the same bytes."""

from __future__ import annotations

import json
import sys
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
from unitcad.attenuation.edge.words import spread
from unitcad.cli.output import print_json, progress, warn
from unitcad.cli.shared_options import AsJson
from unitcad.cli.tables import console
from unitcad.errors import Refusal
from unitcad.export.chart import Series, chart
from unitcad.json_text import rounded
from unitcad.lab import contribution
from unitcad.lab.contribution import lacks
from unitcad.lab.fitting import FitLab, Fitted, fit_lab, load_fit_lab
from unitcad.lab.random_effects import Effect
from unitcad.spec.convert import without_none
from unitcad.spec.toml import text_of
from unitcad.text import join_words, number

FIT = "lab-fit.toml"
DIFFERING = (
    "Level by each model, fitted without the unit, and the factor between the highest and the lowest. "
    "A second cast of these units decides most."
)
EFFECTS = (
    "Factors on the level by the model that leads: of a lab over this lab's, of a batch over the mean batch's, and the "
    "scatter between labs, batches and units, one standard deviation."
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
        "effects": effect_rows(result),
        "prior": prior_text(result),
        "warnings": warnings(result),
    }


def unit_rows(result: Fitted) -> list[dict[str, Any]]:
    """Return each unit's measured level and the leading model's prediction without it."""
    name, table = result.fit.leads, result.campaigns.table
    judged = result.judged[name]
    rows = []
    for i, unit in enumerate(table.names):
        low, high = map(float, quantiles(int(judged.df[i]), judged.centre[i], judged.scale[i]))
        numbers = {"predicted": float(np.exp(judged.centre[i])), "p10": low, "p90": high}
        lab = result.lab.labs[result.campaigns.lab[i]]
        row = {
            "unit": unit,
            "lab": lab,
            "own": bool(judged.own[i]),
            "measured": float(table.levels[i]),
            "model": name,
            **numbers,
        }
        rows.append(rounded(row, 6))
    return rows


def differing_units(result: Fitted) -> list[dict[str, Any]]:
    """Return the lab's own units with the level by each model, fitted without the unit, and the extremes' factor.

    The unit on which the models differ most comes first.
    """
    judged = {name: one for name, one in result.judged.items() if name != BASELINE}
    own = next(iter(judged.values())).own
    rows = []
    measured = [unit for unit in result.lab.units if unit.lab is None]
    for i, unit in zip(np.flatnonzero(own), measured, strict=True):
        levels = {name: float(np.exp(one.centre[i])) for name, one in judged.items()}
        factor = max(levels.values()) / min(levels.values())
        rows.append(rounded({"unit": unit.name, "levels": levels, "factor": factor, "measured": unit.level.value}, 6))
    return sorted(rows, key=lambda row: -row["factor"])


def prior_text(result: Fitted) -> str:
    """State how the units of several labs count."""
    settings = result.lab.settings
    if len(set(result.campaigns.lab)) < 2:
        return "Only the lab's own units count."
    return (
        f"Labs share the model's constants; each lab's factor on the level is fitted. Expected before the levels are "
        f"read: labs scatter by {settings.between_labs:g} times the scatter of units, batches by "
        f"{settings.between_batches:g} times (between_labs and between_batches: assumed)."
    )


def effect_rows(result: Fitted) -> list[dict[str, Any]]:
    """Return the factors of labs and batches on the level by the model that leads, with 90 % ranges, and the scatter.

    A lab's is over this lab's, a batch's over the mean batch's. A scatter is a factor too: exp of a standard deviation.
    """
    found, labs, batches = result.leading, result.lab.labs, result.lab.batches
    rows = [("lab", labs[i], one) for i, one in found.labs.items()]
    for i, one in found.batches.items():
        lab, name = batches[i]
        rows.append(("batch", f"{lab}, {name}" if lab else name, one))
    rows += [
        ("scatter", f"between {kind}", Effect(*(float(np.exp(getattr(one, end))) for end in ("value", "low", "high"))))
        for kind, one in found.scatter.items()
    ]
    return [
        rounded({"kind": kind, "name": name, "factor": one.value, "low": one.low, "high": one.high}, 4)
        for kind, name, one in rows
    ]


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
    if not result.fit.units:
        return f"{lead} leads, as without units of the lab's own: its level is that of a lab that nobody measured."
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
    units = [["unit", "lab", "measured", "predicted", "P10", "P90"]]
    for row in unit_rows(result):
        numbers = (f"{row[key]:.3g}" for key in ("measured", "predicted", "p10", "p90"))
        units.append([row["unit"], "own" if row["own"] else row["lab"], *numbers])
    effects = [["factor", "value", "90 %"]]
    for row in effect_rows(result):
        name = row["name"] if row["kind"] == "scatter" else f"{row['kind']} {row['name']}"
        effects.append([name, f"x {row['factor']:.2f}", f"{row['low']:.2f} to {row['high']:.2f}"])
    rows = differing_units(result)[:_MOST_DIFFERING]
    differing = [["unit", *(name for name in result.judged if name != BASELINE), "factor"]]
    for row in rows:
        differing.append([row["unit"], *(f"{level:.2g}" for level in row["levels"].values()), f"x {row['factor']:.2f}"])
    last = [("Units on which the models differ most", differing, [DIFFERING])] if rows else []
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
        ("Labs and batches", effects, [EFFECTS]),
        *last,
    ]


def _chart(result: Fitted) -> str:
    rows = unit_rows(result)
    series = []
    for label, own in (("units of other labs", False), ("the lab's own", True)):
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
    check: Annotated[
        bool,
        typer.Option(
            "--check", help="Only check the file as a contribution: what it lacks for others to use its units."
        ),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Judge the edge-level models with a lab's units, and fit them.

    Every model predicts each unit from all others, and so does the baseline, the means of four classes. Labs share a
    model's constants, and each has a factor on the level. `estimate --fit` and `build --fit` take lab-fit.toml.
    """

    if check:
        if out is not None:
            raise Refusal("--check", str(out), "writes nothing: leave out --out")
        with progress("check"):
            loaded = load_fit_lab(lab)
        _print_check(loaded, as_json)
        return
    with progress("fit") as stage:
        result = fit_lab(load_fit_lab(lab), stage)
        made = contents(result) if out is not None else {}
    if out is not None:
        files.replace_all(out, {name: text.encode() for name, text in made.items()}, FIT)
    if as_json:
        print_json({**as_data(result), **({"folder": str(out)} if out is not None else {})})
        return
    _print(result)
    if out is not None:
        typer.echo(str(out))


def _print_check(loaded: FitLab, as_json: bool) -> None:
    """Print each unit and everything that the file lacks as a contribution; exit 1 if it lacks anything."""
    found, rows = lacks(loaded), contribution.unit_rows(loaded)
    if as_json:
        data = [{"where": one.where, "message": one.message} for one in found]
        print_json({"name": loaded.settings.name, "complete": not found, "units": rows, "lacks": data})
    else:
        for row in rows:
            ends = "" if row["low"] is None else f" ({number(100 * row['low'], 3)} to {number(100 * row['high'], 3)})"
            level = f"{number(100 * row['level'], 3)} %{ends} of the motor's amplitude at {row['frequency_hz']:.1f} Hz"
            typer.echo(f"{row['unit']}: {level}; {row['source']}{_expected(row)}")
        for one in found:
            warn(f"{one.where}: {one.message}")
        count = f"{len(rows)} unit{'s' if len(rows) > 1 else ''}"
        off = [row["unit"] for row in rows if row["far"]]
        look = f"; look at the level of {join_words(off)}" if off else ""
        typer.echo(
            f"{count}: {'every field is there' if off else 'nothing is missing'}{look}"
            if not found
            else f"{count}; {len(found)} to settle{look}"
        )
    if found:
        sys.exit(1)


def _expected(row: dict[str, Any]) -> str:
    """Return the rule's range for a unit, and whether its level is far off."""
    if row["expected_low"] is None:
        return ""
    far = ", far from this level: check the motor's amplitude and the units" if row["far"] else ""
    return f"; the rule expects {spread(row['expected_low'], row['expected_high'])}{far}"


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
