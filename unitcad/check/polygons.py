"""Faces of five and more corners in text OBJ and OFF, cut into triangles before trimesh reads them.

trimesh makes fans of them, which is wrong where they are not convex, or does not read them at all.
"""

from __future__ import annotations

import re
from bisect import bisect_left

import numpy as np

from unitcad.check.text_mesh import OBJ_VERTEX, numbers_of

_OBJ_FACE = re.compile(rb"(?m)^[ ]*f((?:[ ]+[^\s#\\\\]+){5,})[^\n]*$")
_LARGE = 4  # corners that trimesh manages


def in_triangles(kind: str, raw: bytes) -> bytes:
    """The file's text with large faces replaced; the same bytes where it has none."""
    if kind == "obj" and _OBJ_FACE.search(raw):
        return _obj(raw)
    if kind == "off" and (numbers := numbers_of("off", raw)) is not None:
        return _off(raw, numbers)
    return raw


def _obj(raw: bytes) -> bytes:
    lines = list(OBJ_VERTEX.finditer(raw))
    points, starts = [line.group(1).split()[:3] for line in lines], [line.start() for line in lines]

    def replaced(match: re.Match[bytes]) -> bytes:
        words = match.group(1).split()
        try:
            ids = [int(word.split(b"/")[0]) for word in words]
        except ValueError:
            return match.group(0)
        if min(ids) < 0:  # counted back from the last vertex so far
            above = bisect_left(starts, match.start())
            ids = [i if i > 0 else above + 1 + i for i in ids]
        rows = _cut(points, [i - 1 for i in ids])
        return b"\n".join(b"f " + b" ".join(words[k] for k in row) for row in rows)

    return _OBJ_FACE.sub(replaced, raw)


def _off(raw: bytes, numbers: bytes) -> bytes:
    rows = [line.split() for line in numbers.split(b"\n") if line.strip()]
    if len(rows) < 2 or not rows[0][0].isdigit():
        return raw
    n = int(rows[0][0][:18])
    points, faces = rows[1 : n + 1], rows[n + 1 :]
    if not any(row[0].isdigit() and int(row[0][:18]) > _LARGE for row in faces):
        return raw
    places, made = [point[:3] for point in points], []
    for row in faces:
        size = int(row[0][:18]) if row[0].isdigit() else 0
        ids = row[1 : size + 1]
        if size <= _LARGE or len(ids) < size or not all(word.isdigit() for word in ids):
            made.append(row)
        else:
            made += [[b"3", *(ids[k] for k in cut)] for cut in _cut(places, [int(i[:18]) for i in ids])]
    lines = [b"OFF", b"%d %d 0" % (n, len(made)), *(b" ".join(row) for row in points + made)]
    return b"\n".join(lines) + b"\n"


def _cut(points: list[list[bytes]], polygon: list[int]) -> list[list[int]]:
    """Triangles of places in a polygon that turn as it does; a fan where its corners are not there or lie on a line."""
    from manifold3d import triangulate

    fan = [[0, k, k + 1] for k in range(1, len(polygon) - 1)]
    if min(polygon) < 0 or max(polygon) >= len(points):
        return fan
    try:
        corners = np.array([points[i] for i in polygon]).astype(np.float64)
    except ValueError:
        return fan
    area = np.cross(corners - corners[0], np.roll(corners, -1, axis=0) - corners[0]).sum(axis=0)
    drop = int(np.argmax(np.abs(area)))
    if not abs(area[drop]) > 0:
        return fan
    flat = corners[:, [(drop + 1) % 3, (drop + 2) % 3]] * [np.sign(area[drop]), 1]
    found = triangulate([flat])
    return [[int(k) for k in row] for row in found] if len(found) == len(fan) else fan
