"""Attenuation of a unit's vibration: a layered half-space solved exactly, and estimates of the level at the edge.

numpy and scipy only; SI inside. It does not depend on CAD or on the spec.

Examples
--------
The response of skin on a soft half-space to a motor's disc, at 7 and 20 mm:

>>> from unitcad.attenuation import HalfSpace, Layer, LayeredMedium, LossFactor, UniformDisc
>>> skin = Layer(thickness=1.5e-3, density=1100, youngs_modulus=130e3, poisson_ratio=0.49, damping=LossFactor(0.14))
>>> medium = LayeredMedium([skin], HalfSpace(density=1050, youngs_modulus=12e3, poisson_ratio=0.495))
>>> response = medium.response(UniformDisc(3.5e-3), omega=785.0, r=[7e-3, 20e-3])
>>> bool(abs(response.u_z[1]) < abs(response.u_z[0]))
True
"""

# pyright: strict
from unitcad.attenuation.layered import (
    Damping,
    FractionalKelvinVoigt,
    HalfSpace,
    KelvinVoigt,
    Layer,
    LayeredMedium,
    LossFactor,
    Response,
    UniformDisc,
)

__all__ = [
    "Damping",
    "FractionalKelvinVoigt",
    "HalfSpace",
    "KelvinVoigt",
    "Layer",
    "LayeredMedium",
    "LossFactor",
    "Response",
    "UniformDisc",
]
