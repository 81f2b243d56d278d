"""Self-crossing (G001), touching shells (G003) and coplanar overlap (G004, G008, G009), decided exactly.

Sieves, each a whole block of pairs at a time: boxes; faces round a vertex whose star is a height field, which can
meet in that vertex only; slabs square to the diagonals of space; planes that set faces apart. What is left is decided
by exact signs.
A crossing is one of: two faces pass through each other; an edge lies in a face and its two faces leave to both sides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from unitcad.check import contact, overlap, triangles
from unitcad.check.contact import Contacts
from unitcad.check.detail import detail
from unitcad.check.edges import balanced
from unitcad.check.findings import Finding, Location, counted
from unitcad.check.limits import Deadline, Unreadable
from unitcad.check.mesh import float32_step, same_place
from unitcad.check.pairs import box_order, boxes_of, frame_of, meeting_pairs, slabs_of
from unitcad.check.planes import Planes, planes_of
from unitcad.check.rulebook import finding
from unitcad.check.stars import height_fields
from unitcad.check.topology import Topology
from unitcad.geometry.arrays import Bools, Floats, Ints

_BLOCK = 1 << 17
_PAIRS = 1 << 12  # pairs whose corners stay in the processor's cache
_OPEN, _APART, _FLUSH = 0, 1, 2  # undecided; no point but common corners; nothing but perhaps touching
_LISTED = 16  # pairs whose places are computed, unless more are kept: some fall together
_FEW = 4_000_000  # meeting pairs kept; more is a mesh that lies on itself everywhere, and one is enough to say so


@dataclass(frozen=True)
class Crossings:
    """Findings, whether faces cross, and pairs of shells (k, 2) whose faces meet."""

    findings: tuple[Finding, ...] = ()
    crossed: bool = False
    touching: Ints = field(default_factory=lambda: np.empty((0, 2), np.int64))


@dataclass
class _Found:
    """Pairs collected over the blocks."""

    contact: Contacts
    crossing: list[Ints] = field(default_factory=list)
    overlap: list[Ints] = field(default_factory=list)
    leaning: list[Ints] = field(default_factory=list)
    kept: int = 0


@dataclass(frozen=True)
class _Faces:
    """Faces in the order of a space-filling curve and what the sieves need of them.

    `normal` (3, m) is twice their area vectors; the vertices of `planes` are the first in each place.
    """

    vertices: Floats
    corners: Ints
    normal: Floats
    safe: Ints
    planes: Planes
    shell: Ints
    original: Ints
    several: bool
    doubled: bool


def judge(topology: Topology, deadline: Deadline) -> Crossings:
    """Apply the rules to a mesh that went through the topology rules."""
    mesh = topology.mesh
    frame = frame_of(mesh.vertices)
    steps = frame.steps(mesh.vertices)
    boxes = boxes_of(steps, *mesh.faces.T)
    order = box_order(boxes, frame)
    normal = np.stack([topology.areas[:, axis].take(order) for axis in range(3)])
    solid = (normal != 0).any(axis=0)
    if not solid.all():
        order, normal = order[solid], normal[:, solid]
    if len(order) < 2:
        return Crossings()
    deadline.tick()
    faces = _prepared(topology, order, normal)
    boxes, slabs = boxes.take(order, axis=0), slabs_of(steps, *faces.corners)
    del normal, steps
    found = _Found(Contacts(topology.n_shells, every=detail().meshes is not None))
    waiting: list[tuple[Ints, Ints]] = []
    count = 0
    try:
        for i, j in meeting_pairs(boxes, deadline):
            i, j = slabs.meeting(*_strangers(faces, i, j))
            waiting.append((i, j))
            count += len(i)
            if count > _BLOCK:
                _decide(faces, waiting, found)
                waiting, count = [], 0
                deadline.tick()
        _decide(faces, waiting, found)
    except Unreadable as stop:
        _leaning(faces, found)
        found.contact.pairs.clear()  # shells that touch there may cross elsewhere
        stop.findings = (*_said(topology, faces, found).findings, *stop.findings)
        raise
    _leaning(faces, found)
    return _said(topology, faces, found)


def _prepared(topology: Topology, order: Ints, normal: Floats) -> _Faces:
    vertices, several = topology.mesh.vertices, topology.n_shells > 1
    columns, corners = np.ascontiguousarray(vertices.T), np.ascontiguousarray(topology.mesh.faces.take(order, axis=0).T)
    smooth = height_fields(columns, corners, normal, _surrounded(topology))
    places = same_place(vertices).take(corners) if several else corners
    return _Faces(
        vertices,
        corners,
        normal,
        np.where(smooth.take(corners), corners, np.int32(-1)),
        planes_of(columns, places, normal),
        topology.shells[order],
        topology.kept[order],
        several,
        several or not topology.edges.closed,
    )


def _surrounded(topology: Topology) -> Bools:
    """Vertices all of whose edges have two faces, wound alike."""
    edges, found = topology.edges, np.ones(len(topology.mesh.vertices), bool)
    if not edges.closed:
        wrong = (edges.size != 2) | ~balanced(topology.mesh.faces, edges)
        found[edges.low[wrong]] = False
        found[edges.high[wrong]] = False
    return found


def _strangers(faces: _Faces, i: Ints, j: Ints) -> tuple[Ints, Ints]:
    """Without pairs that share a vertex whose star is a height field."""
    mine = [safe.take(i, mode="clip") for safe in faces.safe]
    theirs = [corner.take(j, mode="clip") for corner in faces.corners]
    shared = mine[0] == theirs[0]
    part = np.empty(len(i), bool)
    for a in range(3):
        for b in range(3):
            if a or b:
                shared |= np.equal(mine[a], theirs[b], out=part)
    keep = np.flatnonzero(~shared)
    return i[keep], j[keep]


def _decide(faces: _Faces, waiting: list[tuple[Ints, Ints]], found: _Found) -> None:
    """Answers for pairs of faces that are near each other: planes and boxes first, then exact signs."""
    if not waiting or found.kept > _FEW:
        return
    i = np.concatenate([pair[0] for pair in waiting])
    j = np.concatenate([pair[1] for pair in waiting])
    state, shared = np.empty((2, len(i)), np.int8)
    for start in range(0, len(i), _PAIRS):
        rows = slice(start, start + _PAIRS)
        state[rows], shared[rows] = _sieved(faces, i[rows], j[rows])
    if faces.several:
        some = np.flatnonzero(np.where(shared > 0, state != _OPEN, state == _FLUSH))
        some = some[faces.shell[i[some]] != faces.shell[j[some]]]
        _contacts(faces, i[some], j[some], shared[some] > 0, found)
    left = np.flatnonzero(state == _OPEN)
    _decide_exactly(faces, i[left], j[left], shared[left], found)


def _sieved(faces: _Faces, i: Ints, j: Ints) -> tuple[Ints, Ints]:
    """What planes and boxes say of pairs, and how many corners the faces of each share."""
    planes = faces.planes
    ids_a, ids_b = (planes.vertices(f) for f in (i, j))
    shared = np.zeros(len(i), np.int8)
    for k in range(3):
        for m in range(3):
            shared += ids_a[k] == ids_b[m]
    apart = planes.one_side(i, ids_b, shared)
    left = np.flatnonzero(~apart)
    apart[left] = planes.one_side(j[left], ids_a.take(left, axis=1), shared[left])
    # Neighbours across an edge meet elsewhere only if one is folded flat onto the other.
    edge = np.flatnonzero((shared >= 2) & ~apart)
    if len(edge):
        open_ = _facing(faces, i[edge], j[edge]) > 0
        if faces.doubled:
            open_ &= ~overlap.run_alike(ids_a[:, edge].T, ids_b[:, edge].T)
        apart[edge] = open_
    state = apart.astype(np.int8)
    left = np.flatnonzero(~apart)
    a, b = (planes.corners(ids.take(left, axis=1)) for ids in (ids_a, ids_b))
    clear, flush = contact.by_boxes(a, b)
    rest = np.flatnonzero(~(clear | flush) & (shared.take(left) < 3))
    clear[rest] = planes.seen_apart(i[left[rest]], a.take(rest, axis=2), b.take(rest, axis=2), shared[left[rest]])
    state[left[flush]] = _FLUSH
    state[left[clear]] = _APART
    return state, shared


def _contacts(faces: _Faces, i: Ints, j: Ints, sharing: Bools, found: _Found) -> None:
    """Note the shells that meet, of pairs of faces that can do no more than touch; those `sharing` a corner do."""
    keys, pair = found.contact.keys(faces.shell[i], faces.shell[j]), np.stack([i, j], axis=1)
    found.contact.add(keys[sharing], pair[sharing])
    asked = np.flatnonzero(~sharing)
    asked = asked[found.contact.open(keys[asked])]
    a, b = (faces.planes.corners(faces.planes.vertices(f[asked])) for f in (i, j))
    near = np.flatnonzero(~contact.parts_apart(a, b))
    asked = asked[near]

    def meet(rows: Ints) -> Bools:
        return triangles.meet(*(corners[:, :, near[rows]].transpose(2, 0, 1) for corners in (a, b))).touches

    found.contact.look(keys[asked], pair[asked], meet)


def _decide_exactly(faces: _Faces, i: Ints, j: Ints, shared: Ints, found: _Found) -> None:
    """Answers by exact signs; `shared` corners (n,)."""
    if not len(i):
        return
    pair, overlaps, meets = np.stack([i, j], axis=1), shared == 3, shared > 0
    a, b = (faces.vertices[faces.corners[:, f].T] for f in (i, j))
    some = np.flatnonzero(~overlaps)  # others are in one place
    meeting = triangles.meet(a[some], b[some])
    overlaps[some] = meeting.overlaps
    wide = np.flatnonzero(overlaps)
    wide = wide[~_same_corners(faces, i[wide], j[wide])]
    found.overlap.append(pair[wide[overlap.wide(a[wide], b[wide])]])
    if faces.several:
        meets[some] |= meeting.touches | meeting.crosses
        meets &= faces.shell[i] != faces.shell[j]
        found.contact.add(found.contact.keys(faces.shell[i[meets]], faces.shell[j[meets]]), pair[meets])
    crossing = some[meeting.crosses & (shared[some] < 2)]
    found.crossing.append(pair[crossing])
    found.kept += len(crossing) + len(wide)
    in_b, in_a = (
        np.flatnonzero(((side == 0).sum(axis=1) == 2) & (shared[some] < 2)) for side in (meeting.side_a, meeting.side_b)
    )
    if len(in_a) or len(in_b):
        sides = np.concatenate([meeting.side_a[in_b], meeting.side_b[in_a]])
        in_a, in_b = some[in_a], some[in_b]
        face, holder = np.concatenate([i[in_b], j[in_a]]), np.concatenate([j[in_b], i[in_a]])
        one, other = np.concatenate([a[in_b], b[in_a]]), np.concatenate([b[in_b], a[in_a]])
        found.leaning.append(_edges_inside(faces, face, holder, one, other, sides))


def _facing(faces: _Faces, i: Ints, j: Ints) -> Floats:
    """The product of both faces' normals: positive where they look the same way."""
    return np.einsum("ij,ij->j", faces.normal.take(i, axis=1), faces.normal.take(j, axis=1))


def _same_corners(faces: _Faces, i: Ints, j: Ints) -> Bools:
    """Which pairs i, j are one face that is listed twice, with the same vertices."""
    one, other = (np.sort(np.stack([corner[f] for corner in faces.corners]), axis=0) for f in (i, j))
    return np.asarray((one == other).all(axis=0))


def _edges_inside(faces: _Faces, face: Ints, holder: Ints, one: Floats, other: Floats, sides: Ints) -> Ints:
    """Edges of `face` (corners `one`) within `holder` (corners `other`), of faces with one corner off its plane.

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


def _leaning(faces: _Faces, found: _Found) -> None:
    """Edges that lie in a face with their two faces on both sides of it: crossings through an edge."""
    if not found.leaning:
        return
    rows = np.concatenate(found.leaning)
    if not len(rows):
        return
    rows = rows[np.lexsort(rows.T[[3, 2, 1, 0]])]
    same = (rows[1:, :3] == rows[:-1, :3]).all(axis=1) & (rows[1:, 3] != rows[:-1, 3])
    through = np.flatnonzero(same)
    found.crossing.append(rows[through][:, [4, 0]].astype(np.int32))


def _said(topology: Topology, faces: _Faces, found: _Found) -> Crossings:
    findings: list[Finding] = []
    crossing, covering = _joined(found.crossing), _joined(found.overlap)
    opposite = _facing(faces, covering[:, 0], covering[:, 1]) < 0
    twice, thin = overlap.kinds(topology, faces.shell[covering], opposite)
    for code, pairs, what in (
        ("G001", crossing, "that cross"),
        ("G004", covering[~twice & ~thin], "that overlap in one plane"),
        ("G008", covering[twice], "of one shell that overlap in one plane and look the same way"),
        ("G009", covering[thin], "in one plane with nothing between them"),
    ):
        if len(pairs):
            text = f"{counted(len(pairs), 'pair')} of faces {what}"
            findings.append(finding(code, text, len(pairs), _places(topology, faces, pairs)))
    touching = _joined(found.contact.pairs)
    if not len(touching):
        return Crossings(tuple(findings), bool(len(crossing)))
    met = np.sort(faces.shell[touching], axis=1)
    shells, first, which = np.unique(met, axis=0, return_index=True, return_inverse=True)
    shells = shells.astype(np.int64)
    through = found.contact.keys(*faces.shell[crossing].T)
    only = ~np.isin(found.contact.keys(*shells.T), through)
    if only.any():
        n = int(only.sum())
        order, which = np.argsort(which, axis=None, kind="stable"), np.sort(which, axis=None)

        def region(at: int) -> tuple[Ints, tuple[float, float, float]]:
            """The faces found of a pair of shells that touch, and the middle of what their boxes share."""
            at = int(np.flatnonzero(only)[at])
            begin, end = np.searchsorted(which, at + np.arange(2))
            x, y, z = (topology.low[shells[at]].max(axis=0) + topology.high[shells[at]].min(axis=0)).tolist()
            return faces.original[np.unique(touching[order[begin:end]])], (x / 2, y / 2, z / 2)

        places = _places(topology, faces, touching[first[only]], region)
        findings.append(finding("G003", f"{counted(n, 'pair')} of shells that touch", n, places))
    return Crossings(tuple(findings), bool(len(crossing)), shells)


def _places(
    topology: Topology,
    faces: _Faces,
    pairs: Ints,
    region: Callable[[int], tuple[Ints, tuple[float, float, float]]] | None = None,
) -> list[Location]:
    """Where pairs meet, no point twice, with both faces; first the one that was not named before."""
    found: dict[tuple[int, ...], Location] = {}
    named: set[int] = set()
    grid = 4 * max(float32_step(faces.vertices), 1e-300)
    listed = max(_LISTED, detail().locations)
    chosen = np.arange(0, len(pairs), max(1, len(pairs) // listed))[:listed]
    corners = faces.vertices[faces.corners[:, pairs[chosen]].transpose(1, 2, 0)].tolist()
    names = np.sort(faces.original[pairs[chosen]], axis=1).tolist()
    for at, (a, b), (one, other) in zip(chosen.tolist(), corners, names, strict=True):
        x, y, z = triangles.common_point(a, b) or (sum(values) / 3 for values in zip(*a, strict=True))
        xyz = x + 0.0, y + 0.0, z + 0.0  # no -0
        near = tuple(round(v / grid) for v in xyz)
        if near in found:
            continue
        first, second = (other, one) if one in named else (one, other)
        named.add(first)
        drawn, centre = region(at) if region else (None, None)
        found[near] = Location(faces=(first, second), xyz=xyz, object=topology.mesh.name, region=drawn, centre=centre)
    return sorted(found.values(), key=lambda place: place.face or 0)


def _joined(blocks: list[Ints]) -> Ints:
    return np.concatenate(blocks) if blocks else np.empty((0, 2), np.int32)
