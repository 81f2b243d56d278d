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
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from dataclasses import asdict
from functools import cache, partial
from pathlib import Path
from typing import Any, cast

from unitcad import __version__
from unitcad.arrays.array import Array
from unitcad.arrays.array_file import (
    ArraySource,
    array_hash,
    array_of,
    expand,
    load_array,
    makeable_array,
    sound_array,
    to_toml,
    with_formats,
)
from unitcad.arrays.array_page import ARRAY_FILE, ArrayManifest, patch_glb, picture_names, pictures, write_array_page
from unitcad.arrays.array_procedure import array_procedure
from unitcad.arrays.circuit import crowded_tracks, has_circuit
from unitcad.arrays.constructions import construction_of
from unitcad.arrays.crosstalk import extras
from unitcad.arrays.estimate_arrays import array_summary, estimate_arrays
from unitcad.arrays.offers import suggest_for_array
from unitcad.arrays.patch import PatchMoulds, patch_bodies, patch_moulds, patch_parts
from unitcad.arrays.sheet import bending_record
from unitcad.arrays.tails import covered_tails, covered_tails_warning
from unitcad.cache import Store, digest
from unitcad.casting.procedure import Procedure
from unitcad.casting.procedure import procedure as unit_procedure
from unitcad.casting.procedure_text import files as written
from unitcad.casting.procedure_text import step_section
from unitcad.casting.steps import pour_warnings
from unitcad.casting.views import picture_path, views
from unitcad.casting.views import pictures as bench_pictures
from unitcad.checks.finding import FindingRecord
from unitcad.checks.gap import play_missing
from unitcad.errors import Refusal
from unitcad.moulds.mould_set import MouldSet, shallow_grooves
from unitcad.pipeline.make import DRAWING, Product, Progress, Subject, finish, geometry, mould_findings, record
from unitcad.pipeline.manifest import (
    CASTING,
    NO_KERNEL,
    UNCHECKED,
    BodyFile,
    Geometry,
    Manifest,
    MeshFinding,
    PartRecord,
    Skipped,
    count_findings,
    printed_mm3,
)
from unitcad.pipeline.plan import (
    OUTPUTS,
    Planned,
    begun,
    body_key,
    code_version,
    file_stem,
    geometry_key,
    joint_key,
    kernel_versions,
    step_file,
    stl_content,
)
from unitcad.pipeline.scenes import drawing
from unitcad.pipeline.subjects import Compound
from unitcad.spec import Spec, read_toml
from unitcad.spec.raw import Format
from unitcad.validation import Changes


class Arrayed(Compound):
    """An array, as a result is made of it."""

    kind, file = "array", ARRAY_FILE

    def __init__(self, array: Array) -> None:
        self.of, self.unit, self.name, self.hash = array, array.unit, array.name, array_hash(array)
        self.formats = array.unit.output.formats

    @classmethod
    def load(cls, source: ArraySource, changes: Changes = ()) -> Arrayed:
        return cls(load_array(source, changes))

    @classmethod
    def of_data(cls, data: Mapping[str, Any]) -> Arrayed:
        return cls(array_of(data))

    @classmethod
    def read(cls, path: Path) -> dict[str, Any]:
        return expand(read_toml(path), path.parent)

    @classmethod
    def offered(cls, refusal: Refusal, data: Mapping[str, Any]) -> Refusal:
        return suggest_for_array(refusal, data, makeable_array, sound_array(data))

    @classmethod
    def write_page(cls, folder: Path, warn: Callable[[str], None]) -> Path:
        return write_array_page(folder, warn)

    @classmethod
    def estimate(
        cls,
        names: Sequence[str],
        sets: Sequence[str],
        hertz: Sequence[float],
        masses: bool,
        details: bool,
        as_json: bool,
    ) -> None:
        estimate_arrays(names, sets, hertz, masses, details, as_json)

    def summary(self, folder: Path, manifest: Manifest, given: Container[str] = ()) -> Iterator[str]:
        return array_summary(self.of, folder, manifest, given)

    @property
    def moulds(self) -> PatchMoulds:
        return patch_moulds(self.of, given=self.given)

    @property
    def text(self) -> str:
        return json.dumps(self.of.asked)

    def key(self, only: Sequence[str], check: bool) -> str:
        return digest(repr((self.hash, tuple(only), check, code_version())).encode())

    def outputs(self, only: Sequence[str]) -> tuple[str, ...]:
        return tuple(only)

    def with_formats(self, formats: Sequence[Format]) -> Arrayed:
        return Arrayed(with_formats(self.of, tuple(formats)))

    def same_file(self, data: dict[str, Any]) -> Arrayed:
        return Arrayed(array_of(data))

    def make(self, only: Sequence[str], check: bool, store: Store, progress: Progress) -> Product:
        array: Array = self.of
        moulds = self.moulds
        moulds.plan  # noqa: B018  # refuses before the long work begins
        units = {
            folder: _unit(array, unit, self.given, only, check, store, progress)
            for folder, unit in unit_folders(array).items()
        }
        own: dict[str, bytes] = {Arrayed.file: to_toml(array).encode()}
        shared: dict[str, str] = {}
        for folder, product in units.items():
            own |= {f"{folder}/{path}": content for path, content in product.own.items()}
            shared |= {f"{folder}/{path}": sha256 for path, sha256 in product.shared.items()}
        parts: list[PartRecord] = []
        shape: Geometry | None = None
        if "pdf" in self.formats and "moulds" in only:
            own[DRAWING] = drawing(moulds, ("moulds",))
        if {"moulds", "casting"} & set(only):
            shape = geometry(moulds, ["moulds"], check and "moulds" in only, store, progress)
            if "moulds" in only:
                shared |= shape["files"]
                parts += shape["parts"]
        if "unit" in only:
            progress("patch")
            made, files = _patch(moulds, store)
            parts, shared = [*parts, *made], shared | files
        drawn: list[str] = []
        tracks = crowded_tracks(array) if has_circuit(array) else []
        warned = [*covered_tails_warning(array), *tracks, *shallow_grooves(moulds), *play_missing(moulds)]
        if {"unit", "moulds"} & set(only):
            progress("pictures")
            shown = _pictures(moulds, store)
            drawn, shared = list(shown), shared | shown
        if "casting" in only and shape:
            progress("casting")
            for step in moulds.plan.steps:
                draw = partial(step_section, moulds, step)
                key = geometry_key(moulds, f"section of pour {step.index}")
                shared[f"step{step.index}-section.svg"] = store.file(key, lambda draw=draw: draw().encode())
            shared |= _step_pictures(moulds, store)
            made = _procedure(moulds, shape, units)
            own |= {path: text.encode() for path, text in written(made).items()}
            warned += pour_warnings([asdict(pour) for pour in made.pours])
        progress("circuit and crosstalk")
        more, lacking = extras(array, only)
        own |= more
        manifest = _manifest(array, moulds, only, check, shape, units, parts, drawn, own, warned)
        manifest["skipped"] += [Skipped(output=output, reason=reason) for output, reason in lacking.items()]
        return finish(manifest, own, shared, store)


def unit_folders(array: Array) -> dict[str, Spec]:
    """Return each distinct unit by the folder of its own result."""
    named: dict[str, Spec] = {}
    for i, unit in enumerate(array.units):
        slug = re.sub(r"[^a-z0-9]+", "-", unit.name.lower()).strip("-")[:40].rstrip("-") or "unit"
        named[f"units/{slug}" if f"units/{slug}" not in named else f"units/{slug}-{i + 1}"] = unit
    return named


def _unit(
    array: Array,
    unit: Spec,
    given: frozenset[str],
    only: Sequence[str],
    check: bool,
    store: Store,
    progress: Progress,
) -> Product:
    """Return a unit's own result; without moulds and casting if it is cast with the sheet."""
    apart = construction_of(array.construction, array.cast).own_tails
    wanted = [name for name in only if apart or name not in ("moulds", "casting")] or ["unit"]
    progress.prefix = "unit: "
    subject = Subject(unit)
    subject.given = _given(array, unit, given)
    product = subject.make(wanted, check, store, progress)
    progress.prefix = ""
    return product


def _given(array: Array, unit: Spec, given: frozenset[str]) -> frozenset[str]:
    """Return the paths of given values in a unit's own spec."""
    paths = array.paths_of(unit)
    return frozenset(key.removeprefix(path) for key in given for path in paths if key.startswith(path))


def _patch(moulds: PatchMoulds, store: Store) -> tuple[list[PartRecord], dict[str, str]]:
    """Return records and files of the silicone that the units share, and the files of the whole patch."""
    blank, bodies = moulds.blank, patch_bodies(moulds.arranged)
    parts: dict[str, PartRecord] = {}
    versions = sorted(kernel_versions(("glb",)).items())
    table = (
        [begun(step_file("patch/patch.step", blank, bodies, "patch"))] if "step" in moulds.spec.output.formats else []
    )
    for body in blank.unit:
        parts[body.name] = {**record(blank, body), "material": _material(moulds, body.step), "files": {}}
        if (solids := len(blank.mesh(body).decompose())) > 1:
            parts[body.name]["solids"] = solids
        path, key = f"patch/{file_stem(body)}.stl", partial(body_key, blank, body, "stl")
        table.append(Planned(path, partial(stl_content, blank, body), key, form="stl", bodies=(body.name,)))
    glb = partial(patch_glb, blank, patch_parts(moulds.arranged))
    table.append(Planned("patch/patch.glb", glb, lambda: joint_key(blank, bodies, "glb", None, versions), form="glb"))
    files: dict[str, str] = {}
    for planned in reversed(table):
        if planned.form in moulds.spec.output.formats:
            files[planned.path] = store.file(planned.key(), planned.make)
            if planned.form == "stl":
                part = parts[planned.bodies[0]]
                part["files"]["stl"] = BodyFile(path=planned.path, sha256=files[planned.path])
    return list(parts.values()), files


def _pictures(moulds: PatchMoulds, store: Store) -> dict[str, str]:
    blank = moulds.blank
    together = cache(lambda: pictures(blank))
    return {
        path: store.file(geometry_key(blank, path), lambda path=path: together()[path]) for path in picture_names(blank)
    }


def _step_pictures(moulds: PatchMoulds, store: Store) -> dict[str, str]:
    """Return the pictures of the procedure's steps: all drawn when the first is not kept yet."""
    together = cache(lambda: bench_pictures(moulds))
    return {
        path: store.file(geometry_key(moulds.blank, path), lambda path=path: together()[path])
        for path in map(picture_path, views(moulds))
    }


def _procedure(moulds: PatchMoulds, shape: Geometry, units: dict[str, Product]) -> Procedure:
    """Return how the array is cast."""
    volumes = [step["layer_volume_mm3"] for step in shape["steps"]]
    apart = unit_folders(moulds.arranged) if moulds.construction.own_tails else {}
    array, given = moulds.arranged, moulds.given
    of_units = {folder: _of_unit(unit, units[folder], _given(array, unit, given)) for folder, unit in apart.items()}
    return array_procedure(moulds, volumes, printed_mm3(shape["parts"]), of_units)


def _of_unit(unit: Spec, product: Product, given: frozenset[str]) -> Procedure:
    manifest = product.manifest
    volumes = [step["layer_volume_mm3"] for step in manifest["steps"]]
    return unit_procedure(MouldSet(unit, given=given), volumes, printed_mm3(manifest["parts"]))


def _material(moulds: PatchMoulds, step: int | None) -> str | None:
    return moulds.plan.steps[step - 1].material if step else None


def _manifest(
    array: Array,
    moulds: PatchMoulds,
    only: Sequence[str],
    check: bool,
    shape: Geometry | None,
    units: dict[str, Product],
    parts: list[PartRecord],
    drawn: list[str],
    own: dict[str, bytes],
    warned: list[str],
) -> ArrayManifest:
    """Return the manifest but for its files: the array's own records, and those of its units under their folders.

    `warned`: of the array itself.
    """
    first = next(iter(units.values())).manifest
    findings = mould_findings(moulds.spec, shape) if shape and check and "moulds" in only else []
    meshes: list[MeshFinding] = list(shape["check"]) if shape and check and "moulds" in only else []
    every = [*parts]
    for folder, product in units.items():
        manifest = product.manifest
        findings += [
            FindingRecord(**{**each, "where": f"{folder}: {each['where']}"}) for each in manifest["mould_checks"]
        ]
        meshes += [
            MeshFinding(**{**each, "path": f"{folder}/{each['path']}"}) for each in manifest["check"]["findings"]
        ]
        every += [_under(folder, part) for part in manifest["parts"]]
    unit_warnings = [f"{folder}: {line}" for folder, product in units.items() for line in product.manifest["warnings"]]
    return ArrayManifest(
        name=array.name,
        design=array.unit.design,
        printer=array.unit.moulds.printer,
        hash=array_hash(array)[:12],
        outputs=list(only),
        label=moulds.plan.label if shape else None,
        warnings=[*warned, *unit_warnings],
        air_ring_mm=first["air_ring_mm"],
        mesh={**first["mesh"], "segments": moulds.segments},
        parts=every,
        steps=[
            {**step, "material": moulds.plan.steps[step["index"] - 1].material}
            for step in (shape["steps"] if shape else [])
        ],
        mould_checks=findings,
        estimate=first["estimate"],
        check=count_findings(meshes),
        pictures=drawn,
        casting=sorted(path for path in own if path in CASTING) or None,
        skipped=list(_skipped(array, only, check, first["skipped"])),
        versions={"unitcad": __version__, **kernel_versions(array.unit.output.formats)},
        files={},
        array=_record(array, units),
    )


def _record(array: Array, units: dict[str, Product]) -> dict[str, Any]:
    """Return the manifest's block of the array itself."""
    folders_of = list(units)
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
        "units": folders_of,
        "places": [
            {
                "name": p.name,
                "x_mm": p.x,
                "y_mm": p.y,
                "angle_deg": p.angle_deg,
                "unit": folders_of[array.units.index(p.unit)],
            }
            for p in array.places
        ],
        "covered_tails": [asdict(tail) for tail in covered_tails(array)],
    }


def _under(folder: str, part: PartRecord) -> PartRecord:
    """Return a unit's part as the array's manifest has it: name and files under the unit's folder."""
    files = {
        form: cast("BodyFile", {**file, "path": f"{folder}/{file['path']}"}) for form, file in part["files"].items()
    }
    return {**part, "name": f"{folder}: {part['name']}", "files": files}


def _skipped(array: Array, only: Sequence[str], check: bool, of_unit: list[Skipped]) -> Iterator[Skipped]:
    if not check:
        yield Skipped(output="mould checks", reason=UNCHECKED)
        yield Skipped(output="mesh checks", reason=UNCHECKED)
    for name in OUTPUTS:
        if name not in only:
            yield Skipped(output=name, reason="not asked for (--only)")
    yield from (each for each in of_unit if each["reason"] == NO_KERNEL)
