"""Instances of a 3MF build against each other: solids that share volume though each is sound by itself (G002).

3MF's core specification (4.1, 4.1.1) lets overlapping components and objects be, and says what is filled, so this is a
warning.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from unitcad.check.findings import Finding, Location, counted
from unitcad.check.limits import Deadline
from unitcad.check.mesh import Floats, Ints, extent, solid_of
from unitcad.check.rulebook import finding
from unitcad.check.shells import box_pairs

if TYPE_CHECKING:
    from manifold3d import Manifold

MOST = 2000
"""Instances compared; of more the first so many, and the message says so."""
_PAIRS = 2000
_SHARE = 1e-6  # of the smaller volume, below which solids only touch


@dataclass(frozen=True)
class Placed:
    """A sound solid in its place: vertices (n, 3) mm, faces (m, 3) outwards, volume mm3, its object's id."""

    vertices: Floats
    faces: Ints
    volume: float
    name: str


def judge(placed: Sequence[Placed], deadline: Deadline) -> list[Finding]:
    """G002 as a warning for the pairs that share volume, by manifold3d's boolean of those whose boxes do."""
    some = placed[:MOST]
    if len(some) < 2:
        return []
    boxes = [extent(solid.vertices) for solid in some]
    low, high = np.array([box[0] for box in boxes]), np.array([box[1] for box in boxes])
    solids: dict[int, Manifold] = {}
    found: list[Location] = []
    pairs = box_pairs(low, high)
    for a, b in pairs[:_PAIRS]:
        deadline.tick()
        least = min(some[a].volume, some[b].volume)
        room = float(np.prod(np.minimum(high[a], high[b]) - np.maximum(low[a], low[b])))
        if room <= _SHARE * least:
            continue
        if _shared(a, b, some, solids) > _SHARE * least:
            centre = (np.maximum(low[a], low[b]) + np.minimum(high[a], high[b])) / 2
            xyz = (float(centre[0]), float(centre[1]), float(centre[2]))
            found.append(Location(xyz=xyz, object=f"{some[a].name} and {some[b].name}"))
    if not found:
        return []
    left = len(placed) > MOST or len(pairs) > _PAIRS
    text = f"{counted(len(found), 'pair')} of instances that share volume{' among those compared' if left else ''}"
    said = finding("G002", f"{text} (3MF's fill rule says what is solid)", len(found), found)
    return [Finding(said.code, "warning", said.message, said.count, said.locations)]


def _shared(a: int, b: int, some: Sequence[Placed], solids: dict[int, Manifold]) -> float:
    """The volume that two share, mm3; 0 where manifold3d refuses one (its own faults are reported)."""
    for i in (a, b):
        if i not in solids:
            solids[i] = solid_of(some[i].vertices, some[i].faces)
    return (solids[a] ^ solids[b]).volume()
