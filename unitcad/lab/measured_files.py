"""What `unitcad measure` writes: measured.toml, measure.json, charts and a page. The same input, the same bytes."""

from __future__ import annotations

import json
import re
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from unitcad import files
from unitcad.export.chart import Series, chart
from unitcad.lab.campaign import plain_data
from unitcad.lab.measuring import Measured, PlaceLevel
from unitcad.lab.record_result import RecordResult
from unitcad.spec.toml import text_of

SHOWN_S = 0.1
"""Seconds of a record's middle that a chart shows."""
STRETCHES = 100
"""Parts of a record of which its chart shows the least and the largest value."""
COMB_HZ = 50.0


def write(result: Measured, folder: Path) -> None:
    """Write all files of a result into a folder. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    charts = _charts(result)
    files.write(folder / "measured.toml", text_of(measured_table(result)).encode())
    files.write(folder / "measure.json", (json.dumps(as_data(result), indent=1, allow_nan=False) + "\n").encode())
    for name, content in charts.items():
        files.write(folder / name, content.encode())
    files.write(folder / "measure.html", _page(result, charts).encode())


def measured_table(result: Measured) -> dict[str, Any]:
    """Return measured.toml's data: a level per unit, place and chain, and the hash of every record behind them."""
    campaign = result.campaign
    units = {unit.name: unit for unit in campaign.unit}
    levels = []
    for one in result.levels:
        unit = units[one.unit]
        source = {"spec": unit.spec} if unit.spec else {"cast": unit.cast} if unit.cast else {}
        source |= {"cavity": unit.cavity} if unit.cavity else {}
        levels.append(
            {
                "unit": one.unit,
                **source,
                "distance_mm": one.distance_mm,
                "value": _short(one.level.value),
                "low": _short(one.level.low),
                "high": _short(one.level.high),
                "status": "measured",
                "chain": one.chain,
                "frequency_hz": _short(one.frequency_hz),
                "repeats": list(one.level.repeats),
                "scatter": _short(one.level.scatter),
            }
        )
    records = [
        {"unit": unit, "place": record.role, "file": record.file, "sha256": record.sha256, "usable": record.usable}
        for unit, several in result.records.items()
        for record in several
    ]
    specs = [{"file": name, "sha256": found} for name, found in result.specs.items()]
    assumed = {"assumed": result.assumed} if result.assumed else {}
    return {
        "name": campaign.name, "status": "measured", "chain": campaign.chain.use[0], "interval": 0.95, **assumed,
        "level": levels, "record": records, "source": specs,
    }  # fmt: skip


def as_data(result: Measured) -> dict[str, Any]:
    """Return everything as JSON-ready data."""
    return {
        "campaign": plain_data(result.campaign),
        "levels": measured_table(result)["level"],
        "records": [
            {"unit": unit, **record.as_dict()} for unit, several in result.records.items() for record in several
        ],
        "findings": [finding.as_dict() for finding in result.findings],
        "assumed": result.assumed,
        "mains_of_blank": [{"hz": k * result.campaign.chain.mains_hz, "amplitude": _short(a)} for k, a in result.mains],
    }


def lines(result: Measured) -> list[str]:
    """Return the levels and the records as lines for a person."""
    out = []
    for one in result.levels:
        place = "edge" if one.distance_mm == 0 else f"{one.distance_mm:g} mm"
        value = f"{one.level.value:.3f} ({one.level.low:.3f} to {one.level.high:.3f})"
        out.append(f"{one.unit}, {place}, {one.chain}: {value} of the motor's amplitude, {one.frequency_hz:.1f} Hz")
    for unit, several in result.records.items():
        for r in several:
            gain = f", filters pass {r.paper_gain:.3f}" if r.paper_gain is not None else ""
            ratio = f", {r.ratio:.4f} of the motor" if r.ratio is not None else ""
            out.append(
                f"  {unit}, {r.role}, {r.file}: {r.amplitude_um:.2f} +- {2 * r.u_um:.2g} um{ratio}, "
                f"{r.frequency_hz:.2f} Hz, drift {r.drift:.2%}, signal to noise {r.snr:.3g}{gain}"
            )
    if result.assumed:
        values = ", ".join(f"{name} {value}" for name, value in result.assumed.items())
        out.append(f"  chain paper, assumed: {values}")
    return out


def _charts(result: Measured) -> dict[str, str]:
    out = {}
    unit_of = result.campaign.sensor.unit
    number = 0
    for several in result.records.values():
        for record in several:
            number += 1
            stem = f"record-{number:02d}"
            out[f"{stem}-time.svg"] = _time_chart(record, unit_of)
            out[f"{stem}-periods.svg"] = _periods_chart(record, unit_of)
            out[f"{stem}-spectrum.svg"] = _spectrum_chart(record, unit_of)
    for i, unit in enumerate(result.campaign.unit, 1):
        levels = [one for one in result.levels if one.unit == unit.name]
        if levels:
            out[f"decay-{i:02d}.svg"] = _decay_chart(unit.name, levels)
    return out


def _time_chart(record: RecordResult, unit: str) -> str:
    """Chart the whole record by its least and largest values in a hundred stretches."""
    time, samples = record.picture[:2]
    step = max(len(time) // STRETCHES, 1)
    count = len(time) // step
    folded = samples[: count * step].reshape(count, step)
    middles = time[step // 2 : count * step : step][:count]
    ends = {"largest": np.fmax.reduce(folded, axis=1), "least": np.fmin.reduce(folded, axis=1)} if count else {}
    series = [Series(f"{name} of each stretch", middles, values) for name, values in ends.items()]
    return chart(series, f"{record.file}: whole record", "time, s", f"signal, {unit}")


def _periods_chart(record: RecordResult, unit: str) -> str:
    """Chart some periods of the record's middle."""
    time, samples = record.picture[:2]
    middle = len(time) // 2
    half = max(int(SHOWN_S / 2 * len(time) / max(time[-1], 1e-9)), 8) if len(time) else 0
    part = slice(max(middle - half, 0), middle + half)
    return chart([Series("signal", time[part], samples[part])], f"{record.file}: middle", "time, s", f"signal, {unit}")


def _spectrum_chart(record: RecordResult, unit: str) -> str:
    frequency, size = record.picture[2:]
    floor = float(np.median(size)) / 10 if len(size) and np.median(size) > 0 else 1e-12
    kept = size > floor
    series = [Series("spectrum (Hann)", frequency[kept], size[kept])]
    if record.frequency_hz:
        marked = record.lines or ()
        at = [one.frequency_hz for one in marked] or [record.frequency_hz]
        tops = [float(np.interp(hz, frequency, size)) for hz in at]
        series.append(Series("fitted line" if len(at) == 1 else "fitted lines", at, tops, points=True))
    zeros = np.arange(COMB_HZ, frequency[-1] + 1e-9, COMB_HZ) if len(frequency) else np.empty(0)
    if len(zeros):
        series.append(Series("zeros of the 50 Hz comb", zeros, np.full(len(zeros), floor), points=True))
    return chart(series, record.file, "frequency, Hz", f"amplitude, {unit}", log_y=True, shaded=(40.0, 200.0))


def _decay_chart(name: str, levels: list[PlaceLevel]) -> str:
    series = []
    for chain in sorted({one.chain for one in levels}):
        there = [one for one in levels if one.chain == chain]
        x = [one.distance_mm for one in there]
        series.append(Series(f"{chain}", x, [one.level.value for one in there], points=True))
        for one in there:
            series.append(
                Series(
                    "95 % interval" if one is there[0] else "", [one.distance_mm] * 2, [one.level.low, one.level.high]
                )
            )
    return chart(series, f"{name}: level over the distance from the edge", "distance, mm", "level", log_y=True)


_STYLE = """body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:70rem;padding:0 1rem;color:#222}
table{border-collapse:collapse}td,th{border:1px solid #ccc;padding:.2rem .5rem;text-align:left}
figure{display:inline-block;margin:.5rem}svg{max-width:100%;height:auto}.error{color:#a11}.warning{color:#850}"""


def _page(result: Measured, charts: dict[str, str]) -> str:
    """Return one offline page: levels, findings, records, charts. It has no script and contacts nothing."""
    levels = _table(
        ("unit", "distance, mm", "chain", "level", "95 %", "repeats", "Hz"),
        [
            (
                one.unit, f"{one.distance_mm:g}", one.chain, f"{one.level.value:.4g}",
                f"{one.level.low:.4g} to {one.level.high:.4g}", " + ".join(map(str, one.level.repeats)),
                f"{one.frequency_hz:.2f}",
            )
            for one in result.levels
        ],
    )  # fmt: skip
    records = _table(
        ("unit", "place", "file", "um", "2 u, um", "Hz", "drift", "signal to noise", "paper's gain", "SHA-256"),
        [
            (
                unit, r.role, r.file, f"{r.amplitude_um:.4g}", f"{2 * r.u_um:.2g}", f"{r.frequency_hz:.2f}",
                f"{r.drift:.2%}", f"{r.snr:.3g}", "" if r.paper_gain is None else f"{r.paper_gain:.3f}", r.sha256[:12],
            )
            for unit, several in result.records.items()
            for r in several
        ],
    )  # fmt: skip
    found = "".join(
        f'<li class="{one.severity}"><b>{one.code}</b> {escape(one.where)}: {escape(one.message)}. '
        f"{escape(one.as_dict()['fix'])}</li>"
        for one in result.findings
    )
    figures = "".join(f"<figure>{re.sub(r'<[?!][^>]*>', '', svg)}</figure>" for svg in charts.values())
    name = escape(result.campaign.name)
    assumed = ", ".join(f"{key} {value}" for key, value in result.assumed.items())
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">"
        f"<title>{name}</title><style>{_STYLE}</style></head><body><h1>{name}</h1>"
        f"<p>{escape(result.campaign.note)}</p><h2>Levels</h2>{levels}"
        + (f"<p>Chain paper, assumed: {escape(assumed)}.</p>" if assumed else "")
        + f"<h2>Findings</h2>{f'<ul>{found}</ul>' if found else '<p>None.</p>'}"
        f"<h2>Records</h2>{records}<h2>Charts</h2>{figures}</body></html>\n"
    )


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    cells = "".join(f"<th>{escape(word)}</th>" for word in head)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table><tr>{cells}</tr>{body}</table>"


def _short(value: float) -> float:
    return float(f"{value:.6g}")
