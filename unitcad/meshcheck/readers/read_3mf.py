"""3MF: the package, its model parts, and the instances of its build, counted before anything is expanded."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints
from unitcad.meshcheck.findings import Finding, Location, counted
from unitcad.meshcheck.geometry.mesh import Mesh, Source
from unitcad.meshcheck.readers import threemf_package as opc
from unitcad.meshcheck.readers import threemf_schema as schema
from unitcad.meshcheck.readers.threemf_model import read_model
from unitcad.meshcheck.readers.threemf_package import Package, Relation
from unitcad.meshcheck.readers.threemf_schema import LINE, Model, Object, Resource, Triangles, Use
from unitcad.meshcheck.rules.f_file import F011, Limits, OutOfTime, Unreadable
from unitcad.meshcheck.rules.p_package import (
    P001,
    P002,
    P003,
    P009,
    P011,
    P012,
    P014,
    P017,
    P019,
    P020,
    P021,
    P022,
)
from unitcad.meshcheck.rules.registry import Rule
from unitcad.meshcheck.rules.s_scale import UNITS_MM
from unitcad.text import some

_MATERIALS = ("basematerials", "compositematerials")
_GROUPS = (*_MATERIALS, "colorgroup", "texture2dgroup", "multiproperties")
SOLID = ("model", "solidsupport")


def check_references(model: Model) -> None:
    """Add findings about references to the model. Objects in other parts are the package's business."""
    for space, place in model.unchecked.items():
        model.where = partial(_same, place)
        model.add_lenient(P021, schema.UNCHECKED[space])
    for resource in model.resources.values():
        model.where = partial(_line_of, resource)
        if isinstance(resource, Object):
            _object(model, resource)
        else:
            _property(model, resource)
    for item in model.items:
        model.where = partial(_line_of, item)
        if not item.path:
            _used(model, item.object, item.rank, "a build item")
    model.where = Location


def _same(place: Location) -> Location:
    return place


def _line_of(thing: Resource | Use) -> Location:
    return Location(line=thing.line, object=str(thing.id) if isinstance(thing, Object) else None)


def _used(model: Model, id_: int, rank: int, who: str) -> None:
    resource = model.resources.get(id_)
    if not isinstance(resource, Object):
        if id_ not in model.foreign:
            model.add(P012, f"{who} names object {id_}, which is not there")
    elif resource.rank > rank:
        model.add(P012, f"{who} names object {id_}, which is defined later or is itself")


def _object(model: Model, resource: Object) -> None:
    who = f"object {resource.id}"
    for use in resource.components:
        if not use.path:
            _used(model, use.object, resource.rank - (use.object == resource.id), f"a component of {who}")
    pid = resource.attributes.get("pid")
    if resource.components and pid is not None:
        model.add_lenient(P019, f"{who} has components and a pid")
    if "pindex" in resource.attributes and pid is None:
        model.add(P019, f"{who} has a pindex without a pid")
    group = _group(model, int(pid), resource.rank, who) if pid is not None else None
    if group is not None and "pindex" in resource.attributes:
        _in_range(model, int(resource.attributes["pindex"]), len(group.members), f"pindex of {who}")
    if resource.mesh is not None:
        _mesh(model, resource, resource.mesh)


def _group(model: Model, id_: int, rank: int, who: str) -> Resource | None:
    """Return the property group with that id, or None with a finding; groups of unknown extensions pass unseen."""
    resource = model.resources.get(id_)
    if resource is None:
        if id_ not in model.foreign:
            model.add(P019, f"{who} names property group {id_}, which is not there")
        return None
    if resource.kind not in _GROUPS:
        model.add(P019, f"{who} names resource {id_}, a {resource.kind}, as property group")
        return None
    if resource.rank > rank:
        model.add(P019, f"{who} names property group {id_}, which is defined later")
    return resource


def _in_range(model: Model, index: int, count: int, what: str) -> None:
    if index >= count:
        model.add(P011, f"{what} is {index}, the list has {count}")


def _mesh(model: Model, resource: Object, mesh: Triangles) -> None:
    who, rows, n = f"object {resource.id}", mesh.rows, len(mesh.vertices)
    if n < 3 and not resource.other_shape:
        model.add(P017, f"the mesh of {who} has {counted(n, 'vertex', 'vertices')}")
    if len(rows) < (4 if resource.type == "model" else 1) and not resource.other_shape:
        model.add(P017, f"the mesh of {who} has {counted(len(rows), 'triangle')}")
    corners = rows[:, :3]
    outside = np.flatnonzero((corners >= n).any(axis=1))
    if len(outside):
        text = f"{counted(len(outside), 'triangle')} of {who} (first {outside[0]}) with a vertex that is not there"
        model.add(P011, text, line=int(rows[outside[0], LINE]))
    same = (corners[:, 0] == corners[:, 1]) | (corners[:, 1] == corners[:, 2]) | (corners[:, 2] == corners[:, 0])
    if same.any():
        line = int(rows[same.argmax(), LINE])
        model.add(P017, f"{counted(int(same.sum()), 'triangle')} of {who} with one vertex twice", line=line)
    _triangle_properties(model, resource, rows)
    _beams(model, resource, n)


def _beams(model: Model, resource: Object, n: int) -> None:
    """Check the beams and balls on the `n` vertices of an object: beam lattice extension 1.2, chapter 2."""
    who, beams, balls = f"object {resource.id}", resource.beams, np.array(resource.balls, np.int64).reshape(-1, 2)
    for key in ("clippingmesh", "representationmesh"):
        if key in resource.lattice:
            _used(model, int(resource.lattice[key]), resource.rank - 1, f"{key} of {who}")
    if resource.lattice.get("clippingmode", "none") != "none" and "clippingmesh" not in resource.lattice:
        model.add(P017, f"the beam lattice of {who} is clipped without a clippingmesh")
    if (outside := balls[:, 0] >= n).any():
        text = f"{counted(int(outside.sum()), 'ball')} of {who} with a vertex that is not there"
        model.add(P011, text, line=int(balls[outside.argmax(), 1]))
    for rule, wrong, what in (
        (P011, (beams[:, :2] >= n).any(axis=1), "with a vertex that is not there"),
        (P017, beams[:, 0] == beams[:, 1], "with one vertex twice"),
        (P017, ~(beams[:, 2:4] > 0).all(axis=1), "with a radius that is not above 0"),
    ):
        if wrong.any():
            model.add(rule, f"{counted(int(wrong.sum()), 'beam')} of {who} {what}", line=int(beams[wrong.argmax(), 4]))
    for noun, indices, there in (("beam", resource.beam_sets, beams), ("ball", resource.ball_sets, balls)):
        _in_range(model, max(indices, default=-1), len(there), f"an index of the {noun} sets of {who}")


def _triangle_properties(model: Model, resource: Object, rows: Ints) -> None:
    who = f"object {resource.id}"
    used = (rows[:, 3:LINE] >= 0).any(axis=1)
    if not used.any():
        return
    rows = rows[used]
    if "pid" not in resource.attributes:
        model.add_lenient(P019, f"triangles of {who} have properties, the object has no pid as default")
    if ((rows[:, 3] < 0) & (rows[:, 4:6] >= 0).any(axis=1)).any():
        model.add(P019, f"a triangle of {who} has p2 or p3 without p1")
    default = int(resource.attributes.get("pid", -1))
    pids = np.where(rows[:, 6] >= 0, rows[:, 6], default)
    for pid in np.unique(pids):
        if pid < 0:
            continue
        group = _group(model, int(pid), resource.rank, f"a triangle of {who}")
        if group is None:
            continue
        of = rows[pids == pid]
        largest = int(of[:, 3:6].max())
        _in_range(model, largest, len(group.members), f"a property index in {who}")
        p1 = of[:, 3:4]
        if group.kind == "basematerials" and ((of[:, 4:6] >= 0) & (of[:, 4:6] != p1)).any():
            model.add(P019, f"a triangle of {who} blends base materials")


def _property(model: Model, resource: Resource) -> None:
    who = f"{resource.kind} {resource.id}"
    if resource.kind == "texture2dgroup":
        _earlier(model, int(resource.attributes["texid"]), resource.rank, who, "texture2d")
    elif resource.kind == "compositematerials":
        base = _earlier(model, int(resource.attributes["matid"]), resource.rank, who, "basematerials")
        if base is not None:
            for text in resource.attributes["matindices"].split():
                _in_range(model, int(text), len(base.members), f"an index of {who}")
    elif resource.kind == "multiproperties":
        _multi(model, resource)


def _earlier(model: Model, id_: int, rank: int, who: str, kind: str) -> Resource | None:
    resource = model.resources.get(id_)
    if resource is None and id_ in model.foreign:
        return None
    if resource is None or resource.kind != kind:
        model.add(P019, f"{who} names {id_} as {kind}, which is not there")
        return None
    if resource.rank > rank:
        model.add(P019, f"{who} names {kind} {id_}, which is defined later")
    return resource


def _multi(model: Model, resource: Resource) -> None:
    """Check materials 1.2, chapter 5: one material at most and first, one colour group at most, no multiproperties."""
    who = f"multiproperties {resource.id}"
    ids = [int(text) for text in resource.attributes["pids"].split()]
    textures = [id_ for id_ in ids if id_ in model.resources and model.resources[id_].kind == "texture2d"]
    if textures:
        # Drafts allowed it and the consortium's own MUSTPASS files do it, so it does not fail a file.
        model.add(P019, f"{who} names texture {textures[0]} itself, not a group of its coordinates", "warning")
    groups = [None if id_ in textures else _group(model, id_, resource.rank, who) for id_ in ids]
    kinds = [group.kind if group else "" for group in groups]
    materials = [place for place, kind in enumerate(kinds) if kind in _MATERIALS]
    if len(materials) > 1:
        model.add(P019, f"{who} names two materials")
    elif materials and materials[0] != 0:
        model.add(P019, f"{who} names its material after a colour")
    if kinds.count("colorgroup") > 1:
        model.add(P019, f"{who} names two colour groups")
    if "multiproperties" in kinds:
        model.add(P019, f"{who} names multiproperties")
    if len(resource.attributes.get("blendmethods", "").split()) > len(ids) - 1:
        model.add(P019, f"{who} has more blend methods than layers less one")
    for member in () if textures else [one for one in resource.members if one[""] == "multi"]:
        indices = [int(text) for text in member["pindices"].split()]
        if len(indices) > len(ids):
            model.add(P019, f"{who} has more indices than groups")
        for index, group in zip(indices, groups, strict=False):
            if group is not None:
                _in_range(model, index, len(group.members), f"an index of {who}")


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
            _expect_planar(model_object, matrix, findings)
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


def _expect_planar(placed: Object, matrix: Floats, findings: list[Finding]) -> None:
    """Apply P022: slices stay in their plane (slice extension, 1.2)."""
    flat = matrix[2, 2] == 1 and not matrix[:2, 2].any() and not matrix[2, :2].any()
    if not flat and f"{schema.SLICE} slicestackid" in placed.attributes:
        places = [Location(line=placed.line, object=str(placed.id))]
        findings.append(P022.finding(f"the build tilts or stretches the slices of object {placed.id}", places=places))


def _large(n: int) -> str:
    """Return a count in digits that can be read: whole up to 1e15, else its power of ten."""
    return str(n) if n < 10**15 else f"more than 1e{math.floor(math.log10(n))}"


def _times(first: Floats, then: Floats) -> Floats:
    """Return the transform `first` followed by `then`, rows as 3MF writes them."""
    with np.errstate(all="ignore"):  # numbers that become too large are found on use
        return np.vstack([first[:3] @ then[:3], first[3] @ then[:3] + then[3]])


_IMAGES = ("image/png", "image/jpeg", "image/jpg")
_TYPES = {
    opc.THUMBNAIL: _IMAGES,
    opc.TEXTURE: (*_IMAGES, "application/vnd.ms-package.3dmanufacturing-3dmodeltexture"),
    opc.TICKET: ("application/vnd.ms-printing.printticket+xml",),
}
"""Content types of parts by their relationships."""


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
        check_references(model)
        package.findings += model.findings
    if not models:
        return None
    root = next(iter(models.values()))
    _drop_modifiers(package, root)
    if not root.items and root.has_build:
        package.findings.append(replace(P014.finding("the build has no item"), ends=True))
    return Build(root.unit, expand(models, root, limits, package.findings))


_PRUSA = "metadata/slic3r_pe_model.config"


def _drop_modifiers(package: Package, root: Model) -> None:
    """Leave out the triangles that PrusaSlicer's settings call no part of a body: modifiers, supports, holes."""
    config = package.xml(_PRUSA, P002) if _PRUSA in package.parts else None
    for one in config.children if config is not None else ():
        name = one.attributes.get("id", "")
        found = root.objects().get(int(name)) if schema.index(name) else None
        if one.name != "object" or found is None or found.mesh is None:
            continue
        body = np.ones(len(found.mesh.rows), bool)
        for volume in one.children:
            settings = {entry.attributes.get("key"): entry.attributes.get("value") for entry in volume.children}
            ends = [volume.attributes.get(end, "") for end in ("firstid", "lastid")]
            part = settings.get("volume_type", "ModelPart") == "ModelPart" and settings.get("modifier", "0") == "0"
            if volume.name == "volume" and not part and all(map(schema.index, ends)):
                body[int(ends[0]) : int(ends[1]) + 1] = False
        if not body.all():
            found.mesh = _part(found.mesh, body)


def _part(mesh: Triangles, which: Bools) -> Triangles:
    """Return some triangles of a mesh, without the vertices that only the others use."""
    n = len(mesh.vertices)
    used, kept = (np.isin(np.arange(n), mesh.rows[some, :3]) for some in (slice(None), which))
    stay = kept | ~used
    rows = mesh.rows[which]
    inside = (rows[:, :3] < n).all(axis=1)  # others are findings
    rows[inside, :3] = (np.cumsum(stay) - 1)[rows[inside, :3]]
    return Triangles(mesh.vertices[stay], rows)


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
            model = read_model(package.read(part), part, limits, package.deadline.tick, faces, strict=package.strict)
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
    return {use.path.lower().lstrip("/"): use.path.lstrip("/") for use in uses if use.path}


def _singletons(package: Package, relations: list[Relation], who: str, kinds: tuple[str, ...]) -> None:
    """Apply P020: one thumbnail, ticket and set of properties at most, each of the type that it must have."""
    for kind in kinds:
        of = [relation for relation in relations if relation.kind == kind]
        if len(of) > 1:
            package.add(P020, f"{len(of)} parts of type {kind.rsplit('/', 1)[-1]} for {who}")
        for relation in of if kind in _TYPES else ():
            _expect_type(package, relation.target, P020, _TYPES[kind])


def _expect_type(package: Package, part: str, rule: Rule, types: tuple[str, ...]) -> None:
    """Add a finding if a part's content type is none of `types`, or if it can't be unpacked."""
    content_type = package.content_type(part)
    if content_type is None:
        package.add(P001, f"{package.shown(part)} has no content type", part)
    elif content_type not in types:
        package.add(rule, f"{package.shown(part)} has type {content_type!r}, not {' or '.join(types)}", part)
    try:
        package.read(part)
    except Unreadable as stop:
        package.findings += stop.findings


def _paths(package: Package, model: Model, related: list[Relation], *, is_root: bool) -> None:
    """Check that parts named by path exist, and are targets of a relationship of the right type."""
    by_kind = {kind: {r.target for r in related if r.kind == kind} for kind in opc.KNOWN}
    for resource in model.resources.values():
        if resource.kind != "texture2d" or "path" not in resource.attributes:
            continue
        path = resource.attributes["path"]
        part = path.lower().lstrip("/")
        if part not in package.parts:
            package.add(P019, f"{path} of texture2d {resource.id} is not in the package", model.part)
        elif part not in by_kind[opc.TEXTURE]:
            package.add(P002, f"{path} of texture2d {resource.id} has no relationship", model.part)
        else:
            _expect_type(package, part, P019, _TYPES[opc.TEXTURE])
    for part, written in sorted(_linked_parts(model).items()):
        if part not in package.parts:
            package.add(P012, f"{written} is not in the package", model.part)
        elif part not in by_kind[opc.START]:
            package.add(P002, f"{written} has no relationship of the model type", model.part)
        elif not is_root and any(use.path for resource in model.objects().values() for use in resource.components):
            package.add(P012, "a part other than the root one refers to objects by path", model.part)
