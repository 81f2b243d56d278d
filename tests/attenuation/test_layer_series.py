"""The exponential of a layer by two functions of its trace and determinant, against 50 digits of the 4 x 4 matrix."""

import mpmath as mp
import numpy as np
import pytest

from unitcad.attenuation.layered.propagation import Material, exponential


def _exponential(material: Material, k: float, h: float) -> np.ndarray:
    """exp(-A h) - 1 in (u_r, u_z, t_r, t_z), A of y' = A y as elastodynamics has it, z into the body."""
    with mp.workdps(50):
        mu, eps, ks2, k = mp.mpc(material.shear), mp.mpf(material.eps), mp.mpc(material.ks2), mp.mpf(k)
        lame = (1 - 2 * eps) * k
        matrix = mp.matrix(
            [
                [0, k, -1 / mu, 0],
                [-lame, 0, 0, -eps / mu],
                [(ks2 - 4 * (1 - eps) * k**2) * mu, 0, 0, lame],
                [0, ks2 * mu, -k, 0],
            ]
        )
        return np.array((mp.expm(-matrix * mp.mpf(h)) - mp.eye(4)).tolist(), dtype=complex)


@pytest.mark.parametrize("eps", [0.0, 1e-7, 0.29, 0.5])
@pytest.mark.parametrize("ks2", [0.0, 3.0 - 0.4j, 2e4, 2e4 - 3e3j])
@pytest.mark.parametrize("h", [1e-7, 1e-3, 0.02])
def test_it_is_the_exponential_of_the_matrix(eps, ks2, h):
    material = Material(2e4 + 3e3j, eps, complex(ks2))
    ks = abs(ks2) ** 0.5
    wavenumbers = np.array([1e-4, 0.3, 20.0, ks * eps**0.5 + 1e-9, ks + 1e-9, 1.3 * ks + 1.0])
    one = np.eye(4)[..., None] * np.ones(wavenumbers.size, dtype=complex)
    top = exponential(material, wavenumbers.astype(complex), h).raised(one)
    for i, k in enumerate(wavenumbers):
        exact = _exponential(material, k, h)
        # each entry in its own unit: traction over displacement is the modulus times a wavenumber
        unit = np.diag([1.0, 1.0, *[abs(material.shear) * max(k, ks)] * 2])
        found, exact = (np.linalg.solve(unit, matrix @ unit) for matrix in (top[..., i] - np.eye(4), exact))
        assert np.max(np.abs(found - exact)) < 4e-15 * max(1.0, np.max(np.abs(exact)))
