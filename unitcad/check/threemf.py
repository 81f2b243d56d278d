"""3MF: the package, its model parts, the instances of its build, and the geometry of each object that is built."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from unitcad.check import instances as placement
from unitcad.check import package as opc
from unitcad.check import references, scale, schema, topology
from unitcad.check.findings import Facts, Finding, counted, ending
from unitcad.check.images import image_kind
from unitcad.check.instances import Instance, Key, mesh_of
from unitcad.check.limits import Deadline, Limits, OutOfTime, Unreadable, keeping, over_limit
from unitcad.check.mesh import LARGEST, Floats, cross, extent
from unitcad.check.model_data import Model, Object, Use
from unitcad.check.model_part import read_model
from unitcad.check.package import Package, Relation
from unitcad.check.rulebook import finding
from unitcad.check.rules_mesh import Judged, judge_mesh
from unitcad.check.scale import UNITS_MM

if TYPE_CHECKING:
    from unitcad.check.check import Options

_IMAGES = {"image/png": "png", "image/jpeg": "jpeg", "image/jpg": "jpeg"}
_TICKET_TYPE = "application/vnd.ms-printing.printticket+xml"
# The core specification, 4.1 and 4.1.1, tells consumers to accept these and says what they mean (positive fill rule).
_FILLED = {"G001", "G002", "G008"}


def check_3mf(data: memoryview, options: Options, deadline: Deadline) -> tuple[list[Finding], Facts]:
    """All findings about a 3MF file and the facts of what it builds."""
    package = opc.open_package(data, options.limits, deadline, strict=options.strict_3mf)
    try:
        with keeping(package.findings):
            findings, facts = _judged(package, options, deadline)
    except Unreadable as stop:  # its facts are one object's
        findings, facts = list(stop.findings), Facts()
    return [_named(package, item) for item in findings], facts


def _named(package: Package, item: Finding) -> Finding:
    """The finding with its places' parts as the package writes them."""
    return replace(
        item,
        locations=tuple(
            replace(place, part=package.shown(place.part)) if place.part else place for place in item.locations
        ),
    )


def _judged(package: Package, options: Options, deadline: Deadline) -> tuple[list[Finding], Facts]:
    models = _models(package, options.limits)
    findings = package.findings
    for model in models.values():
        references.judge(model)
        findings += model.findings
    if not models:
        return list(ending(findings)), Facts()
    root = next(iter(models.values()))
    if not root.items and root.has_build:
        findings.append(replace(finding("P014", "the build has no item"), ends=True))
    try:
        instances = _expand(models, root, options.limits, findings)
    except Unreadable as stop:
        return findings + list(stop.findings), Facts()
    return _geometry(models, instances, options, deadline, findings)


def _models(package: Package, limits: Limits) -> dict[str, Model]:
    """The start part's model first, then those that it reaches by path, each with its relationships checked."""
    relations = package.relations("")
    if "_rels/.rels" not in package.parts:
        package.say("P002", "_rels/.rels is missing")
    starts = [relation for relation in relations if relation.kind == opc.START]
    _singletons(package, relations, "the package", (opc.THUMBNAIL, opc.PROPERTIES))
    if len(starts) != 1:
        if not any(item.code in ("P003", "F003", "P007") for item in package.findings):
            package.say("P003", counted(len(starts), "start part"))
        if not starts:
            return {}
    models: dict[str, Model] = {}
    wanted, faces = [starts[0].target], 0
    while wanted:
        part = wanted.pop(0)
        if part in models:
            continue
        if package.content_type(part) != opc.MODEL_TYPE:
            package.say("P001", f"{package.shown(part)} has type {package.content_type(part)!r}, not the model's", part)
        try:
            model = read_model(package.chunks(part), part, limits, faces, strict=package.strict)
        except OutOfTime:
            raise
        except Unreadable as stop:
            package.findings += stop.findings
            continue
        faces += sum(len(o.triangles) for o in model.objects().values() if o.triangles is not None)
        models[part] = model
        related = package.relations(part)
        _singletons(package, related, part, (opc.TICKET,))
        _paths(package, model, related, is_root=len(models) == 1)
        reached = {path for path in _reached(model) if path in package.parts}
        wanted += sorted(reached)
    return models


def _reached(model: Model) -> dict[str, str]:
    """The parts that a model names by path, each as it is written there."""
    uses = [*model.items, *(use for found in model.objects().values() for use in found.components)]
    paths = {use.path for use in uses if use.path}
    for found in model.resources.values():
        paths |= {member["slicepath"] for member in found.members if "slicepath" in member}
    return {path.lower().lstrip("/"): path.lstrip("/") for path in sorted(paths)}


def _singletons(package: Package, relations: list[Relation], who: str, kinds: tuple[str, ...]) -> None:
    """P020: one thumbnail, ticket and set of properties at most, each of the type that it must have."""
    for kind in kinds:
        of = [relation for relation in relations if relation.kind == kind]
        name = kind.rsplit("/", 1)[-1]
        if len(of) > 1:
            package.say("P020", f"{len(of)} parts of type {name} for {who}")
        for relation in of:
            said = package.content_type(relation.target)
            if kind == opc.THUMBNAIL:
                _image(package, relation.target, "P020")
            elif kind == opc.TICKET and said != _TICKET_TYPE:
                text = f"{package.shown(relation.target)} has type {said!r}, not a print ticket's"
                package.say("P020", text, relation.target)
            elif kind == opc.PROPERTIES:
                package.xml(relation.target, "F003")


def _image(package: Package, part: str, code: str) -> None:
    said = package.content_type(part)
    if said is None:
        package.say("P001", f"{package.shown(part)} has no content type", part)
        return
    if said not in _IMAGES and not (
        code == "P019" and said == "application/vnd.ms-package.3dmanufacturing-3dmodeltexture"
    ):
        package.say(code, f"{package.shown(part)} has type {said!r}, not PNG's or JPEG's", part)
        return
    try:
        kind, why = image_kind(package.chunks(part))
    except OutOfTime:
        raise
    except Unreadable as stop:
        package.findings += stop.findings
        return
    if why:
        package.say(code, f"{package.shown(part)}: {why}", part)
    elif said in _IMAGES and kind != _IMAGES[said]:
        package.say(code, f"{package.shown(part)} is {kind or 'no image'}, its type says {said}", part)


def _paths(package: Package, model: Model, related: list[Relation], *, is_root: bool) -> None:
    """What a model part names by path exists, and is the target of a relationship of the right type."""
    by_kind = {kind: {r.target for r in related if r.kind == kind} for kind in opc.KNOWN}
    images = by_kind[opc.THUMBNAIL] | by_kind[opc.TEXTURE]
    for found in model.resources.values():
        path = found.attributes.get("path" if found.kind == "texture2d" else "thumbnail")
        if path is None or found.kind not in ("texture2d", "object"):
            continue
        part = path.lower().lstrip("/")
        if part not in package.parts:
            code, say = ("P019", package.say) if found.kind == "texture2d" else ("P002", package.say_lenient)
            say(code, f"{path} of {found.kind} {found.id} is not in the package", model.part)
        elif part not in (by_kind[opc.TEXTURE] if found.kind == "texture2d" else images):
            say = package.say if found.kind == "texture2d" else package.say_lenient
            say("P002", f"{path} of {found.kind} {found.id} has no relationship", model.part)
        else:
            _image(package, part, "P019" if found.kind == "texture2d" else "P020")
    for part, written in sorted(_reached(model).items()):
        if part not in package.parts:
            package.say("P012", f"{written} is not in the package", model.part)
        elif part not in by_kind[opc.START]:
            package.say("P002", f"{written} has no relationship of the model type", model.part)
        elif not is_root and any(use.path for found in model.objects().values() for use in found.components):
            package.say("P012", "a part other than the root one refers to objects by path", model.part)


def _expand(models: dict[str, Model], root: Model, limits: Limits, findings: list[Finding]) -> list[Instance]:
    """The meshes of the build with their transforms; faces are counted before anything is expanded."""
    counts: dict[Key, tuple[int, int]] = {}
    objects = {(part, id_): found for part, model in models.items() for id_, found in model.objects().items()}

    def key_of(part: str, use: Use) -> Key:
        return (use.path.lower().lstrip("/") if use.path else part, use.object)

    def size(key: Key, trail: tuple[Key, ...]) -> tuple[int, int]:
        """Faces and nodes under an object; depth and recursion are bounded here."""
        if key in counts:
            return counts[key]
        found = objects.get(key)
        if found is None:
            return 0, 0
        if key in trail:
            raise Unreadable(finding("P012", f"object {key[1]} contains itself"))
        if len(trail) >= limits.max_depth:
            raise Unreadable(finding("P009", f"components nest deeper than {limits.max_depth}"))
        faces, nodes = (0 if found.triangles is None else len(found.triangles)), 1
        for use in found.components:
            more, below = size(key_of(key[0], use), (*trail, key))
            faces, nodes = faces + more, nodes + below
        counts[key] = faces, nodes
        return counts[key]

    total = nodes = 0
    for item in root.items:
        faces, below = size(key_of(root.part, item), ())
        total, nodes = total + faces, nodes + below
    if total > limits.max_faces:
        text = f"{_large(total)} faces in {_large(nodes)} instances, more than --max-faces {limits.max_faces}"
        raise Unreadable(finding("P009", text))
    if nodes > limits.max_instances:
        raise over_limit(f"{_large(nodes)} instances, more than the limit of {limits.max_instances}")
    instances: list[Instance] = []

    def place(key: Key, matrix: Floats, depth: int) -> None:
        found = objects.get(key)
        if found is None or depth > limits.max_depth:
            return
        if found.type == "other" and not found.components:
            findings.append(finding("P012", f"the build uses object {key[1]} of type other"))
        if found.vertices is not None:
            instances.append(Instance(key, matrix))
        for use in found.components:
            place(key_of(key[0], use), _times(use.matrix, matrix), depth + 1)

    for item in root.items:
        key = key_of(root.part, item)
        if item.path and key not in objects and key[0] in models:
            findings.append(finding("P012", f"a build item names object {key[1]} of {item.path}, which is not there"))
        place(key, item.matrix, 0)
    return instances


def _large(n: int) -> str:
    """A count in digits that can be read: whole up to 1e15, else its power of ten."""
    return str(n) if n < 10**15 else f"more than 1e{math.floor(math.log10(n))}"


def _times(first: Floats, then: Floats) -> Floats:
    """The transform `first` followed by `then`, rows as 3MF writes them."""
    with np.errstate(all="ignore"):  # what comes out too large is found where it is used
        return np.vstack([first[:3] @ then[:3], first[3] @ then[:3] + then[3]])


@dataclass(frozen=True)
class _Turned:
    """An object under the linear part of a transform: its box (2, 3) mm, area mm2, and the factor on its volume."""

    box: Floats
    area: float
    scale: float


def _turned(found: Object, linear: Floats, factor: float) -> _Turned:
    """Measured once for all instances that differ by a shift: adding it to the box rounds as it does every vertex."""
    assert found.vertices is not None
    assert found.triangles is not None
    with np.errstate(all="ignore"):
        points = (found.vertices @ linear) * factor
        a, b, c = (points[found.triangles[:, i]] for i in range(3))
        area = float(np.linalg.norm(cross(b - a, c - a), axis=1).sum()) / 2
        return _Turned(np.stack(extent(points)), area, abs(float(np.linalg.det(linear))))


def _geometry(
    models: dict[str, Model], instances: list[Instance], options: Options, deadline: Deadline, findings: list[Finding]
) -> tuple[list[Finding], Facts]:
    judged: dict[Key, Judged] = {}
    turned: dict[tuple[Key, bytes], _Turned] = {}
    broken = any(item.code in ("P011", "V001", "F004") for item in findings)
    if broken:
        return list(ending(findings)), Facts()
    boxes, shifts, placed = list[Floats](), list[Floats](), list[int]()
    triangles = vertices = shells = 0
    volume = area = 0.0
    watertight = known = bool(instances)
    compared, solids = options.cross and len(instances) > 1, list[placement.Placed]()
    for instance in instances:
        found = models[instance.key[0]].resources[instance.key[1]]
        assert isinstance(found, Object)
        assert found.vertices is not None
        assert found.triangles is not None
        if not len(found.triangles):
            continue
        factor = UNITS_MM.get(models[instance.key[0]].unit, 1.0)
        if instance.key not in judged:
            judged[instance.key] = _judge(found, instance.key[0], factor, options, deadline)
            findings += judged[instance.key].findings
        facts = judged[instance.key].facts
        linear = instance.key, instance.matrix[:3].tobytes()
        if linear not in turned:
            turned[linear] = _turned(found, instance.matrix[:3], factor)
        one = turned[linear]
        boxes.append(one.box)
        shifts.append(instance.matrix[3] * factor)
        placed.append(found.id)
        triangles += facts.triangles or 0
        vertices += facts.vertices or 0
        shells += facts.shells or 0
        size = (facts.volume_mm3 or 0.0) * one.scale
        volume += size
        area += one.area
        watertight = watertight and bool(facts.watertight)
        known = known and facts.volume_mm3 is not None
        if compared and facts.watertight and size > 0 and len(solids) <= placement.MOST:
            with np.errstate(all="ignore"):
                mesh = mesh_of(found, instance.key[0], factor, instance.matrix)
            solids.append(placement.Placed(mesh.vertices, mesh.faces, size, str(found.id)))
        deadline.tick()
    if not triangles:
        return list(ending(findings)), Facts(triangles=0, vertices=vertices, shells=0)
    with np.errstate(all="ignore"):
        corners = np.stack(boxes) + np.stack(shifts)[:, None]
    beyond = ~(np.abs(corners) <= LARGEST).all(axis=(1, 2))
    if beyond.any():
        worst = placed[int(beyond.argmax())]
        findings.append(finding("V001", f"an instance of object {worst} reaches beyond the float32 numbers"))
        return list(ending(findings)), Facts()
    findings += topology.too_far(corners, topology.diagonals(*np.swapaxes(np.stack(boxes), 0, 1)))
    findings += scale.specks(corners[:, 0], corners[:, 1], np.ones(len(corners), bool))
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
    findings += placement.judge(solids, deadline) + scale.judge(facts, next(iter(models.values())).unit)
    if options.shells is not None and shells != options.shells:
        findings.append(
            finding("G005", f"{counted(shells, 'shell')}, {options.shells} expected", abs(shells - options.shells))
        )
    if options.printer is not None:
        findings += placement.printed(models, instances, options.printer, deadline)
    return findings, facts


def _judge(found: Object, part: str, factor: float, options: Options, deadline: Deadline) -> Judged:
    """The geometry rules for one object; only model and solidsupport objects must be solids, unless slices stand in."""
    mesh = mesh_of(found, part, factor)
    stand_in = found.attributes.get(f"{schema.SLICE} meshresolution") == "lowres"
    if found.type not in ("model", "solidsupport") or stand_in:
        return Judged((), Facts(triangles=len(mesh.faces), vertices=len(mesh.vertices)), None)
    with keeping(change=_filled):
        judged = judge_mesh(mesh, deadline, cross=options.cross)
    return replace(judged, findings=tuple(_filled(judged.findings)))


def _filled(findings: Iterable[Finding]) -> Iterator[Finding]:
    """The findings, of rules that 3MF answers by its fill rule as warnings."""
    for item in findings:
        if item.code in _FILLED:
            yield replace(item, severity="warning", message=f"{item.message} (3MF's fill rule says what is solid)")
        else:
            yield item
