"""A 3MF model part, read element by element; vertices and triangles in uniform blocks are read by numpy."""

from __future__ import annotations

import math
import re
from array import array
from dataclasses import dataclass, field

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.geometry.boxes import Tick
from unitcad.meshcheck.findings import Location
from unitcad.meshcheck.geometry.mesh import LARGEST
from unitcad.meshcheck.readers import threemf_schema as schema
from unitcad.meshcheck.readers.rows import NOT_FINITE, SPACE, numbers_of, table_of
from unitcad.meshcheck.readers.threemf_package import forbidden, new_parser, parse
from unitcad.meshcheck.readers.threemf_schema import LINE, Model, Object, Resource, Triangles, Use
from unitcad.meshcheck.rules.f_file import F004, F011, Limits, Unreadable, not_a_number
from unitcad.meshcheck.rules.p_package import P010, P013, P015, P016, P017, P018
from unitcad.meshcheck.rules.s_scale import UNITS_MM
from unitcad.meshcheck.rules.v_values import V001

_NOT_FINITE = re.compile(NOT_FINITE, re.ASCII | re.IGNORECASE)


def coordinate(text: str, model: Model) -> float:
    """Return the number of an attribute's text; 0, with a finding, if it is none or is not finite as float32."""
    value = float(text) if schema.number(text) else math.nan
    if abs(value) <= LARGEST:
        return value
    if schema.number(text) or _NOT_FINITE.fullmatch(text.strip(" \t\r\n")):
        model.add(V001, "a vertex is not a finite float32 number")
    else:
        model.add(F004, not_a_number(text.strip(" \t\r\n")).message)
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


_BLOCK = 1 << 18  # bytes that stay in the processor's cache
_NEXT = re.compile(rb"<!--|<(vertices|triangles)>")
_XYZ = ("x", "y", "z")
_COLUMNS = ("v1", "v2", "v3", "p1", "p2", "p3", "pid")
_LISTS = {b"vertices": (b"vertex", _XYZ), b"triangles": (b"triangle", _COLUMNS)}
"""Elements of a list, and their attributes, of which each needs the first three."""
_PLAIN = {
    element: re.compile(rb'(?:\s*<%s(?:\s+[\w:.-]+="[^"<]*")*\s*/>)*\s*' % element) for element, _ in _LISTS.values()
}
"""Elements without content, one after the other."""
_WITHIN = re.compile(rb'"[ \t\r\n]+(\w+)="')
_AFTER = re.compile(rb'"[ \t\r\n]*/>[ \t\r\n]*')
_SHORTEST = 1500  # bytes; a shorter list costs the parser less
_MOST_DIGITS = 9  # an index goes to 2^31 - 1; longer ones are left to the parser
_QUOTE = ord('"')
_BLANKS = b" \t\r\n"
_DIGITS = table_of(b"0123456789")
_IN_NUMBERS = table_of(b"0123456789+-.eE")  # no blanks: each number fills its quotes


def cut_lists(data: bytes) -> tuple[bytes, list[tuple[int, Floats | Ints]]]:
    """Return a part without uniform blocks of its lists, and these blocks with their places in the rest, in order.

    All text between the numbers of a uniform block repeats. Vertices are (n, 3), triangles (m, 8). Line ends stay, so
    that the parser counts them.
    """
    cut: list[tuple[int, Floats | Ints]] = []
    if b"<![" in data or data.count(b"<?") > 1 or data.count(b"\r") != data.count(b"\r\n"):
        return data, cut
    pieces, size, at, line, place = list[bytes](), 0, 0, 1, 0
    while found := _NEXT.search(data, place):
        end = data.find(b"-->" if found[1] is None else b"</", found.end())
        if end < 0:
            break
        place = end if found[1] is None else found.end()
        if end - place < _SHORTEST:
            continue
        for begin, stop, block in _blocks_of(data, place, end, *_LISTS[found[1]]):
            line += data.count(b"\n", at, begin)
            if block.shape[1] > LINE:
                block[:, LINE] += line
            ends = data.count(b"\n", begin, stop)
            pieces += [data[at:begin], b"\n" * ends]
            size += begin - at
            cut.append((size, block))
            size, line, at = size + ends, line + ends, stop
    return b"".join([*pieces, data[at:]]), cut


def _blocks_of(
    data: bytes, at: int, end: int, element: bytes, known: tuple[str, ...]
) -> list[tuple[int, int, Floats | Ints]]:
    """Return the uniform blocks of a list with their ends; none if there is more in it than elements without content.

    Blocks in which an element needs a finding are left to the parser.
    """
    blocks, last = [], data.rfind(b"/>", at, end) + 2
    while at < last:
        stop = data.rfind(b"/>", at, min(at + _BLOCK, last)) + 2
        text = data[at:stop]
        values = _read_block(text, element, known)
        if values is not None:
            blocks.append((at, stop, values))
        elif not text or _PLAIN[element].fullmatch(text) is None:
            return []
        at = stop
    return [] if data[at:end].strip() else blocks


def _read_block(block: bytes, element: bytes, known: tuple[str, ...]) -> Floats | Ints | None:
    """Return the vertices or triangles of a block, with lines counted from its first; None if it is not uniform."""
    head = re.match(rb"[ \t\r\n]*<" + element + rb'[ \t\r\n]+(\w+)="', block)
    if head is None:
        return None
    names, at = [head[1].decode()], head.end()
    while within := _WITHIN.match(block, block.find(b'"', at)):
        names.append(within[1].decode())
        at = within.end()
    if len(set(names)) < len(names) or not set(known[:3]) <= set(names) <= set(known):
        return None
    text = np.frombuffer(block, np.uint8)
    quotes = np.flatnonzero(text == _QUOTE)
    if len(quotes) % (2 * len(names)) or _AFTER.fullmatch(block, int(quotes[-1])) is None:
        return None
    begin, end = quotes[::2].reshape(-1, len(names)) + 1, quotes[1::2].reshape(-1, len(names))
    size, whole = end - begin, known is _COLUMNS
    if size.min() < 1 or (whole and size.max() > _MOST_DIGITS):
        return None
    marks = np.zeros(len(text) + 1, np.int8)
    marks[begin], marks[end] = 1, -1
    inside = np.cumsum(marks[:-1], dtype=np.int8).view(bool)
    between = text[~inside].tobytes().lstrip(_BLANKS)
    period = between[: between.find(b"<", 1)] if len(begin) > 1 else between
    blanks = period[len(period.rstrip(_BLANKS)) :] if len(begin) > 1 else b""
    if between + blanks != period * len(begin) or not (_DIGITS if whole else _IN_NUMBERS)[text[inside]].all():
        return None
    numbers = numbers_of(np.where(inside, text, np.uint8(SPACE)).tobytes(), begin.size, integers=whole)
    if numbers is None:
        return None
    numbers = numbers.reshape(begin.shape)
    if known is _XYZ:
        values = numbers[:, [names.index(axis) for axis in known]]
        return values if (np.abs(values) <= LARGEST).all() else None
    values = np.full((len(numbers), LINE + 1), -1)
    values[:, [known.index(name) for name in names]] = numbers
    values[:, LINE] = block.count(b"\n", 0, block.index(b"<")) + period.count(b"\n") * np.arange(len(numbers))
    return values if values[:, LINE - 1].all() else None  # no resource has the id 0


_DEPTH = 60


@dataclass
class _Open:
    """An element that is being read."""

    space: str
    name: str
    rules: schema.ElementSchema | None
    counts: dict[str, int] = field(default_factory=dict)
    last: int = -1


# Text that programs write for a missing name. Other unprefixed names pass: consumers ignore them (core, 3.4.1).
_PLACEHOLDERS = {"undefined", "null"}


class _Reader:
    """Handlers for expat; its state is the stack of open elements and the object or resource being read."""

    def __init__(self, model: Model, limits: Limits, spent_faces: int, cut: list[tuple[int, Floats | Ints]]) -> None:
        self.model, self.limits, self.faces, self.cut = model, limits, spent_faces, cut[::-1]
        self.parser = new_parser(self.start, self.end)
        self.parser.StartNamespaceDeclHandler = self.namespace
        model.where = self._where
        self.stack: list[_Open] = [_Open("", "", None)]
        self.skip = 0
        self.rank = self.uses = 0
        self.resource: Resource | None = None
        self.names: set[str] = set()
        self.numbers, self.indices, self.beams, self.radius = array("d"), array("q"), array("d"), "1"
        self.vertices: list[Floats] = []
        self.rows: list[Ints] = []

    def _where(self) -> Location:
        inside = self.resource.id if isinstance(self.resource, Object) else None
        return Location(line=self.parser.CurrentLineNumber, object=None if inside is None else str(inside))

    def namespace(self, prefix: str | None, uri: str) -> None:
        self.model.namespaces[prefix or ""] = uri

    def start(self, name: str, flat: list[str]) -> None:
        if self.skip:
            self.skip += 1
            if self.skip > _DEPTH:
                raise F011.unreadable(f"elements nest deeper than {_DEPTH}")
            return
        if len(self.stack) > _DEPTH:
            raise F011.unreadable(f"elements nest deeper than {_DEPTH}")
        space, _, local = name.rpartition(" ")
        attributes = dict(zip(flat[::2], flat[1::2], strict=True))
        rules = schema.ELEMENTS.get(space, {}).get(local)
        self._child(space, local, rules)
        if space in schema.UNCHECKED:
            self.model.unchecked.setdefault(space, self._where())
        if space in _SHAPES and isinstance(self.resource, Object):
            self.resource.other_shape = True
        if rules is None:
            if self.stack[-1].name == "resources" and schema.resource_id(attributes.get("id", "")):
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

    def end(self, _: str) -> None:
        if self.skip:
            self.skip -= 1
            while self.cut and self.cut[-1][0] <= self.parser.CurrentByteIndex:
                self.cut.pop()
            return
        done = self.stack.pop()
        if done.rules is None:
            return
        for child, least, _most in done.rules.children:
            if done.counts.get(child, 0) < least:
                self.model.add(P017, f"<{done.name}> lacks <{child}>")
        if done.space == schema.CORE and done.name in ("vertices", "triangles"):
            self._take_blocks()
        elif done.space == schema.CORE and done.name == "mesh":
            self._flush()
            if isinstance(self.resource, Object):
                self.resource.mesh = Triangles(np.concatenate(self.vertices), np.concatenate(self.rows))
                self.resource.beams = np.array(self.beams).reshape(-1, 5)
            self.vertices, self.rows, self.beams = [], [], array("d")
        elif done.name == "object" and isinstance(self.resource, Object):
            shapes = (self.resource.mesh is not None) + bool(self.resource.components)
            if not shapes and not self.resource.other_shape:
                self.model.add(P017, f"object {self.resource.id} has neither mesh nor components")
            elif shapes == 2:
                self.model.add(P017, f"object {self.resource.id} has a mesh and components")
        if self.stack[-1].name == "resources":
            self.resource = None

    def _child(self, space: str, local: str, rules: schema.ElementSchema | None) -> None:
        """Check that this child may stand here, and in this order."""
        parent = self.stack[-1]
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
                add = self.model.add_lenient if local == "metadata" else self.model.add
                add(P017, f"<{local}> is out of order in <{parent.name}>")
            parent.last = max(parent.last, place)
            return
        if rules is None or parent.name != "resources":
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
                self.model.add_lenient(P017, f"unknown attribute {name!r} of <{local}>", "info")
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
        if space in (schema.BEAM, schema.BALLS):
            self._take_lattice(local, attributes)
        elif "id" in attributes and parent == "resources":
            self._resource(Resource(local, int(attributes["id"]), self.rank, attributes))
        elif self.resource is not None and not isinstance(self.resource, Object):
            self.resource.members.append({"": local, **attributes})
            if len(self.resource.members) > self.limits.max_faces:
                raise F011.unreadable("more properties than --max-faces")

    def _take_lattice(self, local: str, attributes: dict[str, str]) -> None:
        if local == "beamlattice":
            self.radius = attributes["radius"]
            if isinstance(self.resource, Object):
                self.resource.lattice = attributes
        elif local == "beam":
            first = attributes.get("r1", self.radius)
            ends = attributes["v1"], attributes["v2"], first, attributes.get("r2", first)
            self.beams.extend([*map(float, ends), self.parser.CurrentLineNumber])
            self._count_faces(1)
        elif local == "ref" and isinstance(self.resource, Object):
            self.resource.beam_sets.append(int(attributes["index"]))
        elif local == "ballref" and isinstance(self.resource, Object):
            self.resource.ball_sets.append(int(attributes["index"]))
        elif local == "ball" and isinstance(self.resource, Object):
            self.resource.balls.append((int(attributes["vindex"]), self.parser.CurrentLineNumber))
            self._count_faces(1)

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
        if self.model.unit not in UNITS_MM:
            self.model.add(P010, f"unit {self.model.unit[:40]!r}")
        for prefix in attributes.get("requiredextensions", "").split():
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

    def _take_blocks(self) -> None:
        """Keep the blocks that were cut out in front of what the parser reports."""
        while self.cut and self.cut[-1][0] <= self.parser.CurrentByteIndex:
            self._flush()
            _, block = self.cut.pop()
            if block.shape[1] > LINE:
                self.rows.append(block)
                self._count_faces(len(block))
            else:
                self.vertices.append(block)

    def _take_triangle(self, attributes: dict[str, str]) -> None:
        self._take_blocks()
        self.indices.extend(int(attributes.get(name, -1)) for name in _COLUMNS)
        self.indices.append(self.parser.CurrentLineNumber)
        self._count_faces(1)

    def _count_faces(self, number: int) -> None:
        self.faces += number
        if self.faces > self.limits.max_faces:
            raise F011.unreadable(f"more faces than --max-faces {self.limits.max_faces}")

    def _take_vertex(self, attributes: dict[str, str]) -> None:
        self._take_blocks()
        self.numbers.extend(coordinate(attributes[axis], self.model) for axis in _XYZ)

    def _take_component(self, attributes: dict[str, str]) -> None:
        if isinstance(self.resource, Object):
            self.resource.components.append(self._use(attributes))

    def _take_item(self, attributes: dict[str, str]) -> None:
        self.model.items.append(self._use(attributes))

    def _take_build(self, attributes: dict[str, str]) -> None:
        self.model.has_build = True

    def _use(self, attributes: dict[str, str]) -> Use:
        self.uses += 1
        if self.uses > self.limits.max_instances:
            raise F011.unreadable(f"more items and components than the limit of {self.limits.max_instances} instances")
        path = attributes.get(f"{schema.PRODUCTION} path", "")
        matrix = transform(attributes.get("transform"), self.model)
        return Use(int(attributes["objectid"]), path, matrix, self.rank, self.parser.CurrentLineNumber)

    def _flush(self) -> None:
        """Keep the vertices and triangles that the parser reported."""
        self.vertices.append(np.array(self.numbers).reshape(-1, 3))
        self.rows.append(np.array(self.indices).reshape(-1, LINE + 1))
        self.numbers, self.indices = array("d"), array("q")


# Extensions whose elements take the place of an object's mesh, or stand on its vertices.
_SHAPES = {schema.BEAM, schema.BOOLEAN, schema.DISPLACEMENT, schema.OLD_DISPLACEMENT, schema.IMPLICIT}


def read_model(
    data: bytes, part: str, limits: Limits, tick: Tick, spent_faces: int = 0, *, strict: bool = False
) -> Model:
    """Read one model part. Schema faults are the model's findings; raises `Unreadable` if XML or a limit ends it."""
    model = Model(part, strict=strict)
    text, cut = cut_lists(data)
    try:
        parse(_Reader(model, limits, spent_faces, cut).parser, text, part, tick)
    except Unreadable as stop:
        raise Unreadable(*model.findings, *stop.findings) from stop
    return model
