"""References inside a 3MF model: objects (P012), properties (P019), indices (P011), and those of extensions."""

from __future__ import annotations

from functools import partial

import numpy as np

from unitcad.geometry.arrays import Ints
from unitcad.meshcheck.findings import Location, counted
from unitcad.meshcheck.readers import threemf_schema as schema
from unitcad.meshcheck.readers.threemf_schema import LINE, Model, Object, Resource, Triangles, Use
from unitcad.meshcheck.rules.p_package import P011, P012, P017, P019

_MATERIALS = ("basematerials", "compositematerials")
_GROUPS = (*_MATERIALS, "colorgroup", "texture2dgroup", "multiproperties")
_TEXTURED = ("speculartextureid", "glossinesstextureid", "metallictextureid", "roughnesstextureid")
SOLID = ("model", "solidsupport")
_STACK = f"{schema.SLICE} slicestackid"


def check_references(model: Model) -> None:
    """Add findings about references to the model. Objects in other parts are the package's business."""
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
    if schema.PRODUCTION in (model.namespaces.get(prefix) for prefix in model.required):
        _uuids(model)


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
    if resource.lattice is not None:
        _lattice(model, resource, resource.lattice)
    _sliced(model, resource)


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
    solid = resource.type in SOLID and resource.lattice is None
    if n < 3 and not resource.other_shape:
        model.add(P017, f"the mesh of {who} has {counted(n, 'vertex', 'vertices')}")
    if len(rows) < (4 if solid and resource.type == "model" else 1) and resource.lattice is None:
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
    display = resource.attributes.get("displaypropertiesid")
    if display is not None:
        _earlier(model, int(display), resource.rank, who, "displayproperties")
    for name in _TEXTURED:
        if name in resource.attributes:
            _earlier(model, int(resource.attributes[name]), resource.rank, who, "texture2d")
    if resource.kind == "texture2dgroup":
        _earlier(model, int(resource.attributes["texid"]), resource.rank, who, "texture2d")
    elif resource.kind == "compositematerials":
        base = _earlier(model, int(resource.attributes["matid"]), resource.rank, who, "basematerials")
        if base is not None:
            for text in resource.attributes["matindices"].split():
                _in_range(model, int(text), len(base.members), f"an index of {who}")
    elif resource.kind == "multiproperties":
        _multi(model, resource)
    elif resource.kind == "slicestack":
        _slicestack(model, resource, resource.id in _solid_stacks(model))


def _earlier(model: Model, id_: int, rank: int, who: str, kind: str) -> Resource | None:
    resource = model.resources.get(id_)
    if resource is None and id_ in model.foreign:
        return None
    if resource is None or not resource.kind.endswith(kind):
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


def _solid_stacks(model: Model) -> set[int]:
    """Return slice stacks of objects that must be solids: their polygons must be closed."""
    named = (thing.attributes.get(_STACK, "") for thing in model.objects().values() if thing.type in SOLID)
    return {int(text) for text in named if schema.resource_id(text)}


def _slicestack(model: Model, resource: Resource, solid: bool) -> None:
    """Check slice 1.0: heights rise from zbottom; slices or references, not both; polygons name vertices that exist."""
    who = f"slicestack {resource.id}"
    kinds = {member[""] for member in resource.members}
    if {"slice", "sliceref"} <= kinds:
        model.add(P017, f"{who} has slices and references")
    height = float(resource.attributes.get("zbottom", 0))
    count, start, last = 0, -1, -1

    def close_polygon() -> None:
        if solid and start >= 0 and last != start:
            model.add(P017, f"a polygon of {who} is open")

    for member in resource.members:
        kind = member[""]
        if kind == "slice":
            close_polygon()
            top = float(member["ztop"])
            if top < height or (top == height and count):
                model.add(P017, f"the heights of {who} do not rise")
            height, count, start = top, 0, -1
        elif kind == "vertex":
            count += 1
        elif kind == "polygon":
            close_polygon()
            start = last = int(member["startv"])
            _in_range(model, start, count, f"a start vertex of {who}")
        elif kind == "segment":
            if int(member["v2"]) == last:
                model.add(P017, f"a segment of {who} has no length")
            last = int(member["v2"])
            _in_range(model, last, count, f"a segment's vertex in {who}")
        elif kind == "sliceref":
            path = member.get("slicepath", "")
            if path.lower().lstrip("/") == model.part:
                model.add(P019, f"{who} refers to its own part")
    close_polygon()


def _sliced(model: Model, resource: Object) -> None:
    stack = resource.attributes.get(_STACK)
    resolution = resource.attributes.get(f"{schema.SLICE} meshresolution", "fullres")
    who = f"object {resource.id}"
    if resolution not in ("fullres", "lowres"):
        model.add(P017, f"mesh resolution {resolution[:40]!r} of {who}")
    if stack is not None:
        if not schema.resource_id(stack):
            model.add(P017, f"slice stack {stack[:40]!r} of {who} is no id")
        else:
            _earlier(model, int(stack), resource.rank, who, "slicestack")


def _lattice(model: Model, resource: Object, lattice: dict[str, str]) -> None:
    """Check beam lattice 1.2: ends exist and differ, sets name beams that exist, clipping meshes come earlier."""
    who, count = f"the lattice of object {resource.id}", 0 if resource.mesh is None else len(resource.mesh.vertices)
    if resource.type not in SOLID:
        model.add(P017, f"{who} is in an object of type {resource.type}")
    for beam in resource.beams:
        ends = int(beam["v1"]), int(beam["v2"])
        if ends[0] == ends[1]:
            model.add(P017, f"a beam of {who} has the same start and end")
        _in_range(model, max(ends), count, f"a beam's end in {who}")
        if "r2" in beam and "r1" not in beam:
            model.add(P017, f"a beam of {who} has r2 without r1")
    for ball in resource.balls:
        _in_range(model, int(ball["vindex"]), count, f"a ball's vertex in {who}")
    for index in resource.beam_refs:
        _in_range(model, index, len(resource.beams), f"a beam set's index in {who}")
    if lattice.get("clippingmode", "none") != "none" and "clippingmesh" not in lattice:
        model.add(P019, f"{who} clips without a clipping mesh")
    for name in [name for name in ("clippingmesh", "representationmesh") if name in lattice]:
        other = model.resources.get(int(lattice[name]))
        if not isinstance(other, Object) or other.rank >= resource.rank:
            model.add(P019, f"the {name} of {who} is no earlier object")
        elif other.lattice is not None or other.components:
            model.add(P019, f"the {name} of {who} is no plain mesh")
    for holder, names in ((lattice, ["pindex"]), *((beam, ["p1", "p2"]) for beam in resource.beams)):
        group = _group(model, int(holder["pid"]), resource.rank, who) if "pid" in holder else None
        for name in names:
            if group is not None and name in holder:
                _in_range(model, int(holder[name]), len(group.members), f"a property index in {who}")


def _uuids(model: Model) -> None:
    """Check production 1.1: with the extension required, build, items, objects and components carry a UUID."""
    missing = [] if model.build_uuid or not model.has_build else ["the build"]
    if any(not item.uuid for item in model.items):
        missing.append("an item")
    for resource in model.objects().values():
        if f"{schema.PRODUCTION} UUID" not in resource.attributes:
            missing.append(f"object {resource.id}")
        if any(not use.uuid for use in resource.components):
            missing.append(f"a component of object {resource.id}")
    if missing:
        model.add_lenient(P017, f"no UUID for {', '.join(missing[:3])}")
