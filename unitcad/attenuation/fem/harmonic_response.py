"""The steady response of a mesh to a force on its rigid motor, or to a traction on bare skin. SI, e^{+i omega t}.

One factorisation serves every load and reading: the motor's motions are prescribed one by one, which leaves a small
dynamic stiffness to which its mass and turning inertia are added.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from unitcad.attenuation.fem.harmonic_elements import FIELDS, element_matrices
from unitcad.attenuation.fem.harmonic_mesh import TINY, Block, HarmonicMesh, one_thread

Contact = Literal["bonded", "resting"]
"""How skin carries unit and motor: it sticks, or slides without friction and does not lift off."""


@dataclass(frozen=True)
class Fields:
    """Displacements of all nodes (m) under unit motions of the motor or unit loads, a column each.

    values     (fields, nodes, columns), fields as `FIELDS`
    stiffness  the motor's dynamic stiffness without its own mass, (motions, motions): N/m, N and N m per unit of
               translation (m) and turning (rad)
    unknowns   how many equations were solved
    """

    mesh: HarmonicMesh
    harmonic: int
    values: np.ndarray
    stiffness: np.ndarray
    unknowns: int

    def displacement(self, nodes: int | np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return u_r, u_theta, u_z (z upwards) at nodes, a column a motion or load."""
        if self.harmonic == 0:
            u_r, u_z = self.values[:, nodes]
            return u_r, np.zeros_like(u_r), u_z
        q, p, u_z = self.values[:, nodes]
        return q + p, p - q, u_z

    def skin(self, r: Sequence[float] | np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return u_r, u_theta, u_z of the skin at radii (m), by the elements' own quadratics."""
        nodes = self.mesh.on_skin(False)
        radii, x = self.mesh.r[nodes], np.asarray(r, dtype=float)
        i = 2 * np.clip(np.searchsorted(radii[::2], x, side="right") - 1, 0, (radii.size - 3) // 2)
        low, high = radii[i], radii[i + 2]
        t = (2 * x - low - high) / (high - low)
        parts = t * (t - 1) / 2, 1 - t * t, t * (t + 1) / 2
        u_r, u_theta, u_z = (
            sum((n[:, None] * u[i + k] for k, n in enumerate(parts)), np.zeros(())) for u in self.displacement(nodes)
        )
        return u_r, u_theta, u_z


def motor_response(
    mesh: HarmonicMesh, blocks: Sequence[Block], omega: float, harmonic: int, contact: Contact = "bonded"
) -> Fields:
    """Solve for unit motions of the rigid block: along z (m = 0); sideways, and turning about its middle (m = 1).

    Turning is positive from z to x: its top goes towards theta = 0.
    """
    motor = next(b for b in blocks if b.solid is None)
    r, z = mesh.r, mesh.z
    touch = (r > motor.r0 - TINY) & (r < motor.r1 + TINY) & (z > motor.z0 - TINY) & (z < motor.z1 + TINY)
    height = z - (motor.z0 + motor.z1) / 2
    one, none = np.ones_like(r), np.zeros_like(r)
    motions = [(none, one)] if harmonic == 0 else [(one, none, none), (height, none, -r)]
    rigid = np.tile(touch, (len(FIELDS[harmonic]), 1))
    if contact == "resting":
        rigid[:-1, ~mesh.above] = False
    prescribed = np.where(rigid[..., None], np.moveaxis(np.array(motions), 0, -1), 0.0)
    return _respond(mesh, blocks, omega, harmonic, contact, prescribed, rigid, np.zeros_like(prescribed))


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
    return _respond(mesh, blocks, omega, harmonic, "bonded", np.zeros_like(load), np.zeros(load.shape[:2], bool), load)


@one_thread
def _respond(
    mesh: HarmonicMesh,
    blocks: Sequence[Block],
    omega: float,
    harmonic: int,
    contact: Contact,
    prescribed: np.ndarray,
    rigid: np.ndarray,
    load: np.ndarray,
) -> Fields:
    """Solve for columns of prescribed values and loads, (fields, nodes, columns)."""
    fields, nodes, columns = prescribed.shape
    local = _local_matrices(mesh, blocks, omega, harmonic)
    # Field f of node i is unknown f * nodes + i, of an element and of the whole.
    of_element = (np.arange(fields)[:, None, None] * nodes + mesh.basis.element_dofs).reshape(-1, mesh.owner.size).T
    number = _equations(mesh, harmonic, contact, rigid)
    free = number >= 0
    count = int(number.max()) + 1
    fixed = prescribed.reshape(-1, columns)
    rows = number[of_element]
    forces = -np.einsum("eij,ejc->eic", local, fixed[of_element])
    right = np.zeros((count, columns), dtype=complex)
    np.add.at(right, rows[rows >= 0], forces[rows >= 0])
    np.add.at(right, number[free], load.reshape(-1, columns)[free])
    i, j = (np.broadcast_to(k, local.shape) for k in (rows[:, :, None], rows[:, None, :]))
    kept = (i >= 0) & (j >= 0)
    matrix = coo_matrix((local[kept], (i[kept], j[kept])), shape=(count, count)).tocsc()
    # Symmetric with a dissipative imaginary part: pivots may stay on the diagonal, which keeps the factors sparse.
    factors = splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=1e-3, options={"SymmetricMode": True})
    solved = factors.solve(right)
    u = fixed.astype(complex)
    u[free] = solved[number[free]]
    reaction = np.einsum("eic,eij,ejd->cd", fixed[of_element], local, u[of_element], optimize=True)
    return Fields(mesh, harmonic, u.reshape(prescribed.shape), reaction, count)


def _local_matrices(mesh: HarmonicMesh, blocks: Sequence[Block], omega: float, harmonic: int) -> np.ndarray:
    """Return each element's stiffness less omega^2 mass."""
    unit = element_matrices(mesh, harmonic)
    solids = [b.solid for b in blocks]
    mu, lame, inertia = (
        np.array([0.0 if s is None else value(s) for s in solids])[mesh.owner][:, None, None]
        for value in (lambda s: s.shear, lambda s: s.lame, lambda s: s.density * omega**2)
    )
    return mu * unit.shear + lame * unit.bulk - inertia * unit.mass


def _equations(mesh: HarmonicMesh, harmonic: int, contact: Contact, rigid: np.ndarray) -> np.ndarray:
    """Return the equation of each unknown, -1 if it is fixed or prescribed; unit and skin share those of a bond."""
    fields, nodes = rigid.shape
    held = np.tile((mesh.z < mesh.floor + TINY) | (mesh.r > mesh.radius - TINY), (fields, 1))
    on_axis = mesh.r < TINY
    held[0 if harmonic == 0 else 1] |= on_axis
    if harmonic == 1:
        held[2] |= on_axis
    number = np.arange(fields * nodes).reshape(fields, nodes)
    unit, skin = mesh.on_skin(True), mesh.on_skin(False)
    under = skin[np.searchsorted(mesh.r[skin], mesh.r[unit] - TINY)] if skin.size else unit
    tied = range(fields) if contact == "bonded" else (fields - 1,)
    for field in tied:
        number[field, unit] = number[field, under]
    free = ~(held | rigid).ravel()
    equations = np.full(fields * nodes, -1)
    equations[free] = np.unique(number.ravel()[free], return_inverse=True)[1]
    return equations
