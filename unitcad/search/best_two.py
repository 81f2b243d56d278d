"""What would decide between the best two: their measurements, or the ranking's models and these held to the levels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import stdtr, stdtrit

from unitcad.attenuation.edge.predictive import Predictive, stack_of
from unitcad.attenuation.edge.variant_units import stacked
from unitcad.errors import Refusal
from unitcad.estimating import estimate_input
from unitcad.experiments.most_telling import SURE, Decision, decision_between
from unitcad.search.ranking_order import ALIKE
from unitcad.search.target_file import Target
from unitcad.spec import Spec
from unitcad.text import listed, number

_SAME_LEVEL = 0.05
"""Levels whose expected ratio is nearer to one are the same for a purpose: half of a reading's own noise of 10 %."""
_OPEN = 0.05
"""A probability this near to one half tells no order."""
_POINTS = 400


def best_two(target: Target, specs: Sequence[Spec], data: Sequence[dict[str, Any]]) -> tuple[str | None, Any]:
    """Return the sentence on what would decide between the first two proposals, and the figures behind it.

    None where there are not two. Their models and weights are the ranking's. Where both were measured in one lab, the
    sentence follows the measurements.
    """
    if len(specs) < 2:
        return None, None
    stack = stack_of(target.models, target.fit, target.asked.estimate.moduli)
    weights = {model: float(weight) for model, weight in zip(stack.models, stack.weights, strict=True)}
    names = [one["name"] for one in data[:2]]
    try:
        decision = decision_between(dict(zip(names, specs[:2], strict=True)), weights, fit=target.fit)
    except Refusal as refusal:
        return f"No measurement is named between the best two: {refusal.limit}.", None
    below = below_by_ranking([stack.predictive(stacked([estimate_input(spec)])) for spec in specs[:2]])
    figures = {
        "measure": str(decision.ratio),
        "predicted": decision.predicted,
        "weights": weights,
        "first_below_by_ranking": below,
        "first_below": 1.0 - decision.first_higher,
        "bits": decision.order.bits,
        "error": decision.order.error,
        "open_bits": decision.open_bits,
    }
    by_measurement = _by_measurement(below, data[:2])
    return " ".join([*_measured(data[:2]), by_measurement or _sentence(target, decision, below, data[:2])]), figures


def below_by_ranking(both: Sequence[Predictive]) -> float:
    """Return the probability that the first unit's level is the lower one, each model missing the two independently."""

    first, second = both
    shares = (np.arange(_POINTS) + 0.5) / _POINTS
    each = [
        np.mean(stdtr(df, (second.centre[0, k] - first.centre[0, k] + second.scale[0, k] * t) / first.scale[0, k]))
        for k, df in enumerate(first.degrees_of_freedom)
        for t in [stdtrit(df, shares)]
    ]
    return float(np.array(each) @ first.weights)


def _measured(data: Sequence[dict[str, Any]]) -> list[str]:
    measured = [one["measured"] for one in data]
    if not all(measured):
        return []
    printed = [listed([percent(level) for level in _levels(one)]) for one in measured]
    if _one_unit(data):
        return [f"One unit of this silicone was measured, {printed[0]}, once; of which of the two designs is not said."]
    return [f"The two best were measured, #1 printed as {printed[0]}, #2 as {printed[1]}, each unit once."]


def _levels(measured: Mapping[str, Any]) -> list[float]:
    return [level for level in (measured["level"], measured.get("also")) if level]


def _by_paper(one: Mapping[str, Any]) -> bool:
    return bool(one["measured"]["by"].startswith("the paper"))


def _one_unit(data: Sequence[Mapping[str, Any]]) -> bool:
    """Tell whether the measurements of two proposals are one control's, whose design the paper does not say."""
    one_silicone = all(len(one["materials"]) == 1 for one in data) and data[0]["materials"] == data[1]["materials"]
    return one_silicone and all(map(_by_paper, data))


def _by_measurement(below: float, data: Sequence[dict[str, Any]]) -> str | None:
    """Return the order by the measurements of both, beside what the ranking expects; None where they tell none.

    Levels of two labs are not compared.
    """
    if not all(one["measured"] for one in data) or _one_unit(data) or _by_paper(data[0]) != _by_paper(data[1]):
        return None
    first, second = (_levels(one["measured"]) for one in data)
    if max(first) >= min(second) and max(second) >= min(first):
        side, ranked = ("below", below) if below >= 0.5 else ("above", 1.0 - below)
        return (
            "These levels leave the order of the two open; "
            f"the ranking expects #1 {side} #2 ({100 * ranked:.0f} %). Cast and measure both."
        )
    lower, share = (1, below) if max(first) < min(second) else (2, 1.0 - below)
    measured = f"By its measurement #{lower} is the lower"
    if share >= 0.5:
        return f"{measured}, as the ranking expects ({100 * share:.0f} %)."
    return (
        f"{measured}; the ranking, which has the models alone, expects the reverse ({100 * (1.0 - share):.0f} %). "
        "To be sure of the order cast and measure both again."
    )


def percent(level: float) -> str:
    """Return a measured level in per cent as it is printed, to three digits."""
    return f"{number(100 * level, 3)} %"


def _sentence(target: Target, decision: Decision, below: float, data: Sequence[dict[str, Any]]) -> str:
    ratios = [float(span["middle"]) for span in decision.predicted.values()]
    near = max(abs(float(np.log(ratio))) for ratio in ratios) < _SAME_LEVEL
    if near and abs(data[0]["probability"] - data[1]["probability"]) <= ALIKE:
        span = f"{number(min(ratios), 3)} to {number(max(ratios), 3)}"
        return (
            f"#1 and #2 are the same for your purpose: their levels' ratio is {span} by these models. {_faster(data)}"
        )
    side = "below" if below >= 0.5 else "above"
    ranked = below if below >= 0.5 else 1.0 - below
    held = 1.0 - decision.first_higher if side == "below" else decision.first_higher
    how = "with the constants of your lab" if target.fit else "held to the measured levels of their kinds"
    expects = f"The ranking expects #1 {side} #2 ({100 * ranked:.0f} %)"
    if abs(held - 0.5) < _OPEN:
        return f"{expects}; the same models {how} can't tell ({_sure(held)}): the order is open. Cast and measure both."
    if held < 0.5:
        share = _sure(1.0 - held)
        return (
            f"{expects}; the same models {how} expect the reverse ({share}): the order is open. Cast and measure both."
        )
    if held >= SURE:
        return f"{expects}, and so do the same models {how} ({_sure(held)}): no measurement is needed to order the two."
    return f"{expects}, and so do the same models {how} ({_sure(held)}). To be sure of the order cast and measure both."


def _sure(share: float) -> str:
    return "more than 99 %" if share > 0.995 else f"{100 * share:.0f} %"


def _faster(data: Sequence[dict[str, Any]]) -> str:
    hours = [one["cure_hours"] for one in data]
    first, second = (number(each, 3) for each in hours)
    if first == second:
        return f"Both are out of the mould in {first} h."
    quick = int(hours[1] < hours[0])
    return f"Take the faster, #{1 + quick}: {(first, second)[quick]} h against {(second, first)[quick]} h."
