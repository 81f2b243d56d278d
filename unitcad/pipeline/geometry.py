"""The geometry of a result in a store: meshes, their files, mould checks and mesh checks.

Files that depend only on the geometry see a mould set whose materials, names and casting are blank (`MouldSet.blank`),
so that nothing can read them unnoticed: it serves every variant of that geometry.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from unitcad.cache import Store, digest
from unitcad.catalogue import Printer
from unitcad.checks import Strain, check_geometry, check_unit, strain_findings, strains
from unitcad.checks.finding import FindingRecord
from unitcad.errors import Unfinished
from unitcad.kernels.mesh import bounds
from unitcad.meshcheck import Options, check_bytes
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.manifest import BodyFile, Geometry, MeshFinding, PartRecord, PourRecord
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
from unitcad.pipeline.result import Progress, Result
from unitcad.shape.tree import Body
from unitcad.spec import Spec, printer_of

MESH_FORMATS = ("stl", "3mf")
"""The formats whose files the mesh rules look at."""


def geometric_result(moulds: MouldSet, only: Sequence[str], check: bool, store: Store, progress: Progress) -> Result:
    """Return parts, pours, findings and files of a set's geometry, with the silicones of its spec."""
    shape = geometry(moulds, only, check, store, progress)
    layers = moulds.spec.layers
    parts: list[PartRecord] = [
        {**part, "material": layers[(part["step"] or 0) - 1].material if part["made"] == "cast" else None}
        for part in shape["parts"]
    ]
    return Result(
        parts=parts,
        steps=[{**step, "material": layers[step["index"] - 1].material} for step in shape["steps"]],
        findings=_with_strains(moulds.spec, shape),
        meshes=shape["check"],
        shared=dict(shape["files"]),
        skipped=list(shape["skipped"]),
        label=shape["label"],
        air_ring_mm=shape["air_ring_mm"],
    )


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
        sha256 = filed(store, planned) if meshes else optional.made(planned.path, partial(filed, store, planned))
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


def filed(store: Store, planned: Planned) -> str:
    """Return the SHA-256 of a planned file, made if the store lacks it."""
    return store.file(planned.key(), planned.make)


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


def _with_strains(spec: Spec, shape: Geometry) -> list[FindingRecord]:
    """Return the geometry's mould findings, and its strains against this variant's silicones, by code."""
    if not shape["strains"]:
        return list(shape["mould_checks"])
    strained = strain_findings(spec, [Strain(**strain) for strain in shape["strains"]])
    return sorted([*shape["mould_checks"], *_dicts(strained)], key=lambda finding: finding["code"])
