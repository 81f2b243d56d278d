"""A unit's result: its files, findings, estimate and casting procedure."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import ClassVar

from unitcad.cache import Store
from unitcad.casting.figures import check_castable
from unitcad.casting.procedure import procedure
from unitcad.designs import design_of
from unitcad.designs.design import Reason
from unitcad.moulds.heights import height_warnings
from unitcad.moulds.mould_set import MouldSet, shallow_grooves
from unitcad.pipeline import workshop
from unitcad.pipeline.geometry import filed, geometric_result
from unitcad.pipeline.manifest import DRAWING, NO_KERNEL, UNCHECKED, Manifest, Skipped
from unitcad.pipeline.optional import OptionalFiles
from unitcad.pipeline.plan import build_key, plan
from unitcad.pipeline.result import Progress, Result
from unitcad.pipeline.subject import Subject
from unitcad.pipeline.summary import unit_summary
from unitcad.spec import Spec, spec_hash, to_json, to_toml, with_formats
from unitcad.spec.raw import OUTPUTS, Format
from unitcad.validation import warnings


class Unit(Subject):
    """A spec, as a result is made of it."""

    kind: ClassVar[str] = "spec"
    file: ClassVar[str] = "spec.toml"

    def __init__(self, spec: Spec, given: frozenset[str] = frozenset()) -> None:
        self.unit, self.name, self.hash, self.given = spec, spec.name, spec_hash(spec), given
        self.formats = spec.output.formats

    @property
    def moulds(self) -> MouldSet:
        return MouldSet(self.unit, self.given)

    @property
    def text(self) -> str:
        return to_json(self.unit)

    def toml(self) -> str:
        return to_toml(self.unit)

    def key(self, only: Sequence[str], check: bool) -> str:
        return build_key(self.moulds, only, check)

    def outputs(self, only: Sequence[str]) -> tuple[str, ...]:
        return tuple(only)

    def with_formats(self, formats: Sequence[Format]) -> Unit:
        return Unit(with_formats(self.unit, tuple(formats)), self.given)

    def summary(self, folder: Path, manifest: Manifest) -> Iterator[str]:
        return unit_summary(self.moulds, folder, manifest)

    def make(self, only: Sequence[str], check: bool, store: Store, progress: Progress) -> Result:
        spec, moulds, made = self.unit, self.moulds, Result()
        if {"moulds", "casting"} & set(only):
            check_castable(moulds)  # refuses before the long work begins
        optional = OptionalFiles(made.skipped)
        if "pdf" in self.formats and {"unit", "moulds"} & set(only):  # its names are the spec's own
            progress("drawing")
            if drawn := optional.made(DRAWING, lambda: workshop.content([*workshop.sheets(moulds, only, self.hash)])):
                made.own[DRAWING] = drawn
        if "estimate" in only:  # first: the helper for STEP loads its kernel in the meantime
            from unitcad.pipeline.unit_estimate import estimated  # loads scipy

            progress("estimate")
            made.estimate, made.own["estimate.json"] = estimated(spec, store)
        shape = geometric_result(moulds, only, check, store, progress)
        made.add(shape)
        made.label, made.air_ring_mm = shape.label, shape.air_ring_mm
        pictures = _shaded_pictures(moulds, only, store, progress, optional)
        made.shared |= pictures
        made.pictures = list(pictures)
        if "casting" in only:
            progress("casting")
            made.cast(procedure(moulds, made.volumes_mm3, made.printed_mm3))
        made.warnings = list(warnings(spec))
        if "moulds" in only:
            made.warnings += [*shallow_grooves(moulds), *height_warnings(moulds)]
        lacking = [Skipped(output=output, reason=reason) for output, reason in _skipped(spec, only, check)]
        made.skipped = [*lacking, *made.skipped]
        made.compensation = {
            "shrinkage_percent": spec.moulds.shrinkage_percent,
            "bore_compensation_mm": spec.moulds.bore_compensation_mm,
        }
        return made


def _shaded_pictures(
    moulds: MouldSet, only: Sequence[str], store: Store, progress: Progress, optional: OptionalFiles
) -> dict[str, str]:
    """Return the pictures that the format png asks for, path to SHA-256."""
    if "png" not in moulds.spec.output.formats:
        return {}
    progress("pictures")
    scenes = [planned for planned in plan(moulds.blank, only, ("png",)) if planned.form == "png"]
    made = {planned.path: optional.made(planned.path, partial(filed, store, planned)) for planned in scenes}
    return {path: sha256 for path, sha256 in made.items() if sha256}


NO_MOULDS = "no moulds were asked for: only C200 ran, on the unit"


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
            yield name, "not asked for (--only)"
    if "step" not in spec.output.formats:
        yield "boundary representation", "no STEP asked for" if find_spec("OCP") else NO_KERNEL
