"""manifest.json: its tables, how a unit's is made, and the columns that a table of variants takes from it.

A later version may add keys; those that are here keep their names.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from functools import cache
from importlib.util import find_spec
from typing import Any, NotRequired, TypedDict

from unitcad import __version__, catalogue
from unitcad.attenuation.edge.estimates import summary
from unitcad.checks.finding import FindingRecord
from unitcad.designs import design_of, no_estimate
from unitcad.designs.design import Reason
from unitcad.moulds.heights import height_warnings
from unitcad.moulds.mould_set import MouldSet, shallow_grooves
from unitcad.pipeline.plan import kernel_versions
from unitcad.spec import Spec, spec_hash
from unitcad.spec.raw import OUTPUTS
from unitcad.validation import warnings

CASTING = ("bom.csv", "casting.json", "casting.md", "troubleshooting.md")
UNCHECKED = "--no-check"
NO_MOULDS = "no moulds were asked for: only C200 ran, on the unit"
NO_KERNEL = "no B-rep kernel is installed for STEP"


class BodyFile(TypedDict):
    """A file that contains a body; `copies`: how often, if more than once."""

    path: str
    sha256: str
    copies: NotRequired[int]


class PartRecord(TypedDict):
    """A body of unit or tooling; `files` by format, `bbox_mm` the mesh's (x0, y0, z0, x1, y1, z1).

    `solids`: their number, if more than one.
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
    """A model's level at the edge, None if it gives no number, and its mean error against the measured levels."""

    edge: float | None
    table_error: float | None


class EstimateSummary(TypedDict):
    """The summary of the estimate; `measured` is the paper's level of this unit, None if there is none.

    `lines` are the two that lead the estimate; `model` is the one behind the first.
    """

    models: dict[str, ModelLevel]
    model: str | None
    lines: list[str]
    measured: float | None
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
    """A variant's manifest; `mould_checks` are the findings of the mould checks."""

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


def _of_tools(moulds: MouldSet) -> list[str]:
    """Return the warnings about the tools, known before anything is meshed."""
    return [*shallow_grooves(moulds), *height_warnings(moulds)]


def of_unit(
    moulds: MouldSet,
    only: Sequence[str],
    check: bool,
    shape: Geometry,
    findings: list[FindingRecord],
    estimate: dict[str, Any] | None,
    pictures: list[str],
) -> Manifest:
    """Return a unit's manifest but for its files."""
    spec = moulds.spec
    return Manifest(
        name=spec.name,
        design=spec.design,
        printer=spec.moulds.printer,
        hash=spec_hash(spec)[:12],
        outputs=list(only),
        label=shape["label"],
        warnings=[*warnings(spec), *(_of_tools(moulds) if "moulds" in only else [])],
        air_ring_mm=shape["air_ring_mm"],
        compensation={
            "shrinkage_percent": spec.moulds.shrinkage_percent,
            "bore_compensation_mm": spec.moulds.bore_compensation_mm,
        },
        mesh={
            "kernel": "manifold3d",
            "tolerance_mm": spec.output.tolerance_mm,
            "segments": moulds.segments,
            "note": "volume_mm3 and bbox_mm are the mesh's: its corners may exceed the surface by the tolerance",
        },
        parts=[
            {
                **part,
                "material": spec.layers[(part["step"] or 0) - 1].material if part["made"] == "cast" else None,
            }
            for part in shape["parts"]
        ],
        steps=[{**step, "material": spec.layers[step["index"] - 1].material} for step in shape["steps"]],
        mould_checks=findings,
        estimate=EstimateSummary(**summary(estimate)) if estimate else None,
        check=count_findings(shape["check"]),
        pictures=pictures,
        casting=sorted(CASTING) if "casting" in only else None,
        skipped=[Skipped(output=output, reason=reason) for output, reason in _skipped(spec, only, check)],
        versions={"unitcad": __version__, **kernel_versions(spec.output.formats)},
        files={},
    )


def _skipped(spec: Spec, only: Sequence[str], check: bool) -> Iterator[Reason]:
    """Name the outputs that this variant lacks, and why."""
    if not check or "moulds" not in only:
        yield "mould checks", NO_MOULDS if check else UNCHECKED
    if not check:
        yield "mesh checks", UNCHECKED
    design = design_of(spec)
    if design.tooling == "concentric":
        if len(spec.layers) == 1:
            yield "second pour", "one layer: one pour"
        if not spec.fpcb and not spec.wires:
            yield "tongue and slot", "no FPCB"
    yield from design.skipped(spec)
    for name in OUTPUTS:
        if name not in only:
            # The page offers the command for outputs that were not asked for (report/app/estimate.js).
            yield name, no_estimate() if name == "estimate" and not design.passes else "not asked for (--only)"
    if "step" not in spec.output.formats:
        yield "boundary representation", "no STEP asked for" if _has_step_kernel() else NO_KERNEL


@cache
def _has_step_kernel() -> bool:
    return find_spec("OCP") is not None


def printed_mm3(parts: Iterable[PartRecord]) -> float:
    """Return the volume of all printed tools."""
    return sum(part["volume_mm3"] for part in parts if part["role"] == "tool" and part["made"] == "printed")


def count_findings(findings: list[MeshFinding]) -> MeshFindings:
    """Return the findings of mesh rules with their number by severity."""
    count = Counter(finding["severity"] for finding in findings)
    return {"errors": count["error"], "warnings": count["warning"], "findings": findings}


def row(unit: Spec, manifest: Manifest) -> dict[str, Any]:
    """Return volumes (mm3) and masses (g) of the cast layers, mould checks, mesh checks, and edge level by model.

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
    for model, level in (manifest["estimate"] or {"models": {}})["models"].items():
        columns[f"edge_{model}"] = level["edge"]
    return columns
