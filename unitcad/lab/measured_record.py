"""One record measured: its sections fitted and judged, its line as displacement by each chain of the campaign."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from unitcad.files import sha256
from unitcad.geometry.arrays import Floats
from unitcad.lab import record_findings
from unitcad.lab.campaign import Campaign, SensorTable
from unitcad.lab.chains.chain import Chain
from unitcad.lab.chains.clipping import clip_mask
from unitcad.lab.chains.demodulation import spectrum
from unitcad.lab.chains.line import Mains
from unitcad.lab.chains.line_fit import Line, LineFit
from unitcad.lab.chains.signal_chains import chains_of
from unitcad.lab.lab_rules import LabFinding, found
from unitcad.lab.own_recordings import own_keys, recording_of
from unitcad.lab.record_result import RecordResult
from unitcad.lab.record_sections import (
    Section,
    by_chain,
    by_line,
    displacement,
    fit_section,
    over_motor,
    ratio_to_motor,
    together,
)
from unitcad.lab.signals import IRREGULAR, Signal, open_signal

LEAST_GAIN = 0.9
HIGHEST_HZ = 500.0
"""Where a record's spectrum ends, in Hz."""


def measure_record(
    path: Path,
    role: str,
    campaign: Campaign,
    sensors: tuple[SensorTable, ...],
    mains: tuple[Mains, ...],
    band: tuple[float, float],
    shown: str,
    lines: int = 1,
) -> RecordResult:
    """Return a record's figures by every chain of the campaign; `mains` and `sensors` are the unit's, then the motor's.

    `band` is where its line is looked for, in Hz; `lines` how many it is expected to have.
    Raises Refusal for what can't be read.
    """
    with own_keys(campaign.recording, shown):
        signal = open_signal(path, recording_of(campaign.recording, shown), sensors, shown)
    chains = chains_of(campaign.chain)
    names = (shown, f"{shown}, motor")
    sections: list[Section] = []
    clipped = [float("inf")] * len(sensors)
    silent: list[tuple[float, int]] = []
    outside: float | None = None
    at_s = 0.0
    picture: tuple[Floats, Floats, Floats, Floats] = (none := np.empty(0), none, none, none)
    for samples in signal.sections():
        one = fit_section(samples, signal.rate, band, mains, sensors, chains)
        frequency, size = _low_spectrum(samples[:, 0], signal.rate)
        if not len(picture[0]):
            picture = (np.arange(len(samples)) / signal.rate, samples[:, 0].copy(), frequency, size)
        if isinstance(one, Section):
            sections.append(one)
            parts = [one.fit.clipped, *([one.motor.clipped] if one.motor else [])]
            hertz = one.fit.frequency_hz
            outside = outside or record_findings.stronger_outside(
                frequency, size, hertz, campaign.chain.band_hz, campaign.chain.mains_hz
            )
        else:
            parts = [_clipped(channel) for channel in samples.T]
            silent.append((at_s, one))
        clipped = [min(pair) for pair in zip(clipped, parts, strict=True)]
        at_s += len(samples) / signal.rate
    shared = (shown, sha256(path), role, signal.raw_rate, signal.count)
    findings: list[LabFinding] = []
    if signal.off_grid > IRREGULAR:
        findings.append(found("L103", shown, f"a time lies {signal.off_grid:.2g} steps off an even grid"))
    for part, gaps, where in zip(clipped, signal.missing, names, strict=False):
        findings += record_findings.clipping(part, where)
        findings += record_findings.missing(gaps, signal.count, where)
    if not sections:
        where = names[silent[0][1]] if silent else shown
        message = f"nothing between {band[0]:.4g} and {band[1]:.4g} Hz"
        findings.append(found("L111", where, message + _hint(picture, band, campaign)))
        return RecordResult(
            *shared, amplitude_um=0.0, u_um=0.0, shared=0.0, frequency_hz=0.0, drift=0.0, snr=0.0, steady_s=0.0,
            masked=0.0, lines=(), ratio=None, lag_deg=None, by_chain={}, by_line=(), gains={},
            findings=tuple(findings), usable=False, unit=sensors[0].unit, picture=picture,
        )  # fmt: skip
    counts = [one.count for one in sections]
    fit = together([one.fit for one in sections], counts)
    motors = [one.motor for one in sections if one.motor]
    motor = together(motors, counts) if motors else None
    findings += [
        replace(one, message=one.message + _hint(picture, band, campaign))
        if (one.code, one.where) == ("L111", shown)
        else one
        for one in _of_lines(fit, motor, signal, names, mains, lines)
    ]
    steady = sum(one.fit.end_s - one.fit.start_s for one in sections)
    if not any(one.severity == "error" for one in findings):
        findings += record_findings.short_of_steady(steady, sum(counts) / signal.rate, shown)
    if silent:
        count = len(sections) + len(silent)
        message = f"{len(silent)} of {count} sections, the first from {silent[0][0]:.0f} s of {at_s:.0f} s"
        findings.append(found("L113", shown, message))
    if outside is not None:
        findings.append(found("L117", shown, f"a stronger line lies at about {outside:.0f} Hz, outside chain.band_hz"))
    factor = displacement(sensors[0], fit.frequency_hz) / signal.gain(fit.frequency_hz)
    ratio, lag = ratio_to_motor(sections, sensors, fit.frequency_hz)
    values, more = _values(sections, chains, factor if motor is None else over_motor(campaign, fit.frequency_hz), fit)
    whole = fit.amplitude * factor if ratio is None else ratio
    if "line" in values:
        values["line"] = whole
    findings += [found(code, shown, message) for code, message in more]
    return RecordResult(
        *shared,
        amplitude_um=fit.amplitude * factor,
        u_um=fit.u * factor,
        shared=float(np.hypot(fit.u_mains / fit.amplitude, motor.u_mains / motor.amplitude if motor else 0.0)),
        frequency_hz=fit.frequency_hz,
        drift=fit.drift,
        snr=fit.snr,
        steady_s=steady,
        masked=fit.masked,
        lines=tuple(Line(one.frequency_hz, one.amplitude * factor, one.u * factor) for one in fit.lines),
        ratio=ratio,
        lag_deg=lag,
        by_chain=values,
        by_line=by_line(sections, campaign, factor, whole, fit),
        gains={chain.name: chain.gain(fit.frequency_hz) for chain in chains if chain.gain},
        findings=tuple(findings),
        usable=not any(one.severity == "error" for one in findings),
        unit=sensors[0].unit,
        picture=picture,
    )


def _of_lines(
    fit: LineFit, motor: LineFit | None, signal: Signal, names: tuple[str, str], mains: tuple[Mains, ...], lines: int
) -> list[LabFinding]:
    """Return what is wrong with the line of the unit and with that of the motor."""
    out = record_findings.of_line(fit, signal.rate, signal.raw_rate, names[0], mains[0], lines)
    if motor is not None:
        unlike = ("L102", "L108")  # of the rate and the span, which are the same
        judged = record_findings.of_line(motor, signal.rate, signal.raw_rate, names[1], mains[1], lines)
        out += [one for one in judged if one.code not in unlike]
    return out


def _values(
    sections: list[Section], chains: tuple[Chain, ...], factor: float, fit: LineFit
) -> tuple[dict[str, float], list[tuple[str, str]]]:
    """Return the amplitude by each chain that the record is fit for, and the codes and messages of what is not."""
    values, reasons = by_chain(sections, chains, factor)
    findings = []
    for chain in chains:
        gain = chain.gain(fit.frequency_hz) if chain.gain else 1.0
        if gain < LEAST_GAIN:
            values.pop(chain.name, None)
            message = f"the filters of the chain {chain.name} pass {gain:.3f} of {fit.frequency_hz:.2f} Hz"
            findings.append(("L106", message))
    findings += [("L114", f"{name}: {reason}") for name, reason in reasons.items()]
    return values, findings


def _hint(picture: tuple[Floats, Floats, Floats, Floats], band: tuple[float, float], campaign: Campaign) -> str:
    """Return where the strongest line outside a searched band lies, as the end of a message; empty without one."""
    hertz = record_findings.strongest_outside(*picture[2:], band, campaign.chain.mains_hz)
    return f"; the strongest line outside that is at about {hertz:.0f} Hz" if hertz else ""


def _clipped(samples: Floats) -> float:
    good = np.isfinite(samples)
    if good.sum() < 16 or not np.ptp(samples[good]) > 0:
        return float("inf")
    return clip_mask(np.where(good, samples - np.median(samples[good]), 0.0), good)[2]


def _low_spectrum(samples: Floats, rate: float) -> tuple[Floats, Floats]:
    """Return frequency and amplitude of a section up to HIGHEST_HZ, samples that are missing taken as zero."""
    frequency, size = spectrum(np.where(np.isfinite(samples), samples, 0.0), rate)
    low = frequency <= min(HIGHEST_HZ, rate / 2)
    return frequency[low], size[low]
