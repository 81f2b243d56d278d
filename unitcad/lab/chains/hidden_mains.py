"""Mains too close to a line to be told from it by their frequency: what a motor-off record says of them settles it.

The mains then have a known amplitude and any phase: a Gaussian prior of both quadratures (half the amplitude's square
each). Fitted with them, on the demodulated line, are its amplitude, its phase (a polynomial), and a slow wander of its
amplitude, which looks like the mains' beat. How wandering the amplitude is, and how curved the phase, is what makes the
record most probable (MacKay 1992). What the record does not say of the mains, the prior does.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from unitcad.geometry.arrays import Floats

BLOCK_S = 0.02
"""Length of the blocks of the demodulated line: the mains' beat is slow."""
DEGREES = (1, 2, 4)
MOST_TURN = 0.6
"""rad by which a polynomial may miss the phase before it is tried."""
WANDERS = (0.0, 0.001, 0.003, 0.01, 0.03, 0.1)
TIMES_S = (0.1, 0.3, 1.0)
"""Relative standard deviations of the amplitude that are tried, and their correlation times."""
FASTEST_HZ, MOST_WAVES = 5.0, 60
STEPS = 3


@dataclass(frozen=True)
class Hidden:
    """Mains beside a line: cosine and sine at their frequency, and the standard uncertainty left in the amplitude."""

    cosine: float
    sine: float
    u: float


@dataclass(frozen=True)
class _Fitted:
    probability: float
    values: Floats
    u: float


def hidden_mains(
    line: NDArray[np.complex128], time: Floats, angle: Floats, noise: Floats, hertz: float, amplitude: float, free: bool
) -> Hidden:
    """Return the mains of `amplitude` at `hertz` beside a line, by its complex amplitude in blocks (n) at `time` in s.

    `angle` (n) is the phase by which the line was demodulated, in rad, and `noise` (n) the standard deviation of a
    block's quadrature. `free`: that phase was fitted to the line, and may hold what is the mains'; or else it is known.
    """
    middle, half = (time[0] + time[-1]) / 2, max(float(np.ptp(time)) / 2, 1e-9)
    at = (time - middle) / half
    bases = [(angle, 0)]
    if free:
        polynomials = [np.polynomial.Polynomial.fit(at, angle, degree)(at) for degree in DEGREES]
        bases = [(p, d) for p, d in zip(polynomials, DEGREES, strict=True) if np.ptp(p - angle) < MOST_TURN]
        bases = bases or [(angle, DEGREES[-1])]
    best: _Fitted | None = None
    for base, degree in bases:
        for _ in range(STEPS if degree else 1):
            turned = line * np.exp(1j * (angle - base))
            powers = at ** np.arange(1, degree + 1)[:, None]
            beat = np.exp(1j * (2 * np.pi * hertz * time - base))
            found = max(
                (_fit(turned, noise, powers, beat, amplitude, waves) for waves in _waves(time, half)),
                key=lambda one: one.probability,
            )
            base = base + found.values[3 : 3 + degree] @ powers / found.values[0] if degree else base
        if best is None or found.probability > best.probability:
            best = found
    assert best is not None
    return Hidden(float(best.values[1]), float(best.values[2]), best.u)


def _waves(time: Floats, half: float) -> Iterator[Floats]:
    """Yield the cosines, scaled by their deviations, that make a wander of the amplitude of mean 0; (0, n) for none."""
    yield np.empty((0, len(time)))
    length = 2 * half
    count = min(int(2 * length * FASTEST_HZ), MOST_WAVES)
    order = np.arange(1, count + 1)
    cosines = np.sqrt(2) * np.cos(np.pi * order[:, None] * (time - time[0]) / length)
    for time_s in TIMES_S:
        density = 2 * time_s / (1 + (np.pi * order / length * time_s) ** 2)
        for wander in WANDERS[1:]:
            yield cosines * wander * np.sqrt(density / length)[:, None]


def _fit(
    line: NDArray[np.complex128],
    noise: Floats,
    powers: Floats,
    beat: NDArray[np.complex128],
    amplitude: float,
    waves: Floats,
) -> _Fitted:
    """Return amplitude, the mains' cosine and sine, phase and wander, with the logarithm of their probability."""
    size = abs(complex(np.mean(line)))
    columns = np.concatenate([np.ones((1, len(line))), beat[None], -1j * beat[None], 1j * powers, size * waves])
    deviations = np.concatenate(
        [[10 * size], np.full(2, amplitude / np.sqrt(2)), np.full(len(powers), size), np.ones(len(waves))]
    )
    scaled = columns / noise * deviations[:, None]
    rows = np.concatenate([scaled.real, scaled.imag], axis=1)
    data = np.concatenate([line.real, line.imag]) / np.concatenate([noise, noise])
    gram = rows @ rows.T + np.eye(len(rows))
    right = rows @ data
    solved = np.linalg.solve(gram, right)
    probability = -0.5 * float(data @ data - right @ solved) - 0.5 * float(np.linalg.slogdet(gram)[1])
    rest = [0, *range(3, len(gram))]
    both, alone = np.linalg.inv(gram)[0, 0], np.linalg.inv(gram[np.ix_(rest, rest)])[0, 0]
    return _Fitted(probability, solved * deviations, float(deviations[0] * np.sqrt(max(both - alone, 0.0))))
