"""A unit's result made whole, in memory and a store: its files, and the manifest that lists them.

Files that depend only on the geometry see a mould set whose materials, names and casting are blank (`MouldSet.blank`),
so that nothing can read them unnoticed: it serves every variant of that geometry.
"""

from __future__ import annotations

import os
import re
import time
from collections import defaultdict
from collections.abc import Callable, Hashable, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.attenuation.edge.estimates import rounded_layered
from unitcad.attenuation.inputs import EstimateInput
from unitcad.cache import Store, digest
from unitcad.casting.figures import check_castable
from unitcad.casting.procedure import procedure
from unitcad.casting.procedure_text import files as written
from unitcad.catalogue import Printer
from unitcad.checks import Strain, check_geometry, check_unit, strain_findings, strains
from unitcad.checks.finding import FindingRecord
from unitcad.errors import Unfinished
from unitcad.estimate_inputs import estimate_input, estimate_spec
from unitcad.json_text import json_bytes
from unitcad.kernels.mesh import bounds
from unitcad.meshcheck import Options, check_bytes
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline import manifest as manifests
from unitcad.pipeline.manifest import (
    CASTING,
    BodyFile,
    Geometry,
    Manifest,
    MeshFinding,
    PartRecord,
    PourRecord,
)
from unitcad.pipeline.optional import OptionalFiles
from unitcad.pipeline.plan import (
    GEOMETRIC,
    Planned,
    begun,
    body_key,
    build_key,
    code_version,
    geometry_key,
    groups,
    is_printed,
    plan,
    ready,
)
from unitcad.pipeline.plan import forget as forget_geometry
from unitcad.pipeline.scenes import drawing
from unitcad.shape.tree import Body
from unitcad.spec import Spec, printer_of, spec_hash, to_json, to_toml, with_formats
from unitcad.spec.raw import Format

MESH_FORMATS = ("stl", "3mf")
"""The formats whose files the mesh rules look at."""
DRAWING = "drawing.pdf"


@dataclass
class Progress:
    """`progress("meshes")` begins a stage, which ends the one before, and passes its name to `say`."""

    say: Callable[[str], object] = lambda stage: None
    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    stage: str = ""
    prefix: str = ""
    since: float = field(default_factory=time.perf_counter)

    def __call__(self, stage: str) -> None:
        now = time.perf_counter()
        if self.stage:
            self.seconds[self.stage] += now - self.since
        if stage and stage not in self.seconds:
            self.say(self.prefix + stage)
        self.stage, self.since = stage, now


@dataclass(frozen=True)
class Product:
    """A result's files by their paths: `own` as bytes, `shared` as the SHA-256 of content in a store."""

    manifest: Manifest
    own: dict[str, bytes]
    shared: dict[str, str]

    def place(self, folder: Path, store: Store) -> None:
        """Write the result into an empty folder. Raises OSError, or MissingContent if the store lost a content."""
        inside = f"{folder}{os.sep}"  # names as text: a Path costs as much as the link
        for parent in sorted({os.path.dirname(path) for path in (*self.own, *self.shared)} - {""}):
            os.makedirs(inside + parent, exist_ok=True)
        for path, sha256 in self.shared.items():
            store.place(sha256, inside + path)
        for path, content in self.own.items():
            files.write_new(inside + path, content)


class Subject:
    """A spec as the source of a result; `subjects.Compound` is the same for several units."""

    kind, file = "spec", "spec.toml"
    given: frozenset[str] = frozenset()
    """The paths of the values that a person gave: lengths among them count as measured."""

    def __init__(self, spec: Spec) -> None:
        self.of: Any = spec
        self.unit, self.name, self.hash = spec, spec.name, spec_hash(spec)
        self.formats: tuple[Format, ...] = spec.output.formats

    @property
    def folder_name(self) -> str:
        """Return <slug>-<hash12>, at most 63 characters; the hash covers neither name nor formats."""
        slug = re.sub(r"(?:(?!(?<=[0-9])\.[0-9])[^a-z0-9])+", "-", self.name.lower())  # 1.2 keeps its point
        slug = slug.strip("-")[:50].rstrip("-.") or "unit"
        slug = slug.replace(".", "-") if files.names_device(slug) else slug  # on Windows com1.5 is the device com1
        return f"{slug}-{self.hash[:12]}"

    @property
    def moulds(self) -> MouldSet:
        """Return the bodies and tools that are made of it."""
        return MouldSet(self.of)

    @property
    def text(self) -> str:
        """Return a text from which `subject_of_text` makes the same."""
        return to_json(self.of)

    def key(self, only: Sequence[str], check: bool) -> str:
        """Return the key under which variants share their making."""
        return build_key(self.moulds, only, check)

    def outputs(self, only: Sequence[str]) -> tuple[str, ...]:
        """Return the outputs of `only` that this subject has."""
        return tuple(only)

    def with_formats(self, formats: Sequence[Format]) -> Subject:
        """Return the same subject with other formats."""
        return Subject(with_formats(self.of, tuple(formats)))

    def make(self, only: Sequence[str], check: bool, store: Store, progress: Progress) -> Product:
        """Make all files that `only` asks for, in memory and `store`.

        Raises Refusal if the moulds can't be made, Unfinished if a check lacks memory or time.
        """
        spec, outputs = self.unit, tuple(only)
        moulds = MouldSet(spec, given=self.given)
        if {"moulds", "casting"} & set(outputs):
            check_castable(moulds)  # refuses before the long work begins
        own: dict[str, bytes] = {"spec.toml": to_toml(spec).encode()}
        optional = OptionalFiles()
        if "pdf" in spec.output.formats and {"unit", "moulds"} & set(outputs):  # its names are the spec's own
            progress("drawing")
            if drawn := optional.made(DRAWING, lambda: drawing(moulds, outputs)):
                own[DRAWING] = drawn
        estimate = None
        if "estimate" in outputs:  # first: the helper for STEP loads its kernel in the meantime
            progress("estimate")
            estimate, own["estimate.json"] = _estimate(spec, store)
        shape = geometry(moulds, outputs, check, store, progress)
        pictures = _shaded_pictures(moulds, outputs, store, progress, optional)
        if "casting" in outputs:
            progress("casting")
            volumes = [step["layer_volume_mm3"] for step in shape["steps"]]
            made = written(procedure(moulds, volumes, manifests.printed_mm3(shape["parts"])))
            own |= {path: made[path].encode() for path in CASTING}
        progress("manifest")
        findings = mould_findings(spec, shape)
        manifest = manifests.of_unit(moulds, outputs, check, shape, findings, estimate, list(pictures))
        manifest["skipped"] += [*shape["skipped"], *optional.skipped]
        return finish(manifest, own, {**shape["files"], **pictures}, store)


def finish(manifest: Manifest, own: dict[str, bytes], shared: dict[str, str], store: Store) -> Product:
    """Return a product whose manifest lists all its files."""
    listed = {path: manifests.FileRecord(bytes=len(content), sha256=digest(content)) for path, content in own.items()}
    listed |= {path: manifests.FileRecord(bytes=store.size(sha), sha256=sha) for path, sha in shared.items()}
    manifest["files"] = dict(sorted(listed.items()))
    return Product(manifest, {**own, "manifest.json": json_bytes(manifest)}, shared)


def geometry(moulds: MouldSet, only: Sequence[str], check: bool, store: Store, progress: Progress) -> Geometry:
    """Return parts, steps, mould findings, mesh findings and files of a set's geometry."""
    key = build_key(moulds, only, check)
    wanted = [name for name in only if name in GEOMETRIC]
    return store.data(
        key,
        lambda: _geometry(moulds.blank, wanted, check, store, progress),
        intact=lambda there: all(map(store.has, there["files"].values())),
    )


def _geometry(moulds: MouldSet, only: Sequence[str], check: bool, store: Store, progress: Progress) -> Geometry:
    progress("plan")
    forms = [form for form in moulds.spec.output.formats if form != "png"]
    table = [begun(planned) for planned in plan(moulds, only, forms)]
    progress("meshes")
    parts: dict[str, PartRecord] = {}
    for body in (body for group in groups(moulds, only) for body in group.bodies):
        kept = store.data(body_key(moulds, body, "record"), partial(record, moulds, body))
        parts[body.name] = PartRecord(**{**kept, "files": {}})
    made: dict[str, str] = {}
    optional = OptionalFiles()

    def put(planned: Planned) -> None:
        progress(planned.stage)
        meshes = planned.form in MESH_FORMATS
        sha256 = _filed(store, planned) if meshes else optional.made(planned.path, partial(_filed, store, planned))
        if sha256 is None:
            return
        made[planned.path] = sha256
        for name in planned.bodies:
            copies = planned.bodies.count(name)
            parts[name]["files"][planned.form] = BodyFile(path=planned.path, sha256=sha256)
            if copies > 1:
                parts[name]["files"][planned.form]["copies"] = copies

    later = [planned for planned in table if planned.stage in ("step", "step pictures")]
    for planned in table:
        if planned not in later:
            put(planned)
    findings, strained = _mould_checks(moulds, only, store, progress) if check else ([], [])
    meshes = _mesh_checks(moulds, parts, store, progress) if check else []
    for planned in later:  # the helper makes STEP in the meantime
        put(planned)
    pours = bool({"moulds", "casting"} & set(only))
    return {
        "label": moulds.plan.label if pours else None,
        "air_ring_mm": round(moulds.dimensions.air_ring, 9),
        "parts": list(parts.values()),
        "steps": store.data(geometry_key(moulds, "steps"), lambda: _pours(moulds)) if pours else [],
        "mould_checks": findings,
        "strains": strained,
        "check": meshes,
        "files": made,
        "skipped": optional.skipped,
    }


def _filed(store: Store, planned: Planned) -> str:
    """Return the SHA-256 of a planned file, made if the store lacks it."""
    return store.file(planned.key(), planned.make)


def _shaded_pictures(
    moulds: MouldSet, only: Sequence[str], store: Store, progress: Progress, optional: OptionalFiles
) -> dict[str, str]:
    """Return the pictures that the format png asks for, path to SHA-256."""
    if "png" not in moulds.spec.output.formats:
        return {}
    progress("pictures")
    scenes = [planned for planned in plan(moulds.blank, only, ("png",)) if planned.form == "png"]
    made = {planned.path: optional.made(planned.path, partial(_filed, store, planned)) for planned in scenes}
    return {path: sha256 for path, sha256 in made.items() if sha256}


def _mould_checks(
    moulds: MouldSet, only: Sequence[str], store: Store, progress: Progress
) -> tuple[list[FindingRecord], list[dict[str, Any]]]:
    """Return the findings and strains of the moulds; of a unit without moulds the overlaps of its bodies."""
    progress("mould checks")
    if "moulds" not in only and "unit" not in only:
        return [], []
    checked = "mould checks" if "moulds" in only else "overlaps in the unit"
    run = check_geometry if "moulds" in only else check_unit
    findings = store.data(geometry_key(moulds, checked), lambda: _dicts(run(moulds)))
    if "moulds" not in only:
        return findings, []
    return findings, store.data(geometry_key(moulds, "strains"), lambda: list(map(asdict, strains(moulds))))


def _dicts(findings: Sequence[Any]) -> list[Any]:
    return [finding.as_dict() for finding in findings]


def record(moulds: MouldSet, body: Body) -> PartRecord:
    """Return a body's entry in the manifest, material and files left open."""
    body = body.in_file
    solid = moulds.mesh(body)
    return PartRecord(
        name=body.name,
        role=body.role,
        step=body.step,
        made=body.made,
        material=None,
        volume_mm3=_round(solid.volume(), 12),
        bbox_mm=[_round(v, 12) for v in bounds(solid)],
        triangles=len(ready(moulds, body)[1]) if is_printed(body) else int(solid.num_tri()),
        files={},
    )


def _round(value: float, digits: int) -> float:
    """Round to significant digits, so that the order of a summation does not change the file."""
    return float(f"{value:.{digits}g}") + 0.0


def _pours(moulds: MouldSet) -> list[PourRecord]:
    return [
        PourRecord(
            index=step.index,
            layer=step.name,
            material="",
            tools=[piece.name for name in step.tools for piece in moulds.plan.pieces_of(name)],
            cavity_volume_mm3=_round(sum(c.reached.volume() for c in moulds.cavities if c.step is step), 9),
            layer_volume_mm3=_round(moulds.solids[step.name].volume(), 9),
        )
        for step in moulds.plan.steps
    ]


def _mesh_checks(moulds: MouldSet, parts: dict[str, PartRecord], store: Store, progress: Progress) -> list[MeshFinding]:
    """Return the findings of the mesh rules in every mesh file. Raises Unfinished."""
    progress("check")
    found: list[MeshFinding] = []
    listed = {
        file["path"]: (file["sha256"], part["role"])
        for part in parts.values()
        for form, file in part["files"].items()
        if form in MESH_FORMATS
    }
    for path, (sha256, role) in listed.items():
        # unitcad checks a tool's STL against the printer; its 3MF has the same meshes.
        printer = printer_of(moulds.spec) if role == "tool" and path.endswith(".stl") else None
        key = digest(f"{sha256} {printer!r} {code_version()}".encode())
        findings = store.data(key, partial(_mesh_check, store, path, sha256, printer))
        found += [MeshFinding(path=path, **finding) for finding in findings]
    return found


def _mesh_check(store: Store, path: str, sha256: str, printer: Printer | None) -> list[dict[str, Any]]:
    """Return the findings of the mesh rules in one file, but for information. Raises Unfinished."""
    report = check_bytes(store.content(sha256), Path(path).name, Options(printer=printer))
    if report.has("F011"):
        why = next(finding.message for finding in report.findings if finding.code == "F011")
        raise Unfinished(f"{path}: its check was not finished: {why}")
    return [finding.as_dict() for finding in report.findings if finding.severity != "info"]


def mould_findings(spec: Spec, shape: Geometry) -> list[FindingRecord]:
    """Return the geometry's mould findings, and its strains against this variant's silicones, by code."""
    if not shape["strains"]:
        return shape["mould_checks"]
    strained = strain_findings(spec, [Strain(**strain) for strain in shape["strains"]])
    return sorted([*shape["mould_checks"], *_dicts(strained)], key=lambda finding: finding["code"])


_ESTIMATES: dict[Hashable, tuple[dict[str, Any], bytes]] = {}
"""Estimates that this process made last, by their inputs: variants that differ only in casting share one."""
_MOST_ESTIMATES = 64


def forget() -> None:
    """Drop the results that this process caches, for a measurement of times."""
    forget_geometry()
    _ESTIMATES.clear()


def _estimate(spec: Spec, store: Store) -> tuple[dict[str, Any], bytes]:
    """Return the estimate and its file. The layered solver's part reads no silicone: the store shares it."""

    def layered(wanted: EstimateInput) -> dict[str, Any]:
        skin = wanted.tissue_name, wanted.tissue, wanted.frequency
        load = wanted.diameter, wanted.motor_diameter, wanted.drive
        key = digest(repr(((*skin, *load), code_version())).encode())
        return store.data(key, lambda: rounded_layered(wanted))

    reads = estimate_input(spec), spec.estimate
    if reads not in _ESTIMATES:
        while len(_ESTIMATES) >= _MOST_ESTIMATES:
            del _ESTIMATES[next(iter(_ESTIMATES))]
        data = estimate_spec(spec, layered=layered)
        _ESTIMATES[reads] = data, json_bytes(data)
    return _ESTIMATES[reads]
