"""glTF 2.0 in one binary file (GLB), as Khronos defines it: the triangles of the scene, each node in its place.

glTF counts in metres with y up; meshes come out in mm with z up, that is x, -z, y, rounded to float32, which is the
format's precision. Materials, textures, skins, morph targets and animations are left out. Compression such as Draco's,
sparse accessors and buffers outside the file are refused, never skipped.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from unitcad.check.findings import Finding, Location, counted
from unitcad.check.geometry.triangle_mesh import Mesh
from unitcad.check.readers.polygons import Polygons, mesh_of
from unitcad.check.resource_limits import Deadline, Limits, Unreadable, keeping, over_limit
from unitcad.check.rules.f_file import F001, F002, F003, F004, F006, F008
from unitcad.check.rules.p_package import P007, P009, P011, P012, P013, P016
from unitcad.geometry.arrays import Floats, Ints

_MOST_JSON = 100_000_000  # bytes
_JSON, _BIN = 0x4E4F534A, 0x004E4942
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_HARMLESS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_mesh_quantization", "KHR_xmp")
_NAME = 100  # characters of a name that are kept
_Z_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])


@dataclass(frozen=True)
class _Part:
    """One placing of a primitive: its node's whole matrix (4, 4), its object's name."""

    primitive: dict[str, Any]
    matrix: Floats
    name: str


def read_glb(
    data: memoryview, limits: Limits, deadline: Deadline, unit_mm: float = 1000.0
) -> tuple[list[Mesh], list[Finding]]:
    """Read the mesh of a GLB's scene and what the file itself breaks. Raises `Unreadable` where no mesh remains.

    `unit_mm` is the length in mm that a 1 in the scene stands for.
    """
    findings: list[Finding] = []
    with keeping(findings):
        document, binary = _chunks(data, findings)
        for name in _list(document, "extensionsRequired"):
            if not (isinstance(name, str) and name.startswith(_HARMLESS)):
                text = f"the file needs the extension {str(name)[:60]!r}, which cannot be read; export without it"
                raise Unreadable(P016.finding(text))
        parts = list(_parts(document, limits, findings))
        polygons = _polygons(document, binary, parts, unit_mm, limits, deadline)
        meshes, more = mesh_of(polygons, limits, deadline)
    return meshes, findings + more


def _chunks(data: memoryview, findings: list[Finding]) -> tuple[dict[str, Any], memoryview]:
    """Return the document and the binary chunk."""
    if len(data) < 20:
        raise Unreadable(F001.finding(f"{counted(len(data), 'byte')}: shorter than a GLB's header"))
    version, length = (int.from_bytes(data[i : i + 4], "little") for i in (4, 8))
    if version != 2:
        raise Unreadable(F003.finding(f"glTF of version {version} cannot be read, only 2"))
    if length > len(data):
        raise Unreadable(F002.finding(f"the header promises {length} bytes, the file has {len(data)}"))
    if length < len(data):
        extra = len(data) - length
        findings.append(F006.finding(f"{counted(extra, 'byte')} after the last chunk", extra))
    chunks: dict[int, memoryview] = {}
    at = 12
    while at + 8 <= length:
        size, kind = (int.from_bytes(data[i : i + 4], "little") for i in (at, at + 4))
        if at + 8 + size > length:
            raise Unreadable(F002.finding(f"a chunk promises {size} bytes, the file has {length - at - 8}"))
        chunks.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    text = chunks.get(_JSON, memoryview(b""))
    if len(text) > _MOST_JSON:
        raise over_limit(f"{len(text)} bytes of JSON, more than the limit of {_MOST_JSON}")
    try:
        document = json.loads(bytes(text), parse_constant=_no_number)
    except ValueError as error:
        raise Unreadable(F003.finding(f"its JSON cannot be read: {str(error)[:100]}")) from error
    if not isinstance(document, dict):
        raise Unreadable(F003.finding("its JSON is no object"))
    return document, chunks.get(_BIN, memoryview(b""))


def _no_number(name: str) -> float:
    raise ValueError(f"{name} is no number of JSON")


def _list(holder: dict[str, Any], key: str) -> list[Any]:
    value = holder.get(key, [])
    if not isinstance(value, list):
        raise _wrong(key, value, "a list")
    return value


def _wrong(what: str, value: Any, wanted: str) -> Unreadable:
    return Unreadable(F003.finding(f"{what} is {str(value)[:40]!r}, not {wanted}"))


def _count(holder: dict[str, Any], key: str, default: int | None = None) -> int:
    """Return a whole number that is not negative."""
    value = holder.get(key, default)
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**53:
        raise _wrong(key, value, "a whole number from 0")
    return value


def _entry(document: dict[str, Any], key: str, index: Any, who: str) -> dict[str, Any]:
    """Return the object with that index in one of the document's lists. Raises `Unreadable` (P011) where it is not
    there.
    """
    held = _list(document, key)
    if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(held):
        raise Unreadable(P011.finding(f"{who} names {key} {str(index)[:20]}, the list has {len(held)}"))
    if not isinstance(held[index], dict):
        raise _wrong(f"{key} {index}", held[index], "an object")
    return held[index]


def _parts(document: dict[str, Any], limits: Limits, findings: list[Finding]) -> Iterator[_Part]:
    """Return the primitives of the scene's nodes, in the order of the scene. Its nodes must be a tree."""
    nodes = _list(document, "nodes")
    if "scene" in document or _list(document, "scenes"):
        roots = _list(_entry(document, "scenes", document.get("scene", 0), "the document"), "nodes")
    else:
        below = {str(child) for node in nodes if isinstance(node, dict) for child in _list(node, "children")}
        roots = [index for index in range(len(nodes)) if str(index) not in below]
    seen: set[int] = set()
    placed = 0
    waiting = [(index, _Z_UP, 0) for index in reversed(roots)]
    while waiting:
        index, above, depth = waiting.pop()
        node = _entry(document, "nodes", index, "a node or scene")
        if index in seen:
            raise Unreadable(P012.finding(f"node {index} has two parents or contains itself"))
        seen.add(index)
        if depth > limits.max_depth:
            raise Unreadable(P009.finding(f"nodes nest deeper than {limits.max_depth}"))
        if len(seen) > limits.max_instances:
            raise over_limit(f"more nodes than the limit of {limits.max_instances} instances")
        name = str(node.get("name") or f"node {index}")[:_NAME]
        with np.errstate(all="ignore"):  # what comes out too large is found where it is used
            matrix = above @ _matrix(node, name, findings)
        if "mesh" in node:
            mesh = _entry(document, "meshes", node["mesh"], f"node {index}")
            name = str(node.get("name") or mesh.get("name") or name)[:_NAME]
            placed += len(_list(mesh, "primitives"))
            if placed > limits.max_instances:
                raise over_limit(f"more primitives than the limit of {limits.max_instances} instances")
            for primitive in _list(mesh, "primitives"):
                if not isinstance(primitive, dict):
                    raise _wrong("a primitive", primitive, "an object")
                if _count(primitive, "mode", _TRIANGLES) >= _TRIANGLES:
                    yield _Part(primitive, matrix, name)
        waiting += [(child, matrix, depth + 1) for child in reversed(_list(node, "children"))]


def _matrix(node: dict[str, Any], name: str, findings: list[Finding]) -> Floats:
    """Return a node's own matrix (4, 4) for columns. Raises `Unreadable` (P013) where it is not of finite numbers."""

    def numbers(key: str, default: list[float]) -> Floats:
        values = node.get(key, default)
        if not isinstance(values, list) or len(values) != len(default):
            raise _wrong(f"{key} of {name}", values, f"{len(default)} numbers")
        if not all(isinstance(v, (int, float)) and abs(v) < 1e30 for v in values):
            text = f"{key} of {name} is not of {len(default)} finite numbers"
            raise Unreadable(P013.finding(text, places=[Location(object=name)]))
        return np.array(values, float)

    if "matrix" in node:
        matrix = numbers("matrix", np.eye(4).ravel().tolist()).reshape(4, 4).T
    else:
        x, y, z, w = numbers("rotation", [0.0, 0.0, 0.0, 1.0])
        turned = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )
        matrix = np.eye(4)
        matrix[:3, :3] = turned * numbers("scale", [1.0, 1.0, 1.0])
        matrix[:3, 3] = numbers("translation", [0.0, 0.0, 0.0])
    with np.errstate(all="ignore"):
        determinant = float(np.linalg.det(matrix[:3, :3]))
        size = float(np.prod(np.linalg.norm(matrix[:3, :3], axis=0)))
    if not abs(determinant) > 1e-12 * size:
        findings.append(P013.finding(f"the matrix of {name} has determinant zero", places=[Location(object=name)]))
    return matrix


def _polygons(
    document: dict[str, Any],
    binary: memoryview,
    parts: list[_Part],
    unit_mm: float,
    limits: Limits,
    deadline: Deadline,
) -> Polygons:
    """Return all triangles of the scene in mm; what it promises is counted before anything is made."""
    sizes = [_promised(document, part.primitive) for part in parts]
    faces, points = sum(size[0] for size in sizes), sum(size[1] for size in sizes)
    if faces > limits.max_faces or points > 3 * limits.max_faces:
        raise over_limit(f"{counted(faces, 'face')} in the scene, more than --max-faces {limits.max_faces}")
    read: dict[int, tuple[Floats, Ints]] = {}
    vertices, corners, starts = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], []
    before = done = 0
    for part in parts:
        deadline.tick()
        if id(part.primitive) not in read:
            read[id(part.primitive)] = _primitive(document, binary, part)
        points, faces = read[id(part.primitive)]
        vertices.append(_placed(points, part.matrix, unit_mm))
        with np.errstate(all="ignore"):
            mirrored = np.linalg.det(part.matrix[:3, :3]) < 0
        corners.append((faces[:, ::-1] if mirrored else faces) + before)
        starts.append(done)
        before, done = before + len(points), done + len(faces)
    triangles = np.concatenate(corners)
    return Polygons(
        np.concatenate(vertices),
        triangles.reshape(-1),
        np.full(len(triangles), 3),
        starts=np.array(starts, np.int64),
        names="\n".join(part.name.replace("\n", " ") for part in parts).encode("utf-8", "replace"),
    )


def _placed(points: Floats, matrix: Floats, unit_mm: float) -> Floats:
    """Return points under a matrix, mm, as float32 numbers. Column by column, so that equal points stay equal."""
    with np.errstate(all="ignore"):
        rows = [sum(points[:, k] * row[k] for k in range(3)) + row[3] for row in matrix[:3]]
        return (np.stack(rows, axis=1) * unit_mm).astype(np.float32).astype(np.float64)


def _promised(document: dict[str, Any], primitive: dict[str, Any]) -> tuple[int, int]:
    """Return triangles (at most) and vertices of a primitive."""
    attributes = primitive.get("attributes")
    if not isinstance(attributes, dict) or "POSITION" not in attributes:
        raise Unreadable(F003.finding("a primitive of triangles has no POSITION"))
    points = _count(_entry(document, "accessors", attributes["POSITION"], "a primitive"), "count")
    corners = points
    if "indices" in primitive:
        corners = _count(_entry(document, "accessors", primitive["indices"], "a primitive"), "count")
    return (corners // 3 if primitive.get("mode", _TRIANGLES) == _TRIANGLES else corners), points


def _primitive(document: dict[str, Any], binary: memoryview, part: _Part) -> tuple[Floats, Ints]:
    """Return vertices (n, 3) and triangles (m, 3) of a primitive."""
    primitive = part.primitive
    points = _accessor(document, binary, primitive["attributes"]["POSITION"], "VEC3", 3)
    corners: Ints = np.arange(len(points))
    if "indices" in primitive:
        corners = _accessor(document, binary, primitive["indices"], "SCALAR", 1)[:, 0]
        if corners.dtype.kind == "f":
            raise Unreadable(F004.finding("indices are not whole numbers", places=[Location(object=part.name)]))
        corners = corners.astype(np.int64)
        if len(corners) and not 0 <= corners.min() <= corners.max() < len(points):
            wrong = int(corners[(corners < 0) | (corners >= len(points))][0])
            text = f"a face names vertex {wrong} of {len(points)}, counted from 0"
            raise Unreadable(P011.finding(text, places=[Location(object=part.name)]))
    mode = primitive.get("mode", _TRIANGLES)
    if mode == _TRIANGLES:
        if len(corners) % 3:
            text = f"{len(corners)} corners of triangles, which is no multiple of three"
            raise Unreadable(F008.finding(text, places=[Location(object=part.name)]))
        return points.astype(np.float64), corners.reshape(-1, 3)
    if mode not in (_STRIP, _FAN):
        raise _wrong("the mode of a primitive", mode, "0 to 6")
    rows = np.arange(max(len(corners) - 2, 0))
    if mode == _STRIP:  # each other triangle turns the other way
        places = np.stack([rows, rows + 1 + rows % 2, rows + 2 - rows % 2], axis=1)
    else:
        places = np.stack([rows + 1, rows + 2, 0 * rows], axis=1)
    return points.astype(np.float64), corners[places]


def _accessor(document: dict[str, Any], binary: memoryview, index: Any, kind: str, width: int) -> Floats:
    """Return the numbers (n, width) of an accessor. Raises `Unreadable` where they are not in the file's own binary
    chunk.
    """
    accessor = _entry(document, "accessors", index, "a primitive")
    who = f"accessor {index}"
    if "sparse" in accessor or "bufferView" not in accessor:
        what = "sparse" if "sparse" in accessor else "without a buffer view"
        raise Unreadable(F003.finding(f"{who} is {what}, which cannot be read; export without compression"))
    if accessor.get("type") != kind or accessor.get("componentType") not in _TYPES:
        there = f"{accessor.get('type')} of {accessor.get('componentType')}"
        raise _wrong(who, there, f"{kind} of a known type of numbers")
    view = _entry(document, "bufferViews", accessor["bufferView"], who)
    buffer = _entry(document, "buffers", view.get("buffer"), f"buffer view {accessor['bufferView']}")
    if "uri" in buffer or view.get("buffer") != 0:
        raise Unreadable(P007.finding(f"the numbers of {who} are not in the file's own binary chunk"))
    dtype = np.dtype(_TYPES[accessor["componentType"]])
    count, size = _count(accessor, "count"), width * dtype.itemsize
    stride = _count(view, "byteStride", size) or size
    begin, length = _count(view, "byteOffset", 0), _count(view, "byteLength")
    first = _count(accessor, "byteOffset", 0)
    room = min(length, len(binary) - begin) - first
    if stride < size:
        raise _wrong(f"byteStride of {who}", stride, f"{size} or more")
    if count and (room < size or (room - size) // stride + 1 < count):
        text = f"{who} promises {counted(count, 'number')} of {size} bytes, its buffer has {max(room, 0)} bytes"
        raise Unreadable(F002.finding(text))
    if not count:
        return np.empty((0, width))
    numbers = np.ndarray((count, width), dtype, binary, begin + first, (stride, dtype.itemsize))
    if kind == "VEC3" and accessor.get("normalized") is True and dtype.kind in "iu":
        return np.maximum(numbers / float(np.iinfo(dtype).max), -1.0)
    return numbers
