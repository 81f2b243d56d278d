"""The scene of an array in the viewer: the patch, each distinct body once with its places, and the tools by pours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from unitcad.arrays.array import Array
from unitcad.arrays.patch import PatchPart, patch_moulds, patch_parts
from unitcad.arrays.patch_pictures import laid_elsewhere, taken_apart
from unitcad.export import glb
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.pipeline.plan import glb_content, glb_part, joint_glb
from unitcad.report.html_page import compressed
from unitcad.shape import union
from unitcad.shape.body import Body

BELOW = 14.0
"""Distance by which inserted parts are drawn out of a sheet, towards the skin, mm."""


def array_model(array: Array) -> dict[str, Any]:
    """Return an array for the page in the form of `viewer_models.model`: the patch; tools with their silicone.

    Raises UnitcadError if the tools can't be made any more.
    """
    model = {**patch_model(array), **tools_model(array)}
    return model | {key: compressed(model[key]) for key in ("unit", "moulds")}


def patch_model(array: Array) -> dict[str, Any]:
    """Return the patch for the viewer, its GLB file as bytes; a body at several places is there once.

    Lengths in mm.
    """
    parts = _by_kind(patch_parts(array))
    shared = {part.name for part in parts if part.body.made == "cast" and not part.places}
    return {
        "makes": "patch",
        "unit": patch_glb(patch_moulds(array).blank, parts),
        "unit_apart": {part.name: [0.0, 0.0, 0.0 if part.name in shared else -BELOW] for part in parts},
        "row": min((place.y for place in array.places), key=abs),
        "axes": {"y": "along x", "x": "along y", "z": "level"},
    }


def _by_kind(parts: Sequence[PatchPart]) -> list[PatchPart]:
    """Return parts of which those that are put in, each a body of its own round a limb, are one for each kind."""
    put_in: dict[str, list[Body]] = {}
    for part in parts:
        if part.body.made != "cast" and not part.places:
            put_in.setdefault(part.body.kind, []).append(part.body)
    kept = [part for part in parts if part.body.made == "cast" or part.places]
    whole = (replace(bodies[0], name=kind, shape=union(b.shape for b in bodies)) for kind, bodies in put_in.items())
    return [*kept, *(PatchPart(body.name, body) for body in whole)]


def patch_glb(moulds: MouldSet, parts: Sequence[PatchPart]) -> bytes:
    """Return the GLB of an array's whole patch: the mesh of each distinct body once, a node at each of its places."""
    return joint_glb(
        moulds,
        [
            replace(
                glb_part(moulds, part.body),
                name=part.name,
                places=[glb.Standing(f"{p.name}-{part.body.name}", p.x, p.y, p.angle_deg) for p in part.places],
            )
            for part in parts
        ],
    )


def tools_model(array: Array) -> dict[str, Any]:
    """Return the tools of an array's sheet for the viewer, and their silicone: a GLB file as bytes, each pour.

    Lengths in mm. Raises UnitcadError if the tools can't be made.
    """
    moulds = patch_moulds(array).blank
    plan, apart = moulds.plan, dict(taken_apart(moulds))
    pieces = {name: [piece.name for piece in plan.pieces_of(name)] for step in plan.steps for name in step.tools}
    bodies = {body.step: body.name for body in moulds.unit}

    def flat(step: Step) -> str:
        return "-flat" if laid_elsewhere(plan, step) else ""

    return {
        "moulds": glb_content(moulds, list(apart)),
        "moulds_apart": {body.name: list(offset) for body, offset in apart.items()},
        "cells": [],
        "moments": [
            {
                "title": f"Pour {step.index}, struck off",
                "parts": [
                    *(piece for name in step.tools for piece in pieces[name]),
                    *(bodies[i] + flat(step) for i in range(1, step.index + 1)),
                ],
            }
            for step in plan.steps
        ],
    }
