"""A meridian plane of rings as rectangles: graded grid lines, void left out, the skin's surface split from the unit.

z upwards from the skin's surface (the unit's frame), lengths in m.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from unitcad.errors import missing_extra

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
    radius  of the body's outer border, which is fixed
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
    # Interfaces deep in the body need no fine elements: nothing changes there on a unit's scale.
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
