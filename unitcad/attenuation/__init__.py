"""Attenuation of a unit's vibration: a layered half-space solved exactly, and estimates of the level at the edge.

numpy and scipy only; SI inside. Knows nothing of CAD, nor of the spec.
"""

# pyright: strict
from unitcad.attenuation.layered import (
    Damping,
    FractionalKelvinVoigt,
    HalfSpace,
    KelvinVoigt,
    Layer,
    LayeredMedium,
    Load,
    LossFactor,
    Point,
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
    "Load",
    "LossFactor",
    "Point",
    "Response",
    "UniformDisc",
]
