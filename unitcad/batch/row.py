"""The columns of one variant in a batch's table."""

from __future__ import annotations

from unitcad import catalogue
from unitcad.batch.batch_records import Values
from unitcad.pipeline.manifest_records import Manifest
from unitcad.spec import Spec


def row(spec: Spec, manifest: Manifest) -> Values:
    """Return volumes (mm3) and masses (g) of the cast layers, mould checks, mesh checks, and edge level by model."""
    densities = catalogue.materials(spec.materials)
    columns: Values = {"name": spec.name, "design": spec.design, "diameter_mm": spec.diameter_mm}
    total = 0.0
    for part in manifest["parts"]:
        if part["role"] == "unit" and part["material"] is not None:
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
