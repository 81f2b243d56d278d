"""Self-crossing (G001), touching shells (G003) and coplanar overlap (G004, G008, G009), decided exactly.

Four sieves, each a whole block of pairs at a time: boxes; faces round a vertex whose star is a height field, which can
meet in that vertex only; planes of the faces; planes through their edges, both in floating point with an error bound.
What is left is decided by exact signs.
A crossing is one of: two faces pass through each other; an edge lies in a face and its two faces leave to both sides.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from unitcad.check import overlap, triangles
from unitcad.check.detail import detail
from unitcad.check.edges import balanced
from unitcad.check.findings import Finding, Location, counted
from unitcad.check.limits import Deadline, Unreadable
from unitcad.check.mesh import Bools, Floats, Ints, cross, float32_step
from unitcad.check.pairs import boxes_of, frame_of, meeting_pairs, morton_order
from unitcad.check.rulebook import finding
from unitcad.check.topology import Topology

_EPS = float(np.finfo(np.float64).eps)
_BLOCK = 1 << 17
_CACHED = 1 << 11  # pairs whose coordinates stay in the processor's cache
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

    crossing: list[Ints] = field(default_factory=list)
    overlap: list[Ints] = field(default_factory=list)
    contact: list[Ints] = field(default_factory=list)
    leaning: list[Ints] = field(default_factory=list)
    kept: int = 0


@dataclass(frozen=True)
class _Faces:
    """Faces in Morton order and what the sieves need of them; `columns` are the vertices' three coordinates."""

    vertices: Floats
    columns: tuple[Floats, Floats, Floats]
    corners: tuple[Ints, Ints, Ints]
    normal: Floats
    safe: tuple[Ints, Ints, Ints]
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
    found = _Found()
    waiting: list[tuple[Ints, Ints]] = []
    count = 0
    try:
        for i, j in meeting_pairs(boxes, deadline):
            i, j = _strangers(faces, i, j)
            waiting.append((i, j))
            count += len(i)
            if count > _BLOCK:
                _decide(faces, waiting, found)
                waiting, count = [], 0
                deadline.tick()
        _decide(faces, waiting, found)
    except Unreadable as stop:
        _leaning(faces, found)
        found.contact.clear()  # shells that touch there may cross elsewhere
        stop.findings = (*_said(topology, faces, found).findings, *stop.findings)
        raise
    _leaning(faces, found)
    return _said(topology, faces, found)


def _prepared(topology: Topology, order: Ints, ordered: Ints, normal: Floats) -> _Faces:
    vertices = topology.mesh.vertices
    corners = tuple(np.ascontiguousarray(ordered[:, k]) for k in range(3))
    columns = tuple(np.ascontiguousarray(vertices[:, axis]) for axis in range(3))
    at = [[column.take(corner, mode="clip") for column in columns] for corner in corners]
    whole = _surrounded(topology)
    smooth = _height_fields(len(vertices), corners, at, normal) & whole
    smooth |= _tilted_fields(vertices, corners, normal, whole & ~smooth)
    safe = tuple(np.where(smooth[corner], corner, -1) for corner in corners)
    return _Faces(
        vertices,
        columns,  # type: ignore[arg-type]
        corners,  # type: ignore[arg-type]
        normal,
        safe,  # type: ignore[arg-type]
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


def _height_fields(n: int, corners: tuple[Ints, ...], at: list[list[Floats]], areas: Floats) -> Bools:
    """Vertices whose faces all face one way along some axis and go round once: such a star is a height field.

    Holds for vertices that are surrounded by faces. Seen along the axis each face then turns the same way by less than
    half a turn, so turns are counted by the neighbours that pass the line of one coordinate: comparisons only, hence
    exact.
    """
    least = 1e-9 * (np.abs(areas[:, 0]) + np.abs(areas[:, 1]) + np.abs(areas[:, 2]))
    ways = np.zeros(len(areas), np.uint8)  # bits 0 to 2: faces up along x, y, z; 3 to 5: down
    for axis in range(3):
        ways |= (areas[:, axis] > least).astype(np.uint8) << axis
        ways |= (areas[:, axis] < -least).astype(np.uint8) << (axis + 3)
    common = np.full(n, 63, np.uint8)
    for corner in corners:
        np.bitwise_and.at(common, corner, ways)
    common = (common | (common >> 3)) & 7
    axis_bit = common & (~common + np.uint8(1))
    # The coordinate to count by is the one after the axis: bits move round by one.
    line = ((axis_bit << 1) | (axis_bit >> 2)) & 7
    ahead, behind = np.zeros((3, len(ways)), np.uint8), np.zeros((3, len(ways)), np.uint8)
    for k in range(3):
        for axis in range(3):
            ahead[k] |= (at[(k + 1) % 3][axis] > at[k][axis]).astype(np.uint8) << axis
            behind[k] |= (at[(k + 2) % 3][axis] > at[k][axis]).astype(np.uint8) << axis
    turns = np.zeros(n, np.int64)
    for k, corner in enumerate(corners):
        passes = (ahead[k] & ~behind[k] & line[corner]) != 0
        turns += np.bincount(corner[passes], minlength=n)
    return (common != 0) & (turns == 1)


def _tilted_fields(vertices: Floats, corners: tuple[Ints, ...], areas: Floats, asked: Bools) -> Bools:
    """The same for the vertices `asked`, along the mean normal of each one's faces: rims and corners.

    Rounding moves a turn by 1e-10 of itself; the faces must look along that direction by far more, and turns are whole.
    """
    some = np.flatnonzero(asked[corners[0]] | asked[corners[1]] | asked[corners[2]])
    n = len(vertices)
    if not len(some):
        return np.zeros(n, bool)
    ids = [corner[some] for corner in corners]
    points = [vertices[corner] for corner in ids]
    unit = areas[some]
    unit /= np.sqrt(np.einsum("ij,ij->i", unit, unit))[:, None]
    along = np.zeros((n, 3))
    for axis in range(3):
        for corner in ids:
            along[:, axis] += np.bincount(corner, weights=unit[:, axis], minlength=n)
    along /= np.maximum(np.sqrt(np.einsum("ij,ij->i", along, along)), 1e-300)[:, None]
    turns, least = np.zeros(n), np.ones(n)
    for k, corner in enumerate(ids):
        one, two, up = points[(k + 1) % 3] - points[k], points[(k + 2) % 3] - points[k], along[corner]
        facing = np.einsum("ij,ij->i", unit, up)
        np.minimum.at(least, corner, facing)
        flat = np.einsum("ij,ij->i", one, two)
        flat -= np.einsum("ij,ij->i", one, up) * np.einsum("ij,ij->i", two, up)
        double = np.einsum("ij,ij->i", cross(one, two), up)
        turns += np.bincount(corner, weights=np.arctan2(double, flat), minlength=n)
    return asked & (least > 0.01) & (np.abs(turns - 2 * np.pi) < 0.1)


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


@dataclass(frozen=True)
class _Some:
    """Corners (3 of them, 3 axes, n), normals (3 axes, n) and squared longest sides of some faces."""

    corners: Floats
    normal: Floats
    longest: Floats

    def only(self, which: Ints) -> _Some:
        return _Some(self.corners[:, :, which], self.normal[:, which], self.longest[which])


def _some(faces: _Faces, which: Ints) -> _Some:
    corners = np.empty((3, 3, len(which)))
    for k, corner in enumerate(faces.corners):
        ids = corner.take(which, mode="clip")
        for axis, column in enumerate(faces.columns):
            column.take(ids, out=corners[k, axis], mode="clip")
    normal = faces.normal.take(which, axis=0, mode="clip").T.copy()
    sides = corners - corners[[2, 0, 1]]
    sides *= sides
    return _Some(corners, normal, sides.sum(axis=1).max(axis=0))


def _sieved(faces: _Faces, i: Ints, j: Ints) -> tuple[Ints, Ints]:
    """Without pairs of which one lies wholly beyond the other's plane, or beyond an edge seen along its normal."""
    kept: list[tuple[Ints, Ints]] = [(i[:0], j[:0])]
    for start in range(0, len(i), _CACHED):
        block = slice(start, start + _CACHED)
        a, b = _some(faces, i[block]), _some(faces, j[block])
        left = np.arange(len(a.longest)) + start
        for apart in (_beside, _aside):
            for _ in range(2):
                keep = np.flatnonzero(~apart(a, b))
                if len(keep) < len(left):
                    left, a, b = left[keep], a.only(keep), b.only(keep)
                a, b = b, a
        kept.append((i[left], j[left]))
    return np.concatenate([pair[0] for pair in kept]), np.concatenate([pair[1] for pair in kept])


def _beside(a: _Some, b: _Some) -> Bools:
    """Where b lies on one side of a's plane, farther than rounding can hide."""
    offset = b.corners - a.corners[0]
    height = (offset * a.normal).sum(axis=1)
    np.abs(offset, out=offset)
    error = offset.sum(axis=1)
    error *= 32 * _EPS * a.longest
    return np.asarray((height > error).all(axis=0) | (height < -error).all(axis=0))


def _aside(a: _Some, b: _Some) -> Bools:
    """Where b lies beyond an edge of a, seen along a's normal."""
    reach = np.sqrt(a.longest)
    found = np.zeros(len(reach), bool)
    for k in range(3):
        side, normal = a.corners[(k + 1) % 3] - a.corners[k], a.normal
        out = np.stack([side[1] * normal[2] - side[2] * normal[1], side[2] * normal[0] - side[0] * normal[2],
                        side[0] * normal[1] - side[1] * normal[0]])  # fmt: skip
        bound = 64 * _EPS * np.abs(out).sum(axis=0)
        offset = b.corners - a.corners[k]
        height = (offset * out).sum(axis=1)
        found |= (height > bound * (np.abs(offset).sum(axis=1) + reach)).all(axis=0)
    return found


def _decide(faces: _Faces, waiting: list[tuple[Ints, Ints]], found: _Found) -> None:
    """Exact answers for the pairs that came through the sieves."""
    i = np.concatenate([pair[0] for pair in waiting]) if waiting else np.empty(0, np.int32)
    j = np.concatenate([pair[1] for pair in waiting]) if waiting else np.empty(0, np.int32)
    i, j = _sieved(faces, i, j)
    if not len(i) or found.kept > _FEW:
        return
    ids_a = np.stack([corner[i] for corner in faces.corners], axis=1)
    ids_b = np.stack([corner[j] for corner in faces.corners], axis=1)
    shared = (ids_a[:, :, None] == ids_b[:, None, :]).sum(axis=(1, 2))
    # Neighbours across an edge meet elsewhere only if one is folded flat onto the other.
    open_ = (shared >= 2) & (np.einsum("ij,ij->i", faces.normal[i], faces.normal[j]) > 0)
    if faces.doubled:
        open_[open_] = ~overlap.run_alike(ids_a[open_], ids_b[open_])
    if open_.any():
        i, j, ids_a, ids_b, shared = (array[~open_] for array in (i, j, ids_a, ids_b, shared))
    a, b = faces.vertices[ids_a], faces.vertices[ids_b]
    meeting = triangles.meet(a, b)
    pair = np.stack([i, j], axis=1)
    crossing = meeting.crosses & (shared < 2)
    found.crossing.append(pair[crossing])
    wide = np.flatnonzero(meeting.overlaps & (shared < 3))
    found.overlap.append(pair[wide[overlap.wide(a[wide], b[wide])]])
    if faces.several:
        apart = faces.shell[i] != faces.shell[j]
        meets = meeting.touches | meeting.crosses | (shared > 0)
        found.contact.append(pair[apart & meets])
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
    touching = _joined(found.contact)
    if not len(touching):
        return Crossings(tuple(findings), bool(len(crossing)))
    met = np.sort(faces.shell[touching], axis=1)
    shells, first, which = np.unique(met, axis=0, return_index=True, return_inverse=True)
    shells = shells.astype(np.int64)
    through = {tuple(row) for row in np.sort(faces.shell[crossing], axis=1).tolist()}
    only = np.array([tuple(row) not in through for row in shells.tolist()], bool)
    if only.any():
        n = int(only.sum())
        order, which = np.argsort(which, axis=None, kind="stable"), np.sort(which, axis=None)

        def contact(at: int) -> Ints:
            """All faces of a pair of shells that touch."""
            begin, end = np.searchsorted(which, np.flatnonzero(only)[at] + np.arange(2))
            return faces.original[np.unique(touching[order[begin:end]])]

        places = _places(topology, faces, touching[first[only]], contact)
        findings.append(finding("G003", f"{counted(n, 'pair')} of shells that touch", n, places))
    return Crossings(tuple(findings), bool(len(crossing)), shells)


def _places(
    topology: Topology, faces: _Faces, pairs: Ints, region: Callable[[int], Ints] | None = None
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
        found[near] = Location(faces=(first, second), xyz=xyz, object=topology.mesh.name, region=region and region(at))
    return sorted(found.values(), key=lambda place: place.face or 0)


def _joined(blocks: list[Ints]) -> Ints:
    return np.concatenate(blocks) if blocks else np.empty((0, 2), np.int32)
