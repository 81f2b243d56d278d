"""Cost against error of a response: either load, every component; radii, layers, frequencies.

Errors are against `ball_reference`, which shares no code with the solver.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import get_args

import numpy as np

from benchmarks.accuracy import ball_reference
from benchmarks.accuracy.result import Cell, Plot, Promise, Say, Table, shown
from unitcad.accuracy.measurements import PROCESSOR, Timing, interleaved
from unitcad.attenuation.layered import Direction, LayeredMedium, Response, UniformDisc

LOADS = {direction: UniformDisc(3.5e-3, direction) for direction in get_args(Direction)}
TOLERANCES = (1e-3, 1e-6, 1e-9)
OMEGA = 2 * math.pi * 125.0
_COUNTS = {"radii": (1, 13, 100, 1000), "layers": (1, 4, 10, 100), "frequencies": (1, 10, 100)}
_CHECKED = 13
"""At how many radii the error is checked: the first ones."""


@dataclass(frozen=True)
class Cost:
    """Time and error of responses: each component's largest error over the largest |u|, and over its bound."""

    load: str
    of: str
    count: int
    rtol: float
    errors: dict[str, float]
    over_bound: float
    time: Timing

    @property
    def error(self) -> float:
        """The largest of all components."""
        return max(self.errors.values())


def every_load(forearm: LayeredMedium, radii: np.ndarray, quick: bool, say: Say) -> list[Cost]:
    """Return the cost of each load at three tolerances, if quick at one."""
    found = []
    for name in LOADS:
        say(name)
        found += _costs(name, forearm, forearm, np.array([OMEGA]), radii, "radii", quick)
    return found


def counted(forearm: LayeredMedium, say: Say) -> list[Cost]:
    """Return the cost of each load by number of radii, layers and frequencies."""
    found = []
    for of, counts in _COUNTS.items():
        for name in LOADS:
            say(f"{name}, by number of {of}")
            for count in counts:
                medium, same, omegas, radii = forearm, forearm, np.array([OMEGA]), np.array([7e-3])
                if of == "radii":
                    radii = _radii(count) if count > 1 else radii
                elif of == "frequencies":
                    omegas = 2 * math.pi * np.geomspace(20, 500, count) if count > 1 else omegas
                elif of == "layers":
                    medium = cut(forearm, count)
                    same = medium if count == 1 else forearm
                costs = _costs(name, medium, same, omegas, radii, of, quick=False)
                found += [replace(cost, count=count) for cost in costs]
    return found


@cache
def cut(forearm: LayeredMedium, count: int) -> LayeredMedium:
    """Return the first layer alone on the half-space, or all, the lowest cut into equal parts: `count` layers."""
    *upper, lowest = forearm.layers
    if count == 1:
        return LayeredMedium(upper[:1], forearm.half_space)
    parts = count - len(upper)
    part = replace(lowest, thickness=lowest.thickness / parts)
    return LayeredMedium([*upper, *[part] * parts], forearm.half_space)


def tables(loads: Sequence[Cost], counts: Sequence[Cost]) -> list[Table]:
    """Tabulate each load by component, and the cost of each by number of radii, layers and frequencies."""
    found = [_by_load(loads)]
    for of, numbers in _COUNTS.items():
        mine = {(c.load, c.count): c for c in counts if c.of == of and c.rtol == 1e-6}
        if mine:
            rows = tuple((name, *(_cell(mine[name, count]) for count in numbers)) for name in LOADS)
            found.append(
                Table(f"By number of {of}, rtol 1e-6: time, error", ("load", *map(str, numbers)), rows, _NOTES[of])
            )
    return found


_NOTES = {
    "radii": "From 0.5 to 30 mm, one alone 7 mm; the error is checked at 13 of them.",
    "layers": "At 7 mm. 1: the skin on bone. More: the forearm, its muscle cut into equal layers, so that the response "
    "stays that of the forearm.",
    "frequencies": "At 7 mm, from 20 to 500 Hz, one alone 125 Hz, a call each; the error is checked at both ends.",
}


def _by_load(loads: Sequence[Cost]) -> Table:
    rtols = sorted({cost.rtol for cost in loads}, reverse=True)
    rows: list[tuple[Cell, ...]] = []
    for name in LOADS:
        mine = {cost.rtol: cost for cost in loads if cost.load == name}
        components = tuple(mine[1e-6].errors.get(component) for component in ("r", "theta", "z"))
        over = max(cost.over_bound for cost in mine.values())
        rows.append((name, *components, over, *(str(mine[rtol].time) for rtol in rtols)))
    return Table(
        "Either load, every component",
        (
            "load",
            "error of u_r",
            "of u_theta",
            "of u_z",
            "over its bound",
            *(f"time, {t:g}" for t in rtols),
        ),
        tuple(rows),
        "The damped forearm at 125 Hz, 13 radii from 0.5 to 30 mm (quick: four). Errors at rtol 1e-6, over the largest "
        "|u|; the largest error over its bound of all tolerances; times by rtol. The reference is the global matrix in "
        "ball arithmetic, which shares no code with the solver.",
    )


def plots(loads: Sequence[Cost], counts: Sequence[Cost]) -> list[Plot]:
    """Plot error against time: both loads, and by number of radii, layers and frequencies."""
    found = []
    if len({cost.rtol for cost in loads}) > 1:
        series = {name: _points([c for c in loads if c.load == name]) for name in LOADS}
        found.append(Plot("Either load: error against time", "processor seconds for 13 radii", _ERROR, series))
    for of, numbers in _COUNTS.items():
        mine = [cost for cost in counts if cost.of == of]
        if mine:
            series = {
                f"{name}, {count}": _points([c for c in mine if (c.load, c.count) == (name, count)])
                for name in LOADS
                for count in numbers
            }
            found.append(Plot(f"By number of {of}: error against time", "processor seconds", _ERROR, series))
    return found


_ERROR = "error over the largest |u|"


def promises(costs: Sequence[Cost]) -> list[Promise]:
    """Return that bounds hold and that rtol is met under either load."""
    return [
        Promise("either load: largest error over its bound", max(cost.over_bound for cost in costs), 1.0),
        Promise("either load: largest error over rtol", max(cost.error / cost.rtol for cost in costs), 1.0),
    ]


def _costs(
    name: str,
    medium: LayeredMedium,
    same: LayeredMedium,
    omegas: np.ndarray,
    radii: np.ndarray,
    of: str,
    quick: bool,
) -> list[Cost]:
    """Measure at each tolerance; quick: at 1e-6, once. `same` has the same response with fewer layers."""
    load = LOADS[name]
    rtols = (1e-6,) if quick else TOLERANCES
    calls = {
        rtol: lambda rtol=rtol: [medium.response(load, float(omega), radii, rtol=rtol) for omega in omegas]
        for rtol in rtols
    }
    once = quick or omegas.size > 10
    times = interleaved(calls, 1 if once else 3, warm=not once, clock=PROCESSOR)
    at = slice(0, _CHECKED)
    components: tuple[str, ...] = ("r", "theta", "z") if load.direction == "tangential" else ("r", "z")
    worst: dict[float, dict[str, float]] = {rtol: dict.fromkeys(components, 0.0) for rtol in rtols}
    over = dict.fromkeys(rtols, 0.0)
    for i in {0, omegas.size - 1}:
        exact = _exact(same, load, float(omegas[i]), tuple(radii[at].tolist()))
        scale = float(np.max(np.abs(exact.u)))
        for rtol in rtols:
            found: Response = times[rtol].value[i]
            for component, u, doubt in zip(components, exact.u, exact.doubt, strict=True):
                wrong = np.abs(getattr(found, f"u_{component}")[at] - u)
                bound = getattr(found, f"error_{component}")[at]
                worst[rtol][component] = max(worst[rtol][component], float(np.max(wrong)) / scale)
                over[rtol] = max(over[rtol], float(np.max(np.maximum(wrong - doubt, 0.0) / bound)))
    return [
        Cost(name, of, radii.size, rtol, worst[rtol], over[rtol], replace(times[rtol], value=None)) for rtol in rtols
    ]


@cache
def _exact(
    medium: LayeredMedium, load: UniformDisc, omega: float, radii: tuple[float, ...]
) -> ball_reference.Reference:
    return ball_reference.response(medium, load, omega, np.array(radii))


def _points(costs: Sequence[Cost]) -> tuple[tuple[float, float], ...]:
    return tuple((cost.time.median, max(cost.error, 1e-17)) for cost in costs)


def _cell(cost: Cost) -> str:
    return f"{cost.time}, {shown(cost.error)}"


def _radii(count: int) -> np.ndarray:
    """Return radii (m) of which the first are the same for every count."""
    first, more = np.linspace(5e-4, 3e-2, _CHECKED), np.linspace(6e-4, 2.9e-2, max(0, count - _CHECKED))
    return np.concatenate([first, more])
