"""Chains that others use, beside this program's two: a spectrum's peak, a flat-top window, a lock-in."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from unitcad.geometry.arrays import Floats
from unitcad.lab.chains import Chain, ChainTable, bandpass, line
from unitcad.lab.chains.line import fit_line

BAND_HZ = (60.0, 250.0)


def fft_peak(x: Floats, rate: float) -> float:
    """Return the largest amplitude of the plain spectrum in the band."""
    frequency = np.fft.rfftfreq(len(x), 1 / rate)
    size = 2 * np.abs(np.fft.rfft(x)) / len(x)
    return float(size[(frequency > BAND_HZ[0]) & (frequency < BAND_HZ[1])].max())


def flat_top(x: Floats, rate: float) -> float:
    """Return the largest amplitude of the spectrum with a flat-top window, which forgives a line between two bins."""
    from scipy.signal.windows import flattop

    window = flattop(len(x), sym=False)
    frequency = np.fft.rfftfreq(len(x), 1 / rate)
    size = 2 * np.abs(np.fft.rfft(x * window)) / window.sum()
    return float(size[(frequency > BAND_HZ[0]) & (frequency < BAND_HZ[1])].max())


def lock_in(x: Floats, rate: float) -> float:
    """Return the product with a carrier at the spectrum's peak, of fixed frequency, averaged over the inner 80 %."""
    from unitcad.lab.chains.line import coarse_frequency

    frequency = coarse_frequency(x, rate, BAND_HZ, 50.0)
    inner = slice(len(x) // 10, len(x) - len(x) // 10)
    window = np.hanning(len(x[inner]))
    turned = x[inner] * np.exp(-2j * np.pi * frequency * np.arange(len(x))[inner] / rate)
    return float(2 * abs(np.sum(turned * window)) / window.sum())


def _of(chain: Chain) -> Callable[[Floats, float], float]:
    """Return a chain's amplitude of a record; 0 where there is no line."""

    def amplitude(x: Floats, rate: float) -> float:
        fit = fit_line(x, rate)
        return chain.amplitude(x, rate, fit) if fit else 0.0

    return amplitude


CHAINS: dict[str, Callable[[Floats, float], float]] = {
    "bandpass, zero-phase, half peak-to-peak, whole record": partial(
        bandpass.amplitude, ChainTable(measure="peak", trim_s=0.0)
    ),
    "same, ends trimmed": partial(bandpass.amplitude, ChainTable(measure="peak")),
    "bandpass, zero-phase, RMS, trimmed": partial(bandpass.amplitude, ChainTable()),
    "bandpass, causal, RMS, trimmed": partial(bandpass.amplitude, ChainTable(zero_phase=False)),
    "FFT peak, rectangular window": fft_peak,
    "FFT, flat-top window": flat_top,
    "lock-in, fixed frequency": lock_in,
    "line": _of(line.chain(ChainTable())),
}
