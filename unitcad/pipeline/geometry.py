"""What of a variant follows from its geometry alone: made once, whatever silicones it is cast in.

Everything here sees a spec whose materials, names and casting are blank (`geometric`), so that nothing can read
them unnoticed: what it makes serves every variant of that geometry. Each piece is kept in a store under a hash of
what it reads: a body's file by its tree, a verdict on a file by its bytes, the whole by the spec.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, TypedDict

from unitcad.cache import Store, digest
from unitcad.moulds.mould_set import MouldSet, geometric
from unitcad.pipeline import artifacts
from unitcad.pipeline.artifacts import GEOMETRIC, geometry_key
from unitcad.pipeline.bodies import body_key, groups, record
from unitcad.pipeline.stages import Stages
from unitcad.pipeline.versions import code_version, kernel_versions
from unitcad.spec import Spec, printer_of, to_json

MESH_FORMATS = ("stl", "3mf")
"""The formats whose files the mesh rules look at."""


class Geometry(TypedDict):
    """What a geometry is made of, as JSON data: `files` is path -> SHA-256 of content in the store."""

    label: str | None
    air_ring_mm: float
    parts: list[dict[str, Any]]
    steps: list[dict[str, Any]]
    laws: list[dict[str, Any]]
    strains: list[dict[str, Any]]
    check: list[dict[str, Any]]
    files: dict[str, str]


def build_key(spec: Spec, only: Sequence[str], check: bool) -> str:
    """Return what `geometry` depends on; cheap, since no shape is drawn."""
    return _build_key(geometric(spec), _geometric_outputs(only), check)


def geometry(spec: Spec, only: Sequence[str], check: bool, store: Store, stages: Stages) -> Geometry:
    """Return parts, steps, mould findings, mesh findings and files of a spec's geometry."""
    only, blank = _geometric_outputs(only), geometric(spec)
    return store.data(
        _build_key(blank, only, check),
        lambda: _made(MouldSet(blank), only, check, store, stages),
        intact=lambda found: all(map(store.has, found["files"].values())),
    )


def pictures(spec: Spec, only: Sequence[str], store: Store) -> dict[str, str]:
    """Return the shaded pictures of a spec's geometry: path -> SHA-256 of content in `store`.

    Raises NoPicture where this machine can't draw; that is not remembered, so another try may succeed.
    """
    table = artifacts.shared(MouldSet(geometric(spec)), _geometric_outputs(only), ("png",))
    return {a.path: store.file(a.key(), a.make) for a in table if a.form == "png"}


def _geometric_outputs(only: Sequence[str]) -> tuple[str, ...]:
    return tuple(name for name in only if name in GEOMETRIC)


def _made(moulds: MouldSet, only: Sequence[str], check: bool, store: Store, stages: Stages) -> Geometry:
    forms = [form for form in moulds.spec.output.formats if form != "png"]
    pours = {"moulds", "casting"} & set(only)
    with stages("plan"):
        bodies = [body for group in groups(moulds, only) for body in group.bodies]
        label = moulds.plan.label if pours else None
    with stages("meshes"):
        records = {
            body.name: {
                **store.data(body_key(moulds, body, "record"), lambda body=body: record(moulds, body)),
                "files": {},
            }
            for body in bodies
        }
    files: dict[str, str] = {}
    for artifact in artifacts.shared(moulds, only, forms):
        with stages(artifact.stage):
            files[artifact.path] = store.file(artifact.key(), artifact.make)
        for name in artifact.bodies:
            records[name]["files"][artifact.form] = {"path": artifact.path, "sha256": files[artifact.path]}
    with stages("laws"):
        laws, strained = _laws(moulds, only, store) if check else ([], [])
    with stages("check"):
        findings = _mesh_findings(moulds, records, files, store) if check else []
    return {
        "label": label,
        "air_ring_mm": round(moulds.dimensions.air_ring, 9),
        "parts": list(records.values()),
        "steps": _steps(moulds, store) if pours else [],
        "laws": laws,
        "strains": strained,
        "check": findings,
        "files": files,
    }


def _laws(moulds: MouldSet, only: Sequence[str], store: Store) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return what the mould checks find that read no silicone, and the strains that a silicone's limit applies to.

    Without moulds only the unit's bodies are looked at: none may overlap another.
    """
    from unitcad.mould_checks import check_geometry, check_unit, strains

    if "moulds" in only:
        laws = store.data(geometry_key(moulds, "laws"), lambda: [law.as_dict() for law in check_geometry(moulds)])
        return laws, store.data(geometry_key(moulds, "strains"), lambda: [asdict(s) for s in strains(moulds)])
    if "unit" in only:
        key = geometry_key(moulds, "overlaps in the unit")
        return store.data(key, lambda: [law.as_dict() for law in check_unit(moulds)]), []
    return [], []


def _mesh_findings(
    moulds: MouldSet, records: dict[str, dict[str, Any]], files: dict[str, str], store: Store
) -> list[dict[str, Any]]:
    """Return what the mesh rules find in every mesh file: tools against the printer."""
    roles = {e["path"]: r["role"] for r in records.values() for form, e in r["files"].items() if form in MESH_FORMATS}
    return [
        {"path": path, **finding}
        for path, role in roles.items()
        for finding in _findings_in(moulds, path, files[path], role, store)
    ]


def _findings_in(moulds: MouldSet, path: str, sha256: str, role: str, store: Store) -> list[dict[str, Any]]:
    from unitcad.check import Options, check_bytes

    # A tool's STL is judged against the printer; its 3MF holds the same meshes.
    printer = printer_of(moulds.spec) if role == "tool" and path.endswith(".stl") else None

    def looked() -> list[dict[str, Any]]:
        findings = check_bytes(store.content(sha256), Path(path).name, Options(printer=printer)).findings
        return [finding.as_dict() for finding in findings if finding.severity != "info"]

    return store.data(digest(f"{sha256} {printer!r} {code_version()}".encode()), looked)


def _steps(moulds: MouldSet, store: Store) -> list[dict[str, Any]]:
    """Return the pours: volume of the cavities as the tools leave them, and of one layer as the unit has it."""

    def measured() -> list[dict[str, Any]]:
        return [
            {
                "index": step.index,
                "layer": step.name,
                "tools": list(step.tools),
                "cavity_volume_mm3": float(f"{sum(c.reached.volume() for c in moulds.cavities if c.step is step):.9g}"),
                "layer_volume_mm3": float(f"{moulds.solids[step.name].volume():.9g}"),
            }
            for step in moulds.plan.steps
        ]

    return store.data(geometry_key(moulds, "steps"), measured)


def _build_key(blank: Spec, *more: object) -> str:
    epoch = os.environ.get("SOURCE_DATE_EPOCH") if "step" in blank.output.formats else None
    versions = sorted(kernel_versions(blank.output.formats).items())
    return digest(repr((to_json(blank), more, code_version(), versions, epoch)).encode())


def findings_count(findings: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return mesh findings with their number by severity."""
    count = Counter(finding["severity"] for finding in findings)
    return {"errors": count["error"], "warnings": count["warning"], "findings": list(findings)}
