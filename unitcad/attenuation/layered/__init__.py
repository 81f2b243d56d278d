"""A layered half-space under a load: waves, their propagation through layers, loads, and the Hankel integral."""

from unitcad.attenuation.layered.loads import Direction, Load, Point, UniformDisc
from unitcad.attenuation.layered.medium import (
    Damping,
    FractionalKelvinVoigt,
    HalfSpace,
    KelvinVoigt,
    Layer,
    LossFactor,
    complex_shear_modulus,
    compressibility,
)
from unitcad.attenuation.layered.response import LayeredMedium, Response, components

__all__ = [
    "Damping",
    "Direction",
    "FractionalKelvinVoigt",
    "HalfSpace",
    "KelvinVoigt",
    "Layer",
    "LayeredMedium",
    "Load",
    "LossFactor",
    "Point",
    "Response",
    "UniformDisc",
    "complex_shear_modulus",
    "components",
    "compressibility",
]
