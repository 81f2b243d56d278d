"""The best of a kind between the steps of the grid: scipy's simplex over its lengths, within ranges and limits."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import minimize

from unitcad.errors import Refusal
from unitcad.search.candidates import Candidates, tabulate
from unitcad.search.geometries import Lengths, geometry_of
from unitcad.search.ranking_order import ALIKE
from unitcad.search.wishes import limits

LENGTH_STEP, DIAMETER_STEP = 0.05, 0.1
"""What refined walls and caps, and diameters, are rounded to, mm: the printers' play is larger."""
_EVALUATIONS = 150
_MOST_ROUNDED = 64


def alone(found: Candidates, lengths: Lengths, materials: tuple[str, ...]) -> Candidates:
    """Return the one candidate of these lengths and silicones. Raises Refusal where the design does not accept it."""
    return tabulate(
        found.target, [geometry_of(found.target, lengths)], {}, found.silicones, only=materials, work=found.work
    )


def refined(found: Candidates, row: int) -> Candidates | None:
    """Return the candidate that a search from a row ends at, lengths rounded; None where it gains nothing to be seen.

    The probability must rise by `ALIKE`, the lengths stay within the target's ranges and the limits be met.
    """

    start, materials = found.lengths(row), found.materials(row)
    names, pack, unpack, bounds = _coordinates(found, start)
    if not bounds:
        return None

    def loss(x: np.ndarray) -> float:
        try:
            one = alone(found, unpack(x), materials)
        except Refusal:
            return 2.0
        over = sum(max(0.0, float(limit.values[0] / limit.most) - 1.0) for limit in limits(one))
        return 1.0 + over if over > 0 else 1.0 - float(one.probability[0])

    best = minimize(
        loss, pack, method="Nelder-Mead", bounds=bounds, options={"maxfev": _EVALUATIONS, "xatol": 0.01, "fatol": 1e-4}
    )
    steps = [DIAMETER_STEP if name == "diameter" else LENGTH_STEP for name in names]
    ends = [{_near(np.floor, x, step), _near(np.ceil, x, step)} for x, step in zip(best.x, steps, strict=True)]
    tried = [np.array(x) for x in itertools.islice(itertools.product(*map(sorted, ends)), _MOST_ROUNDED)]
    inside = [x for x in tried if all(low <= v <= high for v, (low, high) in zip(x, bounds, strict=True))]
    chosen = min(inside, key=loss, default=None)
    if chosen is None or 1.0 - loss(chosen) <= found.probability[row] + ALIKE:
        return None
    return alone(found, unpack(chosen), materials)


def _coordinates(
    found: Candidates, start: Lengths
) -> tuple[list[str], np.ndarray, Callable[[np.ndarray], Lengths], list[tuple[float, float]]]:
    """Return the varied lengths: the name and value of each, the way back from values, and their bounds."""
    vary = found.target.asked.vary
    own_caps = bool(start.caps) and vary.cap_mm is not None
    ranges = [
        ("walls", start.walls, vary.walls(len(start.walls))),
        ("caps", start.caps if own_caps else (), vary.cap_mm),
        ("diameter", (start.diameter,), vary.diameter_mm),
    ]
    parts = [(name, values, ends) for name, values, ends in ranges if values and ends and ends[0] < ends[1]]
    pack = np.array([value for _, values, _ in parts for value in values])
    bounds = [ends for _, values, ends in parts for _ in values]

    def unpack(x: np.ndarray) -> Lengths:
        at = 0
        changes: dict[str, Any] = {}
        for name, values, _ in parts:
            own = tuple(float(v) for v in x[at : at + len(values)])
            changes[name] = own[0] if name == "diameter" else own
            at += len(values)
        if start.caps and not own_caps and "walls" in changes:
            changes["caps"] = changes["walls"]
        return replace(start, **changes)

    return [name for name, values, _ in parts for _ in values], pack, unpack, bounds


def _near(rounding: Callable[[float], float], value: float, step: float) -> float:
    return round(float(rounding(value / step)) * step, 6)
