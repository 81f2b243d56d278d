"""An array made whole, in memory and a store: its units, the patch, its tools, circuit, crosstalk and procedure.

array.toml  manifest.json  casting.md  casting.json  bom.csv  step1-section.svg
patch/      the patch as it is worn: STL of the sheet, STEP and GLB of all
moulds/     the tools of the sheet
units/NAME/ a unit's own result, as `unitcad build` makes it: with moulds if units are cast apart
pictures/   patch, tools, pours
steps/      the state of the moulds at each step of the procedure
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from unitcad.arrays.array import Array
from unitcad.arrays.array_file import (
    ArraySource,
    array_hash,
    array_of,
    expand,
    load_array,
    suggest_for_array,
    to_toml,
    with_formats,
)
from unitcad.arrays.array_page import ARRAY_FILE, patch_glb, pictures, write_array_page
from unitcad.arrays.array_procedure import array_procedure
from unitcad.arrays.circuit import crowded_tracks
from unitcad.arrays.crosstalk import extras
from unitcad.arrays.estimate_arrays import array_summary
from unitcad.arrays.patch import PatchMoulds, patch_bodies, patch_moulds, patch_parts
from unitcad.arrays.patch_sheet import array_sheets, without_sheet
from unitcad.arrays.sheet import bending_record
from unitcad.arrays.tails import covered_tails, covered_tails_warning
from unitcad.cache import Store, digest
from unitcad.casting.figures import check_castable
from unitcad.casting.procedure import Procedure
from unitcad.casting.procedure import procedure as unit_procedure
from unitcad.casting.steps import pour_warnings
from unitcad.checks.gap import play_missing
from unitcad.documents import read_toml
from unitcad.moulds.heights import height_warnings
from unitcad.moulds.mould_set import MouldSet, shallow_grooves
from unitcad.pipeline import workshop
from unitcad.pipeline.geometry import geometric_result, record
from unitcad.pipeline.make import make
from unitcad.pipeline.manifest import (
    DRAWING,
    NO_KERNEL,
    UNCHECKED,
    BodyFile,
    Manifest,
    PartRecord,
    Skipped,
    printed_mm3,
)
from unitcad.pipeline.optional import OptionalFiles
from unitcad.pipeline.plan import (
    OUTPUTS,
    begun,
    body_key,
    code_version,
    file_stem,
    geometry_key,
    joint_key,
    step_file,
    stl_content,
)
from unitcad.pipeline.result import Product, Progress, Result
from unitcad.pipeline.subject import Compound
from unitcad.pipeline.unit import Unit
from unitcad.spec import Spec
from unitcad.spec.raw import Format
from unitcad.validation import Changes


class Arrayed(Compound):
    """An array, as a result is made of it."""

    kind: ClassVar[str] = "array"
    file: ClassVar[str] = ARRAY_FILE
    of: ClassVar[type] = Array

    def __init__(self, of: Array, given: frozenset[str] = frozenset()) -> None:
        self.array, self.unit, self.name, self.hash, self.given = of, of.unit, of.name, array_hash(of), given
        self.formats = of.unit.output.formats

    @classmethod
    def load(cls, source: ArraySource, changes: Changes = ()) -> Arrayed:
        return cls(load_array(source, changes))

    @classmethod
    def of_data(cls, data: Mapping[str, Any]) -> Arrayed:
        return cls(array_of(data))

    @classmethod
    def read(cls, path: Path) -> dict[str, Any]:
        return expand(read_toml(path), path.parent)

    offered = staticmethod(suggest_for_array)
    write_page = staticmethod(write_array_page)

    def summary(self, folder: Path, manifest: Manifest) -> Iterator[str]:
        return array_summary(self.moulds, folder, manifest)

    @property
    def moulds(self) -> PatchMoulds:
        return patch_moulds(self.array, given=self.given)

    @property
    def text(self) -> str:
        return json.dumps(self.array.asked)

    def toml(self) -> str:
        return to_toml(self.array)

    def key(self, only: Sequence[str], check: bool) -> str:
        return digest(repr((self.hash, tuple(only), check, code_version())).encode())

    def outputs(self, only: Sequence[str]) -> tuple[str, ...]:
        return tuple(only)

    def with_formats(self, formats: Sequence[Format]) -> Arrayed:
        return Arrayed(with_formats(self.array, tuple(formats)), self.given)

    def make(self, only: Sequence[str], check: bool, store: Store, progress: Progress) -> Result:
        array, moulds, made = self.array, self.moulds, Result()
        check_castable(moulds)  # refuses before the long work begins
        optional = OptionalFiles(made.skipped)
        units = {
            folder: _unit(moulds, unit, only, check, store, progress) for folder, unit in unit_folders(array).items()
        }
        if "pdf" in self.formats and {"unit", "moulds"} & set(only):
            progress("drawing")
            if drawn := optional.made(DRAWING, lambda: workshop.content([*array_sheets(moulds, only, self.hash)])):
                made.own[DRAWING] = drawn
                made.skipped += without_sheet(moulds) if "moulds" in only else []
        if moulded := [name for name in ("moulds", "casting") if name in only]:
            shape = geometric_result(moulds, moulded, check, store, progress)
            made.add(shape)
            made.label = shape.label
        if "unit" in only:
            progress("patch")
            made.add(_patch(moulds, store))
        if {"unit", "moulds"} & set(only):
            progress("pictures")
            blank = moulds.blank
            for path, draw in pictures(blank).items():
                key = geometry_key(blank, path)
                if sha256 := optional.made(path, partial(store.file, key, draw)):
                    made.shared[path] = sha256
                    made.pictures.append(path)
        made.warnings = [
            *covered_tails_warning(array),
            *crowded_tracks(array),
            *shallow_grooves(moulds),
            *height_warnings(moulds),
            *play_missing(moulds),
        ]
        if "casting" in only:
            progress("casting")
            procedure = _procedure(moulds, made.volumes_mm3, made.printed_mm3, units)
            made.cast(procedure)
            made.warnings += pour_warnings([asdict(pour) for pour in procedure.pours])
        progress("circuit and crosstalk")
        more, lacking = extras(array, only)
        made.own |= more
        for folder, product in units.items():
            made.add(product.below(folder, said_of_unit(array, unit_folders(array)[folder])))
        first = next(iter(units.values())).manifest
        made.air_ring_mm, made.estimate = first["air_ring_mm"], first["estimate"]
        made.skipped = [
            *_skipped(only, check, first["skipped"]),
            *(Skipped(output=output, reason=reason) for output, reason in lacking.items()),
            *made.skipped,
        ]
        made.blocks = {"array": _record(array, list(units))}
        return made


def unit_folders(array: Array) -> dict[str, Spec]:
    """Return each distinct unit by the folder of its own result."""
    named: dict[str, Spec] = {}
    for i, unit in enumerate(array.units):
        slug = re.sub(r"[^a-z0-9]+", "-", unit.name.lower()).strip("-")[:40].rstrip("-") or "unit"
        named[f"units/{slug}" if f"units/{slug}" not in named else f"units/{slug}-{i + 1}"] = unit
    return named


def said_of_unit(array: Array, unit: Spec) -> dict[str, str]:
    """Return the sentences of a unit's heights, each with that one which names the keys of the array's file."""
    own = MouldSet(unit)
    return dict(zip(height_warnings(own), height_warnings(own, array.paths_of(unit)), strict=True))


def _unit(
    moulds: PatchMoulds, unit: Spec, only: Sequence[str], check: bool, store: Store, progress: Progress
) -> Product:
    """Return a unit's own result; without moulds and casting if it is cast with the sheet."""
    wanted = [name for name in only if moulds.construction.own_tails or name not in ("moulds", "casting")] or ["unit"]
    progress.prefix = "unit: "
    product = make(Unit(unit, _given(moulds, unit)), wanted, check, store, progress)
    progress.prefix = ""
    return product


def _given(moulds: PatchMoulds, unit: Spec) -> frozenset[str]:
    """Return the paths of given values in a unit's own spec."""
    paths = moulds.array.paths_of(unit)
    return frozenset(key.removeprefix(path) for key in moulds.given for path in paths if key.startswith(path))


AS_CAST = "as cast; in patch.step and patch.glb its pockets are stretched round the units"


def _patch(moulds: PatchMoulds, store: Store) -> Result:
    """Return parts and files of the silicone that the units share, and the files of the whole patch."""
    blank, bodies, formats = moulds.blank, patch_bodies(moulds.array), moulds.spec.output.formats
    # A helper makes it in the meantime.
    step = [begun(step_file("patch/patch.step", blank, bodies, "patch"))] if "step" in formats else []
    made = Result()
    for body in blank.unit:
        material = moulds.plan.steps[(body.step or 1) - 1].material
        part = PartRecord(**{**record(blank, body), "material": material, "files": {}})
        if (solids := len(blank.mesh(body).decompose())) > 1:
            part["solids"] = solids
        if moulds.construction.own_tails:
            part["state"] = AS_CAST
        if "stl" in formats:
            path = f"patch/{file_stem(body)}.stl"
            made.shared[path] = store.file(body_key(blank, body, "stl"), partial(stl_content, blank, body))
            part["files"]["stl"] = BodyFile(path=path, sha256=made.shared[path])
        made.parts.append(part)
    whole = {planned.path: (planned.key, planned.make) for planned in step}
    if "glb" in formats:
        draw = partial(patch_glb, blank, patch_parts(moulds.array))
        whole["patch/patch.glb"] = partial(joint_key, blank, bodies, "patch.glb"), draw
    optional = OptionalFiles(made.skipped)
    for path, (key, draw) in whole.items():
        if sha256 := optional.made(path, lambda key=key, draw=draw: store.file(key(), draw)):
            made.shared[path] = sha256
    return made


def _procedure(
    moulds: PatchMoulds, volumes: Sequence[float], printed: float, units: Mapping[str, Product]
) -> Procedure:
    of_units = {}
    for folder, unit in unit_folders(moulds.array).items() if moulds.construction.own_tails else ():
        manifest, own = units[folder].manifest, MouldSet(unit, given=_given(moulds, unit))
        of_each = [step["layer_volume_mm3"] for step in manifest["steps"]]
        of_units[folder] = unit_procedure(own, of_each, printed_mm3(manifest["parts"]))
    return array_procedure(moulds, volumes, printed, of_units)


def _record(array: Array, folders: list[str]) -> dict[str, Any]:
    """Return the manifest's block of the array itself; `folders`: of its distinct units."""
    sheet = array.sheet
    return {
        "construction": array.construction,
        "cast": array.cast,
        "radius_mm": array.radius_mm,
        "layout": array.layout,
        "bending": bending_record(array),
        "pitch_mm": round(array.pitch_mm, 3) if len(array.places) > 1 else None,
        "sheet": {
            "material": sheet.material,
            "low_mm": sheet.low,
            "high_mm": sheet.high,
            "outline_mm": list(sheet.outline),
            "corner_mm": sheet.corner_mm,
            "strap_slots_mm": [list(slot) for slot in sheet.strap_slots],
        },
        "units": folders,
        "places": [
            {
                "name": p.name,
                "x_mm": p.x,
                "y_mm": p.y,
                "angle_deg": p.angle_deg,
                "unit": folders[array.units.index(p.unit)],
            }
            for p in array.places
        ],
        "covered_tails": list(covered_tails(array)),
    }


def _skipped(only: Sequence[str], check: bool, of_unit: list[Skipped]) -> Iterator[Skipped]:
    if not check:
        yield Skipped(output="mould checks", reason=UNCHECKED)
        yield Skipped(output="mesh checks", reason=UNCHECKED)
    for name in OUTPUTS:
        if name not in only:
            yield Skipped(output=name, reason="not asked for (--only)")
    yield from (each for each in of_unit if each["reason"] == NO_KERNEL)
