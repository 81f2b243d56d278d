"""From an array's file, or plain data, to an array with everything settled."""

from __future__ import annotations

import copy
import hashlib
import json
import math
import os
import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from unitcad.arrays.array import Array, Placed, Sheet, units_in
from unitcad.arrays.array_tables import AskedArray
from unitcad.arrays.circuit import outline
from unitcad.arrays.constructions import Construction, construction_of
from unitcad.arrays.layouts import MOST_PLACES, LayoutKind, Point, layouts
from unitcad.arrays.layouts.ring import RingTable
from unitcad.arrays.sheet import middle_radius, sheet_of
from unitcad.arrays.tails import Blocked, angles, length_field, tail_length
from unitcad.designs.limits import up
from unitcad.documents import line_of, read_toml
from unitcad.errors import Refusal, UnitcadError, UnknownKey, WrongArgument, unknown_name
from unitcad.files import read_text
from unitcad.moulds.plan import Plan
from unitcad.shape import mm
from unitcad.spec import Spec, convert, to_data
from unitcad.spec.custom_code import with_source
from unitcad.spec.fields import fields_of
from unitcad.spec.paths import EXACT, in_words, meant
from unitcad.spec.raw import RawSpec
from unitcad.spec.toml import text_of
from unitcad.text import join_words
from unitcad.validation import custom_templates, default_template, from_data, templates
from unitcad.validation.load import named_file, override, shipped_files
from unitcad.validation.plain_data import ABSENT, RIVALS, Changes, at, changes_of, plain, put
from unitcad.validation.suggestions import Judge, every_fault, numbers, suggest_value


def array_templates() -> dict[str, Path]:
    """Return the shipped arrays by name."""
    return shipped_files("arrays")


_UNIT = re.compile(r"((?:place\.\d+\.)?unit)(?:\.(.+))?")
"""The path of a unit, or of a value in it."""


def with_changes(written: Mapping[str, Any], file: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return an expanded array's plain data with changes by `changes_of` put in: those of values in units last.

    `file`: the data as the file has it, of which a unit whose `like` is changed keeps its other keys.
    """
    whole, inside = override(written, ()), {}
    for path, value in changes.items():
        unit = _UNIT.fullmatch(path)
        if unit is None:
            put(whole, path, value)
        elif unit[2] in (None, "like"):
            own = at(file, unit[1])
            given = {**(own if isinstance(own, dict) else {}), "like": value} if unit[2] else value
            put(whole, unit[1], unit_data(given, unit[1], Path()))
        else:
            inside[path] = value
    return override(whole, inside)


def expand(data: Mapping[str, Any], folder: Path = Path()) -> dict[str, Any]:
    """Return an array's plain data with the whole spec of each unit in it. Raises Refusal for a unit not found."""
    whole = copy.deepcopy(dict(data))
    for path, unit in units_in(whole).items():
        put(whole, path, unit_data(unit, path, folder))
    return whole


def unit_data(given: Any, field: str, folder: Path) -> Any:
    """Return the plain data of a unit's spec: that of `like`, with the other keys replaced."""
    at_field = field if isinstance(given, str) else f"{field}.like"
    if isinstance(given, str):
        given = {"like": given}
    if not isinstance(given, dict) or "like" not in given:
        return with_source(given, folder) if isinstance(given, dict) else given
    own = {key: value for key, value in given.items() if key != "like"}
    if not isinstance(given["like"], str):
        raise Refusal(at_field, given["like"], "takes a text: the name of a template, or a spec file")
    known = templates() | custom_templates()
    if given["like"] in array_templates() and given["like"] not in known:
        raise Refusal(at_field, given["like"], "is an array; a unit is a single one")
    path = named_file(given["like"], known, at_field)
    if path not in known.values():
        path = folder / path
        if not path.is_file():
            raise Refusal(at_field, given["like"], f"there is no file {path}")
    base = with_source(read_toml(path), path.parent)
    displaced = [rival for table, rival in RIVALS.items() if isinstance(own.get(table), dict)]
    kept = {key: value for key, value in base.items() if key not in displaced}
    return merge_tables(kept, with_source(own, folder))


def merge_tables(base: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """Return a table with the keys of another in place of its own, and so the tables in it."""
    result = dict(base)
    for key, value in own.items():
        there = result.get(key)
        result[key] = merge_tables(there, value) if isinstance(there, dict) and isinstance(value, dict) else value
    return result


def layout_of(asked: AskedArray) -> tuple[Any, LayoutKind]:
    """Return the layout's table and kind."""
    name = asked.layout.get("kind")
    if name is None:
        raise Refusal("layout.kind", None, f"is required: one of {', '.join(layouts())}")
    if not isinstance(name, str) or name not in layouts():
        raise unknown_name("layout.kind", str(name), layouts())
    kind = layouts()[name]
    own = set(fields_of(kind.table))
    of_others = {key for each in layouts().values() for key in fields_of(each.table)} - own
    if foreign := [key for key in asked.layout if key in of_others]:
        keys = join_words([f"layout.{key}" for key in foreign])
        limit = f"unknown key; a layout of the kind {name!r} has no such keys: leave out {keys}"
        raise UnknownKey(f"layout.{foreign[0]}", asked.layout[foreign[0]], limit)
    return convert(asked.layout, kind.table, "layout"), kind


def places_of(asked: AskedArray, points: list[Point]) -> dict[int, int]:
    """Return the number of each point that a [[place]] speaks of, with that table's number."""
    names = {p.name: n for n, p in enumerate(points)}
    cells = {(p.column + 1, p.row + 1): n for n, p in enumerate(points)}
    found: dict[int, int] = {}
    for i, place in enumerate(asked.place):
        field, given = f"place.{i}.at", place.at if isinstance(place.at, str) else list(place.at)
        index = names.get(place.at) if isinstance(place.at, str) else cells.get(place.at)
        if index is None:
            if isinstance(place.at, str):
                raise unknown_name(field, place.at, list(names))
            column, row = place.at
            nearest = min(cells, key=lambda at: (abs(at[0] - column) + abs(at[1] - row), at))
            raise Refusal(field, given, "there is no such column and row", list(nearest))
        if index in found:
            raise Refusal(field, given, f"place.{found[index]} speaks of it too")
        found[index] = i
    return found


def schema() -> dict[str, Any]:
    """Return the JSON Schema of `AskedArray`; its layout is one of the kinds, each with its own keys."""
    document = msgspec.json.schema(AskedArray)
    kinds = [kind.table for kind in layouts().values()]
    tables, definitions = msgspec.json.schema_components(kinds, ref_template="#/$defs/{name}")
    for table in definitions.values():
        table["required"] = ["kind", *table.get("required", ())]
    defs = {**document["$defs"], **definitions}
    array = dict(defs["AskedArray"])
    about = array["properties"]["layout"].get("description", "")
    array["properties"] = {**array["properties"], "layout": {"description": about, "oneOf": list(tables)}}
    return {**document, "$defs": {**defs, "AskedArray": array}}


_OVERRIDES = ("moulds", "casting", "estimate", "output")
"""Tables of an array file that override those of its units."""
ArraySource = str | os.PathLike[str] | Mapping[str, object] | Array


def load_array(source: ArraySource, set: Changes = (), *, lay_tails: bool = True) -> Array:
    """Load an array.

    Parameters
    ----------
    source : str, path, mapping or Array
        A template's name, a file, plain data, or another array.
    set : dict or sequence of str, optional
        Changes as for `unitcad.load`: texts "path=value", or values by dotted path such as "layout.pitch_mm".
    lay_tails : bool, default True
        Whether to find ways for the tails between the units; an estimate needs none.

    Returns
    -------
    Array

    Raises
    ------
    Refusal, UnitcadError
        For the first invalid value; names its field.

    Examples
    --------
    >>> from unitcad.arrays import load_array
    >>> len(load_array("forearm-pockets", {"layout.pitch_mm": 22}).places)
    9
    """
    path = None
    if isinstance(source, Array):
        data, folder = copy.deepcopy(source.asked), Path()
    elif isinstance(source, Mapping):
        data, folder = plain(source), Path()
    else:
        path = named_file(os.fspath(source), array_templates(), "array", WrongArgument)
        data, folder = read_toml(path), path.parent
    written = expand(data, folder)
    whole = with_changes(written, data, changes_of(set))
    try:
        return array_of(whole, lay_tails=lay_tails)
    except Refusal as first:
        sound = sound_array(whole)
        every = every_fault(first, whole, partial(array_of, lay_tails=lay_tails), sound)
        if len(every) == 1:
            judge = makeable_array if lay_tails else partial(array_of, lay_tails=False)
            every = [suggest_for_array(first, whole, judge)]
        if path:
            for one in every:
                _locate(one, path, data, written, whole)
        every[0].others = tuple(every[1:])
        raise every[0] from None


def sound_array(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the whole data of a shipped array: of the same construction and kind of layout, if there is one."""
    shipped = [expand(read_toml(path), path.parent) for path in array_templates().values()]
    alike = [one for one in shipped if one["layout"]["kind"] == at(data, "layout.kind")] or shipped
    return next((one for one in alike if one["array"] == data.get("array")), alike[0])


def makeable_array(data: Mapping[str, Any]) -> Array:
    """Return the array of plain data as `array_of` does. Raises Refusal also if no tools or circuit can be made."""
    array = array_of(data)
    plan_tools(array)
    return array


def plan_tools(array: Array) -> Plan:
    """Return tools and pours. Raises Refusal for tools that can't be made, and for a circuit that does not fit."""
    way = construction_of(array.construction, array.cast)
    made = way.plan(array)
    if not way.own_tails:
        outline(array)
    return made


MOST_TRIED = 2_000
"""Places of all arrays together that are tried for one suggestion: a try takes some milliseconds a place."""


def suggest_for_array(refusal: Refusal, data: Mapping[str, Any], judge: Judge = makeable_array) -> Refusal:
    """Return the refusal of an array's plain data with a value that was tried and accepted, if one is found."""
    if type(refusal) is not Refusal or (refusal.value is None and refusal.nearest is None):
        return refusal
    left = MOST_TRIED

    def tried(changed: dict[str, Any]) -> object:
        nonlocal left
        # Rings twice: a hexagon's places grow as their square.
        keys = "columns", "rows", "count", "bands", "rings", "rings"
        counts = (at(changed, f"layout.{key}") for key in keys)
        left -= max(1, math.prod(count for count in counts if isinstance(count, int)))
        if left < 0:
            raise Refusal("", None, "not tried")
        return judge(changed)

    better = suggest_value(refusal, data, tried, sound_array(data))
    if isinstance(refusal.nearest, str) and isinstance(better.nearest, str):
        better.nearest = refusal.nearest  # the word that was meant, not another one
    return better


def _locate(
    refusal: Refusal, path: Path, file: Mapping[str, Any], written: Mapping[str, Any], whole: Mapping[str, Any]
) -> None:
    """Add file and line to the refusal of a value that comes from an array file and not from an option.

    Not if an option changed its table: another `layout.kind` has other keys. `written` is the file's data with the
    whole spec of each unit, `whole` that with the options in it.
    """
    table = refusal.field.rpartition(".")[0]
    if table and at(written, table) != at(whole, table):
        return
    if refusal.value is None or at(file, refusal.field) == at(whole, refusal.field) is not ABSENT:
        refusal.file, refusal.line = os.fspath(path), line_of(read_text(path), refusal.field)


def array_of(data: Mapping[str, Any], *, lay_tails: bool = True) -> Array:
    """Return the array of plain data whose units are whole specs. Raises Refusal for the first unfit value.

    Without `lay_tails` units keep the angle that they are given, or 0, whatever their tails run into.
    """
    try:
        asked = convert(data, AskedArray)
        table, kind = layout_of(asked)
    except UnknownKey as key:
        limit = key.limit.replace("`unitcad schema`", "`unitcad schema array`")
        if key.root in fields_of(RawSpec) and not key.settled:
            below = next(numbers(key.value), ("", 0))[0]
            limit = f"unknown key; closest: unit.{key.field}{below and f'.{below}'}"
            raise UnknownKey(key.root, key.value, limit) from None
        raise _or_of_the_unit(key, limit, data) from None
    way = construction_of(asked.array, asked.limb.cast)
    if way.cast == "curved" and asked.limb.radius_mm is None:
        raise Refusal("limb.radius_mm", None, "a curved mould needs the radius of the limb that it goes round", 40.0)
    cavities = asked.moulds.cavities
    if not way.own_tails and cavities != (1, 1):
        limit = "all units are cast in one pour, so their moulds have no cavities side by side: leave it out"
        raise Refusal("moulds.cavities", cavities if isinstance(cavities, str) else list(cavities), limit, [1, 1])
    if asked.circuit is not None and way.own_tails:
        limit = "its units are held with their own circuits; [circuit] is one for all, laid into notches"
        raise Refusal("array", asked.array, limit, "back-sheet")
    points = _points(kind, table, asked.limb.radius_mm)
    if len(points) > MOST_PLACES:
        raise Refusal("layout", len(points), f"an array has at most {MOST_PLACES} units")
    places = places_of(asked, points)
    unit = _unit(asked.unit, "unit", data)
    units = [unit] * len(points)
    for index, i in places.items():
        given = asked.place[i].unit
        if given is not None:
            other = _unit(given, f"place.{i}.unit", data)
            if not way.mixed:
                limit = f"a {asked.array} casts all units in one pour, so they are of one kind: leave it out, or take"
                raise Refusal(f"place.{i}.unit", other.name, f"{limit} array = 'pockets'")
            units[index] = other
    middle = middle_radius(asked, way, units)
    if middle is not None:
        points = _points(kind, table, middle)
    sheet = sheet_of(asked, way, points, units)
    _check_held(way, data, sheet, units, asked, places)
    if middle is not None:
        apart = max(unit.diameter_mm + way.apart(unit)[0] for unit in units)
        _check_closes(asked, table, sheet, middle, apart)
    _check_apart(way, points, units, kind, table, middle)
    given = {n: asked.place[i].angle_deg for n, i in places.items() if asked.place[i].angle_deg is not None}
    if given and not way.own_tails:
        n, angle = next(iter(given.items()))
        raise Refusal(f"place.{places[n]}.angle_deg", angle, "turns a unit's own tail, and these units have none")
    placed = [
        Placed(name=p.name, x=p.x, y=p.y, angle_deg=float(given.get(n) or 0.0), unit=units[n])
        for n, p in enumerate(points)
    ]
    if way.own_tails and lay_tails:
        placed = _turned(asked, placed, given, places, sheet)
    return Array(
        name=asked.name,
        construction=asked.array,
        cast=asked.limb.cast,
        radius_mm=asked.limb.radius_mm,
        layout=dict(asked.layout),
        places=tuple(placed),
        sheet=sheet,
        circuit=asked.circuit,
        asked=_settled(data, unit, asked, units, places),
    )


def _points(kind: LayoutKind, table: Any, radius: float | None) -> list[Point]:
    """Return a layout's points on the length grid; `radius`: that round which a ring's pitch is measured, mm."""
    return [Point(p.name, mm(p.x), mm(p.y), p.row, p.column) for p in kind.points(table, radius)]


def _check_closes(asked: AskedArray, table: Any, sheet: Sheet, middle: float, apart: float) -> None:
    """Raise Refusal for a sheet that is longer than its way round the limb, with the values that would fit.

    `middle`: radius of the sheet's middle; `apart`: least distance of two units of a band, from middle to middle (mm).
    """
    length, closed = sheet.outline[2] - sheet.outline[0], 2 * math.pi * middle
    if length <= closed + 2 / 1024:
        return
    limit = (
        f"round the limb the sheet's middle has {closed:.4g} mm, and the sheet is {length:.4g} mm long: its ends would "
        "overlap. Fewer units, narrower margins and slots, or a wider limb"
    )
    if isinstance(table, RingTable):
        # One pitch remains for the parts of the sheet beyond the first and the last unit.
        needed = max(length - (table.count - 1) * closed / table.count, apart)
        fits = int(closed / needed + 1e-9)
        raise Refusal("layout.count", table.count, limit, fits if fits > 1 else None)
    radius = asked.limb.radius_mm or 0.0
    raise Refusal("limb.radius_mm", radius, limit, up(length / (2 * math.pi) - (middle - radius)))


def with_formats(array: Array, formats: Iterable[str]) -> Array:
    """Return the array with other formats for the files of its units, patch and tools."""
    data = copy.deepcopy(array.asked)
    for unit in units_in(data).values():
        unit["output"]["formats"] = list(formats)
    return array_of(data)


def array_hash(array: Array) -> str:
    """Return the SHA-256 of an array's settled data without names and formats."""
    data = copy.deepcopy(array.asked)
    del data["name"]
    for unit in units_in(data).values():
        del unit["name"], unit["output"]["formats"]
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def _or_of_the_unit(key: UnknownKey, limit: str, data: Mapping[str, Any]) -> UnknownKey:
    """Return the refusal of an array's key with the keys of its unit that it may mean."""
    unit = data.get("unit")
    exact = () if key.settled else meant(key.field, key.value, AskedArray, data, EXACT)
    if isinstance(unit, Mapping) and not key.settled and not (key.nearest and not exact):
        below = meant(key.field, key.value, RawSpec, unit, EXACT)
        if below:
            every = (*exact, *(f"unit.{path}" for path in below))
            only = every[0] if len(every) == 1 else None
            return UnknownKey(key.field, key.value, f"unknown key; known: {in_words(every)}", only, every, key.root)
    return UnknownKey(key.field, key.value, limit, key.nearest, key.meant, key.root, key.settled)


def to_toml(array: Array) -> str:
    """Return the array as TOML, its units' specs whole in it: the same array when read again."""
    return text_of(array.asked)


def _unit(given: str | dict[str, Any], field: str, data: Mapping[str, Any]) -> Spec:
    """Return a unit's spec, with the array's tables over its own; refusals name the field in the array's file."""
    if isinstance(given, str) or "like" in given:  # not expanded: plain data that names a template
        given = unit_data(given, field, Path())
        assert isinstance(given, dict)
    whole = {"name": f"{data['name']}-unit", **given}
    for table in _OVERRIDES:
        if data.get(table):
            whole[table] = merge_tables(whole.get(table) or {}, data[table])
    try:
        return from_data(with_source(whole, Path()))
    except Refusal as refusal:
        own = at(data, refusal.field) is not ABSENT and refusal.field.split(".")[0] in _OVERRIDES
        place = refusal.field if own else f"{field}.{refusal.field}"
        if isinstance(refusal, UnknownKey):
            raise refusal.under("" if own else field) from None
        raise Refusal(place, refusal.value, refusal.limit, refusal.nearest) from None


def _check_held(
    way: Construction,
    data: Mapping[str, Any],
    sheet: Sheet,
    units: list[Spec],
    asked: AskedArray,
    places: dict[int, int],
) -> None:
    """Raise Refusal for a unit that does not fit the sheet, with the name of a template that does."""
    fields = {n: f"place.{i}.unit" for n, i in places.items() if asked.place[i].unit is not None}
    for field, unit in {fields.get(n, "unit"): unit for n, unit in enumerate(units)}.items():
        of_one = {"skin_mm": unit.skin_mm}
        if not way.own_tails:
            of_one |= {"motor.lip_mm": unit.motor.lip_mm, "moulds.draft_deg": unit.moulds.draft_deg}
            of_one |= {
                f"moulds.{key}": getattr(unit.moulds, key) for key in ("shrinkage_percent", "bore_compensation_mm")
            }
        for key, value in of_one.items():
            if value:
                raise Refusal(f"{field}.{key}", value, "only a single unit's moulds have it, no array's", 0.0)
        if unit.motor.absent:
            raise Refusal(f"{field}.motor", False, "an array's circuit joins motors, and this unit has none")
        if why := way.unfit(unit, sheet):
            known = sorted(templates(), key=lambda name: name != default_template())
            raise Refusal(field, unit.name, why, next((name for name in known if _accepted(data, field, name)), None))


def _accepted(data: Mapping[str, Any], field: str, value: object) -> bool:
    """Tell whether plain data is accepted with another value in a field."""
    try:
        array_of(override(data, {field: value}))
    except UnitcadError:
        return False
    return True


def _check_apart(
    way: Construction, points: list[Point], units: list[Spec], kind: LayoutKind, table: Any, middle: float | None
) -> None:
    """Raise Refusal, with the pitch that fits, for two units nearer to each other than the construction can make."""
    order = sorted(range(len(points)), key=lambda i: points[i].x)
    apart = [way.apart(units[i]) for i in order]
    x, y = np.array([(points[i].x, points[i].y) for i in order]).T
    radii, gaps = np.array([units[i].diameter_mm / 2 for i in order]), np.array([gap for gap, _ in apart])
    needed = np.add.outer(radii, radii) + np.maximum.outer(gaps, gaps)
    short = np.triu(needed - np.hypot(np.subtract.outer(x, x), np.subtract.outer(y, y)), 1)
    # Largest error of snapping two centres to the grid.
    if short.max() > 2 / 1024:
        i, j = divmod(int(np.argmax(short > short.max() - 1e-9)), len(order))
        one, other = sorted((points[order[i]], points[order[j]]), key=lambda point: (point.row, point.column))
        refusal = kind.wider(table, middle, (one, other), up(float(needed[i, j])))
        why = max(apart[i], apart[j])[1]
        raise Refusal(refusal.field, refusal.value, f"{refusal.limit}: {why}", refusal.nearest)


def _turned(
    asked: AskedArray, placed: list[Placed], given: Collection[int], places: dict[int, int], sheet: Sheet
) -> list[Placed]:
    """Return the places, each turned so that its tail finds a way. Raises Refusal for one that finds none."""
    try:
        found = angles(placed, given, sheet)
    except Blocked as blocked:
        place, i = placed[blocked.owner], places.get(blocked.owner)
        if blocked.owner in given:
            limit = (
                f"at this angle the tail of {place.name} runs into {blocked.by}; it may be {blocked.longest:g} mm long"
            )
            raise Refusal(f"place.{i}.angle_deg", place.angle_deg, limit, blocked.turned) from None
        at_unit = f"place.{i}.unit" if i is not None and asked.place[i].unit is not None else "unit"
        limit = f"the tail of {place.name} finds no straight way between the units; it may be at most"
        nearest = blocked.longest if blocked.longest >= 0.1 else None
        field, length = f"{at_unit}.{length_field(place.unit)}", tail_length(place.unit)
        raise Refusal(field, length, f"{limit} {blocked.longest:g} mm", nearest) from None
    return [replace(place, angle_deg=angle) for place, angle in zip(placed, found, strict=True)]


def _settled(
    data: Mapping[str, Any], unit: Spec, asked: AskedArray, units: list[Spec], places: dict[int, int]
) -> dict[str, Any]:
    """Return plain data that gives the same array again, each unit's spec whole in it."""
    settled = {key: copy.deepcopy(value) for key, value in data.items() if key not in _OVERRIDES}
    settled["unit"] = to_data(unit)
    for n, i in places.items():
        if asked.place[i].unit is not None:
            settled["place"][i]["unit"] = to_data(units[n])
    return settled
