"""The paper's closed forms, as published and corrected, and inputs of the empirical models, over arrays of units. SI.

Every function broadcasts: a `Units` holds any number of variants of N layers each. A path runs from the motor outwards
through the walls of the layers, inside out, at the skin, and ends at the outer face, in air (equations 4 to 6).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any, Literal

import numpy as np

from unitcad.attenuation.edge.contrast import counts

Wave = Literal["p", "s"]
AIR_IMPEDANCE: dict[str, float] = {"p": 1.204 * 343.0, "s": 0.0}  # Pa s/m at 20 degC; air carries no shear wave


def _quiet() -> np.errstate:
    """Silence numpy's warnings: at nu = 1/2 the pressure wave's speed is infinite, and NaN in the result says so."""
    return np.errstate(divide="ignore", invalid="ignore", over="ignore")


@dataclass(frozen=True)
class Units:
    """Units of N layers: arrays whose last axis runs over the layers, inside out; omega, passes and whole lack it.

    youngs_modulus Pa, density kg/m3, poisson_ratio, tan_delta, thickness m (of the walls), omega rad/s; passes: how
    often the wave from motor to skin passes a border between layers; place, doubt: those of the layers' silicones
    (`contrast.place_of`), by default the logarithms of the moduli, without doubt.
    """

    youngs_modulus: Any
    density: Any
    poisson_ratio: Any
    tan_delta: Any
    thickness: Any
    omega: Any
    passes: Any
    place: Any = None
    doubt: Any = 0.0

    def __post_init__(self) -> None:
        if self.place is None:
            object.__setattr__(self, "place", np.log(self.youngs_modulus))
        for field in fields(self):
            object.__setattr__(self, field.name, np.asarray(getattr(self, field.name), dtype=float))
        object.__setattr__(self, "doubt", np.broadcast_to(self.doubt, np.shape(np.asarray(self.place))))

    def control(self, layer: int) -> Units:
        """Return own-material controls: the same unit, every layer of the material of `layer`."""
        one = {name: np.broadcast_to(v[..., layer, None], v.shape) for name in _MATERIAL for v in [getattr(self, name)]}
        return replace(self, **one)


_MATERIAL = ("youngs_modulus", "density", "poisson_ratio", "tan_delta", "place", "doubt")


def wave_speed(youngs_modulus: Any, density: Any, poisson_ratio: Any, wave: Wave) -> Any:
    """Return the wave speed in m/s by equations 1c and 1d.

    v_p = sqrt((lambda + 2 mu)/rho), infinite at nu = 1/2; v_s = sqrt(mu/rho).
    """
    shear = youngs_modulus / (2.0 * (1.0 + poisson_ratio))
    if wave == "s":
        return np.sqrt(shear / density)
    with _quiet():
        return np.sqrt(shear * 2.0 * (1.0 - poisson_ratio) / np.subtract(1.0, 2.0 * poisson_ratio) / density)


def transmission(from_impedance: Any, to_impedance: Any) -> Any:
    """Return k_t = 2 Z1/(Z1 + Z2), equation 4a: the displacement coefficient between two half-spaces."""
    with _quiet():
        return 2.0 * from_impedance / (from_impedance + to_impedance)


def reflection(from_impedance: Any, to_impedance: Any) -> Any:
    """Return k_r = (Z1 - Z2)/(Z1 + Z2), equation 4b."""
    with _quiet():
        return (from_impedance - to_impedance) / (from_impedance + to_impedance)


def impedances(units: Units, wave: Wave) -> Any:
    """Return rho v of each layer, shape (..., N), Pa s/m."""
    return units.density * wave_speed(units.youngs_modulus, units.density, units.poisson_ratio, wave)


def with_air(layered: Any, wave: Wave) -> Any:
    """Return the layers' impedances and, after the last one, air's."""
    layered = np.asarray(layered)
    return np.concatenate([layered, np.full((*layered.shape[:-1], 1), AIR_IMPEDANCE[wave])], axis=-1)


def transmissions(units: Units, wave: Wave = "s") -> Any:
    """Return k_t at each interface, shape (..., N): Layer 1 to 2, ..., the last layer to air."""
    z = with_air(impedances(units, wave), wave)
    return transmission(z[..., :-1], z[..., 1:])


def exponents(units: Units, wave: Wave = "s") -> Any:
    """Return omega eta d/(E v) of each layer, equation 5, shape (..., N); eta is a loss modulus E tan(delta) in Pa.

    That makes it a number. Its rate is twice the amplitude's true decay.
    """
    speed = wave_speed(units.youngs_modulus, units.density, units.poisson_ratio, wave)
    return units.omega[..., None] * units.tan_delta * units.thickness / speed


def published_path(units: Units, wave: Wave = "s") -> Any:
    """Return equation 5's product of k_t and exponentials along the walls, shape (...).

    f1, f2 and the skin's part cancel.
    """
    with _quiet():
        return np.prod(transmissions(units, wave), axis=-1) * np.exp(-np.sum(exponents(units, wave), axis=-1))


def corrected_path(units: Units, wave: Wave = "s") -> Any:
    """Return the path by complex moduli: product of |2 Z1/(Z1+Z2)|, Z = sqrt(rho M*), exp(Im(omega sqrt(rho/M*)) d)."""
    shear = units.youngs_modulus / (2.0 * (1.0 + units.poisson_ratio)) * (1.0 + 1j * units.tan_delta)
    with _quiet():
        factor = 2.0 * (1.0 - units.poisson_ratio) / (1.0 - 2.0 * units.poisson_ratio) if wave == "p" else 1.0
        modulus = shear * factor
        rate = -np.imag(units.omega[..., None] * np.sqrt(units.density / modulus))
        z = with_air(np.sqrt(units.density * modulus), wave)
        passed = np.abs(np.prod(transmission(z[..., :-1], z[..., 1:]), axis=-1))
        return passed * np.exp(-np.sum(rate * units.thickness, axis=-1))


def borders(units: Units) -> Any:
    """Return how much each border of layers counts, shape (..., N - 1): 1 if its inside is softer, -1 if stiffer."""
    return counts(units.place, units.doubt) - counts(-units.place, units.doubt)


def softer_passes(units: Units) -> Any:
    """Return how often the wave passes a border whose inside is the softer one: the rule is s q^n with this n."""
    return units.passes * np.sum(counts(units.place, units.doubt), axis=-1)


@dataclass(frozen=True)
class Constraint:
    """One of the paper's inequalities 5 and 6: `left` `relation` `right` for a unit against a control, as arrays."""

    name: str
    text: str
    relation: Literal[">", "<"]
    left: Any
    right: Any
    unit: str

    @property
    def margin(self) -> Any:
        """By how much it holds, in the unit of both sides, to the ninth digit of the larger one; negative if it fails.

        Sides that differ by less are equal: what is left of their difference would depend on the processor.
        """
        with _quiet():
            margin = self.left - self.right if self.relation == ">" else self.right - self.left
            return np.where(np.abs(margin) < 1e-9 * np.maximum(np.abs(self.left), np.abs(self.right)), 0.0, margin)


def constraints(units: Units, control: Units) -> list[Constraint]:
    """Return inequalities 5a, 5b and 6a to 6d; 6c and 6d for each pair of neighbouring layers.

    5 compares `published_path`. 6a and 6b compare sums of eta d/(E v) with eta = E tan(delta)/omega in Pa s, whose unit
    is s2; another reading of eta multiplies both sides by the same number. 6c and 6d say that the impedance grows
    outwards; they need no control.
    """
    inequalities = []
    waves: list[tuple[str, Wave]] = [("a", "p"), ("b", "s")]
    for name, wave in waves:
        text = f"path of {wave.upper()} waves: unit below control"
        paths = published_path(units, wave), published_path(control, wave)
        inequalities.append(Constraint(f"5{name}", text, "<", *paths, "1"))
    for name, wave in waves:
        text = f"attenuation of {wave.upper()} waves: unit above control"
        left, right = (np.sum(exponents(u, wave), axis=-1) / u.omega**2 for u in (units, control))
        inequalities.append(Constraint(f"6{name}", text, ">", left, right, "s2"))
    growth: list[tuple[str, Wave]] = [("6c", "p"), ("6d", "s")]
    for name, wave in growth:
        squared = impedances(units, wave) ** 2 * (2.0 if wave == "s" else 1.0)
        for i in range(squared.shape[-1] - 1):
            label = f"{wave.upper()} impedance squared: Layer {i + 1} below Layer {i + 2}"
            inequalities.append(Constraint(name, label, "<", squared[..., i], squared[..., i + 1], "Pa kg/m3"))
    return inequalities
