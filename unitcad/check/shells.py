"""Shells against each other: inversion (T008), overlap (G002), cavities (G006), zero volume (G007), specks (G010)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.check.findings import Finding, Location, counted, number
from unitcad.check.limits import Deadline
from unitcad.check.mesh import Floats, Ints, solid_of
from unitcad.check.rulebook import finding
from unitcad.check.scale import specks
from unitcad.check.topology import Topology, diagonals

FLAT = 1e-6  # G007: a shell's volume over its area times its diagonal
_BLOCK = 500_000


@dataclass(frozen=True)
class Shells:
    """Signed volume (mm3) and box of each shell, and what the rules say of them."""

    volumes: Floats
    low: Floats
    high: Floats
    findings: tuple[Finding, ...]


def judge(topology: Topology, crossed: bool, touching: Ints, deadline: Deadline) -> Shells:
    """Apply the rules; `crossed`: some faces cross; `touching` (k, 2): pairs of shells whose faces meet."""
    mesh, labels, n = topology.mesh, topology.shells, topology.n_shells
    vertices, faces = mesh.vertices, mesh.faces
    volumes, low, high, sound = topology.volumes, topology.low, topology.high, topology.closed
    found: list[Finding] = []
    if n == 0:
        found.append(finding("G007", "no face has an area"))
    if not sound.any():
        return Shells(volumes, low, high, tuple(found))
    area = np.bincount(labels, np.sqrt(np.einsum("ij,ij->i", topology.areas, topology.areas)), n) / 2
    flat = np.abs(volumes) <= FLAT * area * diagonals(low, high)
    which = np.flatnonzero(sound & flat)
    if len(which):
        worst = which[np.argmax(area[which])]
        text = f"volume {number(volumes[worst], 3)} mm3 over {number(area[worst], 3)} mm2 of surface"
        found.append(finding("G007", text, len(which), (_where(topology, low, high, i) for i in which.tolist())))
    sound = sound & ~flat
    found += specks(low, high, sound & (volumes > 0))
    depth = np.zeros(n, int)
    overlaps: list[tuple[int, int]] = []
    if n > 1:
        first = np.full(n, -1)
        first[labels[::-1]] = np.arange(len(labels))[::-1]
        pairs = box_pairs(low, high)
        meeting = {(int(a), int(b)) for a, b in touching} | {(int(b), int(a)) for a, b in touching}
        groups = _faces_by_shell(labels, n)
        for a, b in pairs:
            deadline.tick()
            if not (sound[a] and sound[b]):
                continue
            if (a, b) in meeting:
                least = min(abs(volumes[a]), abs(volumes[b]))
                common = _shared(topology, groups, a, b, volumes)
                if volumes[a] * volumes[b] > 0 and common > 1e-6 * least:
                    overlaps.append((a, b))
                elif common > (1 - 1e-6) * least:  # a cavity that touches the wall
                    depth[a if abs(volumes[a]) < abs(volumes[b]) else b] += 1
                continue
            for inner, outer in ((a, b), (b, a)):
                if (low[inner] >= low[outer]).all() and (high[inner] <= high[outer]).all():
                    point = vertices[faces[groups[inner][0], 0]]
                    depth[inner] += winding_number(vertices, faces[groups[outer]], point) != 0
    for a in range(n):
        if sound[a] and depth[a] % 2 and volumes[a] > 0:
            overlaps.append((a, a))
    if overlaps:
        places = (_where(topology, low, high, *pair) for pair in overlaps)
        text = f"{counted(len(overlaps), 'pair')} of shells that share volume"
        found.append(finding("G002", text, len(overlaps), places))
    inverted = [i for i in range(n) if depth[i] % 2 == 0 and volumes[i] < 0 and sound[i]]
    if inverted and not (crossed and n == 1):
        places = (_where(topology, low, high, i) for i in inverted)
        found.append(finding("T008", counted(len(inverted), "inverted shell"), len(inverted), places))
    hollow = [i for i in range(n) if depth[i] % 2 and volumes[i] < 0 and sound[i]]
    if hollow:
        places = (_where(topology, low, high, i) for i in hollow)
        found.append(finding("G006", counted(len(hollow), "closed cavity", "closed cavities"), len(hollow), places))
    return Shells(volumes, low, high, tuple(found))


def winding_number(vertices: Floats, faces: Ints, point: Floats) -> int:
    """How often the closed surface winds round `point`: the sum of solid angles over 4 pi (Van Oosterom, 1983)."""
    total = 0.0
    for start in range(0, len(faces), _BLOCK):
        a, b, c = (vertices[faces[start : start + _BLOCK, k]] - point for k in range(3))
        la, lb, lc = (np.sqrt(np.einsum("ij,ij->i", v, v)) for v in (a, b, c))
        top = np.einsum("ij,ij->i", a, np.cross(b, c))
        dot = np.einsum
        low = la * lb * lc + dot("ij,ij->i", a, b) * lc + dot("ij,ij->i", b, c) * la + dot("ij,ij->i", c, a) * lb
        total += float(np.arctan2(top, low).sum())
    return round(total / (2 * np.pi))


def _where(topology: Topology, low: Floats, high: Floats, *shells: int) -> Location:
    """The middle of what the boxes of the shells have in common, with all faces of the shells."""
    which = list(shells)
    x, y, z = ((low[which].max(axis=0) + high[which].min(axis=0)) / 2).tolist()
    region = topology.kept[np.isin(topology.shells, which)]
    return Location(face=int(region[0]), xyz=(x, y, z), object=topology.mesh.name, region=region)


def _faces_by_shell(labels: Ints, n: int) -> list[Ints]:
    order = np.argsort(labels, kind="stable")
    return np.split(order, np.cumsum(np.bincount(labels, minlength=n))[:-1])


def box_pairs(low: Floats, high: Floats) -> list[tuple[int, int]]:
    """Pairs of shells whose boxes meet, by a sweep along x; at most a few for parts that were laid out apart."""
    order = np.argsort(low[:, 0], kind="stable")
    pairs = []
    for place, i in enumerate(order):
        later = order[place + 1 :]
        later = later[: np.searchsorted(low[later, 0], high[i, 0], side="right")]
        meet = ((low[later] <= high[i]) & (high[later] >= low[i])).all(axis=1)
        pairs += [(min(int(i), int(j)), max(int(i), int(j))) for j in later[meet]]
    return sorted(pairs)


def _shared(topology: Topology, groups: list[Ints], a: int, b: int, volumes: Floats) -> float:
    """The volume that two shells share, mm3, by manifold3d's boolean.

    Shells that face inwards are turned first; one that manifold3d refuses gives 0 (its own faults are reported).
    """
    solids = []
    for i in (a, b):
        faces = topology.mesh.faces[groups[i]]
        used, local = np.unique(faces, return_inverse=True)
        local = local.reshape(-1, 3)
        if volumes[i] < 0:
            local = local[:, ::-1]
        solid = solid_of(topology.mesh.vertices[used], local)
        if solid.is_empty():
            return 0.0
        solids.append(solid)
    return (solids[0] ^ solids[1]).volume()
