"""A result's folder: ranking.csv, front.svg, design.md, design.html, design.json and a spec for each proposal."""

from __future__ import annotations

import csv
import io
import json
import re
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from unitcad import files
from unitcad.errors import UnitcadError
from unitcad.pipeline import write as folders
from unitcad.pipeline.variant import Variant
from unitcad.search import design_words as words
from unitcad.search.design_page import design_page
from unitcad.search.front_plot import front_svg, quantities
from unitcad.search.geometries import Say
from unitcad.search.proposals import Inversion, name_of
from unitcad.search.ranking_order import ordered
from unitcad.search.wishes import limits
from unitcad.spec import to_toml
from unitcad.text import cell, markdown, number

SPECS = "specs"
OWN = ("ranking.csv", "front.svg", "design.md", "design.html", "design.json", SPECS)
_COLUMNS = (
    "place", "proposal", "name", "design", "motor", "materials", "walls_mm", "caps_mm", "diameter_mm", "height_mm",
    "mass_g", "cure_hours", "crosstalk_ratio", "probability", "edge_p10", "edge_p50", "edge_p90", "measured", "over",
)  # fmt: skip


def folder_of(name: str, out: Path) -> Path:
    """Return the folder of a target's result."""
    slug = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-") or "target"
    return out / f"design-{slug}"


def check_out(out: Path) -> None:
    """Raise UnitcadError, before the work, for a file where the result's folder is to go."""
    if out.exists() and not out.is_dir():
        raise UnitcadError(f"{out}: is a file, not a folder; choose another with -o")


def contents(made: Inversion, folder: str, say: Say = lambda stage: None) -> dict[str, bytes]:
    """Return the files by name; `folder` is how they are seen from where the commands run."""
    say("files")
    data = with_files(made.data, folder)
    panels = quantities(made.found, made.rows)
    names = {"mass, g": "mass_g", "hours until it is out of the mould": "cure_hours", "height, mm": "height_mm"}
    names |= {"diameter, mm": "diameter_mm"}

    def value(one: Mapping[str, Any], quantity: str) -> float:
        return one["crosstalk"]["value"] if quantity == "crosstalk ratio" else one[names[quantity]]

    marked = [
        (str(one["rank"]), one["probability"], [value(one, panel.name) for panel in panels])
        for one in data["proposals"]
    ]
    front = front_svg(made.found, made.rows, marked)
    narrow = front_svg(made.found, made.rows, marked, columns=1)
    sections = [Variant(spec).section() for spec in made.specs]
    specs = {
        f"{SPECS}/{Path(one['file']).name}": to_toml(spec)
        for one, spec in zip(data["proposals"], made.specs, strict=True)
    }
    texts = {
        **specs,
        "ranking.csv": ranking(made),
        "front.svg": front,
        "design.md": page(data),
        "design.html": design_page(data, (front, narrow), sections),
        "design.json": json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n",
    }
    return {name: text.encode() for name, text in texts.items()}


def with_files(data: Mapping[str, Any], folder: str) -> dict[str, Any]:
    """Return the data with the path of each proposal's spec."""
    proposals = [{**one, "file": f"{folder}/{SPECS}/{one['rank']}-{one['name']}.toml"} for one in data["proposals"]]
    return {**data, "proposals": proposals}


def write(folder: Path, found: Mapping[str, bytes]) -> None:
    """Put the files in place of an earlier result's, all or none; what else lies in the folder stays."""
    folders.expect_folder(folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    folders.clear_leftovers(folder.parent)
    with folders.replacing(folder) as fresh:
        (fresh / SPECS).mkdir()
        for name, content in found.items():
            files.write_new(fresh / name, content)
    for spec in (folder / SPECS).glob("[1-9]-*.toml"):
        if f"{SPECS}/{spec.name}" not in found:  # of an earlier result
            spec.unlink()


def ranking(made: Inversion) -> str:
    """Return every candidate as CSV: those within the limits in their order, then the others."""
    found = made.found
    outside = np.setdiff1d(np.arange(found.count), made.rows)
    low, middle, high = found.range
    asked, text = limits(found), io.StringIO()
    over = {int(row): [limit.key for limit in asked if not limit.met[row]] for row in outside}
    numbers_of = {one["name"]: one["rank"] for one in made.data["proposals"]}
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(_COLUMNS)
    for place, row in enumerate([*ordered(found, made.rows), *ordered(found, outside)], 1):
        lengths, name, own = found.lengths(row), name_of(found, int(row)), made.measured.get(int(row))
        numbers = [found.diameter_mm, found.height_mm, found.mass_g, found.hours, found.crosstalk]
        numbers += [found.probability, low, middle, high]
        writer.writerow(
            [
                place if int(row) not in over else "",
                numbers_of.get(name, ""),
                cell(name),
                lengths.design,
                cell(lengths.motor),
                cell(" ".join(found.materials(row))),
                " ".join(f"{wall:g}" for wall in lengths.walls),
                " ".join(f"{cap:g}" for cap in lengths.caps),
                *("" if np.isnan(each[row]) else number(each[row], 4) for each in numbers),
                number(own["level"], 4) if own else "",
                " ".join(over.get(int(row), [])),
            ]
        )
    return text.getvalue()


def page(data: Mapping[str, Any]) -> str:
    """Return the result as Markdown."""
    lines = [f"# {markdown(data['name'])}: {words.wish_line(data['wish'])}", ""]
    lines += [f"{words.tried_line(data)}; {words.models_line(data)}.", ""]
    other = words.first_other(data["proposals"])
    for one in data["proposals"]:
        if one["rank"] == other:
            lines += [f"*{words.OTHERS}.*", ""]
        lines += [f"## {one['rank']}. {markdown(words.title(one))}", "", f"**{markdown(words.level_line(one))}**", ""]
        lines += [f"- {markdown(line)}" for line in [words.size_line(one), *words.reasons(one)]]
        lines += [f"- build it: `unitcad build {shlex.quote(one['file'])}`", ""]
    if data["decides"]:
        lines += ["## What would decide", "", markdown(data["decides"]), ""]
    lines += ["## What pulls apart", "", "![probability of the level over mass, time and size](front.svg)", ""]
    besides = [*words.left_out_lines(data), *words.not_castable_lines(data)]
    if besides:
        lines += ["## Left out", "", *(f"- {markdown(line)}" for line in besides), ""]
    return "\n".join(lines)
