"""What the studies read of the finite elements and no estimate does: bare skin under a disc, other components."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from unitcad.attenuation.fem.elements import FIELDS, TINY, Block, Fields, HarmonicMesh, harmonic_mesh, respond
from unitcad.attenuation.fem.unit import RADIUS, medium_blocks
from unitcad.attenuation.inputs import Drive
from unitcad.attenuation.layered import LayeredMedium

Component = Literal["along", "normal", "radial", "total"]
"""Component of the reading.

Along the drive (axial: u_z; flat: u_r in the drive's direction), |u_z|, |u_r|, or the root of the sum of the squares of
u_r, u_theta and u_z (of a force that turns: over half a turn, the mean of the largest squares).
"""


def amplitude(displacement: tuple[complex, complex, complex], drive: Drive, component: Component) -> float:
    """Return one amplitude of (u_r, u_theta, u_z)."""
    u_r, _, u_z = displacement
    if component == "total":
        return float(np.linalg.norm(displacement)) / (math.sqrt(2.0) if drive == "flat" else 1.0)
    along = "normal" if drive == "axial" else "radial"
    return abs(u_z) if (along if component == "along" else component) == "normal" else abs(u_r)


def disc_response(mesh: HarmonicMesh, blocks: Sequence[Block], omega: float, harmonic: int, disc: float) -> Fields:
    """Solve bare skin under 1 Pa on a disc (m): pushing down (m = 0), or sideways towards theta = 0 (m = 1)."""
    nodes = mesh.on_skin(False)
    nodes = nodes[mesh.r[nodes] < disc + TINY]
    weights = np.zeros(nodes.size)
    for i in range(0, nodes.size - 2, 2):  # the sides of the elements on the surface, each with three nodes
        low, high = mesh.r[nodes[i]], mesh.r[nodes[i + 2]]
        t, w = np.polynomial.legendre.leggauss(3)
        n = np.array([t * (t - 1) / 2, 1 - t * t, t * (t + 1) / 2])
        weights[i : i + 3] += n @ (w * ((low + high) / 2 + (high - low) / 2 * t)) * (high - low) / 2
    load = np.zeros((len(FIELDS[harmonic]), mesh.r.size, 1))
    if harmonic == 0:
        load[1, nodes, 0] = -2 * np.pi * weights
    else:
        load[0, nodes, 0] = 2 * np.pi * weights
    return respond(mesh, blocks, omega, harmonic, "bonded", np.zeros_like(load), np.zeros(load.shape[:2], bool), load)


def pressed_skin(medium: LayeredMedium, omega: float, drive: Drive, disc: float, fineness: float) -> Fields:
    """Solve bare skin under 1 Pa on a disc of that radius (m), pushing down or, flat, sideways."""
    blocks = medium_blocks(medium, omega, RADIUS)
    mesh = harmonic_mesh(blocks, fineness, RADIUS, disc)
    return disc_response(mesh, blocks, omega, 0 if drive == "axial" else 1, disc)
