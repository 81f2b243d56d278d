"""The numbers of a 3MF model part that are read one by one: coordinates, and the transform of an item or component."""

from __future__ import annotations

import math
import re

import numpy as np

from unitcad.geometry.arrays import Floats
from unitcad.meshcheck.geometry.mesh import LARGEST
from unitcad.meshcheck.readers.rows import NOT_FINITE
from unitcad.meshcheck.readers.threemf import elements
from unitcad.meshcheck.readers.threemf.model_data import Model
from unitcad.meshcheck.rules.f_file import F004, not_a_number
from unitcad.meshcheck.rules.p_package import P013, P015, P017

_NOT_FINITE = re.compile(NOT_FINITE, re.ASCII | re.IGNORECASE)


def coordinate(text: str, model: Model, line: int) -> float:
    """Return the number of an attribute's text; NaN for one that is not finite, 0 with a finding for no number."""
    text = text.strip(" \t\r\n")
    if elements.number(text):
        return float(text)
    if _NOT_FINITE.fullmatch(text):
        return math.nan
    model.add(F004, not_a_number(text).message, line=line)
    return 0.0


def transform(text: str | None, model: Model, regular: set[tuple[str, ...]]) -> Floats:
    """Return the transform (4, 3) of an attribute's text; the identity, with a finding of `model`, where it is none.

    `regular`: linear parts that are known to be sound; this one is added.
    """
    identity = np.vstack([np.eye(3), np.zeros(3)])
    if text is None:
        return identity
    parts = elements.words(text)
    if len(parts) == 12 and all(elements.number(part) for part in parts):
        matrix = np.array([float(part) for part in parts]).reshape(4, 3)
        if not (np.abs(matrix) <= LARGEST).all():
            model.add(P013, f'transform="{text[:60]}" is not twelve float32 numbers')
            return identity
        if (linear := tuple(parts[:9])) not in regular:  # most items of a build differ by their shift only
            det = float(np.linalg.det(matrix[:3]))
            scale = float(np.prod(np.linalg.norm(matrix[:3], axis=1)))
            if not math.isfinite(det) or abs(det) <= 1e-12 * scale:
                model.add(P013, "a transform has determinant zero")
            elif det < 0:
                model.add(P015, "a transform mirrors")
            else:
                regular.add(linear)
        return matrix
    rule = P013 if len(parts) == 12 and any(_NOT_FINITE.fullmatch(part) for part in parts) else P017
    model.add(rule, f'transform="{text[:60]}" is not twelve numbers')
    return identity
