"""A spec or an array, as a batch handles both: its text for a worker, its key, its folder, and what makes it."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from unitcad.arrays.array import Array
from unitcad.arrays.array_file import array_hash, array_of
from unitcad.cache import Store, digest
from unitcad.pipeline.array_build import array_subject
from unitcad.pipeline.folder import Subject, subject
from unitcad.pipeline.geometry import build_key
from unitcad.pipeline.product import Product, make, possible_outputs
from unitcad.pipeline.stages import Stages
from unitcad.pipeline.versions import code_version
from unitcad.spec import Spec, from_json, to_json
from unitcad.validation import from_data

Made = Spec | Array
_ARRAY = "array"


def of_data(data: Mapping[str, Any]) -> Made:
    """Return the spec or the array of plain data. Raises Refusal."""
    return array_of(data) if _ARRAY in data else from_data(dict(data), Path())


def to_text(of: Made) -> str:
    """Return a text from which `of_text` gives the same."""
    return json.dumps(of.asked) if isinstance(of, Array) else to_json(of)


def of_text(text: str) -> Made:
    """Return the spec or the array of a text by `to_text`."""
    data = json.loads(text)
    return array_of(data) if _ARRAY in data else from_json(text)


def subject_of(of: Made) -> Subject:
    """Return it as the subject of a result."""
    return array_subject(of) if isinstance(of, Array) else subject(of)


def unit_of(of: Made) -> Spec:
    """Return the spec itself, or the array's unit."""
    return of.unit if isinstance(of, Array) else of


def key_of(of: Made, only: Sequence[str], check: bool) -> str:
    """Return the key under which variants share their making: a spec's geometry; each array has one of its own."""
    if isinstance(of, Array):
        return digest(repr((array_hash(of), tuple(only), check, code_version())).encode())
    return build_key(of, only, check)


def outputs_of(of: Made, only: Sequence[str]) -> tuple[str, ...]:
    """Return what of `only` there can be."""
    return tuple(only) if isinstance(of, Array) else possible_outputs(of, only)


def product_of(of: Made, only: Sequence[str], check: bool, store: Store, stages: Stages) -> Product:
    """Return everything asked for, nothing written yet."""
    if isinstance(of, Array):
        from unitcad.pipeline.array_product import make_array

        return make_array(of, only, check, store, stages)
    return make(of, only, check, store, stages)
