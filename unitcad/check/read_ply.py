"""A binary PLY's header held against its size before trimesh reads it: each element walked, none made.

The format is Greg Turk's (Stanford, 1994): elements in the header's order, records without padding, lists with a count
of their own before them.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np

from unitcad.check.findings import Finding, counted
from unitcad.check.limits import Deadline, Unreadable
from unitcad.check.mesh import Ints
from unitcad.check.rulebook import finding

_TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d"}
_TYPES |= {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"}
_TYPES |= {"float32": "f", "float64": "d"}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
_ALIKE = 4096  # records looked at together, if their lists have one length
_SINGLE = 1000  # records read one by one after two that differ


@dataclass(frozen=True)
class _Element:
    """An element's name, count and properties: type of its list's length ("" for a plain one) and of its numbers."""

    name: str
    count: int
    properties: list[tuple[str, str]]


def trimmed(raw: bytes, deadline: Deadline) -> tuple[bytes, list[Finding]]:
    """The file without bytes after its last element (F006). Raises `Unreadable` where its elements do not fit (F002).

    A text PLY is returned as it is.
    """
    order, elements, at = _header(raw)
    if not order:
        return raw, []
    for element in elements:
        at = _after(raw, at, element, order, deadline)
    if at == len(raw):
        return raw, []
    extra = len(raw) - at
    return raw[:at], [finding("F006", f"{counted(extra, 'byte')} after the last element", extra)]


def _header(raw: bytes) -> tuple[str, list[_Element], int]:
    """Byte order ("" for text), elements, and where the header ends."""
    order, elements, at = "", [], 0
    while True:
        end = raw.find(b"\n", at)
        words = raw[at : end if end >= 0 else len(raw)].decode("ascii", "replace").split()
        if end < 0 or words[:1] == ["end_header"]:
            return order, elements, end + 1 if end >= 0 else len(raw)
        at = end + 1
        if words[:1] == ["format"]:
            order = _ORDERS.get(words[1] if len(words) > 1 else "", "")
        elif words[:1] == ["element"]:
            if len(words) != 3 or not words[2].isdecimal():
                raise Unreadable(
                    finding("F003", f"the header's line {' '.join(words)[:60]!r} names no element and count")
                )
            elements.append(_Element(words[1], int(words[2][:18]), []))
        elif words[:1] == ["property"] and elements:
            kinds = words[2:4] if words[1:2] == ["list"] else ["", *words[1:2]]
            if len(kinds) < 2 or any(kind not in _TYPES for kind in kinds if kind):
                raise Unreadable(finding("F003", f"the header's line {' '.join(words)[:60]!r} is no property"))
            elements[-1].properties.append((_TYPES.get(kinds[0], ""), _TYPES[kinds[1]]))


def _after(raw: bytes, at: int, element: _Element, order: str, deadline: Deadline) -> int:
    """Where the records of an element that begin at `at` end."""
    if not any(length for length, _ in element.properties):
        size = sum(struct.calcsize(order + kind) for _, kind in element.properties)
        if at + size * element.count > len(raw):
            raise _short(element, (len(raw) - at) // size)
        return at + size * element.count
    done = window = 0
    while done < element.count:
        deadline.tick()
        alike = 0
        if window:
            alike, after = _alike(raw, at, element, order, min(window, element.count - done))
            done, at = done + alike, at + after
        if alike == window and window:
            window *= 2
            continue
        window = _ALIKE
        for _ in range(min(_SINGLE, element.count - done)):
            sizes = _sizes(raw, at, element, order)
            at += sum(sizes)
            if not sizes or at > len(raw):
                raise _short(element, done)
            done += 1
    return at


def _sizes(raw: bytes, at: int, element: _Element, order: str) -> list[int]:
    """Bytes of each property of the record at `at`; none where it reaches past the end or a list has no length."""
    sizes = []
    for length, kind in element.properties:
        size = struct.calcsize(order + kind)
        if length:
            own = struct.calcsize(order + length)
            if at + own > len(raw):
                return []
            (n,) = struct.unpack_from(order + length, raw, at)
            if not 0 <= n <= len(raw):  # a NaN, where a length is a float, is neither
                return []
            size = own + int(n) * size
        sizes.append(size)
        at += size
    return sizes


def _alike(raw: bytes, at: int, element: _Element, order: str, most: int) -> tuple[int, int]:
    """How many of the next records have lists as long as the first one's, and their bytes."""
    sizes = _sizes(raw, at, element, order)
    stride = sum(sizes)
    most = min(most, (len(raw) - at) // stride if stride else 0)
    if not most:
        return 0, 0
    table: Ints = np.frombuffer(raw, np.uint8, most * stride, at).reshape(most, stride)
    same = np.ones(most, bool)
    place = 0
    for (length, _), size in zip(element.properties, sizes, strict=True):
        if length:
            own = struct.calcsize(order + length)
            same &= (table[:, place : place + own] == table[0, place : place + own]).all(axis=1)
        place += size
    alike = most if same.all() else int(np.argmin(same))
    return alike, alike * stride


def _short(element: _Element, room: int) -> Unreadable:
    text = f"the header promises {counted(element.count, f'{element.name} record')}, the file has room for {room}"
    return Unreadable(finding("F002", text, max(element.count - room, 1)))
