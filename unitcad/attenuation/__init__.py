"""Attenuation of a unit's vibration: a layered half-space solved exactly, and estimates of the level at the edge.

numpy and scipy only; SI inside. Knows nothing of CAD, nor of the spec. The names below are loaded on first use.
"""

# pyright: strict
from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from unitcad.attenuation.layered.loads import Load, Point, UniformDisc
    from unitcad.attenuation.layered.medium import LayeredMedium
    from unitcad.attenuation.layered.response import Response
    from unitcad.attenuation.layered.rheology import Damping, FractionalKelvinVoigt, KelvinVoigt, LossFactor
    from unitcad.attenuation.layered.stack import HalfSpace, Layer

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

_PLACES = {
    "loads": ("Load", "Point", "UniformDisc"),
    "medium": ("LayeredMedium",),
    "response": ("Response",),
    "rheology": ("Damping", "FractionalKelvinVoigt", "KelvinVoigt", "LossFactor"),
    "stack": ("HalfSpace", "Layer"),
}


def __getattr__(name: str) -> object:
    """Load a public name. Raises `AttributeError` for any other."""
    for place, names in _PLACES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.layered.{place}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
