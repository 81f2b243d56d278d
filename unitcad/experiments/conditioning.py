"""A rival's draws held to what has been measured: the nine levels of the catalogue's units.

A rival that holds also gives those levels, up to one factor, which cancels in every ratio. So a draw counts by the
likelihood of the levels' eight ratios. Each level has the reading's noise and the discrepancy's part that is its own,
together a standard deviation sigma. A rival may miss the levels by more than that, and by how much is not known: the
standard deviation is s sigma with s >= 1 and the density 1/s (Jeffreys). Integrated over s, with chi2 the sum of the
squared deviations over sigma^2 and n = 8 of them independent, a draw's weight is

    chi2^(-n/2) P(n/2, chi2/2)

with P the regularised lower incomplete gamma function: even where a draw explains the levels, a power of the misfit
where none does. The draws that predict anything else are taken from a larger pool in proportion to these weights.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import gammainc

from unitcad.attenuation.edge.measured_levels import measured_table
from unitcad.experiments.draws import Draws, Rival
from unitcad.experiments.lab_file import LabFile, with_ranges
from unitcad.experiments.measured_units import measured_variants

POOL, COSTLY_POOL = 16, 4
"""Draws of the pool for each one that is kept, where a draw is cheap and where it is costly."""
_LEAST = 1e-9
FEW = 5.0
"""Effective draws below which what stands on them is said to."""


@dataclass(frozen=True)
class Held:
    """Draws with their shares, (draws,), summing to 1.

    effective  how many equal draws the pool's weights are worth; None: the draws are held to nothing
    misses     the factor by which they miss the levels, root mean square of the logarithm by the weights
    """

    draws: Draws
    shares: np.ndarray
    effective: float | None = None
    misses: float | None = None


def drawn(rival: Rival, settings: LabFile, step: Callable[[str], None] = lambda stage: None) -> Held:
    """Return a rival's draws as a lab's settings ask for: held to the measured levels, or its prior."""
    count = settings.element_draws if rival.costly else settings.draws
    if not settings.held_to_levels:
        return Held(Draws(count, settings.seed, rival.name), np.full(count, 1.0 / count))
    pool = Draws((COSTLY_POOL if rival.costly else POOL) * count, settings.seed, rival.name, held=True)
    off = misfits(rival, pool, settings, step)
    sigma = np.sqrt(settings.noise**2 + settings.discrepancy**2 / 2.0)
    weights = weights_of(np.sum(off**2, axis=1) / sigma**2, off.shape[1] - 1)
    # In an order of chance: neighbours of a pool that is spread evenly differ by a rule.
    order = np.random.default_rng(settings.seed).permutation(len(weights))
    ends = np.cumsum(weights[order])
    taken = order[np.searchsorted(ends / ends[-1], (np.arange(count) + 0.5) / count)]
    kept, counts = np.unique(taken, return_counts=True)
    return Held(
        replace(pool, kept=tuple(int(index) for index in kept)),
        counts / count,
        float(1.0 / np.sum(weights**2)),
        float(np.exp(np.sqrt(weights @ np.mean(off**2, axis=1)))),
    )


def misfits(
    rival: Rival, draws: Draws, settings: LabFile, step: Callable[[str], None] = lambda stage: None
) -> np.ndarray:
    """Return log level over measured level, (draws, units), each draw's mean taken off."""
    logs, table = [], measured_table()
    for i, (name, shapes) in enumerate(zip(table.names, measured_variants(), strict=True)):
        step(f"{rival.name}: {name}, as measured ({i + 1} of {len(table.names)})")
        ranged = [with_ranges(variant, settings.modulus_factor) for variant in shapes]
        logs.append(np.mean([np.log(rival.levels(variant, draws)) for variant in ranged], axis=0))
    off = np.stack(logs, axis=-1) - np.log(table.levels)
    return off - off.mean(axis=1, keepdims=True)


def weights_of(chi2: np.ndarray, independent: int) -> np.ndarray:
    """Return the weights of draws, summing to 1, from their sums of squares, of which so many are independent.

    A draw without an answer counts nothing; all count alike where none has one.
    """
    power, known = independent / 2.0, np.isfinite(chi2)
    if not known.any():
        return np.full(len(chi2), 1.0 / len(chi2))
    squares = np.maximum(np.where(known, chi2, np.inf), _LEAST)
    likelihood = np.where(known, (squares / squares.min()) ** -power * gammainc(power, squares / 2.0), 0.0)
    return likelihood / likelihood.sum()
