"""A record's sections fitted, and put together: one line, one amplitude by each chain, one ratio to the motor."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.errors import Refusal
from unitcad.geometry.arrays import Floats
from unitcad.lab.campaign import Campaign, SensorTable
from unitcad.lab.chains.chain import Chain
from unitcad.lab.chains.line import Mains, fit_line
from unitcad.lab.chains.line_fit import Line, LineFit
from unitcad.lab.quantities import to_si

SAME_LINE_HZ = 0.5
MICRO = 1e6
_ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}


@dataclass(frozen=True)
class Section:
    """A section of `count` samples: the fit of the unit's channel and of the motor's, where there is one.

    `amplitudes` has by chain the amplitude in the sensor's unit, over the motor's in its own where there is one; or
    the reason why the chain can't take the section.
    """

    fit: LineFit
    motor: LineFit | None
    amplitudes: dict[str, float | str]
    count: int


def fit_section(
    samples: Floats,
    rate: float,
    band: tuple[float, float],
    mains: tuple[Mains, ...],
    sensors: tuple[SensorTable, ...],
    chains: tuple[Chain, ...],
) -> Section | int:
    """Fit one section: the motor's channel first, where there is one, whose phase the other channel then has.

    Returns the number of the channel that has no line, where one has none: 0 the unit's, 1 the motor's.
    """
    motor = None
    if samples.shape[1] > 1:
        motor = fit_line(samples[:, 1], rate, band, mains[1], sensors[1].full_scale)
        if motor is None or motor.phase is None or not motor.amplitude > 0:
            return 1
    span = (motor.start_s, motor.end_s) if motor else None
    fit = fit_line(samples[:, 0], rate, band, mains[0], sensors[0].full_scale, motor.phase if motor else None, span)
    if fit is None or not fit.amplitude > 0:
        return 0
    amplitudes: dict[str, float | str] = {}
    for chain in chains:
        try:
            value = chain.amplitude(samples[:, 0], rate, fit)
            amplitudes[chain.name] = value / chain.amplitude(samples[:, 1], rate, motor) if motor else value
        except Refusal as refusal:
            amplitudes[chain.name] = refusal.limit
    return Section(fit, motor, amplitudes, len(samples))


def together(fits: list[LineFit], counts: list[int]) -> LineFit:
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
        u_noise=float(np.sqrt(np.sum((weights * [fit.u_noise for fit in fits]) ** 2))),
        u_mains=max(fit.u_mains for fit in fits),
        value=first.value,
        frequency_hz=float(weights @ hertz),
        drift=max(float(np.ptp(hertz)) / float(weights @ hertz), *(fit.drift for fit in fits)),
        snr=float(np.median([fit.snr for fit in fits])),
        scatter=max(float(amplitudes.std()) / mean, *(fit.scatter for fit in fits)),
        start_s=first.start_s,
        end_s=first.start_s + sum(fit.end_s - fit.start_s for fit in fits),
        masked=float(weights @ [fit.masked for fit in fits]),
        dropped=float(weights @ [fit.dropped for fit in fits]),
        missing=float(weights @ [fit.missing for fit in fits]),
        clipped=min(fit.clipped for fit in fits),
        mains_hz=max(fit.mains_hz for fit in fits),
        lines=max((fit.lines for fit in fits), key=len),
    )


def by_chain(
    sections: list[Section], chains: tuple[Chain, ...], factor: float
) -> tuple[dict[str, float], dict[str, str]]:
    """Return each chain's amplitude times `factor`, weighted by the sections' lengths; and why a chain has none."""
    fits = [fit for one in sections for fit in (one.fit, one.motor) if fit is not None]
    weights = np.array([one.count for one in sections], float)
    values: dict[str, float] = {}
    reasons: dict[str, str] = {}
    for chain in chains:
        found = [one.amplitudes[chain.name] for one in sections]
        refused = next((one for one in found if isinstance(one, str)), "")
        reason = chain.unfit(fits) or refused
        if reason:
            reasons[chain.name] = reason
        else:
            values[chain.name] = float(np.average(np.array(found, float), weights=weights)) * factor
    return values, reasons


def by_line(
    sections: list[Section], campaign: Campaign, factor: float, whole: float, fit: LineFit
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
            size = line.amplitude / near.amplitude * over_motor(campaign, hertz)
        if campaign.chain.band_hz[0] <= hertz <= campaign.chain.band_hz[1]:
            out.append((hertz, size))
    return tuple(out)


def ratio_to_motor(
    sections: list[Section], sensors: tuple[SensorTable, ...], frequency_hz: float
) -> tuple[float | None, float | None]:
    """Return the displacement over the motor's, and its phase in degrees, behind the motor's where negative."""
    values = [section.fit.value / section.motor.value for section in sections if section.motor]
    if not values:
        return None, None
    turn = [displacement(one, frequency_hz) / 1j ** _ORDER[one.quantity] for one in sensors]
    ratio = complex(np.mean(values)) * turn[0] / turn[1]
    return abs(ratio), float(np.degrees(np.angle(ratio)))


def displacement(sensor: SensorTable, frequency_hz: float) -> float:
    """Return um of displacement per unit of the sensor at a frequency: a line over (j omega) once or twice."""
    si = to_si(sensor.unit, sensor.quantity, "sensor.unit")
    return MICRO * si / (2 * np.pi * frequency_hz) ** _ORDER[sensor.quantity]


def over_motor(campaign: Campaign, frequency_hz: float) -> float:
    """Return a displacement over the motor's per quotient of the two sensors' units."""
    motor = campaign.motor_sensor or campaign.sensor
    return displacement(campaign.sensor, frequency_hz) / displacement(motor, frequency_hz)
