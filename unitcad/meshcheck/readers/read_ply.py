"""PLY as Greg Turk defined it (Stanford, 1994), text and binary of either byte order.

Elements stand in the header's order, records without padding, lists with a count of their own before them. Of all that
a file holds, `x`, `y` and `z` of `vertex` and `vertex_indices` (or `vertex_index`) of `face` are kept.
"""

from __future__ import annotations

import re
import struct
from array import array
from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Finding, Location, counted
from unitcad.meshcheck.geometry.mesh import Mesh, Source
from unitcad.meshcheck.readers import rows
from unitcad.meshcheck.readers.rows import Polygons, Rows, check_promise, mesh_of
from unitcad.meshcheck.rules.f_file import F001, F002, F003, F005, F006, Deadline, Limits

_TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
_TYPES |= {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"}
_TYPES |= {"float32": "f", "float64": "d"}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
_TEXT = re.compile(rb"[\r\n][ \t]*format[ \t]+ascii\b")
_HEADER = 100_000  # bytes
_WANTED = {"vertex": ("x", "y", "z"), "face": ("vertex_indices", "vertex_index")}
_TICK = 100_000
Column = tuple[Ints | None, Floats]  # lengths of lists, None for a plain property, and its numbers
Tables = dict[str, dict[str, Column]]  # the wanted columns of each element


@dataclass(frozen=True)
class _Element:
    """An element: its properties are (name, type of the list's length or "" for a plain one, type of numbers)."""

    name: str
    count: int
    properties: list[tuple[str, str, str]]


def read_ply(data: memoryview, limits: Limits, deadline: Deadline, findings: list[Finding]) -> Mesh | None:
    """Read a PLY file, as `readers.Reader` says."""
    raw = bytes(data)
    if raw.startswith(rows.UTF16) or _TEXT.search(raw[:1000]):
        raw = rows.plain(raw, findings)
    if not raw.startswith(b"ply"):
        raise F005.unreadable("named .ply, but does not begin with ply")
    if b"end_header" not in raw[:_HEADER]:
        raise F003.unreadable("the header has no end")
    order, elements, at = _header(raw)
    check_promise(max((element.count for element in elements), default=0), len(raw), limits)
    lines = None
    if order == "ascii":
        tables, lines = _text(raw, at, elements, deadline, findings)
    else:
        tables = _binary(raw, at, order, elements, deadline, findings)
    return mesh_of(_polygons(elements, tables, lines), limits, deadline, findings)


def _polygons(elements: list[_Element], tables: Tables, lines: Ints | None) -> Polygons:
    if not any(element.name == "face" and element.count for element in elements):
        raise F001.unreadable("the file has no face")
    points = [tables.get("vertex", {}).get(axis, (None, None)) for axis in "xyz"]
    sizes, corners = next(iter(tables["face"].values()), (None, np.empty(0)))
    if sizes is None or any(column is None or of is not None for of, column in points):
        raise F003.unreadable("cannot be read as PLY: its elements are not those of a mesh")
    vertices = np.stack([np.asarray(column, np.float64) for _, column in points], axis=1)
    indices = rows.integers(corners) if corners.dtype.kind == "f" else corners.astype(np.int64)
    return vertices, indices, sizes, Source(lines=lines)


def _header(raw: bytes) -> tuple[str, list[_Element], int]:
    """Return byte order ("ascii" for text), elements, and the end of the header."""
    order, elements, at = "", list[_Element](), 0
    while True:
        end = raw.find(b"\n", at)
        words = raw[at : end if end >= 0 else len(raw)].decode("ascii", "replace").split()
        if end < 0 or words[:1] == ["end_header"]:
            break
        at, line = end + 1, " ".join(words)[:60]
        if words[:1] == ["format"]:
            order = "ascii" if words[1:2] == ["ascii"] else _ORDERS.get(" ".join(words[1:2]), "")
        elif words[:1] == ["element"]:
            if len(words) != 3 or not words[2].isdecimal():
                raise F003.unreadable(f"the header's line {line!r} names no element and count")
            if any(element.name == words[1] for element in elements):
                raise F003.unreadable(f"the header names element {words[1][:30]} twice")
            elements.append(_Element(words[1], int(words[2][:18]), []))
        elif words[:1] == ["property"] and elements:
            kinds = words[2:4] if words[1:2] == ["list"] else ["", *words[1:2]]
            if len(kinds) < 2 or any(kind not in _TYPES for kind in kinds if kind):
                raise F003.unreadable(f"the header's line {line!r} is no property")
            elements[-1].properties.append((" ".join(words[-1:]), _TYPES.get(kinds[0], ""), _TYPES[kinds[1]]))
    if not order:
        raise F003.unreadable("the header names no format that is known")
    return order, elements, end + 1 if end >= 0 else len(raw)


def _text(
    raw: bytes, at: int, elements: list[_Element], deadline: Deadline, findings: list[Finding]
) -> tuple[Tables, Ints | None]:
    """Return the wanted columns, and the lines of the faces."""
    table = rows.all_rows(raw, at, raw.count(b"\n", 0, at) + 1, deadline, comments=False)
    promised = sum(element.count for element in elements)
    extra, longer, tables, lines, row = len(table) - promised, 0, {}, None, 0
    if extra < 0:
        what = f"{counted(promised, 'line')} of vertices, faces and other elements"
        raise F002.unreadable(f"the header promises {what}, not {len(table)}", -extra)
    for element in elements:
        which = slice(row, row + element.count)
        tables[element.name], more = _text_element(table, which, element)
        longer += more
        lines = table.lines[which] if element.name == "face" else lines
        row += element.count
    if extra:
        findings.append(F006.finding(f"{counted(extra, 'line')} after the last element", extra))
    if longer:  # as MeshLab writes, which announces colours of faces and writes a list
        findings.append(F006.finding(f"{counted(longer, 'line')} with more numbers than the properties take", longer))
    return tables, lines


def _text_element(table: Rows, which: slice, element: _Element) -> tuple[dict[str, Column], int]:
    """Return the wanted columns, and how many records have numbers after their last property; only faces may."""
    columns: dict[str, Column] = {}
    place, ends, lines = table.starts[:-1][which], table.starts[1:][which], table.lines[which]
    for name, length, _ in element.properties:
        _refuse(place >= ends, element, lines)
        sizes = None
        if length:
            sizes = rows.lengths(table.values[place], ends - place - 1, lines, element.name)
        if name in _WANTED.get(element.name, ()):
            columns[name] = (sizes, table.values[place if sizes is None else rows.spread(place + 1, sizes)])
        place = place + 1 + (0 if sizes is None else sizes)
    if element.name != "face":
        _refuse(place < ends, element, lines)
    return columns, int((place < ends).sum())


def _refuse(wrong: Ints, element: _Element, lines: Ints) -> None:
    """Raise `Unreadable` (F003) if a record of the element has more or fewer numbers than its properties."""
    if wrong.any():
        text = f"a {element.name} with more or fewer numbers than its properties take"
        raise F003.unreadable(text, int(wrong.sum()), [Location(line=int(lines[int(np.argmax(wrong))]))])


def _binary(
    raw: bytes, at: int, order: str, elements: list[_Element], deadline: Deadline, findings: list[Finding]
) -> Tables:
    """Return the wanted columns of each element."""
    tables: Tables = {}
    for element in elements:
        records = _records(raw, at, element, order) or _walk_rows(raw, at, element, order, deadline)
        tables[element.name], at = records
    if extra := len(raw) - at:
        findings.append(F006.finding(f"{counted(extra, 'byte')} after the last element", extra))
    return tables


def _layout(raw: bytes, at: int, element: _Element, order: str) -> np.dtype | None:
    """Return the type of the record at `at`, a list as its length "#i" and its numbers; None if there is none."""
    fields: list[tuple] = []
    begin = at
    for i, (name, length, kind) in enumerate(element.properties):
        if length:
            own = struct.calcsize(order + length)
            if at + own > len(raw):
                return None
            (n,) = struct.unpack_from(order + length, raw, at)
            if not 0 <= n <= len(raw):  # a NaN, as a length may be a float, is neither
                return None
            fields += [(f"#{i}", order + length), (f"{i} {name}", order + kind, (int(n),))]
            at += own + int(n) * struct.calcsize(order + kind)
        else:
            fields.append((f"{i} {name}", order + kind))
            at += struct.calcsize(order + kind)
        if at > len(raw) or at - begin >= 2**31:  # which numpy's types cannot hold
            return None
    return np.dtype(fields)


def _records(raw: bytes, at: int, element: _Element, order: str) -> tuple[dict[str, Column], int] | None:
    """Return the columns of an element and their end; None if its lists differ in length, or the file is too short."""
    if not element.count:
        return {}, at
    layout = _layout(raw, at, element, order)
    if layout is None or at + element.count * layout.itemsize > len(raw):
        return None
    table = np.frombuffer(raw, layout, element.count, at)
    if any((table[name] != table[name][0]).any() for name in layout.names or () if name.startswith("#")):
        return None
    columns: dict[str, Column] = {}
    for i, (name, length, _) in enumerate(element.properties):
        if name in _WANTED.get(element.name, ()):
            values = table[f"{i} {name}"]
            columns[name] = (np.full(element.count, values.shape[1]) if length else None, values.reshape(-1))
    return columns, at + element.count * layout.itemsize


def _walk_rows(raw: bytes, at: int, element: _Element, order: str, deadline: Deadline) -> tuple[dict[str, Column], int]:
    """Return the columns of an element whose lists differ in length, record after record, and their end."""
    steps = [(struct.Struct(order + (length or kind)), struct.calcsize(order + kind) if length else 0,
              name in _WANTED.get(element.name, ())) for name, length, kind in element.properties]  # fmt: skip
    kept = {i: (array("q"), array("q")) for i, (_, _, wanted) in enumerate(steps) if wanted}
    for done in range(element.count):
        if not done % _TICK:
            deadline.tick()
        for i, (number, size, wanted) in enumerate(steps):
            first, n = at + number.size, 0
            if size and first <= len(raw):
                (n,) = number.unpack_from(raw, at)
                n = int(n) if 0 <= n <= len(raw) else len(raw)
            if wanted:
                kept[i][0].append(first if size else at)
                kept[i][1].append(n if size else 1)
            at = first + n * size
        if at > len(raw):
            text = (
                f"the header promises {counted(element.count, f'{element.name} record')}, the file has room for {done}"
            )
            raise F002.unreadable(text, max(element.count - done, 1))
    columns: dict[str, Column] = {}
    for i, (starts, counts) in kept.items():
        name, length, kind = element.properties[i]
        size = struct.calcsize(order + kind)
        numbers = np.ndarray(len(raw) - size + 1, order + kind, raw, strides=(1,))  # at every byte
        sizes = np.frombuffer(counts, np.int64)
        values = numbers[rows.spread(np.frombuffer(starts, np.int64), sizes, size)]
        columns[name] = (sizes if length else None, values)
    return columns, at
