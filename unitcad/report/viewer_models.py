"""Data of a page: the models of its viewer, and the pictures of the steps."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.errors import UnitcadError
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.plan import GEOMETRIC, build_key, glb_content
from unitcad.pipeline.scenes import exploded_moves, moments, unit_apart
from unitcad.report.html_page import compress
from unitcad.spec import Spec, read_toml, with_formats
from unitcad.validation import from_data

LARGEST_PICTURE = 1_000_000
"""Bytes of a step's picture, at most."""
MOST_PICTURES = 500
PNG = b"\x89PNG\r\n\x1a\n"


def step_pictures(folder: Path, paths: Iterable[str]) -> dict[str, str]:
    """Return the pictures of these paths in a folder as data, without files that are missing or no PNG."""
    read: dict[str, str] = {}
    for path in list(dict.fromkeys(path for path in paths if path))[:MOST_PICTURES]:
        parts = Path(path).parts
        if Path(path).is_absolute() or ".." in parts or any((folder / p).is_symlink() for p in Path(path).parents):
            continue
        try:
            content = files.read(folder / path, largest=LARGEST_PICTURE, links=False)
        except UnitcadError:
            continue
        if content.startswith(PNG):
            read[path] = f"data:image/png;base64,{base64.b64encode(content).decode()}"
    return read


Modelled = Callable[[Spec], dict[str, Any]]
"""Returns the result of `model` for a spec."""


def spec_in(folder: Path) -> Spec:
    """Read the resolved spec of a result folder. Raises UnitcadError if it can't be read."""
    return from_data(read_toml(folder / "spec.toml", links=False))


def model_key(spec: Spec) -> str:
    """Return the key of a geometry, without silicones and formats: sixteen hex digits."""
    return build_key(with_formats(spec), GEOMETRIC, False)[:16]


def model(spec: Spec) -> dict[str, Any]:
    """Return a geometry for the page; GLB files compressed and in base 64. Lengths in mm.

    Raises UnitcadError if the geometry can't be made any more.
    """
    moulds = MouldSet(spec)
    plan = moulds.plan
    return {
        "unit": compress(glb_content(moulds, moulds.unit)),
        "moulds": compress(glb_content(moulds, plan.tools)),
        "cells": cells(moulds),
        "moments": [{"title": moment.title, "parts": list(moment.parts)} for moment in moments(moulds)],
        "unit_apart": {name: list(offset) for name, offset in unit_apart(moulds).items()},
        "moulds_apart": {name: list(offset) for name, offset in exploded_moves(moulds).items()},
    }


def cells(moulds: MouldSet) -> list[list[float]]:
    """Return the places of the unit's layers in the moulds: x, y (mm) and quarter turns about z, a cell each."""
    one_sided = moulds.dimensions.sides == (1,)
    return [[cell.x, cell.y, 2 if one_sided and cell.sides == (-1,) else 0] for cell in moulds.plan.layout.cells]
