"""A 3MF model part read element by element into plain data, against the schema, within the limits.

Vertices and triangles go into arrays in batches; their text is never held as a whole. Uniform blocks
of them are read at once (`uniform_blocks`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Location
from unitcad.meshcheck.geometry.mesh import LARGEST
from unitcad.meshcheck.readers.threemf import elements
from unitcad.meshcheck.readers.threemf.model_data import LINE, Model, Object, Resource, Triangles, Use
from unitcad.meshcheck.readers.threemf.numeric_text import coordinate, transform
from unitcad.meshcheck.readers.threemf.uniform_blocks import UniformBlock, rest_for_parser
from unitcad.meshcheck.readers.threemf.xml_stream import forbidden, new_parser, stream
from unitcad.meshcheck.rules.f_file import F011, Limits, Unreadable
from unitcad.meshcheck.rules.p_package import P010, P016, P017, P018
from unitcad.meshcheck.rules.v_values import V001

_BATCH = 50_000
_DEPTH = 60


@dataclass
class _Open:
    """An element that is being read."""

    space: str
    name: str
    rules: elements.ElementSchema | None
    counts: dict[str, int] = field(default_factory=dict)
    last: int = -1
    told: bool = False


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
        self.regular: set[tuple[str, ...]] = set()
        self.numbers: list[str] = []
        self.lines: list[int] = []
        self.vertices: list[Floats] = []
        self.n_vertices = 0
        self.beyond = False
        self.triangles: list[tuple[int, ...]] = []
        self.rows: list[Ints] = []

    def _where(self) -> Location:
        inside = self.resource.id if isinstance(self.resource, Object) else None
        return Location(line=self.parser.CurrentLineNumber, object=None if inside is None else str(inside))

    def namespace(self, prefix: str | None, uri: str) -> None:
        self.model.namespaces[prefix or ""] = uri

    def inside(self, fed: int) -> tuple[int, str]:
        """Return the number of open elements and the name of the innermost one if it belongs to the core.

        The name is empty while the parser holds back some of the `fed` bytes.
        """
        last = self.stack[-1]
        whole = self.parser.CurrentByteIndex == fed and not self.skip and last.space == elements.CORE
        return len(self.stack) + self.skip, last.name if whole else ""

    def take(self, name: str, found: UniformBlock) -> bool:
        """Keep the elements of a uniform block; return False where one of them needs a finding."""
        if name == "vertices":
            values = np.stack([found.columns[axis] for axis in _XYZ], axis=1)
            if not (np.abs(values) <= LARGEST).all():
                return False
            self._flush_vertices()
            self._keep_vertices(values)
            return True
        if "pid" in found.columns and not found.columns["pid"].all():
            return False
        self._flush_triangles()
        rows = np.full((len(found.lines), LINE + 1), -1)
        for i, column in enumerate(_COLUMNS):
            if column in found.columns:
                rows[:, i] = found.columns[column]
        rows[:, LINE] = self.parser.CurrentLineNumber + found.lines
        self.rows.append(rows)
        self.rank += len(rows)
        self._count_faces(len(rows))
        return True

    def start(self, name: str, flat: list[str]) -> None:
        if self.skip:
            self.skip += 1
            if self.skip > _DEPTH:
                raise F011.unreadable(f"elements nest deeper than {_DEPTH}")
            return
        above = self.stack[-1]
        if name == _VERTEX and flat[::2] == _XYZ and above.name == "vertices" and above.space == elements.CORE:
            self.numbers += flat[1::2]
            self.lines.append(self.parser.CurrentLineNumber)
            self.stack.append(_LEAF)
            if len(self.numbers) >= 3 * _BATCH:
                self._flush_vertices()
            return
        if len(self.stack) > _DEPTH:
            raise F011.unreadable(f"elements nest deeper than {_DEPTH}")
        space, _, local = name.rpartition(" ")
        attributes = dict(zip(flat[::2], flat[1::2], strict=True))
        rules = elements.ELEMENTS.get(space, {}).get(local)
        self._child(space, local, rules)
        if rules is None:
            if space in _SHAPES and isinstance(self.resource, Object):
                self.resource.other_shape = True
            if self.stack[-1].name == "resources" and elements.resource_id(attributes.get("id", "")):
                self._once(int(attributes["id"]))
                self.model.foreign.add(int(attributes["id"]))
            for attribute in attributes:
                if why := forbidden(attribute):
                    self.model.add(P017, f"{why} in <{local}>")
            self.skip = 1
            return
        good = self._attributes(local, rules, attributes)
        self.stack.append(_Open(space, local, rules))
        self.rank += 1
        if good:
            self._take(space, local, attributes)

    def text_inside(self, text: str) -> None:
        """Find fault with text in an element that holds none."""
        above = self.stack[-2] if self.stack[-1] is _LEAF else self.stack[-1]
        if not self.skip and not above.told and above.name not in ("", "metadata") and text.strip(" \t\r\n"):
            above.told = True
            self.model.add_lenient(P017, f"text inside <{above.name}>")

    def end(self, _: str) -> None:
        if self.skip:
            self.skip -= 1
            return
        done = self.stack.pop()
        if done is _LEAF or done.rules is None:
            return
        for child, least, _most in done.rules.children:
            if done.counts.get(child, 0) < least:
                self.model.add(P017, f"<{done.name}> lacks <{child}>")
        if done.space == elements.CORE and done.name == "vertices":
            self._flush_vertices()
        elif done.space == elements.CORE and done.name == "triangles":
            self._flush_triangles()
        elif done.space == elements.CORE and done.name == "mesh":
            self._close_mesh()
        elif done.name == "object" and isinstance(self.resource, Object):
            self._close_object(self.resource)
        if self.stack[-1].name == "resources":
            self.resource = None

    def _child(self, space: str, local: str, rules: elements.ElementSchema | None) -> None:
        """Check that this child may stand here, and in this order."""
        parent = self.stack[-1]
        if parent is _LEAF:
            self.model.add(P017, f"<{local}> inside <vertex>")
            return
        if not parent.name:
            if (space, local) != (elements.CORE, "model"):
                raise P017.unreadable(f"the root is <{local}> in {space or 'no namespace'!r}, not the core's <model>",
                            places=[Location(part=self.model.part)])  # fmt: skip
            return
        if space != parent.space:
            if not space:
                self.model.add(P017, f"<{local}> without a namespace")
            elif space == elements.CORE:
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
        if space in (elements.CORE, elements.MATERIAL, elements.SLICE, elements.BEAM) and not (
            rules is not None and parent.name == "resources"
        ):
            self.model.add(P017, f"<{local}> inside <{parent.name}>")

    def _attributes(self, local: str, rules: elements.ElementSchema, attributes: dict[str, str]) -> bool:
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
        if space == elements.CORE:
            take = getattr(self, f"_take_{local}", None)
            if take is not None:
                take(attributes)
                return
        if "id" in attributes and parent == "resources":
            self._resource(Resource(local, int(attributes["id"]), self.rank, attributes))
        elif space == elements.BEAM or space == elements.BALLS:
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
        if self.model.unit not in elements.UNITS:
            self.model.add(P010, f"unit {self.model.unit[:40]!r}")
        self.model.required = attributes.get("requiredextensions", "").split()
        for prefix in self.model.required:
            uri = self.model.namespaces.get(prefix)
            if uri is None:
                self.model.add(P016, f"required extension {prefix!r} has no namespace")
            elif uri not in elements.KNOWN:
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

    def _take_triangle(self, attributes: dict[str, str]) -> None:
        row = tuple(int(attributes.get(name, -1)) for name in _COLUMNS)
        self.triangles.append((*row, self.parser.CurrentLineNumber))
        self._count_faces(1)
        if len(self.triangles) >= _BATCH:
            self._flush_triangles()

    def _count_faces(self, number: int) -> None:
        self.faces += number
        if self.faces > self.limits.max_faces:
            raise F011.unreadable(f"more faces than --max-faces {self.limits.max_faces}")

    def _take_vertex(self, attributes: dict[str, str]) -> None:
        self.numbers += [attributes["x"], attributes["y"], attributes["z"]]
        self.lines.append(self.parser.CurrentLineNumber)

    def _take_component(self, attributes: dict[str, str]) -> None:
        if isinstance(self.resource, Object):
            self.resource.components.append(self._use(attributes))

    def _take_item(self, attributes: dict[str, str]) -> None:
        self.model.items.append(self._use(attributes))

    def _take_build(self, attributes: dict[str, str]) -> None:
        self.model.has_build = True
        self.model.build_uuid = f"{elements.PRODUCTION} UUID" in attributes

    def _use(self, attributes: dict[str, str]) -> Use:
        self.uses += 1
        if self.uses > self.limits.max_instances:
            raise F011.unreadable(f"more items and components than the limit of {self.limits.max_instances} instances")
        uuid = attributes.get(f"{elements.PRODUCTION} UUID")
        if uuid is not None and not elements.uuid(uuid):
            self.model.add(P017, f"UUID {uuid[:40]!r} is none")
        path = attributes.get(f"{elements.PRODUCTION} path", "")
        matrix = transform(attributes.get("transform"), self.model, self.regular)
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

    def _flush_vertices(self) -> None:
        if not self.numbers:
            return
        try:
            text = "".join(self.numbers)
            if not text.isascii() or "_" in text:  # which Python takes for a number's
                raise ValueError(text[:40])
            values = np.array(self.numbers, dtype=np.float64)
        except ValueError:
            values = np.array([coordinate(text, self.model, self.lines[i // 3]) for i, text in enumerate(self.numbers)])
        bad = np.flatnonzero(~(np.abs(values) <= LARGEST))
        if len(bad):
            if not self.beyond:
                self.model.add(V001, "a vertex is not a finite float32 number", line=self.lines[bad[0] // 3])
            self.beyond = True
            values = np.nan_to_num(values, nan=0.0, posinf=0.0, neginf=0.0)
        self.numbers, self.lines = [], []
        self._keep_vertices(values.reshape(-1, 3))

    def _keep_vertices(self, values: Floats) -> None:
        self.vertices.append(values)
        self.n_vertices += len(values)
        if self.n_vertices > 3 * self.limits.max_faces + 3:
            raise F011.unreadable("more vertices than three times --max-faces")

    def _flush_triangles(self) -> None:
        if self.triangles:
            self.rows.append(np.array(self.triangles, dtype=np.int64))
            self.triangles = []

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
_SHAPES = {elements.BOOLEAN, elements.DISPLACEMENT, elements.OLD_DISPLACEMENT, elements.IMPLICIT}
_XYZ = ["x", "y", "z"]
_COLUMNS = ("v1", "v2", "v3", "p1", "p2", "p3", "pid")
_LEAF = _Open(elements.CORE, "vertex", None)
_VERTEX = f"{elements.CORE} vertex"


def read_model(
    chunks: Iterable[bytes], part: str, limits: Limits, spent_faces: int = 0, *, strict: bool = False
) -> Model:
    """Read one model part. Schema faults are the model's findings; raises `Unreadable` where XML or a limit ends it."""
    model = Model(part, strict=strict)
    reader = _Reader(model, limits, spent_faces)
    try:
        stream(rest_for_parser(chunks, reader), part, reader.start, reader.end, reader.namespace, reader.parser)
    except Unreadable as stop:
        raise Unreadable(*model.findings, *stop.findings) from stop
    return model
