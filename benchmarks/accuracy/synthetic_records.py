"""Records of a motor with known truth: drift, wander, mains, harmonics, spin-up, drop-outs, clipping, noise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from unitcad.geometry.arrays import Floats

RATE = 2000.0
LENGTH_S = 2.0


@dataclass(frozen=True)
class Scenario:
    """What a record has beside its line; amplitudes are parts of the line's amplitude.

    `snr` is the line's amplitude over the noise's standard deviation; `red` the part of the noise whose density falls
    with the frequency; `drift` the change of the frequency over the record, relative; `wander` the standard deviation
    of the amplitude's slow change, of 0.3 s correlation; `mains` the amplitudes at 50, 100, 150 Hz; `spin_up_s` the
    time constant of the start; `dropouts` their number a second; `clip` the level at which the signal is cut off.
    """

    name: str
    snr: float = 30.0
    red: float = 0.0
    drift: float = 0.0
    wander: float = 0.0
    mains: tuple[float, float, float] = (0.0, 0.0, 0.0)
    harmonics: tuple[float, float] = (0.0, 0.0)
    spin_up_s: float = 0.0
    dropouts: float = 0.0
    clip: float = 0.0


PLAIN = Scenario("white noise")
WHOLE = Scenario(
    "all at once", drift=0.004, wander=0.01, mains=(0.05, 0.02, 0.02), harmonics=(0.1, 0.05), spin_up_s=0.05
)
SCENARIOS = (
    PLAIN,
    replace(PLAIN, name="noise of a third of the amplitude", snr=3.0),
    replace(PLAIN, name="noise that falls with frequency", snr=10.0, red=1.0),
    replace(PLAIN, name="frequency drifts by 3 %", drift=0.03),
    replace(PLAIN, name="amplitude wanders by 1 %", wander=0.01),
    replace(PLAIN, name="mains and harmonics", mains=(0.1, 0.03, 0.03), harmonics=(0.2, 0.1)),
    replace(PLAIN, name="8 drop-outs a second", dropouts=8.0),
    WHOLE,
)


@dataclass(frozen=True)
class Synthetic:
    """Samples x (n), and the truth: the amplitude's mean over the record once the motor runs, and its frequency."""

    x: Floats
    amplitude: float
    frequency_hz: float


def synthetic(
    scenario: Scenario,
    rng: np.random.Generator,
    amplitude: float = 1.0,
    frequency_hz: float = 125.0,
    rate: float = RATE,
    length_s: float = LENGTH_S,
) -> Synthetic:
    """Return a record of a scenario. The same generator's state gives the same record."""
    count = round(rate * length_s)
    time = np.arange(count) / rate
    sweep = frequency_hz * (1 + scenario.drift * (time / length_s - 0.5))
    phase = 2 * np.pi * np.cumsum(sweep) / rate + rng.uniform(0, 2 * np.pi)
    wander = 1 + scenario.wander * _slow(rng, count, rate)
    start = 1 - np.exp(-time / scenario.spin_up_s) if scenario.spin_up_s else np.ones(count)
    x = np.cos(phase)
    for k, part in enumerate(scenario.harmonics, 2):
        x = x + part * np.cos(k * phase + rng.uniform(0, 2 * np.pi))
    x = amplitude * wander * start * x
    for k, part in enumerate(scenario.mains, 1):
        x = x + amplitude * part * np.cos(2 * np.pi * 50.0 * k * time + rng.uniform(0, 2 * np.pi))
    x = x + amplitude / scenario.snr * _noise(rng, count, scenario.red)
    if scenario.clip:
        x = np.clip(x, -scenario.clip * amplitude, scenario.clip * amplitude)
    if scenario.dropouts:
        for at in rng.uniform(0, length_s, rng.poisson(scenario.dropouts * length_s)):
            first = int(at * rate)
            x[first : first + int(rng.integers(1, 7))] += rng.choice([-1, 1]) * amplitude * rng.uniform(2, 6)
    running = start > 0.99
    return Synthetic(x, float(amplitude * np.mean(wander[running])), frequency_hz)


def _slow(rng: np.random.Generator, count: int, rate: float) -> Floats:
    """Return a process of unit variance, correlated over about 0.3 s."""
    from scipy.signal import lfilter

    lead = int(3 * rate)
    keep = np.exp(-1 / (0.3 * rate))
    noise = lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.standard_normal(count + lead))[lead:]
    return np.asarray(noise)


def _noise(rng: np.random.Generator, count: int, red: float) -> Floats:
    """Return white noise of unit variance, or a mixture whose amplitude falls as 1/sqrt(f) to the part `red`."""
    white = rng.standard_normal(count)
    if not red:
        return white
    bins = np.fft.rfft(white)
    shape = 1 / np.sqrt(np.maximum(np.arange(len(bins)), 1))
    shape /= np.sqrt(np.mean(shape[1:] ** 2))
    return (1 - red) * white + red * np.fft.irfft(bins * shape, count)
