"""All geometry rules on one mesh: values, topology, crossing, shells, and the facts that fall out on the way."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from unitcad.check import crossing, overlap, shells, topology
from unitcad.check.detail import detail
from unitcad.check.findings import Facts, Finding, Location, counted, ending
from unitcad.check.limits import Deadline, keeping
from unitcad.check.mesh import LARGEST, Mesh, extent, representable
from unitcad.check.rulebook import finding
from unitcad.check.source import Source
from unitcad.check.topology import Topology


@dataclass(frozen=True)
class Judged:
    """One mesh's findings and facts; `topology` is None where the mesh has no face left."""

    findings: tuple[Finding, ...]
    facts: Facts
    topology: Topology | None


def judge_mesh(mesh: Mesh, deadline: Deadline, *, cross: bool = True) -> Judged:
    """Apply the V, T and G rules to one mesh; `cross=False` leaves self-crossing out."""
    facts = Facts(triangles=len(mesh.faces), vertices=len(mesh.vertices))
    mesh = replace(mesh, vertices=representable(mesh.vertices))
    finite = np.asarray((np.abs(mesh.vertices) <= LARGEST).all(axis=1))
    if not finite.all():
        bad = np.flatnonzero(~finite[mesh.faces].all(axis=1))
        places = (Location(face=int(i), object=mesh.name) for i in bad)
        wrong = len(finite) - int(finite.sum())
        text = counted(wrong, "non-finite vertex", "non-finite vertices")
        return Judged(in_file(ending([finding("V001", text, len(bad) or 1, places)]), mesh), facts, None)
    if not len(mesh.faces):
        return Judged(ending([finding("F001", "the mesh has no face")]), facts, None)
    low, high = extent(mesh.vertices)
    facts = replace(facts, bbox_mm=(tuple(low.tolist()), tuple(high.tolist())))
    with keeping((), facts, lambda kept: in_file(kept, mesh)):
        found = topology.judge(mesh, deadline)
    findings = list(found.findings)
    area = float(np.sqrt(np.einsum("ij,ij->i", found.areas, found.areas)).sum()) / 2
    facts = replace(facts, shells=found.n_shells, area_mm2=area, watertight=found.watertight)
    with keeping(findings, facts, lambda kept: in_file(kept, mesh)):
        crossings = crossing.judge(found.as_stored(), deadline) if cross and len(found.kept) else crossing.Crossings()
        findings += crossings.findings
        findings += overlap.judge(found)
        judged = shells.judge(found, crossings.crossed, crossings.touching, deadline)
    findings += judged.findings
    if found.watertight and found.oriented:
        facts = replace(facts, volume_mm3=float(judged.volumes.sum()))
    return Judged(in_file(findings, mesh), facts, found)


def in_file(findings: Iterable[Finding], mesh: Mesh) -> tuple[Finding, ...]:
    """The findings with the faces of each location as the file has them, and their line and object where known."""
    meshes = detail().meshes
    if meshes is not None and not any(known is mesh for known in meshes):
        meshes.append(mesh)
    drawn = tuple(replace(item, locations=tuple(_drawn(place, mesh) for place in item.locations)) for item in findings)
    source = mesh.source
    if source is None:
        return drawn
    return tuple(replace(item, locations=tuple(_located(place, source) for place in item.locations)) for item in drawn)


def _drawn(place: Location, mesh: Mesh) -> Location:
    """The location with the middle of its triangles and, where somebody draws, the number of their mesh."""
    if place.mesh is not None or (place.centre is not None and place.region is None):
        return place
    whole, meshes = place.region is not None, detail().meshes
    region = place.region if whole else np.array(place.faces, np.int64)
    centre = place.xyz
    if place.centre is not None:
        centre = place.centre
    elif len(region) and (whole or len(region) > 1 or centre is None):
        low, high = extent(mesh.vertices[mesh.faces[region]].reshape(-1, 3))
        x, y, z = ((low + high) / 2).tolist()
        centre = (x, y, z)
    if meshes is None or (not len(region) and centre is None):
        return replace(place, region=None, centre=centre)
    number = next(i for i, known in enumerate(meshes) if known is mesh)
    return replace(place, region=region, mesh=number, centre=centre)


def _located(place: Location, source: Source) -> Location:
    """The location with its triangles' faces, line, part and object as the file has them."""
    part = place.part or source.part
    if place.face is None:
        return replace(place, part=part)
    faces = [face if source.polygons is None else int(source.polygons[face]) for face in place.faces]
    names = dict.fromkeys(name for face in faces if (name := source.object(face)))
    return replace(
        place,
        face=faces[0],
        faces=tuple(dict.fromkeys(faces)),
        line=source.line(faces[0]) if place.line is None else place.line,
        part=part,
        object=place.object or " and ".join(names) or None,
    )
