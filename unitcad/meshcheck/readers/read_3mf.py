"""3MF: the package, its model parts, and the instances of its build, counted before anything is expanded."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from unitcad.geometry.arrays import Floats
from unitcad.meshcheck.findings import Finding, counted
from unitcad.meshcheck.geometry.mesh import Mesh, Source
from unitcad.meshcheck.readers import threemf_package as opc
from unitcad.meshcheck.readers import threemf_references as references
from unitcad.meshcheck.readers.threemf_model import read_model
from unitcad.meshcheck.readers.threemf_package import Package, Relation, image_kind
from unitcad.meshcheck.readers.threemf_schema import LINE, Model, Object, Triangles, Use
from unitcad.meshcheck.rules.f_file import F003, F011, Limits, OutOfTime, Unreadable
from unitcad.meshcheck.rules.p_package import P001, P002, P003, P009, P012, P014, P019, P020
from unitcad.meshcheck.rules.registry import Rule
from unitcad.meshcheck.rules.s_scale import UNITS_MM
from unitcad.text import some

Key = tuple[str, int]
"""A part of the package and the id of an object in it."""


@dataclass(frozen=True)
class Instance:
    """An object of the build with its mesh, its whole transform (4, 3) in the model's unit, and that unit in mm."""

    key: Key
    object: Object
    triangles: Triangles
    matrix: Floats
    unit_mm: float

    @property
    def linear(self) -> tuple[Key, bytes]:
        """The common part of instances that differ by a shift."""
        return self.key, self.matrix[:3].tobytes()

    @property
    def shift(self) -> Floats:
        """The object's origin, mm."""
        return self.matrix[3] * self.unit_mm

    def mesh(self, *, placed: bool) -> Mesh:
        """Return the object's mesh, mm: `placed` at the instance, otherwise in the object's own frame."""
        points, faces = self.triangles.vertices, self.triangles.rows[:, :3].astype(np.int32)
        if placed:
            with np.errstate(all="ignore"):  # numbers that become too large are found on use
                points = points @ self.matrix[:3] + self.matrix[3]
            if np.linalg.det(self.matrix[:3]) < 0:
                faces = faces[:, ::-1]
        source = Source(lines=self.triangles.rows[:, LINE], part=self.key[0])
        return Mesh(points * self.unit_mm, np.ascontiguousarray(faces), name=str(self.object.id), source=source)


def expand(models: dict[str, Model], root: Model, limits: Limits, findings: list[Finding]) -> list[Instance]:
    """Return the meshes of the build with their transforms; faces are counted before anything is expanded."""
    sizes: dict[Key, tuple[int, int, int]] = {}
    objects = {
        (part, id_): model_object for part, model in models.items() for id_, model_object in model.objects().items()
    }

    def key_of(part: str, use: Use) -> Key:
        return (use.path.lower().lstrip("/") if use.path else part, use.object)

    def size(key: Key, trail: tuple[Key, ...]) -> tuple[int, int, int]:
        """Return faces, nodes and levels of an object with its components, within the limit of depth."""
        if key not in objects:
            return 0, 0, 0
        if key in trail:
            raise P012.unreadable(f"object {key[1]} contains itself")
        if key not in sizes and len(trail) < limits.max_depth:
            mesh, components = objects[key].mesh, objects[key].components
            below = [(0 if mesh is None else len(mesh.rows), 1, 0)]
            below += [size(key_of(key[0], use), (*trail, key)) for use in components]
            faces, nodes, levels = zip(*below, strict=True)
            sizes[key] = sum(faces), sum(nodes), 1 + max(levels)
        if key not in sizes or len(trail) + sizes[key][2] > limits.max_depth:
            raise P009.unreadable(f"components nest deeper than {limits.max_depth}")
        return sizes[key]

    total = nodes = 0
    for item in root.items:
        faces, below, _ = size(key_of(root.part, item), ())
        total, nodes = total + faces, nodes + below
    if total > limits.max_faces:
        text = f"{_large(total)} faces in {_large(nodes)} instances, more than --max-faces {limits.max_faces}"
        raise P009.unreadable(text)
    if nodes > limits.max_instances:
        raise F011.unreadable(f"{_large(nodes)} instances, more than the limit of {limits.max_instances}")
    instances: list[Instance] = []
    made: set[str] = set()

    def place(key: Key, matrix: Floats, severity: str | None = None) -> None:
        model_object = objects.get(key)
        if model_object is None:
            return
        if not model_object.components:
            made.add(model_object.type)
        if model_object.type == "other" and not model_object.components:
            findings.append(P012.finding(f"the build uses object {key[1]} of type other", severity=severity))
        elif model_object.mesh is not None:
            unit_mm = UNITS_MM.get(models[key[0]].unit, 1.0)
            instances.append(Instance(key, model_object, model_object.mesh, matrix, unit_mm))
        for use in model_object.components:
            place(key_of(key[0], use), _times(use.matrix, matrix), None if root.strict else "warning")

    for item in root.items:
        key = key_of(root.part, item)
        if item.path and key not in objects and key[0] in models:
            findings.append(P012.finding(f"a build item names object {key[1]} of {item.path}, which is not there"))
        place(key, item.matrix)
    if made and "model" not in made:
        types = some(sorted(made))
        findings.append(P014.finding(f"the build has no object of type model, only of type {types}"))
    return instances


def _large(n: int) -> str:
    """Return a count in digits that can be read: whole up to 1e15, else its power of ten."""
    return str(n) if n < 10**15 else f"more than 1e{math.floor(math.log10(n))}"


def _times(first: Floats, then: Floats) -> Floats:
    """Return the transform `first` followed by `then`, rows as 3MF writes them."""
    with np.errstate(all="ignore"):  # numbers that become too large are found on use
        return np.vstack([first[:3] @ then[:3], first[3] @ then[:3] + then[3]])


_IMAGES = {"image/png": "png", "image/jpeg": "jpeg", "image/jpg": "jpeg"}
_TICKET_TYPE = "application/vnd.ms-printing.printticket+xml"


@dataclass(frozen=True)
class Build:
    """Print job of a 3MF file: the instances, and the unit that its start part names."""

    unit: str
    instances: list[Instance]


def read_build(package: Package, limits: Limits) -> Build | None:
    """Read the model parts and place the objects of the build; faults are added to the package's findings.

    None if no start part can be read. Raises `Unreadable` if components nest without end or a limit is reached.
    """
    models = _models(package, limits)
    for model in models.values():
        references.check_references(model)
        package.findings += model.findings
    if not models:
        return None
    root = next(iter(models.values()))
    if not root.items and root.has_build:
        package.findings.append(replace(P014.finding("the build has no item"), ends=True))
    return Build(root.unit, expand(models, root, limits, package.findings))


def _models(package: Package, limits: Limits) -> dict[str, Model]:
    """Return the start part's model first, then those that it reaches by path, each with its relationships checked."""
    relations = package.relations("")
    if "_rels/.rels" not in package.parts:
        package.add(P002, "_rels/.rels is missing")
    starts = [relation for relation in relations if relation.kind == opc.START]
    _singletons(package, relations, "the package", (opc.THUMBNAIL, opc.PROPERTIES))
    if len(starts) != 1:
        if not any(item.code in ("P003", "F003", "P007") for item in package.findings):
            package.add(P003, counted(len(starts), "start part"))
        if not starts:
            return {}
    models: dict[str, Model] = {}
    wanted, faces = [starts[0].target], 0
    while wanted:
        part = wanted.pop(0)
        if part in models:
            continue
        if package.content_type(part) != opc.MODEL_TYPE:
            package.add(P001, f"{package.shown(part)} has type {package.content_type(part)!r}, not the model's", part)
        try:
            model = read_model(package.chunks(part), part, limits, faces, strict=package.strict)
        except OutOfTime:
            raise
        except Unreadable as stop:
            package.findings += stop.findings
            continue
        faces += sum(len(one.mesh.rows) for one in model.objects().values() if one.mesh is not None)
        models[part] = model
        related = package.relations(part)
        _singletons(package, related, part, (opc.TICKET,))
        _paths(package, model, related, is_root=len(models) == 1)
        reached = {path for path in _linked_parts(model) if path in package.parts}
        wanted += sorted(reached)
    return models


def _linked_parts(model: Model) -> dict[str, str]:
    """Return the parts that a model names by path, each as it is written there."""
    uses = [*model.items, *(use for resource in model.objects().values() for use in resource.components)]
    paths = {use.path for use in uses if use.path}
    for resource in model.resources.values():
        paths |= {member["slicepath"] for member in resource.members if "slicepath" in member}
    return {path.lower().lstrip("/"): path.lstrip("/") for path in sorted(paths)}


def _singletons(package: Package, relations: list[Relation], who: str, kinds: tuple[str, ...]) -> None:
    """Apply P020: one thumbnail, ticket and set of properties at most, each of the type that it must have."""
    for kind in kinds:
        of = [relation for relation in relations if relation.kind == kind]
        name = kind.rsplit("/", 1)[-1]
        if len(of) > 1:
            package.add(P020, f"{len(of)} parts of type {name} for {who}")
        for relation in of:
            content_type = package.content_type(relation.target)
            if kind == opc.THUMBNAIL:
                _image(package, relation.target, P020)
            elif kind == opc.TICKET and content_type != _TICKET_TYPE:
                text = f"{package.shown(relation.target)} has type {content_type!r}, not a print ticket's"
                package.add(P020, text, relation.target)
            elif kind == opc.PROPERTIES:
                package.xml(relation.target, F003)


def _image(package: Package, part: str, rule: Rule) -> None:
    content_type = package.content_type(part)
    if content_type is None:
        package.add(P001, f"{package.shown(part)} has no content type", part)
        return
    if content_type not in _IMAGES and not (
        rule is P019 and content_type == "application/vnd.ms-package.3dmanufacturing-3dmodeltexture"
    ):
        package.add(rule, f"{package.shown(part)} has type {content_type!r}, not PNG's or JPEG's", part)
        return
    try:
        kind, why = image_kind(package.chunks(part))
    except OutOfTime:
        raise
    except Unreadable as stop:
        package.findings += stop.findings
        return
    if why:
        package.add(rule, f"{package.shown(part)}: {why}", part)
    elif content_type in _IMAGES and kind != _IMAGES[content_type]:
        package.add(rule, f"{package.shown(part)} is {kind or 'no image'}, its type says {content_type}", part)


def _paths(package: Package, model: Model, related: list[Relation], *, is_root: bool) -> None:
    """Check that parts named by path exist, and are targets of a relationship of the right type."""
    by_kind = {kind: {r.target for r in related if r.kind == kind} for kind in opc.KNOWN}
    images = by_kind[opc.THUMBNAIL] | by_kind[opc.TEXTURE]
    for resource in model.resources.values():
        path = resource.attributes.get("path" if resource.kind == "texture2d" else "thumbnail")
        if path is None or resource.kind not in ("texture2d", "object"):
            continue
        part = path.lower().lstrip("/")
        if part not in package.parts:
            rule, add = (P019, package.add) if resource.kind == "texture2d" else (P002, package.add_lenient)
            add(rule, f"{path} of {resource.kind} {resource.id} is not in the package", model.part)
        elif part not in (by_kind[opc.TEXTURE] if resource.kind == "texture2d" else images):
            add = package.add if resource.kind == "texture2d" else package.add_lenient
            add(P002, f"{path} of {resource.kind} {resource.id} has no relationship", model.part)
        else:
            _image(package, part, P019 if resource.kind == "texture2d" else P020)
    for part, written in sorted(_linked_parts(model).items()):
        if part not in package.parts:
            package.add(P012, f"{written} is not in the package", model.part)
        elif part not in by_kind[opc.START]:
            package.add(P002, f"{written} has no relationship of the model type", model.part)
        elif not is_root and any(use.path for resource in model.objects().values() for use in resource.components):
            package.add(P012, "a part other than the root one refers to objects by path", model.part)
