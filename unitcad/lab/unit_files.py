"""The source of a lab's unit: a template, a spec file, or the record of its casting; each found, checked and hashed."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from msgspec import Meta

from unitcad import files
from unitcad.casting.cast_record import CastRecord, CastUnit, read_cast_record
from unitcad.catalogue import materials
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.spec import Spec, check_plain
from unitcad.spec.raw import Table
from unitcad.text import some
from unitcad.validation import custom_templates, from_data, put, read, templates
from unitcad.validation.load import is_path

Name = Annotated[str, Meta(min_length=1, max_length=100)]
File = Annotated[str, Meta(min_length=1, max_length=1000)]


class UnitSource(Table, frozen=True, kw_only=True):
    """A unit by its name, and its source: a template or spec file, or a cast record and a cavity of it."""

    name: Annotated[Name, Meta(description="a name of the unit")]
    spec: Annotated[File | None, Meta(description="spec file or template of the unit")] = None
    cast: Annotated[File | None, Meta(description="cast record of the unit, in place of spec")] = None
    cavity: Annotated[
        Annotated[int, Meta(ge=1, le=999)] | None,
        Meta(description="cavity of the cast record: the number engraved next to the unit"),
    ] = None


def file_of(folder: Path, name: str, field: str) -> Path:
    """Return the path of a file that a lab's file in `folder` names. Raises Refusal if there is none."""
    path = folder / name
    if not path.is_file():
        raise Refusal(field, name, f"no such file in {files.path_seen_from(folder)}")
    return path


def source_file(unit: UnitSource, folder: Path, field: str) -> str | None:
    """Return the name of the file that defines a unit; None for a template, or if there is none.

    Raises Refusal for a template that is not known, a file that is not there, and a cast record that is not valid or
    has no such unit.
    """
    if unit.spec is not None and unit.cast is not None:
        raise Refusal(f"{field}.cast", unit.cast, "excludes spec; leave one out")
    if unit.cavity is not None and unit.cast is None:
        raise Refusal(f"{field}.cavity", unit.cavity, "is of a cast record, but there is no cast")
    if unit.cast is not None:
        _cast(unit, folder, field)
        return unit.cast
    known = templates() | custom_templates()
    if unit.spec is None or unit.spec in known:
        return None
    if not is_path(unit.spec):
        raise unknown_name(f"{field}.spec", unit.spec, known)
    file_of(folder, unit.spec, f"{field}.spec")
    return unit.spec


def specs_of(
    unit: UnitSource, folder: Path, field: str, changes: Mapping[str, Any], entries: Mapping[str, Any]
) -> tuple[Spec, Spec]:
    """Return a unit's spec as asked, and as built: with the walls that its cast record measured, the mean of places.

    `changes` are values by path, `entries` tables of the lab's own such as materials.NAME. Raises Refusal.
    """
    if unit.spec is not None:
        asked = _spec_with(field, unit.spec, changes, folder, entries)
        return asked, asked
    if changes:
        raise Refusal(f"{field}.set", dict(changes), "excludes cast: the record has the spec that was cast")
    record, built = _cast(unit, folder, field)
    where = f"{field}.cast"
    if record.spec is None:
        raise Refusal(where, unit.cast, "spec: is required here: the resolved spec as a table")
    data = copy.deepcopy(record.spec)
    try:
        for path, entry in entries.items():
            put(data, path, entry)
        asked = from_data(data)
        _expect_layers(record, built, asked)
        for wall in built.walls if built else ():
            put(data, f"layers.{wall.layer - 1}.wall_mm", float(np.mean(wall.places_mm)))
        return asked, from_data(data)
    except Refusal as refusal:
        raise Refusal(where, unit.cast, str(refusal)) from None


def _spec_with(field: str, base: str, changes: Mapping[str, Any], folder: Path, entries: Mapping[str, Any]) -> Spec:
    """Return the spec that `base` names, a template or a file in `folder`, with `entries` and `changes` by path."""
    data = read(folder / base if is_path(base) else base)
    check_plain(data)
    for path, entry in entries.items():
        put(data, path, entry)
    try:
        for path, value in changes.items():
            put(data, path, value)
        return from_data(data, folder)
    except Refusal as refusal:
        raise type(refusal)(f"{field}.{refusal.field}", refusal.value, refusal.limit, refusal.nearest) from None


def measured_walls(asked: Spec, built: Spec) -> str:
    """Return the measured walls, inside out; "" if none differs from the spec."""
    if asked.layers == built.layers:
        return ""
    return "walls as measured, " + ", ".join(f"{layer.wall_mm:.3g}" for layer in built.layers) + " mm"


def _cast(unit: UnitSource, folder: Path, field: str) -> tuple[CastRecord, CastUnit | None]:
    """Return a cast record and the unit that is meant; None if nobody looked at any."""
    where, name = f"{field}.cast", str(unit.cast)
    path = file_of(folder, name, where)
    try:
        record = read_cast_record(path)
    except UnitcadError as error:
        raise Refusal(where, name, str(error)) from None
    units = {one.cavity: one for one in record.units}
    usable = [one for one in record.units if one.usable]
    nearest = min((one.cavity for one in usable), key=lambda cavity: abs(cavity - (unit.cavity or 0)), default=None)
    listed, field = some(units), f"{field}.cavity"
    if unit.cavity is not None:
        found = units.get(unit.cavity)
        if found is None and units:
            raise Refusal(field, unit.cavity, f"{name} has no such unit; it has {listed}", nearest)
    elif len(units) > 1 and len(usable) != 1:
        raise Refusal(field, None, f"is required: {name} has the cavities {listed}")
    else:
        found = next(iter([*usable, *record.units]), None)
    if found is not None and not found.usable:
        raise Refusal(field, found.cavity, f"{name} says that this unit is not usable", nearest)
    return record, found


def _expect_layers(record: CastRecord, built: CastUnit | None, asked: Spec) -> None:
    """Refuse walls of layers that the spec does not have, and another silicone in a pour than the spec's."""
    count, known = len(asked.layers), materials(asked.materials)
    for wall in built.walls if built else ():
        if wall.layer > count:
            raise Refusal("units.walls.layer", wall.layer, f"the spec has {count} layers", count)
    for i, pour in enumerate(record.pours):
        if pour.material in known and pour.index <= count and pour.material != asked.layers[pour.index - 1].material:
            of = asked.layers[pour.index - 1].material
            raise Refusal(f"pours.{i}.material", pour.material, f"the record's own spec has {of} in layer {pour.index}")
