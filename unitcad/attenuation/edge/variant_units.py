"""Variants at the middle of their inputs' ranges, as the closed forms read them. SI."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec.structs import replace

from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.measured_levels import whole_ratio
from unitcad.attenuation.inputs import EstimateInput, SiliconeLayer

FIELDS = ("youngs_modulus", "poisson_ratio", "tan_delta")
"""Properties of a silicone that have a range."""


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
        whole=[whole_ratio(variant.moduli) for variant in variants],
    )


def merged(variant: EstimateInput, within: float = 0.0) -> EstimateInput:
    """Return a unit with neighbouring layers of one material as one layer: how a body is cut changes no level.

    `within`: layers whose properties differ by less, relative, are of one material too, that of the innermost.
    """
    layers, shapes = variant.layers, variant.geometry.layers
    groups: list[list[int]] = []

    def alike(one: SiliconeLayer, other: SiliconeLayer) -> bool:
        values = [[layer.density, *(getattr(layer, field).middle for field in FIELDS)] for layer in (one, other)]
        return one.material == other.material or bool(np.allclose(*values, rtol=within, atol=0.0))

    for i, layer in enumerate(layers):
        if groups and alike(layers[groups[-1][0]], layer):
            groups[-1].append(i)
        else:
            groups.append([i])
    if len(groups) == len(layers):
        return variant
    whole = (replace(layers[g[0]], thickness=sum(layers[i].thickness for i in g), first=g[0]) for g in groups)
    outer = tuple(replace(shapes[g[-1]], cap=sum(shapes[i].cap for i in g)) for g in groups)
    return replace(variant, layers=tuple(whole), geometry=replace(variant.geometry, layers=outer))
