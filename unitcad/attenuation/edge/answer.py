"""The answer of an estimate: two lines that are always shown, and the details that say how sure it is. Levels in %.

The first line is a measurement of this very unit, if there is one, and the range by the model that leads
(`models.leader`). The second is the paper's analytic model from the unit's own moduli, with its error.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from unitcad.attenuation.edge.lab_fit import LabFit
from unitcad.attenuation.edge.measured_levels import CLASSES, Moduli, measured_table, unit_class
from unitcad.attenuation.edge.models import BASELINE, RULE, assessments, choice
from unitcad.attenuation.edge.nearest import LENGTHS, coordinates_of, differing, nearest
from unitcad.attenuation.edge.ranges import held, lead_of, predictive_of
from unitcad.attenuation.edge.variant_units import nominal
from unitcad.attenuation.inputs import EstimateInput
from unitcad.catalogue import measurements
from unitcad.text import listed, number

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

    Errors are factors with the unit left out. `held`: how many of the nine measured units lay in the range that was
    predicted without them. `class_mean` is the baseline.

    With a lab's fit `measured` and `nearest` are the lab's own; `elsewhere` is the paper's measurement of this unit.
    """
    lead, errors = lead_of(variant.moduli, fit), left_out(variant.moduli, fit)
    expected = predictive_of([variant], fit)
    low, middle, high = (float(end[0]) for end in expected.range)
    known, measured = bool(np.isfinite([low, middle, high]).all()), _measured(estimated, fit)
    far = known and not measured and (high > _WIDEST * low or high > _MOST)
    group = int(unit_class(nominal(variant))[0])
    stated = not far and levels[lead.model]["value"] is not None
    best = assessments(variant.moduli)[lead.model].left_out
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
        "class_mean": _class_mean(variant, group, fit),
        "baseline_error": errors[BASELINE],
        "held": None if fit else held(variant.moduli),
        "measured": measured,
        "elsewhere": _of_paper(estimated) if fit else [],
        "nearest": _nearest(variant, fit),
        "highest": _highest(fit),
        "analytic": {name: {**levels[name], "left_out": errors[name]} for name in ANALYTIC},
    }
    headline = _headline(data, levels, fit)
    return {
        **data,
        "headline": headline,
        "lines": [f"{headline}{_source(variant, estimated, data, fit)}", _second(data)],
        "details": list(_details(variant, estimated, data, levels, fit)),
    }


def left_out(moduli: Moduli = "small-strain", fit: LabFit | None = None) -> dict[str, float]:
    """Return each model's typical factor with the unit left out: on the lab's own units, or on the paper's nine."""
    if fit:
        return {name: one.own_left_out or one.left_out for name, one in fit.model.items()}
    return {name: one.left_out.geometric_mean for name, one in assessments(moduli).items()}


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


def _class_mean(variant: EstimateInput, group: int, fit: LabFit | None) -> float:
    """Return the baseline: the mean of the unit's class, by a lab's fit or of the paper's units."""
    if fit:
        return fit.model[BASELINE].constants[CLASSES[group]]
    table = measured_table(variant.moduli)
    return float(np.exp(np.log(table.levels[table.classes == group]).mean()))


def _nearest(variant: EstimateInput, fit: LabFit | None) -> dict[str, Any]:
    """Return the nearest measured unit as `nearest.nearest` does; with a fit, of the lab's own ones."""
    found = nearest(variant)
    if fit is None:
        return found
    place = coordinates_of(variant)
    unit = min(fit.measured, key=lambda one: float(np.nansum((np.array(one.place) - place) ** 2)))
    apart = place - np.array(unit.place)
    silicones = ["silicones"] if not np.allclose(apart[LENGTHS:], 0.0) else []
    return {**found, "unit": unit.unit, "level": unit.value, "differs_in": [*silicones, *differing(apart)]}


def _highest(fit: LabFit | None) -> float:
    """Return the highest level behind the leading model."""
    paper = [float(measured_table().levels.max())] if fit is None or fit.include_paper_units else []
    return max([*paper, *(unit.value for unit in (fit.measured if fit else ()))])


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
        f"The paper's analytic model from this unit's moduli: {_level(published)} as published, {_level(corrected)} "
        f"corrected{above} (its path of u_z through the walls, scaled to the measured units). Typical error on "
        f"measured units left out: x {number(published['left_out'], 3, zeros=True)}; of four class means "
        f"x {number(data['baseline_error'], 3, zeros=True)}."
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
    worst = (
        f", worst x {number(data['worst_error'], 3, zeros=True)} ({data['worst_at']})" if data["worst_error"] else ""
    )
    if name == RULE and fit is None:
        chosen = number(choice(variant.moduli).score.geometric_mean, 3, zeros=True)
        worst += f"; x {chosen} if its form is chosen without the unit too"
    units = f"the units of {fit.name}" if fit else "the nine measured units"
    yield (
        f"Error of {name} on {units}, each left out: x {error} typical{worst}; four class means: x "
        f"{number(data['baseline_error'], 3, zeros=True)}. Leaving out a whole class costs more: see the table of "
        "classes."
    )
    if data["held"] is not None:
        knows = " The range above knows this unit's own level, so it is narrower." if data["measured"] else ""
        yield f"80 % range: it held {data['held']} of the nine measured units, each predicted without it.{knows}"
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
        yield f"Also measured: {listed(others)}."
    if differs := data["nearest"]["differs_in"]:
        yield (
            f"Nearest measured unit: {data['nearest']['unit']}, {number(100 * data['nearest']['level'], 3)} %. This "
            f"unit differs in {listed(differs)}: the range is wider for it, by an assumed slope."
        )
    if unread := data["nearest"]["not_read"]:
        yield f"Not measured, and not in the range: {listed(unread)}."
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
    yield f"On the skin ({layered['tissue']}), of the motion at the edge: {listed(told)}."
    if "far" in layered:
        yield layered["far"]
