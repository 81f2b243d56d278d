"""What is wrong with a record: judged by the fit of its line, its samples and its spectrum."""

from __future__ import annotations

import numpy as np

from unitcad.geometry.arrays import Floats
from unitcad.lab.chains.clipping import LOWEST
from unitcad.lab.chains.line import Mains
from unitcad.lab.chains.line_fit import LineFit
from unitcad.lab.lab_rules import LabFinding, found

MOST_SCATTER = MOST_DRIFT = 0.05
LEAST_PERIODS, NO_PERIODS = 20, 5
MOST_MASKED = 0.1
LEAST_STEADY = 0.5
"""Part of a record that its steady part is at least: a motor that spins up and runs leaves more of 2 s."""
LEAST_SNR = 10.0
LEAST_OVER_U = 5
"""The strongest of the 400 bins of noise in a band of 190 Hz over 2 s is above 4 in a record of ten, above 5 in few of
a thousand.
"""
TREMOR_HZ = 20


def clipping(part: float, where: str) -> list[LabFinding]:
    """Return the finding of a channel that is cut off at `part` of its amplitude; infinite where it is not."""
    if part == np.inf:
        return []
    return [found("L101", where, f"at about {part:.2f} of the amplitude", "error" if part < LOWEST else "warning")]


def missing(count: int, samples: int, where: str) -> list[LabFinding]:
    """Return the finding of a channel of which `count` of the `samples` are no numbers."""
    if not count:
        return []
    message = f"{count} of {samples} samples ({count / samples:.2g} of them) are no numbers"
    return [found("L119", where, message, "error" if count > MOST_MASKED * samples else "warning")]


def short_of_steady(steady_s: float, length_s: float, where: str) -> list[LabFinding]:
    """Return the finding of a record of which only a small part is steady, and was used."""
    if steady_s >= LEAST_STEADY * length_s:
        return []
    return [found("L107", where, f"steady for {steady_s:.2f} s of {length_s:.2f} s; only that part was used")]


def of_line(fit: LineFit, rate: float, raw_rate: float, where: str, mains: Mains, lines: int = 1) -> list[LabFinding]:
    """Return what is wrong with a line, in the order of the codes, beside clipping; `lines` are expected.

    Of a channel that is clipped beyond repair nothing is said that follows from it: its fit leaves much, and changes.
    """
    out = []
    hertz = fit.frequency_hz
    cut_off = fit.clipped < LOWEST
    if fit.masked > MOST_MASKED and not cut_off:
        out.append(found("L110", where, f"{fit.masked:.0%} of the samples were left out"))
    own = float(np.sqrt(max(fit.u**2 - fit.u_mains**2, 0.0))) if fit.snr < 1 else fit.u_noise
    if fit.amplitude < LEAST_OVER_U * own and not cut_off:  # nothing else can be said of a line that is not there
        return [*out, found("L111", where, f"the strongest has {fit.amplitude / own:.1f} times its uncertainty")]
    if raw_rate < 4 * hertz:
        out.append(found("L102", where, f"{raw_rate:g} Hz for a line at {hertz:.1f} Hz"))
    if fit.mains_hz:
        known = "its part is in the uncertainty" if mains.blank else "without a [blank] its part is not known"
        out.append(found("L105", where, f"{hertz:.2f} Hz beside {fit.mains_hz:g} Hz: {known}"))
    periods = (fit.end_s - fit.start_s) * hertz
    if periods < LEAST_PERIODS:
        severity = "error" if periods < NO_PERIODS else "warning"
        out.append(found("L108", where, f"{periods:.0f} periods in the steady part", severity))
    if not cut_off:
        out += _of_steadiness(fit, rate, where, lines)
    return sorted(out, key=lambda one: one.code)


def _of_steadiness(fit: LineFit, rate: float, where: str, lines: int) -> list[LabFinding]:
    out = []
    if max(len(fit.lines), 1) != lines:
        there = [(one.frequency_hz, one.amplitude / fit.amplitude) for one in fit.lines] or [(fit.frequency_hz, 1.0)]
        listed = ", ".join(f"{hertz:.2f} Hz ({part:.2f})" for hertz, part in there)
        expected = f", {lines} expected" if lines > 1 else ""
        out.append(found("L104", where, f"{len(there)} line{'s' if len(there) > 1 else ''}{expected}: {listed}"))
    noise = np.sqrt(2 / max(0.2 * rate, 1)) / fit.snr
    scatter = float(np.sqrt(max(fit.scatter**2 - noise**2, 0.0)))
    if not fit.lines and (scatter > MOST_SCATTER or fit.drift > MOST_DRIFT):
        out.append(found("L107", where, f"amplitude varies by {scatter:.1%}, frequency by {fit.drift:.1%}"))
    if 2 * fit.u > fit.amplitude:
        message = f"twice the uncertainty is {2 * fit.u / fit.amplitude:.1f} times the amplitude"
        out.append(found("L118", where, message, "error"))
    elif fit.snr < LEAST_SNR:
        out.append(found("L118", where, f"the amplitude is {fit.snr:.1f} times the noise's standard deviation"))
    return out


def strongest_outside(
    frequency: Floats, size: Floats, band: tuple[float, float], mains_hz: float, own_hz: float | None = None
) -> float | None:
    """Return the frequency of the strongest line outside a band; None where all is noise there.

    `frequency` and `size` are a spectrum. The mains are no line, and neither are harmonics of a line at `own_hz`.
    """
    near = _near(frequency)
    outside = (frequency > TREMOR_HZ) & ((frequency < band[0] - near) | (frequency > band[1] + near))
    outside &= np.abs(frequency - mains_hz * np.round(frequency / mains_hz)) > near
    if own_hz is not None:
        harmonic = np.abs(frequency - own_hz * np.round(frequency / own_hz)) <= near
        outside &= (frequency < 1.5 * own_hz) | ~harmonic
    if not outside.any():
        return None
    at = int(np.argmax(np.where(outside, size, 0.0)))
    return float(frequency[at]) if size[at] > 8 * float(np.median(size[outside])) else None


def stronger_outside(
    frequency: Floats, size: Floats, hertz: float, band: tuple[float, float], mains_hz: float
) -> float | None:
    """Return the frequency of a line outside the band above the one in it; the mains and its own harmonics are none.

    `frequency` and `size` are a spectrum.
    """
    own = np.abs(frequency - hertz) <= _near(frequency)
    other = strongest_outside(frequency, size, band, mains_hz, hertz)
    if other is None or not own.any():
        return None
    return other if size[np.searchsorted(frequency, other)] > float(size[own].max()) else None


def _near(frequency: Floats) -> float:
    """Return within which distance in Hz two lines of a spectrum are one."""
    return max(1.0, 3 * float(frequency[1] - frequency[0])) if len(frequency) > 1 else 1.0
