"""Viscoelastic laws: how a shear modulus becomes complex at an angular frequency. SI, time factor e^{+i omega t}.

Poisson's ratio stays real, so every modulus of a material carries the same phase. With this time factor a passive
material has a positive imaginary part.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Complex, Real

from unitcad.errors import Refusal

LEAST, MOST = 1e-60, 1e60
"""Magnitudes of a quantity in SI units: products of a few of them stay finite."""


def finite(field: str, value: object, least: float | None = 0.0, above: bool = False) -> float:
    """Return `value` as a float that is finite and at least (or `above`) `least`. Raises `Refusal` otherwise.

    With a `least` its magnitude is 0 or from LEAST to MOST.
    """
    if isinstance(value, Complex) and not isinstance(value, Real):
        raise Refusal(field, str(value), "must be a real number")
    try:
        number = float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        raise Refusal(field, value, "must be a number") from None
    if not math.isfinite(number):
        raise Refusal(field, value, "must be a finite number")
    if least is not None and (number < least or (above and number == least)):
        raise Refusal(field, value, f"must be {'above' if above else 'at least'} {least:g}")
    if least is not None and number != 0.0 and not LEAST <= abs(number) <= MOST:
        raise out_of_range(field, number)
    return number


def out_of_range(field: str, number: float) -> Refusal:
    """Return the refusal of a magnitude with which numbers would overflow on the way."""
    nearest = math.copysign(MOST if abs(number) > 1.0 else LEAST, number)
    return Refusal(field, number, f"its magnitude must be from {LEAST:g} to {MOST:g}", nearest)


@dataclass(frozen=True)
class KelvinVoigt:
    """mu + i omega eta, with the shear viscosity eta in Pa s."""

    viscosity: float

    def __post_init__(self) -> None:
        finite("damping.viscosity", self.viscosity)

    def complex_shear(self, shear_modulus: float, omega: float) -> complex:
        return complex(shear_modulus, omega * self.viscosity)


@dataclass(frozen=True)
class LossFactor:
    """mu (1 + i tan delta), the same at every frequency, 0 included."""

    tan_delta: float

    def __post_init__(self) -> None:
        finite("damping.tan_delta", self.tan_delta)

    def complex_shear(self, shear_modulus: float, omega: float) -> complex:
        return complex(shear_modulus, shear_modulus * self.tan_delta)


@dataclass(frozen=True)
class FractionalKelvinVoigt:
    """mu (1 + (i omega tau)^n), tau in seconds, 0 <= n <= 1; n = 1 is Kelvin-Voigt with eta = mu tau."""

    tau: float
    n: float

    def __post_init__(self) -> None:
        finite("damping.tau", self.tau)
        if finite("damping.n", self.n) > 1.0:
            raise Refusal("damping.n", self.n, "must be at most 1", 1.0)

    def complex_shear(self, shear_modulus: float, omega: float) -> complex:
        if omega == 0.0:
            return complex(shear_modulus)
        return shear_modulus * (1.0 + (1j * omega * self.tau) ** self.n)


Damping = KelvinVoigt | LossFactor | FractionalKelvinVoigt | None


def complex_shear_modulus(youngs_modulus: float, poisson_ratio: float, damping: Damping, omega: float) -> complex:
    """Return mu* in Pa from E in Pa, nu and the damping at omega in rad/s: mu = E / (2 (1 + nu))."""
    shear = youngs_modulus / (2.0 * (1.0 + poisson_ratio))
    return complex(shear) if damping is None else damping.complex_shear(shear, omega)


def compressibility(poisson_ratio: float) -> float:
    """Return eps = mu / (lambda + 2 mu) = (v_s / v_p)^2 = (1 - 2 nu) / (2 (1 - nu)): 0 where incompressible."""
    return (1.0 - 2.0 * poisson_ratio) / (2.0 * (1.0 - poisson_ratio))
