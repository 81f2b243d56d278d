"""A result in words, for the terminal, design.md and the page alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from unitcad.text import listed, number

OTHERS = "Nearest others: measured outside the target, or below the probability that is asked for"
"""The heading over the candidates that are no proposals."""
_GOALS = {
    "edge_min": "at least {} of the motor's amplitude at the edge",
    "edge_max": "at most {} of the motor's amplitude at the edge",
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


def target_line(goals: Mapping[str, Any]) -> str:
    """Return the target in words."""
    texts = {
        key: percent(value) if key in ("edge_min", "edge_max") else number(value, 4) for key, value in goals.items()
    }
    return ", ".join(text.format(texts[key]) for key, text in _GOALS.items() if key in goals)


def head_lines(data: Mapping[str, Any]) -> list[str]:
    """Return the number of candidates, the source of the probabilities, and the order that the evidence supports."""
    tried, leads = data["tried"], data["leads"]
    refused = sum(one["count"] for one in tried["refused"])
    not_made = f"; {refused} sets of lengths that no design accepts" if refused else ""
    return [
        f"{tried['candidates']} candidates ({tried['geometries']} sets of lengths), {tried['within_limits']} within "
        f"the limits{not_made}",
        f"probabilities by {leads['model']}, fitted to {leads['by']}; they rank {leads['ranks']}",
        f"they do not rank {leads['does_not_rank']}",
    ]


def skipped_lines(data: Mapping[str, Any]) -> list[str]:
    """Return a line for each silicone that is skipped, and for each candidate that can't be cast."""
    return [
        *(f"skipped, {name}: {why}" for name, why in data["skipped"].items()),
        *(f"can't be cast, {one['candidate']}: {'; '.join(one['failed'])}" for one in data["not_castable"]),
    ]


def title(one: Mapping[str, Any]) -> str:
    """Return a proposal's heading: its number, its kind, and whether its lengths were never measured."""
    return f"{one['rank']}. {one['label']}" + ("" if one["lengths_measured"] else " (not measured at these lengths)")


def is_first_other(proposals: Sequence[Mapping[str, Any]], i: int) -> bool:
    """Tell whether a candidate is under the heading `OTHERS`."""
    return proposals[i]["nearest_other"] and not any(one["nearest_other"] for one in proposals[:i])


def level_line(one: Mapping[str, Any]) -> str:
    """Return a proposal's measurement, if there is one, then its probability and range."""
    first = f"{measured_words(one['measured'])}; " if one["measured"] else ""
    edge, least = one["edge"], one["probability_min"]
    below = f", below your {100 * least:.3g} %" if one["probability"] < least else ""
    return (
        f"{first}probability {one['probability']:.2f}{below}, {percent(edge['p10'])} to {percent(edge['p90'])} "
        "at the edge (10 to 90 %)"
    )


def measured_words(measured: Mapping[str, Any]) -> str:
    """Return a unit's measurement, by whom, and whether it is within the target."""
    level, second = percent(measured["level"]), measured.get("also")
    also = f", also printed as {percent(second)}" if second and percent(second) != level else ""
    return f"measured {level} ({measured['by']}{also}): {'meets' if measured['meets'] else 'outside'} the target"


def lines(one: Mapping[str, Any]) -> list[str]:
    """Return a proposal's size, mass and hours, then its reasons and its unknowns."""
    checks = "moulds not checked" if one["checks"] is None else f"moulds pass at {one['checks']} places"
    size = (
        f"{number(one['diameter_mm'], 3)} mm wide, {number(one['height_mm'], 3)} mm high, "
        f"{number(one['mass_g'], 3)} g with motor, out of the mould in {number(one['cure_hours'], 3)} h, {checks}"
    )
    made = [size]
    if one["equal_to"]:
        made.insert(0, f"as likely as number {one['equal_to']}: the order among equals is how easily they are made")
    if crosstalk := one.get("crosstalk"):
        value, low, high = (number(crosstalk[key], 2) for key in ("value", "low", "high"))
        made.append(
            f"crosstalk ratio {value} ({low} to {high}) at {number(crosstalk['pitch_mm'], 4)} mm, the same for every "
            f"unit of this diameter; {percent(crosstalk['neighbour'])} of the motor's amplitude at the neighbour"
        )
    if sibling := one.get("measured_sibling"):
        made.append(
            f"the measured unit of this kind ({sibling['label']}): {measured_words(sibling)}; "
            f"its probability is {sibling['probability']:.2f}"
        )
    if one["relies_on"]:
        made.append(f"the nearest measured unit differs in {listed(one['relies_on'])}")
    return [*made, one["lengths_gain"], *one["remarks"]]


def explanation_lines(data: Mapping[str, Any]) -> list[str]:
    """Return an answer of `explain`."""
    head = data["name"]
    if data["probability"] is not None:
        place = f", place {data['rank']} of {data['of']}" + ("" if data["among"] else " if it were tried")
        head += f": {level_line(data)}{place if data['rank'] else ''}"
    elif data["measured"]:
        head += f": {measured_words(data['measured'])}"
    is_proposal = data["listed"] and not data["nearest_other"]
    among = [f"it is among the proposals, as number {data['listed']}"] if is_proposal else []
    return [head, *(f"  {line}" for line in [*among, *data["reasons"]])]
