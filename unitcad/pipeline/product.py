"""A variant made whole, in memory and a store: its files and the manifest that lists them and what was left out."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from unitcad import __version__, files
from unitcad.cache import Store, digest
from unitcad.designs import design_named, no_estimate
from unitcad.designs.design import Reason
from unitcad.errors import Refusal, unknown_name
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline import artifacts
from unitcad.pipeline import folder as folders
from unitcad.pipeline.artifacts import OUTPUTS
from unitcad.pipeline.geometry import Geometry, findings_count, geometry, pictures
from unitcad.pipeline.json_text import json_bytes
from unitcad.pipeline.stages import Stages
from unitcad.pipeline.versions import kernel_versions
from unitcad.spec import Spec
from unitcad.validation import warnings

NO_MOULDS = "no moulds were asked for: only C200 ran, on the unit"


@dataclass(frozen=True)
class Product:
    """A variant's files by their paths: `own` as bytes, `shared` as the SHA-256 of content in a store."""

    manifest: dict[str, Any]
    own: dict[str, bytes]
    shared: dict[str, str]

    def place(self, folder: Path, store: Store) -> None:
        """Write it into an empty folder. Raises OSError, or MissingContent where the store has lost something."""
        for parent in sorted({os.path.dirname(path) for path in (*self.own, *self.shared)}):
            (folder / parent).mkdir(parents=True, exist_ok=True)
        for path, sha256 in self.shared.items():
            store.place(sha256, folder / path)
        for path, content in self.own.items():
            files.write_new(folder / path, content)


def make(spec: Spec, only: Sequence[str], check: bool, store: Store, stages: Stages) -> Product:
    """Return everything asked for of a spec, nothing written yet. Raises Refusal where the moulds can't be."""
    moulds, possible = MouldSet(spec), possible_outputs(spec, only)
    shape = geometry(spec, possible, check, store, stages)
    drawn, no_pictures = _pictures(spec, possible, store, stages)
    shared = {**shape["files"], **drawn}
    volumes = [step["layer_volume_mm3"] for step in shape["steps"]]
    own: dict[str, bytes] = {}
    for artifact in artifacts.own(moulds, possible, volumes, store):
        with stages(artifact.stage):
            own[artifact.path] = artifact.make()
    manifest: dict[str, Any] = {
        "name": spec.name,
        "design": spec.design,
        "printer": spec.moulds.printer,
        "hash": folders.folder_name(spec)[-12:],
        "outputs": list(possible),
        "label": shape["label"],
        "warnings": warnings(spec),
        "air_ring_mm": shape["air_ring_mm"],
        "mesh": {
            "kernel": "manifold3d",
            "tolerance_mm": spec.output.tolerance_mm,
            "segments": moulds.segments,
            "note": "volume_mm3 and bbox_mm are the mesh's: its corners may stand out by the tolerance",
        },
        "parts": [_part(spec, part) for part in shape["parts"]],
        "steps": [_step(spec, step) for step in shape["steps"]],
        "laws": _laws(spec, shape),
        "estimate": _estimate(moulds, possible, store),
        "check": findings_count(shape["check"]),
        "pictures": list(drawn),
        "casting": sorted(path for path in own if path in artifacts.CASTING) if "casting" in possible else None,
        "left_out": [
            {"what": what, "why": why} for what, why in [*no_pictures, *_left_out(spec, only, possible, check)]
        ],
        "versions": {"unitcad": __version__, **kernel_versions(spec.output.formats)},
    }
    listed = {path: {"bytes": len(content), "sha256": digest(content)} for path, content in own.items()}
    listed |= {path: {"bytes": store.size(sha256), "sha256": sha256} for path, sha256 in shared.items()}
    manifest["files"] = dict(sorted(listed.items()))
    return Product(manifest, {**own, "manifest.json": json_bytes(manifest)}, shared)


def checked_outputs(only: Sequence[str]) -> tuple[str, ...]:
    """Return `only` in the order of OUTPUTS. Raises Refusal for an unknown one, or none."""
    for name in only:
        if name not in OUTPUTS:
            raise unknown_name("--only", name, OUTPUTS)
    if not only:
        raise Refusal("--only", "", f"needs at least one of {', '.join(OUTPUTS)}", OUTPUTS[0])
    return tuple(name for name in OUTPUTS if name in only)


def possible_outputs(spec: Spec, only: Sequence[str]) -> tuple[str, ...]:
    """Return what of `only` there can be: not every design has an estimate. Raises Refusal where nothing is left."""
    possible = tuple(name for name in only if name != "estimate" or design_named(spec.design).passes)
    if not possible:
        raise Refusal("--only", ",".join(only), f"{spec.design} has no estimate: {no_estimate()}", "unit")
    return possible


def _pictures(spec: Spec, only: Sequence[str], store: Store, stages: Stages) -> tuple[dict[str, str], list[Reason]]:
    """Return the shaded pictures; where this machine can't draw, none and the reason: the section drawing stays."""
    if "png" not in spec.output.formats:
        return {}, []
    from unitcad.export.picture import NoPicture

    try:
        with stages("pictures"):
            return pictures(spec, only, store), []
    except NoPicture as error:
        return {}, [("pictures", str(error))]


def _laws(spec: Spec, shape: Geometry) -> list[dict[str, Any]]:
    """Return the geometry's mould findings, and its strains against this variant's silicones, by code."""
    if not shape["strains"]:
        return shape["laws"]
    from unitcad.mould_checks import Strain, strain_findings

    strained = strain_findings(spec, [Strain(**strain) for strain in shape["strains"]])
    return sorted(shape["laws"] + [finding.as_dict() for finding in strained], key=lambda law: law["code"])


def _estimate(moulds: MouldSet, only: Sequence[str], store: Store) -> dict[str, Any] | None:
    if "estimate" not in only:
        return None
    from unitcad.attenuation.edge.estimates import summary

    return summary(artifacts.estimated(moulds, store))


def _part(spec: Spec, part: dict[str, Any]) -> dict[str, Any]:
    """Return a part of the geometry with this variant's material, after what it is made by."""
    step = part["step"] if part["made"] == "cast" else None
    entry: dict[str, Any] = {}
    for key, value in part.items():
        entry[key] = value
        if key == "made":
            entry["material"] = spec.layers[step - 1].material if step else None
    return entry


def _step(spec: Spec, step: dict[str, Any]) -> dict[str, Any]:
    material = spec.layers[step["index"] - 1].material
    return {"index": step["index"], "layer": step["layer"], "material": material, **step}


def _left_out(spec: Spec, asked: Sequence[str], only: Sequence[str], check: bool) -> list[Reason]:
    """Name what this variant does without, and why."""
    reasons: list[Reason] = []
    if not check or "moulds" not in only:
        reasons.append(("mould checks", NO_MOULDS if check else folders.UNCHECKED))
    if not check:
        reasons.append(("mesh checks", folders.UNCHECKED))
    reasons += _tooling_left_out(spec)
    reasons += [
        (name, no_estimate() if name in asked else "not asked for (--only)") for name in OUTPUTS if name not in only
    ]
    if "step" not in spec.output.formats:
        reasons.append(("boundary representation", "no STEP asked for"))
    return reasons


def _tooling_left_out(spec: Spec) -> list[Reason]:
    design = design_named(spec.design)
    if not design.tooling:
        return []
    reasons: list[Reason] = [("second pour", "one layer: one pour")] if len(spec.layers) == 1 else []
    if not spec.fpcb and not spec.wires:
        reasons.append(("tongue and slot", "no FPCB"))
    return reasons + design.left_out(spec)
