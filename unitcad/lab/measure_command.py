"""unitcad measure: its files and page. The same input, the same bytes."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable, Iterator
from html import escape
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
import typer

from unitcad import files
from unitcad.cli.output import print_json, progress, warn
from unitcad.cli.shared_options import AsJson
from unitcad.export.chart import Series, chart
from unitcad.json_text import rounded
from unitcad.lab import bandpass, measuring
from unitcad.lab.campaign import read_campaign
from unitcad.lab.measuring import Measured
from unitcad.lab.record import RecordResult
from unitcad.spec.toml import text_of

MEASURED = "measured.toml"


def write(result: Measured, folder: Path) -> None:
    """Write all files of a result into a folder, measured.toml last. Raises OSError."""
    texts = {
        "measure.json": json.dumps(as_data(result), indent=1, allow_nan=False) + "\n",
        "measure.html": page(result),
        MEASURED: text_of(measured_table(result)),
    }
    files.replace_all(folder, {name: text.encode() for name, text in texts.items()}, MEASURED)


def _each_record(result: Measured) -> Iterator[tuple[str, RecordResult]]:
    """Yield all records with the names of their units."""
    for unit, several in result.records.items():
        for record in several:
            yield unit, record


def _place(distance_mm: float) -> str:
    return "edge" if distance_mm == 0 else f"{distance_mm:g} mm"


def measured_table(result: Measured) -> dict[str, Any]:
    """Return measured.toml's data: a level per unit, place and chain, and the hash of every record behind them."""
    campaign = result.campaign
    levels = []
    for one in result.levels:
        found = one.level
        levels.append(
            {
                "unit": one.unit, "distance_mm": one.distance_mm,
                "value": found.value, "low": found.low, "high": found.high, "status": "measured", "chain": one.chain,
                "frequency_hz": one.frequency_hz, "repeats": found.repeats, "scatter": found.scatter,
            }
        )  # fmt: skip
    records = [
        {"unit": unit, "place": record.role, "file": record.file, "sha256": record.sha256, "usable": record.usable}
        for unit, record in _each_record(result)
    ]
    return {
        "name": campaign.name, "status": "measured", "chain": campaign.chain.use[0], "interval": 0.95,
        "level": rounded(levels, 6), "record": records,
    }  # fmt: skip


def as_data(result: Measured) -> dict[str, Any]:
    """Return everything as JSON-ready data."""
    return {
        "campaign": msgspec.to_builtins(result.campaign),
        "levels": measured_table(result)["level"],
        "records": [{"unit": unit, **record.as_dict()} for unit, record in _each_record(result)],
        "findings": [finding.as_dict() for finding in result.findings],
    }


_STYLE = """:root{color-scheme:light dark;--text:#222;--back:#fff;--edge:#ccc;--error:#a11;--warning:#850}
@media(prefers-color-scheme:dark){:root{--text:#ddd;--back:#181a1b;--edge:#555;--error:#f99;--warning:#eb6}}
body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:70rem;padding:0 1rem;color:var(--text);
background:var(--back);overflow-wrap:anywhere}
.wide{overflow-x:auto;overflow-wrap:normal}table{border-collapse:collapse}td{white-space:nowrap}
td,th{border:1px solid var(--edge);padding:.2rem .5rem;text-align:left}tr.out td{color:var(--error)}
figure{display:inline-block;margin:.5rem 0;max-width:100%}svg{max-width:100%;height:auto}
.error{color:var(--error)}.warning{color:var(--warning)}@media(max-width:500px){
h1{font-size:1.4rem}table{font-size:13px}td,th{padding:.15rem .3rem}td:first-child{white-space:normal}
figure{overflow-x:auto}svg{max-width:none;width:31rem}}"""


def page(result: Measured) -> str:
    """Return the page as HTML."""
    found = "".join(
        f'<li class="{one.severity}"><b>{one.code}</b> {escape(one.where)}: {escape(one.message)}. '
        f"{escape(one.as_dict()['fix'])}</li>"
        for one in result.findings
    )
    drawn = _figures(svg for _, record in _each_record(result) for svg in _record_charts(record))
    levels = []
    for one in result.levels:
        level = one.level
        size = f"{level.value:.3f}", f"{level.low:.3f} to {level.high:.3f}", " + ".join(map(str, level.repeats))
        levels.append((one.unit, _place(one.distance_mm), one.chain, *size, f"{one.frequency_hz:.2f}"))
    assumed = _assumed(result)
    records = []
    for unit, r in _each_record(result):
        row = [unit, r.role, r.file, "yes" if r.usable else "no"]
        row += [
            f"{r.amplitude_um:.4g}", f"{2 * r.u_um:.2g}" if r.usable else "", f"{r.frequency_hz:.2f}",
            f"{r.steady_s:.3g} of {r.length_s:.3g}", f"{r.drift:.2%}", f"{r.snr:.3g}",
            "" if r.bandpass_gain is None else f"{r.bandpass_gain:.3f}",
        ] if r.frequency_hz else [""] * 7  # fmt: skip
        records.append((*row, r.sha256[:12]))
    head = ("unit", "place", "file", "used", "um", "2 u, um", "Hz", "steady, s", "drift", "signal to noise")
    head = (*head, "gain of bandpass", "SHA-256")
    name, place = escape(result.campaign.name), ("unit", "place", "chain", "level", "95 %", "repeats", "Hz")
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">"
        f"<title>{name}</title><style>{_STYLE}</style></head><body><h1>{name}</h1>"
        f"<p>{escape(result.campaign.note)}</p><h2>Levels</h2>"
        + (_table(place, levels) if levels else "<p>None: see the findings.</p>")
        + (f"<p>{escape(assumed)}.</p>" if assumed else "")
        + f"{_figures(_decay_charts(result))}<h2>Findings</h2>{f'<ul>{found}</ul>' if found else '<p>None.</p>'}"
        "<h2>Records</h2><p>2 u is of the amplitude in the long run, as far as one record tells; a level's interval "
        "comes from the scatter of the repeats.</p>"
        f"{_table(head, records)}<h2>Charts of the records</h2>{drawn}</body></html>\n"
    )


def _assumed(result: Measured) -> str:
    """State the values that the chain bandpass assumes, if it was used."""
    return f"Chain bandpass, assumed: {bandpass.ASSUMED}" if "bandpass" in result.campaign.chain.use else ""


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a table; a row of a record that is not used is marked."""
    cells = "".join(f"<th>{escape(word)}</th>" for word in head)
    body = "".join(
        f'<tr class="{"out" if row[3] == "no" else ""}">{"".join(f"<td>{escape(cell)}</td>" for cell in row)}</tr>'
        for row in rows
    )
    return f'<div class="wide"><table><tr>{cells}</tr>{body}</table></div>'


STRETCHES = 100
"""Parts of a record of which its chart shows the least and the largest value."""
BESIDE_HZ = 30.0
"""Width of a spectrum to either side of the line: one multiple of 50 Hz at least."""
LEAST_WIDE_MM = 10.0
"""Smallest span of the axis of distances."""


def _record_charts(record: RecordResult) -> list[str]:
    """Chart the whole record, and its spectrum near the line, or all of it without a line, as SVG."""
    time, samples, frequency, size = record.picture
    unit = f"signal, {record.unit}"
    step = max(len(time) // STRETCHES, 1)
    count = len(time) // step
    folded = samples[: count * step].reshape(count, step)
    middles = time[step // 2 : count * step : step][:count]
    ends = {"largest": np.fmax.reduce(folded, axis=1), "least": np.fmin.reduce(folded, axis=1)} if count else {}
    whole = [Series(f"{name} of each stretch", middles, values) for name, values in ends.items()]
    if hertz := record.frequency_hz:
        near = np.abs(frequency - hertz) < BESIDE_HZ
        frequency, size = frequency[near], size[near]
    floor = float(np.median(size)) / 10 if len(size) and np.median(size) > 0 else 1e-12
    kept = size > floor
    series = [Series("spectrum (Hann)", frequency[kept], size[kept])]
    if hertz:
        series.append(Series("fitted line", [hertz], [float(np.interp(hertz, frequency, size))], points=True))
    span = (float(frequency[0]), float(frequency[-1])) if len(frequency) else None
    amplitude = f"amplitude, {record.unit}"
    return [
        chart(whole, f"{record.file}: whole record", "time, s", unit),
        chart(series, f"{record.file}: spectrum", "frequency, Hz", amplitude, log_y=True, x_range=span),
    ]


def _decay_charts(result: Measured) -> Iterator[str]:
    """Chart each unit's levels of the first chain over the distance, as SVG."""
    for unit in result.campaign.unit:
        levels = [one for one in result.levels if (one.unit, one.chain) == (unit.name, result.campaign.chain.use[0])]
        if levels:
            x = [one.distance_mm for one in levels]
            bars = [(one.level.low, one.level.high) for one in levels]
            wide = max(LEAST_WIDE_MM, *x)
            series = [Series("95 % interval", x, [one.level.value for one in levels], points=True, bars=bars)]
            title = f"{unit.name}: level over the distance from the edge"
            yield chart(series, title, "distance, mm", "level", log_y=True, x_range=(-0.03 * wide, 1.03 * wide))


def _figures(charts: Iterable[str]) -> str:
    return "".join(f"<figure>{re.sub(r'<[?!][^>]*>', '', svg)}</figure>" for svg in charts)


def measure(
    campaign: Annotated[
        Path, typer.Argument(metavar="CAMPAIGN", help="File of the units, their recordings and the sensor.")
    ],
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", metavar="DIR", help="Folder for the results. Default: out/measure-CAMPAIGN."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Measure units from recordings in a lab.

    Reads a vibrometer, a displacement sensor or an accelerometer. Gives the level at the edge and along the skin,
    normalised by the motor, with an interval of 95 % from the repeats.
    Exit 1 if a finding puts a record or a level in doubt. The last line printed is the folder.
    """

    asked = read_campaign(campaign)
    folder = out or Path("out") / f"measure-{campaign.stem}"
    with progress(asked.name) as say:
        result = measuring.measure(asked, campaign.parent, say)
        say("files")
        write(result, folder)
    for finding in result.findings:
        warn(f"{finding.code} {finding.severity}: {finding.where}: {finding.message}")
    if as_json:
        print_json({"folder": str(folder), **as_data(result)})
    else:
        for one in result.levels:
            value = f"{one.level.value:.3f} ({one.level.low:.3f} to {one.level.high:.3f})"
            place = f"{one.unit}, {_place(one.distance_mm)}, {one.chain}"
            typer.echo(f"{place}: {value} of the motor's amplitude, {one.frequency_hz:.1f} Hz")
        if assumed := _assumed(result):
            typer.echo(f"  {assumed}")
        typer.echo(str(folder))
    if result.findings:
        sys.exit(1)
