"""The bench page of a variant: its casting procedure for a phone, with timers, fields and the cast record.

One HTML file as the report is, made from casting.json, the pictures of the steps and the spec of the same folder.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec

from unitcad import __version__, files
from unitcad.casting.cast_record import ENDING, FORMAT, HASH_DIGITS
from unitcad.casting.preparation import MEASURED_MM
from unitcad.casting.procedure import Procedure
from unitcad.documents import read_json
from unitcad.errors import UnitcadError
from unitcad.pipeline.manifest import BENCH, Manifest
from unitcad.report.html_page import html_page
from unitcad.report.read_results import expect, spec_in, step_pictures
from unitcad.spec import Spec, spec_hash, to_data

PROGRAMS = ("dom.js", "glb.js", "bench.js")
STYLES = ("app/page.css", "app/bench.css")


def write_bench(folder: Path) -> Path | None:
    """Write `folder`/bench.html for the variant in `folder` and return its path; None if it has no procedure.

    Raises UnitcadError if casting.json is damaged.
    """
    try:
        data = read_json(folder / "casting.json", links=False)
    except files.NotThere:
        return None
    expect(data, Procedure, folder / "casting.json")
    casting = msgspec.convert(data, Procedure)
    try:
        spec = spec_in(folder)
    except UnitcadError:  # such as one that runs code: the record then names it only by its hash
        spec = None
    content: dict[str, Any] = {
        "version": __version__,
        "casting": msgspec.to_builtins(casting),
        "spec": to_data(spec) if spec else None,
        "hash": spec_hash(spec)[:HASH_DIGITS] if spec else _hash(folder),
        "room_c": spec.casting.room_c if spec else None,
        "scale_g": spec.casting.scale_resolution_g if spec else None,
        "asked": _expected_measures(casting, spec),
        "record": {"format": FORMAT, "version": 1, "ending": ENDING},
        "measured_mm": MEASURED_MM,
        "pictures": step_pictures(folder, _paths(casting)),
    }
    target = folder / BENCH
    text = html_page(content, f"{casting.name}: bench", PROGRAMS, STYLES, (), "Without a script, read casting.md.")
    files.write(target, text.encode("utf-8", "replace"))
    return target


def _expected_measures(casting: Procedure, spec: Spec | None) -> dict[str, Any]:
    """Return the expected measures of a unit, mm and g: the page refuses values far from them. {} if unknown."""
    if spec is None:
        return {}
    figures = [{figure.name: figure.value for figure in pour.figures} for pour in casting.pours]
    grams = [each.get("volume of one layer", 0.0) * each.get("density", 0.0) / 1000 for each in figures]
    return {
        "height_mm": figures[-1].get("depth of this pour"),  # the last rim over the seat
        "diameter_mm": spec.diameter_mm,
        "mass_g": sum(grams) if all(grams) else None,
        "walls_mm": [layer.wall_mm for layer in spec.layers],
    }


def _hash(folder: Path) -> str:
    manifest = read_json(folder / "manifest.json", links=False)
    expect(manifest, Manifest, folder / "manifest.json")
    return str(manifest["hash"])


def _paths(casting: Procedure) -> list[str]:
    steps = [*casting.preparation, *(step for pour in casting.pours for step in pour.steps)]
    return [step.picture for step in (*steps, *casting.release, *casting.assembly)]
