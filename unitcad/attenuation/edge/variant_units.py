"""Variants at the middle of their inputs' ranges, as the closed forms read them. SI."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec.structs import replace

from unitcad.attenuation.edge.bush import sections
from unitcad.attenuation.edge.closed_form import CONTROL_PASSES, Units
from unitcad.attenuation.inputs import EstimateInput

FIELDS = ("youngs_modulus", "poisson_ratio", "tan_delta")
"""What a silicone has a range of."""
MOST_LAYERS = 2
"""Layers that a unit with a level may have, neighbours of one material merged."""
MANY_LAYERS = (
    "no measured unit has more than two layers, and the models would give this one another level if its layers were "
    "cut differently"
)


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


def merged(variant: EstimateInput) -> EstimateInput:
    """Return a unit with neighbouring layers of one material as one layer: how a body is cut changes no level."""
    layers, shapes = variant.layers, variant.geometry.layers
    groups: list[list[int]] = []
    for i, layer in enumerate(layers):
        if groups and layers[groups[-1][-1]].material == layer.material:
            groups[-1].append(i)
        else:
            groups.append([i])
    if len(groups) == len(layers):
        return variant
    whole = (replace(layers[g[0]], thickness=sum(layers[i].thickness for i in g), first=g[0]) for g in groups)
    outer = tuple(replace(shapes[g[-1]], cap=sum(shapes[i].cap for i in g)) for g in groups)
    return replace(
        variant,
        passes=CONTROL_PASSES if len(groups) == 1 else variant.passes,
        layers=tuple(whole),
        geometry=replace(variant.geometry, layers=outer),
    )


def no_level(variant: EstimateInput) -> str:
    """Return why no model gives the unit a level, its layers or a silicone's modulus; empty if they may."""
    if len(variant.layers) > MOST_LAYERS:
        return MANY_LAYERS
    return next((layer.youngs_modulus.note for layer in variant.layers if not layer.youngs_modulus.known), "")
