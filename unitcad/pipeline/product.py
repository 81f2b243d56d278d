"""A variant made whole, in memory and a store: its files and the manifest that lists them and what was left out."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from unitcad import __version__, files
from unitcad.cache import Store, digest
from unitcad.designs import design_of, no_estimate
from unitcad.designs.design import Reason
from unitcad.errors import WrongArgument, unknown_name
from unitcad.json_text import json_bytes
from unitcad.mould_checks.finding import FindingRecord
from unitcad.moulds.groove_depths import shallow_grooves
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline import artifacts
from unitcad.pipeline import folder as folders
from unitcad.pipeline.artifacts import OUTPUTS
from unitcad.pipeline.geometry import Geometry, geometry, mesh_findings, pictures
from unitcad.pipeline.manifest_records import EstimateSummary, FileRecord, LeftOut, Manifest, PartRecord
from unitcad.pipeline.stages import Stages
from unitcad.pipeline.versions import kernel_versions
from unitcad.spec import Spec, spec_hash
from unitcad.validation import warnings

NO_MOULDS = "no moulds were asked for: only C200 ran, on the unit"
NO_KERNEL = "no B-rep kernel is installed for STEP: in a clone, pip install '.[step]'"


@dataclass(frozen=True)
class Product:
    """A variant's files by their paths: `own` as bytes, `shared` as the SHA-256 of content in a store."""

    manifest: Manifest
    own: dict[str, bytes]
    shared: dict[str, str]

    def place(self, folder: Path, store: Store) -> None:
        """Write it into an empty folder. Raises OSError, or MissingContent where the store has lost something."""
        inside = f"{folder}{os.sep}"  # names as text: a Path costs as much as the link
        for parent in sorted({os.path.dirname(path) for path in (*self.own, *self.shared)} - {""}):
            os.makedirs(inside + parent, exist_ok=True)
        for path, sha256 in self.shared.items():
            store.place(sha256, inside + path)
        for path, content in self.own.items():
            files.write_new(inside + path, content)


def make(spec: Spec, only: Sequence[str], check: bool, store: Store, stages: Stages) -> Product:
    """Return everything asked for of a spec, nothing written yet. Raises Refusal where the moulds can't be made."""
    moulds, possible = MouldSet(spec), possible_outputs(spec, only)
    estimate = _estimate_begun(moulds, possible, store, stages) if "estimate" in possible else None
    shape = geometry(moulds, possible, check, store, stages)
    drawn, no_pictures = _pictures(moulds, possible, store, stages)
    shared = {**shape["files"], **drawn}
    volumes = [step["layer_volume_mm3"] for step in shape["steps"]]
    if estimate:
        with stages("estimate"):
            artifacts.given(moulds, estimate)
    own: dict[str, bytes] = {}
    for artifact in artifacts.own(moulds, possible, volumes, printed_mm3(shape["parts"]), store):
        with stages(artifact.stage):
            own[artifact.path] = artifact.make()
    listed = {path: FileRecord(bytes=len(content), sha256=digest(content)) for path, content in own.items()}
    listed |= {path: FileRecord(bytes=store.size(sha256), sha256=sha256) for path, sha256 in shared.items()}
    manifest = Manifest(
        name=spec.name,
        design=spec.design,
        printer=spec.moulds.printer,
        hash=spec_hash(spec)[:12],
        outputs=list(possible),
        label=shape["label"],
        warnings=[*warnings(spec), *(shallow_grooves(moulds) if "moulds" in possible else [])],
        air_ring_mm=shape["air_ring_mm"],
        mesh={
            "kernel": "manifold3d",
            "tolerance_mm": spec.output.tolerance_mm,
            "segments": moulds.segments,
            "note": "volume_mm3 and bbox_mm are the mesh's: its corners may stand out by the tolerance",
        },
        parts=[{**part, "material": _material(spec, part)} for part in shape["parts"]],
        steps=[{**step, "material": spec.layers[step["index"] - 1].material} for step in shape["steps"]],
        laws=mould_findings(spec, shape),
        estimate=_estimate(moulds, store) if "estimate" in possible else None,
        check=mesh_findings(shape["check"]),
        pictures=list(drawn),
        casting=sorted(path for path in own if path in artifacts.CASTING) if "casting" in possible else None,
        left_out=[LeftOut(what=what, why=why) for what, why in [*no_pictures, *_left_out(spec, possible, check)]],
        versions={"unitcad": __version__, **kernel_versions(spec.output.formats)},
        files=dict(sorted(listed.items())),
    )
    return Product(manifest, {**own, "manifest.json": json_bytes(manifest)}, shared)


def _estimate_begun(
    moulds: MouldSet, only: Sequence[str], store: Store, stages: Stages
) -> Callable[[], dict[str, Any]] | None:
    """Ask for the estimate; where no process makes it, make it now: STEP is under way meanwhile, and is waited for."""
    if {"moulds", "casting"} & set(only):
        moulds.plan  # noqa: B018  # refuses before the long work begins
    here = partial(artifacts.estimated, moulds, store)
    if stages.beside and stages.beside.estimates:
        return stages.beside.estimate(moulds.spec, here)
    with stages("estimate"):
        here()
    return None


def checked_outputs(only: Sequence[str]) -> tuple[str, ...]:
    """Return `only` in the order of OUTPUTS. Raises Refusal for an unknown one, or none."""
    for name in only:
        if name not in OUTPUTS:
            raise unknown_name("only", name, OUTPUTS, WrongArgument)
    if not only:
        raise WrongArgument("only", "", f"needs at least one of {', '.join(OUTPUTS)}", OUTPUTS[0])
    return tuple(name for name in OUTPUTS if name in only)


def possible_outputs(spec: Spec, only: Sequence[str]) -> tuple[str, ...]:
    """Return what of `only` there can be: not every design has an estimate. Raises Refusal where nothing is left."""
    possible = tuple(name for name in only if name != "estimate" or design_of(spec).passes)
    if not possible:
        raise WrongArgument("only", ",".join(only), f"{spec.design} has no estimate: {no_estimate()}", "unit")
    return possible


def _pictures(
    moulds: MouldSet, only: Sequence[str], store: Store, stages: Stages
) -> tuple[dict[str, str], list[Reason]]:
    """Return the shaded pictures; where this machine can't draw, none and the reason: the section drawing stays."""
    if "png" not in moulds.spec.output.formats:
        return {}, []
    from unitcad.export.picture import NoPicture

    try:
        with stages("pictures"):
            return pictures(moulds, only, store), []
    except NoPicture as error:
        return {}, [("pictures", str(error))]


def printed_mm3(parts: Iterable[PartRecord]) -> float:
    """Return the volume of all printed tools."""
    return sum(part["volume_mm3"] for part in parts if part["role"] == "tool" and part["made"] == "printed")


def mould_findings(spec: Spec, shape: Geometry) -> list[FindingRecord]:
    """Return the geometry's mould findings, and its strains against this variant's silicones, by code."""
    if not shape["strains"]:
        return shape["laws"]
    from unitcad.mould_checks import Strain, strain_findings

    strained = strain_findings(spec, [Strain(**strain) for strain in shape["strains"]])
    return sorted([*shape["laws"], *(each.as_dict() for each in strained)], key=lambda finding: finding["code"])


def _estimate(moulds: MouldSet, store: Store) -> EstimateSummary:
    from unitcad.attenuation.edge.estimate_summary import summary

    return EstimateSummary(**summary(artifacts.estimated(moulds, store)))


def _material(spec: Spec, part: PartRecord) -> str | None:
    return spec.layers[part["step"] - 1].material if part["made"] == "cast" and part["step"] else None


def _left_out(spec: Spec, only: Sequence[str], check: bool) -> Iterator[Reason]:
    """Name what this variant does without, and why."""
    if not check or "moulds" not in only:
        yield "mould checks", NO_MOULDS if check else folders.UNCHECKED
    if not check:
        yield "mesh checks", folders.UNCHECKED
    design = design_of(spec)
    if design.tooling == "concentric":
        if len(spec.layers) == 1:
            yield "second pour", "one layer: one pour"
        if not spec.fpcb and not spec.wires:
            yield "tongue and slot", "no FPCB"
    yield from design.left_out(spec)
    for name in OUTPUTS:
        if name not in only:
            # The page offers the command for what was not asked for (report/app/estimate.js).
            yield name, no_estimate() if name == "estimate" and not design.passes else "not asked for (--only)"
    if "step" not in spec.output.formats:
        yield "boundary representation", "no STEP asked for" if _has_step_kernel() else NO_KERNEL


@cache
def _has_step_kernel() -> bool:
    return find_spec("OCP") is not None
