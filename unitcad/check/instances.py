"""Instances of a 3MF build: in their places before a printer, and against each other.

Solids may share volume though each is sound by itself (G002). 3MF's core specification (4.1, 4.1.1) lets overlapping
components and objects be, and says what is filled, so this is a warning.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from unitcad.catalogue import Printer
from unitcad.check import topology
from unitcad.check.findings import Finding, Location, counted
from unitcad.check.limits import Deadline, Unreadable, keeping
from unitcad.check.mesh import Floats, Ints, Mesh, extent, solid_of
from unitcad.check.model_data import LINE, Model, Object
from unitcad.check.rulebook import finding
from unitcad.check.rules_mesh import in_file
from unitcad.check.scale import UNITS_MM
from unitcad.check.shells import box_pairs
from unitcad.check.source import Source

if TYPE_CHECKING:
    from manifold3d import Manifold

Key = tuple[str, int]
"""A part of the package and the id of an object in it."""

MOST = 2000
"""Instances compared; of more the first so many, and the message says so."""
_PAIRS = 2000
_SHARE = 1e-6  # of the smaller volume, below which solids only touch


@dataclass(frozen=True)
class Instance:
    """An object of the build with its whole transform (4, 3), in the model's unit."""

    key: Key
    matrix: Floats


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
    pairs = box_pairs(low, high, deadline)
    try:
        for a, b in pairs[:_PAIRS].tolist():
            deadline.tick()
            least = min(some[a].volume, some[b].volume)
            room = float(np.prod(np.minimum(high[a], high[b]) - np.maximum(low[a], low[b])))
            if room <= _SHARE * least:
                continue
            if _shared(a, b, some, solids) > _SHARE * least:
                centre = (np.maximum(low[a], low[b]) + np.minimum(high[a], high[b])) / 2
                xyz = (float(centre[0]), float(centre[1]), float(centre[2]))
                found.append(Location(xyz=xyz, object=f"{some[a].name} and {some[b].name}"))
    except Unreadable as stop:
        stop.findings = (*_said(found, among=True), *stop.findings)
        raise
    return _said(found, among=len(placed) > MOST or len(pairs) > _PAIRS)


def _said(found: list[Location], *, among: bool) -> list[Finding]:
    if not found:
        return []
    text = f"{counted(len(found), 'pair')} of instances that share volume{' among those compared' if among else ''}"
    said = finding("G002", f"{text} (3MF's fill rule says what is solid)", len(found), found)
    return [Finding(said.code, "warning", said.message, said.count, said.locations)]


def _shared(a: int, b: int, some: Sequence[Placed], solids: dict[int, Manifold]) -> float:
    """The volume that two share, mm3; 0 where manifold3d refuses one (its own faults are reported)."""
    for i in (a, b):
        if i not in solids:
            solids[i] = solid_of(some[i].vertices, some[i].faces)
    return (solids[a] ^ solids[b]).volume()


def mesh_of(found: Object, part: str, factor: float, matrix: Floats | None = None) -> Mesh:
    """The object, of a part of the package, in its own place or that of an instance; `factor` mm a unit."""
    assert found.vertices is not None
    assert found.triangles is not None
    points = found.vertices if matrix is None else found.vertices @ matrix[:3] + matrix[3]
    faces = found.triangles[:, :3].astype(np.int32)
    if matrix is not None and np.linalg.det(matrix[:3]) < 0:
        faces = faces[:, ::-1]
    source = Source(lines=found.triangles[:, LINE], part=part)
    return Mesh(points * factor, np.ascontiguousarray(faces), name=str(found.id), source=source)


def printed(
    models: dict[str, Model], instances: Sequence[Instance], printer: Printer, deadline: Deadline
) -> list[Finding]:
    """The printer's rules for each instance; those that differ by their place on the bed alone are judged once."""
    from unitcad.check import printing

    found: list[Finding] = []
    judged: dict[tuple[Key, bytes, float], tuple[Floats, tuple[Finding, ...]]] = {}
    for instance in instances:
        thing = models[instance.key[0]].resources[instance.key[1]]
        assert isinstance(thing, Object)
        if thing.type != "model" or thing.triangles is None or not len(thing.triangles):
            continue
        factor = UNITS_MM.get(models[instance.key[0]].unit, 1.0)
        alike = instance.key, instance.matrix[:3].tobytes(), float(instance.matrix[3, 2])
        if alike not in judged:
            mesh = mesh_of(thing, instance.key[0], factor, instance.matrix)
            with keeping(found), keeping(change=lambda kept, mesh=mesh: in_file(kept, mesh)):
                with keeping(change=_last):  # what the topology rules found was reported with the object
                    shape = topology.judge(mesh, deadline)
                of = printing.judge(shape, printer, deadline)
            judged[alike] = instance.matrix[3], in_file(of, mesh)
        begin, of = judged[alike]
        found += _shifted(of, (instance.matrix[3] - begin) * factor)
    return found


def _last(findings: Iterable[Finding]) -> Iterator[Finding]:
    return (item for item in findings if item.ends)


def _shifted(findings: Sequence[Finding], by: Floats) -> Iterator[Finding]:
    """The findings of an instance that lies elsewhere on the bed."""
    if not by.any():
        yield from findings
        return
    for item in findings:
        places = (
            replace(place, xyz=tuple(float(v) for v in place.xyz + by)) if place.xyz else place
            for place in item.locations
        )
        yield replace(item, locations=tuple(places))
