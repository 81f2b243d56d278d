"""The rules on one mesh, the facts that follow on the way, and solids of one file that share volume (G002)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import islice

import numpy as np
from manifold3d import Manifold

from unitcad.geometry.arrays import extent
from unitcad.geometry.boxes import box_pairs
from unitcad.meshcheck.findings import Facts, Finding, Location, counted, detail, ending, point
from unitcad.meshcheck.geometry.mesh import Mesh, representable, solid_of
from unitcad.meshcheck.geometry.topology import topology_of
from unitcad.meshcheck.rules import registry
from unitcad.meshcheck.rules.f_file import F001, Deadline, Unreadable, keeping
from unitcad.meshcheck.rules.g_shells import G002
from unitcad.meshcheck.rules.inspection import Inspection, Printer
from unitcad.meshcheck.rules.v_values import not_finite

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


@dataclass(frozen=True, eq=False)
class CheckedMesh:
    """One mesh's findings and facts; `inspection` is None where the mesh could not be inspected."""

    findings: tuple[Finding, ...]
    facts: Facts
    inspection: Inspection | None = None


def check_surface(mesh: Mesh, deadline: Deadline, *, cross: bool = True, strict: bool = False) -> CheckedMesh:
    """Apply the rules that need no printer; `cross` and `strict` are those of `Inspection`."""
    facts = Facts(triangles=len(mesh.faces), vertices=len(mesh.vertices))
    points = representable(mesh.vertices)
    # What was made 0 may be where another vertex is.
    mesh = replace(mesh, vertices=points, indexed=mesh.indexed or points is not mesh.vertices)
    if broken := not_finite(mesh):
        return CheckedMesh(in_file(broken, mesh), facts)
    if not len(mesh.faces):
        return CheckedMesh(ending([F001.finding("the mesh has no face")]), facts)
    low, high = extent(mesh.vertices[np.unique(mesh.faces)] if mesh.indexed else mesh.vertices)
    facts = replace(facts, bbox_mm=(tuple(low.tolist()), tuple(high.tolist())))
    findings: list[Finding] = []
    with keeping((), facts, lambda kept: in_file(kept, mesh)):
        part = Inspection(mesh, topology_of(mesh, deadline.tick), deadline.tick, cross, strict=strict)
    topology = part.topology
    area = float(np.sqrt(np.einsum("ij,ij->i", topology.areas, topology.areas)).sum()) / 2
    facts = replace(facts, shells=topology.n_shells, area_mm2=area, watertight=topology.watertight)
    with keeping(findings, facts, lambda kept: in_file(kept, mesh)):
        for module in registry.modules(registry.OF_MESHES):
            if hasattr(module, "check_mesh"):
                findings.extend(module.check_mesh(part))
    if part.solid:
        facts = replace(facts, volume_mm3=float(topology.volumes.sum()))
    return CheckedMesh(in_file(findings, mesh), facts, part)


def check_on_bed(part: Inspection, printer: Printer) -> tuple[Finding, ...]:
    """Apply the rules for a printer to a mesh as it stands."""
    if not len(part.topology.mesh.faces):
        return ()
    part = replace(part, printer=printer)
    findings: list[Finding] = []
    with keeping(findings, change=lambda kept: in_file(kept, part.mesh)):
        for module in registry.modules():
            if hasattr(module, "check_print"):
                findings.extend(module.check_print(part, printer))
    return in_file(findings, part.mesh)


def in_file(findings: Iterable[Finding], mesh: Mesh) -> tuple[Finding, ...]:
    """Return the findings with each location's faces as the file has them, and their line and object where known."""
    meshes = detail().meshes
    if meshes is not None and not any(known is mesh for known in meshes):
        meshes.append(mesh)
    return tuple(
        replace(item, locations=tuple(_with_file_places(_with_middle(place, mesh), mesh) for place in item.locations))
        for item in findings
    )


def _with_middle(place: Location, mesh: Mesh) -> Location:
    """Return the location with the middle of its triangles and, where findings are drawn, the number of their mesh."""
    if place.mesh is not None or (place.centre is not None and place.region is None):
        return place
    whole, meshes = place.region is not None, detail().meshes
    region = place.region if whole else np.array(place.faces, np.int64)
    centre = place.centre or place.xyz
    if place.centre is None and len(region) and (whole or len(region) > 1 or centre is None):
        low, high = extent(mesh.vertices[mesh.faces[region]].reshape(-1, 3))
        centre = point((low + high) / 2)
    if meshes is None or (not len(region) and centre is None):
        return replace(place, region=None, centre=centre)
    number = next(i for i, known in enumerate(meshes) if known is mesh)
    return replace(place, region=region, mesh=number, centre=centre)


def _with_file_places(place: Location, mesh: Mesh) -> Location:
    """Return the location with its triangles' faces, line, part and object as the file has them."""
    place, source = replace(place, object=place.object or mesh.name), mesh.source
    if source is None:
        return place
    place = replace(place, part=place.part or source.part)
    if place.face is None:
        return place
    faces = [face if source.polygons is None else int(source.polygons[face]) for face in place.faces]
    names = dict.fromkeys(name for face in faces if (name := source.object(face)))
    return replace(
        place,
        face=faces[0],
        faces=tuple(dict.fromkeys(faces)),
        line=source.line(faces[0]) if place.line is None else place.line,
        object=place.object or " and ".join(names) or None,
    )
