"""An array's crosstalk in a few sentences, and how two layouts compare."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

from unitcad.text import listed, number

IN_BRACKETS = (
    "In brackets is the range: tissue moduli, damping, thicknesses and frequency taken to both ends of their ranges, "
    "and how far finite elements differ from the computed decay."
)
ALIKE = 1e-3
"""Sums that differ by less, as a share, are called alike."""
Crosstalk = Mapping[str, Any]
"""What `crosstalk_matrix.crosstalk` returns."""


def crosstalk_lines(data: Crosstalk) -> list[str]:
    """Return the answer, the nearest neighbour first: what reaches it, what adds up, and the range over the models."""
    nearest, worst = data["nearest"], data["worst"]
    if nearest is None:
        return ["A single unit has no neighbour: there is no crosstalk."]
    lines = [
        f"Of a unit's motion at its edge {_percent(nearest['centre'])} reaches the middle of its nearest neighbour "
        f"({nearest['from']} to {nearest['to']}, {number(nearest['distance_mm'], 4)} mm apart), "
        f"{_percent(nearest['nearest_edge'])} that neighbour's edge.",
        f"With all other units on, {_most(data)}: {_times(worst['root_sum_of_squares'])} times one "
        f"unit's edge level by the root of the sum of squares, as motors that are not synchronous add up; "
        f"{_times(worst['sum'])} times if all are in phase.",
        _absolute(data["absolute"]),
    ]
    if data["band"]:
        lines.append(_band(data))
    if masses := data.get("masses"):
        at = [place["name"] for place in data["places"]].index(worst["place"])
        changes = masses["root_sum_of_squares_changes_by"][at], masses["sum_changes_by"][at]
        lines.append(
            f"The units' masses on the skin change what {worst['place']} gets by x {number(changes[0], 3)} (root of "
            f"the sum of squares) and x {number(changes[1], 3)} (in phase)."
        )
    return [*lines, IN_BRACKETS]


def _most(data: Crosstalk) -> str:
    """Name the place that gets the most; places that stand alike differ by what their centres are rounded to."""
    values = data["sums"]["own_drive"]["root_sum_of_squares"]
    alike = max(values) - min(values) <= ALIKE * max(values)
    return "all get alike" if alike else f"{data['worst']['place']} gets the most"


def ratios(every: Sequence[Crosstalk]) -> list[dict[str, Any]]:
    """Return each array's crosstalk over that of the first: nearest neighbour, and the sums at the worst places.

    In units' own levels at their edge. A ratio is None where one of the two is a single unit.
    """
    first, found = every[0], []
    for other in every[1:]:
        block: dict[str, Any] = {"array": other["array"], "over": first["array"]}
        both = first["nearest"], other["nearest"]
        for key in ("centre", "nearest_edge"):
            block[f"nearest_{key.removeprefix('nearest_')}"] = (
                _over(both[1][key], both[0][key]) if both[0] and both[1] else None
            )
        for key in ("sum", "root_sum_of_squares"):
            block[key] = _over(other["worst"][key], first["worst"][key])
        block["same_body"] = first["tissue"] == other["tissue"]
        found.append(block)
    return found


def ratio_line(one: Mapping[str, Any]) -> str:
    """Say how an array's crosstalk compares with another's."""
    parts = {
        "nearest neighbour": one["nearest_centre"],
        "worst place, root of squares": one["root_sum_of_squares"],
        "in phase": one["sum"],
    }
    said = listed(f"{what} x {number(value, 3, zeros=True)}" for what, value in parts.items() if value is not None)
    body = "" if one["same_body"] else " (on another body)"
    return (
        f"{one['array']} over {one['over']}: {said or 'nothing to compare'}{body}, in edge levels of their own units."
    )


def _over(one: Mapping[str, float], other: Mapping[str, float]) -> float | None:
    return round(one["value"] / other["value"], 6) if other["value"] else None


def _percent(quantity: Mapping[str, float]) -> str:
    value, low, high = (number(100 * quantity[key], 2) for key in ("value", "low", "high"))
    return f"{value} % ({low} to {high})"


def _times(quantity: Mapping[str, float]) -> str:
    value, low, high = (number(quantity[key], 2) for key in ("value", "low", "high"))
    return f"{value} ({low} to {high})"


def _absolute(block: Mapping[str, Any]) -> str:
    root, phase = block["root_sum_of_squares"], block["sum"]
    if root is None:
        return f"No absolute level: {block['reason']}."
    said = [f"{number(100 * one['low'], 2)} to {number(100 * one['high'], 2)} %" for one in (root, phase)]
    return (
        f"At {block['place']} that is {said[0]} of the motor's own amplitude, and {said[1]} if all are in phase: the "
        "models of the level at a unit's edge differ so much."
    )


def _band(data: Crosstalk) -> str:
    """Say how the nearest neighbour's share goes over the band under the drive of most units."""
    drives = [place["drive"] for place in data["places"]]
    drive = max(("flat", "axial"), key=drives.count)
    shares = [(row["frequency_hz"], row[drive]["nearest_centre"]) for row in data["band"]]
    ordered = sorted(shares, key=lambda pair: pair[1])
    least, most = ordered[0], ordered[-1]
    falls = all(a[1] >= b[1] for a, b in pairwise(shares))
    if falls and len(shares) > 1:
        return (
            f"From {number(shares[0][0])} to {number(shares[-1][0])} Hz the nearest neighbour's share falls from "
            f"{number(100 * most[1], 2)} to {number(100 * least[1], 2)} % ({drive} drive)."
        )
    return (
        f"From {number(shares[0][0])} to {number(shares[-1][0])} Hz the nearest neighbour's share lies between "
        f"{number(100 * least[1], 2)} % at {number(least[0])} Hz and {number(100 * most[1], 2)} % at "
        f"{number(most[0])} Hz ({drive} drive)."
    )
