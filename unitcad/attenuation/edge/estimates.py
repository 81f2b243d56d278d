"""The estimate of one variant as JSON-ready data: models, layered curve, measured values, errors, assumptions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict
from functools import lru_cache
from math import isfinite
from typing import Any

from msgspec.structs import replace

from unitcad.attenuation.curve import decay_at, layered_block
from unitcad.attenuation.edge.answer import answer
from unitcad.attenuation.edge.lab_fit import LabFit, error_block, own_block
from unitcad.attenuation.edge.level import edge_level, model_block, ranged, unknown
from unitcad.attenuation.edge.measured_levels import Moduli
from unitcad.attenuation.edge.models import (
    BASELINE,
    MODELS,
    assessments,
    choice,
    classes_out,
    in_order,
    pairwise,
    rules,
)
from unitcad.attenuation.edge.nearest import measured_block
from unitcad.attenuation.edge.scores import RANGE_PERCENT, Assessment
from unitcad.attenuation.inputs import EstimateInput, Quantity

SIGNIFICANT_DIGITS = 9
ASSUMPTIONS = [
    "A flat ERM's sideways force turns in the skin's plane. The layered curve takes it so (`layered.drives`); the "
    "models of the edge level know no direction of the force.",
    "The edge is the skin at r = D/2, z = 0; a level is an amplitude over the motor's. published and corrected are "
    "|u_z|; the paper states neither surface nor axis of what it measured, to which the rule is fitted.",
    "Poisson's ratio and loss factor of the silicones are assumed, with ranges; nobody has measured them for this.",
    "The cavity's air, the circuit's stiffness, the bond and the motor's mass are in none of the closed forms.",
]
TABLE_NOTE = (
    "nine measured levels; twelve ratios of six units to the controls of their own materials (eight of them "
    "independent); geometric-mean factor, 1 is exact; left out: each unit predicted by constants fitted without it; "
    "baseline: the mean of each of four classes; computed when this was made"
)
RANGE_NOTE = (
    "5 to 95 % of the score over units drawn again with replacement; of nine units it holds the score of new ones less "
    "often than that (docs/explanation/estimate.md has the share)"
)
P_NOTE = (
    "two-sided p of the mean difference of two models' errors with the unit left out, over all flips of the units' "
    "signs; not corrected for the number of pairs"
)
CHOICE_NOTE = (
    "the rule when its form, n and what counts, is chosen without the unit too: each unit predicted by the form that "
    "is best on the other units, its constants fitted without the unit"
)
CLASSES_NOTE = (
    "geometric-mean factor error of each class, predicted by constants fitted without the whole class; the baseline, "
    "which has no mean of it, takes that of all others. Four classes calibrate nothing"
)
SAME_P = 0.05
"""Two models whose sign-flip p is above it are not told apart."""
DECAY_AT_MM = (5.0, 10.0, 20.0, 30.0)


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
    block, rounded; it reads no silicone: variants on one body share it. A quantity that can't be given is null next to
    a `reason`. Raises `Refusal` for values that no body has.
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
            *(f"A range, not a value: {note}" for note in ranged(variant)),
            *dict.fromkeys(_noted(variant)),
        ],
    }
    if fit:
        data["table_error"] = errors | {"constants": "the stored ones, not this fit's; fit_error has the fit's own"}
        data |= {"fit": fit_block(fit, models), "own_measured": own_block(fit, variant)}
    levels = {name: edge_level(variant, name, fit) for name in MODELS}
    lead = answer(variant, data, levels, fit)
    whole = {"variant": data.pop("variant"), "answer": lead, **data}
    # The solver's block and every table_error are rounded already.
    models_rounded = {
        model: {key: part if key == "table_error" else rounded(part) for key, part in block.items()}
        for model, block in blocks.items()
    }
    done = {"models": models_rounded, "layered": data["layered"], "table_error": data["table_error"]}
    return {name: done[name] if name in done else rounded(block) for name, block in whole.items()}


def fit_block(fit: LabFit, models: Sequence[str]) -> dict[str, Any]:
    """Return a description of a fit, the model that leads by it, and the scores of models and baseline there."""
    scores = {name: fit.model[name] for name in (*models, BASELINE)}
    return {
        "name": fit.name,
        "leads": fit.leads,
        "own_units": fit.units,
        "include_paper_units": fit.include_paper_units,
        "moduli": fit.moduli,
        "left_out": {
            name: {"geometric_mean": one.left_out, "low": one.left_out_low, "high": one.left_out_high}
            for name, one in scores.items()
        },
        "at_bound": {name: one.at_bound for name, one in scores.items() if one.at_bound},
    }


def frequency_table(
    variant: EstimateInput,
    frequencies: Sequence[float],
    models: Sequence[str] = MODELS,
    fit: LabFit | None = None,
) -> dict[str, Any]:
    """Return {variant, frequencies}: per frequency (Hz) each model's edge level and the decay at `DECAY_AT_MM`.

    `flat_over_edge`, `axial_over_edge`: of |u| under either drive; `u_over_edge`: under the motor's;
    `u_z_over_edge`: of |u_z| under an axial one.
    """
    rows, places = [], [f"at_{d:g}_mm" for d in DECAY_AT_MM]
    models = sorted(models, key=in_order(assessments(variant.moduli)).index)
    for hertz in frequencies:
        at = replace(variant, frequency=Quantity(hertz))
        decays = decay_at(at, hertz, DECAY_AT_MM)
        rows.append(
            {
                "frequency_hz": hertz,
                "edge_level": {model: model_block(at, model, fit)["edge_level"] for model in models},
                **{f"{name}_over_edge": dict(zip(places, decay, strict=True)) for name, decay in decays.items()},
            }
        )
    block = variant_block(variant)
    value = frequencies[0] if len(frequencies) == 1 else None
    block["frequency_hz"] = {"value": value, "low": min(frequencies), "high": max(frequencies)}
    return rounded({"variant": block, "frequencies": rows, "assumptions": ASSUMPTIONS})


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

    `order`: by the score with a unit left out, the best first. `sign_flip`: p of each pair, the better one first.
    `chosen_without`: the rule's score when its form is chosen without the unit too. `classes_out`: by class left out.
    """
    found = assessments(moduli)
    order = in_order(found)
    by_model: dict[str, Any] = {name: assessment_block(found[name]) for name in order}
    best = {worse: p for better, worse, p in pairwise(found) if better == order[0]}
    for name in order:
        p = best.get(name)
        by_model[name]["against_best"] = {"model": order[0], "p": p, "told_apart": p is not None and p <= SAME_P}
    chosen = choice(moduli)
    table = {
        **by_model,
        "what": TABLE_NOTE + ("; by moduli of a slow pull" if moduli == "quasi-static" else ""),
        "moduli": moduli,
        "range": RANGE_NOTE,
        "order": order,
        "sign_flip": {
            "what": P_NOTE,
            "pairs": [{"better": better, "worse": worse, "p": p} for better, worse, p in pairwise(found)],
        },
        "chosen_without": {
            "what": CHOICE_NOTE,
            **asdict(chosen.score),
            "range": _range(chosen.range),
            "forms": list(rules()),
            "chosen": list(chosen.chosen),
        },
        "classes_out": {"what": CLASSES_NOTE, "by_class": classes_out(moduli)},
    }
    return rounded(table)


def assessment_block(assessment: Assessment) -> dict[str, Any]:
    """Return an assessment as data."""
    return {
        "levels": asdict(assessment.levels),
        "ratios": asdict(assessment.ratios),
        "directions": {"right": assessment.directions, "of": assessment.ratios.count},
        "leave_one_unit_out": {
            "levels": {**asdict(assessment.left_out), "range": _range(assessment.left_out_range)},
            "ratios": asdict(assessment.left_out_ratios) if assessment.left_out_ratios else None,
        },
    }


def _noted(variant: EstimateInput) -> list[str]:
    """Return notes on moduli that are known but not at the motor's frequency."""
    moduli = [(layer.material, layer.youngs_modulus) for layer in variant.layers]
    return [f"{name} youngs_modulus: {one.note}" for name, one in moduli if one.note and one.value is not None]


def _range(ends: tuple[float, float]) -> dict[str, Any]:
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
