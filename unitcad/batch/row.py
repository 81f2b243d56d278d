"""The columns of one variant in a batch's table."""

from __future__ import annotations

from typing import Any

from unitcad import catalogue
from unitcad.batch.batch_records import Values
from unitcad.spec import Spec


def row(spec: Spec, manifest: dict[str, Any]) -> Values:
    """Return volumes (mm3) and masses (g) of the cast layers, mould checks, mesh checks, and edge level by model."""
    densities = catalogue.materials(spec.materials)
    columns: Values = {"name": spec.name, "design": spec.design, "diameter_mm": spec.diameter_mm}
    total = 0.0
    for part in manifest["parts"]:
        if part["role"] != "unit" or part["made"] != "cast" or part["step"] is None:
            continue
        # g/cm3 times mm3 is mg.
        mass = part["volume_mm3"] * float(densities[part["material"]].density_g_cm3) / 1000
        columns[f"layer{part['step']}_volume_mm3"] = float(f"{part['volume_mm3']:.9g}")
        columns[f"layer{part['step']}_mass_g"] = float(f"{mass:.6g}")
        total += mass
    if total:
        columns["silicone_mass_g"] = float(f"{total:.6g}")
    laws, check = manifest["laws"], manifest["check"]
    columns["laws_held"], columns["laws"] = sum(law["ok"] for law in laws), len(laws)
    columns["laws_broken"] = " ".join(sorted({law["code"] for law in laws if not law["ok"]}))
    columns["check_errors"], columns["check_warnings"] = check["errors"], check["warnings"]
    for model, level in edge_levels(manifest.get("estimate")).items():
        columns[f"edge_{model}"] = level
    return columns


def edge_levels(estimate: dict[str, Any] | None) -> dict[str, float | None]:
    """Return the edge level by model, of a manifest's estimate summary."""
    models = (estimate or {}).get("models") or {}
    return {model: entry.get("edge") if isinstance(entry, dict) else entry for model, entry in models.items()}
