"""The columns of one variant in a table of variants."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from unitcad import catalogue
from unitcad.pipeline.manifest_records import Manifest
from unitcad.spec import Spec

# What belongs to arrays alone takes long to import, and a unit's table does without.
if TYPE_CHECKING:
    from unitcad.pipeline.subjects import Made


def row(of: Made, manifest: Manifest) -> dict[str, Any]:
    """Return volumes (mm3) and masses (g) of the cast layers, mould checks, mesh checks, and edge level by model."""
    spec, array = (of, None) if isinstance(of, Spec) else (of.unit, of)
    densities = catalogue.materials(spec.materials)
    columns: dict[str, Any] = {"name": of.name, "design": spec.design, "diameter_mm": spec.diameter_mm}
    if array:
        columns |= {"array": array.construction, "units": len(array.places), "pitch_mm": round(array.pitch_mm, 3)}
    total = 0.0
    for part in manifest["parts"]:
        # An array's own silicone; its units' parts are named after their folders.
        own = not array or ":" not in part["name"]
        if own and part["role"] == "unit" and part["material"] is not None:
            # g/cm3 times mm3 is mg.
            mass = part["volume_mm3"] * float(densities[part["material"]].density_g_cm3) / 1000
            columns[f"layer{part['step']}_volume_mm3"] = float(f"{part['volume_mm3']:.9g}")
            columns[f"layer{part['step']}_mass_g"] = float(f"{mass:.6g}")
            total += mass
    if total:
        columns["silicone_mass_g"] = float(f"{total:.6g}")
    findings, check = manifest["laws"], manifest["check"]
    columns["laws_held"], columns["laws"] = sum(finding["ok"] for finding in findings), len(findings)
    columns["laws_broken"] = " ".join(sorted({finding["code"] for finding in findings if not finding["ok"]}))
    columns["check_errors"], columns["check_warnings"] = check["errors"], check["warnings"]
    for model, level in (manifest["estimate"] or {"models": {}})["models"].items():
        columns[f"edge_{model}"] = level["edge"]
    return columns
