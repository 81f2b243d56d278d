"""Polygons as a file has them, cut into triangles: input from the readers of PLY, OBJ, OFF and GLB.

A polygon is cut in its own plane. A fan from a corner is taken if all its triangles turn the same way; concave
polygons, and those with corners on a line, are cut by manifold3d.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from manifold3d import triangulate

from unitcad.geometry.arrays import Bools, Floats, Ints
from unitcad.meshcheck.findings import Finding, Location, counted, number
from unitcad.meshcheck.geometry.mesh import LARGEST, Mesh, Source, weld_points
from unitcad.meshcheck.rules.f_file import F001, F002, F008, F011, F013, Deadline, Limits
from unitcad.meshcheck.rules.p_package import P011
from unitcad.meshcheck.rules.t_topology import unreferenced
from unitcad.meshcheck.rules.v_values import faces_not_finite

FLAT = 1e-3  # F013: distance of a corner from the polygon's plane, as part of the polygon's size
_CHUNK = 50_000  # corners looked at together
_PROPER = 1e-12  # least area of a fan's triangle, as part of the squared length of its polygon


@dataclass(frozen=True)
class Polygons:
    """Vertices (n, 3) mm, the corners of all polygons one after the other (c,), and how many each has (p,).

    `source`: their places in the file. `counts_from` is the format's first index, for messages.
    """

    vertices: Floats
    corners: Ints
    sizes: Ints
    source: Source
    counts_from: int = 0


def check_promise(n: int, size: int, limits: Limits) -> None:
    """Raise `Unreadable` if a header promises more vertices or faces than the limits (F011) or the file (F002)."""
    if n > 3 * limits.max_faces:
        raise F011.unreadable(f"{n} vertices or faces promised")
    if n > size:
        raise F002.unreadable(f"{n} vertices or faces promised in {size} bytes")


def mesh_of(polygons: Polygons, limits: Limits, deadline: Deadline, findings: list[Finding]) -> Mesh | None:
    """Return the mesh, none if a vertex is not finite, and add the faults of the polygons to the findings.

    Raises `Unreadable` if there is no polygon (F001), too many (F011), or one names a missing vertex (P011).
    """
    sizes, source = polygons.sizes, polygons.source
    short = np.flatnonzero(sizes < 3)
    if len(short):
        text = f"{counted(len(short), 'face')} with fewer than three vertices"
        findings.append(F008.finding(text, len(short), _places(source, short)))
    if len(sizes) == len(short):
        raise F001.unreadable("the file has no face")
    limits.check_faces(int(np.maximum(sizes - 2, 0).sum()))
    vertices, corners = polygons.vertices, polygons.corners
    missing = np.flatnonzero((corners < 0) | (corners >= len(vertices)))
    if len(missing):
        wrong = missing[0]
        counting = "" if polygons.counts_from else ", counted from 0"
        text = f"a face names vertex {corners[wrong] + polygons.counts_from} of {len(vertices)}{counting}"
        raise P011.unreadable(text, places=_places(source, np.searchsorted(np.cumsum(sizes), [wrong], "right")))
    used = np.zeros(len(vertices), bool)
    used[corners] = True
    if unused := len(used) - int(np.count_nonzero(used)):
        findings.append(unreferenced(unused))
    finite = ~used
    finite[used] = (np.abs(vertices[used]) <= LARGEST).all(axis=1)
    if not finite.all():
        bad = np.unique(np.searchsorted(np.cumsum(sizes), np.flatnonzero(~finite[corners]), "right"))
        findings.append(faces_not_finite(len(bad), _places(source, bad)))
        return None
    faces, of, bent = _in_triangles(vertices, corners, sizes, deadline)
    if bent is not None and bent.any():
        folded = np.flatnonzero(bent)
        few = counted(len(folded), "face of four or more corners", "faces of four or more corners")
        text = f"{few} not in a plane: a corner lies up to {number(bent.max())} mm off"
        findings.append(F013.finding(text, len(folded), _places(source, folded)))
    points, index = weld_points(vertices[used])  # OBJ splits vertices along texture seams
    place = np.zeros(len(vertices), np.int32)
    place[used] = index
    return Mesh(points, place[faces], indexed=False, source=replace(source, polygons=of))


def _places(source: Source, polygons: Ints) -> Iterator[Location]:
    for i in polygons.tolist():
        yield Location(face=i, line=source.line(i), object=source.object(i))


def _in_triangles(
    vertices: Floats, corners: Ints, sizes: Ints, deadline: Deadline
) -> tuple[Ints, Ints | None, Floats | None]:
    """Return triangles (t, 3) in the polygons' order, the polygon of each (t,), how far each polygon is bent (p,) mm.

    If all are triangles, the second is None, since triangle and polygon are one, and so is the third.
    """
    if (sizes == 3).all():
        return corners.reshape(-1, 3), None, None
    bent = np.zeros(len(sizes), np.float32)
    counts = np.maximum(sizes - 2, 0)
    first, offsets = np.cumsum(sizes) - sizes, np.cumsum(counts) - counts
    triangles = np.empty((int(counts.sum()), 3), corners.dtype)
    for size in np.unique(sizes[sizes >= 3]).tolist():
        alike = np.flatnonzero(sizes == size)
        step = max(1, _CHUNK // size)
        for at in range(0, len(alike), step):
            deadline.tick()
            some = alike[at : at + step]
            ring = corners[first[some, None] + np.arange(size)]
            rows = offsets[some, None] + np.arange(size - 2)
            if size == 3:
                triangles[rows[:, 0]] = ring
                continue
            cut, off = _cut(vertices[ring], deadline)
            triangles[rows] = np.take_along_axis(ring, cut.reshape(len(ring), -1), axis=1).reshape(len(ring), -1, 3)
            bent[some] = off
    return triangles, np.repeat(np.arange(len(sizes)), counts), bent


def _cut(points: Floats, deadline: Deadline) -> tuple[Ints, Floats]:
    """Return triangles (k, n - 2, 3) of polygons (k, n, 3) as places in them, and how far each is bent.

    That is in mm, 0 if it is flat.
    """
    n = points.shape[1]
    with np.errstate(all="ignore"):
        local = points - points.mean(axis=1, keepdims=True)
        normal = np.cross(local, np.roll(local, -1, axis=1)).sum(axis=1)
        length = np.linalg.norm(normal, axis=1)
        size = np.linalg.norm(np.ptp(local, axis=1), axis=1)
        off = np.abs(np.einsum("kni,ki->kn", local, normal)).max(axis=1) / length
        rounding = 2 * np.spacing(np.abs(points).max(axis=(1, 2)).astype(np.float32))
        off = np.where((length > 0) & (off > np.maximum(FLAT * size, rounding)), off, 0.0)
        least = _PROPER * size * size * length
        fans = np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], axis=1)
        cut = np.broadcast_to(fans, (len(points), n - 2, 3)).copy()
        left = np.flatnonzero(~_proper(local, normal, fans, least))
        if n == 4 and len(left):
            turned = (fans + 1) % 4
            good = _proper(local[left], normal[left], turned, least[left])
            cut[left[good]] = turned
            return cut, off
    for i in left.tolist() if n > 4 else ():
        deadline.tick()
        cut[i] = _concave(local[i], normal[i], fans)
    return cut, off


def _proper(local: Floats, normal: Floats, fans: Ints, least: Floats) -> Bools:
    """Return which polygons all triangles of a fan turn with, none of them without an area."""
    a, b, c = (local[:, fans[:, k]] for k in range(3))
    areas = np.einsum("kti,ki->kt", np.cross(b - a, c - a), normal)
    return np.asarray((areas > least[:, None]).all(axis=1))


def _concave(local: Floats, normal: Floats, fan: Ints) -> Ints:
    """Return triangles of one polygon by manifold3d; the fan if its corners are on a line or it crosses itself."""
    drop = int(np.argmax(np.abs(normal)))
    if not abs(normal[drop]) > 0:
        return fan
    flat = local[:, [(drop + 1) % 3, (drop + 2) % 3]] * [np.sign(normal[drop]), 1]
    triangles = np.asarray(triangulate([flat]))
    return triangles if triangles.shape == fan.shape else fan
