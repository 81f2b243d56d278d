"""Signal chains against records of known truth: error and run time, coverage of the stated uncertainty, levels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.accuracy.chain_peers import CHAINS
from benchmarks.accuracy.cramer_rao import amplitude_bound
from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Plot, Promise, Result, Say, Summary, Table, shown, stars
from benchmarks.accuracy.synthetic_records import (
    LENGTH_S,
    RATE,
    SCENARIOS,
    WHOLE,
    Scenario,
    Synthetic,
    synthetic,
)
from unitcad.accuracy.measurements import PROCESSOR, PROCESSOR_NOTE
from unitcad.lab import bandpass
from unitcad.lab.line import fit_line
from unitcad.lab.measuring import level

SEED = 20240
TRIALS, QUICK_TRIALS = 400, 40
SCATTER = 0.05
"""Standard deviation of the logarithms of simulated repeats."""


@dataclass(frozen=True)
class Coverage:
    """One scenario's errors, and the part of the records whose amplitude lies within 2 u.

    `over_bound` is the root mean square of the errors, each over the bound of its own record; `bound` the median of
    those, relative; `furthest` the largest error over u.
    """

    name: str
    median: float
    highest: float
    bound: float
    over_bound: float
    furthest: float
    covered: float
    long_run: float


def run(quick: bool, say: Say) -> Result:
    """Compare the chains on the same records, and count how often stated intervals hold the truth."""
    trials = QUICK_TRIALS if quick else TRIALS
    say("chains")
    near, rows = _chain_errors(trials)
    points = [(row[4], row[1]) for row in rows]
    chains = tuple((*row, star) for row, star in zip(rows, stars(points), strict=True))
    coverage = []
    for scenario in SCENARIOS:
        say(scenario.name)
        coverage.append(_coverage(scenario, trials))
    say("levels")
    repeats = [_level_coverage(count, 1000 if quick else 10000) for count in (3, 5)]
    gains = [(hz, bandpass.gain(hz), bandpass.gain(hz) ** 0.5) for hz in _GAIN_HZ]
    return Result(
        suite="measure",
        title="Signal chains of a measurement",
        text=(
            f"Amplitudes of synthetic records of {LENGTH_S:g} s at {RATE / 1000:g} kHz whose truth is known. The "
            "chains are unitcad's `line` and `bandpass` and four in use, all on the same records. These have 12 to "
            "300 um, "
            f"100 to 150 Hz, drift of the frequency {100 * WHOLE.drift:g} %, wander of the amplitude "
            f"{100 * WHOLE.wander:g} %, mains, harmonics, spin-up, noise of 1/{WHOLE.snr:g}. The truth is the "
            "amplitude's mean over the record once the motor runs. A comb at 50 Hz takes 100 and 150 Hz away: there "
            "the chain `bandpass` reads next to nothing."
        ),
        tables=(
            Table(
                "Error of the amplitude against run time",
                ("chain", "median, %", "95th percentile, %", "worst within 1 Hz of 100 or 150 Hz, %", "ms", "frontier"),
                chains,
                f"{trials} records; the column before the last but one has {near} records of its own, the sign is the "
                f"error's. {PROCESSOR_NOTE}",
            ),
            Table(
                "`line`: error and coverage by scenario",
                (
                    "record",
                    "median, %",
                    "95th percentile, %",
                    "Cramer-Rao bound, median, %",
                    "error over the bound, rms",
                    "largest error over u",
                    "within 2 u, %",
                    "long-run amplitude within 2 u, %",
                ),
                tuple(
                    (
                        c.name,
                        100 * c.median,
                        100 * c.highest,
                        100 * c.bound,
                        c.over_bound,
                        c.furthest,
                        100 * c.covered,
                        100 * c.long_run,
                    )
                    for c in coverage
                ),
                "The bound is that of each record, from the Fisher information of the whole model. Unknown are "
                "phase, frequency, harmonics, offset, slope and the mains' phases. The mains' amplitudes are known. "
                "Of a clipped sample only the side is known. It grows by 3.3 where the line is cut off at 0.8, and up "
                "to 28 beside 100 and 150 Hz. Records with a line within 0.75 Hz of those are left out: in 2 s they "
                "can't tell it from the mains (L105). The promise of 94 % is of the column "
                '"within 2 u": the amplitude that the record had. The last column is about the long-run '
                "amplitude of a wandering motor, of which 2 s show little. Nothing is promised for it: repeats are "
                "for that.",
            ),
            Table(
                "Gain of the paper's filters (order 4, Q 30: assumed)",
                ("Hz", "forwards and backwards", "forwards"),
                tuple(gains),
            ),
            Table(
                "Level from repeats of 5 % scatter: how often the interval of 95 % holds the truth",
                (
                    "repeats of unit and motor",
                    "log-ratio and Student's t, %",
                    "mean of ratios +- SD, %",
                    "half-width, %",
                ),
                tuple((f"{r[0]} + {r[0]}", 100 * r[1], 100 * r[2], 100 * r[3]) for r in repeats),
            ),
        ),
        plots=(
            Plot(
                "Chains: median error against run time",
                "ms",
                "median error, %",
                {str(row[0]): ((row[4], max(row[1], 1e-4)),) for row in rows},
                lines=False,
                frontier=True,
            ),
            Plot(
                "Gain of the paper's filters",
                "Hz",
                "gain",
                {
                    "forwards and backwards": tuple((hz, max(bandpass.gain(hz), 1e-4)) for hz in _FINE_HZ),
                    "forwards": tuple((hz, max(bandpass.gain(hz) ** 0.5, 1e-4)) for hz in _FINE_HZ),
                },
                curves=("forwards and backwards", "forwards"),
                linear_x=True,
            ),
        ),
        promises=(
            *(Promise(f"`line`, {c.name}: error over the Cramer-Rao bound, rms", c.over_bound, 1.2) for c in coverage),
            *(
                Promise(f"`line`, {c.name}: part of the records outside 2 u", round(1 - c.covered, 6), 0.06)
                for c in coverage
            ),
            *(
                Promise(f"`line`, {c.name}: largest error over u, of {trials} records", c.furthest, 4.5)
                for c in coverage
            ),
            *(Promise(f"level from {r[0]} + {r[0]}: part outside 95 %", round(1 - r[1], 6), 0.06) for r in repeats),
            *(Promise(f"level from {r[0]} + {r[0]}: part within 95 %", r[1], 0.98) for r in repeats),
            Promise("bandpass: gain at 100 Hz", bandpass.gain(100.0), 1e-6),
        ),
        measured={**machine("numpy", "scipy"), "records": trials, "seed": SEED},
        summary=_summary(rows, coverage),
    )


def _summary(rows: list, coverage: list[Coverage]) -> Summary:
    """Return the chain with the smallest median error, and the record on which `line` is farthest off."""
    name, median, _, _, ms = min(rows, key=lambda row: row[1])
    worst = max(coverage, key=lambda one: one.highest)
    return Summary(
        (
            (
                f"amplitude from a record of {LENGTH_S:g} s",
                f"{shown(median)} %, median",
                f"chain {name}: {shown(ms)} ms",
            ),
        ),
        f"`line`, {worst.name}: {shown(100 * worst.highest)} %, 95th percentile",
        0,
    )


_GAIN_HZ = (95.0, 98.0, 99.0, 100.0, 101.0, 102.0, 105.0, 125.0, 150.0)
_FINE_HZ = tuple(round(90 + 0.25 * i, 2) for i in range(281))


def _chain_errors(trials: int) -> tuple[int, list[tuple[str, float, float, float, float]]]:
    """Return per chain: name, median and 95th percentile of the error, the worst one near 100 and 150 Hz, in %; ms."""
    far = [_record(WHOLE, i) for i in range(trials)]
    near = []
    for i in range(max(trials // 4, 25)):
        rng = np.random.default_rng([SEED, 1, i])
        hz = float(rng.choice([100.0, 150.0]) + rng.uniform(-1, 1))
        near.append(synthetic(WHOLE, rng, _amplitude(rng), hz))
    rows = []
    for name, chain in CHAINS.items():
        seconds, errors = [], []
        for record in far:
            began = PROCESSOR()
            found = chain(record.x, RATE)
            seconds.append(PROCESSOR() - began)
            errors.append(100 * abs(found / record.amplitude - 1))
        beside = [100 * (chain(record.x, RATE) / record.amplitude - 1) for record in near]
        worst = max(beside, key=abs)
        rows.append(
            (name, float(np.median(errors)), float(np.percentile(errors, 95)), worst, 1e3 * float(np.median(seconds)))
        )
    return len(near), rows


def _amplitude(rng: np.random.Generator) -> float:
    """Draw an amplitude of 12 to 300, in um."""
    return float(np.exp(rng.uniform(np.log(12), np.log(300))))


def _record(scenario: Scenario, index: int) -> Synthetic:
    rng = np.random.default_rng([SEED, 0, index])
    return synthetic(scenario, rng, _amplitude(rng), float(rng.uniform(100, 150)))


def _coverage(scenario: Scenario, trials: int) -> Coverage:
    """Return a scenario's errors, without the records that can't tell their line from the mains."""
    errors, over_u, bounds, hits, long_run = [], [], [], 0, 0
    for i in range(trials):
        rng = np.random.default_rng([SEED, 2, i])
        amplitude, hz = _amplitude(rng), float(rng.uniform(100, 150))
        record = synthetic(scenario, rng, amplitude, hz)
        fit = fit_line(record.x, RATE)
        if fit and fit.mains_hz:
            continue
        bounds.append(amplitude_bound(scenario, hz))
        if fit is None:
            errors.append(1.0)
            over_u.append(float("inf"))
            continue
        errors.append(fit.amplitude / record.amplitude - 1)
        over_u.append(abs(fit.amplitude - record.amplitude) / fit.u)
        hits += abs(fit.amplitude - record.amplitude) <= 2 * fit.u
        long_run += abs(fit.amplitude - amplitude) <= 2 * fit.u
    size = np.abs(errors)
    return Coverage(
        scenario.name, float(np.median(size)), float(np.percentile(size, 95)), float(np.median(bounds)),
        float(np.sqrt(np.mean((size / bounds) ** 2))), max(over_u), hits / len(errors), long_run / len(errors),
    )  # fmt: skip


def _level_coverage(count: int, trials: int) -> tuple[int, float, float, float]:
    """Return how often the interval of a level from repeats holds the truth, how often mean and SD do, its width."""
    rng = np.random.default_rng([SEED, 3, count])
    hits, plain, widths = 0, 0, []
    for _ in range(trials):
        unit, motor = np.exp(SCATTER * rng.standard_normal((2, count)))
        found = level(list(0.4 * unit), list(motor))
        hits += found.low <= 0.4 <= found.high
        ratios = 0.4 * unit / motor
        plain += abs(ratios.mean() - 0.4) <= ratios.std(ddof=1)
        widths.append((found.high - found.low) / 2 / found.value)
    return count, hits / trials, plain / trials, float(np.median(widths))
