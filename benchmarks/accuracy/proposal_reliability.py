"""The probabilities of `unitcad design` against the measured units, each left out; its search against two others."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Plot, Promise, Result, Say, Summary, Table
from unitcad.attenuation.edge.measured_levels import MeasuredTable, measured_table
from unitcad.attenuation.edge.predictive import STACKED, Predictive, stack
from unitcad.errors import Refusal
from unitcad.search.candidates import Candidates, Lengths, candidates
from unitcad.search.proposals import refined
from unitcad.search.ranking import kinds
from unitcad.search.target_file import Target, target_of

STACKS = {"every closed form": STACKED, "crossings, fitted, paper": ("crossings", "fitted", "paper")}
LEVELS = (0.03, 0.06, 0.12, 0.25, 0.5)
"""Targets "at most this much at the edge"."""
BINS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
RANGE = 0.8
"""What the range from 10 to 90 % should hold."""
QUESTION = {
    "target": {"edge_max": 0.06, "mass_max_g": 1.05},
    "vary": {"layers": [2], "wall_mm": [1.1, 2.0], "diameter_mm": [13.0, 15.0], "step_mm": 0.3},
}
GAP = 0.02
"""How much better than `unitcad design` another search may be: what it does not tell apart itself."""


@dataclass(frozen=True)
class Judged:
    """A measured unit, predicted by models that were stacked and fitted without it."""

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
    """Judge the probabilities unit by unit, and time the search against differential evolution and Optuna."""
    judged = {}
    for name, models in STACKS.items():
        say(f"nine units left out: {name}")
        judged[name] = left_out(models, measured_table())
    tables = [_units(name, own) for name, own in judged.items()]
    tables += [_reliability(judged), _coverage(judged)]
    say("searches")
    searched = searches(quick, say)
    tables.append(_searches(searched))
    outside = {name: _miss(own) for name, own in judged.items()}
    ours = searched[0].best
    promises = [
        Promise(f"{name}: 80 % ranges, how far 0.8 lies outside the 95 % interval of the share that held", miss, 0.0)
        for name, miss in outside.items()
    ]
    promises += [
        Promise(f"{name}: score of the probabilities (Brier) over that of the share met alone", score(own), 1.0)
        for name, own in judged.items()
    ]
    promises += [Promise(f"{one.name}: its best probability less ours", one.best - ours, GAP) for one in searched[1:]]
    first = next(iter(judged.values()))
    held = sum(one.held for one in first)
    return Result(
        suite="design",
        title="Proposals: are their probabilities right, and is the search",
        text=(
            "Each of the nine measured units is taken as if it had not been measured: the models are fitted, and "
            "stacked, without it, and `unitcad design`'s probability and range for it are set against the level that "
            "was measured. The nine units share walls, diameter, motor and frequency: nothing here says how far a "
            "range can be trusted for other lengths."
        ),
        tables=tuple(tables),
        plots=(_plot(judged),),
        promises=tuple(promises),
        measured=machine("numpy", "scipy", "optuna"),
        summary=Summary(
            ((f"a unit's level as a range, {held} of 9 held", "80 % nominal", "10 to 90 % of the stacked models"),),
            f"a unit left out lay at {_worst(first)} of its distribution",
            0,
        ),
    )


def left_out(models: Sequence[str], table: MeasuredTable) -> list[Judged]:
    """Predict each unit of a table by the stack of the others."""
    found = []
    for i, name in enumerate(table.names):
        made = stack(models, table.without(i)).predictive(table.inputs[i])
        one = _mean(made)
        low, middle, high = (float(end[0]) for end in one.range)
        level = float(table.levels[i])
        met = tuple(float(p) for p in (one.at_most(limit)[0] for limit in LEVELS))
        found.append(Judged(name, level, low, middle, high, float(one.at_most(level)[0]), met))
    return found


def _mean(made: Predictive) -> Predictive:
    """Return the distribution of a unit whose shape is not known: about the geometric mean of its shapes' levels."""
    centre = np.atleast_2d(made.centre).mean(axis=0)[None]
    return replace(made, centre=centre, scale=np.atleast_2d(made.scale)[:1])


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
        ("models", "probability", "judgements", "mean probability", "share met", "95 % interval of the share"),
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
        ("models", "ranges that held", "95 % interval of the share", "nominal", "Brier score over the share's"),
        tuple(rows),
        "Nine units can't tell 0.8 from much of what is near it: the interval says how much. A score below 1 says more "
        "than the share of the other units that met the goals.",
    )


@dataclass(frozen=True)
class Search:
    """A search's best probability, how many candidates it judged, and its processor time in seconds."""

    name: str
    best: float
    judged: int
    seconds: float


def searches(quick: bool, say: Say) -> list[Search]:
    """Answer one question by `unitcad design`'s grid and refinement, scipy's differential evolution and Optuna."""
    target = target_of(QUESTION)
    candidates(target)  # what is read once does not count
    found = [_ours(target)]
    for name, search in (("differential evolution", _evolution), ("Optuna, TPE", _optuna)):
        say(name)
        start, judge = time.process_time(), _Counter(target)
        search(judge, quick)
        found.append(Search(name, judge.best, judge.count, time.process_time() - start))
    return found


def _ours(target: Target) -> Search:
    start = time.process_time()
    table = candidates(target)
    rows = np.flatnonzero(table.mass_g <= (target.goals.mass_max_g or np.inf))
    ranked = kinds(table, rows)[:5]
    better = [refined(table, kind.best) for kind in ranked]
    best = max([float(table.probability[rows].max()), *(float(one.probability[0]) for one in better if one)])
    return Search("unitcad design: grid, refined", best, table.count, time.process_time() - start)


class _Counter:
    """A target's candidates one at a time: the probability of one within the limits, 0 elsewhere."""

    def __init__(self, target: Target) -> None:
        self.target, self.count, self.best = target, 0, 0.0
        self.table: Candidates = candidates(target)
        rows = [kind.best for kind in kinds(self.table, np.arange(self.table.count))]
        self.kinds = sorted({(self.table.kind(row)[0], self.table.materials(row)) for row in rows})

    def __call__(self, kind: int, walls: tuple[float, float], diameter: float) -> float:
        design, materials = self.kinds[kind]
        caps = walls if any(self.table.lengths(row).caps for row in self._rows(design)) else ()
        motor = self.target.asked.at_hand.motors[0]
        self.count += 1
        try:
            one = self.table.alone(Lengths(design, motor, walls, caps, diameter), materials)
        except Refusal:
            return 0.0
        p = float(one.probability[0]) if one.mass_g[0] <= (self.target.goals.mass_max_g or np.inf) else 0.0
        self.best = max(self.best, p)
        return p

    def _rows(self, design: str) -> list[int]:
        return [next(i for i in range(self.table.count) if self.table.lengths(i).design == design)]


def _evolution(judge: _Counter, quick: bool) -> None:
    from scipy.optimize import differential_evolution

    last = len(judge.kinds) - 1
    differential_evolution(
        lambda x: -judge(round(x[0]), (float(x[1]), float(x[2])), float(x[3])),
        [(0, last), (1.1, 2.0), (1.1, 2.0), (13.0, 15.0)],
        integrality=[True, False, False, False],
        seed=7,  # pyright: ignore[reportCallIssue] - scipy below 1.15 knows no `rng`
        maxiter=4 if quick else 40,
        popsize=10,
        polish=False,
    )


def _optuna(judge: _Counter, quick: bool) -> None:
    import optuna

    optuna.logging.set_verbosity(optuna.logging.ERROR)
    study = optuna.create_study(direction="maximize", sampler=optuna.samplers.TPESampler(seed=7))
    names = [str(i) for i in range(len(judge.kinds))]

    def objective(trial: optuna.Trial) -> float:
        kind = int(trial.suggest_categorical("kind", names))
        walls = trial.suggest_float("inner", 1.1, 2.0), trial.suggest_float("outer", 1.1, 2.0)
        return judge(kind, walls, trial.suggest_float("diameter", 13.0, 15.0))

    study.optimize(objective, n_trials=60 if quick else 600)


def _searches(found: Sequence[Search]) -> Table:
    return Table(
        "One question, three searches: at most 6 % at the edge and 1.05 g; kind, two walls and diameter",
        ("search", "best probability", "candidates judged", "processor time, s"),
        tuple((one.name, one.best, one.judged, one.seconds) for one in found),
        "All judge by the same models and limits. The grid's candidates are judged at once, and the best of five kinds "
        "refined; the others ask for one at a time. Theirs are not rounded to what can be printed.",
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
