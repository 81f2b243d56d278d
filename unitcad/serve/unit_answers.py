"""Answers to the page about a unit's spec: its form, the unit itself, the moulds judged, the estimate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from unitcad import catalogue
from unitcad.casting.procedure import Procedure, procedure
from unitcad.casting.steps import casting_summary
from unitcad.checks import check_moulds
from unitcad.designs import widths
from unitcad.errors import Refusal
from unitcad.estimate_inputs import closed_forms, estimate_spec, motor_mass
from unitcad.export.svg import unit_section
from unitcad.moulds.heights import as_printed, height_warnings
from unitcad.moulds.mould_set import MouldSet, shallow_grooves
from unitcad.pipeline.plan import glb_content
from unitcad.pipeline.scenes import exploded_moves, moments, unit_apart
from unitcad.report.page import cells
from unitcad.serve.form import groups
from unitcad.serve.messages import Answer, Trusted
from unitcad.spec import Spec, to_data, to_toml
from unitcad.spec.custom_code import files_named, is_allowed, is_body_file, is_custom, with_source
from unitcad.validation import from_data, warnings
from unitcad.validation.defaults import resolved
from unitcad.validation.load import all_faults, sound_data
from unitcad.validation.load import judge as judge

form = groups
named_files = files_named
as_data = to_data
as_toml = to_toml
faults_of = all_faults
PICKED = ("design",)
"""Fields whose change needs others."""


def settled(data: Mapping[str, Any], trusted: Trusted) -> Spec:
    """Return the resolved spec of a text's plain data. Raises Refusal."""
    return from_data(data, folder_for(data, trusted))


def with_files(data: Mapping[str, Any], trusted: Trusted) -> dict[str, Any]:
    """Return plain data with the texts of the files that it may name."""
    folder = folder_for(data, trusted)
    return with_source(dict(data), folder) if folder else dict(data)


def makeable(data: dict[str, Any]) -> Mapping[str, Any]:
    """Return the result of `judge`. Raises UnitcadError also for a unit that has no moulds."""

    spec = resolved(data)
    _ = MouldSet(spec).plan
    return to_data(spec)


def asked_toml(text: str, data: Mapping[str, Any], spec: Spec, trusted: Trusted) -> str:
    """Return a text as TOML that names no file: the text itself if it names none."""
    import tomlkit

    return tomlkit.dumps(with_files(data, trusted)) if files_named(data) else text


def units(data: Mapping[str, Any], folder: Path) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the unit's plain data, with the field of its design."""
    yield "design", data


def sound_with(data: Mapping[str, Any], before: Spec) -> dict[str, Any]:
    """Return the data of a template of a picked design."""
    return sound_data(data)


def has_code(spec: Spec) -> bool:
    """Tell whether a spec has code. Raises Refusal if it may not run."""
    code = spec.design_source is not None and not is_body_file(spec.design)
    if code and not is_allowed(spec.design, spec.design_source or ""):
        raise Refusal("design", spec.design, "code from a page does not run")
    return code


def folder_for(data: Mapping[str, Any], trusted: Trusted) -> Path | None:
    """Return the folder that a text's files start at; None unless it names only those of a trusted spec.

    Raises Refusal for a design's file that no trusted spec names.
    """
    named, design = files_named(data), data.get("design")
    folders = [Path(source.folder) for source in trusted if source.named == named]
    if not folders and is_custom(design) and data.get("design_source") is None:
        limit = "a design's file is read only if the spec that the server was started with names it"
        raise Refusal("design", design, limit)
    return folders[0] if named and folders else None


def _unit(spec: Spec, answer: Answer) -> None:

    moulds = MouldSet(spec)
    solids = {body.name: moulds.mesh(body) for body in moulds.unit}
    answer.model = {
        "unit": glb_content(moulds, moulds.unit),
        "unit_apart": {name: list(offset) for name, offset in unit_apart(moulds).items()},
    }
    concentric = moulds.design.tooling == "concentric"
    answer.section = unit_section(moulds.unit, moulds.dimensions, moulds.segments, concentric=concentric)
    answer.warnings = warnings(spec)
    boxes = [solid.bounding_box() for solid in solids.values()]
    height = max(box[5] for box in boxes) - min(box[2] for box in boxes)
    across = widths(spec, [solids[body.name].bounding_box() for body in moulds.unit if body.made != "bought"])
    names = ("diameter",) if not is_custom(spec.design) else ("width",) if len(across) == 1 else ("length", "width")
    answer.figures = [(name, size, "mm") for name, size in zip((*names, "height"), (*across, height), strict=True)]
    if not (spec.motor.absent or spec.motor.fill or is_custom(spec.design)):
        answer.figures.append(("ring of air", moulds.dimensions.air_ring, "mm"))
    known, grams = catalogue.materials(spec.materials), []
    layers = {f"layer{i}": float(known[layer.material].density_g_cm3) for i, layer in enumerate(spec.layers, 1)}
    if layers.keys() <= solids.keys():
        grams = [density * solids[name].volume() / 1000 for name, density in layers.items()]
    if grams:
        answer.figures.append(("silicone", sum(grams), "g"))
    if grams and not spec.motor.absent:
        motor = catalogue.motors(spec.motors)[spec.motor.part] if spec.motor.part else None
        answer.figures.append(("with its motor", sum(grams) + 1e3 * motor_mass(spec, motor).middle, "g"))


def _moulds(spec: Spec, answer: Answer) -> None:

    moulds = MouldSet(spec)
    answer.model = {
        "moulds": glb_content(moulds, moulds.plan.tools),
        "cells": cells(moulds),
        "moments": [{"title": moment.title, "parts": list(moment.parts)} for moment in moments(moulds)],
        "moulds_apart": {name: list(offset) for name, offset in exploded_moves(moulds).items()},
    }
    answer.checks = [dict(finding.as_dict()) for finding in check_moulds(moulds)]
    answer.lines = [*printed_line(moulds), *casting_summary(asdict(unit_procedure(moulds)))]
    answer.warnings = [*shallow_grooves(moulds), *height_warnings(moulds)]


def printed_line(moulds: MouldSet, of: str = "The unit") -> Iterator[str]:
    """Yield the heights that the printer makes, as a build's first line has them; nothing if they are as drawn."""
    if made := as_printed(moulds):
        yield f"{of} comes out {made}."


def unit_procedure(moulds: MouldSet) -> Procedure:
    """Return the casting procedure of a unit from its meshes."""

    return procedure(moulds, [moulds.solids[step.name].volume() for step in moulds.plan.steps])


def _estimate(spec: Spec, answer: Answer) -> None:
    # The elements take seconds: the page shows the formulas, `unitcad estimate` has the rest.
    answer.estimate = estimate_spec(spec, closed_forms(spec.estimate.models))


ANSWERS = {"unit": _unit, "moulds": _moulds, "estimate": _estimate}
