"""What the page is told about a spec's text: its form and faults, the unit, the moulds judged, the estimate.

Runs in a worker process, which a hang or a crash ends. A text from the page is data: what it names in files is read,
and code is run, only where the spec that the server was started with names the same.
"""

from __future__ import annotations

import time
import tomllib
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import msgspec

from unitcad.errors import Refusal, UnitcadError
from unitcad.serve.edits import edited
from unitcad.serve.form import groups
from unitcad.serve.messages import Answer, Ask, Fault, Trusted
from unitcad.spec import Spec, to_data, to_toml
from unitcad.spec.custom_code import files_named, is_allowed, is_body_file
from unitcad.validation import from_data
from unitcad.validation.load import all_faults


def respond(message: bytes, trusted: bytes) -> bytes:
    """Return the answer to an `Ask`, both as JSON; `trusted` is a `Trusted` as JSON."""
    begun = time.perf_counter()
    ask = msgspec.json.decode(message, type=Ask)
    answer = answered(ask, msgspec.json.decode(trusted, type=Trusted))
    answer.milliseconds = round(1e3 * (time.perf_counter() - begun), 1)
    return msgspec.json.encode(answer)


def answered(ask: Ask, trusted: Trusted) -> Answer:
    """Return the answer to a question. A fault of the text or of a value is in it; nothing is raised for one."""
    try:
        text = edited(ask.text, ask.edits)
    except UnitcadError as error:
        return Answer(text=ask.text, faults=[_fault(error)])
    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        return Answer(text=text, faults=[Fault(f"the text is no TOML: {error}", line=_line_of(str(error)))])
    answer = Answer(text=text, layers=len(data["layers"]) if isinstance(data.get("layers"), list) else 0)
    spec = None
    try:
        spec = from_data(data, folder_for(data, trusted))
        if ask.what == "unit":
            _unit(spec, answer)
        elif ask.what == "moulds":
            _moulds(spec, answer)
        else:
            _estimate(spec, answer)
    except Refusal as error:
        answer.faults = [_fault(one) for one in _every(error, data, text, spec is None)]
    except UnitcadError as error:
        answer.faults = [_fault(error)]
    if ask.what == "unit":
        answer.groups = groups(data, spec)
        answer.spec = to_data(spec) if spec else None
    return answer


def effective(text: bytes, trusted: bytes) -> bytes:
    """Return {"text": the effective spec as TOML, "code": whether it holds code} of a text, or {"refused": why}.

    The spec holds the texts of the files that it may name, and no other code.
    """
    try:
        data = tomllib.loads(text.decode())
        spec = from_data(data, folder_for(data, msgspec.json.decode(trusted, type=Trusted)))
        code = spec.design_source is not None and not is_body_file(spec.design)
        if code and not is_allowed(spec.design, spec.design_source or ""):
            raise Refusal("design", spec.design, "code from a page does not run")
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        return msgspec.json.encode({"refused": f"the text is no TOML: {error}"})
    except UnitcadError as error:
        return msgspec.json.encode({"refused": str(error)})
    return msgspec.json.encode({"text": to_toml(spec), "code": code})


def folder_for(data: Mapping[str, Any], trusted: Trusted) -> Path | None:
    """Return the folder that a text's files start at; None unless it names those of the server's own spec alone."""
    named = files_named(data)
    if trusted.folder is None or not named or named != trusted.named:
        return None
    return Path(trusted.folder)


def _unit(spec: Spec, answer: Answer) -> None:
    from unitcad.export.svg import unit_section
    from unitcad.moulds.mould_set import MouldSet
    from unitcad.pipeline.bodies import glb_content
    from unitcad.pipeline.scenes import unit_apart
    from unitcad.validation import warnings

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
    answer.figures = [("diameter", spec.diameter_mm, "mm"), ("height", height, "mm")]
    grams = _grams(
        spec, [solids[f"layer{i + 1}"].volume() for i in range(len(spec.layers)) if f"layer{i + 1}" in solids]
    )
    if grams:
        answer.figures.append(("silicone", sum(grams), "g"))


def _grams(spec: Spec, volumes: list[float]) -> list[float]:
    from unitcad import catalogue

    known = catalogue.materials(spec.materials)
    if len(volumes) != len(spec.layers):
        return []
    pairs = zip(spec.layers, volumes, strict=True)
    return [float(known[layer.material].density_g_cm3) * volume / 1000 for layer, volume in pairs]


def _moulds(spec: Spec, answer: Answer) -> None:
    from unitcad.casting.in_short import in_short
    from unitcad.casting.procedure import procedure
    from unitcad.mould_checks import check_moulds
    from unitcad.moulds.mould_set import MouldSet
    from unitcad.pipeline.bodies import glb_content, is_printed
    from unitcad.pipeline.scenes import moments, taken_apart
    from unitcad.report.viewer_models import cells

    moulds = MouldSet(spec)
    plan, solids = moulds.plan, moulds.solids
    answer.model = {
        "moulds": glb_content(moulds, plan.tools),
        "cells": cells(moulds),
        "moments": [{"title": moment.title, "parts": list(moment.parts)} for moment in moments(moulds)],
        "moulds_apart": {name: list(offset) for name, offset in taken_apart(moulds).items()},
    }
    answer.checks = [dict(finding.as_dict()) for finding in check_moulds(moulds)]
    printed = sum(solids[tool.name].volume() for tool in plan.tools if is_printed(tool))
    made = procedure(moulds, [solids[step.name].volume() for step in plan.steps], printed)
    answer.lines = list(in_short(asdict(made)))


def _estimate(spec: Spec, answer: Answer) -> None:
    from unitcad.designs import design_of, no_estimate
    from unitcad.estimating import closed_forms, estimate_spec

    if not design_of(spec).passes:
        answer.lines = [f"{spec.design} has no estimate: {no_estimate()}"]
        return
    # The elements take seconds: the page shows the formulas, `unitcad estimate` has the rest.
    answer.estimate = estimate_spec(spec, closed_forms(spec.estimate.models))


def _every(error: Refusal, data: dict[str, Any], text: str, of_values: bool) -> list[Refusal]:
    """Return all faults of the text; of one that the moulds or the estimate met, itself."""
    return all_faults(error, data, text) if of_values else [error]


def _fault(error: UnitcadError) -> Fault:
    if isinstance(error, Refusal):
        given = error.as_dict()
        return Fault(str(error), error.field, given["nearest"], error.line)
    return Fault(str(error))


def _line_of(message: str) -> int | None:
    """Return the line that tomllib's message names."""
    _, _, place = message.rpartition("(at line ")
    digits = place.partition(",")[0]
    return int(digits) if digits.isdigit() else None
