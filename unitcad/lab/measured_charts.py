"""Charts of a campaign: each record over time and its spectrum about the line, and the decay along the skin."""

from __future__ import annotations

from itertools import groupby

import numpy as np

from unitcad.export.chart import Series, chart
from unitcad.lab.chains.chain import Chain
from unitcad.lab.measuring import Measured, PlaceLevel
from unitcad.lab.record_result import RecordResult

SHOWN_S = 0.1
"""Seconds of a record's middle that a chart shows."""
STRETCHES = 100
"""Parts of a record of which its chart shows the least and the largest value."""
BESIDE_HZ = 30.0
"""To either side of the lines, what a spectrum shows: one multiple of 50 Hz at least."""
APART = 0.008
"""Part of the axis by which the levels of two chains are drawn apart, so that no bar covers another."""
LEAST_WIDE_MM = 10.0
"""What the axis of distances shows at least: beside it APART is no distance."""


def charts_of(result: Measured) -> dict[str, str]:
    """Return the charts as SVG by file name."""
    out = {}
    number = 0
    for several in result.records.values():
        for record in several:
            number += 1
            stem = f"record-{number:02d}"
            out[f"{stem}-time.svg"] = _time_chart(record)
            out[f"{stem}-periods.svg"] = _periods_chart(record)
            out[f"{stem}-spectrum.svg"] = _spectrum_chart(record, result.chains)
    for i, unit in enumerate(result.campaign.unit, 1):
        levels = [one for one in result.levels if one.unit == unit.name]
        if levels:
            out[f"decay-{i:02d}.svg"] = _decay_chart(unit.name, levels)
    return out


def _time_chart(record: RecordResult) -> str:
    """Chart the whole record by its least and largest values in a hundred stretches."""
    time, samples = record.picture[:2]
    step = max(len(time) // STRETCHES, 1)
    count = len(time) // step
    folded = samples[: count * step].reshape(count, step)
    middles = time[step // 2 : count * step : step][:count]
    ends = {"largest": np.fmax.reduce(folded, axis=1), "least": np.fmin.reduce(folded, axis=1)} if count else {}
    series = [Series(f"{name} of each stretch", middles, values) for name, values in ends.items()]
    return chart(series, f"{record.file}: whole record", "time, s", f"signal, {record.unit}")


def _periods_chart(record: RecordResult) -> str:
    """Chart some periods of the record's middle."""
    time, samples = record.picture[:2]
    middle = len(time) // 2
    half = max(int(SHOWN_S / 2 * len(time) / max(time[-1], 1e-9)), 8) if len(time) else 0
    part = slice(max(middle - half, 0), middle + half)
    series = [Series("signal", time[part], samples[part])]
    return chart(series, f"{record.file}: middle", "time, s", f"signal, {record.unit}")


def _spectrum_chart(record: RecordResult, chains: tuple[Chain, ...]) -> str:
    """Chart the spectrum about the fitted lines with the zeros of the chains' combs; all of it without a sure line."""
    frequency, size = record.picture[2:]
    at = [one.frequency_hz for one in record.lines] or [record.frequency_hz]
    if record.frequency_hz and not any(one.code == "L117" for one in record.findings):
        near = (frequency > min(at) - BESIDE_HZ) & (frequency < max(at) + BESIDE_HZ)
        frequency, size = frequency[near], size[near]
    floor = float(np.median(size)) / 10 if len(size) and np.median(size) > 0 else 1e-12
    kept = size > floor
    series = [Series("spectrum (Hann)", frequency[kept], size[kept])]
    if record.frequency_hz:
        tops = [float(np.interp(hertz, frequency, size)) for hertz in at]
        series.append(Series("fitted line" if len(at) == 1 else "fitted lines", at, tops, points=True))
    for chain in chains:
        if chain.zeros_hz and len(frequency):
            first = np.ceil(frequency[0] / chain.zeros_hz) or 1.0
            zeros = np.arange(first * chain.zeros_hz, frequency[-1] + 1e-9, chain.zeros_hz)
            bars = [(floor, float(size.max()))] * len(zeros)
            name = f"zeros of {chain.name}'s comb"
            series.append(Series(name, zeros, np.full(len(zeros), floor), points=True, bars=bars))
    filtered = next((chain for chain in chains if chain.pass_hz), None)
    return chart(
        series, f"{record.file}: spectrum", "frequency, Hz", f"amplitude, {record.unit}", log_y=True,
        shaded=filtered.pass_hz if filtered else None,
        shaded_name=f"pass band of {filtered.name}" if filtered else "",
        x_range=(float(frequency[0]), float(frequency[-1])) if len(frequency) else None,
    )  # fmt: skip


def _decay_chart(name: str, levels: list[PlaceLevel]) -> str:
    """Chart the levels over the distance, a colour for each chain, and each line where a unit has several."""
    several = len({(one.chain, one.distance_mm) for one in levels}) < len(levels)

    def kind(one: PlaceLevel) -> str:
        return f"{one.chain}, {one.frequency_hz:.1f} Hz" if several else one.chain

    kinds = {key: list(there) for key, there in groupby(sorted(levels, key=kind), kind)}
    wide = max(LEAST_WIDE_MM, *(one.distance_mm for one in levels))
    series = []
    for i, (key, there) in enumerate(kinds.items()):
        there.sort(key=lambda one: one.distance_mm)
        shift = APART * wide * (i - (len(kinds) - 1) / 2)
        x = [one.distance_mm + shift for one in there]
        bars = [(one.level.low, one.level.high) for one in there]
        series.append(Series(f"{key}, 95 % interval", x, [one.level.value for one in there], points=True, bars=bars))
    title = f"{name}: level over the distance from the edge"
    return chart(series, title, "distance, mm", "level", log_y=True, x_range=(-0.03 * wide, 1.03 * wide))
