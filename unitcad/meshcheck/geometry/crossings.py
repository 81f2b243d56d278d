"""Faces of a mesh that cross, touch or cover each other in one plane, decided exactly, and how deep."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, columns_of, cross, sorted_with_order
from unitcad.geometry.boxes import Interrupted, Tick, TooMany, box_order, boxes_of, frame_of, meeting_pairs, slabs_of
from unitcad.meshcheck.geometry import predicates
from unitcad.meshcheck.geometry.mesh import area_vectors, float32_steps, same_place
from unitcad.meshcheck.geometry.predicates import orient3d
from unitcad.meshcheck.geometry.sieves import MOST_CONTACTS, Contacts, Planes, height_fields, planes_of
from unitcad.meshcheck.geometry.topology import (
    Edges,
    Topology,
    Turns,
    edges_of,
    max_side_squared,
    side_by_side,
    surrounded_vertices,
)

_FOLD = 2.0  # float32 steps: a fold thinner than that has no thickness
_WIDE = 64.0  # float32 steps: a face lower than that may be thin by rounding


def kinds(topology: Topology, shells: Ints, opposite: Bools) -> tuple[Bools, Bools]:
    """Return which pairs that cover each other in one plane double a shell (G008), and which leave no room (G009).

    `shells` (n, 2) are theirs; `opposite`: they look opposite ways. The others belong to two shells side by side, or to
    one within the other, which G003 and G002 report.
    """
    volume, closed = topology.volumes[shells], topology.closed[shells].all(axis=1)
    apart = shells[:, 0] != shells[:, 1]
    bare = apart & closed & ~side_by_side(volume[:, 0], volume[:, 1])
    return ~opposite & ~apart, opposite & (~apart | bare)


def run_alike(a: Ints, b: Ints) -> Bools:
    """Return which pairs of faces (n, 3) run along a common edge in one direction: they lie on one side of it."""
    ends = [np.roll(face, -1, axis=1) for face in (a, b)]
    same = (a[:, :, None] == b[:, None, :]) & (ends[0][:, :, None] == ends[1][:, None, :])
    return np.asarray(same.any(axis=(1, 2)))


def wide_pairs(a: Floats, b: Floats) -> Bools:
    """Return which coplanar pairs that overlap are higher than four float32 steps both. Rounding makes lower ones."""
    high = np.ones(len(a), bool)
    least = 4 * float32_steps(np.concatenate([a, b], axis=1))
    for corners in (a, b):
        double = area_vectors(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
        height = np.sqrt(np.einsum("ij,ij->i", double, double)) / np.sqrt(max_side_squared(corners))
        high &= height > least
    return high


def through_edges(turns: Turns | None, shells: Ints) -> Ints:
    """Return edges round which the winding number of one shell takes three values or more."""
    if turns is None:
        return np.empty(0, np.int64)
    group, ends, turn = turns.group, turns.ends, turns.turn
    shell = shells[turns.half // 3]
    n = int(shell.max()) + 1  # the half-edges are in the order of turns already
    bits = (len(turns.many) * n).bit_length()
    order = sorted_with_order(group.astype(np.uint64) * np.uint64(n) + shell.astype(np.uint64), bits)[1]
    group, ends, turn, shell = group[order], ends[order], turn[order], shell[order]
    own = np.append(True, (group[1:] != group[:-1]) | (shell[1:] != shell[:-1]))
    start = np.flatnonzero(own)
    change = np.where(ends, -1, 1)
    level = np.cumsum(change)
    level -= np.repeat(level[start] - change[start], np.diff(np.append(start, len(level))))
    last = np.append((turn[1:] != turn[:-1]) | own[1:], True)
    between = np.flatnonzero(last)  # values in sectors that have a width, one shell of one edge after the other
    of = (np.cumsum(own) - 1)[between]
    low, high = np.full(len(start), 10**9), np.full(len(start), -(10**9))
    np.minimum.at(low, of, level[between])
    np.maximum.at(high, of, level[between])
    evenly = np.add.reduceat(change, start) == 0
    return turns.many[np.unique(group[start][(high - low > 1) & evenly])]


def folded_edges(vertices: Floats, faces: Ints, edges: Edges, areas: Floats) -> tuple[Ints, Floats, Floats]:
    """Return edges of two faces that look opposite ways and are in one plane as float32 has it, though not exactly.

    And for each of them the heights of its two faces, mm, the lower one first.
    """
    two = (edges.size == 2) & edges.balanced  # two faces that run alike are turned over, not folded
    pair = edges.first[two]
    left, right = edges.order[pair] // 3, edges.order[pair + 1] // 3
    facing = np.einsum("ij,ij->i", areas.take(left, axis=0), areas.take(right, axis=0))
    against = np.flatnonzero(facing < 0)
    if not len(against):
        return against, np.empty(0), np.empty(0)
    pair, left, right, facing = pair[against], left[against], right[against], facing[against]
    square = [np.einsum("ij,ij->i", areas[face], areas[face]) for face in (left, right)]
    flat = facing * facing > (1 - 1e-6) * square[0] * square[1]
    pair, left, square = pair[flat], left[flat], [values[flat] for values in square]
    ends = [faces[edges.order[pair] // 3, (edges.order[pair] % 3 + k) % 3] for k in range(3)]
    tip = faces[edges.order[pair + 1] // 3, (edges.order[pair + 1] % 3 + 2) % 3]
    corners = vertices[np.stack([*ends, tip], axis=1)]
    step = float32_steps(corners)
    length = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    height, higher = (np.sqrt(of(*square)) / length for of in (np.minimum, np.maximum))
    apart = np.abs(np.einsum("ij,ij->i", areas[left], corners[:, 3] - corners[:, 0])) / np.sqrt(square[0])
    thin = np.flatnonzero((height > _WIDE * step) & (apart <= _FOLD * step))
    exact = orient3d(*(corners[thin, k] for k in range(4))) == 0
    thin = thin[~exact]
    return np.flatnonzero(two)[against][flat][thin], height[thin], higher[thin]


Pairs = tuple[Ints, Ints]
_AHEAD = 8  # blocks that wait for the second thread
_BLOCK = 1 << 17  # pairs of faces decided together
_PAIRS = 1 << 15  # of which so many are sieved together: enough to outweigh the calls, few enough for the cache
_MOST_LOOKS, _LOOKS = 50_000_000, 100  # pairs looked at, in all and a face
_FEW = 4_000_000  # meeting pairs kept; more is a mesh that lies on itself everywhere, and one is enough to say so


@dataclass(frozen=True, eq=False)
class Faces:
    """Faces with an area in the order of a space-filling curve, and what decides pairs of them.

    `corners` (3, m) are their vertices, and `safe` (3, m) those whose stars are height fields, -1 for the others.
    `shell` and `original` (m,) give each face's shell and its number in the file. `several`: whether there are several
    shells.
    """

    vertices: Floats
    corners: Ints
    safe: Ints
    planes: Planes
    shell: Ints
    original: Ints
    several: bool


@dataclass(eq=False)
class Crossings:
    """Pairs of `faces` that meet, collected over the blocks; `stopped`: why not all were looked at, None if they were.

    `crossing` pass through each other, `covering` overlap in one plane; `contact` has pairs of shells that meet.
    """

    faces: Faces | None = None
    contact: Contacts = field(default_factory=lambda: Contacts(0))
    crossing: list[Ints] = field(default_factory=list)
    covering: list[Ints] = field(default_factory=list)
    leaning: list[Ints] = field(default_factory=list)
    kept: int = 0
    looked_at: int = 0
    stopped: Interrupted | None = None

    @property
    def crossed(self) -> bool:
        """Whether faces pass through each other."""
        return any(len(pairs) for pairs in self.crossing)

    def touching(self) -> Ints:
        """Return pairs of shells (k, 2) whose faces meet, the smaller number first."""
        return np.stack(np.divmod(self.contact.pairs()[0], self.contact.shells), axis=1)


def crossings_of(topology: Topology, tick: Tick) -> Crossings:
    """Find the pairs of faces that meet, each where the file has it; of those that touch one for a pair of shells."""
    vertices, stored = topology.mesh.vertices, topology.stored
    frame = frame_of(vertices)
    steps = frame.steps(vertices)
    boxes = boxes_of(steps, *stored.T)
    order = box_order(boxes, frame)
    order = order[topology.stored_areas[order].any(axis=1)]
    if len(order) < 2:
        return Crossings()
    tick()
    faces = _prepared(topology, order)
    crossings = Crossings(faces, Contacts(topology.n_shells, max(MOST_CONTACTS, 2 * len(order))))
    slabs, waiting = slabs_of(steps, *faces.corners), list[Pairs]()
    try:
        pairs = meeting_pairs(boxes.take(order, axis=0), tick)
        for near in _ahead(lambda block: slabs.meeting(*_strangers(faces, *block)), pairs):
            waiting.append(near)
            if sum(len(some) for some, _ in waiting) > _BLOCK:
                _decide(faces, waiting, crossings)
                waiting = []
                tick()
        _decide(faces, waiting, crossings)
    except Interrupted as stop:
        crossings.stopped = stop
        crossings.contact.noted.clear()  # shells that touch there may cross elsewhere
    _leaning(crossings)
    return crossings


def _ahead(sieve: Callable[[Pairs], Pairs], blocks: Iterator[Pairs]) -> Iterator[Pairs]:
    """Yield the sieved blocks in their order; a second thread sieves while this one finds the next blocks."""
    coming = deque[Future[Pairs]]()
    with ThreadPoolExecutor(1) as thread:
        for block in blocks:
            coming.append(_submit(thread, sieve, block))
            if len(coming) > _AHEAD:
                yield coming.popleft().result()
        while coming:
            yield coming.popleft().result()


def _submit(thread: ThreadPoolExecutor, function: Callable[..., Any], *given: object) -> Future[Any]:
    """Call a function in another thread. Raises MemoryError if there is no room for its stack."""
    try:
        return thread.submit(function, *given)
    except RuntimeError:
        raise MemoryError from None


def _prepared(topology: Topology, order: Ints) -> Faces:
    vertices, several = topology.mesh.vertices, topology.n_shells > 1
    stored = topology.stored
    columns, corners = np.ascontiguousarray(vertices.T), columns_of(stored, order)
    normal = columns_of(topology.stored_areas, order)
    edges = topology.edges if stored is topology.mesh.faces else edges_of(stored, len(vertices))
    places = same_place(vertices).take(corners) if several and topology.mesh.indexed else corners
    with ThreadPoolExecutor(1) as thread:
        planes = _submit(thread, planes_of, columns, places, normal)
        smooth = height_fields(columns, corners, normal, surrounded_vertices(edges, len(vertices)))
    return Faces(
        vertices,
        corners,
        np.where(smooth.take(corners), corners, np.int32(-1)),
        planes.result(),
        topology.shells[order],
        topology.kept[order],
        several,
    )


def _strangers(faces: Faces, i: Ints, j: Ints) -> Pairs:
    """Drop pairs that share a vertex whose star is a height field."""
    apart = np.ones(len(i), bool)
    mine = [corner.take(i, mode="clip") for corner in faces.safe]
    theirs = [corner.take(j, mode="clip") for corner in faces.corners]
    for one in mine:
        for other in theirs:
            apart &= one != other
    keep = np.flatnonzero(apart)
    return i[keep], j[keep]


def _decide(faces: Faces, waiting: list[Pairs], crossings: Crossings) -> None:
    """Decide pairs of faces that are near each other: planes first, then exact signs."""
    if not waiting or crossings.kept > _FEW:
        return
    i, j = (np.concatenate(part) for part in zip(*waiting, strict=True))
    if not len(i):
        return
    crossings.looked_at += len(i)
    if crossings.looked_at > (most := max(_MOST_LOOKS, _LOOKS * len(faces.original))):
        raise TooMany(most, "faces")
    blocks = [slice(start, start + _PAIRS) for start in range(0, len(i), _PAIRS)]
    sieved = [_sieved(faces, i[block], j[block]) for block in blocks]
    open_, flush, shared = (np.concatenate(part) for part in zip(*sieved, strict=True))
    twice = np.flatnonzero(shared == 3)  # in one place: a face that the file lists twice, or another one
    if faces.planes.ids is not faces.corners:
        twice = twice[_common(*(faces.corners.take(f[twice], axis=1) for f in (i, j))) == 3]
    open_[twice] = False
    if faces.several:
        some = np.flatnonzero(~open_ & (shared > 0))
        crossings.contact.add(faces.shell, i[some], j[some])
        some = np.flatnonzero(flush)
        some = some[crossings.contact.unknown(faces.shell, i[some], j[some])]
        touch = some[predicates.meet(*(faces.vertices[faces.corners[:, f[some]].T] for f in (i, j))).touches]
        crossings.contact.add(faces.shell, i[touch], j[touch])
    left = np.flatnonzero(open_)
    _decide_exactly(faces, i[left], j[left], shared[left], crossings)


def _sieved(faces: Faces, i: Ints, j: Ints) -> tuple[Bools, Bools, Ints]:
    """Return which pairs of faces may cross or overlap, which others may touch, and how many corners they share."""
    planes = faces.planes
    ids_a, ids_b = planes.vertices(i), planes.vertices(j)
    common = _common(ids_a, ids_b)
    clear = planes.one_side(i, ids_b, common)
    left = np.flatnonzero(~clear)
    clear[left] = planes.one_side(j[left], ids_a.take(left, axis=1), common[left])
    # Neighbours across an edge meet elsewhere only if one is folded flat onto the other.
    edge = np.flatnonzero((common >= 2) & ~clear)
    if len(edge):
        clear[edge] = (facing(faces, i[edge], j[edge]) > 0) & ~run_alike(ids_a[:, edge].T, ids_b[:, edge].T)
    left = np.flatnonzero(~clear & (common < 3))
    a, b = (planes.corners(ids.take(left, axis=1)) for ids in (ids_a, ids_b))
    flush = np.zeros(len(i), bool)
    flush[left] = clear[left] = _flush(a, b)
    return ~clear, flush & (common == 0), common


def _flush(a: Floats, b: Floats) -> Bools:
    """Return which faces (corner, axis, n) lie to either side of a level plane and can do no more than touch there.

    The plane holds four corners at most, so no side of one lies in it with all of the other.
    """
    flush = np.zeros(a.shape[2], bool)
    for one, other in ((a, b), (b, a)):
        high, low = one.max(axis=0), other.min(axis=0)
        there = np.count_nonzero(one == high, axis=0) + np.count_nonzero(other == low, axis=0)
        flush |= ((high < low) | ((high == low) & (there <= 4))).any(axis=0)
    return flush


def _common(a: Ints, b: Ints) -> Ints:
    """Return how many corners faces share, by their vertices (corner, n)."""
    shared = np.zeros(a.shape[1], np.int8)
    for k in range(3):
        for m in range(3):
            shared += a[k] == b[m]
    return shared


def _decide_exactly(faces: Faces, i: Ints, j: Ints, shared: Ints, crossings: Crossings) -> None:
    """Decide pairs of faces by exact signs; `shared` (n,) counts their common corners."""
    if not len(i):
        return
    pair, overlaps, meets = np.stack([i, j], axis=1), shared == 3, shared > 0
    a, b = (faces.vertices[faces.corners[:, f].T] for f in (i, j))
    some = np.flatnonzero(~overlaps)  # others are in one place
    meeting = predicates.meet(a[some], b[some])
    overlaps[some] = meeting.overlaps
    wide = np.flatnonzero(overlaps)
    crossings.covering.append(pair[wide[wide_pairs(a[wide], b[wide])]])
    if faces.several:
        meets[some] |= meeting.touches | meeting.crosses
        crossings.contact.add(faces.shell, i[meets], j[meets])
    crossing = some[meeting.crosses & (shared[some] < 2)]
    crossings.crossing.append(pair[crossing])
    crossings.kept += len(crossing) + len(wide)
    in_b, in_a = (
        np.flatnonzero(((side == 0).sum(axis=1) == 2) & (shared[some] < 2)) for side in (meeting.side_a, meeting.side_b)
    )
    if len(in_a) or len(in_b):
        sides = np.concatenate([meeting.side_a[in_b], meeting.side_b[in_a]])
        in_a, in_b = some[in_a], some[in_b]
        face, holder = np.concatenate([i[in_b], j[in_a]]), np.concatenate([j[in_b], i[in_a]])
        one, other = np.concatenate([a[in_b], b[in_a]]), np.concatenate([b[in_b], a[in_a]])
        crossings.leaning.append(_edges_inside(faces, face, holder, one, other, sides))


def facing(faces: Faces, i: Ints, j: Ints) -> Floats:
    """Return the product of both faces' normals: positive where they look the same way."""
    return np.einsum("ij,ij->j", faces.planes.normal.take(i, axis=1), faces.planes.normal.take(j, axis=1))


def _edges_inside(faces: Faces, face: Ints, holder: Ints, one: Floats, other: Floats, sides: Ints) -> Ints:
    """Return edges of `face` (corners `one`) within `holder` (corners `other`), of faces with one corner off its plane.

    Rows of holder, both vertices of the edge, the side that its face leaves to, and that face.
    """
    free = np.argmax(sides != 0, axis=1)
    rows = np.arange(len(face))
    u, v = (free + 1) % 3, (free + 2) % 3
    kept = np.flatnonzero(predicates.segment_inside(one[rows, u], one[rows, v], other))
    face, holder = face[kept], holder[kept]
    ids = np.stack([corner[face] for corner in faces.corners], axis=1)
    rows = rows[: len(kept)]
    ends = np.sort(np.stack([ids[rows, u[kept]], ids[rows, v[kept]]], axis=1), axis=1)
    return np.column_stack([holder, ends, sides[kept, free[kept]], face]).astype(np.int64)


def _leaning(crossings: Crossings) -> None:
    """Add edges that lie in a face with their two faces on both sides of it: crossings through an edge."""
    rows = np.concatenate([np.empty((0, 5), np.int64), *crossings.leaning])
    rows = rows[np.lexsort(rows.T[[3, 2, 1, 0]])]
    same = (rows[1:, :3] == rows[:-1, :3]).all(axis=1) & (rows[1:, 3] != rows[:-1, 3])
    through = np.flatnonzero(same)
    crossings.crossing.append(rows[through][:, [4, 0]].astype(np.int32))


def join_pairs(blocks: list[Ints]) -> Ints:
    """Return the pairs of all blocks, (k, 2)."""
    return np.concatenate(blocks) if blocks else np.empty((0, 2), np.int32)


MOST_DEPTHS = 20_000
"""Pairs whose depth is worked out; more of them are no rounding."""
_MOST_NEIGHBOURS = 4_000_000
_STEPS = 4  # float32 steps: no less is told from rounding
_SEEN = 3  # pairs in which one fold shows
_PART = 0.1  # of a face: of finer faces none reaches deep, though all of them together do


def crossing_depths(vertices: Floats, corners: Ints, pairs: Ints, least: float) -> Floats:
    """Return how deep pairs of faces (n, 2) that cross reach through each other, mm; infinity if that is not shallow.

    A face reaches through another's plane as far as the neighbours of its corners there do. `corners` (3, m) are the
    faces' vertices. No depth above `least` (mm) or a tenth of the face is shallow, unless float32 steps are larger.
    """
    depth = np.full(len(pairs), np.inf)
    for face, holder in (pairs.T, pairs.T[::-1]) if 0 < len(pairs) <= MOST_DEPTHS else ():
        a, b = (vertices[corners[:, f].T] for f in (face, holder))
        depth = np.minimum(
            depth, _shallow(_beyond(vertices, corners, face, a, b), a, b, np.sqrt(max_side_squared(a)), least)
        )
    return depth


def _shallow(depth: Floats, a: Floats, b: Floats, size: Floats, least: float) -> Floats:
    steps = float32_steps(np.concatenate([a, b], axis=1))
    return np.where(depth <= np.maximum(_STEPS * steps, np.minimum(least, _PART * size)), depth, np.inf)


def _beyond(vertices: Floats, corners: Ints, face: Ints, a: Floats, b: Floats) -> Floats:
    """Return how far the surface round each face (n,), with corners `a`, reaches to the nearer side of b's plane.

    It is without end if vertices have too many neighbours to look at.
    """
    normal = cross(b[:, 1] - b[:, 0], b[:, 2] - b[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    near, first, count = _neighbours(corners, np.unique(corners[:, face]), len(vertices))
    seeds = corners[:, face].T.reshape(-1)
    if int(count[seeds].sum()) > _MOST_NEIGHBOURS:
        return np.full(len(face), np.inf)
    row = np.repeat(np.arange(len(seeds)), count[seeds])
    place = np.arange(len(row)) - np.repeat(np.cumsum(count[seeds]) - count[seeds], count[seeds])
    pair = row // 3
    away = np.einsum("ij,ij->i", vertices[near[first[seeds][row] + place]] - b[pair, 0], normal[pair])
    own = np.einsum("ikj,ij->ik", a - b[:, :1], normal)
    step = float32_steps(np.concatenate([a, b], axis=1))[:, None]
    reach = np.zeros((2, len(face)))
    for side, sign in enumerate((1.0, -1.0)):
        there = (sign * own >= -step).reshape(-1)[row]
        np.maximum.at(reach[side], pair[there], sign * away[there])
    return reach.min(axis=0)


def _neighbours(corners: Ints, asked: Ints, n: int) -> tuple[Ints, Ints, Ints]:
    """Return the vertices that share a face with those `asked`, themselves included; of each the first, how many."""
    wanted = np.zeros(n, bool)
    wanted[asked] = True
    some = corners[:, wanted[corners].any(axis=0)]
    start = np.concatenate([np.repeat(corner, 3) for corner in some])
    end = np.concatenate([some.T.reshape(-1)] * 3)
    order = sorted_with_order(start.astype(np.uint64), max(n, 1).bit_length())[1]
    count = np.bincount(start, minlength=n)
    return end[order], np.cumsum(count) - count, count


def covering_depths(vertices: Floats, corners: Ints, pairs: Ints, least: float) -> Floats:
    """Return how deep pairs of faces (n, 2) in one plane cover each other, mm; infinity if that is not shallow.

    A pair's depth is the way in the plane by which the faces come apart, or the mean
    width that all faces together cover of one of the two, by fold, if that is more. The others are as in
    `crossing_depths`.
    """
    if not 0 < len(pairs) <= MOST_DEPTHS:
        return np.full(len(pairs), np.inf)
    a, b = (vertices[corners[:, f].T] for f in pairs.T)
    normals = [cross(of[:, 1] - of[:, 0], of[:, 2] - of[:, 0]) for of in (a, b)]
    double = [np.linalg.norm(normal, axis=1) for normal in normals]
    normal = np.where((double[0] >= double[1])[:, None], *normals)
    depth = np.min([_overlap(a, b, axis) for axis in _across(a, b, normal)], axis=0)
    longest = [np.sqrt(max_side_squared(of)) for of in (a, b)]
    strip, both = depth * np.minimum(*longest), pairs.T.reshape(-1)
    covered = np.bincount(both, np.concatenate([strip, strip]))[pairs] / _SEEN
    depth = np.max([depth, covered[:, 0] / longest[0], covered[:, 1] / longest[1]], axis=0)
    height = np.maximum(double[0] / longest[0], double[1] / longest[1])
    return _shallow(depth, a, b, height, least)


def folded(low: Floats, high: Floats, least: float) -> Floats:
    """Return `low`, the lesser height of two faces that fold onto each other, or infinity if that is not shallow."""
    return np.where(low <= np.minimum(least, _PART * high), low, np.inf)


def _across(a: Floats, b: Floats, normal: Floats) -> Iterator[Floats]:
    """Yield unit vectors in the plane square to each side of both faces."""
    for of in (a, b):
        for k in range(3):
            axis = cross(of[:, k] - of[:, k - 1], normal)
            yield axis / np.maximum(np.linalg.norm(axis, axis=1), 1e-300)[:, None]


def _overlap(a: Floats, b: Floats, axis: Floats) -> Floats:
    one, other = (np.einsum("ikj,ij->ik", of - a[:, :1], axis) for of in (a, b))
    return np.minimum(one.max(axis=1) - other.min(axis=1), other.max(axis=1) - one.min(axis=1))
