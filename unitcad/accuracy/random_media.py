"""Random media, loads and radii of the classes on which an error bound is most easily broken."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from unitcad.attenuation.layered import (
    Damping,
    FractionalKelvinVoigt,
    HalfSpace,
    KelvinVoigt,
    Layer,
    LayeredMedium,
    LossFactor,
    UniformDisc,
)


@dataclass(frozen=True)
class Trial:
    """A response to compute, SI."""

    name: str
    kind: str
    medium: LayeredMedium
    load: UniformDisc
    omega: float
    r: np.ndarray


def trial(kind: str, seed: int) -> Trial:
    """Draw one of the `CLASSES` from `seed`."""
    rng = np.random.default_rng([seed, CLASSES.index(kind)])
    medium = _MEDIA[kind](rng)
    omega = 2 * math.pi * (_between(rng, 1e3, 2e4) if kind == "large k a" else _between(rng, 20, 500))
    if kind == "ordinary" and rng.random() < 0.1:
        omega = 0.0
    radius = _between(rng, 5e-3, 15e-3) if kind == "large k a" else _between(rng, 0.5e-3, 8e-3)
    load = UniformDisc(radius, "normal" if rng.integers(0, 2) else "tangential")
    r = np.sort([_between(rng, 3e-4, 4e-2) for _ in range(4)])
    if rng.random() < 0.3:
        r[0] = radius
    return Trial(f"{kind} {seed}", kind, medium, load, omega, r)


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _damping(rng: np.random.Generator) -> Damping:
    dampings = (
        LossFactor(_between(rng, 0.01, 0.5)),
        KelvinVoigt(_between(rng, 0.3, 30.0)),
        FractionalKelvinVoigt(_between(rng, 1e-5, 1e-3), 0.3),
    )
    return dampings[rng.integers(0, 3)]


def _material(rng: np.random.Generator, low: float = 3e3, high: float = 1e7) -> tuple[float, float, float, Damping]:
    nu = float(rng.choice([-0.3, 0.0, 0.3, 0.45, 0.49, 0.4999, 0.4999999, 0.5]))
    return float(rng.uniform(800, 2000)), _between(rng, low, high), nu, _damping(rng)


def _ordinary(rng: np.random.Generator) -> LayeredMedium:
    layers = [Layer(_between(rng, 1e-4, 2e-2), *_material(rng)) for _ in range(rng.integers(0, 4))]
    return LayeredMedium(layers, HalfSpace(*_material(rng, 3e3, 1e10)))


def _forearm(rng: np.random.Generator) -> tuple[list[Layer], HalfSpace]:
    """Draw the catalogue's kind of tissue: skin, fat, muscle on bone, each modulus within a factor of two."""

    def about(value: float) -> float:
        return value * _between(rng, 0.5, 2.0)

    layers = [
        Layer(about(1.5e-3), 1100, about(130e3), 0.49, LossFactor(0.14)),
        Layer(about(4e-3), 950, about(9e3), 0.495, KelvinVoigt(about(3.0))),
        Layer(about(25e-3), 1050, about(12e3), 0.495, KelvinVoigt(about(4.5))),
    ]
    return layers, HalfSpace(1900, 15e9, 0.3, LossFactor(0.01))


def _film_on_the_forearm(rng: np.random.Generator) -> LayeredMedium:
    """Draw gel or rubber between unit and skin."""
    layers, bone = _forearm(rng)
    film = Layer(_between(rng, 1e-5, 1e-3), 1000, _between(rng, 1e2, 1e6), 0.4999, LossFactor(_between(rng, 0.05, 0.5)))
    return LayeredMedium([film, *layers], bone)


def _nearly_fluid_film(rng: np.random.Generator) -> LayeredMedium:
    """Draw water, oil or a thin gel, anywhere in the stack."""
    layers, bone = _forearm(rng) if rng.random() < 0.5 else ([], HalfSpace(*_material(rng)))
    film = Layer(
        _between(rng, 1e-5, 1e-3),
        1000,
        _between(rng, 1e-4, 10.0),
        float(rng.choice([0.4999, 0.499999999, 0.5])),
        KelvinVoigt(_between(rng, 1e-3, 1.0)),
    )
    place = int(rng.integers(0, len(layers) + 1))
    return LayeredMedium([*layers[:place], film, *layers[place:]], bone)


def _inverted(rng: np.random.Generator) -> LayeredMedium:
    """Draw stiff layers over soft ones, each by up to 1e4."""
    moduli = sorted((_between(rng, 1e3, 1e8) for _ in range(rng.integers(2, 5))), reverse=True)
    parts = [(float(rng.uniform(800, 2000)), e, float(rng.choice([0.3, 0.45, 0.4999])), _damping(rng)) for e in moduli]
    return LayeredMedium([Layer(_between(rng, 3e-5, 5e-3), *part) for part in parts[:-1]], HalfSpace(*parts[-1]))


def _zero_thickness(rng: np.random.Generator) -> LayeredMedium:
    """Draw one or two layers of no thickness, of any material, among ordinary ones."""
    medium = _ordinary(rng)
    layers = list(medium.layers)
    for _ in range(rng.integers(1, 3)):
        layers.insert(int(rng.integers(0, len(layers) + 1)), Layer(0.0, *_material(rng, 1e-3, 1e9)))
    return LayeredMedium(layers, medium.half_space)


def _large(rng: np.random.Generator) -> LayeredMedium:
    """Draw soft media under a wide disc at kilohertz, with few layers."""
    layers = [Layer(_between(rng, 3e-4, 1e-2), *_material(rng, 5e3, 1e6)) for _ in range(rng.integers(0, 3))]
    return LayeredMedium(layers, HalfSpace(*_material(rng, 5e3, 1e6)))


def _undamped(rng: np.random.Generator) -> LayeredMedium:
    medium = _ordinary(rng)
    layers = [Layer(la.thickness, la.density, la.youngs_modulus, la.poisson_ratio) for la in medium.layers]
    below = medium.half_space
    return LayeredMedium(layers, HalfSpace(below.density, below.youngs_modulus, below.poisson_ratio))


def _partly_damped(rng: np.random.Generator) -> LayeredMedium:
    """Draw an ordinary medium or a wide contrast with at least one layer and about half of its layers undamped."""
    medium = _ordinary(rng) if rng.random() < 0.5 else _wide_contrast(rng)
    while not medium.layers:
        medium = _ordinary(rng)
    bare = rng.random(len(medium.layers) + 1) < 0.5
    bare[rng.integers(0, bare.size)] = True
    layers = [replace(layer, damping=None) if no else layer for layer, no in zip(medium.layers, bare, strict=False)]
    below = medium.half_space
    return LayeredMedium(layers, replace(below, damping=None) if bare[-1] else below)


def _wide_contrast(rng: np.random.Generator) -> LayeredMedium:
    """Draw moduli of 1 kPa to 1 GPa in any order, layers from 3 micrometres on, damped or not."""
    damped = rng.random() < 0.7

    def part() -> tuple[float, float, float, Damping]:
        nu = float(rng.choice([0.0, 0.3, 0.45, 0.49, 0.4999999, 0.5]))
        damping = LossFactor(_between(rng, 0.01, 0.5)) if damped else None
        return float(rng.uniform(900, 2000)), _between(rng, 1e3, 1e9), nu, damping

    layers = [Layer(_between(rng, 3e-6, 0.02), *part()) for _ in range(rng.integers(1, 5))]
    return LayeredMedium(layers, HalfSpace(*part()))


def _extreme_contrast(rng: np.random.Generator) -> LayeredMedium:
    """Draw moduli 1e6 to 1e12 apart: a stiff layer on, under or between soft ones, damped or not."""
    ratio = _between(rng, 1e6, 1e12)
    soft = _between(rng, 1e2, 1e5)
    damped = rng.random() < 0.7

    def part(modulus: float) -> tuple[float, float, float, Damping]:
        nu = float(rng.choice([0.0, 0.3, 0.45, 0.4999999, 0.5]))
        damping = LossFactor(_between(rng, 0.01, 0.5)) if damped else None
        return float(rng.uniform(900, 2000)), modulus, nu, damping

    start = int(rng.integers(0, 2))
    moduli = [soft * _between(rng, 1.0, 10.0) * (ratio if i % 2 == start else 1.0) for i in range(rng.integers(2, 5))]
    layers = [Layer(_between(rng, 3e-5, 0.02), *part(modulus)) for modulus in moduli[:-1]]
    return LayeredMedium(layers, HalfSpace(*part(moduli[-1])))


_MEDIA: dict[str, Callable[[np.random.Generator], LayeredMedium]] = {
    "ordinary": _ordinary,
    "film on the forearm": _film_on_the_forearm,
    "nearly fluid film": _nearly_fluid_film,
    "inverted": _inverted,
    "zero thickness": _zero_thickness,
    "large k a": _large,
    "undamped": _undamped,
    "wide contrast": _wide_contrast,
    "extreme contrast": _extreme_contrast,
    "partly damped": _partly_damped,
}
CLASSES = tuple(_MEDIA)
