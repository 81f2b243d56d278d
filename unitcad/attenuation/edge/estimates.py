"""The estimate of one variant as JSON-ready data: the answer and its sentences, every model, the skin, the scores."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import msgspec

from unitcad.attenuation.curve import layered_block
from unitcad.attenuation.edge.answer import Answer, answer
from unitcad.attenuation.edge.level import model_block, range_notes, unknown
from unitcad.attenuation.edge.measured import Moduli, measured_block
from unitcad.attenuation.edge.models import BASELINE, MODELS
from unitcad.attenuation.edge.ranges import LabFit, error_block, own_block
from unitcad.attenuation.edge.scores import Range, scores
from unitcad.attenuation.edge.words import details, first_line, lines, skin_lines
from unitcad.attenuation.inputs import EstimateInput, Quantity
from unitcad.json_text import rounded

ASSUMPTIONS = [
    "A flat ERM's sideways force turns in the skin's plane. The layered curve takes it so (`layered.drives`); the "
    "models of the edge level do not use the direction of the force.",
    "The edge is the skin at r = D/2, z = 0; a level is an amplitude over the motor's. published and corrected are "
    "|u_z|; the rule is fitted to the paper's levels, whose surface and axis the paper does not state.",
    "Poisson's ratio and loss factor of the silicones are assumed, with ranges; nobody has measured them for this.",
    "No closed form contains the cavity's air, the circuit's stiffness, the bond or the motor's mass.",
]
QUASI_STATIC = "The moduli are those of slow pulls: constants and errors of the analytic model are by such moduli."
TABLE_NOTE = (
    "nine measured levels; twelve ratios of six units to the controls of their own materials (eight of them "
    "independent); geometric-mean factor, 1 is exact; leave-one-out: each unit predicted by constants fitted without "
    "it; baseline: the mean of each of four classes"
)
RANGE_NOTE = (
    "5 to 95 % of the score over units drawn again with replacement; with nine units it contains the score of new ones "
    "less often (docs/explanation/estimate.md has the share)"
)
CHOICE_NOTE = (
    "the rule if its form is chosen without the unit too: each unit is predicted by the form that is best on the other "
    "units, with constants fitted without the unit"
)
CLASSES_NOTE = (
    "geometric-mean factor error of each class, predicted by constants fitted without the whole class; the baseline "
    "has no mean of that class, so it takes the mean of all others. Four classes are too few to calibrate a range"
)

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

    `answer` has the fields of `answer.Answer`, and its sentences as `lines` and `details`. `models` have a block each;
    the answer does not depend on them. With a lab's `fit` the constants are its own, each model has a predictive range,
    and the data have `fit` and `own_measured`. `layered` gives the layered solver's block, rounded; it reads no
    silicone: variants on one tissue share it. A quantity without a value is null, with a `reason`. Raises `Refusal` for
    impossible tissues.
    """
    errors = table_error(variant.moduli)
    blocks = {}
    for model in sorted(models, key=errors["order"].index):
        block = model_block(variant, model, fit)
        block["table_error"] = errors[model]
        if fit:
            block["fit_error"] = error_block(fit, model)
        blocks[model] = block
    skin = layered(variant)
    data = {
        "variant": variant_block(variant),
        "answer": answer_block(answer(variant, fit), variant, skin, fit),
        "models": blocks,
        "layered": skin,
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
    return rounded(data)


def answer_block(
    one: Answer, variant: EstimateInput, layered: dict[str, Any], fit: LabFit | None = None
) -> dict[str, Any]:
    """Return an answer as data, with its sentences: `line` alone says the level, `lines` lead, `details` follow."""
    bounds = {name: model.at_bound for name, model in (fit.model if fit else {}).items() if model.at_bound}
    slow = [QUASI_STATIC] if variant.moduli == "quasi-static" and fit is None else []
    told = details(one, len(variant.layers), variant.moduli, bounds)
    return {
        **msgspec.to_builtins(one),
        "line": first_line(one),
        "lines": lines(one),
        "details": [*told, *slow, *skin_lines(layered)],
    }


def summary(estimated: dict[str, Any]) -> dict[str, Any]:
    """Return an estimate for a table or a manifest: level, range, the measurement of this unit, and the one line."""
    one = estimated["answer"]
    return {
        "level": one["level"],
        "low": one["low"],
        "high": one["high"],
        "measured": one["measured"][0]["level"] if one["measured"] else None,
        "line": one["line"],
        "frequency_hz": estimated["variant"]["frequency_hz"]["value"],
    }


def fit_block(fit: LabFit, models: Sequence[str]) -> dict[str, Any]:
    """Return a description of a fit, the model that leads by it, and the scores of models and baseline there."""
    scores = {name: fit.model[name] for name in (*models, BASELINE)}
    return {
        "name": fit.name,
        "leads": fit.leads,
        "own_units": fit.units,
        "units_of_other_labs": len(fit.measured) - fit.units,
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
    """Return every model's errors against the measured table by such moduli, the baseline's too (`scores`).

    `order`: by the leave-one-out error, the best first. `chosen_without`: the rule's score if its form is chosen
    without the unit too. `leave_one_class_out`: the error of each class, by constants fitted without it.
    """
    known = scores(moduli)

    def ends(of: Range) -> dict[str, Any]:
        return {"low": of.low, "high": of.high, "percent": list(known.percent)}

    plain = msgspec.to_builtins
    return {
        **{
            name: {
                "levels": plain(one.levels),
                "ratios": plain(one.ratios),
                "directions": {"right": one.directions, "of": one.ratios.count},
                "leave_one_out": {
                    "levels": {**plain(one.leave_one_out), "range": ends(one.leave_one_out_range)},
                    "ratios": plain(one.leave_one_out_ratios),
                },
            }
            for name in known.order
            for one in [known.models[name]]
        },
        "note": TABLE_NOTE + ("; by moduli of a slow pull" if moduli == "quasi-static" else ""),
        "moduli": moduli,
        "range": RANGE_NOTE,
        "order": known.order,
        "chosen_without": {
            "note": CHOICE_NOTE,
            **plain(known.chosen_without.score),
            "range": ends(known.chosen_without.range),
            "forms": known.chosen_without.forms,
            "chosen": known.chosen_without.chosen,
        },
        "leave_one_class_out": {"note": CLASSES_NOTE, "by_class": known.by_class},
    }


def _quantity(quantity: Quantity, factor: float) -> dict[str, Any]:
    scaled = {
        name: None if value is None else value * factor
        for name, value in (("value", quantity.value), ("low", quantity.low), ("high", quantity.high))
    }
    return {**scaled, **({"note": quantity.note} if quantity.note else {})}
