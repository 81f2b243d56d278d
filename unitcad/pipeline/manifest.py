"""manifest.json: its tables, and the columns that a table of variants takes from it. `make.py` makes it.

A later version may add keys; those that are here keep their names.
"""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any, NotRequired, TypedDict

from unitcad import catalogue
from unitcad.checks.finding import FindingRecord
from unitcad.spec import Spec

CASTING = ("bom.csv", "casting.json", "casting.md", "troubleshooting.md")
DRAWING = "drawing.pdf"
PAGE = "report.html"
"""The page of a folder, made on request and kept up by every later build into it."""
BENCH = "bench.html"
"""The bench page of a variant's procedure, next to the page."""
UNCHECKED = "--no-check"
NO_KERNEL = "no B-rep kernel is installed for STEP"


class BodyFile(TypedDict):
    """A file that contains a body; `copies`: how often, if more than once."""

    path: str
    sha256: str
    copies: NotRequired[int]


class PartRecord(TypedDict):
    """A body of unit or tooling; `files` by format, `bbox_mm` the mesh's (x0, y0, z0, x1, y1, z1).

    `solids`: their number, if more than one. `state`: how its file has a body that another file has stretched.
    """

    name: str
    role: str
    step: int | None
    made: str
    material: str | None
    volume_mm3: float
    bbox_mm: list[float]
    triangles: int
    files: dict[str, BodyFile]
    solids: NotRequired[int]
    state: NotRequired[str]


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


class EstimateSummary(TypedDict):
    """The level at the edge with its 80 % range, the measurement of this unit, None if there is none, and the line."""

    level: float | None
    low: float | None
    high: float | None
    measured: float | None
    line: str
    frequency_hz: float | None


class Skipped(TypedDict):
    """An output that a variant lacks, and why."""

    output: str
    reason: str


class FileRecord(TypedDict):
    """A file of the folder."""

    bytes: int
    sha256: str


class Manifest(TypedDict):
    """A result's manifest; `mould_checks` are the findings of the mould checks. A room's may have further keys."""

    name: str
    design: str
    printer: str
    hash: str
    outputs: list[str]
    label: str | None
    warnings: list[str]
    air_ring_mm: float
    compensation: NotRequired[dict[str, float]]
    mesh: dict[str, Any]
    parts: list[PartRecord]
    steps: list[PourRecord]
    mould_checks: list[FindingRecord]
    estimate: EstimateSummary | None
    check: MeshFindings
    pictures: list[str]
    casting: list[str] | None
    skipped: list[Skipped]
    versions: dict[str, str]
    files: dict[str, FileRecord]


def failed_codes(manifest: Manifest) -> list[str]:
    """Return the codes of the mould checks and mesh rules that a variant fails, each once, the mould checks first."""
    moulds = {finding["code"] for finding in manifest["mould_checks"] if not finding["ok"]}
    meshes = {finding["code"] for finding in manifest["check"]["findings"] if finding["severity"] == "error"}
    return [*sorted(moulds), *sorted(meshes)]


class Geometry(TypedDict):
    """A geometry's content as JSON data: `files` is path -> SHA-256 of content in the store, `skipped` has no file.

    The strains are compared with a limit by each variant, since it is that of its silicones.
    """

    label: str | None
    air_ring_mm: float
    parts: list[PartRecord]
    steps: list[PourRecord]
    mould_checks: list[FindingRecord]
    strains: list[dict[str, Any]]
    check: list[MeshFinding]
    files: dict[str, str]
    skipped: list[Skipped]


def printed_mm3(parts: Iterable[PartRecord]) -> float:
    """Return the volume of all printed tools."""
    return sum(part["volume_mm3"] for part in parts if part["role"] == "tool" and part["made"] == "printed")


def count_findings(findings: list[MeshFinding]) -> MeshFindings:
    """Return the findings of mesh rules with their number by severity."""
    count = Counter(finding["severity"] for finding in findings)
    return {"errors": count["error"], "warnings": count["warning"], "findings": findings}


def row(unit: Spec, manifest: Manifest) -> dict[str, Any]:
    """Return volumes (mm3) and masses (g) of the cast layers, mould checks, mesh checks, and the level at the edge.

    The manifest is that of the unit, or of an array of it.
    """
    densities = catalogue.materials(unit.materials)
    columns: dict[str, Any] = {"name": manifest["name"], "design": unit.design, "diameter_mm": unit.diameter_mm}
    array: dict[str, Any] = manifest.get("array", {})
    if array:
        columns |= {"array": array["construction"], "units": len(array["places"]), "pitch_mm": array["pitch_mm"]}
    total = 0.0
    for part in manifest["parts"]:
        # An array's own silicone; its units' parts are named after their folders.
        own = not array or ":" not in part["name"]
        if own and part["role"] == "unit" and part["material"] is not None:
            # g/cm3 times mm3 is mg.
            mass = part["volume_mm3"] * float(densities[part["material"]].density_g_cm3) / 1000
            columns[f"{part['name']}_volume_mm3"] = float(f"{part['volume_mm3']:.9g}")
            columns[f"{part['name']}_mass_g"] = float(f"{mass:.6g}")
            total += mass
    if total:
        columns["silicone_mass_g"] = float(f"{total:.6g}")
    findings, check = manifest["mould_checks"], manifest["check"]
    columns["mould_checks_passed"], columns["mould_checks"] = sum(finding["ok"] for finding in findings), len(findings)
    columns["mould_checks_failed"] = " ".join(sorted({finding["code"] for finding in findings if not finding["ok"]}))
    columns["check_errors"], columns["check_warnings"] = check["errors"], check["warnings"]
    return columns | level_columns(manifest["estimate"])


LEVEL_COLUMNS = ("level", "low", "high", "measured")


def level_columns(level: Mapping[str, Any] | None) -> dict[str, float | None]:
    """Return the columns of the level at the edge: its value, its 80 % range, the measurement of this unit."""
    return {} if level is None else {f"edge_{key}": level[key] for key in LEVEL_COLUMNS}
