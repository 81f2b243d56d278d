"""The page of a campaign: levels, findings, records, charts; or why there are none. It has no script."""

from __future__ import annotations

import re
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from unitcad.lab.measuring import Measured
    from unitcad.lab.record_result import RecordResult

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


def page(result: Measured, charts: dict[str, str], lead: str = "") -> str:
    """Return the page as HTML; `charts` are SVG documents by file name, `lead` is HTML that stands first."""
    found = "".join(
        f'<li class="{one.severity}"><b>{one.code}</b> {escape(one.where)}: {escape(one.message)}. '
        f"{escape(one.as_dict()['fix'])}</li>"
        for one in result.findings
    )
    assumed = "".join(
        f"<p>Chain {escape(chain.name)}, assumed: {escape(chain.assumed_text)}.</p>"
        for chain in result.chains
        if chain.assumed
    )
    decay = "".join(_figure(svg) for name, svg in charts.items() if name.startswith("decay"))
    figures = "".join(_figure(svg) for name, svg in charts.items() if not name.startswith("decay"))
    return _document(
        result.campaign.name,
        f"{lead}<p>{escape(result.campaign.note)}</p><h2>Levels</h2>{_levels(result)}{assumed}{decay}"
        f"<h2>Findings</h2>{f'<ul>{found}</ul>' if found else '<p>None.</p>'}"
        f"<h2>Records</h2><p>2 u is of the amplitude in the long run, as far as one record tells; a level's interval "
        f"comes from the scatter of the repeats.</p>{_records(result)}"
        f"<h2>Charts of the records</h2>{figures}",
    )


def fault_page(name: str, fault: str, lead: str = "") -> str:
    """Return the page of a campaign that can't be measured, as HTML: why; `lead` is HTML that stands after it."""
    return _document(name, f'<h2>Not measured</h2><p class="error">{escape(fault)}</p>{lead}')


def _document(name: str, body: str) -> str:
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width">'
        "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">"
        f"<title>{escape(name)}</title><style>{_STYLE}</style></head><body><h1>{escape(name)}</h1>{body}</body></html>\n"
    )


def _figure(svg: str) -> str:
    return f"<figure>{re.sub(r'<[?!][^>]*>', '', svg)}</figure>"


def _levels(result: Measured) -> str:
    rows = [
        (
            one.unit, "edge" if one.distance_mm == 0 else f"{one.distance_mm:g} mm", one.chain,
            f"{one.level.value:.3f}", f"{one.level.low:.3f} to {one.level.high:.3f}",
            " + ".join(map(str, one.level.repeats)), f"{one.frequency_hz:.2f}",
        )
        for one in result.levels
    ]  # fmt: skip
    if not rows:
        return "<p>None: see the findings.</p>"
    return _table(("unit", "place", "chain", "level", "95 %", "repeats", "Hz"), [(row, "") for row in rows])


def _records(result: Measured) -> str:
    gains = [chain.name for chain in result.chains if chain.gain]
    head = ("unit", "place", "file", "used", "um", "2 u, um", "Hz", "steady, s", "drift", "signal to noise")
    head += (*(f"gain of {name}" for name in gains), "SHA-256")
    rows = [
        (_record(unit, record, gains), "" if record.usable else "out")
        for unit, several in result.records.items()
        for record in several
    ]
    return _table(head, rows)


def _record(unit: str, r: RecordResult, gains: list[str]) -> tuple[str, ...]:
    figures = (
        f"{r.amplitude_um:.4g}", f"{2 * r.u_um:.2g}" if r.usable else "", f"{r.frequency_hz:.2f}",
        f"{r.steady_s:.3g} of {r.length_s:.3g}", f"{r.drift:.2%}",
        f"{r.snr:.3g}", *(f"{r.gains[name]:.3f}" for name in gains if name in r.gains),
    )  # fmt: skip
    figures = figures if r.frequency_hz else ("",) * (6 + len(gains))
    return (unit, r.role, r.file, "yes" if r.usable else "no", *figures, r.sha256[:12])


def _table(head: tuple[str, ...], rows: list[tuple[tuple[str, ...], str]]) -> str:
    cells = "".join(f"<th>{escape(word)}</th>" for word in head)
    body = "".join(
        f'<tr class="{kind}">' + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row, kind in rows
    )
    return f'<div class="wide"><table><tr>{cells}</tr>{body}</table></div>'
