"""Shells against each other: which lie inside which, and which share volume."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from manifold3d import Manifold

from unitcad.geometry.arrays import Bools, Floats, Ints, among
from unitcad.geometry.boxes import Interrupted, Tick, TooMany, box_pairs
from unitcad.meshcheck.geometry.crossings import Crossings
from unitcad.meshcheck.geometry.mesh import float32_steps, solid_of
from unitcad.meshcheck.geometry.rays import winding_numbers
from unitcad.meshcheck.geometry.resolution import STEPS
from unitcad.meshcheck.geometry.topology import Topology, diagonals

FLAT = 1e-6
"""Volume of a shell without thickness, as part of its area times its diagonal."""
_BOOLEANS = 100_000  # pairs of shells
_POINTS = 3  # of a shell that are looked for in another
_INWARDS = 0.1  # of the mean thickness: how far those points lie behind the surface


@dataclass(eq=False)
class Nesting:
    """The relations of a mesh's shells as far as they were found; `stopped`: why not all were, None if they were.

    `flat` are closed shells without volume, `sound` the other closed ones. `depth` counts the sound shells that a shell
    lies in. `overlaps` are pairs that share volume; a shell that faces outwards inside another one is paired with
    itself.
    """

    area: Floats
    flat: Bools
    sound: Bools
    depth: Ints
    overlaps: list[tuple[int, int]] = field(default_factory=list)
    stopped: Interrupted | None = None


def nesting_of(topology: Topology, crossings: Crossings, tick: Tick) -> Nesting:
    """Relate the shells of a mesh to each other."""
    n, volumes = topology.n_shells, topology.volumes
    size = np.sqrt(np.einsum("ij,ij->i", topology.areas, topology.areas))
    area = np.bincount(topology.shells, size, n) / 2
    flat = topology.closed & (np.abs(volumes) <= FLAT * area * diagonals(topology.low, topology.high))
    found = Nesting(area, flat, topology.closed & ~flat, np.zeros(n, int))
    if n > 1 and found.sound.any():
        try:
            if crossings.contact.full:
                raise TooMany(crossings.contact.most, "shells")
            _relate(topology, crossings, size, found, tick)
        except Interrupted as stop:
            found.stopped = stop
            return found
    inner = np.flatnonzero(found.sound & (found.depth % 2 == 1) & (volumes > 0))
    found.overlaps += [(one, one) for one in inner.tolist()]
    return found


def _relate(topology: Topology, crossings: Crossings, size: Floats, found: Nesting, tick: Tick) -> None:
    n, volumes, low, high = topology.n_shells, topology.volumes, topology.low, topology.high
    pairs = box_pairs(low, high, tick)
    pairs = pairs[found.sound[pairs].all(axis=1)]
    rounding = STEPS * float32_steps(np.stack([low, high], axis=1))[pairs].max(axis=1, initial=0)[:, None]
    one, other = np.ascontiguousarray(pairs.T)
    cross = among(one * n + other, crossings.crossing_shells())
    touch = among(one * n + other, crossings.touching_shells()) & ~cross
    alike = volumes[one] * volumes[other] > 0
    found.overlaps += [(a, b) for a, b in pairs[cross & alike].tolist()]
    inside = ((low[one] >= low[other] - rounding) & (high[one] <= high[other] + rounding)).all(axis=1)
    outside = ((low[one] <= low[other] + rounding) & (high[one] >= high[other] - rounding)).all(axis=1)
    either = np.zeros(len(pairs), bool)
    order = np.lexsort((-size, topology.shells))
    count = np.bincount(topology.shells, minlength=n)
    first = np.cumsum(count) - count
    by_shell = topology.mesh.faces[order]
    for inner, outer, within in ((one, other, inside), (other, one, outside)):
        some = np.flatnonzero(within & ~cross & ~either)  # of two in one place the first is in the other
        shell, around = inner[some], outer[some]
        votes = np.zeros(len(some), int)
        for k in range(_POINTS):
            face = order[first[shell] + np.minimum(k, count[shell] - 1)]
            normal = topology.areas[face] / np.maximum(size[face], 1e-300)[:, None]
            behind = (_INWARDS * volumes[shell] / found.area[shell])[:, None] * normal
            points = topology.mesh.vertices[topology.mesh.faces[face]].mean(axis=1) - behind
            votes += winding_numbers(topology.mesh.vertices, by_shell, first[around], count[around], points, tick) != 0
        found.depth += np.bincount(shell[2 * votes > _POINTS], minlength=n)
        either[some[2 * votes > _POINTS]] = True
    room = np.minimum(high[one], high[other]) - np.maximum(low[one], low[other])
    beside = touch & alike & ~either & (room > rounding).all(axis=1)
    _compare(topology, pairs[beside], by_shell, (first, count), rounding[beside, 0], found, tick)


def _compare(
    topology: Topology,
    pairs: Ints,
    by_shell: Ints,
    groups: tuple[Ints, Ints],
    least: Floats,
    found: Nesting,
    tick: Tick,
) -> None:
    """Add to the overlaps those pairs of shells whose common part is thicker than `least` (k,) mm: 2 volume / area."""
    if len(pairs) > _BOOLEANS:
        raise TooMany(_BOOLEANS, "shells")
    solids: dict[int, Manifold] = {}
    before = -1
    for (a, b), thickness in zip(pairs.tolist(), least.tolist(), strict=True):
        tick()
        if a != before:  # pairs are sorted: what comes before it comes no more
            before, solids = a, {i: solid for i, solid in solids.items() if i >= a}
        for i in {a, b} - solids.keys():
            own = by_shell[groups[0][i] : groups[0][i] + groups[1][i]]
            used, local = np.unique(own[:, :: -1 if topology.volumes[i] < 0 else 1], return_inverse=True)
            solids[i] = solid_of(topology.mesh.vertices[used], local.reshape(-1, 3))  # empty if manifold3d refuses it
        common = solids[a] ^ solids[b]
        if 2 * common.volume() > thickness * common.surface_area():
            found.overlaps.append((a, b))
