"""Checks of one mesh, and of the builds of a 3MF file and the bodies of a STEP file.

Solids may share volume though each is sound by itself (G002). 3MF's core specification (4.1, 4.1.1) permits overlapping
components and objects, and defines what is filled, so this is a warning.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import compress, islice
from pathlib import Path

import numpy as np
from manifold3d import Manifold

from unitcad.geometry.arrays import Floats, Ints, cross, extent
from unitcad.geometry.boxes import box_pairs
from unitcad.meshcheck.findings import Facts, Finding, Location, counted, drawn_meshes, ending, number, point
from unitcad.meshcheck.geometry.mesh import LARGEST, Mesh, representable, solid_of, weld_exact
from unitcad.meshcheck.geometry.topology import diagonals, topology_of
from unitcad.meshcheck.readers import threemf_schema as schema
from unitcad.meshcheck.readers.read_3mf import SOLID, Build, Instance, Key, read_build
from unitcad.meshcheck.readers.read_step import Measured, measured
from unitcad.meshcheck.readers.threemf_package import open_package
from unitcad.meshcheck.rules import g_shells, registry, s_scale, v_values
from unitcad.meshcheck.rules.f_file import F001, F012, Deadline, Unreadable, keeping
from unitcad.meshcheck.rules.g_crossing import G001
from unitcad.meshcheck.rules.g_shells import G002, G007, T008, expected
from unitcad.meshcheck.rules.inspection import Inspection, Options, Printer
from unitcad.meshcheck.rules.s_scale import likely_unit
from unitcad.meshcheck.rules.v_values import V001, not_finite

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


def check_surface(mesh: Mesh, deadline: Deadline, *, strict: bool = False) -> CheckedMesh:
    """Apply the rules that need no printer; `strict` is that of `Inspection`."""
    facts = Facts(triangles=len(mesh.faces), vertices=len(mesh.vertices))
    points = representable(mesh.vertices)
    # What was made 0 may be where another vertex is.
    mesh = replace(mesh, vertices=points, indexed=mesh.indexed or points is not mesh.vertices)
    if broken := not_finite(mesh):
        return CheckedMesh(in_file(broken, mesh), facts)
    if not len(mesh.faces):
        return CheckedMesh(ending([F001.finding("the mesh has no face")]), facts)
    low, high = extent(mesh.vertices[mesh.faces.reshape(-1)] if mesh.indexed else mesh.vertices)
    facts = replace(facts, bbox_mm=(tuple(low.tolist()), tuple(high.tolist())))
    findings: list[Finding] = []
    with keeping((), facts, lambda kept: in_file(kept, mesh)):
        part = Inspection(mesh, topology_of(mesh, deadline.tick), deadline.tick, strict=strict)
    topology = part.topology
    area = float(np.sqrt(np.einsum("ij,ij->i", topology.areas, topology.areas)).sum()) / 2
    facts = replace(facts, shells=topology.n_shells, area_mm2=area, watertight=topology.watertight)
    with keeping(findings, facts, lambda kept: in_file(kept, mesh)):
        for module in registry.modules():
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
    meshes = drawn_meshes()
    if meshes is not None and not any(known is mesh for known in meshes):
        meshes.append(mesh)
    return tuple(
        replace(item, locations=tuple(_with_file_places(_drawn(place, mesh), mesh) for place in item.locations))
        for item in findings
    )


def _drawn(place: Location, mesh: Mesh) -> Location:
    """Return the location with its middle and, where findings are drawn, its triangles and the number of their mesh."""
    if place.mesh is not None or place.centre is not None:
        return place
    meshes = drawn_meshes()
    region = place.region if place.region is not None else np.array(place.faces, np.int64)
    centre = place.xyz
    if len(region) and (place.region is not None or len(region) > 1 or centre is None):
        low, high = extent(mesh.vertices[mesh.faces[region]].reshape(-1, 3))
        centre = point((low + high) / 2) if np.isfinite([low, high]).all() else None
    if meshes is None or (not len(region) and place.xyz is None):
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


# The core specification, 4.1 and 4.1.1, tells consumers to accept these and defines them (positive fill rule).
_FILLED = {"G001", "G002", "G008"}
# It asks for two faces at each edge, by the indices of vertices.
_MANIFOLD = {"T003", "T006"}


def check_3mf(data: memoryview, options: Options, deadline: Deadline) -> tuple[list[Finding], Facts]:
    """Return all findings about a 3MF file and the facts of its build."""
    package = open_package(data, options.limits, deadline, strict=options.strict_3mf)
    try:
        with keeping(package.findings):
            build = read_build(package, options.limits)
            found, facts = _geometry(build, options, deadline, package.findings)
            findings = list(found)
    except Unreadable as stop:  # its facts are one object's
        findings, facts = list(stop.findings), Facts()
    for i, item in enumerate(findings):
        places = (replace(place, part=place.part and package.shown(place.part)) for place in item.locations)
        findings[i] = replace(item, locations=tuple(places))
    return findings, facts


def placed_meshes(data: memoryview, options: Options, deadline: Deadline) -> list[tuple[Floats, Ints]]:
    """Return vertices (n, 3), mm, and faces (m, 3) of the instances of a 3MF. Raises `Unreadable`."""
    build = read_build(open_package(data, options.limits, deadline), options.limits)
    meshes = [] if build is None else [one.mesh(placed=True) for one in build.instances]
    return [(mesh.vertices, mesh.faces) for mesh in meshes if mesh.faces.max(initial=-1) < len(mesh.vertices)]


def _measure_turned(instance: Instance) -> tuple[Floats, float, float]:
    """Measure an object under the linear part of its transform: box (2, 3) mm, area mm2, and the factor on its volume.

    Done once for all instances that differ by a shift: adding it to the box rounds as it does every vertex.
    """
    linear = instance.matrix[:3]
    with np.errstate(all="ignore"):
        points = (instance.triangles.vertices @ linear) * instance.unit_mm
        corners = instance.triangles.rows[:, :3]
        a, b, c = (points[corner] for corner in corners.T)
        area = float(np.linalg.norm(cross(b - a, c - a), axis=1).sum()) / 2
        return np.stack(extent(np.concatenate([a, b, c]))), area, abs(float(np.linalg.det(linear)))


def _geometry(
    build: Build | None, options: Options, deadline: Deadline, findings: list[Finding]
) -> tuple[Sequence[Finding], Facts]:
    """Add the findings of the geometry rules in the built objects, and between their instances."""
    if build is None or any(item.code in ("P011", "V001", "F004") for item in findings):
        return ending(findings), Facts()
    instances = [instance for instance in build.instances if len(instance.triangles.rows)]
    if not instances:
        return ending(findings), Facts(triangles=0, vertices=0, shells=0)
    checked: dict[Key, CheckedMesh] = {}
    turned: dict[tuple[Key, bytes], tuple[Floats, float, float]] = {}
    for instance in instances:
        if instance.key not in checked:
            checked[instance.key] = _check_object(instance, options, deadline)
            findings += checked[instance.key].findings
        if instance.linear not in turned:
            turned[instance.linear] = _measure_turned(instance)
        deadline.tick()
    each = [checked[instance.key].facts for instance in instances]
    sizes, areas, scales = zip(*(turned[instance.linear] for instance in instances), strict=True)
    boxes = np.stack(sizes)
    with np.errstate(all="ignore"):
        corners = boxes + np.stack([instance.shift for instance in instances])[:, None]
    beyond = ~(np.abs(corners) <= LARGEST).all(axis=(1, 2))
    if beyond.any():
        worst = instances[int(beyond.argmax())].object.id
        findings.append(V001.finding(f"an instance of object {worst} reaches beyond the float32 numbers"))
        return ending(findings), Facts()
    findings += v_values.too_far(corners, diagonals(boxes[:, 0], boxes[:, 1]))
    findings += g_shells.specks(corners[:, 0], corners[:, 1], np.ones(len(corners), bool))
    volumes = [(facts.volume_mm3 or 0.0) * scale for facts, scale in zip(each, scales, strict=True)]
    whole = Facts(
        triangles=sum(facts.triangles or 0 for facts in each),
        vertices=sum(facts.vertices or 0 for facts in each),
        shells=sum(facts.shells or 0 for facts in each),
        volume_mm3=sum(volumes) if all(facts.volume_mm3 is not None for facts in each) else None,
        area_mm2=sum(areas),
        bbox_mm=(point(corners[:, 0].min(axis=0)), point(corners[:, 1].max(axis=0))),
        watertight=all(facts.watertight for facts in each),
    )
    solids = ((facts.watertight and volume > 0) for facts, volume in zip(each, volumes, strict=True))
    sound = (
        Solid(instance.mesh(placed=True), volume, str(instance.object.id))
        for instance, volume in compress(zip(instances, volumes, strict=True), solids)
    )
    with keeping(change=_filled):
        findings += _filled(overlapping(sound, "instances", deadline))
    findings += s_scale.likely_unit(whole, build.unit)
    findings += g_shells.expected(whole.shells, options.shells)
    if options.printer is not None:
        findings += check_printability(instances, options.printer, deadline)
    return findings, whole


def _check_object(instance: Instance, options: Options, deadline: Deadline) -> CheckedMesh:
    """Apply the geometry rules to one object, if it must be a solid and no slices stand in for its mesh."""
    mesh, one = instance.mesh(placed=False), instance.object
    if one.type not in SOLID or one.attributes.get(f"{schema.SLICE} meshresolution") == "lowres":
        return CheckedMesh((), Facts(triangles=len(mesh.faces), vertices=len(mesh.vertices)))
    judged = partial(_filled, strict=options.strict_3mf)
    with keeping(change=judged):
        checked = check_surface(mesh, deadline, strict=options.strict)
    return replace(checked, findings=tuple(judged(checked.findings)))


def _filled(findings: Iterable[Finding], strict: bool = False) -> Iterator[Finding]:
    """Return the findings, as warnings those that 3MF settles by its fill rule; `strict`: forbidden ones as errors."""
    for item in findings:
        if strict and item.code in _MANIFOLD:
            yield replace(item, severity="error", message=f"{item.message} (3MF's core specification, 4.1, forbids it)")
            continue
        if item.code in _FILLED and item.severity == "error":
            yield replace(item, severity="warning", message=f"{item.message} (3MF's fill rule says what is solid)")
        else:
            yield item


def check_printability(instances: Sequence[Instance], printer: Printer, deadline: Deadline) -> list[Finding]:
    """Apply the printer's rules to instances; those that differ by their place on the bed alone are checked once."""
    findings: list[Finding] = []
    checked: dict[tuple[Key, bytes, float], tuple[Floats, tuple[Finding, ...]]] = {}
    for instance in instances:
        if instance.object.type != "model":
            continue
        alike = *instance.linear, float(instance.matrix[3, 2])
        if alike not in checked:
            mesh = instance.mesh(placed=True)
            with keeping(findings):
                part = Inspection(mesh, topology_of(mesh, deadline.tick), deadline.tick)
                checked[alike] = instance.shift, check_on_bed(part, printer)
        begin, of = checked[alike]
        findings += _shifted(of, instance.shift - begin)
    return findings


def _shifted(findings: Sequence[Finding], by: Floats) -> Iterator[Finding]:
    """Return the findings of an instance that lies elsewhere on the bed."""
    for item in findings:
        places = (_moved(place, by) for place in item.locations)
        yield replace(item, locations=tuple(places))


def _moved(place: Location, by: Floats) -> Location:
    xyz, centre = (None if at is None else point(np.add(at, by)) for at in (place.xyz, place.centre))
    return replace(place, xyz=xyz, centre=centre)


def check_step(path: Path, data: memoryview, options: Options, deadline: Deadline) -> tuple[list[Finding], Facts]:
    """Return findings about a STEP file's text and, with OCP there, about its solids."""
    step = measured(path, data, options.limits.seconds)
    findings: list[Finding] = []
    if not step.valid:
        findings.append(G001.finding("the B-rep is not valid by BRepCheck"))
    facts = Facts(
        shells=step.solids,
        volume_mm3=step.volume,
        area_mm2=step.area,
        bbox_mm=step.box,
        watertight=step.solids > 0,
    )
    if not step.solids:
        findings.append(G007.finding("no solid in the file"))
    elif step.volume < 0:
        findings.append(T008.finding(f"volume {number(step.volume)} mm3"))
    findings += expected(step.solids, options.shells, "solid")
    findings += likely_unit(facts, None)
    with keeping(findings, facts):
        options.limits.check_faces(sum(len(faces) for _, faces in step.meshes))
        findings += _by_mesh(step, options, deadline)
    return findings, facts


def _by_mesh(step: Measured, options: Options, deadline: Deadline) -> Iterator[Finding]:
    """Apply G002 to the solids and the rules for a printer to them together, or say which of that was not done."""
    solids, opened = list[Solid](), 0
    for place, (vertices, faces) in enumerate(step.meshes, 1):
        topology = topology_of(_mesh([(vertices, faces)]), deadline.tick)
        if topology.watertight and topology.oriented:
            solids.append(Solid(topology.mesh, abs(float(topology.volumes.sum())), f"solid {place}"))
        else:
            opened += 1
    if opened:
        text = f"{counted(opened, 'solid')} without a closed mesh; overlap (G002) and printability (D) are not judged"
        yield F012.finding(f"OCCT makes {text}", opened, severity="warning")
    yield from overlapping(solids, "solids", deadline, thick=2 * step.tolerance)
    if options.printer is not None and step.meshes:
        whole = _mesh(step.meshes)
        part = Inspection(whole, topology_of(whole, deadline.tick), deadline.tick)
        for item in check_on_bed(part, options.printer):
            places = (replace(place, face=None, faces=()) for place in item.locations)  # STEP has no such faces
            yield replace(item, locations=tuple(places))


def _mesh(meshes: Sequence[tuple[np.ndarray, np.ndarray]]) -> Mesh:
    """Return solids as one mesh, its vertices as an STL would have them: those of neighbouring B-rep faces are one."""
    corners = np.concatenate([vertices[faces] for vertices, faces in meshes]).astype(np.float32)
    return Mesh(*weld_exact(corners.reshape(-1, 3, 3)), indexed=False)
