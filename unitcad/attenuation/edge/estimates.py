"""The estimate of one variant as JSON-ready data, and its answer: two lines that are always shown, and details.

The first line is a measurement of this very unit, if there is one, and the range by the model that leads
(`models.leader`). The second is the paper's analytic model from the unit's own moduli, with its error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from functools import lru_cache
from math import isfinite
from typing import Any

import numpy as np

from unitcad.attenuation.curve import layered_block
from unitcad.attenuation.edge.level import edge_level, model_block, range_notes, unknown
from unitcad.attenuation.edge.measured import (
    CLASSES,
    LENGTHS,
    Moduli,
    coordinates_of,
    differing,
    measured_block,
    measured_table,
    nearest,
    nominal,
    unit_class,
)
from unitcad.attenuation.edge.models import (
    BASELINE,
    MODELS,
    RANGE_PERCENT,
    RULE,
    Assessment,
    assessments,
    choice,
    in_order,
    leave_one_class_out,
    pairwise,
    rules,
)
from unitcad.attenuation.edge.ranges import LabFit, coverage, error_block, lead_of, own_block, predictive_of
from unitcad.attenuation.inputs import EstimateInput, Quantity
from unitcad.catalogue import measurements
from unitcad.text import join_words, number

PAPER = "the paper"
"""Who measured the catalogue's levels."""
QUASI_STATIC = "Moduli of a slow pull: all constants and errors are those of the nine units with such moduli."
SURFACE = (
    "The paper does not state on which surface or along which axis it measured; the rule is fitted to its levels as "
    "they are. published and corrected are the normal motion of the skin at the edge (|u_z|, equation 5b)."
)
ANALYTIC = ("published", "corrected")
_LEAST, _MOST = 1e-4, 2.0
"""Levels beyond these are not printed as numbers."""
_WIDEST = 100.0
"""Largest factor between the ends of a range at which a level is stated."""
SKIN_MM = (5, 10, 20)
"""Distances from the edge that the sentence on the skin names."""


def answer(
    variant: EstimateInput, estimated: dict[str, Any], levels: dict[str, Any], fit: LabFit | None
) -> dict[str, Any]:
    """Return the answer of an estimate (`estimates.estimate`) as data.

    `lines`: the two that lead, `headline` the first without its source; `details`: how sure they are.
    `level`: the headline's, measured or else `p50` (null if a modulus is known as a range only, or if the unit is
    `too_far` from the measured ones). `p10`, `p50` and `p90`: the leading model's median and 80 % range, fractions of
    the motor's amplitude. `analytic`: the levels of the paper's model.

    Errors are leave-one-out factors. `coverage`: how many of the nine measured units are in the range that was
    predicted without them. `class_mean` is the baseline.

    With a lab's fit `measured` and `nearest` are the lab's own; `elsewhere` is the paper's measurement of this unit.
    """
    table = measured_table(variant.moduli)
    lead, errors = lead_of(variant.moduli, fit), leave_one_out_errors(variant.moduli, fit)
    expected = predictive_of([variant], fit)
    low, middle, high = (float(end[0]) for end in expected.range)
    known, measured = bool(np.isfinite([low, middle, high]).all()), _measured(estimated, fit)
    far = known and not measured and (high > _WIDEST * low or high > _MOST)
    group = int(unit_class(nominal(variant))[0])
    stated = not far and levels[lead.model]["value"] is not None
    best = assessments(variant.moduli)[lead.model].leave_one_out
    behind = [unit.value for unit in fit.measured] if fit else []
    if fit is None or fit.include_paper_units:
        behind.append(float(table.levels.max()))
    data: dict[str, Any] = {
        "model": lead.model if known else None,
        "level": measured[0]["level"] if measured else middle if stated else None,
        "too_far": far,
        "p10": low if known else None,
        "p50": middle if known else None,
        "p90": high if known else None,
        "typical_error": errors[lead.model],
        "worst_error": None if fit else best.worst,
        "worst_at": None if fit else best.worst_at,
        "class": CLASSES[group],
        "class_mean": fit.model[BASELINE].constants[CLASSES[group]]
        if fit
        else float(np.exp(np.log(table.levels[table.classes == group]).mean())),
        "baseline_error": errors[BASELINE],
        "coverage": None if fit else coverage(variant.moduli),
        "measured": measured,
        "elsewhere": _of_paper(estimated) if fit else [],
        "nearest": _nearest(variant, fit),
        "highest": max(behind),
        "analytic": {name: {**levels[name], "leave_one_out": errors[name]} for name in ANALYTIC},
    }
    headline = _headline(data, levels, fit)
    return {
        **data,
        "headline": headline,
        "lines": [f"{headline}{_source(variant, estimated, data, fit)}", _second(data)],
        "details": list(_details(variant, estimated, data, levels, fit)),
    }


def leave_one_out_errors(moduli: Moduli = "small-strain", fit: LabFit | None = None) -> dict[str, float]:
    """Return each model's leave-one-out error, a factor: on the lab's own units, or on the paper's nine."""
    if fit:
        return {name: one.own_leave_one_out or one.leave_one_out for name, one in fit.model.items()}
    return {name: one.leave_one_out.geometric_mean for name, one in assessments(moduli).items()}


def percent(level: float) -> str:
    """Return a fraction in per cent, with two digits."""
    return f"{number(100 * level, 2, zeros=True)} %" if level >= _LEAST else f"below {100 * _LEAST:g} %"


def _range(low: float, high: float) -> str:
    """Return two fractions as a range in per cent; one number if both round to the same."""
    first, last = percent(low), percent(high) if high <= _MOST else f"over {percent(_MOST)}"
    return last if first == last else f"{first.removesuffix(' %')} to {last}"


def _measured(estimated: dict[str, Any], fit: LabFit | None) -> list[dict[str, Any]]:
    """Return the measurements of this very unit: the lab's own with a fit, else the paper's."""
    if fit is None:
        return _of_paper(estimated)
    return [
        {"level": one["value"], "low": one["low"], "high": one["high"], "by": one["unit"]}
        for one in estimated["own_measured"]
    ]


def _of_paper(estimated: dict[str, Any]) -> list[dict[str, Any]]:
    found = estimated["measured"] or {}
    if not found.get("same_size"):
        return []
    printed = [found[key] for key in ("level", "also_printed") if found.get(key) is not None]
    return [{"level": level, "low": None, "high": None, "by": PAPER} for level in printed]


def _nearest(variant: EstimateInput, fit: LabFit | None) -> dict[str, Any]:
    """Return the nearest measured unit as `measured.nearest` does; with a fit, of the lab's own ones."""
    found = nearest(variant)
    if fit is None:
        return found
    place = coordinates_of(variant)
    unit = min(fit.measured, key=lambda one: float(np.nansum((np.array(one.place) - place) ** 2)))
    apart = place - np.array(unit.place)
    silicones = ["silicones"] if not np.allclose(apart[LENGTHS:], 0.0) else []
    return {**found, "unit": unit.unit, "level": unit.value, "differs_in": [*silicones, *differing(apart)]}


def _headline(data: dict[str, Any], levels: dict[str, Any], fit: LabFit | None) -> str:
    """Return the measured or expected level, and the range, in words."""
    if data["p50"] is None:
        return f"Not known: {levels[RULE]['reason']}."
    where = "of the motor's amplitude at the edge"
    most = data["highest"]
    highest = "highest measured level" if fit else f"highest level that {PAPER} prints as a number"
    above = f" (above the {highest}, {percent(most)})" if data["p90"] > most else ""
    if data["too_far"]:
        ends = _range(data["p10"], data["p90"])
        return f"No level: this unit is too far from the measured ones (80 % range {ends} {where})."
    expect = f"Expect {_range(data['p10'], data['p90'])}"
    if data["measured"]:
        first = data["measured"][0]
        by = f"in {PAPER}" if first["by"] == PAPER else f"on {first['by']}"
        return f"{_spread(first)} {where} (measured {by}). {expect}{above}."
    if data["level"] is None:
        return f"{expect} {where}{above}; a modulus is known as a range only."
    return f"{percent(data['level'])} {where}. {expect}{above}."


def _source(variant: EstimateInput, estimated: dict[str, Any], data: dict[str, Any], fit: LabFit | None) -> str:
    """Say the source of the range, and which measured unit is nearest."""
    if data["p50"] is None:
        return ""
    if fit is None:
        what = "a rule fitted to nine measured levels; the paper states neither their surface nor axis"
    else:
        paper = " and the paper's nine" if fit.include_paper_units else ""
        what = f"{'a rule' if fit.leads == RULE else fit.leads} fitted to {fit.units} units of {fit.name}{paper}"
    new = " Three or more layers: not measured." if len(variant.layers) > 2 else ""
    near = data["nearest"]
    close = "" if data["measured"] else f" Nearest measured: {near['unit']}, {number(100 * near['level'], 3)} %."
    return f" By {what}.{new}{close}{''.join(f' {one}' for one in _besides(estimated['measured'] or {}))}"


def _besides(printed: dict[str, Any]) -> Iterator[str]:
    """Say which statements the paper makes on a unit that it gives no level for."""
    if printed.get("level") is not None:
        return
    if ratio := printed.get("over_a_control_not_named"):
        controls = [float(level) for level in measurements().controls.values()]
        ends = _range(ratio * min(controls), ratio * max(controls))
        yield f"The paper prints {number(100 * ratio, 4)} % of a control that it does not name for this unit: {ends}."
    if direction := printed.get("direction_stated"):
        yield f"The paper states of this unit: {direction}."


def _spread(one: dict[str, Any]) -> str:
    ends = f" ({number(100 * one['low'], 3)} to {number(100 * one['high'], 3)})" if one["low"] is not None else ""
    return f"{number(100 * one['level'], 2 if one['by'] == PAPER else 3)} %{ends}"


def _second(data: dict[str, Any]) -> str:
    """Say the paper's analytic model, from the unit's own moduli, and its error next to the baseline's."""
    published, corrected = (data["analytic"][name] for name in ANALYTIC)
    if published["low"] is None:
        return f"The paper's analytic model gives no number: {published['reason']}"
    most = data["highest"]
    above = (
        f", above every measured level ({percent(most)})" if max(published["high"], corrected["high"]) > most else ""
    )
    return (
        f"The paper's analytic model with this unit's moduli: {_level(published)} as published, {_level(corrected)} "
        f"corrected{above} (its path of u_z through the walls, scaled to the measured units). Leave-one-out error: "
        f"factor {number(published['leave_one_out'], 3, zeros=True)}; baseline, the means of four classes: "
        f"{number(data['baseline_error'], 3, zeros=True)}."
    )


def _level(level: dict[str, Any]) -> str:
    return percent(level["value"]) if level["value"] is not None else _range(level["low"], level["high"])


def _details(
    variant: EstimateInput,
    estimated: dict[str, Any],
    data: dict[str, Any],
    levels: dict[str, Any],
    fit: LabFit | None,
) -> Iterator[str]:
    """Say how sure the answer is: errors, unmeasured inputs, units that the models can't tell apart, the skin."""
    name, error = data["model"] or RULE, number(data["typical_error"], 3, zeros=True)
    worst = f", worst {number(data['worst_error'], 3, zeros=True)} ({data['worst_at']})" if data["worst_error"] else ""
    if name == RULE and fit is None:
        chosen = number(choice(variant.moduli).score.geometric_mean, 3, zeros=True)
        worst += f"; {chosen} if the form of the rule is chosen without the unit too"
    units = f"the units of {fit.name}" if fit else "the nine measured units"
    yield (
        f"Leave-one-out error of {name} on {units}: factor {error} typical{worst}; baseline: "
        f"{number(data['baseline_error'], 3, zeros=True)}. Leaving out a whole class costs more: see the table of "
        "classes."
    )
    if data["coverage"] is not None:
        knows = " The range above also uses this unit's own level, so it is narrower." if data["measured"] else ""
        yield f"Coverage of the 80 % range: {data['coverage']} of 9 measured units, each predicted without it.{knows}"
    middle, value = data["p50"], levels[name]["value"]
    if middle is not None and value is not None and percent(middle) != percent(value):
        yield (
            f"{name} gives {percent(value)}; the measured levels of units like this one move the middle of the range "
            f"to {percent(middle)}."
        )
    if data["elsewhere"]:
        yield f"{PAPER.capitalize()} measured {percent(data['elsewhere'][0]['level'])} for this unit, in its own lab."
    others = [f"{number(100 * one['level'], 3)} %" for one in data["measured"][1:]]
    if others:
        yield f"Also measured: {join_words(others)}."
    if differs := data["nearest"]["differs_in"]:
        yield (
            f"Nearest measured unit: {data['nearest']['unit']}, {number(100 * data['nearest']['level'], 3)} %. This "
            f"unit differs in {join_words(differs)}: the range is wider for it, by an assumed slope."
        )
    if unread := data["nearest"]["not_read"]:
        yield f"Not measured, and not in the range: {join_words(unread)}."
    if len(variant.layers) == 1:
        yield "The rule gives every one-material unit the same level; 39.5, 45.2 and 60.2 % were measured."
    yield SURFACE
    if fit is None and variant.moduli == "quasi-static":
        yield QUASI_STATIC
    for model, constant in estimated.get("fit", {}).get("at_bound", {}).items():
        yield f"{model}: the units of the fit do not determine {constant}."
    yield from _skin(estimated["layered"])


def _skin(layered: dict[str, Any]) -> Iterator[str]:
    """Say how the skin's motion decays beyond the edge."""
    drive = (layered.get("drives") or {}).get(layered.get("drive"))
    if drive is None:
        return
    places = [(r, layered["r_mm"].index(r)) for r in SKIN_MM if r in layered["r_mm"]]
    ends = {r: _range(drive["u"]["low"][i], drive["u"]["high"][i]).removesuffix(" %") for r, i in places}
    told = [f"{percent(drive['u']['value'][i])} ({ends[r]}) after {r} mm" for r, i in places]
    yield f"On the skin ({layered['tissue']}), of the motion at the edge: {join_words(told)}."
    if "far" in layered:
        yield layered["far"]


def summary(estimated: dict[str, Any]) -> dict[str, Any]:
    """Return an estimate for a table or a manifest: edge level and its geometric-mean error by model, measured.

    `measured` is that of this very unit. `model` is the one that leads, `lines` the two lines of the answer.
    """
    measured = estimated["measured"] or {}
    models = {
        name: {
            "edge": block["edge_level"].get("value"),
            "table_error": block["table_error"]["levels"]["geometric_mean"],
        }
        for name, block in estimated["models"].items()
    }
    return {
        "models": models,
        "model": estimated["answer"]["model"],
        "lines": estimated["answer"]["lines"],
        "measured": measured.get("level") if measured.get("same_size") else None,
        "frequency_hz": estimated["variant"]["frequency_hz"]["value"],
    }


SIGNIFICANT_DIGITS = 9
ASSUMPTIONS = [
    "A flat ERM's sideways force turns in the skin's plane. The layered curve takes it so (`layered.drives`); the "
    "models of the edge level do not use the direction of the force.",
    "The edge is the skin at r = D/2, z = 0; a level is an amplitude over the motor's. published and corrected are "
    "|u_z|; the rule is fitted to the paper's levels, whose surface and axis the paper does not state.",
    "Poisson's ratio and loss factor of the silicones are assumed, with ranges; nobody has measured them for this.",
    "No closed form contains the cavity's air, the circuit's stiffness, the bond or the motor's mass.",
]
TABLE_NOTE = (
    "nine measured levels; twelve ratios of six units to the controls of their own materials (eight of them "
    "independent); geometric-mean factor, 1 is exact; leave-one-out: each unit predicted by constants fitted without "
    "it; baseline: the mean of each of four classes; computed when this was made"
)
RANGE_NOTE = (
    "5 to 95 % of the score over units drawn again with replacement; with nine units it contains the score of new ones "
    "less often (docs/explanation/estimate.md has the share)"
)
P_NOTE = (
    "two-sided p of the mean difference of two models' leave-one-out errors, over all flips of the units' "
    "signs; not corrected for the number of pairs"
)
CHOICE_NOTE = (
    "the rule if its form is chosen without the unit too: each unit is predicted by the form that is best on the other "
    "units, with constants fitted without the unit"
)
CLASSES_NOTE = (
    "geometric-mean factor error of each class, predicted by constants fitted without the whole class; the baseline "
    "has no mean of that class, so it takes the mean of all others. Four classes are too few to calibrate a range"
)
SAME_P = 0.05
"""Largest sign-flip p at which the difference of two models is significant."""


Layered = Callable[[EstimateInput], dict[str, Any]]


def rounded_layered(variant: EstimateInput) -> dict[str, Any]:
    """Return the layered solver's block, numbers to nine digits."""
    return rounded(layered_block(variant))


def estimate(
    variant: EstimateInput,
    models: Sequence[str] = MODELS,
    layered: Layered = rounded_layered,
    fit: LabFit | None = None,
) -> dict[str, Any]:
    """Return {variant, answer, models, layered, measured, table_error, assumptions}; numbers to nine digits.

    `models` have a block each; the answer does not depend on them. With a lab's `fit` the constants are its own, each
    model has a predictive range, and the data have `fit` and `own_measured`. `layered` gives the layered solver's
    block, rounded; it reads no silicone: variants on one tissue share it. A quantity without a value is null, with
    a `reason`. Raises `Refusal` for impossible tissues.
    """
    errors = table_error(variant.moduli)
    blocks = {}
    for model in sorted(models, key=errors["order"].index):
        block = model_block(variant, model, fit)
        block["table_error"] = errors[model]
        if fit:
            block["fit_error"] = error_block(fit, model)
        blocks[model] = block
    data = {
        "variant": variant_block(variant),
        "models": blocks,
        "layered": layered(variant),
        "measured": measured_block(variant),
        "table_error": errors,
        "assumptions": [
            *ASSUMPTIONS,
            *(f"A range, not a value: {note}" for note in range_notes(variant)),
            *dict.fromkeys(  # known, but not at the motor's frequency
                f"{layer.material} youngs_modulus: {layer.youngs_modulus.note}"
                for layer in variant.layers
                if layer.youngs_modulus.note and layer.youngs_modulus.value is not None
            ),
        ],
    }
    if fit:
        data["table_error"] = errors | {"constants": "the stored ones, not this fit's; fit_error has the fit's own"}
        data |= {"fit": fit_block(fit, models), "own_measured": own_block(fit, variant)}
    levels = {name: edge_level(variant, name, fit) for name in MODELS}
    lead = answer(variant, data, levels, fit)
    whole = {"variant": data.pop("variant"), "answer": lead, **data}
    return rounded(whole)


def fit_block(fit: LabFit, models: Sequence[str]) -> dict[str, Any]:
    """Return a description of a fit, the model that leads by it, and the scores of models and baseline there."""
    scores = {name: fit.model[name] for name in (*models, BASELINE)}
    return {
        "name": fit.name,
        "leads": fit.leads,
        "own_units": fit.units,
        "include_paper_units": fit.include_paper_units,
        "moduli": fit.moduli,
        "leave_one_out": {
            name: {"geometric_mean": one.leave_one_out, "low": one.leave_one_out_low, "high": one.leave_one_out_high}
            for name, one in scores.items()
        },
        "at_bound": {name: one.at_bound for name, one in scores.items() if one.at_bound},
    }


def variant_block(variant: EstimateInput) -> dict[str, Any]:
    """Return the inputs as they were used, in the units of the spec."""
    return {
        "name": variant.name,
        "design": variant.design,
        "diameter_mm": variant.diameter * 1e3,
        "motor_diameter_mm": variant.motor_diameter * 1e3,
        "motor_drive": variant.drive,
        "frequency_hz": _quantity(variant.frequency, 1.0),
        "moduli": variant.moduli,
        "amplitude_um": None if variant.amplitude is None else variant.amplitude * 1e6,
        "tissue": variant.tissue_name,
        "layers": [
            {
                "material": layer.material,
                "wall_mm": layer.thickness * 1e3,
                "density_kg_m3": layer.density,
                "youngs_modulus_kpa": _quantity(layer.youngs_modulus, 1e-3),
                "poisson_ratio": _quantity(layer.poisson_ratio, 1.0),
                "loss_factor": _quantity(layer.tan_delta, 1.0),
            }
            for layer in variant.layers
        ],
        "not_known": unknown(variant) or None,
    }


@lru_cache
def table_error(moduli: Moduli = "small-strain") -> dict[str, Any]:
    """Return every model's errors against the measured table by such moduli, the baseline's too, to nine digits.

    `order`: by the leave-one-out error, the best first. `sign_flip`: p of each pair, the better one first.
    `chosen_without`: the rule's score when its form is chosen without the unit too.
    `leave_one_class_out`: the error of each class, by constants fitted without it.
    """
    found = assessments(moduli)
    order = in_order(found)
    by_model: dict[str, Any] = {name: assessment_block(found[name]) for name in order}
    best = {worse: p for better, worse, p in pairwise(found) if better == order[0]}
    for name in order:
        p = best.get(name)
        by_model[name]["against_best"] = {"model": order[0], "p": p, "significant": p is not None and p <= SAME_P}
    chosen = choice(moduli)
    table = {
        **by_model,
        "note": TABLE_NOTE + ("; by moduli of a slow pull" if moduli == "quasi-static" else ""),
        "moduli": moduli,
        "range": RANGE_NOTE,
        "order": order,
        "sign_flip": {
            "note": P_NOTE,
            "pairs": [{"better": better, "worse": worse, "p": p} for better, worse, p in pairwise(found)],
        },
        "chosen_without": {
            "note": CHOICE_NOTE,
            **asdict(chosen.score),
            "range": _ends_of(chosen.range),
            "forms": list(rules()),
            "chosen": list(chosen.chosen),
        },
        "leave_one_class_out": {"note": CLASSES_NOTE, "by_class": leave_one_class_out(moduli)},
    }
    return rounded(table)


def assessment_block(assessment: Assessment) -> dict[str, Any]:
    """Return an assessment as data."""
    return {
        "levels": asdict(assessment.levels),
        "ratios": asdict(assessment.ratios),
        "directions": {"right": assessment.directions, "of": assessment.ratios.count},
        "leave_one_out": {
            "levels": {**asdict(assessment.leave_one_out), "range": _ends_of(assessment.leave_one_out_range)},
            "ratios": asdict(assessment.leave_one_out_ratios) if assessment.leave_one_out_ratios else None,
        },
    }


def _ends_of(ends: tuple[float, float]) -> dict[str, Any]:
    return {"low": ends[0], "high": ends[1], "percent": list(RANGE_PERCENT)}


def _quantity(quantity: Quantity, factor: float) -> dict[str, Any]:
    scaled = {
        name: None if value is None else value * factor
        for name, value in (("value", quantity.value), ("low", quantity.low), ("high", quantity.high))
    }
    return {**scaled, **({"note": quantity.note} if quantity.note else {})}


def rounded(data: Any, digits: int = SIGNIFICANT_DIGITS) -> Any:
    """Return `data` with its floats to `digits` significant digits, and None for floats that are not finite.

    So the last bits of a platform do not show.
    """
    if isinstance(data, str):  # the most frequent
        return data
    if isinstance(data, float):
        return float(f"{data:.{digits}g}") if isfinite(data) else None
    if isinstance(data, dict):
        return {key: rounded(value, digits) for key, value in data.items()}
    if isinstance(data, (list, tuple)):  # a union would be made anew at each call
        return [rounded(value, digits) for value in data]
    return data
