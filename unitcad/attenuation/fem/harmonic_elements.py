"""Elements of one angular harmonic: biquadratic displacement, linear discontinuous pressure eliminated in each element.

The pair Q2 / P1 does not lock where silicone is nearly incompressible. m = 0: u_r and u_z, the same all round. m = 1:
u_r cos(theta), u_theta sin(theta), u_z cos(theta), a motion towards theta = 0. Its unknowns are u_z,
q = (u_r - u_theta) / 2 and p = (u_r + u_theta) / 2, since regularity on the axis is then p = 0
and u_z = 0, with q free. SI.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.attenuation.fem.harmonic_mesh import HarmonicMesh

FIELDS = {0: ("u_r", "u_z"), 1: ("q", "p", "u_z")}
"""The unknown fields of each harmonic."""


@dataclass(frozen=True)
class ElementMatrices:
    """Matrices of every element for unit constants, shape (elements, n, n); n runs over fields, then nodes.

    shear is to be multiplied by mu, bulk by Lame's lambda, mass by the density. u^T K u is twice the energy of the
    whole ring, J.
    """

    shear: np.ndarray
    bulk: np.ndarray
    mass: np.ndarray


def element_matrices(mesh: HarmonicMesh, harmonic: int) -> ElementMatrices:
    """Integrate the matrices of every element of a mesh for harmonic 0 or 1."""
    basis = mesh.basis
    x = np.asarray(basis.global_coordinates())
    functions = [f[0] for f in basis.basis]
    n = np.moveaxis(np.array([np.broadcast_to(np.asarray(f), x.shape[1:]) for f in functions]), 0, -1)
    dr, dz = (np.moveaxis(np.array([np.asarray(f.grad)[i] for f in functions]), 0, -1) for i in (0, 1))
    weight = x[0] * basis.dx * (2 * np.pi if harmonic == 0 else np.pi)
    strains = _strains(harmonic, n, dr, dz, x[0][..., None])
    shear = sum(
        (scale * _product(strain, strain, weight) for scale, strain in zip((2, 2, 2, 1, 1, 1), strains, strict=False)),
        np.zeros(()),
    )
    mass = sum((_product(u, u, weight) for u in _displacements(harmonic, n)), np.zeros(()))
    divergence = strains[0] + strains[1] + strains[2]
    middle, half = _middle_and_half(mesh)
    linear = np.stack([np.ones_like(x[0]), *((x[i] - middle[i]) / half[i] for i in (0, 1))], axis=-1)
    gram = _product(linear, linear, weight)
    coupling = _product(linear, divergence, weight)
    bulk = np.swapaxes(coupling, 1, 2) @ np.linalg.solve(gram, coupling)
    return ElementMatrices(shear, bulk, mass)


def _strains(harmonic: int, n: np.ndarray, dr: np.ndarray, dz: np.ndarray, r: np.ndarray) -> list[np.ndarray]:
    """Return rr, tt, zz and the engineering shears rz, rt, tz, each (elements, points, unknowns of an element)."""
    o, h = np.zeros_like(n), n / r
    if harmonic == 0:
        rows = [(dr, o), (h, o), (o, dz), (dz, dr)]
    else:
        rows = [(dr, dr, o), (o, 2 * h, o), (o, o, dz), (dz, dz, dr), (-dr, dr - 2 * h, o), (-dz, dz, -h)]
    return [np.concatenate(row, axis=-1) for row in rows]


def _displacements(harmonic: int, n: np.ndarray) -> list[np.ndarray]:
    """Return u_r, (u_theta,) u_z, each (elements, points, unknowns of an element)."""
    o = np.zeros_like(n)
    rows = [(n, o), (o, n)] if harmonic == 0 else [(n, n, o), (-n, n, o), (o, o, n)]
    return [np.concatenate(row, axis=-1) for row in rows]


def _product(a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> np.ndarray:
    return np.swapaxes(a * weight[..., None], 1, 2) @ b


def _middle_and_half(mesh: HarmonicMesh) -> tuple[np.ndarray, np.ndarray]:
    corners = mesh.basis.mesh.p[:, mesh.basis.mesh.t]
    low, high = corners.min(axis=1)[..., None], corners.max(axis=1)[..., None]
    return (low + high) / 2, (high - low) / 2
