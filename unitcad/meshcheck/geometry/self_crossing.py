"""Faces of a mesh that cross, touch or cover each other in one plane, decided exactly.

Sieves, each a whole block of pairs at a time: boxes; faces round a vertex whose star is a height field, which can
meet in that vertex only; slabs square to the diagonals of space; planes that set faces apart. What is left is decided
by exact signs.
A crossing is one of: two faces pass through each other; an edge lies in a face and its two faces leave to both sides.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, distinct
from unitcad.geometry.boxes import Slabs, box_pairs, meeting_parts
from unitcad.geometry.ticks import Interrupted, Tick, TooMany
from unitcad.meshcheck.geometry import coverings, triangles
from unitcad.meshcheck.geometry.arranged import Arranged
from unitcad.meshcheck.geometry.common_corners import CommonCorners, common_corners
from unitcad.meshcheck.geometry.contact import MOST_CONTACTS, Contacts, FaceBoxes, face_boxes
from unitcad.meshcheck.geometry.hubs import hub_walks
from unitcad.meshcheck.geometry.planes import Planes, planes_of
from unitcad.meshcheck.geometry.stars import Stars
from unitcad.meshcheck.geometry.topology import Topology
from unitcad.meshcheck.geometry.triangle_mesh import MANY, same_place

LEAST_SHELLS = 200  # compared shell by shell, where they are small
_BLOCK = 1 << 17
_PARTS = 24  # of the walk over MANY faces or more
_PAIRS = 1 << 15  # pairs looked at together: enough to outweigh the calls, few enough for the cache
_RARE = 16  # of so many faces less than one has such a corner: most pairs need no look for one in common
_SPARSE = 4  # of so many faces less than one is in a pair: a sieve of those few is the cheaper one
_OPEN, _APART, _FLUSH = 0, 1, 2  # undecided; no point but common corners; nothing but perhaps touching
_MOST_LOOKS, _LOOKS = 50_000_000, 100  # pairs looked at, in all and a face
_UNEVEN = 4  # times its share that a part of the walk may take
_FEW = 4_000_000  # meeting pairs kept; more is a mesh that lies on itself everywhere, and one is enough to say so


@dataclass(frozen=True, eq=False)
class Faces:
    """Faces in the order of a space-filling curve and what the sieves need of them.

    `normal` (3, m) is twice their area vectors; `columns` (3, n) are the vertices by axis, and `places` (3, m) the
    first vertices in the places of the corners. `safe` are the corners whose stars are height fields;
    `some_safe` says which faces have one, where few do.
    """

    vertices: Floats
    corners: Ints
    normal: Floats
    safe: CommonCorners
    some_safe: Bools | None
    columns: Floats
    places: Ints
    ranked: FaceBoxes | None
    shell: Ints
    original: Ints
    several: bool
    doubled: bool

    @cached_property
    def sieve(self) -> Sieve:
        """The sieve of all faces."""
        return _sieve(self)


@dataclass(frozen=True, eq=False)
class Sieve:
    """Planes and boxes of faces, all or some."""

    planes: Planes
    boxes: FaceBoxes


def _sieve(faces: Faces, some: Ints | None = None) -> Sieve:
    """Return the sieve of all faces or, by their own numbers, of `some`."""
    corners, places, normal = (
        rows if some is None else rows.take(some, axis=1) for rows in (faces.corners, faces.places, faces.normal)
    )
    boxes = faces.ranked if faces.ranked is not None and some is None else face_boxes(faces.columns, corners)
    return Sieve(planes_of(faces.columns, places, normal), boxes)


@dataclass(eq=False)
class Crossings:
    """Pairs of `faces` that meet, collected over the blocks; `stopped`: why not all were looked at, None if they were.

    `crossing` pass through each other, `covering` overlap in one plane; `contact` has pairs of shells that meet, and
    `meeting` (k, 2) those whose boxes do, sorted, where they were needed. Those of one of several `parts` of the walk
    have no `faces` of their own.
    """

    faces: Faces | None = None
    contact: Contacts = field(default_factory=lambda: Contacts(0))
    crossing: list[Ints] = field(default_factory=list)
    covering: list[Ints] = field(default_factory=list)
    leaning: list[Ints] = field(default_factory=list)
    kept: int = 0
    looked_at: int = 0
    parts: int = 1
    meeting: Ints | None = None
    stopped: Interrupted | None = None

    @property
    def crossed(self) -> bool:
        """Whether faces pass through each other."""
        return any(len(pairs) for pairs in self.crossing)

    def touching(self) -> Ints:
        """Return pairs of shells (k, 2) whose faces meet, the smaller number first."""
        keys = self.contact.pairs()[0]
        return self.contact.shells_of(keys[distinct(keys)])


def crossings_of(topology: Topology, ready: Arranged, stars: Stars, tick: Tick, *, every: bool = False) -> Crossings:
    """Find the pairs of faces that meet, each where the file has it; `ready`: the surface's faces `arranged`.

    `every`: all pairs of those that touch, else one for each pair of shells.
    """
    if len(ready.order) < 2:
        return Crossings()
    tick()
    faces, slabs = _prepared(topology, ready, stars), ready.slabs
    most = max(MOST_CONTACTS, 2 * len(ready.order))
    crossings = Crossings(faces, Contacts(topology.n_shells, every, most))
    parts = _PARTS if len(ready.order) >= MANY else 1
    small = None
    if topology.n_shells >= LEAST_SHELLS and not every:
        from unitcad.meshcheck.geometry.small_shells import small_shells

        with suppress(TooMany):
            crossings.meeting = meeting = box_pairs(topology.low, topology.high, tick)
            small = small_shells(
                topology, meeting, faces.shell, faces.columns, faces.corners, faces.places, ready.steps
            )
    hubs = hub_walks(ready, stars.smooth, parts, tick) if small is None else []
    if small is None:
        walks = hubs or meeting_parts(ready.steps, parts, tick)
    else:
        walks = small.parts(parts, tick)
        crossings.contact.noted += small.sharing.noted

    def part(k: int) -> Crossings:
        # Each begins with nothing known: which process does it has no say in what is found.
        contact = Contacts(topology.n_shells, every, most // len(walks))
        return _met(faces, slabs, walks[k], Crossings(None, contact, parts=len(walks)), tick)

    for met in map(part, range(len(walks))):
        crossings.crossing += met.crossing
        crossings.covering += met.covering
        crossings.leaning += met.leaning
        crossings.contact.noted += met.contact.noted
        crossings.contact.full |= met.contact.full
        crossings.stopped = crossings.stopped or met.stopped
    if crossings.stopped is not None:
        crossings.contact.noted.clear()  # shells that touch there may cross elsewhere
    _leaning(faces, crossings)
    if hubs:  # whose walks give some pairs twice
        for blocks in (crossings.crossing, crossings.covering):
            blocks[:] = [np.unique(np.sort(joined(blocks), axis=1), axis=0)]
    return crossings


def _met(faces: Faces, slabs: Slabs, walk: Iterator[tuple[Ints, Ints]], crossings: Crossings, tick: Tick) -> Crossings:
    """Add to `crossings` the pairs of faces of a walk that meet; return them."""
    waiting: list[tuple[Ints, Ints]] = []
    count = 0
    try:
        for i, j in walk:
            i, j = slabs.meeting(*_strangers(faces, i, j))
            waiting.append((i, j))
            count += len(i)
            if count > _BLOCK:
                _decide(faces, waiting, crossings)
                waiting, count = [], 0
                tick()
        _decide(faces, waiting, crossings)
    except Interrupted as stop:
        crossings.stopped = stop
    crossings.contact.pairs()  # what is noted twice goes where two processes share the work
    return crossings


def _prepared(topology: Topology, ready: Arranged, stars: Stars) -> Faces:
    vertices, several = topology.mesh.vertices, topology.n_shells > 1
    order, columns, corners, normal = ready.order, ready.columns, ready.corners, ready.normal
    safe = stars.smooth.take(corners)
    has_safe = np.asarray(safe.any(axis=0))
    places = same_place(vertices).take(corners) if several and topology.mesh.indexed else corners
    return Faces(
        vertices,
        corners,
        normal,
        common_corners(corners, safe, len(vertices)),
        has_safe if np.count_nonzero(has_safe) * _RARE < len(order) else None,
        columns,
        places,
        ready.ranked,
        topology.shells[order],
        topology.kept[order],
        several,
        several or not stars.closed,
    )


def _strangers(faces: Faces, i: Ints, j: Ints) -> tuple[Ints, Ints]:
    """Drop pairs that share a vertex whose star is a height field."""
    if faces.some_safe is not None:
        some = np.flatnonzero(faces.some_safe.take(i, mode="clip"))
        drop = some[faces.safe.of(i[some], j[some])]
        return (np.delete(i, drop), np.delete(j, drop)) if len(drop) else (i, j)
    keep = np.flatnonzero(~faces.safe.of(i, j))
    return i[keep], j[keep]


def _decide(faces: Faces, waiting: list[tuple[Ints, Ints]], crossings: Crossings) -> None:
    """Decide pairs of faces that are near each other: boxes and planes first, then exact signs."""
    if not waiting or crossings.kept * crossings.parts > _FEW:
        return
    i = np.concatenate([pair[0] for pair in waiting])
    j = np.concatenate([pair[1] for pair in waiting])
    state, shared = np.empty((2, len(i)), np.int8)
    crossings.looked_at += len(i)
    most = max(_MOST_LOOKS, _LOOKS * faces.corners.shape[1])
    if crossings.looked_at * crossings.parts > most * (1 if crossings.parts == 1 else _UNEVEN):
        raise TooMany(most, "faces")
    if "sieve" not in vars(faces) and crossings.looked_at * crossings.parts * _SPARSE < faces.corners.shape[1]:
        some, at = np.unique(np.concatenate([i, j]), return_inverse=True)
        sieve, at = _sieve(faces, some), at.reshape(2, -1)
    else:
        sieve, at = faces.sieve, (i, j)
    for start in range(0, len(i), _PAIRS):
        rows = slice(start, start + _PAIRS)
        state[rows], shared[rows] = _sieved(faces, sieve, (i[rows], j[rows]), at[0][rows], at[1][rows])
    if faces.several:
        some = np.flatnonzero((state == _FLUSH) | ((state == _APART) & (shared > 0)))
        _contacts(faces, i[some], j[some], crossings)
    twice = np.flatnonzero(shared == 3)  # in one place: a face that the file lists twice, or another one
    if faces.places is not faces.corners:
        twice = twice[_common(*(faces.corners.take(f[twice], axis=1) for f in (i, j))) == 3]
    state[twice] = _APART
    if faces.several:
        _note(faces, i, j, twice, crossings.contact)
    left = np.flatnonzero(state == _OPEN)
    _decide_exactly(faces, i[left], j[left], shared[left], crossings)


def _sieved(faces: Faces, sieve: Sieve, pair: tuple[Ints, Ints], i: Ints, j: Ints) -> tuple[Ints, Ints]:
    """Return the state of pairs by boxes and planes, and how many corners the faces share of those boxes leave open.

    i, j are what the `sieve` calls the faces of the pairs.
    """
    state, shared = np.zeros((2, len(i)), np.int8)
    state[sieve.boxes.touching(i, j)] = _FLUSH
    rows = np.flatnonzero(state == _OPEN)
    i, j, planes = i[rows], j[rows], sieve.planes
    ids_a, ids_b = (planes.vertices(f) for f in (i, j))
    shared[rows] = common = _common(ids_a, ids_b)
    clear = planes.one_side(i, ids_b, common)
    left = np.flatnonzero(~clear)
    clear[left] = planes.one_side(j[left], ids_a.take(left, axis=1), common[left])
    # Neighbours across an edge meet elsewhere only if one is folded flat onto the other.
    edge = np.flatnonzero((common >= 2) & ~clear)
    if len(edge):
        open_ = facing(faces, *(f[rows[edge]] for f in pair)) > 0
        if faces.doubled:
            open_ &= ~coverings.run_alike(ids_a[:, edge].T, ids_b[:, edge].T)
        clear[edge] = open_
    left = np.flatnonzero(~clear & (common < 3))
    a, b = (planes.corners(ids.take(left, axis=1)) for ids in (ids_a, ids_b))
    clear[left] = planes.seen_apart(i[left], a, b, common[left])
    state[rows[clear]] = _APART
    return state, shared


def _common(a: Ints, b: Ints) -> Ints:
    """Return how many corners faces share, by their vertices (corner, n)."""
    shared = np.zeros(a.shape[1], np.int8)
    for k in range(3):
        for m in range(3):
            shared += a[k] == b[m]
    return shared


def _contacts(faces: Faces, i: Ints, j: Ints, crossings: Crossings) -> None:
    """Note the shells that meet, of pairs of faces that can do no more than touch; those that share a corner do."""
    contact = crossings.contact
    one, other = faces.shell.take(i), faces.shell.take(j)
    apart = np.flatnonzero(one != other)
    keys = contact.keys(one.take(apart), other.take(apart))
    asked = contact.open(keys)
    i, j, keys = i[apart[asked]], j[apart[asked]], keys[asked]
    asked = np.arange(len(keys))
    if not contact.every:  # mostly the first pair of two shells shares a corner, and the others need no look
        first = contact.foremost(keys)
        first = first[_sharing(faces, i[first], j[first])]
        contact.add(keys[first], np.stack([i[first], j[first]], axis=1))
        asked = contact.open(keys)
    sharing = _sharing(faces, i[asked], j[asked])
    some = asked[sharing]
    contact.add(keys[some], np.stack([i[some], j[some]], axis=1))
    some = asked[~sharing]
    some = some[contact.open(keys[some])]
    a, b = (faces.vertices[faces.corners[:, f[some]].T] for f in (i, j))
    some = some[triangles.meet(a, b).touches]
    contact.add(keys[some], np.stack([i[some], j[some]], axis=1))


def _sharing(faces: Faces, i: Ints, j: Ints) -> Bools:
    """Return which pairs of faces have a corner in one place."""
    return _common(faces.places.take(i, axis=1), faces.places.take(j, axis=1)) > 0


def _decide_exactly(faces: Faces, i: Ints, j: Ints, shared: Ints, crossings: Crossings) -> None:
    """Decide pairs of faces by exact signs; `shared` (n,) counts their common corners."""
    if not len(i):
        return
    pair, overlaps, meets = np.stack([i, j], axis=1), shared == 3, shared > 0
    a, b = (faces.vertices[faces.corners[:, f].T] for f in (i, j))
    some = np.flatnonzero(~overlaps)  # others are in one place
    meeting = triangles.meet(a[some], b[some])
    overlaps[some] = meeting.overlaps
    wide = np.flatnonzero(overlaps)
    crossings.covering.append(pair[wide[coverings.wide(a[wide], b[wide])]])
    if faces.several:
        meets[some] |= meeting.touches | meeting.crosses
        _note(faces, i, j, np.flatnonzero(meets), crossings.contact)
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


def _note(faces: Faces, i: Ints, j: Ints, some: Ints, contact: Contacts) -> None:
    """Note the shells of `some` pairs of faces, which meet."""
    if contact.full:
        return
    one, other = faces.shell.take(i[some]), faces.shell.take(j[some])
    apart = np.flatnonzero(one != other)
    some, keys = some[apart], contact.keys(one[apart], other[apart])
    contact.add(keys, np.stack([i[some], j[some]], axis=1))


def facing(faces: Faces, i: Ints, j: Ints) -> Floats:
    """Return the product of both faces' normals: positive where they look the same way."""
    return np.einsum("ij,ij->j", faces.normal.take(i, axis=1), faces.normal.take(j, axis=1))


def _edges_inside(faces: Faces, face: Ints, holder: Ints, one: Floats, other: Floats, sides: Ints) -> Ints:
    """Return edges of `face` (corners `one`) within `holder` (corners `other`), of faces with one corner off its plane.

    Rows of holder, both vertices of the edge, the side that its face leaves to, and that face.
    """
    free = np.argmax(sides != 0, axis=1)
    rows = np.arange(len(face))
    u, v = (free + 1) % 3, (free + 2) % 3
    kept = np.flatnonzero(triangles.segment_inside(one[rows, u], one[rows, v], other))
    face, holder = face[kept], holder[kept]
    ids = np.stack([corner[face] for corner in faces.corners], axis=1)
    rows = rows[: len(kept)]
    ends = np.sort(np.stack([ids[rows, u[kept]], ids[rows, v[kept]]], axis=1), axis=1)
    return np.column_stack([holder, ends, sides[kept, free[kept]], face]).astype(np.int64)


def _leaning(faces: Faces, crossings: Crossings) -> None:
    """Return edges that lie in a face with their two faces on both sides of it: crossings through an edge."""
    if not crossings.leaning:
        return
    rows = np.concatenate(crossings.leaning)
    if not len(rows):
        return
    rows = rows[np.lexsort(rows.T[[3, 2, 1, 0]])]
    same = (rows[1:, :3] == rows[:-1, :3]).all(axis=1) & (rows[1:, 3] != rows[:-1, 3])
    through = np.flatnonzero(same)
    crossings.crossing.append(rows[through][:, [4, 0]].astype(np.int32))


def joined(blocks: list[Ints]) -> Ints:
    """Return the pairs of all blocks, (k, 2)."""
    return np.concatenate(blocks) if blocks else np.empty((0, 2), np.int32)
