"""A 3MF model part, read element by element; the numbers of vertices and triangles become arrays in batches."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Location
from unitcad.meshcheck.geometry.mesh import LARGEST
from unitcad.meshcheck.readers import threemf_schema as schema
from unitcad.meshcheck.readers.rows import NOT_FINITE
from unitcad.meshcheck.readers.threemf_package import forbidden, new_parser, stream
from unitcad.meshcheck.readers.threemf_schema import LINE, Model, Object, Resource, Triangles, Use
from unitcad.meshcheck.rules.f_file import F004, F011, Limits, Unreadable, not_a_number
from unitcad.meshcheck.rules.p_package import P010, P013, P015, P016, P017, P018
from unitcad.meshcheck.rules.v_values import V001

_NOT_FINITE = re.compile(NOT_FINITE, re.ASCII | re.IGNORECASE)


def coordinate(text: str, model: Model, line: int) -> float:
    """Return the number of an attribute's text; NaN for one that is not finite, 0 with a finding for no number."""
    text = text.strip(" \t\r\n")
    if schema.number(text):
        return float(text)
    if _NOT_FINITE.fullmatch(text):
        return math.nan
    model.add(F004, not_a_number(text).message, line=line)
    return 0.0


def transform(text: str | None, model: Model) -> Floats:
    """Return the transform (4, 3) of an attribute's text; the identity, with a finding of `model`, if it is none."""
    identity = np.vstack([np.eye(3), np.zeros(3)])
    if text is None:
        return identity
    parts = schema.words(text)
    if len(parts) == 12 and all(schema.number(part) for part in parts):
        matrix = np.array([float(part) for part in parts]).reshape(4, 3)
        if not (np.abs(matrix) <= LARGEST).all():
            model.add(P013, f'transform="{text[:60]}" is not twelve float32 numbers')
            return identity
        det = float(np.linalg.det(matrix[:3]))
        scale = float(np.prod(np.linalg.norm(matrix[:3], axis=1)))
        if not math.isfinite(det) or abs(det) <= 1e-12 * scale:
            model.add(P013, "a transform has determinant zero")
        elif det < 0:
            model.add(P015, "a transform mirrors")
        return matrix
    rule = P013 if len(parts) == 12 and any(_NOT_FINITE.fullmatch(part) for part in parts) else P017
    model.add(rule, f'transform="{text[:60]}" is not twelve numbers')
    return identity


_BATCH = 50_000
_DEPTH = 60
_DIGITS = 10  # 2^31 has as many


@dataclass
class _Open:
    """An element that is being read."""

    space: str
    name: str
    rules: schema.ElementSchema | None
    counts: dict[str, int] = field(default_factory=dict)
    last: int = -1
    told: bool = False
    leaf: str = ""  # the name of its elements if they are read in batches


# What programs write where a name is missing. Other unprefixed names pass: consumers ignore them (core, 3.4.1).
_PLACEHOLDERS = {"undefined", "null"}


class _Reader:
    """Handlers for expat; its state is the stack of open elements and the object or resource being read."""

    def __init__(self, model: Model, limits: Limits, spent_faces: int) -> None:
        self.model, self.limits, self.faces = model, limits, spent_faces
        self.parser = new_parser()
        self.parser.buffer_text = False  # the line of a text is that of its event
        self.parser.CharacterDataHandler = self.text_inside
        model.where = self._where
        self.stack: list[_Open] = [_Open("", "", None)]
        self.skip = 0
        self.rank = self.uses = 0
        self.resource: Resource | None = None
        self.names: set[str] = set()
        self.leaf, self.leaf_names = "", list[str]()
        self.texts: list[str] = []
        self.lines: list[int] = []
        self.line = 0
        self.vertices: list[Floats] = []
        self.n_vertices = 0
        self.beyond = False
        self.rows: list[Ints] = []

    def _where(self) -> Location:
        inside = self.resource.id if isinstance(self.resource, Object) else None
        line = self.line or self.parser.CurrentLineNumber
        return Location(line=line, object=None if inside is None else str(inside))

    def namespace(self, prefix: str | None, uri: str) -> None:
        self.model.namespaces[prefix or ""] = uri

    def start(self, name: str, flat: list[str]) -> None:
        if self.skip:
            self.skip += 1
            if self.skip > _DEPTH:
                raise F011.unreadable(f"elements nest deeper than {_DEPTH}")
            return
        above = self.stack[-1]
        if name == above.leaf:
            self._leaf(name, flat)
            return
        self.flush()
        if len(self.stack) > _DEPTH:
            raise F011.unreadable(f"elements nest deeper than {_DEPTH}")
        space, _, local = name.rpartition(" ")
        attributes = dict(zip(flat[::2], flat[1::2], strict=True))
        rules = schema.ELEMENTS.get(space, {}).get(local)
        self._child(space, local, rules)
        if rules is None:
            if space in _SHAPES and isinstance(self.resource, Object):
                self.resource.other_shape = True
            if self.stack[-1].name == "resources" and schema.resource_id(attributes.get("id", "")):
                self._once(int(attributes["id"]))
                self.model.foreign.add(int(attributes["id"]))
            for attribute in attributes:
                if why := forbidden(attribute):
                    self.model.add(P017, f"{why} in <{local}>")
            self.skip = 1
            return
        good = self._attributes(local, rules, attributes)
        self.stack.append(_Open(space, local, rules, leaf=_LISTS.get(name, "")))
        self.rank += 1
        if good:
            self._take(space, local, attributes)

    def _leaf(self, name: str, flat: list[str]) -> None:
        """Let a vertex or a triangle wait for others with the same attributes."""
        names = flat[::2]
        if names != self.leaf_names or name != self.leaf or len(self.lines) >= _BATCH:
            self.flush()
            self.leaf, self.leaf_names = name, names
        self.texts += flat[1::2]
        self.lines.append(self.parser.CurrentLineNumber)
        self.stack.append(_LEAVES[name])

    def text_inside(self, text: str) -> None:
        """Find fault with text in an element that holds none."""
        above = self.stack[-1] if self.stack[-1].rules else self.stack[-2]
        if not self.skip and not above.told and above.name not in ("", "metadata") and text.strip(" \t\r\n"):
            above.told = True
            self.model.add_lenient(P017, f"text inside <{above.name}>")

    def end(self, _: str) -> None:
        if self.skip:
            self.skip -= 1
            return
        done = self.stack.pop()
        if done.rules is None:
            return
        self.flush()
        for child, least, _most in done.rules.children:
            if done.counts.get(child, 0) < least:
                self.model.add(P017, f"<{done.name}> lacks <{child}>")
        if done.space == schema.CORE and done.name == "mesh":
            self._close_mesh()
        elif done.name == "object" and isinstance(self.resource, Object):
            self._close_object(self.resource)
        if self.stack[-1].name == "resources":
            self.resource = None

    def _child(self, space: str, local: str, rules: schema.ElementSchema | None) -> None:
        """Check that this child may stand here, and in this order."""
        parent = self.stack[-1]
        if parent.name and parent.rules is None:
            self.model.add(P017, f"<{local}> inside <{parent.name}>")
            return
        if not parent.name:
            if (space, local) != (schema.CORE, "model"):
                raise P017.unreadable(f"the root is <{local}> in {space or 'no namespace'!r}, not the core's <model>",
                            places=[Location(part=self.model.part)])  # fmt: skip
            return
        if space != parent.space:
            if not space:
                self.model.add(P017, f"<{local}> without a namespace")
            elif space == schema.CORE:
                self.model.add(P017, f"<{local}> inside <{parent.name}>")
            return
        assert parent.rules is not None
        for place, (name, _, most) in enumerate(parent.rules.children):
            if name != local:
                continue
            parent.counts[name] = parent.counts.get(name, 0) + 1
            if parent.counts[name] == most + 1:
                self.model.add(P017, f"<{parent.name}> has <{local}> more than once")
            if parent.rules.ordered and place < parent.last:
                self.model.add(P017, f"<{local}> is out of order in <{parent.name}>")
            parent.last = max(parent.last, place)
            return
        if space in (schema.CORE, schema.MATERIAL, schema.SLICE, schema.BEAM) and not (
            rules is not None and parent.name == "resources"
        ):
            self.model.add(P017, f"<{local}> inside <{parent.name}>")

    def _attributes(self, local: str, rules: schema.ElementSchema, attributes: dict[str, str]) -> bool:
        """Check them; return whether all required ones are there and well typed. Others of a wrong type are dropped."""
        good = True
        for name in rules.required:
            if name not in attributes:
                self.model.add(P017, f"<{local}> lacks {name}")
                good = False
        for name, value in list(attributes.items()):
            test = rules.required.get(name) or rules.optional.get(name)
            if test is not None:
                if not test(value):
                    self.model.add(P017, f'{name}="{value[:40]}" of <{local}> is not of its type')
                    good = good and name not in rules.required
                    del attributes[name]
            elif why := forbidden(name):
                self.model.add(P017, f"{why} in <{local}>")
            elif name.startswith("http://www.w3.org/XML/1998/namespace ") and local != "model":
                self.model.add(P017, f"attribute xml:lang in <{local}>")
            elif " " not in name:
                self.model.add_lenient(P017, f"unknown attribute {name!r} of <{local}>")
            elif not rules.open_ and " " in name:
                self.model.add(P017, f"attribute {name.split()[-1]!r} of <{local}>, which takes none of others")
        return good

    def _take(self, space: str, local: str, attributes: dict[str, str]) -> None:
        """Keep what the element says."""
        parent = self.stack[-2].name
        if space == schema.CORE:
            take = getattr(self, f"_take_{local}", None)
            if take is not None:
                take(attributes)
                return
        if "id" in attributes and parent == "resources":
            self._resource(Resource(local, int(attributes["id"]), self.rank, attributes))
        elif space == schema.BEAM or space == schema.BALLS:
            self._take_lattice(local, attributes)
        elif self.resource is not None and not isinstance(self.resource, Object):
            self.resource.members.append({"": local, **attributes})
            if len(self.resource.members) > self.limits.max_faces:
                raise F011.unreadable("more properties than --max-faces")

    def _once(self, id_: int) -> None:
        if id_ in self.model.resources or id_ in self.model.foreign:
            self.model.add(P018, f"id {id_} twice")

    def _resource(self, resource: Resource) -> None:
        self._once(resource.id)
        resource.line = self.parser.CurrentLineNumber
        self.model.resources.setdefault(resource.id, resource)
        self.resource = resource

    def _take_model(self, attributes: dict[str, str]) -> None:
        self.model.unit = attributes.get("unit", "millimeter")
        if self.model.unit not in schema.UNITS:
            self.model.add(P010, f"unit {self.model.unit[:40]!r}")
        self.model.required = attributes.get("requiredextensions", "").split()
        for prefix in self.model.required:
            uri = self.model.namespaces.get(prefix)
            if uri is None:
                self.model.add(P016, f"required extension {prefix!r} has no namespace")
            elif uri not in schema.KNOWN:
                self.model.add(P016, f"required extension {uri!r} is not known")

    def _take_metadata(self, attributes: dict[str, str]) -> None:
        name = attributes["name"]
        prefix, colon, _ = name.partition(":")
        if not name.strip() or name.lower() in _PLACEHOLDERS:
            self.model.add(P017, f"metadata without a name ({name!r})")
        elif colon and prefix not in self.model.namespaces:
            self.model.add(P017, f"metadata name {name!r} has no namespace")
        if self.stack[-2].name == "model":
            if name in self.names:
                self.model.add_lenient(P017, f"metadata {name!r} twice")
            self.names.add(name)

    def _take_object(self, attributes: dict[str, str]) -> None:
        kind = attributes.get("type", "model")
        self._resource(Object("object", int(attributes["id"]), self.rank, attributes, type=kind))

    def _take_component(self, attributes: dict[str, str]) -> None:
        if isinstance(self.resource, Object):
            self.resource.components.append(self._use(attributes))

    def _take_item(self, attributes: dict[str, str]) -> None:
        self.model.items.append(self._use(attributes))

    def _take_build(self, attributes: dict[str, str]) -> None:
        self.model.has_build = True
        self.model.build_uuid = f"{schema.PRODUCTION} UUID" in attributes

    def _use(self, attributes: dict[str, str]) -> Use:
        self.uses += 1
        if self.uses > self.limits.max_instances:
            raise F011.unreadable(f"more items and components than the limit of {self.limits.max_instances} instances")
        uuid = attributes.get(f"{schema.PRODUCTION} UUID")
        if uuid is not None and not schema.uuid(uuid):
            self.model.add(P017, f"UUID {uuid[:40]!r} is none")
        path = attributes.get(f"{schema.PRODUCTION} path", "")
        matrix = transform(attributes.get("transform"), self.model)
        return Use(
            int(attributes["objectid"]), path, matrix, self.rank, uuid is not None, self.parser.CurrentLineNumber
        )

    def _take_lattice(self, local: str, attributes: dict[str, str]) -> None:
        if not isinstance(self.resource, Object):
            return
        if local == "beamlattice":
            self.resource.lattice = attributes
        elif local == "beam":
            self.resource.beams.append(attributes)
        elif local == "ball":
            self.resource.balls.append(attributes)
        elif local == "ref":
            self.resource.beam_refs.append(int(attributes["index"]))
        if len(self.resource.beams) > self.limits.max_faces:
            raise F011.unreadable("more beams than --max-faces")

    def flush(self) -> None:
        """Keep the vertices or triangles that wait; those that are odd are checked one by one."""
        leaf, names, texts, lines = self.leaf, self.leaf_names, self.texts, self.lines
        self.leaf, self.leaf_names, self.texts, self.lines = "", [], [], []
        if not lines:
            return
        local, n = leaf.split()[-1], len(names)
        needed = _XYZ if local == "vertex" else _COLUMNS
        if not set(needed[:3]) <= set(names) <= set(needed) or (local == "triangle" and not _plain(names, texts)):
            rules, good = schema.ELEMENTS[schema.CORE][local], list[tuple[int, dict[str, str]]]()
            for i, self.line in enumerate(lines):
                attributes = dict(zip(names, texts[i * n : (i + 1) * n], strict=True))
                if self._attributes(local, rules, attributes):
                    good.append((self.line, attributes))
            self.line = 0
            lines, names = [line for line, _ in good], needed
            texts = [attributes.get(name, "-1") for _, attributes in good for name in needed]
        if local == "vertex":
            self._keep_vertices(names, texts, lines)
        else:
            self._keep_triangles(names, texts, lines)

    def _keep_vertices(self, names: list[str], texts: list[str], lines: list[int]) -> None:
        try:
            text = "".join(texts)
            if not text.isascii() or "_" in text:  # which Python takes for a number's
                raise ValueError(text[:40])
            values = np.array(texts, dtype=np.float64)
        except ValueError:
            n = len(names)
            values = np.array([coordinate(text, self.model, lines[i // n]) for i, text in enumerate(texts)])
        bad = np.flatnonzero(~(np.abs(values) <= LARGEST))
        if len(bad):
            if not self.beyond:
                self.model.add(V001, "a vertex is not a finite float32 number", line=lines[bad[0] // len(names)])
            self.beyond = True
            values = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
        self.vertices.append(values.reshape(-1, 3)[:, [names.index(axis) for axis in _XYZ]])
        self.n_vertices += len(lines)
        if self.n_vertices > 3 * self.limits.max_faces + 3:
            raise F011.unreadable("more vertices than three times --max-faces")

    def _keep_triangles(self, names: list[str], texts: list[str], lines: list[int]) -> None:
        rows = np.full((len(lines), LINE + 1), -1)
        rows[:, [_COLUMNS.index(name) for name in names]] = np.array(texts, dtype=np.int64).reshape(-1, len(names))
        rows[:, LINE] = lines
        self.rows.append(rows)
        self.faces += len(rows)
        if self.faces > self.limits.max_faces:
            raise F011.unreadable(f"more faces than --max-faces {self.limits.max_faces}")

    def _close_mesh(self) -> None:
        if isinstance(self.resource, Object):
            vertices = np.concatenate([np.empty((0, 3)), *self.vertices])
            self.resource.mesh = Triangles(vertices, np.concatenate([np.empty((0, LINE + 1), np.int64), *self.rows]))
        self.vertices, self.n_vertices, self.rows, self.beyond = [], 0, [], False

    def _close_object(self, resource: Object) -> None:
        if resource.mesh is None and not resource.components and not resource.other_shape:
            self.model.add(P017, f"object {resource.id} has neither mesh nor components")
        if resource.mesh is not None and resource.components:
            self.model.add(P017, f"object {resource.id} has a mesh and components")


# Extensions whose elements take the place of an object's mesh.
_SHAPES = {
    schema.BOOLEAN,
    schema.DISPLACEMENT,
    schema.OLD_DISPLACEMENT,
    schema.IMPLICIT,
}
_XYZ = ["x", "y", "z"]
_COLUMNS = ["v1", "v2", "v3", "p1", "p2", "p3", "pid"]
_LISTS = {
    f"{schema.CORE} vertices": f"{schema.CORE} vertex",
    f"{schema.CORE} triangles": f"{schema.CORE} triangle",
}
_LEAVES = {name: _Open(schema.CORE, name.split()[-1], None) for name in _LISTS.values()}


def _plain(names: list[str], texts: list[str]) -> bool:
    """Test whether all attributes of triangles are of their types, written in nothing but digits."""
    digits = "".join(texts)
    return (
        digits.isascii()
        and digits.isdecimal()
        and 0 < min(map(len, texts)) <= max(map(len, texts)) < _DIGITS
        and ("pid" not in names or all(map(int, texts[names.index("pid") :: len(names)])))
    )


def read_model(
    chunks: Iterable[bytes], part: str, limits: Limits, spent_faces: int = 0, *, strict: bool = False
) -> Model:
    """Read one model part. Schema faults are the model's findings; raises `Unreadable` where XML or a limit ends it."""
    model = Model(part, strict=strict)
    reader = _Reader(model, limits, spent_faces)
    try:
        try:
            stream(chunks, part, reader.start, reader.end, reader.namespace, reader.parser)
        finally:
            reader.flush()
    except Unreadable as stop:
        raise Unreadable(*model.findings, *stop.findings) from stop
    return model
