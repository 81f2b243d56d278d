"""Finite elements of one angular harmonic of rings: the mesh, its matrices, and the steady response to a force.

The mesh is of rectangles: graded grid lines, void left out, the skin's surface split from the unit; z upwards from the
skin's surface (the unit's frame), lengths in m.

Displacement is biquadratic, pressure linear, discontinuous and eliminated in each element. The pair Q2 / P1 does not
lock where silicone is nearly incompressible. m = 0: u_r and u_z, the same all round. m = 1: u_r cos(theta), u_theta
sin(theta), u_z cos(theta), a motion towards theta = 0. Its unknowns are u_z, q = (u_r - u_theta) / 2 and p = (u_r +
u_theta) / 2, since regularity on the axis is then p = 0 and u_z = 0, with q free. SI.

SI, e^{+i omega t}. One factorisation serves every load and reading: the motor's motions are prescribed one by one,
which leaves a small dynamic stiffness to which its mass and turning inertia are added.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from unitcad.extras import missing_extra

try:
    import skfem
    from threadpoolctl import threadpool_limits
except ImportError as error:  # pragma: no cover - depends on the installation
    raise missing_extra("fem", "finite elements need scikit-fem and threadpoolctl") from error

SIZE, GROWTH, LARGEST = 1e-3, 0.3, 4e-3
"""The mesh of fineness 1: an element's size at corners of the geometry (m), its growth per distance from one, and its
largest size (m). Fineness n divides all three, so that errors fall with the elements' order."""
TINY = 1e-9
one_thread = threadpool_limits.wrap(limits=1)
"""Keeps a function's linear algebra on one thread: its blocks are small, and threads on them cost ten times."""


@dataclass(frozen=True)
class Solid:
    """A material at one frequency: complex shear modulus (Pa), Poisson's ratio below 1/2, density (kg/m3)."""

    shear: complex
    poisson_ratio: float
    density: float

    @property
    def lame(self) -> complex:
        """Lame's first constant, Pa."""
        return 2 * self.shear * self.poisson_ratio / (1 - 2 * self.poisson_ratio)


@dataclass(frozen=True)
class Block:
    """A ring of one material: r0 to r1, z0 to z1 (m). `solid` None: rigid, the motor."""

    r0: float
    r1: float
    z0: float
    z1: float
    solid: Solid | None


@dataclass(frozen=True)
class HarmonicMesh:
    """Biquadratic nodes of a meridian plane.

    basis   scikit-fem's scalar basis on the rectangles: shape functions, quadrature
    owner   the block of each element
    above   whether a node belongs to the unit; at z = 0 the skin and the unit have nodes of their own
    floor   the lowest z, at which everything is fixed
    radius  of the tissue's outer border, which is fixed
    """

    basis: skfem.Basis
    owner: np.ndarray
    above: np.ndarray
    floor: float
    radius: float

    @property
    def r(self) -> np.ndarray:
        return self.basis.doflocs[0]

    @property
    def z(self) -> np.ndarray:
        return self.basis.doflocs[1]

    def on_skin(self, above: bool) -> np.ndarray:
        """Return the nodes at z = 0 of the unit (`above`) or of the skin, by radius."""
        nodes = np.flatnonzero((np.abs(self.z) < TINY) & (self.above == above))
        return nodes[np.argsort(self.r[nodes])]

    def at(self, r: float, z: float, above: bool) -> int:
        """Return the node at a corner of the geometry."""
        away = np.hypot(self.r - r, self.z - z) + np.where(self.above == above, 0.0, 1.0)
        node = int(np.argmin(away))
        if away[node] > 1e-7:
            raise ValueError(f"no node at r {r:g}, z {z:g}")
        return node


def lines(breaks: Sequence[float], focus: Sequence[float], fineness: float) -> np.ndarray:
    """Return grid lines (m) through all `breaks`: fine at a focus, coarser with the distance from it."""
    near = np.asarray(focus)
    grid = [float(breaks[0])]
    for low, high in itertools.pairwise(breaks):
        x = np.linspace(low, high, 400)
        wanted = np.minimum(LARGEST, SIZE + GROWTH * np.min(np.abs(x[:, None] - near[None]), axis=1)) / fineness
        count = np.concatenate([[0.0], np.cumsum(np.diff(x) * (1 / wanted[1:] + 1 / wanted[:-1]) / 2)])
        elements = max(1, math.ceil(count[-1] - 1e-9))
        grid += [*np.interp(np.linspace(0, count[-1], elements + 1)[1:-1], count, x), float(high)]
    return np.array(grid)


def harmonic_mesh(blocks: Sequence[Block], fineness: float, radius: float, corner: float | None = None) -> HarmonicMesh:
    """Mesh `blocks` out to `radius` (m); void elsewhere. A line goes through r = `corner`, say the edge of a load.

    Of overlapping blocks the last one counts.
    """
    corners = sorted({x for b in blocks for x in (b.r0, b.r1) if x < radius} | {0.0, corner or 0.0})
    levels = sorted({z for b in blocks for z in (b.z0, b.z1)})
    # Interfaces deep in the tissue need no fine elements: nothing changes there on a unit's scale.
    near = [z for z in levels if z > -TINY] or levels[-1:]
    grid = skfem.MeshQuad.init_tensor(
        lines([*corners, radius], corners[1:] or [0.0], fineness), lines(levels, near, fineness)
    )
    middle = grid.p[:, grid.t].mean(axis=1)
    owner = np.full(grid.t.shape[1], -1)
    for i, b in enumerate(blocks):
        inside = (middle[0] > b.r0) & (middle[0] < b.r1) & (middle[1] > b.z0) & (middle[1] < b.z1)
        owner[inside] = i if b.solid else -1
    kept = np.flatnonzero(owner >= 0)
    mesh = grid.restrict(kept)
    upper = mesh.p[1, mesh.t].mean(axis=0) > 0
    shared = np.intersect1d(np.unique(mesh.t[:, upper]), np.unique(mesh.t[:, ~upper]))
    double = np.arange(mesh.p.shape[1])
    double[shared] = mesh.p.shape[1] + np.arange(shared.size)
    t = np.where(upper[None], double[mesh.t], mesh.t)
    split = skfem.MeshQuad(np.hstack([mesh.p, mesh.p[:, shared]]), t)
    basis = skfem.Basis(split, skfem.ElementQuad2(), intorder=5)
    above = np.zeros(basis.N, dtype=bool)
    above[np.unique(basis.element_dofs[:, upper])] = True
    return HarmonicMesh(basis, owner[kept], above, levels[0], radius)


FIELDS = {0: ("u_r", "u_z"), 1: ("q", "p", "u_z")}


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
    o = np.zeros_like(n)
    rows = [(n, o), (o, n)] if harmonic == 0 else [(n, n, o), (-n, n, o), (o, o, n)]  # u_r, (u_theta,) u_z
    displacements = [np.concatenate(row, axis=-1) for row in rows]
    mass = sum((_product(u, u, weight) for u in displacements), np.zeros(()))
    divergence = strains[0] + strains[1] + strains[2]
    corners = basis.mesh.p[:, basis.mesh.t]
    low, high = corners.min(axis=1)[..., None], corners.max(axis=1)[..., None]
    middle, half = (low + high) / 2, (high - low) / 2
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


def _product(a: np.ndarray, b: np.ndarray, weight: np.ndarray) -> np.ndarray:
    return np.swapaxes(a * weight[..., None], 1, 2) @ b


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
    return respond(mesh, blocks, omega, harmonic, contact, prescribed, rigid, np.zeros_like(prescribed))


@one_thread
def respond(
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
