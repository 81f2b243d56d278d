"""Sieves for pairs of faces: boxes, planes, corners in common. What they leave is decided by exact signs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np
from numpy.typing import NDArray

from unitcad.geometry.arrays import Bools, Floats, Ints, among, columns_of, distinct, grouped, sorted_with_order
from unitcad.geometry.boxes import (
    Slabs,
    Tick,
    box_order,
    boxes_of,
    frame_of,
    meeting_between,
    meeting_parts,
    ranks_of,
    slabs_of,
)
from unitcad.meshcheck.geometry.topology import Surface, Topology, edges_of, surrounded

_FACES = 1 << 14  # faces whose corners stay in the processor's cache
_RECENT = 1 << 16  # pairs of shells remembered: those found again are near each other in the order of the faces


@dataclass(frozen=True, eq=False)
class FaceBoxes:
    """Boxes of faces by the ranks of their sides, rows of three axes: what can only touch is told by one comparison.

    `high` (n, 4) are 8 times the ranks and how many corners lie there; `low` are 8 times the ranks less that number,
    plus 4. Where the boxes of two faces touch, the former is at most the latter if four corners or fewer lie in the
    plane: then the plane holds no side of one and all of the other. Boxes that are apart touch by this.
    """

    low: Ints
    high: Ints

    def touching(self, i: Ints, j: Ints) -> Bools:
        """Return for pairs of faces whether they can do no more than touch."""
        touch = self._below(i, j)
        touch |= self._below(j, i)
        return np.asarray(touch.view(np.uint32)[:, 0] != 0)

    def _below(self, i: Ints, j: Ints) -> Bools:
        return self.high.take(i, axis=0, mode="clip") <= self.low.take(j, axis=0, mode="clip")


MOST_RANK = 8191
"""The largest rank for which numbers of 16 bits suffice."""


def face_boxes(columns: Floats, ids: Ints) -> FaceBoxes:
    """Return the boxes of faces from vertices (3, n) and their ids (3, m)."""
    if ids.size > columns.shape[1]:
        return ranked_boxes([_numbers(column) for column in columns], ids)
    corners = np.arange(ids.size).reshape(ids.shape)
    return ranked_boxes([_numbers(column.take(ids.reshape(-1))) for column in columns], corners)


def _numbers(values: Floats) -> NDArray[np.uint64]:
    """Return whole numbers of at most 32 bits that are in the order of coordinates (n,), and equal where these are."""
    single = values.astype(np.float32) + np.float32(0)
    if not np.array_equal(single, values):
        return np.unique(values, return_inverse=True)[1].astype(np.uint64)
    bits = single.view(np.uint32)
    return np.where(bits >> np.uint32(31), ~bits, bits | np.uint32(1 << 31)).astype(np.uint64)


def ranked_boxes(ranks: Sequence[NDArray[np.unsignedinteger]], ids: Ints) -> FaceBoxes:
    """Return the boxes of faces from the ranks of the vertices along each axis, and the faces' ids (3, m)."""
    kind = ranks[0].dtype.type
    low, high = np.zeros((ids.shape[1], 4), kind), np.full((ids.shape[1], 4), np.iinfo(kind).max, kind)
    for start in range(0, ids.shape[1], _FACES):
        block = slice(start, start + _FACES)
        places = [corner[block].astype(np.intp) for corner in ids]
        for axis, rank in enumerate(ranks):  # the fourth column never touches
            one, two, three = (rank.take(place, mode="clip") for place in places)
            least, most = np.minimum(np.minimum(one, two), three), np.maximum(np.maximum(one, two), three)
            on_low, on_high = np.zeros((2, len(one)), kind)
            for corner in (one, two, three):
                on_low += corner == least
                on_high += corner == most
            high[block, axis] = most * kind(8) + on_high
            low[block, axis] = least * kind(8) + kind(4) - on_low
    return FaceBoxes(low, high)


MOST_CONTACTS = 1_000_000
"""Pairs of faces that `Contacts` holds, unless it is told another number."""


@dataclass(eq=False)
class Contacts:
    """Pairs of shells that meet, each with the first pair of faces found, or with `every` one.

    `noted` are pairs of faces in blocks, some of shells that were noted before; with more than `most` of them it is
    `full`, and takes no more. `recent_keys` has the keys of some
    shells that were, each at its own place, and `first_place` is room to find the first of several in.
    """

    shells: int
    every: bool = False
    most: int = MOST_CONTACTS
    full: bool = False
    noted: list[tuple[Ints, Ints]] = field(default_factory=list)
    recent_keys: Ints = field(default_factory=lambda: np.full(_RECENT, -1))
    first_place: Ints = field(default_factory=lambda: np.empty(_RECENT, np.int32))

    def keys(self, one: Ints, other: Ints) -> Ints:
        """Return a number for each pair of shells, in either order."""
        return np.minimum(one, other).astype(np.int64) * self.shells + np.maximum(one, other)

    def open(self, keys: Ints) -> Ints:
        """Return which keys (k,) may not be known yet: all that are not, and some others."""
        if self.full:
            return np.empty(0, np.intp)
        if self.every:
            return np.arange(len(keys))
        return np.flatnonzero(self.recent_keys.take(keys & (_RECENT - 1)) != keys)

    def foremost(self, keys: Ints) -> Ints:
        """Return the first place of each key in `keys` (k,). With `every`, return all places.

        Keys that share a slot with another key keep all their places.
        """
        places = np.arange(len(keys), dtype=np.int32)
        if self.every:
            return places
        slots = keys & (_RECENT - 1)
        self.first_place[slots[::-1]] = places[::-1]  # of keys that share a slot, the first one stays
        first = self.first_place.take(slots)
        return np.flatnonzero((first == places) | (keys.take(first) != keys))

    def add(self, keys: Ints, pairs: Ints) -> None:
        """Note pairs of faces that meet (k, 2), one for each pair of shells or `every` one."""
        if self.full:
            return
        if not self.every and len(keys):
            first = self.foremost(keys)
            keys, pairs = keys[first], pairs[first]
            self.recent_keys[keys & (_RECENT - 1)] = keys
        self.noted.append((keys, pairs))
        self.full = sum(len(block) for block, _ in self.noted) > self.most and len(self.pairs()[0]) > self.most // 2

    def pairs(self) -> tuple[Ints, Ints]:
        """Return the keys of shells that meet and pairs of their faces (k, 2), in the order of the keys."""
        if not self.noted:
            return np.empty(0, np.int64), np.empty((0, 2), np.int32)
        keys, pairs = (np.concatenate(part) for part in zip(*self.noted, strict=True))
        ordered, order = sorted_with_order(keys.astype(np.uint64), max(self.shells**2 - 1, 1).bit_length())
        if not self.every:
            fresh = distinct(ordered)
            ordered, order = ordered[fresh], order[fresh]
        keys, pairs = ordered.astype(np.int64), pairs[order]
        self.noted = [(keys, pairs)]  # sorted, the next time takes less
        return keys, pairs

    def shells_of(self, keys: Ints) -> Ints:
        """Return the pairs of shells (k, 2) of these keys, the smaller number first."""
        return np.stack(np.divmod(keys, self.shells), axis=1)


_UNIT = np.finfo(np.float64).eps / 2
_PLANE = 128 * _UNIT  # of longest side ** 2 * largest coordinate: a height times twice the area is off by less
_LINE = 16 * _UNIT  # of the mesh's size ** 2: twice an area in a plane is off by less
_TINY = 1e-270  # more than underflow takes from coordinates that fit single precision


@dataclass(frozen=True, eq=False)
class Planes:
    """Faces by their corners and planes.

    `columns` (3, n): the coordinates of vertices; `ids` (3, m): the vertices of the faces; `normal` (3, m): twice their
    area vectors; `offset` and `error` (m,): normal * point - offset is right to within the error. `line_error` is the
    same for twice an area in a plane square to an axis.
    """

    columns: Floats
    ids: Ints
    normal: Floats
    offset: Floats
    error: Floats
    line_error: float

    def vertices(self, i: Ints) -> Ints:
        """Return the vertices of faces i: (corner, n), to take with."""
        return self.ids.take(i, axis=1, mode="clip").astype(np.intp)

    def corners(self, ids: Ints) -> Floats:
        """Return the corners of faces by their vertices: (corner, axis, n)."""
        corners = np.empty((3, 3, ids.shape[1]))
        for k, at in enumerate(ids):
            for axis, column in enumerate(self.columns):
                column.take(at, mode="clip", out=corners[k, axis])
        return corners

    def one_side(self, i: Ints, others: Ints, shared: Ints) -> Bools:
        """Return whether the vertices `others` (corner, n) of faces are on one side of the plane of each face i.

        0 to 3 of them are `shared`, and left out.
        """
        x, y, z = (row.take(i, mode="clip") for row in self.normal)
        offset, error = self.offset.take(i, mode="clip"), self.error.take(i, mode="clip")
        above, below = np.zeros((2, len(i)), np.int8)
        for at in others:
            height = self.columns[0].take(at, mode="clip")
            height *= x
            for part, column in ((y, self.columns[1]), (z, self.columns[2])):
                term = column.take(at, mode="clip")
                term *= part
                height += term
            height -= offset
            above += height > error
            below += height < -error
        return ((above == 0) | (below == 0)) & (above + below >= 3 - shared) & (shared < 3)

    def seen_apart(self, i: Ints, a: Floats, b: Floats, shared: Ints) -> Bools:
        """Return whether a side of a or b has them on both sides of its line, as seen along the axis that i faces most.

        `a` are the corners of i, `b` those of the other face.
        """
        drop = np.argmax(np.abs(self.normal.take(i, axis=1)), axis=0)
        rows = np.arange(len(i))
        (x_a, y_a), (x_b, y_b) = ([corners[:, (drop + k) % 3, rows] for k in (1, 2)] for corners in (a, b))
        return self._outside(x_a, y_a, x_b, y_b, shared) | self._outside(x_b, y_b, x_a, y_a, shared)

    def _outside(self, x: Floats, y: Floats, other_x: Floats, other_y: Floats, shared: Ints) -> Bools:
        """Return whether all of the other's corners (corner, pair) are outside one side of a triangle in the plane."""
        along_x, along_y = x[[1, 2, 0]] - x, y[[1, 2, 0]] - y
        turn = along_x[0] * along_y[1] - along_y[0] * along_x[1]
        turn = np.sign(turn) * (np.abs(turn) > self.line_error)
        along_x *= turn
        along_y *= turn
        inside, outside = np.zeros((2, *x.shape), np.int8)
        for k in range(3):
            height = along_x * (other_y[k] - y)
            height -= along_y * (other_x[k] - x)
            inside += height > self.line_error
            outside += height < -self.line_error
        return np.asarray(((inside == 0) & (outside >= 3 - shared) & (shared < 3)).any(axis=0))


def planes_of(columns: Floats, ids: Ints, normal: Floats) -> Planes:
    """Return the planes of faces from vertices (3, n), their ids (3, m) and their `area_vectors` (3, m)."""
    low, high = columns.min(axis=1), columns.max(axis=1)
    offset, longest = np.zeros((2, ids.shape[1]))
    for start in range(0, ids.shape[1], _FACES):
        block = slice(start, start + _FACES)
        places = [corner[block].astype(np.intp) for corner in ids]
        for axis, column in enumerate(columns):
            at = [column.take(place, mode="clip") for place in places]
            offset[block] += normal[axis, block] * at[0]
            for k in range(3):
                side = at[k] - at[k - 1]
                np.maximum(longest[block], np.abs(side, out=side), out=longest[block])
    longest *= longest
    longest *= _PLANE * float(np.maximum(-low, high).max())
    longest += _TINY
    return Planes(columns, ids, normal, offset, longest, _LINE * float((high - low).max()) ** 2 + _TINY)


_FACES = 1 << 14  # faces whose coordinates stay in the processor's cache
_ROUNDING = 1e-15  # of the squared longest side: more than rounding takes from twice an area
_SOUND = 1e-9  # of the squared longest side: faces with less area have no direction worth adding to a mean
_FACING = 0.01  # cosine to the mean direction
_AXES = (((1, 0, 0), 1), ((0, 1, 0), 2), ((0, 0, 1), 0))
_DIAGONALS = (((1, 1, 0), 2), ((1, -1, 0), 2), ((1, 0, 1), 1), ((1, 0, -1), 1), ((0, 1, 1), 0), ((0, 1, -1), 0))
"""Ways to look along, and an axis square to each."""


@dataclass(frozen=True, eq=False)
class Stars:
    """Vertices of a surface, `smooth` (n,) where their stars are height fields.

    `closed`: whether every edge has two faces, wound alike.
    """

    smooth: Bools
    closed: bool


def stars_of(surface: Surface) -> Stars:
    """Return the stars of a surface's vertices, each face where the file has it."""
    vertices, faces, areas = surface.mesh.vertices, surface.stored, surface.stored_areas
    edges = surface.edges if faces is surface.mesh.faces else edges_of(faces, len(vertices))
    normal, corners = np.ascontiguousarray(areas.T), np.ascontiguousarray(faces.T)
    solid = (normal != 0).any(axis=0)
    if not solid.all():
        normal, corners = normal.compress(solid, axis=1), corners.compress(solid, axis=1)
    whole = surrounded(edges, len(vertices))
    return Stars(height_fields(np.ascontiguousarray(vertices.T), corners, normal, whole), edges.closed)


def height_fields(columns: Floats, corners: Ints, areas: Floats, whole: Bools) -> Bools:
    """Return which vertices (3, n) have such a star, of the `whole` ones, `surrounded` by faces wound alike.

    `corners` (3, m) are the vertices of the faces, `areas` (3, m) twice their area vectors.
    """
    found = _along(_AXES, columns, corners, areas) & whole
    for further in (partial(_along, _DIAGONALS), _along_means):
        asked = whole & ~found
        some = np.flatnonzero(asked.take(corners[0]) | asked.take(corners[1]) | asked.take(corners[2]))
        if not len(some):
            break
        corners, areas = corners.take(some, axis=1), areas.take(some, axis=1)
        found |= further(columns, corners, areas) & asked
    return found


def _along(ways: Sequence[tuple[tuple[int, ...], int]], columns: Floats, corners: Ints, areas: Floats) -> Bools:
    """Return vertices whose faces all face one way, of some `ways`, and go round once, if all their faces are given.

    Seen along that way each face then turns the same way by less than half a turn, so turns are counted by the
    neighbours that pass the line of one coordinate, the one that each way has: comparisons only, hence exact.
    """
    n, m = columns.shape[1], corners.shape[1]
    kind = np.uint8 if len(ways) < 4 else np.uint16
    facing = np.zeros(m, kind)  # a bit a way: faces up along it; then those down
    rises, falls = np.zeros((2, 3, m), np.uint8)  # a bit an axis, for each side
    for start in range(0, m, _FACES):
        block = slice(start, start + _FACES)
        sides = _sides_of(columns, [corner[block].astype(np.intp) for corner in corners])
        least = _ROUNDING * _longest(sides)
        for place, (weights, _) in enumerate(ways):
            parts = [areas[axis, block] * weight for axis, weight in enumerate(weights) if weight]
            up = np.add.reduce(parts)
            more = least * (2 * len(parts) - 1)
            facing[block] |= (up > more).astype(kind) << place
            facing[block] |= (up < -more).astype(kind) << (place + len(ways))
        for axis in range(3):
            for k in range(3):
                rises[k, block] |= (sides[k][axis] > 0).view(np.uint8) << axis
                falls[k, block] |= (sides[k][axis] < 0).view(np.uint8) << axis
    common = np.full(n, (1 << 2 * len(ways)) - 1, kind)
    for corner in corners:
        np.bitwise_and.at(common, corner, facing)
    common = (common | (common >> len(ways))) & ((1 << len(ways)) - 1)
    line = np.zeros(n, np.uint8)  # of the first of them, as a bit
    for place, (_, axis) in reversed(list(enumerate(ways))):
        line[(common & (1 << place)) != 0] = 1 << axis
    turns = np.zeros(n, np.int64)
    for k, corner in enumerate(corners):
        passes = (rises[k] & ~falls[k - 1] & line.take(corner, mode="clip")) != 0
        turns += np.bincount(corner[passes], minlength=n)
    return (common != 0) & (turns == 1)


def _along_means(columns: Floats, corners: Ints, areas: Floats) -> Bools:
    """Return the same along the mean normal of each vertex' faces: corners.

    Rounding moves a face's turn by 2e-5 at most, and turns are whole.
    """
    n, m = columns.shape[1], corners.shape[1]
    blocks = [slice(start, start + _FACES) for start in range(0, m, _FACES)]
    share, angle, steep = np.empty(m), np.empty((3, m)), np.empty((3, m), bool)
    for block in blocks:
        here = list(areas[:, block])
        size = np.sqrt(_dot(here, here))
        sound = size > _SOUND * _longest(_sides_of(columns, [corner[block].astype(np.intp) for corner in corners]))
        share[block] = 1 / np.where(sound, size, np.inf)
    along = [np.add.reduce([np.bincount(corner, share * area, n) for corner in corners]) for area in areas]
    length = np.maximum(np.sqrt(_dot(along, along)), 1e-300)
    along = [part / length for part in along]
    for block in blocks:
        near, here = [corner[block].astype(np.intp) for corner in corners], list(areas[:, block])
        sides = _sides_of(columns, near)
        for k, corner in enumerate(near):
            up = [part.take(corner) for part in along]
            double = _dot(here, up)
            flat = _dot(sides[k], up) * _dot(sides[k - 1], up) - _dot(sides[k], sides[k - 1])
            steep[k, block] = double * share[block] <= _FACING
            np.arctan2(double, flat, out=angle[k, block])
    turns, seen = np.zeros(n), np.ones(n, bool)
    for k, corner in enumerate(corners):
        seen[corner[steep[k]]] = False
        turns += np.bincount(corner, angle[k], n)
    return seen & (np.abs(turns - 2 * np.pi) < 0.1)


def _sides_of(columns: Floats, ids: list[Ints]) -> list[list[Floats]]:
    """Return the sides of faces from each corner to the next, by axis."""
    at = [[column.take(corner, mode="clip") for column in columns] for corner in ids]
    return [[at[(k + 1) % 3][axis] - at[k][axis] for axis in range(3)] for k in range(3)]


def _longest(sides: list[list[Floats]]) -> Floats:
    """Return the squared longest side."""
    one, two, three = (_dot(side, side) for side in sides)
    return np.maximum(np.maximum(one, two), three)


def _dot(a: list[Floats], b: list[Floats]) -> Floats:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


_BITS = 21  # of a corner: its vertex and, above it, a bit that only a difference of 0 clears
MOST_VERTICES = (1 << (_BITS - 1)) - 1
"""From which on no word has room for a corner that does not count."""

_TOPS = np.uint64(sum(1 << (_BITS * k + _BITS - 1) for k in range(3)))
_ONES = np.uint64(sum(1 << (_BITS * k) for k in range(3)))
_TURN, _BACK = np.uint64(_BITS), np.uint64(2 * _BITS)
_WHOLE = np.uint64((1 << 3 * _BITS) - 1)


@dataclass(frozen=True, eq=False)
class CommonCorners:
    """The corners of faces by their vertices, `every` one and those `counted`.

    Words (n,) of three corners, or (3, n) where vertices are too many for that.
    """

    counted: Ints
    every: Ints

    def of(self, i: Ints, j: Ints) -> Bools:
        """Return for pairs of faces whether a corner of i that counts is one of j."""
        if self.every.ndim > 1:
            return self._by_corner(i, j)
        mine, theirs = self.counted.take(i, mode="clip"), self.every.take(j, mode="clip")
        left = mine ^ theirs
        left -= _ONES
        for _ in range(2):
            turned = theirs >> _BACK
            theirs <<= _TURN
            theirs &= _WHOLE
            theirs |= turned
            np.bitwise_xor(mine, theirs, out=turned)
            turned -= _ONES
            left &= turned
        left &= _TOPS
        return np.asarray(left != _TOPS)

    def _by_corner(self, i: Ints, j: Ints) -> Bools:
        mine = [corner.take(i, mode="clip") for corner in self.counted]
        theirs = [corner.take(j, mode="clip") for corner in self.every]
        common, part = np.zeros(len(i), bool), np.empty(len(i), bool)
        for one in mine:
            for other in theirs:
                common |= np.equal(one, other, out=part)
        return common


def common_corners(corners: Ints, counts: Bools, n_vertices: int) -> CommonCorners:
    """Return the corners of faces (3, n), of which those count that `counts` (3, n) says."""
    if n_vertices > MOST_VERTICES:
        return CommonCorners(np.where(counts, corners, np.int32(-1)), corners)
    counted = _words(np.where(counts, corners, np.int32(MOST_VERTICES)))
    return CommonCorners(counted | _TOPS, _words(corners))


def _words(corners: Ints) -> Ints:
    words = np.zeros(corners.shape[1], np.uint64)
    for k, corner in enumerate(corners):
        words |= corner.astype(np.uint64) << np.uint64(_BITS * k)
    return words


@dataclass(frozen=True, eq=False)
class Arranged:
    """Faces that have an area, in the order `order`: `columns` (3, n) of their vertices, `corners` (3, m) into them.

    `normal` (3, m) is twice their area vectors, `steps` (m, 6) their boxes in the tree's steps; `ranked` are these
    boxes where vertices have few coordinates.
    """

    order: Ints
    columns: Floats
    corners: Ints
    normal: Floats
    steps: Ints
    slabs: Slabs
    ranked: FaceBoxes | None


def arranged(surface: Surface) -> Arranged:
    """Arrange the faces of a surface, each where the file has it."""
    vertices, faces, areas = surface.mesh.vertices, surface.stored, surface.stored_areas
    frame = frame_of(vertices)
    steps = frame.steps(vertices)
    boxes = boxes_of(steps, *faces.T)
    order = box_order(boxes, frame)
    normal = columns_of(areas, order)
    solid = (normal != 0).any(axis=0)
    if not solid.all():
        order, normal = order[solid], normal.compress(solid, axis=1)  # keeps each axis in one piece
    columns, corners = np.ascontiguousarray(vertices.T), columns_of(faces, order)
    ranks = ranks_of(steps, vertices, MOST_RANK)
    return Arranged(
        order,
        columns,
        corners,
        normal,
        boxes.take(order, axis=0),
        slabs_of(steps, *corners),
        None if ranks is None else ranked_boxes(ranks, corners),
    )


HUB_FACES = 2000
"""Faces that a hub has at least."""
_HUBS = 16  # hubs, those with the most faces: each is compared with all that is left
_PIECES = 32  # of a face, from the hub outwards
_MOST_PIECES = 4_000_000
Walk = Iterator[tuple[Ints, Ints]]


def hub_walks(ready: Arranged, smooth: Bools, parts: int, tick: Tick) -> list[Walk]:
    """Return iterators over the pairs of faces to compare, some pairs twice; none if there is no hub.

    `smooth` says which vertices have a star that is a height field.
    """
    valence = np.bincount(ready.corners.reshape(-1), minlength=len(smooth)) * smooth
    hubs = np.flatnonzero(valence >= HUB_FACES)
    if not len(hubs):
        return []
    hubs = np.sort(hubs[np.argsort(-valence[hubs], kind="stable")][:_HUBS])
    weight = np.zeros_like(valence)
    weight[hubs] = valence[hubs]
    weights = weight[ready.corners]
    corner = np.argmax(weights, axis=0)
    own = np.where(weights.max(axis=0) > 0, np.take_along_axis(ready.corners, corner[None], axis=0)[0], -1)
    rest, boxes = np.flatnonzero(own < 0), ready.steps[own < 0]
    walks = [_renamed(walk, rest, rest) for walk in meeting_parts(boxes, parts, tick)] if len(rest) > 1 else []
    for hub in hubs:
        mine = np.flatnonzero(own == hub)
        if not len(mine):
            continue
        faces, pieces = _pieces(ready, mine, corner[mine])
        if len(rest):
            walks.append(_renamed(meeting_between(pieces, boxes, tick), faces, rest))
        rest, boxes = np.concatenate([rest, faces]), np.concatenate([boxes, pieces])
    return walks


def _renamed(walk: Walk, here: Ints, there: Ints) -> Walk:
    """Yield the pairs of a walk as faces, each pair once a block."""
    for i, j in walk:
        key = np.unique(here[i].astype(np.uint64) << np.uint64(32) | there[j].astype(np.uint64))
        yield (key >> np.uint64(32)).astype(np.intp), (key & np.uint64(0xFFFFFFFF)).astype(np.intp)


def _pieces(ready: Arranged, faces: Ints, corner: Ints) -> tuple[Ints, Ints]:
    """Return the boxes of pieces of some faces from their hubs outwards, in steps, and the face of each.

    A box is a step wider than its piece on all sides, more than rounding takes.
    """
    frame, n = frame_of(ready.columns.T), max(min(_PIECES, _MOST_PIECES // len(faces)), 1)
    part = np.linspace(0, 1, n + 1)[:, None, None]
    ids = ready.corners[:, faces]
    hub, one, other = (ready.columns[:, np.take_along_axis(ids, (corner[None] + k) % 3, axis=0)[0]].T for k in range(3))
    ends = []
    for far in (one, other):
        points = (hub + part * (far - hub)).reshape(-1, 3)
        ends.append(np.stack(frame.steps(points), axis=1).reshape(n + 1, len(faces), 3).astype(np.int32))
    low = np.minimum(np.minimum(ends[0][:-1], ends[0][1:]), np.minimum(ends[1][:-1], ends[1][1:])) - 1
    high = np.maximum(np.maximum(ends[0][:-1], ends[0][1:]), np.maximum(ends[1][:-1], ends[1][1:])) + 1
    boxes = np.concatenate([low, 65_535 - high], axis=2).reshape(-1, 6).astype(np.uint16)
    order = box_order(boxes, frame)
    return np.tile(faces, n)[order], boxes[order]


_MOST_FACES = 48  # of a shell
_MOST_PAIRS = 32  # for each face: with more of them a tree over the faces takes less
_BLOCK = 1 << 16  # pairs of faces at a time


@dataclass(frozen=True, eq=False)
class SmallShells:
    """What is to be compared of the faces of small shells.

    `sharing` are the pairs of shells that share a corner, each with two faces that do. `faces` lists faces by shell, of
    which shell s has `count[s]` from `first[s]` on, and behind them those that lie in a side of their shell's box. The
    faces of a shell are compared with each other, and rows of `faces` with other rows: of each where they begin and how
    many they are, `products` (p, 4). `boxes` (m, 6) are those of the faces, in steps.
    """

    sharing: Contacts
    faces: Ints
    first: Ints
    count: Ints
    products: Ints
    boxes: Ints

    def parts(self, n: int, tick: Tick) -> list[Iterator[tuple[Ints, Ints]]]:
        """Return `n` iterators that yield the pairs of faces between them, each pair once."""
        shells = np.searchsorted(self.first, np.linspace(0, len(self.boxes), n + 1))
        products = np.array_split(self.products, n)
        return [self._part(shells[k], shells[k + 1], products[k], tick) for k in range(n)]

    def _part(self, begin: int, end: int, products: Ints, tick: Tick) -> Iterator[tuple[Ints, Ints]]:
        for i, j in self._within(np.arange(begin, end)):
            tick()
            yield self._near(i, j)
        for i, j in _product(self.faces, products):
            tick()
            yield self._near(i, j)

    def _within(self, shells: Ints) -> Iterator[tuple[Ints, Ints]]:
        """Yield the pairs of faces of each shell."""
        count = self.count[shells]
        for n in range(2, _MOST_FACES + 1):
            some = shells[count == n]
            one, other = np.triu_indices(n, 1)
            at_once = max(_BLOCK // len(one), 1)
            for start in range(0, len(some), at_once):
                first = self.first[some[start : start + at_once], None]
                yield self.faces[first + one].ravel(), self.faces[first + other].ravel()

    def _near(self, i: Ints, j: Ints) -> tuple[Ints, Ints]:
        """Return the pairs of faces whose boxes meet."""
        one, other = self.boxes.take(i, axis=0), self.boxes.take(j, axis=0)
        below = ~other[:, 3:] >= one[:, :3]
        below &= ~one[:, 3:] >= other[:, :3]
        keep = np.flatnonzero(below.all(axis=1))
        return i[keep], j[keep]


def small_shells(
    topology: Topology, meeting: Ints, shell: Ints, columns: Floats, corners: Ints, places: Ints, boxes: Ints
) -> SmallShells | None:
    """Return what is to be looked at of faces that lie in many small shells; None where they do not.

    meeting (k, 2): pairs of shells whose boxes meet; shell (m,): of each face; columns (3, n): the vertices by axis;
    corners (3, m): of the faces, `places` the first vertices in the places of these; boxes (m, 6): of the faces, in
    steps.
    """
    n = topology.n_shells
    if topology.stored is not topology.mesh.faces:
        return None
    by_shell, first, count = grouped(shell, n)
    if count.max() > _MOST_FACES:
        return None
    sharing = _sharing(places, shell, n)
    if sharing is None:
        return None
    one, other = np.ascontiguousarray(meeting.T)
    flat, axis, rises = np.zeros((3, len(one)), np.int8)
    for k in range(3):
        low, high = np.ascontiguousarray(topology.low[:, k]), np.ascontiguousarray(topology.high[:, k])
        after = high.take(one) == low.take(other)
        ends = after | (high.take(other) == low.take(one))
        flat += ends
        axis[ends], rises[ends] = k, after[ends]
    known = among(sharing.keys(one, other), sharing.pairs()[0]) & (flat > 0)
    whole, level = np.flatnonzero(~known), np.flatnonzero(known & (flat == 1))
    axis, rises = axis[level].astype(np.int64), rises[level].astype(np.int64)
    side_faces, side_first, side_count = _on_sides(topology, shell, columns, corners)
    side_one = one[level] * 6 + axis * 2 + rises
    side_other = other[level] * 6 + axis * 2 + 1 - rises
    m = len(by_shell)
    products = np.concatenate(
        [
            np.stack([first[one[whole]], count[one[whole]], first[other[whole]], count[other[whole]]], axis=1),
            np.stack(
                [m + side_first[side_one], side_count[side_one], m + side_first[side_other], side_count[side_other]],
                axis=1,
            ),
        ]
    )
    products = products[(products[:, 1] * products[:, 3]) > 0]
    if (products[:, 1] * products[:, 3]).sum() > _MOST_PAIRS * m:
        return None
    faces = np.concatenate([by_shell, side_faces])
    return SmallShells(sharing, faces, first, count, products, boxes)


def _on_sides(topology: Topology, shell: Ints, columns: Floats, corners: Ints) -> tuple[Ints, Ints, Ints]:
    """Return the faces that lie in a side of their shell's box, by shell and side, where each side's begin, how many.

    Sides are numbered by axis, the lower one first: shell times 6 plus axis times 2, plus 1 for the upper one.
    """
    faces, sides = [], []
    for axis in range(3):
        one, two, three = (columns[axis].take(corner) for corner in corners)
        level = np.flatnonzero((one == two) & (two == three))
        at, of = one[level], shell[level].astype(np.int64)
        for upper, end in enumerate((topology.low, topology.high)):
            there = at == end[of, axis]
            faces.append(level[there])
            sides.append(of[there] * 6 + (axis * 2 + upper))
    order, first, count = grouped(np.concatenate(sides), 6 * topology.n_shells)
    return np.concatenate(faces)[order], first, count


def _sharing(places: Ints, shell: Ints, n: int) -> Contacts | None:
    """Return the pairs of shells that share a corner, each with two faces that do.

    None where so many shells share one that there would be too many pairs.
    """
    m = len(shell)
    key = (places.astype(np.uint64) * np.uint64(n) + shell.astype(np.uint64)).ravel()
    ordered, order = sorted_with_order(key, int(key.max()).bit_length())
    fresh = distinct(ordered)
    place, of = np.divmod(ordered[fresh].astype(np.int64), n)
    face = order[fresh] % m
    group = distinct(place)
    begin = np.flatnonzero(group)
    size = np.diff(np.append(begin, len(place)))
    if (size * (size - 1) // 2).sum() > _MOST_PAIRS * m:
        return None
    within = np.arange(len(place)) - np.repeat(begin, size)
    left = np.repeat(size, size) - within
    found, some = Contacts(n), np.arange(len(place))
    for apart in range(1, int(size.max(initial=1))):
        some = some[left[some] > apart]
        found.noted.append((found.keys(of[some], of[some + apart]), np.stack([face[some], face[some + apart]], axis=1)))
    return found


def _product(faces: Ints, products: Ints) -> Iterator[tuple[Ints, Ints]]:
    """Yield all pairs of a row of `faces` and another for each of `products`, in blocks."""
    size = products[:, 1] * products[:, 3]
    ends = np.cumsum(size)
    start = 0
    while start < len(products):
        before = ends[start - 1] if start else 0
        stop = max(int(np.searchsorted(ends, before + _BLOCK, "right")), start + 1)
        first, _, second, wide = np.repeat(products[start:stop], size[start:stop], axis=0).T
        at = np.arange(ends[stop - 1] - before) - np.repeat(
            ends[start:stop] - size[start:stop] - before, size[start:stop]
        )
        row, column = np.divmod(at, wide)
        yield faces[first + row], faces[second + column]
        start = stop
