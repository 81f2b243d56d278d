"""Faces of a mesh that cross or touch, decided exactly, and those that lie on each other to within rounding."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, columns_of, cross, extents, sorted_with_order
from unitcad.geometry.boxes import Interrupted, Tick, TooMany, box_order, boxes_of, frame_of, meeting_pairs, slabs_of
from unitcad.geometry.components import components
from unitcad.meshcheck.geometry import predicates
from unitcad.meshcheck.geometry.mesh import float32_steps, same_place
from unitcad.meshcheck.geometry.resolution import STEPS
from unitcad.meshcheck.geometry.sieves import MOST_CONTACTS, Contacts, Planes, height_fields, planes_of
from unitcad.meshcheck.geometry.topology import (
    Topology,
    Turns,
    edges_of,
    side_by_side,
    surrounded_vertices,
)


def run_alike(a: Ints, b: Ints) -> Bools:
    """Return which pairs of faces (n, 3) run along a common edge in one direction: they lie on one side of it."""
    ends = [np.roll(face, -1, axis=1) for face in (a, b)]
    same = (a[:, :, None] == b[:, None, :]) & (ends[0][:, :, None] == ends[1][:, None, :])
    return np.asarray(same.any(axis=(1, 2)))


def lapping(a: Floats, b: Floats, rounding: Floats) -> Bools:
    """Return which pairs of faces (n, 3, 3) that lie in one plane share a strip wider than `rounding` (n,), mm.

    A face that is no higher than that has no such strip.
    """
    normals = [cross(of[:, 1] - of[:, 0], of[:, 2] - of[:, 0]) for of in (a, b)]
    size = [np.einsum("ij,ij->i", normal, normal) for normal in normals]
    normal = np.where((size[0] >= size[1])[:, None], *normals)
    share = np.ones(len(a), bool)
    for of in (a, b):
        for k in range(3):
            axis = cross(of[:, k] - of[:, k - 1], normal)
            one, other = (np.einsum("ikj,ij->ik", corners - a[:, :1], axis) for corners in (a, b))
            strip = np.minimum(one.max(axis=1) - other.min(axis=1), other.max(axis=1) - one.min(axis=1))
            least = rounding * np.sqrt(np.einsum("ij,ij->i", axis, axis))
            share &= strip > least
            share &= np.ptp(one if of is a else other, axis=1) > least
    return share


def within(a: Floats, b: Floats, reach: Floats) -> Ints:
    """Return the pairs of faces (n, 3, 3), of those that do not meet, that are no farther apart than `reach` (n,), mm.

    The nearest points are on an edge of each, or a corner of one and the inside of the other.
    """
    boxes = [(of.min(axis=1), of.max(axis=1)) for of in (a, b)]
    apart = np.maximum(boxes[0][0] - boxes[1][1], boxes[1][0] - boxes[0][1])
    left = np.flatnonzero((apart <= reach[:, None]).all(axis=1))
    a, b, reach = a[left], b[left], reach[left]
    near = np.zeros(len(left), bool)
    for points, of in ((a, b), (b, a)):
        normal = cross(of[:, 1] - of[:, 0], of[:, 2] - of[:, 0])
        size = np.sqrt(np.einsum("ij,ij->i", normal, normal))
        for k in range(3):
            off = points[:, k] - of[:, 0]
            here = np.abs(np.einsum("ij,ij->i", off, normal)) <= reach * size
            for m in range(3):
                inward = cross(normal, of[:, m] - of[:, m - 1])
                here &= np.einsum("ij,ij->i", points[:, k] - of[:, m], inward) >= 0
            near |= here
    for k in range(3):
        for m in range(3):
            near |= _apart(a[:, k - 1], a[:, k], b[:, m - 1], b[:, m]) <= reach
    return left[near]


def _apart(p: Floats, q: Floats, r: Floats, s: Floats) -> Floats:
    """Return the distances of the segments p q and r s, (n, 3) each (Ericson, Real-Time Collision Detection, 5.1.9)."""
    along, across, off = q - p, s - r, p - r
    a, b, c = (np.einsum("ij,ij->i", *pair) for pair in ((along, along), (along, across), (across, across)))
    d, e = (np.einsum("ij,ij->i", side, off) for side in (along, across))
    one = np.clip((b * e - c * d) / np.maximum(a * c - b * b, 1e-300), 0, 1)
    other = np.clip((b * one + e) / np.maximum(c, 1e-300), 0, 1)
    one = np.clip((b * other - d) / np.maximum(a, 1e-300), 0, 1)
    between = off + one[:, None] * along - other[:, None] * across
    return np.sqrt(np.einsum("ij,ij->i", between, between))


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


Pairs = tuple[Ints, Ints]
_AHEAD = 8  # blocks that wait for the second thread
_BLOCK = 1 << 17  # pairs of faces decided together
_PAIRS = 1 << 15  # of which so many are sieved together: enough to outweigh the calls, few enough for the cache
_MOST_LOOKS, _LOOKS = 50_000_000, 100  # pairs looked at, in all and a face
_MANY_TWICE = 1000  # duplicate faces of which all are compared
_FEW = 1_000_000  # meeting pairs kept; more is a mesh that lies on itself everywhere, and one is enough to say so


@dataclass(frozen=True, eq=False)
class Faces:
    """Faces with an area in the order of a space-filling curve, and what decides pairs of them.

    `corners` (3, m) are their vertices, and `safe` (3, m) those whose stars are height fields, -1 for the others.
    `shell` and `original` (m,) give each face's shell and its number in the file. `several`: whether there are several
    shells. `rounding` (m,): how far rounding may move a face's plane, mm.
    """

    vertices: Floats
    corners: Ints
    safe: Ints
    planes: Planes
    shell: Ints
    original: Ints
    several: bool
    rounding: Floats

    def corners_of(self, *pair: Ints) -> list[Floats]:
        """Return the corners (n, 3, 3) of the faces of each side of pairs."""
        return [self.vertices[self.corners[:, f].T] for f in pair]


@dataclass(eq=False)
class Crossings:
    """Pairs of `faces` that meet, collected over the blocks; `stopped`: why not all were looked at, None if they were.

    `crossing` pass through each other, `lying` lie on each other to within rounding. `contact` has pairs of shells that
    meet, `near` those that rounding may have moved apart. `leaned` (k, 3) are two faces on either side of a third one
    that holds their common edge; they are the last of `crossing`.
    """

    faces: Faces | None = None
    contact: Contacts = field(default_factory=lambda: Contacts(0))
    near: Contacts = field(default_factory=lambda: Contacts(0))
    crossing: list[Ints] = field(default_factory=list)
    lying: list[Ints] = field(default_factory=list)
    leaning: list[Ints] = field(default_factory=list)
    leaned: Ints = field(default_factory=lambda: np.empty((0, 3), np.int32))
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

    def touching_shells(self) -> Ints:
        """Return the keys, sorted, of pairs of shells whose faces meet, or would but for rounding."""
        return np.unique(np.concatenate([self.contact.pairs()[0], self.near.pairs()[0]]))

    def crossing_shells(self) -> Ints:
        """Return the keys, sorted, of pairs of shells that cross by more than rounding."""
        if self.faces is None:
            return np.empty(0, np.int64)
        return np.unique(self.contact.keys(*self.faces.shell[self.deep].T))

    def kinds(self, topology: Topology) -> tuple[Ints, Ints, Ints]:
        """Return the pairs that lie on each other: in one shell and alike, with no room between, all others.

        The others belong to two shells side by side, or to one within the other, which G003 and G002 report.
        """
        pairs = join_pairs(self.lying)
        if self.faces is None:
            return pairs, pairs, pairs
        shells, opposite = self.faces.shell[pairs], facing(self.faces, *pairs.T) < 0
        volume, closed = topology.volumes[shells], topology.closed[shells].all(axis=1)
        apart = shells[:, 0] != shells[:, 1]
        bare = apart & closed & ~side_by_side(volume[:, 0], volume[:, 1])
        twice, thin = ~opposite & ~apart, opposite & (~apart | bare)
        return pairs[twice], pairs[thin], pairs[~twice & ~thin]

    @cached_property
    def deep(self) -> Ints:
        """The pairs that cross by more than rounding moves a plane: places in `faces`, (k, 2)."""
        pairs = join_pairs(self.crossing)
        if self.faces is None or not len(pairs):
            return pairs
        corners = (self.faces.corners_of(*some.T) for some in _blocks(pairs))
        reach = np.concatenate([np.minimum(_reaches(a, b), _reaches(b, a)).min(axis=0) for a, b in corners])
        one, other, holder = self.faces.corners_of(*self.leaned.T)
        sides = [_reaches(of, holder).max(axis=0) for of in (one, other)]
        reach[len(pairs) - len(self.leaned) :] = np.minimum(*sides)
        return pairs[reach > self.faces.rounding[pairs].max(axis=1)]


def _blocks(pairs: Ints) -> list[Ints]:
    """Return pairs in blocks, so that what is worked out of them stays small."""
    return np.split(pairs, np.arange(_BLOCK, len(pairs), _BLOCK))


def _reaches(a: Floats, b: Floats) -> Floats:
    """Return how far the faces `a` reach to either side of the planes of the faces `b`, (n, 3, 3) each: (2, n) mm."""
    normal = cross(b[:, 1] - b[:, 0], b[:, 2] - b[:, 0])
    height = np.einsum("ikj,ij->ik", a - b[:, :1], normal)
    size = np.maximum(np.sqrt(np.einsum("ij,ij->i", normal, normal)), 1e-300)
    return np.maximum([height.max(axis=1), -height.min(axis=1)], 0) / size


def crossing_boxes(faces: Faces, pairs: Ints) -> Floats:
    """Return the boxes (k, 2, 3) of the lines along which pairs of faces cross; those of one face are one line."""
    parts = [_segment(*faces.corners_of(*some.T)) for some in _blocks(pairs)]
    ends = np.concatenate([end for side in zip(*parts, strict=True) for end in side])
    label = components(len(faces.original), *pairs.T)[np.tile(pairs[:, 0], 2)]
    _, label = np.unique(label, return_inverse=True)
    return np.stack(extents(ends, label, int(label.max()) + 1), axis=1)


def _segment(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Return the ends of the segments in which faces a, b (n, 3, 3) cross."""
    normals = [cross(of[:, 1] - of[:, 0], of[:, 2] - of[:, 0]) for of in (a, b)]
    line = cross(*normals)
    low, high = [], []
    for corners, plane, normal in ((a, b, normals[1]), (b, a, normals[0])):
        height = np.einsum("ikj,ij->ik", corners - plane[:, :1], normal)
        before = np.roll(height, 1, axis=1)
        crosses = (height > 0) != (before > 0)
        share = np.where(crosses, before, 0) / np.where(crosses, before - height, 1)
        points = np.roll(corners, 1, axis=1) + share[:, :, None] * (corners - np.roll(corners, 1, axis=1))
        along = np.einsum("ikj,ij->ik", points, line)
        rows = np.arange(len(points))
        for ends, side in ((low, np.inf), (high, -np.inf)):
            way = np.where(crosses, along, side)
            at = np.argmin(way, axis=1) if side > 0 else np.argmax(way, axis=1)
            ends.append((way[rows, at], points[rows, at]))
    first = np.where((low[0][0] >= low[1][0])[:, None], low[0][1], low[1][1])
    last = np.where((high[0][0] <= high[1][0])[:, None], high[0][1], high[1][1])
    return first, last


def crossings_of(topology: Topology, tick: Tick) -> Crossings:
    """Find the pairs of faces that meet, each where the file has it; of those that touch one for a pair of shells."""
    vertices, stored = topology.mesh.vertices, topology.stored
    frame = frame_of(vertices)
    steps = frame.steps(vertices)
    boxes = boxes_of(steps, *stored.T)
    order = box_order(boxes, frame)
    order = order[topology.stored_areas[order].any(axis=1)]
    if len(topology.twice) > _MANY_TWICE:
        order = order[~np.isin(order, _again(topology))]
    if len(order) < 2:
        return Crossings()
    tick()
    faces = _prepared(topology, order)
    contact, near = (Contacts(topology.n_shells, max(MOST_CONTACTS, 2 * len(order))) for _ in range(2))
    crossings = Crossings(faces, contact, near)
    slabs, waiting = slabs_of(steps, *faces.corners), list[Pairs]()
    try:
        pairs = meeting_pairs(boxes.take(order, axis=0), tick, _fans(faces))
        for near in _ahead(lambda block: slabs.meeting(*_strangers(faces, *block)), pairs):
            waiting.append(near)
            if sum(len(some) for some, _ in waiting) > _BLOCK:
                _decide(faces, waiting, crossings)
                waiting = []
                tick()
                if crossings.kept > _FEW:
                    break
        _decide(faces, waiting, crossings)
    except Interrupted as stop:
        crossings.stopped = stop
        crossings.contact.noted.clear()  # shells that touch there may cross elsewhere
        crossings.near.noted.clear()
    _leaning(crossings)
    return crossings


def _again(topology: Topology) -> Ints:
    """Return the faces that others repeat, but for one of each place: k copies of a face would make k^2 pairs."""
    corners = np.sort(topology.mesh.faces[topology.twice], axis=1)
    _, first = np.unique(corners, axis=0, return_index=True)
    return np.delete(topology.twice, first)


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
    rounding = STEPS * float32_steps(vertices[corners.T])
    with ThreadPoolExecutor(1) as thread:
        planes = _submit(thread, planes_of, columns, places, normal, rounding)
        smooth = height_fields(columns, corners, normal, surrounded_vertices(edges, len(vertices)))
    return Faces(
        vertices,
        corners,
        np.where(smooth.take(corners), corners, np.int32(-1)),
        planes.result(),
        topology.shells[order],
        topology.kept[order],
        several,
        rounding,
    )


def _fans(faces: Faces) -> Ints | None:
    """Return for each face the vertex of the largest fan that it belongs to, -1 for none; None if there is no fan.

    Faces round a safe vertex do not cross, and the boxes of all those of a fan of long faces meet.
    """
    count = np.bincount(faces.corners.ravel(), minlength=len(faces.vertices))
    if count.max(initial=0) < _FAN:
        return None
    size = np.where(faces.safe >= 0, count.take(faces.safe, mode="clip"), 0)
    largest = np.argmax(size, axis=0)
    rows = np.arange(size.shape[1])
    return np.where(size[largest, rows] >= _FAN, faces.safe[largest, rows], -1)


_FAN = 64  # faces round a vertex


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
    if not waiting:
        return
    i, j = (np.concatenate(part) for part in zip(*waiting, strict=True))
    if not len(i):
        return
    crossings.looked_at += len(i)
    if crossings.looked_at > (most := max(_MOST_LOOKS, _LOOKS * len(faces.original))):
        raise TooMany(most, "faces")
    blocks = [slice(start, start + _PAIRS) for start in range(0, len(i), _PAIRS)]
    sieved = [_sieved(faces, i[block], j[block]) for block in blocks]
    open_, flush, lying, shared = (np.concatenate(part) for part in zip(*sieved, strict=True))
    twice = np.flatnonzero(shared == 3)  # in one place: a face that the file lists twice, or another one
    if faces.planes.ids is not faces.corners:
        twice = twice[_common(*(faces.corners.take(f[twice], axis=1) for f in (i, j))) == 3]
    open_[twice] = lying[twice] = False
    some = np.flatnonzero(lying)
    some = some[lapping(*faces.corners_of(i[some], j[some]), faces.rounding[i[some]])]
    crossings.lying.append(np.stack([i[some], j[some]], axis=1))
    crossings.kept += len(some)
    if faces.several:
        crossings.near.add(faces.shell, i[some], j[some])
        some = np.flatnonzero(~open_ & (shared > 0))
        crossings.contact.add(faces.shell, i[some], j[some])
        some = np.flatnonzero(flush)
        some = some[crossings.contact.unknown(faces.shell, i[some], j[some])]
        touch = some[predicates.meet(*faces.corners_of(i[some], j[some])).touches]
        crossings.contact.add(faces.shell, i[touch], j[touch])
        some = np.flatnonzero(~open_ & (shared == 0))
        some = some[crossings.contact.unknown(faces.shell, i[some], j[some])]
        some = some[crossings.near.unknown(faces.shell, i[some], j[some])]
        some = some[within(*faces.corners_of(i[some], j[some]), faces.rounding[i[some]])]
        crossings.near.add(faces.shell, i[some], j[some])
    left = np.flatnonzero(open_)
    _decide_exactly(faces, i[left], j[left], shared[left], crossings)


def _sieved(faces: Faces, i: Ints, j: Ints) -> tuple[Bools, Bools, Bools, Ints]:
    """Return which pairs of faces may cross, may touch, and may lie on each other, and how many corners they share."""
    planes = faces.planes
    larger = planes.near.take(i) >= planes.near.take(j)  # rounding tilts the plane of a small face
    i, j = np.where(larger, i, j), np.where(larger, j, i)
    ids_a, ids_b = planes.vertices(i), planes.vertices(j)
    common = _common(ids_a, ids_b)
    clear, lying = planes.one_side(i, ids_b, common)
    left = np.flatnonzero(~clear)
    clear[left], _ = planes.one_side(j[left], ids_a.take(left, axis=1), common[left])
    # Neighbours across an edge meet elsewhere only if one is folded flat onto the other.
    edge = np.flatnonzero((common >= 2) & (~clear | lying))
    if len(edge):
        onwards = (facing(faces, i[edge], j[edge]) > 0) & ~run_alike(ids_a[:, edge].T, ids_b[:, edge].T)
        clear[edge] |= onwards
        lying[edge] &= ~onwards
    left = np.flatnonzero(~clear & (common < 3))
    a, b = (planes.corners(ids.take(left, axis=1)) for ids in (ids_a, ids_b))
    flush = np.zeros(len(i), bool)
    flush[left] = clear[left] = _flush(a, b)
    return ~clear, flush & (common == 0), lying, common


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
    pair, meets = np.stack([i, j], axis=1), shared > 0
    a, b = faces.corners_of(i, j)
    some = np.flatnonzero(shared < 3)  # others are in one place
    meeting = predicates.meet(a[some], b[some])
    if faces.several:
        meets[some] |= meeting.touches | meeting.crosses
        crossings.contact.add(faces.shell, i[meets], j[meets])
    crossing = some[meeting.crosses & (shared[some] < 2)]
    crossings.crossing.append(pair[crossing])
    crossings.kept += len(crossing)
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
    crossings.leaned = np.stack([rows[through, 4], rows[through + 1, 4], rows[through, 0]], axis=1).astype(np.int32)
    crossings.crossing.append(crossings.leaned[:, [0, 2]])


def join_pairs(blocks: list[Ints]) -> Ints:
    """Return the pairs of all blocks, (k, 2)."""
    return np.concatenate(blocks) if blocks else np.empty((0, 2), np.int32)
