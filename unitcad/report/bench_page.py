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
from unitcad.errors import UnitcadError
from unitcad.pipeline.manifest import Manifest
from unitcad.pipeline.write import BENCH
from unitcad.report.html_page import html_page
from unitcad.report.read_results import expect, spec_in, step_pictures
from unitcad.spec import Spec, spec_hash, to_data

PROGRAMS = ("dom.js", "glb.js", "bench.js")
STYLES = ("app/page.css", "app/bench.css")


class ListedStep(msgspec.Struct):
    """A step of casting.json, as far as the page relies on it."""

    title: str
    text: str
    picture: str
    kind: str
    minutes: float
    wait_min: float
    short: str = ""


class ListedFigure(msgspec.Struct):
    """A figure of a pour."""

    name: str
    value: float


class ListedPour(msgspec.Struct):
    """A pour of casting.json."""

    index: int
    material: str
    figures: list[ListedFigure]
    part_a_g: float
    part_b_g: float
    pot_life_min: float
    cure_h: float
    steps: list[ListedStep]
    layer: str = ""


class ListedPhase(msgspec.Struct):
    """A phase of casting.json's time line."""

    name: str
    start_min: float
    bench_min: float
    wait_min: float


class ListedItem(msgspec.Struct):
    """A line of the bill."""

    item: str
    quantity: float
    unit: str
    made: str
    note: str


class ListedSize(msgspec.Struct):
    """A length to measure before printing."""

    what: str
    keys: list[str]
    value_mm: float
    assumed: str


class ListedPrinting(msgspec.Struct):
    """The lengths to measure and the plates to print."""

    sizes: list[ListedSize]
    source: str
    how: list[str]


class ListedTrouble(msgspec.Struct):
    """A fault and its remedies."""

    sign: str
    cause: str
    now: str
    spec: str


class CastingFile(msgspec.Struct):
    """The part of casting.json that the page shows."""

    name: str
    label: str
    cells: int
    earliest_finish_min: float
    bench_min: float
    time_line: list[ListedPhase]
    printing: ListedPrinting
    preparation: list[ListedStep]
    pours: list[ListedPour]
    release: list[ListedStep]
    assembly: list[ListedStep]
    measure: list[str]
    bill: list[ListedItem]
    warnings: list[str]
    troubles: list[ListedTrouble]
    makes: str = "unit"
    last: str = "Motor in"


def write_bench(folder: Path) -> Path | None:
    """Write `folder`/bench.html for the variant in `folder` and return its path; None if it has no procedure.

    Raises UnitcadError if casting.json is damaged.
    """
    try:
        data = files.read_json(folder / "casting.json", links=False)
    except files.NotThere:
        return None
    expect(data, CastingFile, folder / "casting.json")
    casting = msgspec.convert(data, CastingFile)
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


def _expected_measures(casting: CastingFile, spec: Spec | None) -> dict[str, Any]:
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
    manifest = files.read_json(folder / "manifest.json", links=False)
    expect(manifest, Manifest, folder / "manifest.json")
    return str(manifest["hash"])


def _paths(casting: CastingFile) -> list[str]:
    steps = [*casting.preparation, *(step for pour in casting.pours for step in pour.steps)]
    return [step.picture for step in (*steps, *casting.release, *casting.assembly)]
