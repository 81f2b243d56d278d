"""What of a variant follows from its geometry alone: made once, whatever silicones it is cast in.

Everything here sees a mould set whose materials, names and casting are blank (`MouldSet.blank`), so that nothing can
read them unnoticed: what it makes serves every variant of that geometry. Each piece is kept in a store under a hash of
what it reads: a body's file by its tree, the findings of a file by its bytes, the whole by the spec.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypedDict

from unitcad.cache import Store, digest
from unitcad.mould_checks.finding import FindingRecord
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline import artifacts
from unitcad.pipeline.artifacts import GEOMETRIC, PROCEDURE, Artifact, geometry_key
from unitcad.pipeline.bodies import body_key, groups, record
from unitcad.pipeline.manifest_records import BodyFile, MeshFinding, MeshFindings, PartRecord, PourRecord
from unitcad.pipeline.stages import Stages
from unitcad.pipeline.versions import code_version, kernel_versions
from unitcad.spec import Spec, printer_of

MESH_FORMATS = ("stl", "3mf")
"""The formats whose files the mesh rules look at."""


class Geometry(TypedDict):
    """A geometry's content as JSON data: `files` is path -> SHA-256 of content in the store.

    The strains are compared with a limit by each variant, since it is that of its silicones.
    """

    label: str | None
    air_ring_mm: float
    parts: list[PartRecord]
    steps: list[PourRecord]
    laws: list[FindingRecord]
    strains: list[dict[str, Any]]
    check: list[MeshFinding]
    files: dict[str, str]


def build_key(spec: Spec, only: Sequence[str], check: bool) -> str:
    """Return what `geometry` depends on; cheap, since no shape is drawn."""
    return _build_key(MouldSet(spec), _geometric_outputs(only), check)


def geometry(moulds: MouldSet, only: Sequence[str], check: bool, store: Store, stages: Stages) -> Geometry:
    """Return parts, steps, mould findings, mesh findings and files of a set's geometry."""
    only = _geometric_outputs(only)
    return store.data(
        _build_key(moulds, only, check),
        lambda: _made(moulds.blank, only, check, store, stages),
        intact=lambda there: all(map(store.has, there["files"].values())),
    )


def pictures(moulds: MouldSet, only: Sequence[str], store: Store) -> dict[str, str]:
    """Return the shaded pictures of a set's geometry: path -> SHA-256 of content in `store`.

    Raises NoPicture where this machine can't draw; that is not remembered, so another try may succeed.
    """
    table = artifacts.shared(moulds.blank, _geometric_outputs(only), ("png",))
    return {a.path: store.file(a.key(), a.make) for a in table if a.form == "png"}


def _geometric_outputs(only: Sequence[str]) -> tuple[str, ...]:
    return tuple(name for name in only if name in GEOMETRIC)


def _made(moulds: MouldSet, only: Sequence[str], check: bool, store: Store, stages: Stages) -> Geometry:
    forms = [form for form in moulds.spec.output.formats if form != "png"]
    pours = {"moulds", "casting"} & set(only)
    with stages("plan"):
        bodies = [body for group in groups(moulds, only) for body in group.bodies]
        label = moulds.plan.label if pours else None
        table = artifacts.shared(moulds, only, forms)
        if stages.beside:
            table = artifacts.begun(table, moulds, only, stages.beside)
    parts: dict[str, PartRecord] = {}
    with stages("meshes"):
        for body in bodies:
            part: PartRecord = store.data(body_key(moulds, body, "record"), lambda body=body: record(moulds, body))
            parts[body.name] = {**part, "files": {}}
    files: dict[str, str] = {}

    def put(table: Sequence[Artifact]) -> None:
        for artifact in table:
            with stages(artifact.stage):
                files[artifact.path] = store.file(artifact.key(), artifact.make)
            if stages.take:
                stages.take(artifact.path, store.content(files[artifact.path]))
            for name in artifact.bodies:
                parts[name]["files"][artifact.form] = BodyFile(path=artifact.path, sha256=files[artifact.path])

    later = [artifact for artifact in table if artifact.stage in (PROCEDURE, "step")]
    put([artifact for artifact in table if artifact not in later])
    with stages("mould checks"):
        findings, strains = _mould_findings(moulds, only, store) if check else ([], [])
    with stages("check"):
        mesh_findings = _mesh_findings(moulds, parts, store) if check else []
    put(later)
    return {
        "label": label,
        "air_ring_mm": round(moulds.dimensions.air_ring, 9),
        "parts": list(parts.values()),
        "steps": store.data(geometry_key(moulds, "steps"), lambda: _pours(moulds)) if pours else [],
        "laws": findings,
        "strains": strains,
        "check": mesh_findings,
        "files": files,
    }


def _mould_findings(
    moulds: MouldSet, only: Sequence[str], store: Store
) -> tuple[list[FindingRecord], list[dict[str, Any]]]:
    """Return what the mould checks find that read no silicone, and the strains that a silicone's limit applies to.

    Without moulds only the unit's bodies are looked at: none may overlap another.
    """
    from unitcad.mould_checks import check_geometry, check_unit, strains

    if "moulds" in only:
        findings = store.data(
            geometry_key(moulds, "mould checks"), lambda: [f.as_dict() for f in check_geometry(moulds)]
        )
        return findings, store.data(geometry_key(moulds, "strains"), lambda: [asdict(s) for s in strains(moulds)])
    if "unit" in only:
        key = geometry_key(moulds, "overlaps in the unit")
        return store.data(key, lambda: [f.as_dict() for f in check_unit(moulds)]), []
    return [], []


def _mesh_findings(moulds: MouldSet, parts: dict[str, PartRecord], store: Store) -> list[MeshFinding]:
    """Return what the mesh rules find in every mesh file."""
    files = {
        file["path"]: (file["sha256"], part["role"])
        for part in parts.values()
        for form, file in part["files"].items()
        if form in MESH_FORMATS
    }
    return [
        MeshFinding(path=path, **finding)
        for path, (sha256, role) in files.items()
        for finding in _findings_in(moulds, path, sha256, role, store)
    ]


def _findings_in(moulds: MouldSet, path: str, sha256: str, role: str, store: Store) -> list[dict[str, Any]]:
    from unitcad.check import Options, check_bytes

    # A tool's STL is checked against the printer; its 3MF holds the same meshes.
    printer = printer_of(moulds.spec) if role == "tool" and path.endswith(".stl") else None

    def findings() -> list[dict[str, Any]]:
        report = check_bytes(store.content(sha256), Path(path).name, Options(printer=printer))
        return [finding.as_dict() for finding in report.findings if finding.severity != "info"]

    return store.data(digest(f"{sha256} {printer!r} {code_version()}".encode()), findings)


def _pours(moulds: MouldSet) -> list[PourRecord]:
    return [
        PourRecord(
            index=step.index,
            layer=step.name,
            material="",
            tools=[piece.name for name in step.tools for piece in moulds.plan.pieces_of(name)],
            cavity_volume_mm3=_rounded(sum(c.reached.volume() for c in moulds.cavities if c.step is step)),
            layer_volume_mm3=_rounded(moulds.solids[step.name].volume()),
        )
        for step in moulds.plan.steps
    ]


def _rounded(volume: float) -> float:
    return float(f"{volume:.9g}")


def _build_key(moulds: MouldSet, *more: object) -> str:
    formats = moulds.spec.output.formats
    epoch = os.environ.get("SOURCE_DATE_EPOCH") if "step" in formats else None
    versions = sorted(kernel_versions(formats).items())
    return digest(repr((moulds.geometry, formats, more, code_version(), versions, epoch)).encode())


def mesh_findings(findings: list[MeshFinding]) -> MeshFindings:
    """Return the findings of mesh rules with their number by severity."""
    count = Counter(finding["severity"] for finding in findings)
    return {"errors": count["error"], "warnings": count["warning"], "findings": findings}
