"""A result's folder: the ranking, the page, the same as JSON, and a spec for each proposal."""

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
from unitcad.api.variant import Variant
from unitcad.attenuation.edge.words import level_cell
from unitcad.errors import UnitcadError
from unitcad.pipeline import write as folders
from unitcad.report.html_page import drawing, plain_page
from unitcad.search.candidates import Say, limits
from unitcad.search.proposals import Inversion, name_of, order_rows
from unitcad.spec import to_toml
from unitcad.text import cell, number, some

_GOALS = {
    "edge_min": "at least {} of the motor's amplitude at the edge",
    "edge_max": "at most {} of the motor's amplitude at the edge",
    "diameter_max_mm": "diameter at most {} mm",
    "height_max_mm": "height at most {} mm",
    "mass_max_g": "mass at most {} g",
    "cure_hours_max": "out of the mould within {} h",
    "crosstalk_ratio_max": "crosstalk ratio at most {}",
    "pitch_mm": "neighbours {} mm apart",
    "frequency_hz": "at {} Hz",
}


def percent(level: float) -> str:
    """Return a level as per cent of the motor's amplitude, two digits."""
    return f"{number(100 * level, 2)} %"


def target_line(goals: Mapping[str, Any]) -> str:
    """Return the target in words."""
    texts = {
        key: percent(value) if key in ("edge_min", "edge_max") else number(value, 4) for key, value in goals.items()
    }
    return ", ".join(text.format(texts[key]) for key, text in _GOALS.items() if key in goals)


def head_lines(data: Mapping[str, Any]) -> list[str]:
    """Return the number of candidates, the source of the probabilities, and the order that the evidence supports."""
    tried, leads = data["tried"], data["leads"]
    refused = sum(one["count"] for one in tried["refused"])
    not_made = f"; {refused} sets of lengths that no design accepts" if refused else ""
    return [
        f"{tried['candidates']} candidates ({tried['geometries']} sets of lengths), {tried['within_limits']} within "
        f"the limits{not_made}",
        f"probabilities by {leads['model']}, fitted to {leads['by']}; ranked by {leads['ranks']}",
        f"not ranked by {leads['does_not_rank']}",
    ]


def _skipped(skipped: Mapping[str, str]) -> list[str]:
    """Return a line for each silicone, or for each kind of reason if there are many."""
    if len(skipped) <= _MOST_SKIPPED:
        return [f"skipped, {name}: {why}" for name, why in skipped.items()]
    by_reason: dict[str, list[str]] = {}
    for name, why in skipped.items():
        by_reason.setdefault(re.split("[;:,]", why)[0], []).append(name)
    return [f"skipped, {some(names)}: {why}" for why, names in by_reason.items()]


_MOST_SKIPPED = 5
"""Silicones that are skipped with a line for each."""


def skipped_lines(data: Mapping[str, Any]) -> list[str]:
    """Return a line for each silicone that is skipped, and for each candidate that can't be cast."""
    return [
        *_skipped(data["skipped"]),
        *(f"can't be cast, {one['candidate']}: {'; '.join(one['failed'])}" for one in data["not_castable"]),
    ]


def title(one: Mapping[str, Any]) -> str:
    """Return a proposal's heading: its number, its kind, and whether its lengths were never measured."""
    return f"{one['rank']}. {one['label']}" + ("" if one["lengths_measured"] else " (not measured at these lengths)")


def level_line(one: Mapping[str, Any]) -> str:
    """Return the line of a proposal's level, its probability, and whether its measurement meets the target."""
    meets = ""
    if measured := one["measured"]:
        level, second = percent(measured["level"]), measured.get("also")
        also = f", also printed as {percent(second)}" if second and percent(second) != level else ""
        meets = f" The measurement ({level}{also}, {measured['by']}) meets the target."
    return f"{one['edge']['line']} Probability of meeting the target: {one['probability']:.2f}.{meets}"


def lines(one: Mapping[str, Any]) -> list[str]:
    """Return a proposal's size, mass and hours, then its reasons and its unknowns."""
    checks = "moulds not checked" if one["checks"] is None else f"moulds pass at {one['checks']} places"
    size = (
        f"{number(one['diameter_mm'], 3)} mm wide, {number(one['height_mm'], 3)} mm high, "
        f"{number(one['mass_g'], 3)} g with motor, out of the mould in {number(one['cure_hours'], 3)} h, {checks}"
    )
    made = [size]
    if one["equal_to"]:
        made.insert(
            0, f"as likely as number {one['equal_to']}; among equals the unit that is easier to make comes first"
        )
    if crosstalk := one.get("crosstalk"):
        value, low, high = (number(crosstalk[key], 2) for key in ("value", "low", "high"))
        at = crosstalk["neighbour"]
        made.append(
            f"crosstalk ratio {value} ({low} to {high}) at {number(crosstalk['pitch_mm'], 4)} mm, the same for every "
            "unit of this diameter"
            + ("" if at is None else f"; {percent(at)} of the motor's amplitude at the neighbour")
        )
    return [*made, one["lengths_gain"], *one["remarks"]]


SPECS = "specs"
_COLUMNS = (
    "place", "proposal", "name", "design", "motor", "materials", "walls_mm", "caps_mm", "diameter_mm", "height_mm",
    "mass_g", "cure_hours", "crosstalk_ratio", "probability", "edge_low", "edge_level", "edge_high", "measured", "over",
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
    texts = {
        **{f"{SPECS}/{name}": to_toml(spec) for name, spec in specs.items()},
        "ranking.csv": ranking(made),
        "design.html": html_page(data, [Variant(spec).section() for spec in made.specs]),
        "design.json": json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n",
    }
    return {name: text.encode() for name, text in texts.items()}


def with_files(data: Mapping[str, Any], folder: str) -> dict[str, Any]:
    """Return the data with the path of each proposal's spec."""
    proposals = [{**one, "file": f"{folder}/{SPECS}/{one['rank']}-{one['name']}.toml"} for one in data["proposals"]]
    return {**data, "proposals": proposals}


def write(folder: Path, made: Mapping[str, bytes]) -> None:
    """Put the files in place of an earlier result's; other files in the folder stay."""
    folders.expect_folder(folder)
    files.replace_all(folder, made, "design.json")
    for earlier in folder.glob(f"{SPECS}/[1-9]-*.toml"):
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
    for place, row in enumerate([*order_rows(found, made.rows), *order_rows(found, outside)], 1):
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


def html_page(data: Mapping[str, Any], sections: Sequence[str]) -> str:
    """Return the page of a result; `sections`: the SVG of each proposal."""
    tried, *ranks = (escape(line) for line in head_lines(data))
    refused = [
        f"{one['what']}: {one['count']} sets of lengths refused, first {one['first']}"
        for one in data["tried"]["refused"]
    ]
    proposals = zip(data["proposals"], sections, strict=True)
    body = [
        f'<div class="top"><div><h1>{escape(data["name"])}</h1>',
        f'<p class="line">{escape(target_line(data["target"]))}</p></div></div>',
        f"<section><h2>Proposals</h2>{_table(data['proposals'])}",
        f'<p class="note">Levels in per cent of the motor; mm: diameter x height. The {"; ".join(ranks)}. A '
        "probability is that of meeting the level.</p></section>",
        *(
            f'<section id="proposal-{one["rank"]}"><h2>{escape(title(one))}</h2>'
            f"<p><strong>{escape(level_line(one))}</strong></p>{_list(lines(one))}"
            f"{drawing(section, 'section of ' + one['label'])}"
            f"<p>Build it: <code>unitcad build {escape(shlex.quote(one['file']))}</code></p></section>"
            for one, section in proposals
        ),
        f"<section><h2>Tried</h2><p>{tried}. All of them are in ranking.csv.</p>",
        f"{_list([*skipped_lines(data), *refused])}</section>",
    ]
    return plain_page(f"{data['name']}: designs", "\n".join(body))


def _table(proposals: Sequence[Mapping[str, Any]]) -> str:
    rows, head = [], ("unit", "level, % (80 % range)", "measured, %", "probability", "g", "hours", "mm")
    for one in proposals:
        edge, measured = one["edge"], one["measured"]
        cells = [
            level_cell(edge["level"], edge["low"], edge["high"]),
            percent(measured["level"]).removesuffix(" %") if measured else "",
            f"{one['probability']:.2f}",
            number(one["mass_g"], 2),
            number(one["cure_hours"], 3),
            f"{number(one['diameter_mm'], 3)} x {number(one['height_mm'], 3)}",
        ]
        numbers = "".join(
            f'<td{_NUMBER} data-head="{escape(name)}">{escape(text)}</td>'
            for name, text in zip(head[1:], cells, strict=True)
        )
        link = f'<a href="#proposal-{one["rank"]}">{escape(title(one))}</a>'
        rows.append(f"<tr><td>{link}</td>{numbers}</tr>")
    heads = "".join(f"<th{_NUMBER if i else ''}>{escape(name)}</th>" for i, name in enumerate(head))
    return (
        '<div class="scroll" tabindex="0" role="region" aria-label="proposals"><table class="stacked">'
        f"<thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
    )


def _list(made: Sequence[str]) -> str:
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in made)}</ul>" if made else ""
