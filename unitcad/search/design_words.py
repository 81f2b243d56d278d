"""A result in words, for the terminal, design.md and the page alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from unitcad.text import listed, number

_APART = 0.1
"""Models whose probabilities differ by more are named one by one."""
_WISHES = {
    "diameter_max_mm": "diameter at most {} mm",
    "height_max_mm": "height at most {} mm",
    "mass_max_g": "mass at most {} g",
    "cure_hours_max": "out of the mould within {} h",
    "crosstalk_ratio_max": "crosstalk ratio at most {}",
    "pitch_mm": "neighbours {} mm apart",
    "frequency_hz": "at {} Hz",
}


def percent(level: float) -> str:
    """Return a level as per cent of the motor's amplitude, two digits."""
    return f"{number(100 * level, 2)} %"


def share(probability: float) -> str:
    """Return a probability with two decimals."""
    return f"{probability:.2f}"


def wish_line(wish: Mapping[str, Any]) -> str:
    """Return what is wished for."""
    parts = []
    if "edge_max" in wish and "edge_min" in wish:
        parts.append(f"between {percent(wish['edge_min'])} and {percent(wish['edge_max'])} at the edge")
    elif "edge_max" in wish:
        parts.append(f"at most {percent(wish['edge_max'])} at the edge")
    else:
        parts.append(f"at least {percent(wish['edge_min'])} at the edge")
    return ", ".join([*parts, *(text.format(number(wish[key], 4)) for key, text in _WISHES.items() if key in wish)])


def tried_line(data: Mapping[str, Any]) -> str:
    """Return how much was tried."""
    tried = data["tried"]
    refused = sum(one["count"] for one in tried["refused"])
    not_made = f"; {refused} sets of lengths that no design accepts" if refused else ""
    return (
        f"{tried['candidates']} candidates ({tried['geometries']} sets of lengths), {tried['within_limits']} within "
        f"the limits{not_made}"
    )


def models_line(data: Mapping[str, Any]) -> str:
    """Return which models count, and how much."""
    models = data["models"]
    weights = listed(f"{name} {share(weight)}" for name, weight in models["weights"].items())
    none = f"; no weight: {listed(models['without_weight'])}" if models["without_weight"] else ""
    return f"models by their left-out score, {models['by']}: {weights}{none}"


def left_out_lines(data: Mapping[str, Any]) -> list[str]:
    """Return a line for each silicone that is left out."""
    return [f"left out, {name}: {why}" for name, why in data["left_out"].items()]


def not_castable_lines(data: Mapping[str, Any]) -> list[str]:
    """Return a line for each candidate that fell out by its moulds."""
    return [f"can't be cast, {one['candidate']}: {'; '.join(one['failed'])}" for one in data["not_castable"]]


def title(one: Mapping[str, Any]) -> str:
    """Return what a candidate is, and whether a unit of its lengths was never measured."""
    return one["label"] + ("" if one["lengths_measured"] else " (not measured at these lengths)")


def level_line(one: Mapping[str, Any]) -> str:
    """Return a proposal's measurement, if there is one, then its probability and range."""
    first = f"{measured_words(one['measured'])}; " if one["measured"] else ""
    edge, least = one["edge"], one["probability_min"]
    below = f", below your {100 * least:.3g} %" if one["probability"] < least else ""
    return (
        f"{first}probability {share(one['probability'])}{below}, {percent(edge['p10'])} to {percent(edge['p90'])} "
        "at the edge (10 to 90 %)"
    )


def measured_words(measured: Mapping[str, Any]) -> str:
    """Return a unit's measurement, by whom, and whether it is within the wish."""
    also = f", also printed as {percent(measured['also'])}" if _differs(measured) else ""
    verdict = "meets the wish" if measured["meets"] else "outside the wish"
    return f"measured {percent(measured['level'])} ({measured['by']}{also}): {verdict}"


def _differs(measured: Mapping[str, Any]) -> bool:
    return bool(measured.get("also")) and percent(measured["also"]) != percent(measured["level"])


OTHERS = "Nearest others: measured outside the wish, or below the probability that is asked for"
"""The heading over the candidates that are no proposals."""


def first_other(proposals: Sequence[Mapping[str, Any]]) -> int | None:
    """Return the rank of the first candidate that stands under `OTHERS`; None where all are proposals."""
    return next((one["rank"] for one in proposals if one["nearest_other"]), None)


def size_line(one: Mapping[str, Any]) -> str:
    """Return a proposal's size, mass, time and moulds."""
    checks = "moulds not checked" if one["checks"] is None else f"moulds pass at {one['checks']} places"
    parts = [
        f"{number(one['diameter_mm'], 3)} mm wide, {number(one['height_mm'], 3)} mm high",
        f"{number(one['mass_g'], 3)} g with motor",
        f"out of the mould in {number(one['cure_hours'], 3)} h",
        checks,
    ]
    if crosstalk := one.get("crosstalk"):
        value, low, high = (number(crosstalk[key], 2) for key in ("value", "low", "high"))
        parts.append(f"crosstalk ratio {value} ({low} to {high}) at {number(crosstalk['pitch_mm'], 4)} mm")
    return ", ".join(parts)


def reasons(one: Mapping[str, Any]) -> list[str]:
    """Return what speaks for a proposal, and what is not known of it."""
    by_model = one["by_model"]
    lines = []
    if sibling := one.get("measured_sibling"):
        lines.append(
            f"the measured unit of this kind ({sibling['label']}) had {percent(sibling['level'])} ({sibling['by']}), "
            f"{'within' if sibling['meets'] else 'outside'} the wish; "
            f"its probability is {share(sibling['probability'])}"
        )
    lines += [f"not measured: {note}" for note in one["relies_on"]]
    if max(by_model.values()) - min(by_model.values()) > _APART:
        lines.append(f"the models differ: {listed(f'{name} {share(p)}' for name, p in by_model.items())}")
    lines.append(one["lengths_gain"])
    if crosstalk := one.get("crosstalk"):
        lines.append(
            f"{percent(crosstalk['neighbour'])} of the motor's amplitude is expected at the neighbour; the crosstalk "
            f"ratio is the same for every unit of {number(one['diameter_mm'], 3)} mm and tells no designs apart"
        )
    return [*lines, *one["remarks"]]


def explanation_lines(data: Mapping[str, Any]) -> list[str]:
    """Return what `explain` found."""
    head = data["name"]
    if data["probability"] is not None:
        place = f", place {data['rank']} of {data['of']}" + ("" if data["among"] else " if it were tried")
        head += f": {level_line(data)}{place if data['rank'] else ''}"
    elif data["measured"]:
        head += f": {measured_words(data['measured'])}"
    proposal = data["listed"] and not data["nearest_other"]
    among = [f"it is among the proposals, as number {data['listed']}"] if proposal else []
    return [head, *(f"  {line}" for line in [*among, *data["reasons"]])]
