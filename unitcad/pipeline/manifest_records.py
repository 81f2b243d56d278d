"""The data of manifest.json, as typed tables. A later version may add keys; those that are here keep their names."""

from __future__ import annotations

from typing import Any, TypedDict

from unitcad.mould_checks.finding import FindingRecord


class BodyFile(TypedDict):
    """A file that holds a body."""

    path: str
    sha256: str


class PartRecord(TypedDict):
    """A body of unit or tooling; `files` by format, `bbox_mm` the mesh's (x0, y0, z0, x1, y1, z1)."""

    name: str
    role: str
    step: int | None
    made: str
    material: str | None
    volume_mm3: float
    bbox_mm: list[float]
    triangles: int
    files: dict[str, BodyFile]


class PourRecord(TypedDict):
    """A pour: the volume of all its cavities as the tools leave them, and of one layer as the unit has it."""

    index: int
    layer: str
    material: str
    tools: list[str]
    cavity_volume_mm3: float
    layer_volume_mm3: float


class MeshFinding(TypedDict):
    """A finding of a mesh rule in the file `path`; it has the other keys of a finding of `unitcad check` too."""

    path: str
    code: str
    severity: str
    message: str


class MeshFindings(TypedDict):
    """The findings of the mesh rules, but for information."""

    errors: int
    warnings: int
    findings: list[MeshFinding]


class ModelLevel(TypedDict):
    """A model's level at the edge, None where it gives no number, and its mean error against the measured levels."""

    edge: float | None
    table_error: float | None


class EstimateSummary(TypedDict):
    """The estimate in short; `measured` is the paper's level of this unit, None where there is none.

    `answer` leads the estimate; `model` has the least error of those that give a level.
    """

    models: dict[str, ModelLevel]
    model: str | None
    answer: str
    measured: float | None
    frequency_hz: float | None


class LeftOut(TypedDict):
    """Something that a variant does without."""

    what: str
    why: str


class FileRecord(TypedDict):
    """A file of the folder."""

    bytes: int
    sha256: str


class Manifest(TypedDict):
    """A variant's manifest; `laws` are the findings of the mould checks."""

    name: str
    design: str
    printer: str
    hash: str
    outputs: list[str]
    label: str | None
    warnings: list[str]
    air_ring_mm: float
    mesh: dict[str, Any]
    parts: list[PartRecord]
    steps: list[PourRecord]
    laws: list[FindingRecord]
    estimate: EstimateSummary | None
    check: MeshFindings
    pictures: list[str]
    casting: list[str] | None
    left_out: list[LeftOut]
    versions: dict[str, str]
    files: dict[str, FileRecord]


class ArrayManifest(Manifest):
    """An array's manifest: `laws`, `check` and `parts` are those of its tools and sheet and of its units.

    `array` has construction, layout, sheet, and the places with the folder of their unit's own result.
    """

    array: dict[str, Any]


def failed_codes(manifest: Manifest) -> list[str]:
    """Return the codes of the mould checks and mesh rules that a variant fails, each once, the mould checks first."""
    moulds = {finding["code"] for finding in manifest["laws"] if not finding["ok"]}
    meshes = {finding["code"] for finding in manifest["check"]["findings"] if finding["severity"] == "error"}
    return [*sorted(moulds), *sorted(meshes)]
