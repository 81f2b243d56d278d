"""Variants at the middle of their inputs' ranges, as the closed forms read them. SI."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from unitcad.attenuation.edge.bush import sections
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.inputs import EstimateInput

FIELDS = ("youngs_modulus", "poisson_ratio", "tan_delta")
"""What a silicone has a range of."""


def nominal(variant: EstimateInput) -> Units:
    """Return the variant's middle values as closed-form input."""
    return stacked([variant])


def stacked(variants: Sequence[EstimateInput]) -> Units:
    """Return the middle values of variants of one number of layers as closed-form input, a row each."""
    layers = [variant.layers for variant in variants]
    return Units(
        **{field: [[getattr(layer, field).middle for layer in row] for row in layers] for field in FIELDS},
        density=[[layer.density for layer in row] for row in layers],
        thickness=[[layer.thickness for layer in row] for row in layers],
        omega=[2.0 * np.pi * variant.frequency.middle for variant in variants],
        passes=[variant.passes for variant in variants],
        section=sections([variant.geometry for variant in variants]),
    )
