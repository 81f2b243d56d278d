"""How much material lies behind the faces of a mesh, or air before them, by short rays; what lies inside of what."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints
from unitcad.geometry.boxes import Tick, boxes_of, frame_of, meeting_between, morton_order
from unitcad.meshcheck.geometry.sieves import dot
from unitcad.meshcheck.geometry.topology import Topology, max_side_squared

_FACES = 1 << 13  # faces looked at together


def winding_numbers(vertices: Floats, faces: Ints, first: Ints, count: Ints, points: Floats, tick: Tick) -> Ints:
    """Return how often closed surfaces wind round points (n, 3), of each the surface of `count` faces from `first` on.

    It is the sum of solid angles over 4 pi (Van Oosterom, 1983).
    """
    numbers, ends, start = np.zeros(len(points), np.int64), np.cumsum(count), 0
    while start < len(points):
        tick()
        before = ends[start] - count[start]
        stop = max(int(np.searchsorted(ends, before + _FACES, "right")), start + 1)
        some = count[start:stop]
        row = np.repeat(np.arange(start, stop), some)
        place = np.arange(len(row)) - np.repeat(ends[start:stop] - some - before, some)
        angles = _half_angles(vertices, faces[first[row] + place], points[row])
        numbers[start:stop] = np.round(np.bincount(row - start, angles, stop - start) / (2 * np.pi))
        start = stop
    return numbers


def _half_angles(vertices: Floats, faces: Ints, points: Floats) -> Floats:
    """Return half of the solid angle under which each face is seen from a point, (n,)."""
    a, b, c = (np.ascontiguousarray((vertices.take(faces[:, k], axis=0) - points).T) for k in range(3))
    la, lb, lc = (np.sqrt(dot(v, v)) for v in (a, b, c))
    top = a[0] * (b[1] * c[2] - b[2] * c[1])
    top += a[1] * (b[2] * c[0] - b[0] * c[2])
    top += a[2] * (b[0] * c[1] - b[1] * c[0])
    low = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb
    return np.asarray(np.arctan2(top, low))


PARALLEL = float(np.cos(np.radians(12.0)))  # two sides of a wall
OPPOSED = 0.3  # two sides of a whisker, which may have three
LEVEL = float(np.cos(np.radians(45.0)))  # normals steeper than this belong to a flat piece's wall
SLACK = 0.995  # of the floor: a wall drawn at the floor passes after rounding and tessellation
_SAMPLES = 40_000
_FINEST = 6  # a face has at most _FINEST (_FINEST + 1) / 2 points


@dataclass(frozen=True, eq=False)
class Rays:
    """Points inside the faces, the face of each, and how much material (for gaps, air) lies behind it, mm.

    `thickness` goes up to the first face that is nearly parallel, within the wall's floor. `behind` goes up to the
    first face that looks the other way at all, within the larger of that floor and the least feature. Both are inf
    beyond. `across` is the face that `thickness` ends at, -1 where there is none.
    """

    points: Floats
    owner: Ints
    floor: Floats
    thickness: Floats
    behind: Floats
    across: Ints


def cast(topology: Topology, floors: tuple[float, float], least: float, tick: Tick, *, side: int) -> Rays:
    """Measure from each face; `floors`: of upright and of lying walls, mm; `side` is 1 for material, -1 for air."""
    upright, level = floors
    mesh = topology.mesh
    corners = mesh.vertices[mesh.faces[:, ::side]]
    double = np.sqrt(np.einsum("ij,ij->i", topology.areas, topology.areas))
    longest = np.sqrt(max_side_squared(corners))
    sound = double > 1e-3 * longest  # a height of a micrometre: below it a face has no direction worth following
    points, owner = _spread_points(corners, longest, sound, upright or level)
    normal = side * topology.areas / np.maximum(double, 1e-300)[:, None]
    floor = np.where(lying(topology), level, upright) * SLACK
    reach = np.maximum(floor, least)
    solid = np.flatnonzero(sound)
    return Rays(points, owner, floor[owner], *_behind(corners, normal, solid, points, owner, reach, tick))


def _spread_points(corners: Floats, longest: Floats, sound: Floats, step: float) -> tuple[Floats, Ints]:
    """Return points inside the faces, about `step` apart, and the face of each."""
    count = np.clip(np.ceil(longest / step), 1, _FINEST).astype(int)
    while (count * (count + 1) // 2)[sound].sum() > _SAMPLES and count.max() > 1:
        count = np.maximum(count - 1, 1)
    points, owner = [], []
    for n in np.unique(count[sound]):
        which = np.flatnonzero(sound & (count == n))
        grid = [(i, j) for i in range(n) for j in range(n - i)]
        weights = np.array([[3 * i + 1, 3 * j + 1, 3 * (n - 1 - i - j) + 1] for i, j in grid]) / (3 * n)
        points.append(np.einsum("wk,fkx->fwx", weights, corners[which]).reshape(-1, 3))
        owner.append(np.repeat(which, len(weights)))
    if not points:
        return np.empty((0, 3)), np.empty(0, int)
    return np.concatenate(points), np.concatenate(owner)


def _behind(
    corners: Floats,
    normal: Floats,
    solid: Ints,
    points: Floats,
    owner: Ints,
    reach: Floats,
    tick: Tick,
) -> tuple[Floats, Floats, Ints]:
    """Return distances from each point, against its face's normal, and the face across, as `Rays` has; `reach` (m,)."""
    n, m = len(points), len(solid)
    thickness, behind = np.full((2, n), np.inf)
    across = np.full(n, -1)
    if not n:
        return thickness, behind, across
    ends = points - (normal * reach[:, None])[owner]
    places = np.concatenate([points, ends, corners[solid].reshape(-1, 3)])
    steps = frame_of(places).steps(places)
    order = morton_order(steps, np.arange(n))
    rays = boxes_of(steps, order, order + n)
    first = 2 * n + 3 * np.arange(m)
    order_faces = morton_order(steps, first)
    first, by_place = first[order_faces], solid[order_faces]
    faces = boxes_of(steps, first, first + 1, first + 2)
    for i, j in meeting_between(rays, faces, tick):
        ray, face = order[i], by_place[j]
        facing = np.einsum("ij,ij->i", normal[owner[ray]], normal[face])
        opposed = facing < -OPPOSED
        ray, face, facing = ray[opposed], face[opposed], facing[opposed]
        distance = _hit(points[ray], -normal[owner[ray]], corners[face], normal[face])
        np.minimum.at(behind, ray, distance)
        parallel = facing < -PARALLEL
        ray, face, distance = ray[parallel], face[parallel], distance[parallel]
        np.minimum.at(thickness, ray, distance)
        nearest = np.isfinite(distance) & (distance == thickness[ray])
        across[ray[nearest]] = face[nearest]
    return thickness, behind, across


def _hit(origin: Floats, along: Floats, corners: Floats, normal: Floats) -> Floats:
    """Return distances to the triangles' insides, inf where missed or behind."""
    slope = np.einsum("ij,ij->i", along, normal)
    distance = np.einsum("ij,ij->i", corners[:, 0] - origin, normal) / slope
    place = origin + along * distance[:, None]
    inside = distance > 1e-4
    for k in range(3):
        side = corners[:, (k + 1) % 3] - corners[:, k]
        turn = np.cross(side, place - corners[:, k])
        inside &= np.einsum("ij,ij->i", turn, normal) >= -1e-9
    return np.where(inside, distance, np.inf)


def lying(topology: Topology) -> Bools:
    """Return faces that belong to flat walls: their normals are nearer to the vertical than to the level."""
    areas = topology.areas
    return np.abs(areas[:, 2]) > LEVEL * np.sqrt(np.einsum("ij,ij->i", areas, areas))
