"""The plain propagator method in double precision, to stand beside the solver and be seen to fail.

Thomson (1950) and Haskell (1953): the layers' 4x4 matrices, with growing exponentials, are multiplied; potentials P and
S are not separated as omega -> 0.
"""

from __future__ import annotations

import numpy as np

from unitcad.attenuation.layered import HalfSpace, Layer, LayeredMedium, complex_shear_modulus, compressibility


def _columns(body: Layer | HalfSpace, k: complex, omega: float) -> tuple[np.ndarray, np.ndarray]:
    mu = complex_shear_modulus(body.youngs_modulus, body.poisson_ratio, body.damping, omega)
    ks2 = body.density * omega**2 / mu
    gp = np.sqrt(k * k - compressibility(body.poisson_ratio) * ks2 + 0j)
    gs = np.sqrt(k * k - ks2 + 0j)
    q = 2 * k * k - ks2
    down_p = [k, gp, 2 * mu * k * gp, mu * q]
    down_s = [gs, k, mu * q, 2 * mu * k * gs]
    mirror = np.array([1, -1, -1, 1])
    return np.array([down_p, down_s, mirror * down_p, mirror * down_s]).T, np.array([gp, gs, -gp, -gs])


def compliance(medium: LayeredMedium, k: float, omega: float) -> np.ndarray:
    """Return the 2x2 surface compliance at one wavenumber; NaN or wrong where the method breaks down."""
    with np.errstate(all="ignore"):
        plane = _columns(medium.half_space, k, omega)[0][:, :2]
        for layer in reversed(medium.layers):
            waves, rates = _columns(layer, k, omega)
            try:
                plane = waves @ np.diag(np.exp(rates * layer.thickness)) @ np.linalg.inv(waves) @ plane
            except np.linalg.LinAlgError:
                return np.full((2, 2), np.nan)
        try:
            return plane[:2] @ np.linalg.inv(plane[2:])
        except np.linalg.LinAlgError:
            return np.full((2, 2), np.nan)
