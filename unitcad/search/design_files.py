"""A result's folder: the ranking, the page, the same as Markdown and as JSON, charts, and a spec for each proposal."""

from __future__ import annotations

import csv
import io
import json
import re
import shlex
from collections.abc import Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from unitcad import files
from unitcad.errors import UnitcadError
from unitcad.export.chart import Series, chart
from unitcad.pipeline import write as folders
from unitcad.pipeline.variant import Variant
from unitcad.report.plain_page import drawing, plain_page
from unitcad.search import design_text
from unitcad.search.candidates import Candidates, Say
from unitcad.search.limits import limits
from unitcad.search.proposals import Inversion, name_of
from unitcad.search.ranking import ordered
from unitcad.spec import to_toml
from unitcad.text import cell, markdown, number

SPECS = "specs"
_QUANTITIES = {
    "mass_g": "mass, g",
    "cure_hours": "hours until it is out of the mould",
    "height_mm": "height, mm",
    "diameter_mm": "diameter, mm",
    "crosstalk": "crosstalk ratio",
}
"""Columns of the candidates, of which less may cost probability."""
_COLUMNS = (
    "place", "proposal", "name", "design", "motor", "materials", "walls_mm", "caps_mm", "diameter_mm", "height_mm",
    "mass_g", "cure_hours", "crosstalk_ratio", "probability", "edge_p10", "edge_p50", "edge_p90", "measured", "over",
)  # fmt: skip
_NUMBER = ' class="number"'


def folder_of(name: str, out: Path) -> Path:
    """Return the folder of a target's result."""
    slug = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "target"
    return out / f"design-{slug}"


def check_out(out: Path) -> None:
    """Raise UnitcadError, before the work, if a file is in the place of the result's folder."""
    if out.exists() and not out.is_dir():
        raise UnitcadError(f"{out}: is a file, not a folder; choose another with -o")


def contents(made: Inversion, folder: str, say: Say = lambda stage: None) -> dict[str, bytes]:
    """Return the files by name; `folder` is their path from the working directory."""
    say("files")
    data = with_files(made.data, folder)
    specs = {Path(one["file"]).name: spec for one, spec in zip(data["proposals"], made.specs, strict=True)}
    charts = front_charts(made)
    texts = {
        **{f"{SPECS}/{name}": to_toml(spec) for name, spec in specs.items()},
        **charts,
        "ranking.csv": ranking(made),
        "design.md": page(data, charts),
        "design.html": html_page(data, charts, [Variant(spec).section() for spec in made.specs]),
        "design.json": json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n",
    }
    return {name: text.encode() for name, text in texts.items()}


def with_files(data: Mapping[str, Any], folder: str) -> dict[str, Any]:
    """Return the data with the path of each proposal's spec."""
    proposals = [{**one, "file": f"{folder}/{SPECS}/{one['rank']}-{one['name']}.toml"} for one in data["proposals"]]
    return {**data, "proposals": proposals}


def write(folder: Path, made: Mapping[str, bytes]) -> None:
    """Put the files in place of an earlier result's, all or none; other files in the folder stay."""
    folders.expect_folder(folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    folders.clear_leftovers(folder.parent)
    with folders.replacing(folder) as fresh:
        (fresh / SPECS).mkdir()
        for name, content in made.items():
            files.write_new(fresh / name, content)
    for earlier in [*folder.glob(f"{SPECS}/[1-9]-*.toml"), *folder.glob("front-*.svg")]:
        if earlier.relative_to(folder).as_posix() not in made:
            earlier.unlink()


def ranking(made: Inversion) -> str:
    """Return every candidate as CSV: those within the limits in their order, then the others."""
    found, asked, text = made.found, limits(made.found), io.StringIO()
    outside = np.setdiff1d(np.arange(found.count), made.rows)
    numbered = {one["name"]: one["rank"] for one in made.data["proposals"]}
    columns = [found.diameter_mm, found.height_mm, found.mass_g, found.cure_hours, found.crosstalk, found.probability]
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for place, row in enumerate([*ordered(found, made.rows), *ordered(found, outside)], 1):
        lengths, name, own = found.lengths(row), name_of(found, int(row)), made.measured.get(int(row))
        writer.writerow(
            [
                place if place <= made.rows.size else "",
                numbered.get(name, ""),
                cell(name),
                lengths.design,
                cell(lengths.motor),
                cell(" ".join(found.materials(row))),
                " ".join(f"{wall:g}" for wall in lengths.walls),
                " ".join(f"{cap:g}" for cap in lengths.caps),
                *("" if np.isnan(each[row]) else number(each[row], 4) for each in [*columns, *found.range]),
                number(own["level"], 4) if own else "",
                " ".join(limit.key for limit in asked if not limit.met[row]),
            ]
        )
    return text.getvalue()


def front(found: Candidates, rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the rows that no other one beats in both: a higher probability and a smaller value; by rising value."""
    order = rows[np.lexsort((rows, -found.probability[rows], values[rows]))]
    best = np.maximum.accumulate([-1.0, *found.probability[order]])
    return order[found.probability[order] > best[:-1] + 1e-9]


def front_charts(made: Inversion) -> dict[str, str]:
    """Return a chart of the probability over each quantity of which less costs probability, by file name."""
    found, rows, proposals, charts = made.found, made.rows, made.data["proposals"], {}
    for key, name in _QUANTITIES.items():
        values = getattr(found, key)
        best = front(found, rows, values)
        if np.all(np.isfinite(values[rows])) and best.size > 1:
            own = [one[key]["value"] if key == "crosstalk" else one[key] for one in proposals]
            series = [
                Series("candidates", values[rows], found.probability[rows], points=True),
                Series("front: nothing is better in both", values[best], found.probability[best]),
                Series("proposals", own, [one["probability"] for one in proposals], points=True),
            ]
            charts[f"front-{key}.svg"] = chart(series, f"{rows.size} candidates", name, "probability of the level")
    return charts


def page(data: Mapping[str, Any], charts: Mapping[str, str]) -> str:
    """Return the result as Markdown."""
    made = [f"# {markdown(data['name'])}: {design_text.target_line(data['target'])}", ""]
    made += [f"{'; '.join(design_text.head_lines(data))}.", ""]
    for i, one in enumerate(data["proposals"]):
        if design_text.is_first_other(data["proposals"], i):
            made += [f"*{design_text.OTHERS}.*", ""]
        made += [f"## {markdown(design_text.title(one))}", "", f"**{markdown(design_text.level_line(one))}**", ""]
        made += [f"- {markdown(line)}" for line in design_text.lines(one)]
        made += [f"- build it: `unitcad build {shlex.quote(one['file'])}`", ""]
    made += [f"![probability of the level]({name})\n" for name in charts]
    if skipped := design_text.skipped_lines(data):
        made += ["## Skipped", "", *(f"- {markdown(line)}" for line in skipped), ""]
    return "\n".join(made)


def html_page(data: Mapping[str, Any], charts: Mapping[str, str], sections: Sequence[str]) -> str:
    """Return the page of a result; `sections`: the SVG of each proposal."""
    tried, *ranks = (escape(line) for line in design_text.head_lines(data))
    refused = [
        f"{one['what']}: {one['count']} sets of lengths refused, first {one['first']}"
        for one in data["tried"]["refused"]
    ]
    proposals = zip(data["proposals"], sections, strict=True)
    body = [
        f'<div class="top"><div><h1>{escape(data["name"])}</h1>',
        f'<p class="line">{escape(design_text.target_line(data["target"]))}</p></div></div>',
        f"<section><h2>Proposals</h2>{_table(data['proposals'])}",
        f'<p class="note">Levels in per cent of the motor; mm: diameter x height. The {"; ".join(ranks)}. A '
        "probability is that of meeting the level.</p></section>",
        *(
            f'<section id="proposal-{one["rank"]}"><h2>{escape(design_text.title(one))}</h2>'
            f"<p><strong>{escape(design_text.level_line(one))}</strong></p>{_list(design_text.lines(one))}"
            f"{drawing(section, 'section of ' + one['label'])}"
            f"<p>Build it: <code>unitcad build {escape(shlex.quote(one['file']))}</code></p></section>"
            for one, section in proposals
        ),
        "<section><h2>Less costs probability</h2>",
        *(drawing(svg, "probability of the level, with the front") for svg in charts.values()),
        f"</section><section><h2>Tried</h2><p>{tried}. All of them are in ranking.csv.</p>",
        f"{_list([*design_text.skipped_lines(data), *refused])}</section>",
    ]
    return plain_page(f"{data['name']}: designs", "\n".join(body))


def _table(proposals: Sequence[Mapping[str, Any]]) -> str:
    rows, head = [], ("unit", "measured", "probability", "10 to 90 %", "g", "hours", "mm")
    for i, one in enumerate(proposals):
        edge, measured = one["edge"], one["measured"]
        outside = "" if not measured or measured["meets"] else ", outside"
        cells = [
            design_text.percent(measured["level"]) + outside if measured else "",
            f"{one['probability']:.2f}",
            f"{design_text.percent(edge['p10'])} to {design_text.percent(edge['p90'])}",
            number(one["mass_g"], 2),
            number(one["cure_hours"], 3),
            f"{number(one['diameter_mm'], 3)} x {number(one['height_mm'], 3)}",
        ]
        if design_text.is_first_other(proposals, i):
            rows.append(f'<tr><td colspan="{len(head)}">{escape(design_text.OTHERS)}</td></tr>')
        numbers = "".join(
            f'<td{_NUMBER} data-head="{escape(name)}">{escape(text)}</td>'
            for name, text in zip(head[1:], cells, strict=True)
        )
        link = f'<a href="#proposal-{one["rank"]}">{escape(design_text.title(one))}</a>'
        rows.append(f"<tr><td>{link}</td>{numbers}</tr>")
    heads = "".join(f"<th{_NUMBER if i else ''}>{escape(name)}</th>" for i, name in enumerate(head))
    return (
        '<div class="scroll" tabindex="0" role="region" aria-label="proposals"><table class="stacked">'
        f"<thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def _list(made: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in made)}</ul>" if made else ""
