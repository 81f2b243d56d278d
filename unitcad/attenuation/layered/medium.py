"""Materials and layers, and a layered half-space: its compliance per wavenumber, exact from statics to k h = 1e12.

A viscoelastic law makes a shear modulus complex. Poisson's ratio stays real, so every modulus of a material carries the
same phase. With this time factor a passive material has a positive imaginary part.

The state below an interface is the plane of all (u, t) that the stack can carry there. It is kept as a pair of 2x2
blocks (U, T), u = U c, t = T c. It is carried upwards through a thick layer by reflection, R -> E R E, with decaying
exponentials only, and through one that is thin for a wave by the series of exp(-A h) - 1; before the next such step one
of the blocks is made the identity: the impedance T U^-1 or the compliance U T^-1, whichever is better conditioned, so
that neither a clamped nor a free resonance of the lower layers costs digits. The Thomson-Haskell propagator, which
multiplies growing exponentials, loses all digits where k h is large or omega small.

Time factor e^{+i omega t}; z into the medium; u_z with J0(kr), u_r with J1(kr), both k dk; SI throughout.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from numbers import Complex, Real
from typing import Any

import numpy as np

from unitcad.attenuation.layered.propagation import (
    Array,
    Material,
    adjugate,
    det,
    product,
    raise_plane,
    shear_compliance,
    underside,
)
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
    """Damping by a viscosity: mu + i omega eta.

    Parameters
    ----------
    viscosity : float
        Shear viscosity eta, Pa s, at least 0.

    Raises
    ------
    Refusal
        For a value that is negative or not finite.

    Examples
    --------
    >>> from unitcad.attenuation import KelvinVoigt
    >>> KelvinVoigt(2.0).complex_shear(10e3, omega=500.0)
    (10000+1000j)
    """

    viscosity: float

    def __post_init__(self) -> None:
        finite("damping.viscosity", self.viscosity)

    def complex_shear(self, shear_modulus: float, omega: float) -> complex:
        return complex(shear_modulus, omega * self.viscosity)


@dataclass(frozen=True)
class LossFactor:
    """Damping by a constant loss factor: mu (1 + i tan delta), the same at every frequency.

    Parameters
    ----------
    tan_delta : float
        Loss factor, at least 0.

    Raises
    ------
    Refusal
        For a value that is negative or not finite.

    Examples
    --------
    >>> from unitcad.attenuation import LossFactor
    >>> LossFactor(0.5).complex_shear(10e3, omega=785.0)
    (10000+5000j)
    """

    tan_delta: float

    def __post_init__(self) -> None:
        finite("damping.tan_delta", self.tan_delta)

    def complex_shear(self, shear_modulus: float, omega: float) -> complex:
        return complex(shear_modulus, shear_modulus * self.tan_delta)


@dataclass(frozen=True)
class FractionalKelvinVoigt:
    """Damping by a fractional law: mu (1 + (i omega tau)^n).

    Parameters
    ----------
    tau : float
        Time constant, s, at least 0.
    n : float
        Order, 0 to 1; n = 1 is Kelvin-Voigt with eta = mu tau.

    Raises
    ------
    Refusal
        For a value out of range or not finite.

    Examples
    --------
    >>> from unitcad.attenuation import FractionalKelvinVoigt
    >>> modulus = FractionalKelvinVoigt(tau=2e-3, n=1.0).complex_shear(10e3, omega=500.0)
    >>> round(modulus.real), round(modulus.imag)
    (10000, 10000)
    """

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


@dataclass(frozen=True)
class Layer:
    """A layer of a layered medium.

    Parameters
    ----------
    thickness : float
        Thickness, m, at least 0.
    density : float
        Density, kg/m3.
    youngs_modulus : float
        Young's modulus, Pa.
    poisson_ratio : float
        Poisson's ratio, above -1, at most 1/2.
    damping : Damping, optional
        Damping of the shear modulus. Default: none.

    Raises
    ------
    Refusal
        For a value out of range or not finite.

    Examples
    --------
    >>> from unitcad.attenuation import Layer, LossFactor
    >>> skin = Layer(1.5e-3, 1100.0, 100e3, 0.5, LossFactor(0.3))
    """

    thickness: float
    density: float
    youngs_modulus: float
    poisson_ratio: float
    damping: Damping = None

    def __post_init__(self) -> None:
        finite("layer.thickness", self.thickness)
        _check_material("layer", self, above=True)


@dataclass(frozen=True)
class HalfSpace:
    """The half-space under all layers.

    Parameters
    ----------
    density : float
        Density, kg/m3.
    youngs_modulus : float
        Young's modulus, Pa; 0 means a free underside.
    poisson_ratio : float
        Poisson's ratio, above -1, at most 1/2.
    damping : Damping, optional
        Damping of the shear modulus. Default: none.

    Raises
    ------
    Refusal
        For a value out of range or not finite.

    Examples
    --------
    >>> from unitcad.attenuation import HalfSpace
    >>> muscle = HalfSpace(1060.0, 20e3, 0.5)
    """

    density: float
    youngs_modulus: float
    poisson_ratio: float
    damping: Damping = None

    def __post_init__(self) -> None:
        _check_material("half_space", self, above=False)


def _check_material(what: str, material: Layer | HalfSpace, above: bool) -> None:
    finite(f"{what}.density", material.density)
    finite(f"{what}.youngs_modulus", material.youngs_modulus, 0.0, above)
    nu = finite(f"{what}.poisson_ratio", material.poisson_ratio, None)
    if nu > 0.5:
        raise Refusal(f"{what}.poisson_ratio", nu, "must be at most 0.5", 0.5)
    finite(f"{what}.poisson_ratio", nu, -1.0, above=True)
    if not isinstance(material.damping, Damping):
        raise Refusal(
            f"{what}.damping", str(material.damping), "must be a LossFactor, KelvinVoigt, FractionalKelvinVoigt or None"
        )


class Stack:
    """Layers, top first, on a half-space: its compliance, per wavenumber.

    Raises `Refusal` for objects other than `Layer` and `HalfSpace`.
    """

    def __init__(self, layers: Iterable[Layer], half_space: HalfSpace, least_loss: float = 0.0) -> None:
        entries: list[Any] = list(layers) if isinstance(layers, Iterable) else [layers]
        for i, layer in enumerate(entries):
            if not isinstance(layer, Layer):
                raise Refusal(f"layers.{i}", layer, "must be a Layer")
        if not isinstance(half_space, HalfSpace):
            raise Refusal("half_space", str(half_space), "must be a HalfSpace")
        self.layers: tuple[Layer, ...] = tuple(entries)
        self.half_space = half_space
        self.least_loss = least_loss
        self._last: tuple[float, tuple[Material, ...]] | None = None

    def __repr__(self) -> str:
        count, thickness = len(self.layers), sum(layer.thickness for layer in self.layers)
        layers = f"{count} {'layer' if count == 1 else 'layers'}, {1000 * thickness:g} mm, on a " if count else ""
        return f"{type(self).__name__}({layers}half-space)"

    def compliance(self, k: Any, omega: float) -> Array:
        """Return surface displacement (u_r, u_z) per surface traction (t_r, t_z), in m/Pa, shape k.shape + (2, 2).

        k: wavenumbers (1/m) with positive real part, real or complex, any shape; omega >= 0 (rad/s). The traction acts
        on the medium in +r and +z, so a positive pressure pushes into it and counts as t_z. Symmetric. Raises `Refusal`
        for k, for omega and for a medium without support at omega = 0.
        """
        k = np.asarray(k, dtype=np.complex128)
        wrong = k[~((np.abs(k) <= MOST) & (k.real > 0))]
        if wrong.size:
            raise Refusal(
                "k", str(wrong[0]), f"wavenumbers must be finite, at most {MOST:g}, with a positive real part"
            )
        with np.errstate(divide="ignore", invalid="ignore"):  # infinite at an undamped mode
            block = self.columns((0, 1), k.ravel(), omega)
        return np.moveaxis(block, -1, 0).reshape(*k.shape, 2, 2)

    def without_empty_layers(self) -> Stack:
        """Return the same stack without layers of no thickness, which change nothing."""
        if all(layer.thickness > 0 for layer in self.layers):
            return self  # and its cached properties of materials
        return Stack([layer for layer in self.layers if layer.thickness > 0], self.half_space, self.least_loss)

    def with_loss(self, tan_delta: float) -> Stack:
        """Return the same stack with at least that loss factor in every layer and the half-space."""
        return Stack(self.layers, self.half_space, tan_delta)

    def materials(self, omega: float) -> tuple[Material, ...]:
        """Return the layers' and the half-space's complex moduli at omega. Raises `Refusal` for a
        static medium without support."""
        if self._last is None or self._last[0] != omega:
            omega = finite("omega", omega)
            if self.half_space.youngs_modulus == 0.0 and omega == 0.0:
                raise Refusal("omega", omega, "nothing supports this medium: static loads would carry it away")
            materials = (*self.layers, self.half_space)
            self._last = omega, tuple(_material(material, omega, self.least_loss) for material in materials)
        return self._last[1]

    def last_pole(self, omega: float) -> float:
        """Return a wavenumber (1/m) above every pole and branch point: slow surface waves, bending of layers as plates.

        The softest layer bends with the layers under it, not as a plate. Raises as `materials`.
        """
        return _last_pole(self.layers, self.materials(omega), omega)

    def columns(self, ways: Sequence[int], k: Array, omega: float) -> Array:
        """Return (u_r, u_z) per unit surface traction along r (0) or z (1) of `ways`, shape (2, ways, n), in m/Pa."""
        *materials, base = self.materials(omega)
        top = underside(base, k)
        for layer, material in zip(reversed(self.layers), reversed(materials), strict=True):
            top = raise_plane(material, layer.thickness, k, top)
        return product(top.u, adjugate(top.t)[:, ways] / det(top.t))

    def shear_column(self, k: Array, omega: float) -> Array:
        """Return u_theta per surface traction of horizontally polarised shear (m/Pa), shape (n,)."""
        *materials, base = self.materials(omega)
        thicknesses = (layer.thickness for layer in reversed(self.layers))
        return shear_compliance(base, zip(reversed(materials), thicknesses, strict=True), k)


def _last_pole(layers: tuple[Layer, ...], materials: tuple[Material, ...], omega: float) -> float:
    shear = max(abs(m.ks2) ** 0.5 for m in materials)
    softest = min(abs(m.shear) for m in materials)
    mass = sum(layer.thickness * layer.density for layer in layers)
    bending = [
        (6.0 * mass * omega**2 / ((1.0 + layer.poisson_ratio) * abs(material.shear) * layer.thickness**3)) ** 0.25
        for layer, material in zip(layers, materials, strict=False)
        if abs(material.shear) > softest
    ]
    floor = min(max(bending, default=0.0), 20.0 * shear)
    return 1.5 * max(1.5 * shear, floor)


def _material(material: Layer | HalfSpace, omega: float, least_loss: float) -> Material:
    shear = complex_shear_modulus(material.youngs_modulus, material.poisson_ratio, material.damping, omega)
    shear = complex(shear.real, max(shear.imag, least_loss * shear.real))
    ks2 = material.density * omega * omega / shear if shear != 0 else 0.0
    return Material(shear, compressibility(material.poisson_ratio), complex(ks2))
