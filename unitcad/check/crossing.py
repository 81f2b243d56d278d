"""Self-crossing (G001), touching shells (G003) and coplanar overlap (G004, G008, G009), decided exactly.

Three sieves, each a whole block of pairs at a time: boxes; faces round a vertex whose star is a height field, which can
meet in that vertex only; slabs square to the diagonals of space. What is left is decided by exact signs.
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
from unitcad.check.mesh import float32_step
from unitcad.check.pairs import Slabs, boxes_of, frame_of, meeting_pairs, morton_order, slabs_of
from unitcad.check.rulebook import finding
from unitcad.check.stars import height_fields
from unitcad.check.topology import Topology
from unitcad.geometry.arrays import Bools, Floats, Ints

_BLOCK = 1 << 17
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
    """Faces in Morton order and what the sieves need of them."""

    vertices: Floats
    corners: tuple[Ints, Ints, Ints]
    normal: Floats
    safe: tuple[Ints, Ints, Ints]
    slabs: Slabs
    shell: Ints
    original: Ints
    several: bool
    doubled: bool


def judge(topology: Topology, deadline: Deadline) -> Crossings:
    """Apply the rules to a mesh that went through the topology rules."""
    mesh = topology.mesh
    steps = frame_of(mesh.vertices).steps(mesh.vertices)
    order = morton_order(steps, mesh.faces[:, 0])
    ordered = np.ascontiguousarray(mesh.faces[order])
    normal = topology.areas[order]
    solid = (normal[:, 0] != 0) | (normal[:, 1] != 0) | (normal[:, 2] != 0)
    if not solid.all():
        order, ordered, normal = order[solid], ordered[solid], normal[solid]
    if len(order) < 2:
        return Crossings()
    deadline.tick()
    faces = _prepared(topology, order, ordered, normal)
    boxes = boxes_of(steps, *faces.corners)
    del ordered, normal, steps
    found = _Found(Contacts(topology.n_shells, every=detail().meshes is not None))
    waiting: list[tuple[Ints, Ints]] = []
    count = 0
    try:
        for i, j in meeting_pairs(boxes, deadline):
            i, j = faces.slabs.meeting(*_strangers(faces, i, j))
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


def _prepared(topology: Topology, order: Ints, ordered: Ints, normal: Floats) -> _Faces:
    vertices = topology.mesh.vertices
    corners = tuple(np.ascontiguousarray(ordered[:, k]) for k in range(3))
    smooth = height_fields(vertices, corners, normal, _surrounded(topology))
    safe = tuple(np.where(smooth[corner], corner, -1) for corner in corners)
    return _Faces(
        vertices,
        corners,  # type: ignore[arg-type]
        normal,
        safe,  # type: ignore[arg-type]
        slabs_of(vertices, *corners),
        topology.shells[order],
        topology.kept[order],
        topology.n_shells > 1,
        not topology.edges.closed,
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
    """Exact answers for the pairs that came through the sieves."""
    i = np.concatenate([pair[0] for pair in waiting]) if waiting else np.empty(0, np.int32)
    j = np.concatenate([pair[1] for pair in waiting]) if waiting else np.empty(0, np.int32)
    if not len(i) or found.kept > _FEW:
        return
    ids_a = np.stack([corner[i] for corner in faces.corners], axis=1)
    ids_b = np.stack([corner[j] for corner in faces.corners], axis=1)
    shared = np.zeros(len(i), np.int8)
    for k in range(3):
        for m in range(3):
            shared += ids_a[:, k] == ids_b[:, m]
    # Neighbours across an edge meet elsewhere only if one is folded flat onto the other.
    open_ = (shared >= 2) & (np.einsum("ij,ij->i", faces.normal[i], faces.normal[j]) > 0)
    if faces.doubled:
        open_[open_] = ~overlap.run_alike(ids_a[open_], ids_b[open_])
    if open_.any():
        if faces.several:  # shells that share an edge touch
            edge = np.flatnonzero(open_ & (faces.shell[i] != faces.shell[j]))
            keys = found.contact.keys(faces.shell[i[edge]], faces.shell[j[edge]])
            found.contact.add(keys, np.stack([i[edge], j[edge]], axis=1))
        i, j, ids_a, ids_b, shared = (array[~open_] for array in (i, j, ids_a, ids_b, shared))
    a, b = faces.vertices.take(ids_a, axis=0), faces.vertices.take(ids_b, axis=0)
    apart, flush = contact.by_boxes(a, b)
    if faces.several:
        some = np.flatnonzero(flush & ~apart & (faces.shell[i] != faces.shell[j]))
        keys, pair = found.contact.keys(faces.shell[i[some]], faces.shell[j[some]]), np.stack([i, j], axis=1)[some]
        found.contact.add(keys[shared[some] > 0], pair[shared[some] > 0])
        found.contact.look(keys, pair, lambda rows: triangles.meet(a[some[rows]], b[some[rows]]).touches)
    rest = ~(apart | flush)
    i, j, ids_a, ids_b, shared, a, b = (array[rest] for array in (i, j, ids_a, ids_b, shared, a, b))
    meeting = triangles.meet(a, b)
    pair = np.stack([i, j], axis=1)
    crossing = meeting.crosses & (shared < 2)
    found.crossing.append(pair[crossing])
    wide = np.flatnonzero(meeting.overlaps & (shared < 3))
    found.overlap.append(pair[wide[overlap.wide(a[wide], b[wide])]])
    if faces.several:
        meets = (meeting.touches | meeting.crosses | (shared > 0)) & (faces.shell[i] != faces.shell[j])
        found.contact.add(found.contact.keys(faces.shell[i[meets]], faces.shell[j[meets]]), pair[meets])
    for one, other, ids, sides, flip in (
        (a, b, ids_a, meeting.side_a, False),
        (b, a, ids_b, meeting.side_b, True),
    ):
        lies = np.flatnonzero(((sides == 0).sum(axis=1) == 2) & (shared < 2))
        if not len(lies):
            continue
        free = np.argmax(sides[lies] != 0, axis=1)
        u, v = (free + 1) % 3, (free + 2) % 3
        inside = triangles.segment_inside(one[lies, u], one[lies, v], other[lies])
        kept, u, v, free = lies[inside], u[inside], v[inside], free[inside]
        ends = np.sort(np.stack([ids[kept, u], ids[kept, v]], axis=1), axis=1)
        face, holder = (j[kept], i[kept]) if flip else (i[kept], j[kept])
        side = sides[kept, free]
        found.leaning.append(np.column_stack([holder, ends, side, face]).astype(np.int64))
    found.kept += int(crossing.sum()) + len(wide)


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
    opposite = np.einsum("ij,ij->i", faces.normal[covering[:, 0]], faces.normal[covering[:, 1]]) < 0
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
    for at in range(0, len(pairs), max(1, len(pairs) // listed))[:listed]:
        pair = pairs[at].tolist()
        a, b = (faces.vertices[[int(corner[i]) for corner in faces.corners]] for i in pair)
        point = triangles.common_point(a, b)
        point = a.mean(axis=0) if point is None else point + 0.0
        near = tuple(round(float(v) / grid) for v in point)
        if near in found:
            continue
        one, other = sorted(int(faces.original[i]) for i in pair)
        first, second = (other, one) if one in named else (one, other)
        named.add(first)
        xyz = (float(point[0]), float(point[1]), float(point[2]))
        drawn, centre = region(at) if region else (None, None)
        found[near] = Location(faces=(first, second), xyz=xyz, object=topology.mesh.name, region=drawn, centre=centre)
    return sorted(found.values(), key=lambda place: place.face or 0)


def _joined(blocks: list[Ints]) -> Ints:
    return np.concatenate(blocks) if blocks else np.empty((0, 2), np.int32)
