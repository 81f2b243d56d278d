"""glTF 2.0 in one binary file (GLB), as Khronos defines it: the triangles of the scene, each node in its place.

glTF counts in metres with y up; meshes come out in mm with z up, that is x, -z, y, rounded to float32, which is the
format's precision. Materials, textures, skins, morph targets and animations are left out. Strips and fans, compression
such as Draco's, sparse accessors and buffers outside the file are refused, never skipped.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, TypeVar

import msgspec
import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Finding, Location, counted
from unitcad.meshcheck.geometry.mesh import Mesh, Source
from unitcad.meshcheck.readers.rows import Polygons, mesh_of
from unitcad.meshcheck.rules.f_file import F001, F002, F003, F004, F006, F008, F011, Deadline, Limits
from unitcad.meshcheck.rules.p_package import P007, P009, P011, P012, P013, P016

_MOST_JSON = 100_000_000  # bytes
_JSON, _BIN = 0x4E4F534A, 0x004E4942
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_TRIANGLES = 4
_HARMLESS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_xmp")
_NAME = 100  # characters of a name that are kept
_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
_Count = Annotated[int, msgspec.Meta(ge=0, lt=2**53)]
_T = TypeVar("_T")


class _Node(msgspec.Struct):
    name: str = ""
    children: list[int] = []
    mesh: int | None = None
    matrix: Annotated[list[float], msgspec.Meta(min_length=16, max_length=16)] | None = None
    rotation: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0)
    scale: tuple[float, float, float] = (1.0, 1.0, 1.0)
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)


class _Primitive(msgspec.Struct):
    attributes: dict[str, int]
    indices: int | None = None
    mode: Annotated[int, msgspec.Meta(ge=0, le=6)] = _TRIANGLES


class _GltfMesh(msgspec.Struct):
    primitives: list[_Primitive]
    name: str = ""


class _Nodes(msgspec.Struct):
    nodes: list[int] = []


class _Accessor(msgspec.Struct, rename="camel"):
    count: _Count
    component_type: int
    type: str
    buffer_view: int | None = None
    byte_offset: _Count = 0
    sparse: object = None


class _BufferView(msgspec.Struct, rename="camel"):
    buffer: int
    byte_length: _Count
    byte_offset: _Count = 0
    byte_stride: _Count = 0


class _Buffer(msgspec.Struct):
    uri: str | None = None


class _Document(msgspec.Struct, rename="camel"):
    """A glTF document: the part of its schema that places triangles."""

    extensions_required: list[str] = []
    scene: int | None = None
    scenes: list[_Nodes] = []
    nodes: list[_Node] = []
    meshes: list[_GltfMesh] = []
    accessors: list[_Accessor] = []
    buffer_views: list[_BufferView] = []
    buffers: list[_Buffer] = []


@dataclass(frozen=True)
class _Part:
    """One placing of a primitive: its node's whole matrix (4, 4), its object's name."""

    primitive: _Primitive
    matrix: Floats
    name: str

    @property
    def place(self) -> list[Location]:
        """The object as a place of a finding."""
        return [Location(object=self.name)]


def read_glb(
    data: memoryview, limits: Limits, deadline: Deadline, findings: list[Finding], unit_mm: float = 1000.0
) -> Mesh | None:
    """Read a GLB file, as `readers.Reader` says. `unit_mm` is the length in mm that a 1 in the scene stands for."""
    document, binary = _chunks(data, findings)
    for name in document.extensions_required:
        if not name.startswith(_HARMLESS):
            text = f"the file needs the extension {name[:60]!r}, which cannot be read; export without it"
            raise P016.unreadable(text)
    parts = list(_parts(document, limits, findings))
    return mesh_of(_polygons(document, binary, parts, unit_mm, limits, deadline), limits, deadline, findings)


def _chunks(data: memoryview, findings: list[Finding]) -> tuple[_Document, memoryview]:
    """Return the document and the binary chunk."""
    if len(data) < 20:
        raise F001.unreadable(f"{counted(len(data), 'byte')}: shorter than a GLB's header")
    version, length = (int.from_bytes(data[i : i + 4], "little") for i in (4, 8))
    if version != 2:
        raise F003.unreadable(f"glTF of version {version} cannot be read, only 2")
    if length > len(data):
        raise F002.unreadable(f"the header promises {length} bytes, the file has {len(data)}")
    if extra := len(data) - length:
        findings.append(F006.finding(f"{counted(extra, 'byte')} after the last chunk", extra))
    chunks: dict[int, memoryview] = {}
    at = 12
    while at + 8 <= length:
        size, kind = (int.from_bytes(data[i : i + 4], "little") for i in (at, at + 4))
        if at + 8 + size > length:
            raise F002.unreadable(f"a chunk promises {size} bytes, the file has {length - at - 8}")
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    text = chunks.get(_JSON, memoryview(b""))
    if len(text) > _MOST_JSON:
        raise F011.unreadable(f"{len(text)} bytes of JSON, more than the limit of {_MOST_JSON}")
    try:
        document = msgspec.json.decode(text, type=_Document)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise F003.unreadable(f"the glTF document cannot be read: {str(error)[:200]}") from error
    return document, chunks.get(_BIN, memoryview(b""))


def _entry(held: list[_T], index: int | None, key: str, who: str) -> _T:
    """Return the entry with that index. Raises `Unreadable` (P011) if it is not there."""
    if index is None or not 0 <= index < len(held):
        raise P011.unreadable(f"{who} names {key} {str(index)[:20]}, the list has {len(held)}")
    return held[index]


def _parts(document: _Document, limits: Limits, findings: list[Finding]) -> Iterator[_Part]:
    """Return the primitives of the scene's nodes, in the order of the scene. Its nodes must be a tree."""
    if document.scene is not None or document.scenes:
        roots = _entry(document.scenes, document.scene or 0, "scenes", "the document").nodes
    else:
        below = {child for node in document.nodes for child in node.children}
        roots = [index for index in range(len(document.nodes)) if index not in below]
    seen: set[int] = set()
    placed = 0
    waiting = [(index, _Z_UP, 0) for index in reversed(roots)]
    while waiting:
        index, above, depth = waiting.pop()
        node = _entry(document.nodes, index, "nodes", "a node or scene")
        if index in seen:
            raise P012.unreadable(f"node {index} has two parents or contains itself")
        seen.add(index)
        if depth > limits.max_depth:
            raise P009.unreadable(f"nodes nest deeper than {limits.max_depth}")
        if len(seen) > limits.max_instances:
            raise F011.unreadable(f"more nodes than the limit of {limits.max_instances} instances")
        name = (node.name or f"node {index}")[:_NAME]
        with np.errstate(all="ignore"):  # numbers that become too large are found on use
            matrix = above @ _matrix(node, name, findings)
        if node.mesh is not None:
            mesh = _entry(document.meshes, node.mesh, "meshes", f"node {index}")
            placed += len(mesh.primitives)
            if placed > limits.max_instances:
                raise F011.unreadable(f"more primitives than the limit of {limits.max_instances} instances")
            name = (node.name or mesh.name or name)[:_NAME]
            if any(primitive.mode > _TRIANGLES for primitive in mesh.primitives):
                raise F003.unreadable(f"{name} has strips or fans, which cannot be read; export triangles")
            yield from (_Part(primitive, matrix, name) for primitive in mesh.primitives if primitive.mode == _TRIANGLES)
        waiting += [(child, matrix, depth + 1) for child in reversed(node.children)]


def _matrix(node: _Node, name: str, findings: list[Finding]) -> Floats:
    """Return a node's own matrix (4, 4) for columns. Raises `Unreadable` (P013) if a number is too large."""
    place = [Location(object=name)]
    for key in ("matrix", "rotation", "scale", "translation"):
        values = getattr(node, key) or ()
        if any(abs(value) >= 1e30 for value in values):
            raise P013.unreadable(f"{key} of {name} is not of {len(values)} finite numbers", places=place)
    if node.matrix is not None:
        matrix = np.array(node.matrix, float).reshape(4, 4).T
    else:
        x, y, z, w = node.rotation
        turned = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        matrix = np.eye(4)
        matrix[:3, :3] = turned * node.scale
        matrix[:3, 3] = node.translation
    with np.errstate(all="ignore"):
        determinant = float(np.linalg.det(matrix[:3, :3]))
        size = float(np.prod(np.linalg.norm(matrix[:3, :3], axis=0)))
    if not abs(determinant) > 1e-12 * size:
        findings.append(P013.finding(f"the matrix of {name} has determinant zero", places=place))
    return matrix


def _polygons(
    document: _Document, binary: memoryview, parts: list[_Part], unit_mm: float, limits: Limits, deadline: Deadline
) -> Polygons:
    """Return all triangles of the scene in mm; promised numbers are counted before anything is made."""
    sizes = [_declared_counts(document, part.primitive) for part in parts]
    faces, points = sum(size[0] for size in sizes), sum(size[1] for size in sizes)
    if faces > limits.max_faces or points > 3 * limits.max_faces:
        raise F011.unreadable(f"{counted(faces, 'face')} in the scene, more than --max-faces {limits.max_faces}")
    read: dict[int, tuple[Floats, Ints]] = {}
    vertices, corners, starts = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], []
    before = done = 0
    for part in parts:
        deadline.tick()
        if id(part.primitive) not in read:
            read[id(part.primitive)] = _primitive(document, binary, part)
        points, faces = read[id(part.primitive)]
        vertices.append(_transform(points, part.matrix, unit_mm))
        with np.errstate(all="ignore"):
            mirrored = np.linalg.det(part.matrix[:3, :3]) < 0
        corners.append((faces[:, ::-1] if mirrored else faces) + before)
        starts.append(done)
        before, done = before + len(points), done + len(faces)
    names = "\n".join(part.name.replace("\n", " ") for part in parts).encode("utf-8", "replace")
    source = Source(starts=np.array(starts, np.int64), names=names)
    return Polygons(np.concatenate(vertices), np.concatenate(corners).reshape(-1), np.full(done, 3), source)


def _transform(points: Floats, matrix: Floats, unit_mm: float) -> Floats:
    """Return points under a matrix, mm, as float32 numbers. Column by column, so that equal points stay equal."""
    with np.errstate(all="ignore"):
        rows = [sum(points[:, k] * row[k] for k in range(3)) + row[3] for row in matrix[:3]]
        return (np.stack(rows, axis=1) * unit_mm).astype(np.float32).astype(np.float64)


def _declared_counts(document: _Document, primitive: _Primitive) -> tuple[int, int]:
    """Return triangles (at most) and vertices of a primitive."""
    if "POSITION" not in primitive.attributes:
        raise F003.unreadable("a primitive of triangles has no POSITION")
    corners = points = _entry(document.accessors, primitive.attributes["POSITION"], "accessors", "a primitive").count
    if primitive.indices is not None:
        corners = _entry(document.accessors, primitive.indices, "accessors", "a primitive").count
    return corners // 3, points


def _primitive(document: _Document, binary: memoryview, part: _Part) -> tuple[Floats, Ints]:
    """Return vertices (n, 3) and triangles (m, 3) of a primitive."""
    primitive = part.primitive
    points = _numbers(document, binary, primitive.attributes["POSITION"], "VEC3", 3)
    corners: Ints = np.arange(len(points))
    if primitive.indices is not None:
        corners = _numbers(document, binary, primitive.indices, "SCALAR", 1)[:, 0]
        if corners.dtype.kind == "f":
            raise F004.unreadable("indices are not whole numbers", places=part.place)
        corners = corners.astype(np.int64)
        if len(wrong := corners[(corners < 0) | (corners >= len(points))]):
            text = f"a face names vertex {wrong[0]} of {len(points)}, counted from 0"
            raise P011.unreadable(text, places=part.place)
    if len(corners) % 3:
        text = f"{len(corners)} corners of triangles, which is no multiple of three"
        raise F008.unreadable(text, places=part.place)
    return points.astype(np.float64), corners.reshape(-1, 3)


def _numbers(document: _Document, binary: memoryview, index: int, kind: str, width: int) -> Floats:
    """Return the numbers (n, width) of an accessor.

    Raises `Unreadable` if they are not in the file's own binary chunk.
    """
    accessor, who = document.accessors[index], f"accessor {index}"
    if accessor.sparse is not None or accessor.buffer_view is None:
        what = "sparse" if accessor.sparse is not None else "without a buffer view"
        raise F003.unreadable(f"{who} is {what}, which cannot be read; export without compression")
    if accessor.type != kind or accessor.component_type not in _TYPES:
        there = f"{accessor.type[:20]} of {accessor.component_type}"
        raise F003.unreadable(f"{who} is {there!r}, not {kind} of a known type of numbers")
    view = _entry(document.buffer_views, accessor.buffer_view, "bufferViews", who)
    buffer = _entry(document.buffers, view.buffer, "buffers", f"buffer view {accessor.buffer_view}")
    if buffer.uri is not None or view.buffer != 0:
        raise P007.unreadable(f"the numbers of {who} are not in the file's own binary chunk")
    dtype = np.dtype(_TYPES[accessor.component_type])
    count, size = accessor.count, width * dtype.itemsize
    stride = view.byte_stride or size
    room = min(view.byte_length, len(binary) - view.byte_offset) - accessor.byte_offset
    if stride < size:
        raise F003.unreadable(f"byteStride of {who} is {stride}, not {size} or more")
    if count and (room < size or (room - size) // stride + 1 < count):
        text = f"{who} promises {counted(count, 'number')} of {size} bytes, its buffer has {max(room, 0)} bytes"
        raise F002.unreadable(text)
    if not count:
        return np.empty((0, width))
    first = view.byte_offset + accessor.byte_offset
    return np.ndarray((count, width), dtype, binary, first, (stride, dtype.itemsize))
