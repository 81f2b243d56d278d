"""Answers to the page about an array: its form, the patch, its tools judged, its crosstalk."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from functools import lru_cache
from pathlib import Path
from typing import Any

from msgspec.structs import replace

from unitcad.arrays.array import Array, units_in
from unitcad.arrays.array_file import array_of, expand, makeable_array, sound_array, to_toml
from unitcad.arrays.array_page import WORDS, patch_model, tools_model
from unitcad.arrays.array_procedure import array_procedure
from unitcad.arrays.array_tables import AskedArray, CircuitTable, LimbTable, SheetTable
from unitcad.arrays.arrayed import said_of_unit, unit_folders
from unitcad.arrays.crosstalk import crosstalk, heat_map_svg, patch_map_svg
from unitcad.arrays.layouts import layouts
from unitcad.arrays.patch import patch_moulds
from unitcad.casting.procedure import Procedure
from unitcad.casting.steps import casting_summary
from unitcad.catalogue import materials
from unitcad.checks import check_moulds, check_unit
from unitcad.checks.gap import play_missing
from unitcad.documents import line_of
from unitcad.errors import Refusal
from unitcad.moulds.heights import height_warnings
from unitcad.moulds.mould_set import MouldSet, shallow_grooves
from unitcad.serve.form import LAST_TABLES, choices_of, fields, table_groups
from unitcad.serve.messages import Answer, Field, Group, Trusted
from unitcad.serve.unit_answers import has_code as unit_holds_code
from unitcad.serve.unit_answers import printed_line, unit_procedure
from unitcad.spec.custom_code import files_named
from unitcad.spec.raw import Table
from unitcad.spec.toml import from_json, to_json
from unitcad.validation import templates
from unitcad.validation.plain_data import at
from unitcad.validation.suggestions import every_fault

as_toml = to_toml
PICKED = ("array", "layout.kind", "unit")
"""Fields whose change needs others."""


def judge(data: dict[str, Any]) -> Mapping[str, Any]:
    """Return an array's plain data with its units' whole specs, settled. Raises UnitcadError."""
    return array_of(data).asked


def makeable(data: dict[str, Any]) -> Mapping[str, Any]:
    """Return the result of `judge`. Raises UnitcadError also for an array whose tools or circuit can't be made."""
    return makeable_array(data).asked


def asked_toml(text: str, data: Mapping[str, Any], array: Array, trusted: Trusted) -> str:
    """Return a text as TOML that names no file: the text itself if it names none."""
    return to_toml(array) if named_files(data) else text


def settled(data: Mapping[str, Any], trusted: Trusted) -> Array:
    """Return the array of a text's plain data. Raises Refusal, also for a file that a page's text may not name."""
    return array_of(with_files(data, trusted))


def with_files(data: Mapping[str, Any], trusted: Trusted) -> dict[str, Any]:
    """Return plain data with the whole spec of each unit in it. Raises Refusal for a file that may not be named."""
    named = named_files(data)
    values = set(named.values())
    folders = [Path(source.folder) for source in trusted if values <= set(source.named.values())]
    if named and not folders:
        field, value = next(iter(named.items()))
        raise Refusal(field, value, "a page's text names only files that the server's own array names")
    return expand(data, folders[0] if named else Path())


def faults_of(first: Refusal, whole: dict[str, Any], text: str) -> list[Refusal]:
    """Return every fault of an array's data, the units' specs whole in it, `first` among them, each with its line."""
    every = every_fault(first, whole, judge, sound_array(whole))
    for one in every:
        one.line = line_of(text, one.field)
    return every


def sound_with(data: Mapping[str, Any], before: Array) -> dict[str, Any]:
    """Return the data of a shipped array of a picked kind; listed points begin as the places of the array before."""
    sound = sound_array(data)
    points = [[round(place.x, 3), round(place.y, 3)] for place in before.places]
    return sound if at(data, "layout.kind") != "list" else {**sound, "layout": {"kind": "list", "points_mm": points}}


def named_files(data: Mapping[str, Any]) -> dict[str, str]:
    """Return the values of an array's plain data that name files, by their paths; a shipped unit's name is none."""
    found = files_named({key: value for key, value in data.items() if key != "design"})
    for field, unit in units_in(data).items():
        own = unit if isinstance(unit, dict) else {}
        like = own.get("like") if own else unit
        if isinstance(like, str) and like not in templates():
            found[f"{field}.like" if own else field] = like
        found |= {f"{field}.{key}": value for key, value in files_named(own).items()}
    return found


def units(data: Mapping[str, Any], folder: Path) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield each unit's plain data, with the field of its design. Raises Refusal for a unit that is not found."""
    found = units_in(expand(data, folder))
    yield from ((f"{field}.design", unit) for field, unit in found.items() if isinstance(unit, dict))


def has_code(array: Array) -> bool:
    """Tell whether a unit of an array has code. Raises Refusal if it may not run."""
    return any([unit_holds_code(unit) for unit in array.units])


def as_data(array: Array) -> dict[str, Any]:
    """Return an array's plain data, everything settled."""
    return array.asked


def form(data: Mapping[str, Any], array: Array | None) -> list[Group]:
    """Return the form of an array's plain data; `array` None if the data is refused."""
    holds = array.asked if array else {}
    choices = {
        **choices_of(data),
        "sheet.material": [(name, "") for name in materials()],
        "layout.kind": [(name, kind.about) for name, kind in layouts().items()],
        "unit": [(name, "") for name in templates()],
    }

    def rows(table: type[Table], path: str, *keys: tuple[str, ...]) -> list[Field]:
        return [*fields(table, path, data, holds, choices, *keys)]

    kind = layouts().get(str(at(data, "layout.kind")))
    unit, there = data.get("unit"), isinstance(data.get("circuit"), dict)
    made = [Group("", "Array", rows(AskedArray, "", ("name", "array")))]
    if isinstance(unit, str):
        field = Field("unit", "unit", "word", unit, given=True, required=True, choices=choices["unit"])
        made[0].fields.append(field)
    if kind is not None:
        # Its kind may be any of the kinds.
        known = {"kind": "word", "required": True, "choices": choices["layout.kind"]}
        of_kind = [replace(row, **known) if row.path == "layout.kind" else row for row in rows(kind.table, "layout")]
        made.append(Group("layout", "Layout", of_kind))
    made.append(Group("sheet", "Sheet", rows(SheetTable, "sheet")))
    made.append(Group("limb", "Limb", rows(LimbTable, "limb")))
    circuit = rows(CircuitTable, "circuit") if there else []
    made.append(Group("circuit", "Common circuit", circuit, there, optional=True))
    # The unit has the keys that the array's tables lack.
    return [*made, *table_groups(LAST_TABLES, data, array.asked["unit"] if array else {}, choices)]


def _patch(array: Array, answer: Answer) -> None:
    answer.model = patch_model(array)
    x0, y0, x1, y1 = array.sheet.outline
    answer.figures = [("units", float(len(array.places)), ""), ("sheet along x", x1 - x0, "mm")]
    answer.figures += [("along y", y1 - y0, "mm"), ("thick", array.sheet.thickness_mm, "mm")]


def _tools(array: Array, answer: Answer) -> None:
    moulds = patch_moulds(array)
    answer.model = tools_model(array)
    answer.checks = [dict(finding.as_dict()) for finding in check_moulds(moulds)]
    answer.warnings = [*shallow_grooves(moulds), *height_warnings(moulds), *play_missing(moulds)]
    apart = unit_folders(array) if moulds.construction.own_tails else {}
    for folder, unit in unit_folders(array).items():
        found, said = _checked(to_json(unit), folder in apart), said_of_unit(array, unit) if folder in apart else {}
        for finding in found:
            advice = said.get(finding["advice"], finding["advice"])
            answer.checks.append({**finding, "where": f"{folder}: {finding['where']}", "advice": advice})
        answer.warnings += [f"{folder}: {line}" for line in said.values()]
    volumes = [sum(solid.volume() for solid in moulds.meshes(step.layer)) for step in moulds.plan.steps]
    of_units = {name: _cast(to_json(unit)) for name, unit in apart.items()}
    made = array_procedure(moulds, volumes, 0.0, of_units)
    tools = ", ".join(tool.name for tool in moulds.plan.tools)
    printed = [*printed_line(moulds, "The sheet")]
    for unit in apart.values():
        printed += printed_line(MouldSet(unit), f"Unit {unit.name}")
    answer.lines = [*printed, *casting_summary(asdict(made)), f"Tools of the sheet: {tools}"]


@lru_cache(maxsize=8)
def _checked(unit: str, apart: bool) -> list[dict[str, Any]]:
    """Return the findings of the mould checks on a unit, given as JSON: with its moulds if it is cast `apart`."""
    return [dict(finding.as_dict()) for finding in (check_moulds if apart else check_unit)(MouldSet(from_json(unit)))]


@lru_cache(maxsize=8)
def _cast(unit: str) -> Procedure:
    """Return the procedure of a unit, given as JSON: it stays while the sheet changes."""
    return unit_procedure(MouldSet(from_json(unit)))


def _crosstalk(array: Array, answer: Answer) -> None:
    data = crosstalk(array)
    answer.lines = data["answer"]
    answer.drawings = [
        (WORDS["crosstalk-patch.svg"], patch_map_svg(array, data)),
        (WORDS["crosstalk.svg"], heat_map_svg(data)),
    ]


ANSWERS = {"unit": _patch, "moulds": _tools, "estimate": _crosstalk}
