"""The probabilities of `unitcad design` against the measured units, each left out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Plot, Promise, Result, Say, Summary, Table
from unitcad.attenuation.edge.measured import MeasuredTable, measured_table
from unitcad.attenuation.edge.models import BASELINE, COMPARED, RULE
from unitcad.attenuation.edge.ranges import Predictive, lead_on

JUDGED = (RULE, BASELINE, "published")
LEVELS = (0.03, 0.06, 0.12, 0.25, 0.5)
"""Targets "at most this much at the edge"."""
BINS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
RANGE = 0.8
"""What the range from 10 to 90 % should hold."""


@dataclass(frozen=True)
class Judged:
    """A measured unit, predicted by a model that was fitted without it."""

    unit: str
    level: float
    low: float
    middle: float
    high: float
    share: float
    met: tuple[float, ...]

    @property
    def held(self) -> bool:
        """Whether the range has the measured level."""
        return self.low <= self.level <= self.high


def run(quick: bool, say: Say) -> Result:
    """Judge the probabilities unit by unit."""
    judged = {}
    for name in JUDGED:
        say(f"nine units left out: {name}")
        judged[name] = leave_one_out(name, measured_table())
    tables = [_units(name, own) for name, own in judged.items()]
    tables += [_reliability(judged), _coverage(judged)]
    promises = [
        Promise(
            f"{RULE}: 80 % ranges, how far 0.8 lies outside the 95 % interval of the share that held",
            _miss(judged[RULE]),
            0.0,
        ),
        Promise(
            f"{RULE}: score of the probabilities (Brier) over that of the share met alone", score(judged[RULE]), 1.0
        ),
        Promise(f"{RULE}: the same over the {BASELINE}'s", score(judged[RULE]) / score(judged[BASELINE]), 1.1),
    ]
    held = sum(one.held for one in judged[RULE])
    return Result(
        suite="design",
        title="Proposals: are their probabilities right",
        text=(
            "Each of the nine measured units is taken as if it had not been measured: a model is fitted without it, "
            "and `unitcad design`'s probability and range for it are set against the level that was measured. The "
            "four class means are the baseline. The nine units share walls, diameter, motor and frequency: nothing "
            "here says how far a range can be trusted for other lengths, where it is wider by assumed slopes."
        ),
        tables=tuple(tables),
        plots=(_plot(judged),),
        promises=tuple(promises),
        measured=machine("numpy", "scipy"),
        summary=Summary(
            ((f"a unit's level as a range, {held} of 9 held", "80 % nominal", f"10 to 90 % of the {RULE}"),),
            f"a unit left out lay at {_worst(judged[RULE])} of its distribution",
            0,
        ),
    )


def leave_one_out(name: str, table: MeasuredTable) -> list[Judged]:
    """Predict each unit of a table by a model fitted to the others; a unit of unknown shape has its shapes' mean."""
    found = []
    for i, unit in enumerate(table.names):
        lead = lead_on(table.without(i), name)
        own = np.array(list(lead.constants.values()))
        centre = np.array(np.mean(COMPARED[name].logs(table.inputs[i], own)))
        one = Predictive(lead.degrees_of_freedom, centre, np.array(lead.sigma))
        low, middle, high = (float(end) for end in one.range)
        level = float(table.levels[i])
        met = tuple(float(one.at_most(limit)) for limit in LEVELS)
        found.append(Judged(unit, level, low, middle, high, float(one.at_most(level)), met))
    return found


def pairs(own: Sequence[Judged]) -> tuple[np.ndarray, np.ndarray]:
    """Return the probability of each unit's meeting each of `LEVELS`, and whether it did."""
    p = np.array([one.met for one in own])
    met = np.array([[one.level <= limit for limit in LEVELS] for one in own])
    return p.ravel(), met.ravel()


def score(own: Sequence[Judged]) -> float:
    """Return the Brier score over that of saying, for each target, the share of the other units that met it."""
    p, met = pairs(own)
    shape = (len(own), len(LEVELS))
    share = (met.reshape(shape).sum(axis=0) - met.reshape(shape)) / (len(own) - 1)
    return float(np.mean((p - met) ** 2) / np.mean((share.ravel() - met) ** 2))


def interval(held: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a share, by Clopper and Pearson."""
    from scipy.stats import binomtest

    found = binomtest(held, count).proportion_ci(0.95, "exact")
    return float(found.low), float(found.high)


def _miss(own: Sequence[Judged]) -> float:
    low, high = interval(sum(one.held for one in own), len(own))
    return max(0.0, low - RANGE, RANGE - high)


def _units(name: str, own: Sequence[Judged]) -> Table:
    rows = tuple(
        (one.unit, one.level, one.middle, f"{one.low:.3f} to {one.high:.3f}", _yes(one.held), one.share, one.met[1])
        for one in own
    )
    return Table(
        f"Each unit left out: {name}",
        ("unit", "measured", "median", "10 to 90 %", "held", "P(level below the measured)", "P(at most 6 %)"),
        rows,
    )


def _yes(held: bool) -> str:
    return "yes" if held else "no"


def _reliability(judged: dict[str, list[Judged]]) -> Table:
    rows = []
    for name, own in judged.items():
        p, met = pairs(own)
        for low, high in pairwise(BINS):
            inside = (p >= low) & ((p < high) | (high == 1.0))
            count = int(inside.sum())
            shares = (float(p[inside].mean()), float(met[inside].mean())) if count else (None, None)
            ends = "{:.2f} to {:.2f}".format(*interval(int(met[inside].sum()), count)) if count else "-"
            rows.append((name, f"{low:g} to {high:g}", count, *shares, ends))
    targets = ", ".join(f"{100 * level:g} %" for level in LEVELS)
    return Table(
        "Reliability: probabilities of meeting a target, and how often it was met",
        ("model", "probability", "judgements", "mean probability", "share met", "95 % interval of the share"),
        tuple(rows),
        f"Targets: at most {targets} at the edge, of each of the nine units. The judgements of one unit hang together, "
        "so the true intervals are wider than these.",
    )


def _coverage(judged: dict[str, list[Judged]]) -> Table:
    rows = []
    for name, own in judged.items():
        held = sum(one.held for one in own)
        low, high = interval(held, len(own))
        rows.append((name, f"{held} of {len(own)}", f"{low:.2f} to {high:.2f}", RANGE, score(own)))
    return Table(
        "Are 80 % ranges right 80 % of the time?",
        ("model", "ranges that held", "95 % interval of the share", "nominal", "Brier score over the share's"),
        tuple(rows),
        "Nine units can't tell 0.8 from much of what is near it: the interval says how much. A score below 1 says more "
        "than the share of the other units that met the goals.",
    )


def _plot(judged: dict[str, list[Judged]]) -> Plot:
    return Plot(
        "Each unit left out: median over measured level",
        "measured level at the edge, motor = 1",
        "median of the prediction, motor = 1",
        {
            **{name: tuple((one.level, one.middle) for one in own) for name, own in judged.items()},
            "equal": ((0.04, 0.04), (0.7, 0.7)),
        },
        lines=False,
        curves=("equal",),
    )


def _worst(own: Sequence[Judged]) -> str:
    one = max(own, key=lambda each: abs(each.share - 0.5))
    return f"{100 * one.share:.2g} % ({one.unit})"
