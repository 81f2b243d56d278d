"""Several units on one tissue: how far one that drives moves the others, whose masses load the skin.

Each unit is a mass on a disc of skin, free to move along x, y and z without turning. The skin under unit i moves by
u_i = sum of G_ij f_j, f_j being the force on the skin at unit j. A unit of mass m_j that is driven by F_j presses with
f_j = F_j + omega^2 m_j u_j, so (I - omega^2 G m) u = G F. G is the layered response of a uniform traction on the disc
of unit j, averaged over the disc of unit i. It is symmetric by reciprocity, and tissue only takes up power through it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from unitcad.attenuation.inputs import Drive, EstimateInput, Quantity
from unitcad.attenuation.layered import LayeredMedium, components
from unitcad.attenuation.layered.loads import UniformDisc
from unitcad.errors import Refusal

FORCES: dict[Drive, tuple[complex, complex, complex]] = {"flat": (1.0, -1.0j, 0.0), "axial": (0.0, 0.0, 1.0)}
"""A newton along x, y and z: one that turns in the plane of the skin, and one along the axis."""
_RINGS, _SPOKES = 4, 12
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(16)


@dataclass(frozen=True)
class Patch:
    """A unit on the skin: the middle of its disc, the disc's radius (m) and the mass on it (kg)."""

    x: float
    y: float
    radius: float
    mass: float


def influence(medium: LayeredMedium, patches: Sequence[Patch], omega: float, rtol: float = 1e-4) -> np.ndarray:
    """Return G at omega (rad/s) in m/N, shape (n, 3, n, 3): mean motion (x, y, z) of each patch per newton on each.

    rtol as `LayeredMedium.response`; the means add about 5e-4 of the largest entry. Raises `Refusal` if patches
    overlap.
    """
    n = len(patches)
    middles = np.array([(patch.x, patch.y) for patch in patches])
    radii = np.array([patch.radius for patch in patches])
    apart = np.linalg.norm(middles[:, None] - middles[None], axis=2) + np.diag(np.full(n, np.inf))
    if np.any(apart < (radii[:, None] + radii[None]) * (1.0 - 1e-9)):
        raise Refusal("patches", float(apart.min()), "patches overlap", float(2.0 * radii.max()))
    inside = np.sqrt((_NODES + 1.0) / 2.0)
    g = np.zeros((n, 3, n, 3), dtype=np.complex128)
    for radius in np.unique(radii):
        to, source = np.meshgrid(np.arange(n), np.nonzero(radii == radius)[0], indexing="ij")
        to, source = to[to != source], source[to != source]
        ways = np.column_stack([middles[to] - middles[source], radii[to]])
        ways, way_of = np.unique(np.round(ways, 12), axis=0, return_inverse=True)  # alike in a regular array
        steps = (ways[:, None, :2] + ways[:, None, 2:] * _over_disc()).reshape(-1, 2)
        distances, at = np.unique(np.round(np.linalg.norm(steps, axis=1), 12), return_inverse=True)
        r = np.concatenate([inside * radius, distances])
        normal = components(medium, UniformDisc(radius, "normal"), omega, r, rtol)
        sideways = components(medium, UniformDisc(radius, "tangential"), omega, r, rtol)
        area = np.pi * radius**2
        alone = _own(normal, sideways) / area
        for j in np.nonzero(radii == radius)[0]:
            g[j, :, j, :] = alone
        if to.size:
            tensors = _tensors(normal, sideways, inside.size + at.ravel(), steps) / area
            g[to, :, source, :] = tensors.reshape(len(ways), -1, 3, 3).mean(axis=1)[way_of.ravel()]
    return g


def motion(g: np.ndarray, masses: Sequence[float] | np.ndarray, forces: np.ndarray, omega: float) -> np.ndarray:
    """Return the motion u of the patches in m for G (m/N), masses (kg, n) and forces (N), u shaped as the forces.

    Forces: (n, 3), or (n, 3, cases) for any number of cases.
    """
    size = 3 * len(masses)
    flat = g.reshape(size, size)
    loaded = np.eye(size) - omega**2 * flat * np.repeat(masses, 3)
    return np.linalg.solve(loaded, flat @ forces.reshape(size, -1)).reshape(forces.shape)


def unit_mass(variant: EstimateInput) -> Quantity:
    """Return the mass of a unit in kg: its silicone and its motor, without the circuit."""
    shape = variant.geometry
    held, silicone = shape.cavity_radius**2 * shape.core_height, 0.0
    for layer, of in zip(shape.layers, variant.layers, strict=True):
        cylinder = layer.outer_radius**2 * layer.top
        silicone += np.pi * (cylinder - held) * of.density
        held = cylinder
    motor = shape.motor_mass
    low, high = motor.ends
    return Quantity(silicone + motor.middle, silicone + low, silicone + high, motor.note)


def _over_disc() -> np.ndarray:
    """Return points (x, y) of a disc of radius 1, equal in weight, whose mean is that over the disc."""
    rings = np.sqrt((np.arange(_RINGS) + 0.5) / _RINGS)
    spokes = 2.0 * np.pi * (np.arange(_SPOKES) + 0.5) / _SPOKES
    return np.stack([np.outer(rings, np.cos(spokes)).ravel(), np.outer(rings, np.sin(spokes)).ravel()], axis=1)


def _own(normal: np.ndarray, sideways: np.ndarray) -> np.ndarray:
    """Return the mean motion of a disc under its own traction, shape (3, 3), from the first radii of the responses."""
    own = slice(0, _NODES.size)
    along = np.sum(_WEIGHTS * (sideways[0] - sideways[1])[own]) / 4.0
    return np.diag([along, along, np.sum(_WEIGHTS * normal[2, own]) / 2.0])


def _tensors(normal: np.ndarray, sideways: np.ndarray, at: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return the motion (x, y, z) per traction along x, y and z a step (m) from the source, shape (steps, 3, 3)."""
    outwards = steps / np.linalg.norm(steps, axis=1)[:, None]
    both = outwards[:, :, None] * outwards[:, None, :]
    tensors = np.zeros((len(steps), 3, 3), dtype=np.complex128)
    u_r, u_theta = sideways[0, at][:, None, None], sideways[1, at][:, None, None]
    tensors[:, :2, :2] = u_r * both - u_theta * (np.eye(2) - both)
    tensors[:, 2, :2] = sideways[2, at][:, None] * outwards
    tensors[:, :2, 2] = normal[0, at][:, None] * outwards
    tensors[:, 2, 2] = normal[2, at]
    return tensors
