"""How much material lies behind the faces of a mesh, or air before them, by short rays; what lies inside of what."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints
from unitcad.geometry.boxes import Tick, boxes_of, frame_of, meeting_between, morton_order
from unitcad.meshcheck.geometry.topology import Topology, max_side_squared

_FACES = 1 << 13  # faces whose corners stay in the processor's cache


def _dot(a: Floats, b: Floats) -> Floats:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def winding_number(vertices: Floats, faces: Ints, point: Floats) -> int:
    """Count how often a closed surface winds round `point`: the sum of solid angles over 4 pi (Van Oosterom, 1983)."""
    total = 0.0
    for start in range(0, len(faces), _FACES):
        block = faces[start : start + _FACES]
        total += float(_half_angles(vertices, block, np.broadcast_to(point, (len(block), 3))).sum())
    return round(total / (2 * np.pi))


def winding_numbers(vertices: Floats, faces: Ints, first: Ints, count: Ints, points: Floats, tick: Tick) -> Ints:
    """Return the same for points (n, 3), of each the surface of the `count` faces from `first` on."""
    numbers, ends = np.zeros(len(points), np.int64), np.cumsum(count)
    start = 0
    while start < len(points):
        tick()
        stop = max(int(np.searchsorted(ends, ends[start] - count[start] + _FACES, "right")), start + 1)
        if stop == start + 1:
            surface = faces[first[start] : first[start] + count[start]]
            numbers[start] = winding_number(vertices, surface, points[start])
        else:
            row = np.repeat(np.arange(start, stop), count[start:stop])
            place = np.arange(len(row)) - np.repeat(
                ends[start:stop] - count[start:stop] - ends[start] + count[start], count[start:stop]
            )
            angles = _half_angles(vertices, faces[first[row] + place], points[row])
            numbers[start:stop] = np.round(np.bincount(row - start, angles, stop - start) / (2 * np.pi))
        start = stop
    return numbers


def _half_angles(vertices: Floats, faces: Ints, points: Floats) -> Floats:
    """Return half of the solid angle under which each face is seen from a point, (n,)."""
    a, b, c = (np.ascontiguousarray((vertices.take(faces[:, k], axis=0) - points).T) for k in range(3))
    la, lb, lc = (np.sqrt(_dot(v, v)) for v in (a, b, c))
    top = a[0] * (b[1] * c[2] - b[2] * c[1])
    top += a[1] * (b[2] * c[0] - b[0] * c[2])
    top += a[2] * (b[0] * c[1] - b[1] * c[0])
    low = la * lb * lc + _dot(a, b) * lc + _dot(b, c) * la + _dot(c, a) * lb
    return np.asarray(np.arctan2(top, low))


PARALLEL = float(np.cos(np.radians(12.0)))  # two sides of a wall
OPPOSED = 0.3  # two sides of a whisker, which may have three
LEVEL = float(np.cos(np.radians(45.0)))  # normals steeper than this belong to a flat piece's wall
SLACK = 0.995  # of the floor: a wall drawn at the floor passes after rounding and tessellation
_SAMPLES = 40_000
_FINEST = 6  # a face has at most _FINEST (_FINEST + 1) / 2 points
_ROUNDING_MM = 1e-6
_BLOCKS, _POINTS = 4, 2048  # a look at the faces may take so many blocks of box pairs, and one for so many points


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
    seeing = _seeing(corners, normal, solid, reach, len(points), tick)
    return Rays(points, owner, floor[owner], *_behind(corners, normal, solid, points, owner, reach, seeing, tick))


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


class _Many(Exception):
    """Box pairs so many that rays alone are cast in less time."""


def _seeing(corners: Floats, normal: Floats, solid: Ints, reach: Floats, points: int, tick: Tick) -> Bools:
    """Return which faces, of `solid` ones, may see an opposed face within `reach` behind them: no ray of others hits.

    Most see none. All of them where the boxes of so many meet that the rays of all `points` are cast in less time.
    """
    seeing = np.zeros(len(corners), bool)
    if not len(solid):
        return seeing
    blocks = _BLOCKS + points // _POINTS

    def counted() -> None:
        nonlocal blocks
        tick()
        blocks -= 1
        if not blocks:
            raise _Many

    swept = corners[solid] - (normal * reach[:, None])[solid, None]
    places = np.concatenate([corners[solid], swept]).reshape(-1, 3)
    steps = frame_of(places).steps(places)
    first = 3 * np.arange(len(solid))
    order = morton_order(steps, first)
    first, by_place = first[order], solid[order]
    here = [first + k for k in range(3)]
    there = [corner + 3 * len(solid) for corner in here]
    try:
        for i, j in meeting_between(boxes_of(steps, *here, *there), boxes_of(steps, *here), counted):
            face, other = by_place[i], by_place[j]
            opposed = np.einsum("ij,ij->i", normal[face], normal[other]) < -OPPOSED
            face, other = face[opposed], other[opposed]
            away = np.einsum("ikx,ix->ik", corners[other] - corners[face, :1], normal[face])
            seeing[face[(away.min(axis=1) < 0.0) & (away.max(axis=1) > -reach[face] - _ROUNDING_MM)]] = True
    except _Many:
        seeing[solid] = True
    return seeing


def _behind(
    corners: Floats,
    normal: Floats,
    solid: Ints,
    points: Floats,
    owner: Ints,
    reach: Floats,
    seeing: Bools,
    tick: Tick,
) -> tuple[Floats, Floats, Ints]:
    """Return distances from each point of the faces `seeing`, against its normal, and the face across, as `Rays` has.

    reach (m,): of each face.
    """
    thickness, behind = np.full((2, len(points)), np.inf)
    across = np.full(len(points), -1)
    which = np.flatnonzero(seeing[owner])
    if not len(which):
        return thickness, behind, across
    ends = points[which] - (normal * reach[:, None])[owner[which]]
    places = np.concatenate([points[which], ends, corners[solid].reshape(-1, 3)])
    steps = frame_of(places).steps(places)
    n, m = len(which), len(solid)
    order = morton_order(steps, np.arange(n))
    rays, by_curve = boxes_of(steps, order, order + n), which[order]
    first = 2 * n + 3 * np.arange(m)
    order_faces = morton_order(steps, first)
    first, by_place = first[order_faces], solid[order_faces]
    faces = boxes_of(steps, first, first + 1, first + 2)
    for i, j in meeting_between(rays, faces, tick):
        ray, face = by_curve[i], by_place[j]
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
