"""Axisymmetric harmonic finite elements (m = 0) for bare skin and for a unit on it, compared with the layered solver.

Biquadratic displacement on rectangles; the pressure, linear and discontinuous, is eliminated element by element, so
that nearly incompressible silicone does not lock (the pair Q2 / P1). The lowest blocks stand on a rigid floor.
SI throughout, e^{+i omega t}; z upwards from the skin's surface (the unit's frame). Needs scikit-fem (extra `fem`).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import block_diag, csc_matrix, vstack
from scipy.sparse.linalg import splu

from unitcad.errors import Missing

if TYPE_CHECKING:
    from skfem import Basis

try:
    import skfem
except ImportError as error:  # pragma: no cover - depends on the installation
    raise Missing("finite elements need scikit-fem: pip install 'unitcad[fem]'") from error

SIZE, GROWTH, LARGEST = 1e-3, 0.3, 4e-3
"""The mesh of fineness 1: an element's size at corners of the geometry (m), its growth per distance from one, and its
largest size (m). Fineness n divides all three, so that errors fall with the elements' order."""
_TINY = 1e-9


@dataclass(frozen=True)
class Solid:
    """A material at one frequency: complex shear modulus (Pa), Poisson's ratio below 1/2, density (kg/m3)."""

    shear: complex
    poisson_ratio: float
    density: float


@dataclass(frozen=True)
class Block:
    """A ring of one material: r0 to r1, z0 to z1 (m). `solid` None: rigid, moving with unit amplitude along z."""

    r0: float
    r1: float
    z0: float
    z1: float
    solid: Solid | None


@dataclass(frozen=True)
class Surface:
    """Displacements at the skin's surface: radii (m), complex u_r and u_z (m, z upwards), and unknowns solved for."""

    r: np.ndarray
    u_r: np.ndarray
    u_z: np.ndarray
    unknowns: int

    def at(self, r: Sequence[float] | np.ndarray) -> np.ndarray:
        """Return u_z at radii r (m), by the elements' own quadratics."""
        x = np.asarray(r, dtype=float)
        i = 2 * np.clip(np.searchsorted(self.r[::2], x, side="right") - 1, 0, (len(self.r) - 3) // 2)
        low, high = self.r[i], self.r[i + 2]
        t = (2 * x - low - high) / (high - low)
        return t * (t - 1) / 2 * self.u_z[i] + (1 - t * t) * self.u_z[i + 1] + t * (t + 1) / 2 * self.u_z[i + 2]


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


def solve(
    blocks: Sequence[Block], omega: float, fineness: float, *, radius: float, pressure_radius: float | None = None
) -> Surface:
    """Solve for `blocks` (void elsewhere) at omega (rad/s) out to `radius` (m).

    The floor (the blocks' lowest z) and the outer edge are held. The load is a pressure of 1 Pa on the skin (z = 0)
    within `pressure_radius`, pushing down, or the motion of a rigid block.
    """
    corners = sorted({x for b in blocks for x in (b.r0, b.r1) if x < radius} | {0.0, pressure_radius or 0.0})
    levels = sorted({z for b in blocks for z in (b.z0, b.z1)})
    # Interfaces deep in the body need no fine elements: nothing changes there on a unit's scale.
    near = [z for z in levels if z > -_TINY]
    grid = skfem.MeshQuad.init_tensor(lines([*corners, radius], corners[1:], fineness), lines(levels, near, fineness))
    middle = grid.p[:, grid.t].mean(axis=1)
    owner = np.full(grid.t.shape[1], -1)
    for i, b in enumerate(blocks):
        inside = (middle[0] > b.r0) & (middle[0] < b.r1) & (middle[1] > b.z0) & (middle[1] < b.z1)
        owner[inside] = i if b.solid else -1
    kept = np.flatnonzero(owner >= 0)
    mesh = grid.restrict(kept)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementQuad2()), intorder=5)
    stiffness = _assemble(basis, [blocks[i].solid for i in owner[kept]], omega)
    load = np.zeros(basis.N, dtype=complex)
    if pressure_radius is not None:
        pressed = mesh.facets_satisfying(
            lambda x: (np.abs(x[1]) < _TINY) & (x[0] < pressure_radius), boundaries_only=True
        )
        side = skfem.FacetBasis(mesh, basis.elem, facets=pressed, intorder=5)
        load = load - skfem.LinearForm(lambda v, w: v[1] * w.x[0]).assemble(side)
    return _surface(basis, _solve(basis, stiffness, load, blocks, levels[0], radius))


def _assemble(basis: Basis, materials: Sequence[Any], omega: float) -> csc_matrix:
    """Assemble the stiffness less omega^2 mass; the bulk part through the eliminated pressure."""
    shape = (basis.nelems, basis.X.shape[-1])

    def spread(values: Sequence[complex]) -> np.ndarray:
        return np.broadcast_to(np.asarray(values)[:, None], shape)

    mu = spread([m.shear for m in materials])
    inertia = spread([m.density * omega**2 for m in materials])
    lame = np.array([2 * m.shear * m.poisson_ratio / (1 - 2 * m.poisson_ratio) for m in materials])

    def energy(u: Any, v: Any, w: Any) -> Any:
        du, dv, r = u.grad, v.grad, w.x[0]
        strain = du[0][0] * dv[0][0] + du[1][1] * dv[1][1] + u[0] * v[0] / r**2
        shear = (du[0][1] + du[1][0]) * (dv[0][1] + dv[1][0])
        kinetic = u[0] * v[0] + u[1] * v[1]
        return (w.mu * (2 * strain + shear) - w.inertia * kinetic) * r

    matrix = skfem.BilinearForm(energy, dtype=np.complex128).assemble(basis, mu=mu, inertia=inertia)  # type: ignore[arg-type]
    constant = basis.with_element(skfem.ElementQuad0())
    mesh = basis.mesh
    low, high = mesh.p[:, mesh.t].min(axis=1), mesh.p[:, mesh.t].max(axis=1)
    middle, half = (low + high) / 2, (high - low) / 2

    def linear(x: np.ndarray) -> list[np.ndarray]:
        return [np.ones_like(x[0]), *((x[i] - middle[i][:, None]) / half[i][:, None] for i in range(2))]

    def divergence(i: int) -> Any:
        form = skfem.BilinearForm(
            lambda u, q, w: linear(w.x)[i] * q * (u.grad[0][0] + u.grad[1][1] + u[0] / w.x[0]) * w.x[0]
        )
        return form.assemble(basis, constant)

    x, weight = np.asarray(basis.global_coordinates()), basis.dx
    functions = linear(x)
    gram = np.array([[np.sum(f * g * x[0] * weight, axis=1) for f in functions] for g in functions])
    bulk = np.linalg.inv(np.moveaxis(gram, -1, 0)) * lame[:, None, None]
    # The rows run function by function; the blocks want them element by element.
    order = np.arange(3 * basis.nelems).reshape(3, -1).T.ravel()
    pressure = vstack([divergence(i) for i in range(3)]).tocsr()[order]
    return (matrix + pressure.T @ block_diag(list(bulk), format="csr") @ pressure).tocsc()


def _solve(
    basis: Basis, stiffness: csc_matrix, load: np.ndarray, blocks: Sequence[Block], floor: float, radius: float
) -> np.ndarray:
    r, z = basis.doflocs
    along_z = np.zeros(basis.N, dtype=bool)
    along_z[basis.split_indices()[1]] = True
    held = (z < floor + _TINY) | (r > radius - _TINY) | ((r < _TINY) & ~along_z)
    u = np.zeros(basis.N, dtype=complex)
    for b in blocks:
        if b.solid is None:
            touch = (r > b.r0 - _TINY) & (r < b.r1 + _TINY) & (z > b.z0 - _TINY) & (z < b.z1 + _TINY)
            held |= touch
            u[touch & along_z] = 1.0
    free = np.flatnonzero(~held)
    rows = stiffness[free]
    factors = splu(rows[:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    u[free] = factors.solve(load[free] - rows[:, np.flatnonzero(held)] @ u[held])
    return u


def _surface(basis: Basis, u: np.ndarray) -> Surface:
    across, along = basis.split_indices()
    on = along[np.abs(basis.doflocs[1, along]) < _TINY]
    on = on[np.argsort(basis.doflocs[0, on])]
    r = basis.doflocs[0, on]
    other = across[np.abs(basis.doflocs[1, across]) < _TINY]
    other = other[np.argsort(basis.doflocs[0, other])]
    return Surface(r, u[other], u[on], int(basis.N))
