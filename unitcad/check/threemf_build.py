"""The geometry rules on a 3MF: each object that is built, and its instances in their places and against each other.

Solids may share volume though each is sound by itself (G002). 3MF's core specification (4.1, 4.1.1) lets overlapping
components and objects be, and says what is filled, so this is a warning.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from unitcad.check.findings import Facts, Finding, Location, counted, ending, point
from unitcad.check.geometry.topology import diagonals, topology_of
from unitcad.check.geometry.triangle_mesh import LARGEST, solid_of
from unitcad.check.one_mesh import CheckedMesh, check_on_bed, check_surface
from unitcad.check.options import Options
from unitcad.check.readers.threemf import elements
from unitcad.check.readers.threemf.model_data import Model, Object
from unitcad.check.readers.threemf.opc import Package, open_package
from unitcad.check.readers.threemf.placement import Instance, Key, mesh_of
from unitcad.check.readers.threemf.read_3mf import Build, read_build
from unitcad.check.rules import g_shells, s_scale, v_values
from unitcad.check.rules.f_limits import Deadline, Unreadable, keeping
from unitcad.check.rules.g_shells import G002
from unitcad.check.rules.inspection import Inspection
from unitcad.check.rules.v_values import V001
from unitcad.check.units import UNITS_MM
from unitcad.geometry.arrays import Floats, Ints, cross, extent
from unitcad.geometry.boxes import box_pairs

if TYPE_CHECKING:
    from manifold3d import Manifold

    from unitcad.catalogue import Printer

# The core specification, 4.1 and 4.1.1, tells consumers to accept these and says what they mean (positive fill rule).
_FILLED = {"G001", "G002", "G008"}
MOST = 2000
"""Instances compared; of more the first so many, and the message says so."""
_PAIRS = 2000
_SHARE = 1e-6  # of the smaller volume, below which solids only touch


def check_3mf(data: memoryview, options: Options, deadline: Deadline) -> tuple[list[Finding], Facts]:
    """Return all findings about a 3MF file and the facts of what it builds."""
    package = open_package(data, options.limits, deadline, strict=options.strict_3mf)
    try:
        with keeping(package.findings):
            build = read_build(package, options.limits)
            findings, facts = _geometry(build, options, deadline, package.findings)
    except Unreadable as stop:  # its facts are one object's
        findings, facts = list(stop.findings), Facts()
    return [_named(package, item) for item in findings], facts


def _named(package: Package, item: Finding) -> Finding:
    """Return the finding with its places' parts as the package writes them."""
    return replace(
        item,
        locations=tuple(
            replace(place, part=package.shown(place.part)) if place.part else place for place in item.locations
        ),
    )


@dataclass(frozen=True)
class _Turned:
    """An object under the linear part of a transform: its box (2, 3) mm, area mm2, and the factor on its volume."""

    box: Floats
    area: float
    scale: float


def _turned(model_object: Object, linear: Floats, factor: float) -> _Turned:
    """Measure once for all instances that differ by a shift: adding it to the box rounds as it does every vertex."""
    assert model_object.vertices is not None
    assert model_object.triangles is not None
    with np.errstate(all="ignore"):
        points = (model_object.vertices @ linear) * factor
        a, b, c = (points[model_object.triangles[:, i]] for i in range(3))
        area = float(np.linalg.norm(cross(b - a, c - a), axis=1).sum()) / 2
        return _Turned(np.stack(extent(points)), area, abs(float(np.linalg.det(linear))))


def _geometry(
    build: Build, options: Options, deadline: Deadline, findings: list[Finding]
) -> tuple[list[Finding], Facts]:
    """Add what the geometry rules find in the objects that are built, and in their instances beside each other."""
    models, instances = build.models, build.instances
    checked: dict[Key, CheckedMesh] = {}
    turned: dict[tuple[Key, bytes], _Turned] = {}
    broken = any(item.code in ("P011", "V001", "F004") for item in findings)
    if broken or not models:
        return list(ending(findings)), Facts()
    boxes, shifts, placed = list[Floats](), list[Floats](), list[int]()
    triangles = vertices = shells = 0
    volume = area = 0.0
    watertight = known = bool(instances)
    compared, solids = options.cross and len(instances) > 1, list[Placed]()
    for instance in instances:
        model_object = models[instance.key[0]].resources[instance.key[1]]
        assert isinstance(model_object, Object)
        assert model_object.vertices is not None
        assert model_object.triangles is not None
        if not len(model_object.triangles):
            continue
        factor = UNITS_MM.get(models[instance.key[0]].unit, 1.0)
        if instance.key not in checked:
            checked[instance.key] = _check_object(model_object, instance.key[0], factor, options, deadline)
            findings += checked[instance.key].findings
        facts = checked[instance.key].facts
        linear = instance.key, instance.matrix[:3].tobytes()
        if linear not in turned:
            turned[linear] = _turned(model_object, instance.matrix[:3], factor)
        one = turned[linear]
        boxes.append(one.box)
        shifts.append(instance.matrix[3] * factor)
        placed.append(model_object.id)
        triangles += facts.triangles or 0
        vertices += facts.vertices or 0
        shells += facts.shells or 0
        size = (facts.volume_mm3 or 0.0) * one.scale
        volume += size
        area += one.area
        watertight = watertight and bool(facts.watertight)
        known = known and facts.volume_mm3 is not None
        if compared and facts.watertight and size > 0 and len(solids) <= MOST:
            with np.errstate(all="ignore"):
                mesh = mesh_of(model_object, instance.key[0], factor, instance.matrix)
            solids.append(Placed(mesh.vertices, mesh.faces, size, str(model_object.id)))
        deadline.tick()
    if not triangles:
        return list(ending(findings)), Facts(triangles=0, vertices=vertices, shells=0)
    with np.errstate(all="ignore"):
        corners = np.stack(boxes) + np.stack(shifts)[:, None]
    beyond = ~(np.abs(corners) <= LARGEST).all(axis=(1, 2))
    if beyond.any():
        worst = placed[int(beyond.argmax())]
        findings.append(V001.finding(f"an instance of object {worst} reaches beyond the float32 numbers"))
        return list(ending(findings)), Facts()
    findings += v_values.too_far(corners, diagonals(*np.swapaxes(np.stack(boxes), 0, 1)))
    findings += g_shells.specks(corners[:, 0], corners[:, 1], np.ones(len(corners), bool))
    low, high = corners[:, 0].min(axis=0), corners[:, 1].max(axis=0)
    facts = Facts(
        triangles,
        vertices,
        shells,
        volume if known else None,
        area,
        (tuple(low.tolist()), tuple(high.tolist())),
        watertight,
    )
    findings += overlapping(solids, deadline)
    findings += s_scale.likely_unit(facts, next(iter(models.values())).unit)
    findings += g_shells.expected(shells, options.shells)
    if options.printer is not None:
        findings += printed(models, instances, options.printer, deadline)
    return findings, facts


def _check_object(model_object: Object, part: str, factor: float, options: Options, deadline: Deadline) -> CheckedMesh:
    """Return the geometry rules for one object; only model and solidsupport objects must be solids, unless slices stand
    in.
    """
    mesh = mesh_of(model_object, part, factor)
    stand_in = model_object.attributes.get(f"{elements.SLICE} meshresolution") == "lowres"
    if model_object.type not in ("model", "solidsupport") or stand_in:
        return CheckedMesh((), Facts(triangles=len(mesh.faces), vertices=len(mesh.vertices)))
    with keeping(change=_filled):
        checked = check_surface(mesh, deadline, cross=options.cross)
    return replace(checked, findings=tuple(_filled(checked.findings)))


def _filled(findings: Iterable[Finding]) -> Iterator[Finding]:
    """Return the findings, of rules that 3MF answers by its fill rule as warnings."""
    for item in findings:
        if item.code in _FILLED:
            yield replace(item, severity="warning", message=f"{item.message} (3MF's fill rule says what is solid)")
        else:
            yield item


@dataclass(frozen=True)
class Placed:
    """A sound solid in its place: vertices (n, 3) mm, faces (m, 3) outwards, volume mm3, its object's id."""

    vertices: Floats
    faces: Ints
    volume: float
    name: str


def overlapping(placed: Sequence[Placed], deadline: Deadline) -> list[Finding]:
    """Apply G002, as a warning, to pairs that share volume, by manifold3d's boolean of those whose boxes do."""
    some = placed[:MOST]
    if len(some) < 2:
        return []
    boxes = [extent(solid.vertices) for solid in some]
    low, high = np.array([box[0] for box in boxes]), np.array([box[1] for box in boxes])
    solids: dict[int, Manifold] = {}
    places: list[Location] = []
    pairs = box_pairs(low, high, deadline.tick)
    try:
        for a, b in pairs[:_PAIRS].tolist():
            deadline.tick()
            least = min(some[a].volume, some[b].volume)
            room = float(np.prod(np.minimum(high[a], high[b]) - np.maximum(low[a], low[b])))
            if room <= _SHARE * least:
                continue
            if _shared(a, b, some, solids) > _SHARE * least:
                centre = (np.maximum(low[a], low[b]) + np.minimum(high[a], high[b])) / 2
                places.append(Location(xyz=point(centre), object=f"{some[a].name} and {some[b].name}"))
    except Unreadable as stop:
        stop.findings = (*_overlaps(places, among=True), *stop.findings)
        raise
    return _overlaps(places, among=len(placed) > MOST or len(pairs) > _PAIRS)


def _overlaps(places: list[Location], *, among: bool) -> list[Finding]:
    if not places:
        return []
    text = f"{counted(len(places), 'pair')} of instances that share volume{' among those compared' if among else ''}"
    return [G002.finding(f"{text} (3MF's fill rule says what is solid)", len(places), places, "warning")]


def _shared(a: int, b: int, some: Sequence[Placed], solids: dict[int, Manifold]) -> float:
    """Return the volume that two share, mm3; 0 where manifold3d refuses one (its own faults are reported)."""
    for i in (a, b):
        if i not in solids:
            solids[i] = solid_of(some[i].vertices, some[i].faces)
    return (solids[a] ^ solids[b]).volume()


def printed(
    models: dict[str, Model], instances: Sequence[Instance], printer: Printer, deadline: Deadline
) -> list[Finding]:
    """Apply the printer's rules to each instance; those that differ by their place on the bed alone are
    checked once.
    """
    findings: list[Finding] = []
    checked: dict[tuple[Key, bytes, float], tuple[Floats, tuple[Finding, ...]]] = {}
    for instance in instances:
        model_object = models[instance.key[0]].resources[instance.key[1]]
        assert isinstance(model_object, Object)
        if model_object.type != "model" or model_object.triangles is None or not len(model_object.triangles):
            continue
        factor = UNITS_MM.get(models[instance.key[0]].unit, 1.0)
        alike = instance.key, instance.matrix[:3].tobytes(), float(instance.matrix[3, 2])
        if alike not in checked:
            mesh = mesh_of(model_object, instance.key[0], factor, instance.matrix)
            with keeping(findings):
                part = Inspection(mesh, topology_of(mesh, deadline.tick), deadline.tick)
                checked[alike] = instance.matrix[3], check_on_bed(part, printer)
        begin, of = checked[alike]
        findings += _shifted(of, (instance.matrix[3] - begin) * factor)
    return findings


def _shifted(findings: Sequence[Finding], by: Floats) -> Iterator[Finding]:
    """Return the findings of an instance that lies elsewhere on the bed."""
    if not by.any():
        yield from findings
        return
    for item in findings:
        places = (replace(place, xyz=point(place.xyz + by)) if place.xyz else place for place in item.locations)
        yield replace(item, locations=tuple(places))
