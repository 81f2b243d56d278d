"""Which of the best two proposals has the lower level: by their measurements, or as the ranking's models expect."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import stdtr, stdtrit

from unitcad.attenuation.edge.predictive import Predictive, stack_of
from unitcad.attenuation.edge.variant_units import stacked
from unitcad.estimating import estimate_input
from unitcad.search.ranking_order import ALIKE
from unitcad.search.target_file import Target
from unitcad.spec import Spec
from unitcad.text import listed, number

_SAME_LEVEL = 0.05
"""Levels whose expected ratio is nearer to one are the same for a purpose: half of a reading's own noise of 10 %."""
_OPEN, _SURE = 0.55, 0.99
"""Below the first probability the order of two levels is open; from the second on no measurement is needed for it."""
_POINTS = 400


def best_two(target: Target, specs: Sequence[Spec], data: Sequence[dict[str, Any]]) -> tuple[str | None, Any]:
    """Return the sentence on the order of the first two proposals' levels, and the figures behind it.

    None if there are not two. If one lab measured both, the sentence follows the measurements.
    """
    if len(specs) < 2:
        return None, None
    stack = stack_of(target.models, target.fit, target.asked.estimate.moduli)
    both = [stack.predictive(stacked([estimate_input(spec)])) for spec in specs[:2]]
    ratios = np.exp(both[0].centre[0] - both[1].centre[0])
    below = below_by_ranking(both)
    figures = {
        "ratios": dict(zip(stack.models, map(float, ratios), strict=True)),
        "weights": dict(zip(stack.models, map(float, stack.weights), strict=True)),
        "first_below": below,
    }
    ratio = float(np.exp(stack.weights @ np.log(ratios)))
    said = _by_measurement(below, data[:2]) or _by_models(ratio, below, data[:2])
    return " ".join([*_measured(data[:2]), said]), figures


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
    printed = [listed([f"{number(100 * level, 3)} %" for level in _levels(one)]) for one in measured]
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
    """Return the order by the measurements of both, with what the ranking expects; None if they tell none.

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


def _by_models(ratio: float, below: float, data: Sequence[dict[str, Any]]) -> str:
    """Return the order that the ranking expects; `ratio`: its first level over the second, a mean over the models."""
    if abs(np.log(ratio)) < _SAME_LEVEL and abs(data[0]["probability"] - data[1]["probability"]) <= ALIKE:
        return (
            "#1 and #2 are the same for your purpose: "
            f"the ranking expects levels with a ratio of {number(ratio, 3)}. {_faster(data)}"
        )
    side, share = ("below", below) if below >= 0.5 else ("above", 1.0 - below)
    if share < _OPEN:
        return f"The ranking can't tell whether #1 is below #2 ({100 * below:.0f} %). Cast and measure both."
    expects = f"The ranking expects #1 {side} #2 ({'more than 99' if share > 0.995 else f'{100 * share:.0f}'} %)"
    if share >= _SURE:
        return f"{expects}: no measurement is needed to order the two."
    return f"{expects}. To be sure of the order cast and measure both."


def _faster(data: Sequence[dict[str, Any]]) -> str:
    hours = [one["cure_hours"] for one in data]
    first, second = (number(each, 3) for each in hours)
    if first == second:
        return f"Both are out of the mould in {first} h."
    quick = int(hours[1] < hours[0])
    return f"Take the faster, #{1 + quick}: {(first, second)[quick]} h against {(second, first)[quick]} h."
