"""Solids of one file that share volume (G002), by manifold3d's boolean."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice

import numpy as np
from manifold3d import Manifold

from unitcad.geometry.arrays import extent
from unitcad.geometry.boxes import box_pairs
from unitcad.meshcheck.findings import Finding, Location, counted, point
from unitcad.meshcheck.geometry.mesh import Mesh, solid_of
from unitcad.meshcheck.rules.f_file import Deadline, Unreadable
from unitcad.meshcheck.rules.g_shells import G002

MOST = 2000
"""At most this many solids are compared."""
_PAIRS = 2000
_SHARE = 1e-6  # of the smaller volume, below which solids only touch


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed mesh, its volume, mm3, and its name in the file."""

    mesh: Mesh
    volume: float
    name: str


def overlapping(sound: Iterable[Solid], noun: str, deadline: Deadline, thick: float = 0.0) -> list[Finding]:
    """Apply G002 to pairs of `sound` solids, which a message calls by the `noun`; beyond MOST it says so.

    A common part whose mean thickness (twice its volume over its area) is below `thick` (mm) is none.
    """
    rest = iter(sound)
    compared = list(islice(rest, MOST))
    if len(compared) < 2:
        return []
    boxes = np.array([extent(solid.mesh.vertices) for solid in compared])
    low, high = boxes[:, 0], boxes[:, 1]
    made: dict[int, Manifold] = {}
    places: list[Location] = []
    pairs = box_pairs(low, high, deadline.tick)
    try:
        for a, b in pairs[:_PAIRS].tolist():
            deadline.tick()
            least = _SHARE * min(compared[a].volume, compared[b].volume)
            inner, outer = np.maximum(low[a], low[b]), np.minimum(high[a], high[b])
            if float(np.prod(outer - inner)) <= least:
                continue
            for i in {a, b} - made.keys():
                made[i] = solid_of(compared[i].mesh.vertices, compared[i].mesh.faces)
            common = made[a] ^ made[b]  # empty if manifold3d refuses one, whose faults are reported
            volume = common.volume()
            if volume > least and 2 * volume >= thick * common.surface_area():
                names = f"{compared[a].name} and {compared[b].name}"
                places.append(Location(xyz=point((inner + outer) / 2), object=names))
    except Unreadable as stop:
        stop.findings = (*_overlaps(places, noun, among=True), *stop.findings)
        raise
    return _overlaps(places, noun, among=len(pairs) > _PAIRS or next(rest, None) is not None)


def _overlaps(places: list[Location], noun: str, *, among: bool) -> list[Finding]:
    if not places:
        return []
    text = f"{counted(len(places), 'pair')} of {noun} that share volume{' among those compared' if among else ''}"
    return [G002.finding(text, len(places), places)]
