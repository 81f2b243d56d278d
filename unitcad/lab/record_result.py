"""One record measured: amplitude as displacement, by each chain, with what is wrong with it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from unitcad import files
from unitcad.errors import Refusal
from unitcad.geometry.arrays import Floats
from unitcad.lab.campaign import Campaign, SensorTable
from unitcad.lab.chains import least_squares
from unitcad.lab.chains.clipping import LOWEST, clip_mask
from unitcad.lab.chains.demodulation import spectrum
from unitcad.lab.chains.line import Mains, fit_line
from unitcad.lab.chains.line_fit import Line, LineFit
from unitcad.lab.chains.paper import PaperChain
from unitcad.lab.lab_rules import LabFinding, found
from unitcad.lab.quantities import to_si
from unitcad.lab.signals import IRREGULAR, Signal, open_signal

MOST_SCATTER = MOST_DRIFT = 0.05
LEAST_PERIODS, NO_PERIODS = 20, 5
MOST_MASKED = 0.1
LEAST_GAIN = 0.9
SAME_LINE_HZ = 0.5
TREMOR_HZ = 20
LEAST_OVER_U = 4
PAPER_MASKED = 2e-4
"""Part of the samples that may be left out of a record whose amplitude by `paper` counts: it has no robust step."""
MICRO = 1e6
_ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}


@dataclass(frozen=True)
class RecordResult:
    """A record's figures; amplitudes (peak) and standard uncertainties in um. `ratio` is to the motor's own channel.

    `usable`: it counts for levels. `by_chain` has each chain's amplitude over which a level is taken, without the
    chains that the record is not fit for; `by_line` the same of each line in the band by the chain `line`, with its
    frequency; `picture` the samples and the spectrum of its first section, in the sensor's unit.
    """

    file: str
    sha256: str
    role: str
    rate_hz: float
    samples: int
    amplitude_um: float
    u_um: float
    shared: float
    frequency_hz: float
    drift: float
    snr: float
    steady_s: float
    masked: float
    lines: tuple[Line, ...]
    ratio: float | None
    lag_deg: float | None
    by_chain: dict[str, float]
    by_line: tuple[tuple[float, float], ...]
    paper_gain: float | None
    findings: tuple[LabFinding, ...]
    usable: bool
    picture: tuple[Floats, Floats, Floats, Floats]

    def as_dict(self) -> dict[str, Any]:
        """Return JSON-ready data, six significant digits."""
        short = {key: _short(value) for key, value in vars(self).items() if isinstance(value, float | int | str)}
        short["by_chain"] = {name: _short(value) for name, value in self.by_chain.items()}
        short["lines"] = [
            {"frequency_hz": _short(one.frequency_hz), "amplitude": _short(one.amplitude), "u": _short(one.u)}
            for one in self.lines
        ]
        short["findings"] = [one.as_dict() for one in self.findings]
        return short


@dataclass(frozen=True)
class _Section:
    fit: LineFit
    motor: LineFit | None
    paper: float | str
    count: int


def measure_record(
    path: Path,
    role: str,
    campaign: Campaign,
    sensors: tuple[SensorTable, ...],
    mains: Mains,
    band: tuple[float, float],
    shown: str,
) -> RecordResult:
    """Return a record's figures by every chain of the campaign. Raises Refusal for what can't be read."""
    signal = open_signal(path, campaign.recording, sensors, shown)
    sections: list[_Section] = []
    findings: list[LabFinding] = []
    clipped = [float("inf")] * len(sensors)
    silent: list[tuple[float, str]] = []
    at_s = 0.0
    picture: Any = None
    for samples in signal.sections():
        one = _section(samples, signal, campaign, mains, band, sensors, shown)
        if picture is None:
            picture = _picture(samples[:, 0], signal.rate)
        if isinstance(one, _Section):
            sections.append(one)
            parts = [one.fit.clipped, *([one.motor.clipped] if one.motor else [])]
        else:
            parts = [_clipped(channel) for channel in samples.T]
            silent.append((at_s, one))
        clipped = [min(pair) for pair in zip(clipped, parts, strict=True)]
        at_s += len(samples) / signal.rate
    if picture is None:
        picture = (np.empty(0),) * 4
    shared = (shown, files.sha256(path), role, signal.raw_rate, signal.count)
    if signal.off_grid > IRREGULAR:
        findings.append(found("L103", shown, f"a time lies {signal.off_grid:.2g} steps off an even grid"))
    for part, where in zip(clipped, (shown, f"{shown}, motor"), strict=False):
        if part < np.inf:
            severity = "error" if part < LOWEST else "warning"
            findings.append(found("L101", where, f"at about {part:.2f} of the amplitude", severity))
    if not sections:
        where = silent[0][1] if silent else shown
        findings.append(found("L111", where, f"nothing between {band[0]:g} and {band[1]:g} Hz"))
        return _without_line(shared, tuple(findings), picture)
    fit = _together([one.fit for one in sections], [one.count for one in sections])
    findings += _line_findings(fit, signal, shown, mains)
    motors = [one.motor for one in sections if one.motor]
    shared_u = fit.u_mains / fit.amplitude
    if motors:
        motor = _together(motors, [one.count for one in sections])
        unlike = ("L102", "L108")  # of the rate and the span, which are the same
        judged = _line_findings(motor, signal, f"{shown}, motor", Mains(campaign.chain.mains_hz))
        findings += [one for one in judged if one.code not in unlike]
        shared_u = float(np.hypot(shared_u, motor.u_mains / motor.amplitude))
    if silent:
        count = len(sections) + len(silent)
        message = f"{len(silent)} of {count} sections, the first from {silent[0][0]:.0f} s of {at_s:.0f} s"
        findings.append(found("L113", shown, message))
    factor = _displacement(sensors[0], fit.frequency_hz) / signal.gain(fit.frequency_hz)
    outside = _stronger_outside(picture, fit.frequency_hz, campaign.chain.band_hz, campaign.chain.mains_hz)
    if outside is not None:
        findings.append(found("L117", shown, f"a stronger line lies at about {outside:.0f} Hz, outside chain.band_hz"))
    ratio, lag = _ratio(sections, sensors, fit.frequency_hz)
    chain = _paper(campaign)
    gain = chain.gain(fit.frequency_hz) if "paper" in campaign.chain.use else None
    if gain is not None and gain < LEAST_GAIN:
        findings.append(found("L106", shown, f"the filters pass {gain:.2g} of {fit.frequency_hz:.2f} Hz"))
    by_chain = {"line": fit.amplitude * factor if ratio is None else ratio}
    if gain is not None:
        reason = _unfit_for_paper(sections)
        if reason:
            findings.append(found("L114", shown, f"paper: {reason}"))
        elif gain >= LEAST_GAIN:
            values = [s.paper for s in sections if not isinstance(s.paper, str)]
            by_chain["paper"] = float(np.mean(values)) * (factor if ratio is None else 1.0)
    return RecordResult(
        *shared,
        amplitude_um=fit.amplitude * factor,
        u_um=fit.u * factor,
        shared=shared_u,
        frequency_hz=fit.frequency_hz,
        drift=fit.drift,
        snr=fit.snr,
        steady_s=sum(s.fit.end_s - s.fit.start_s for s in sections),
        masked=fit.masked,
        lines=tuple(Line(one.frequency_hz, one.amplitude * factor, one.u * factor) for one in fit.lines),
        ratio=ratio,
        lag_deg=lag,
        by_chain=by_chain,
        by_line=_by_line(sections, campaign, factor, by_chain["line"], fit),
        paper_gain=gain,
        findings=tuple(findings),
        usable=not any(one.severity == "error" for one in findings),
        picture=picture,
    )


def mains_of(paths: list[Path], campaign: Campaign) -> tuple[tuple[int, float], ...]:
    """Return the mains' amplitudes by multiple in motor-off records, the largest of all, in the sensor's unit."""
    hertz = campaign.chain.mains_hz
    largest: dict[int, float] = {}
    for path in paths:
        signal = open_signal(path, campaign.recording, (campaign.sensor,), path.name)
        samples = next(signal.sections())[:, 0]
        good = np.isfinite(samples)
        time = np.arange(len(samples)) / signal.rate
        orders = least_squares.mains_orders(hertz, signal.rate, (), float(time[-1]))
        columns = np.concatenate([least_squares.mains_columns(time, hertz, orders), least_squares.trend_columns(time)])
        values = least_squares.solve(columns, np.where(good, samples, 0.0), good.astype(float))
        for i, order in enumerate(orders):
            largest[order] = max(largest.get(order, 0.0), float(np.hypot(*values[2 * i : 2 * i + 2])))
    return tuple(sorted(largest.items()))


def _section(
    samples: Floats,
    signal: Signal,
    campaign: Campaign,
    mains: Mains,
    band: tuple[float, float],
    sensors: tuple[SensorTable, ...],
    shown: str,
) -> _Section | str:
    """Fit one section: the motor's channel first, where there is one, whose phase the other channel then has.

    Returns the channel that has no line, where one has none.
    """
    motor = None
    if samples.shape[1] > 1:
        motor = fit_line(samples[:, 1], signal.rate, band, Mains(campaign.chain.mains_hz), sensors[1].full_scale)
        if motor is None or motor.phase is None or not motor.amplitude > 0:
            return f"{shown}, motor"
    span = (motor.start_s, motor.end_s) if motor else None
    fit = fit_line(samples[:, 0], signal.rate, band, mains, sensors[0].full_scale, motor.phase if motor else None, span)
    if fit is None or not fit.amplitude > 0:
        return shown
    paper: float | str = ""
    if "paper" in campaign.chain.use:
        try:
            paper = _paper(campaign).amplitude(samples[:, 0], signal.rate)
            if motor is not None:
                paper /= _paper(campaign).amplitude(samples[:, 1], signal.rate)
                paper *= _over_motor(campaign, fit.frequency_hz)
        except Refusal as refusal:
            paper = refusal.limit
    return _Section(fit, motor, paper, len(samples))


def _unfit_for_paper(sections: list[_Section]) -> str:
    """Return why the chain `paper`, which has no robust step, gives no amplitude of a record; empty where it does."""
    fits = [fit for one in sections for fit in (one.fit, one.motor) if fit is not None]
    masked = max(fit.masked for fit in fits)
    if masked > PAPER_MASKED:
        return f"{masked:.2%} of the samples are drop-outs, which it does not leave out"
    if min(fit.clipped for fit in fits) < np.inf:
        return "samples are clipped, which it does not allow for"
    if any(fit.lines for fit in fits):
        return "it can't tell several lines apart"
    return next((one.paper for one in sections if isinstance(one.paper, str)), "")


def _by_line(
    sections: list[_Section], campaign: Campaign, factor: float, whole: float, fit: LineFit
) -> tuple[tuple[float, float], ...]:
    """Return frequency and amplitude, or ratio to the motor's line of the same frequency, of each line in the band."""
    most = max(sections, key=lambda one: len(one.fit.lines))
    motor = most.motor
    if not most.fit.lines and not (motor and motor.lines):
        return ((fit.frequency_hz, whole),)
    out = []
    for line in most.fit.lines or (Line(fit.frequency_hz, fit.amplitude, fit.u),):
        hertz, size = line.frequency_hz, line.amplitude * factor
        if motor is not None:
            there = motor.lines or (Line(motor.frequency_hz, motor.amplitude, motor.u),)
            near = min(there, key=lambda one: abs(one.frequency_hz - hertz))
            if abs(near.frequency_hz - hertz) > SAME_LINE_HZ:
                continue
            size = line.amplitude / near.amplitude * _over_motor(campaign, hertz)
        if campaign.chain.band_hz[0] <= hertz <= campaign.chain.band_hz[1]:
            out.append((hertz, size))
    return tuple(out)


def _paper(campaign: Campaign) -> PaperChain:
    table = campaign.chain
    return PaperChain(table.order, table.q, table.zero_phase, table.measure, table.trim_s)


def _displacement(sensor: SensorTable, frequency_hz: float) -> float:
    """Return um of displacement per unit of the sensor at a frequency: a line over (j omega) once or twice."""
    si = to_si(sensor.unit, sensor.quantity, "sensor.unit")
    return MICRO * si / (2 * np.pi * frequency_hz) ** _ORDER[sensor.quantity]


def _over_motor(campaign: Campaign, frequency_hz: float) -> float:
    motor = campaign.motor_sensor or campaign.sensor
    return _displacement(campaign.sensor, frequency_hz) / _displacement(motor, frequency_hz)


def _together(fits: list[LineFit], counts: list[int]) -> LineFit:
    """Return one fit for all sections of `counts` samples: mean amplitude and frequency, the worst of what warns."""
    if len(fits) == 1:
        return fits[0]
    weights = np.array(counts, float)
    weights /= weights.sum()
    amplitudes = np.array([fit.amplitude for fit in fits])
    hertz = np.array([fit.frequency_hz for fit in fits])
    mean = float(weights @ amplitudes)
    u = float(np.sqrt(np.sum((weights * [fit.u for fit in fits]) ** 2) + np.max([fit.u_mains for fit in fits]) ** 2))
    first = fits[0]
    return LineFit(
        amplitude=mean,
        u=u,
        u_mains=max(fit.u_mains for fit in fits),
        value=first.value,
        frequency_hz=float(weights @ hertz),
        drift=max(float(np.ptp(hertz)) / float(weights @ hertz), *(fit.drift for fit in fits)),
        snr=float(np.median([fit.snr for fit in fits])),
        scatter=max(float(amplitudes.std()) / mean, *(fit.scatter for fit in fits)),
        start_s=first.start_s,
        end_s=first.start_s + sum(fit.end_s - fit.start_s for fit in fits),
        masked=float(weights @ [fit.masked for fit in fits]),
        clipped=min(fit.clipped for fit in fits),
        mains_hz=max(fit.mains_hz for fit in fits),
        lines=max((fit.lines for fit in fits), key=len),
    )


def _ratio(
    sections: list[_Section], sensors: tuple[SensorTable, ...], frequency_hz: float
) -> tuple[float | None, float | None]:
    """Return the displacement over the motor's, and its phase in degrees, behind the motor's where negative."""
    values = [section.fit.value / section.motor.value for section in sections if section.motor]
    if not values:
        return None, None
    turn = [_displacement(one, frequency_hz) / 1j ** _ORDER[one.quantity] for one in sensors]
    ratio = complex(np.mean(values)) * turn[0] / turn[1]
    return abs(ratio), float(np.degrees(np.angle(ratio)))


def _line_findings(fit: LineFit, signal: Signal, where: str, mains: Mains) -> list[LabFinding]:
    """Return what is wrong with a line, in the order of the codes."""
    out = []
    hertz = fit.frequency_hz
    if fit.masked > MOST_MASKED:
        out.append(found("L110", where, f"{fit.masked:.0%} of the samples were left out"))
    if fit.amplitude < LEAST_OVER_U * fit.u:  # nothing else can be said of a line that is not there
        return [*out, found("L111", where, f"the strongest has {fit.amplitude / fit.u:.1f} times its uncertainty")]
    if signal.raw_rate < 4 * hertz:
        out.append(found("L102", where, f"{signal.raw_rate:g} Hz for a line at {hertz:.1f} Hz"))
    if fit.lines:
        listed = ", ".join(f"{one.frequency_hz:.2f} Hz ({one.amplitude / fit.amplitude:.2f})" for one in fit.lines)
        out.append(found("L104", where, f"{len(fit.lines)} lines: {listed}"))
    if fit.mains_hz:
        known = "its part is in the uncertainty" if mains.blank else "without a [blank] its part is not known"
        out.append(found("L105", where, f"{hertz:.2f} Hz beside {fit.mains_hz:g} Hz: {known}"))
    noise = np.sqrt(2 / max(0.2 * signal.rate, 1)) / fit.snr
    scatter = float(np.sqrt(max(fit.scatter**2 - noise**2, 0.0)))
    if not fit.lines and (scatter > MOST_SCATTER or fit.drift > MOST_DRIFT):
        out.append(found("L107", where, f"amplitude varies by {scatter:.1%}, frequency by {fit.drift:.1%}"))
    periods = (fit.end_s - fit.start_s) * hertz
    if periods < LEAST_PERIODS:
        severity = "error" if periods < NO_PERIODS else "warning"
        out.append(found("L108", where, f"{periods:.0f} periods in the steady part", severity))
    return sorted(out, key=lambda one: one.code)


def _stronger_outside(
    picture: tuple[Floats, ...], hertz: float, band: tuple[float, float], mains_hz: float
) -> float | None:
    """Return the frequency of a line outside the band above the one in it; the mains and its own harmonics are none."""
    frequency, size = picture[2:]
    near = max(1.0, 3 * float(frequency[1] - frequency[0])) if len(frequency) > 1 else 1.0
    own = np.abs(frequency - hertz) <= near
    outside = (frequency > TREMOR_HZ) & ((frequency < band[0] - near) | (frequency > band[1] + near))
    outside &= np.abs(frequency - mains_hz * np.round(frequency / mains_hz)) > near
    outside &= (frequency < 1.5 * hertz) | (np.abs(frequency - hertz * np.round(frequency / hertz)) > near)
    if not own.any() or not outside.any():
        return None
    at = int(np.argmax(np.where(outside, size, 0.0)))
    strong = size[at] > max(float(size[own].max()), 8 * float(np.median(size[outside])))
    return float(frequency[at]) if strong else None


def _clipped(samples: Floats) -> float:
    good = np.isfinite(samples)
    if good.sum() < 16 or not np.ptp(samples[good]) > 0:
        return float("inf")
    return clip_mask(np.where(good, samples - np.median(samples[good]), 0.0), good)[2]


def _picture(samples: Floats, rate: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return time and samples, frequency and amplitude of a section, as a plot needs them."""
    whole = np.where(np.isfinite(samples), samples, 0.0)
    frequency, size = spectrum(whole, rate)
    low = frequency <= min(500.0, rate / 2)
    return np.arange(len(whole)) / rate, samples.copy(), frequency[low], size[low]


def _without_line(
    shared: tuple[str, str, str, float, int], findings: tuple[LabFinding, ...], picture: Any
) -> RecordResult:
    return RecordResult(
        *shared, amplitude_um=0.0, u_um=0.0, shared=0.0, frequency_hz=0.0, drift=0.0, snr=0.0, steady_s=0.0, masked=0.0,
        lines=(), ratio=None, lag_deg=None, by_chain={}, by_line=(), paper_gain=None, findings=findings, usable=False,
        picture=picture,
    )  # fmt: skip


def _short(value: Any) -> Any:
    if isinstance(value, float):
        return float(f"{value:.6g}") if np.isfinite(value) else None
    return value
