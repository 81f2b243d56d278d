"""The topology of a mesh: edges, shells, what is open, wound wrongly or pinched, and what welding closes.

A half-edge is 3 * face + side; side k runs from corner k to corner k + 1. Everything is sorting and gathering.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, cross, distinct, extent, extents, sorted_with_order
from unitcad.geometry.boxes import Tick, TooMany, box_pairs
from unitcad.geometry.components import components
from unitcad.meshcheck.geometry.mesh import Mesh, area_vectors, float32_step, float32_steps, same_place
from unitcad.meshcheck.geometry.resolution import Resolution, resolution_of

_ALONG = 0.1  # cosine: edges that run more alike are not the two sides of a crack
_PAIRS = 1 << 18  # pairs of edges looked at together
_SAME_ANGLE = 1e-7  # radian: faces nearer to each other lie in one plane


@dataclass(frozen=True, eq=False)
class Edges:
    """Half-edges of `faces` sorted by their undirected edge. `first` and `size` describe the groups in `order`."""

    faces: Ints
    order: Ints
    first: Ints
    size: Ints
    low: Ints
    high: Ints

    @cached_property
    def pairs(self) -> tuple[Ints, Ints]:
        """The two half-edges of each edge that has two faces."""
        first = self.first[self.size == 2]
        return self.order[first], self.order[first + 1]

    @cached_property
    def balanced(self) -> Bools:
        """Whether at each edge as many faces run one way as the other, as they do round a solid."""
        last = self.first + self.size - 1
        count = np.cumsum(self.faces.reshape(-1)[self.order] == np.repeat(self.low, self.size), dtype=np.int32)[last]
        return 2 * np.diff(count, prepend=np.int32(0)) == self.size

    @cached_property
    def closed(self) -> bool:
        """Whether every edge has exactly two faces, which run along it in opposite directions."""
        return bool(len(self.size)) and bool((self.balanced & (self.size == 2)).all())


@dataclass(frozen=True, eq=False)
class Turns:
    """The half-edges of the edges `many` by edge and angle, and what is known of each.

    `group` is the place of its edge in `many`, `ends` whether the solid ends at its face, `turn` the rank of its angle,
    the same for faces in one plane. By angle about the edge, the solid begins at faces that run from its high vertex to
    its low one and ends at the others.
    """

    many: Ints
    half: Ints
    group: Ints
    ends: Bools
    turn: Ints


def half_edges(faces: Ints) -> tuple[Ints, Ints]:
    """Return start and end vertex of every half-edge, (3 m,) each."""
    start = np.ascontiguousarray(faces).reshape(-1)
    end = np.ascontiguousarray(faces[:, [1, 2, 0]]).reshape(-1)
    return start, end


def edges_of(faces: Ints, n_vertices: int) -> Edges:
    """Group the half-edges of `faces` (no face may use a vertex twice)."""
    start, end = half_edges(faces)
    bits = max(n_vertices - 1, 1).bit_length()
    key = np.minimum(start, end).astype(np.uint64) << np.uint64(bits)
    key |= np.maximum(start, end).astype(np.uint64)
    key, order = sorted_with_order(key, 2 * bits)
    first = np.flatnonzero(distinct(key)).astype(np.int32)
    size = np.diff(np.append(first, np.int32(len(order))))
    low, high = (ends.astype(np.int32) for ends in np.divmod(key[first], np.uint64(1 << bits)))
    return Edges(faces, order, first, size, low, high)


def opposite(edges: Edges, n_half: int) -> Ints:
    """Return for each half-edge the one across its edge; itself where an edge has other than two faces."""
    across = np.arange(n_half, dtype=np.int32)
    one, other = edges.pairs
    across[one] = other
    across[other] = one
    return across


def surrounded_vertices(edges: Edges, n_vertices: int) -> Bools:
    """Return which vertices have two faces, wound alike, at all their edges."""
    whole = np.ones(n_vertices, bool)
    wrong = (edges.size != 2) | ~edges.balanced
    whole[edges.low[wrong]] = whole[edges.high[wrong]] = False
    return whole


def pinched_vertices(faces: Ints, edges: Edges, n_vertices: int) -> Ints:
    """Return vertices whose faces form more than one fan, but for those of edges that have more than two faces."""
    whole = surrounded_vertices(edges, n_vertices)
    several = _fans(faces, opposite(edges, 3 * len(faces)), whole) > 1
    if not whole.all():
        rest, many = ~whole, edges.size > 2
        rest[edges.low[many]] = rest[edges.high[many]] = False
        first = edges.first[(edges.size == 2) & (rest[edges.low] | rest[edges.high])]
        start = np.ascontiguousarray(faces).reshape(-1)
        several |= _joined_fans(start, edges.order[first], edges.order[first + 1], rest) > 1
    return np.flatnonzero(several).astype(np.int32)


def _fans(faces: Ints, across: Ints, asked: Bools) -> Ints:
    """Return how many fans the faces of each vertex form, of those that are `asked`, where all edges have two faces.

    The half-edges leaving a vertex are permuted by turning to the next face; a fan is one cycle. Cycles are counted
    by pointer doubling, in as many rounds as the largest valence has binary digits.
    """
    start, places = np.ascontiguousarray(faces).reshape(-1), np.arange(3 * len(faces), dtype=np.int32)
    turn = across.reshape(-1, 3)[:, [2, 0, 1]].reshape(-1)
    valence = np.bincount(start, minlength=len(asked))
    if not asked.all():
        turn = np.where(asked.take(start), turn, places)
    label = places.copy()
    rounds = int(valence.max(initial=1, where=asked)).bit_length()
    for i in range(rounds):
        np.minimum(label, label.take(turn), out=label)
        if i < rounds - 1:
            turn = turn.take(turn)
    fans = np.bincount(start[label == places], minlength=len(asked))
    fans[~asked] = 0
    return fans


def _joined_fans(start: Ints, one: Ints, other: Ints, asked: Bools) -> Ints:
    """Return how many fans the faces of each vertex form, of those that are `asked`.

    `one` and `other` are half-edges in pairs, at least all of edges of two faces at these vertices.
    """
    half = np.flatnonzero(asked.take(start))
    number = np.full(len(start), -1)
    number[half] = np.arange(len(half))
    one_on, other_on = (side // 3 * 3 + (side + 1) % 3 for side in (one, other))  # the next half-edge of its face
    alike = start[one] == start[other]
    left = number[np.concatenate([one, one_on])]
    right = number[np.concatenate([np.where(alike, other, other_on), np.where(alike, other_on, other)])]
    kept = left >= 0
    fans = components(len(half), left[kept], right[kept])
    _, where = np.unique(fans, return_index=True)
    return np.bincount(start[half[where]], minlength=len(asked))


def shells_of(faces: Ints, edges: Edges, turns: Turns | None) -> Ints:
    """Return the shell of each face, numbered by their first face.

    Faces are joined across edges of two faces, and in pairs across edges of four, six and so on, by their `turns`.
    """
    left, right = edges.pairs
    if turns is not None:
        one, other = _paired(edges, turns)
        left, right = np.concatenate([left, one]), np.concatenate([right, other])
    return components(len(faces), left // 3, right // 3)


def turns_of(vertices: Floats, faces: Ints, edges: Edges) -> Turns | None:
    """Return the turns at the edges of four, six and so on faces that are balanced; None where there are none."""
    many = np.flatnonzero((edges.size > 2) & edges.balanced)
    return _around(vertices, faces, edges, many) if len(many) else None


def _around(vertices: Floats, faces: Ints, edges: Edges, many: Ints) -> Turns:
    size = edges.size[many]
    group = np.repeat(np.arange(len(many), dtype=np.int32), size)
    starts = np.cumsum(size) - size
    half = edges.order[edges.first[many][group] + np.arange(len(group)) - starts[group]]
    face, side = half // 3, half % 3
    ends = faces[face, side] == edges.low[many][group]
    origin = vertices[edges.low[many]]
    axis = vertices[edges.high[many]] - origin
    length = np.sqrt(np.einsum("ij,ij->i", axis, axis))
    axis /= np.where(length > 0, length, 1.0)[:, None]  # two vertices of one place have an edge without direction
    axis = axis[group]
    out = vertices[faces[face, (side + 2) % 3]] - origin[group]
    out -= axis * np.einsum("ij,ij->i", out, axis)[:, None]
    zero = out[starts][group]
    angle = np.arctan2(np.einsum("ij,ij->i", cross(zero, out), axis), np.einsum("ij,ij->i", zero, out))
    angle[angle < -_SAME_ANGLE] += 2 * np.pi
    angle[angle > 2 * np.pi - _SAME_ANGLE] -= 2 * np.pi
    order = np.lexsort((angle, group))
    angle, half, ends = angle[order], half[order], ends[order]
    fresh = np.diff(angle, prepend=-np.inf) > _SAME_ANGLE
    fresh[starts] = True
    return Turns(many, half, group, ends, np.cumsum(fresh, dtype=np.int32) - np.int32(1))


def _paired(edges: Edges, turns: Turns) -> tuple[Ints, Ints]:
    """Return half-edges at the edges of `turns` in pairs that have the solid between them.

    Where it begins twice before it ends (solids that overlap), first begun is first ended, so that faces in one place
    need no order. Where it begins and ends in one plane, one solid ends and the next one begins.
    """
    half, group, ends, turn = turns.half, turns.group, turns.ends, turns.turn
    size = edges.size[turns.many]
    starts = np.cumsum(size) - size
    place = np.arange(len(group)) - starts[group]
    bits = int(half.max()).bit_length()
    key = (turn.astype(np.uint64) * np.uint64(2) + ~ends) << np.uint64(bits)  # an edge has no turn of another
    key |= half.astype(np.uint64)
    key.sort()
    half, ends = (key & np.uint64((1 << bits) - 1)).astype(half.dtype), (key >> np.uint64(bits)) % 2 == 0
    inside = np.cumsum(np.where(ends, -1, 1))  # solids that have begun and not ended; zero at each edge's last face
    outermost = np.flatnonzero(inside == np.minimum.reduceat(inside, starts)[group])
    outermost = outermost[distinct(group[outermost])]
    rank = (place + starts[group] - outermost[group] - 1) % size[group]
    order = np.empty(len(group), np.int64)
    order[starts[group] + rank] = np.arange(len(group))
    half, ends = half[order], ends[order]
    return half[~ends], half[ends]


NARROW = 0.1  # of the shortest edge at a vertex
_CROWD = 30  # points within reach of a vertex, itself too: more means points that lie everywhere, not a seam


@dataclass(frozen=True)
class Seams:
    """Faces with vertices joined: in `stored` those in one place, in `joined` also those within reach.

    `whole` are the faces that keep three vertices in `stored`. `gap` is the largest distance joined, mm.
    """

    stored: Ints
    joined: Ints
    whole: Bools
    gap: float


def join(vertices: Floats, faces: Ints, loose: Ints, thin: float, tick: Tick) -> Seams:
    """Join the vertices `loose` (those of open edges).

    Two are joined where they are nearer than a tenth of the shortest edge at either, and than `thin` mm (or two float32
    steps). No face collapses: joins that would do that are left out.
    """
    place = np.arange(len(vertices), dtype=np.int32)
    place[loose] = loose[same_place(vertices[loose])]
    stored = place[faces]
    whole = _three(stored)
    points = np.unique(place[loose])
    short = _shortest_edges(vertices, stored[whole], points)
    reach = np.minimum(NARROW * short, np.maximum(thin, 2 * float32_steps(vertices[points])))
    target = _joined(place, stored, points, _near(vertices[points], reach, tick))
    moved = np.flatnonzero(target != np.arange(len(target)))
    away = vertices[moved] - vertices[target[moved]]
    return Seams(stored, target[stored], whole, float(np.sqrt(np.einsum("ij,ij->i", away, away)).max(initial=0)))


def _three(faces: Ints) -> Bools:
    return (faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])


def connected_parts(faces: Ints, n: int) -> Ints:
    """Return for each of `n` vertices which part of the mesh it belongs to: faces connect their vertices."""
    spokes = np.concatenate([faces[:, 0], faces[:, 0]]), np.concatenate([faces[:, 1], faces[:, 2]])
    return components(n, *spokes)


def _shortest_edges(vertices: Floats, faces: Ints, points: Ints) -> Floats:
    """Return the length of the shortest edge at each of `points`, mm."""
    asked = np.zeros(len(vertices), bool)
    asked[points] = True
    start, end = half_edges(faces[asked[faces].any(axis=1)])
    length = np.linalg.norm(vertices[end] - vertices[start], axis=1)
    short = np.full(len(vertices), np.inf)
    np.minimum.at(short, start, length)
    np.minimum.at(short, end, length)
    return short[points]


def _near(points: Floats, reach: Floats, tick: Tick) -> Ints:
    """Return pairs of points within both their reaches; none of a crowd."""
    half = reach[:, None] / 2
    try:
        pairs = box_pairs(points - half, points + half, tick)
    except TooMany:
        pairs = np.empty((0, 2), np.int64)
    distance = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    fits = distance <= reach[pairs].min(axis=1, initial=np.inf)
    if len(points) + 2 * np.count_nonzero(fits) > _CROWD * len(points):
        fits[:] = False
    return pairs[fits]


def _joined(place: Ints, stored: Ints, points: Ints, pairs: Ints) -> Ints:
    """Return what each vertex becomes if each group of pairs is made one, but for groups that would collapse a face."""
    group = components(len(points), pairs[:, 0], pairs[:, 1])
    _, first = np.unique(group, return_index=True)
    target = np.arange(len(place), dtype=np.int32)
    target[points] = points[first[group]]
    joined = target[stored]
    spoilt = joined[_three(stored) & ~_three(joined)].reshape(-1)
    if len(spoilt):
        back = np.isin(target, spoilt)
        target[back] = np.flatnonzero(back)
    return target


def cracks(vertices: Floats, start: Ints, end: Ints, thin: float, tick: Tick) -> tuple[Bools, float]:
    """Return which open edges belong to a border that lies along itself within `thin` mm, and the largest width there.

    Each edge runs from `start` to `end`, as its face does. A border is what open edges connect; on a crack both ends
    and the middle of each of its edges lie at other edges that do not run the same way.
    """
    n = len(start)
    thin = max(thin, 2 * float32_step(vertices[start]))
    ends = np.stack([vertices[start], vertices[end]], axis=1)
    try:
        pairs = box_pairs(ends.min(axis=1) - thin / 2, ends.max(axis=1) + thin / 2, tick)
    except TooMany:
        return np.zeros(n, bool), 0.0
    along = ends[:, 1] - ends[:, 0]
    square = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    away = np.full((3, n), np.inf)
    for at in range(0, len(pairs), _PAIRS):  # of a fine border all at once would take a gigabyte
        tick()
        some = pairs[at : at + _PAIRS]
        one, other = np.concatenate([some, some[:, ::-1]]).T
        facing = np.einsum("ij,ij->i", along[one], along[other]) <= _ALONG * np.sqrt(square[one] * square[other])
        one, other = one[facing], other[facing]
        for k, point in enumerate((ends[:, 0], ends[:, 1], ends.mean(axis=1))):
            off = point[one] - ends[other, 0]
            share = np.clip(np.einsum("ij,ij->i", off, along[other]) / square[other], 0, 1)
            off -= share[:, None] * along[other]
            np.minimum.at(away[k], one, np.sqrt(np.einsum("ij,ij->i", off, off)))
    width = away.max(axis=0)
    used, ids = np.unique(np.concatenate([start, end]), return_inverse=True)
    border = components(len(used), ids[:n], ids[n:])[ids[:n]]
    crack = np.bincount(border[width > thin], minlength=int(border.max(initial=0)) + 1)[border] == 0
    return crack, float(width[crack].max(initial=0))


def closed_shells(edges: Edges, shells: Ints, n: int, but: Ints | None = None) -> Bools:
    """Return whether each of `n` shells has an inside: at all its edges as many faces run one way as the other.

    `but`: edges that have no say.
    """
    inside, odd = np.ones(n, bool), ~edges.balanced
    if but is not None:
        odd[but] = False
    inside[shells[edges.order[np.repeat(odd, edges.size)] // 3]] = False
    return inside


def signed_volumes(vertices: Floats, faces: Ints, areas: Floats, shells: Ints, n: int) -> Floats:
    """Return the volume of each of `n` shells, mm3: negative if its faces look inwards.

    The volume of an open shell means nothing. Tetrahedra stand on the middle of all vertices, so that a part far
    from the origin loses no digits.
    """
    corner = faces[:, 0]
    tetra = np.zeros(len(faces))
    for axis in range(3):
        column = vertices[:, axis]
        height = column.take(corner)
        height -= (column.min() + column.max()) / 2 if n else 0.0
        height *= areas[:, axis]
        tetra += height
    tetra /= 6
    return np.bincount(shells, tetra, n).astype(float) if n > 1 else np.array([tetra.sum()] * n)


def side_by_side(one: Floats, other: Floats) -> Bools:
    """Return whether two closed shells that meet in faces which look opposite ways have material on both sides.

    Arguments are their volumes, 0 for a shell that is not closed. Two solids have; a cavity and the wall's outer face
    have not: the wall is without thickness there. What stands in a cavity has less volume than the cavity, whose volume
    is below zero.
    """
    return np.asarray((one * other > 0) | ((one * other < 0) & (one + other < -1e-9 * np.abs(one))))


@dataclass(frozen=True, eq=False)
class OpenEdges:
    """Edges of one face, before vertices were welded and after it.

    `edges` are those before, of the faces `kept`; of them `shut` are the ones that welding closes, and `gap` is how far
    it moves a vertex, mm. `left` are edges of the welded faces that are open still; `crack` says which of those lie
    along each other, `wide` mm apart at most.
    """

    edges: Edges
    kept: Ints
    shut: Ints
    gap: float
    left: Ints
    crack: Bools
    wide: float


@dataclass(frozen=True, eq=False)
class Topology:
    """A mesh without degenerate faces whose open edges are welded, and what follows from its edges.

    `kept` maps its faces to the file's; `areas` are twice the area vectors, mm2. `stored` are the faces before welding
    moved any, with vertices in one place joined. `repeated` are the file's faces that use a vertex twice, `unused`
    counts vertices that no face uses, `opened` has the edges of one face, if any.
    `shells` labels faces, `turns` has those round edges of four and more. `low` and `high`: each shell's box, mm;
    `volumes`: what it encloses, mm3, below zero where its faces look inwards; `closed`: whether it has an inside,
    `sealed`: whether it has one but for cracks. `resolution`: sizes that a printer shows.
    `pinched` are vertices of several fans, `twice` faces with the vertices of another one, `unbalanced` edges of an
    even number of faces along which more run one way than the other.
    """

    mesh: Mesh
    kept: Ints
    edges: Edges
    areas: Floats
    stored: Ints
    repeated: Ints
    unused: int
    opened: OpenEdges | None
    turns: Turns | None
    shells: Ints
    n_shells: int
    low: Floats
    high: Floats
    volumes: Floats
    closed: Bools
    sealed: Bools
    resolution: Resolution
    pinched: Ints
    twice: Ints
    unbalanced: Ints

    @cached_property
    def stored_areas(self) -> Floats:
        """Twice the area vectors of the faces as stored, mm2."""
        return self.areas if self.stored is self.mesh.faces else area_vectors(self.mesh.vertices, self.stored)

    @cached_property
    def watertight(self) -> bool:
        """Whether every edge has an even number of faces."""
        return bool(len(self.mesh.faces)) and bool((self.edges.size % 2 == 0).all())

    @property
    def oriented(self) -> bool:
        """Whether neighbours are wound alike."""
        return not len(self.unbalanced)


def topology_of(mesh: Mesh, tick: Tick) -> Topology:
    """Work out the topology of a mesh with finite vertices; open edges are welded first."""
    mesh, unused = _referenced(mesh) if mesh.indexed else (mesh, 0)
    faces, vertices = mesh.faces, mesh.vertices
    repeated = ~_three(faces)
    kept = np.arange(len(faces), dtype=np.int32)
    if repeated.any():
        kept = np.flatnonzero(~repeated).astype(np.int32)
        faces = faces[kept]
    edges = edges_of(faces, len(vertices))
    tick()
    stored, opened = faces, None
    resolution = resolution_of(float(np.ptp(extent(vertices), axis=0).max()) if len(vertices) else 0.0)
    if (edges.size == 1).any():
        faces, stored, kept, edges, opened = _welded(vertices, faces, kept, edges, resolution.thin, tick)
        tick()
    areas, turns = area_vectors(vertices, faces), turns_of(vertices, faces, edges)
    tick()
    shells = shells_of(faces, edges, turns)
    tick()
    n = int(shells.max(initial=-1)) + 1
    if n == 1:
        low, high = (corner[None] for corner in extent(vertices))
    else:
        low, high = extents(vertices[faces].reshape(-1, 3), np.repeat(shells, 3), n)
    volumes, closed = signed_volumes(vertices, faces, areas, shells, n), closed_shells(edges, shells, n)
    sealed = closed
    if opened is not None and opened.crack.any():
        sealed = closed_shells(edges, shells, n, opened.left[opened.crack])
    tick()
    pinched = pinched_vertices(faces, edges, len(vertices))
    tick()
    order, same = _same_vertices(faces)
    twice = np.sort(order[same | np.append(same[1:], False)] if edges.closed else order[same])
    if len(twice):
        twice = np.setdiff1d(twice, _facing(order, same, areas, shells, volumes * closed))
    return Topology(
        replace(mesh, faces=faces, normals=None),
        kept,
        edges,
        areas,
        stored,
        np.flatnonzero(repeated),
        unused,
        opened,
        turns,
        shells,
        n,
        low,
        high,
        volumes,
        closed,
        sealed,
        resolution,
        pinched,
        twice,
        np.flatnonzero((edges.size % 2 == 0) & ~edges.balanced),
    )


def by_place(topology: Topology) -> Topology:
    """Return a topology whose vertices in one place are one: its faces, edges, shells and turns, nothing else of it."""
    mesh = topology.mesh
    place = same_place(mesh.vertices) if mesh.indexed else np.arange(0)
    if np.array_equal(place, np.arange(len(place))):
        return topology
    faces = place[mesh.faces]
    whole = _three(faces)
    faces = faces[whole]
    edges = edges_of(faces, len(mesh.vertices))
    return replace(
        topology,
        mesh=replace(mesh, faces=faces),
        kept=topology.kept[whole],
        shells=topology.shells[whole],
        areas=topology.areas[whole],
        edges=edges,
        turns=turns_of(mesh.vertices, faces, edges),
    )


def _referenced(mesh: Mesh) -> tuple[Mesh, int]:
    """Return the mesh without vertices that no face uses, which have no part in its size, and their number."""
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces.reshape(-1)] = True
    n = len(used) - int(np.count_nonzero(used))
    if not n:
        return mesh, 0
    place = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return replace(mesh, vertices=mesh.vertices[used], faces=place[mesh.faces]), n


def _welded(
    vertices: Floats, faces: Ints, kept: Ints, edges: Edges, thin: float, tick: Tick
) -> tuple[Ints, Ints, Ints, Edges, OpenEdges]:
    """Return the faces welded and as stored, what they are in the file, the edges of the former, and the open edges."""

    open_ = np.flatnonzero(edges.size == 1)
    seams = join(vertices, faces, np.unique(np.concatenate([edges.low[open_], edges.high[open_]])), thin, tick)
    joined, stored, whole = seams.joined, seams.stored, seams.whole
    if not whole.all():
        joined, stored, whole_kept = joined[whole], stored[whole], kept[whole]
    else:
        whole_kept = kept
    if np.array_equal(joined, stored):
        stored = joined
    after = edges_of(joined, len(vertices))
    left = np.flatnonzero(after.size == 1)
    shut, crack, wide = open_, np.zeros(0, bool), 0.0
    if len(left):  # only what belongs to shells without a boundary left
        part = connected_parts(joined, len(vertices))
        at = seams.joined[edges.order[edges.first[open_]] // 3, 0]
        shut = open_[~np.isin(part[at], part[after.low[left]])]
        half = after.order[after.first[left]]
        start, end = (joined[half // 3, (half % 3 + k) % 3] for k in (0, 1))
        crack, wide = cracks(vertices, start, end, thin, tick)
    return joined, stored, whole_kept, after, OpenEdges(edges, kept, shut, seams.gap, left, crack, wide)


def diagonals(low: Floats, high: Floats) -> Floats:
    """Return the diagonals of boxes, mm."""
    sides = high - low
    return np.sqrt(np.einsum("ij,ij->i", sides, sides))


def _same_vertices(faces: Ints) -> tuple[Ints, Bools]:
    """Return an order of the faces by their vertices, and where in it one has those of the one before."""
    ordered = np.sort(faces, axis=1)
    order = np.lexsort(ordered.T)
    ordered = ordered[order]
    same = (ordered[1:] == ordered[:-1]).all(axis=1)
    return order, np.append(False, same)[: len(order)]


def _facing(order: Ints, same: Bools, areas: Floats, shells: Ints, volume: Floats) -> Ints:
    """Return duplicates that are none: two faces back to back, of two closed shells that lie on either side of them.

    Where a cavity reaches the wall's outer face, the wall has no thickness. `order` and `same` are of `_same_vertices`.
    """
    first = np.flatnonzero(same) - 1
    alone = ~same[first] & ~np.append(same, False)[first + 2]  # no third face there
    one, other = order[first[alone]], order[first[alone] + 1]
    shell, beside = shells[one], shells[other]
    opposite = np.einsum("ij,ij->i", areas[one], areas[other]) < 0
    touching = opposite & (shell != beside) & side_by_side(volume[shell], volume[beside])
    return np.concatenate([one[touching], other[touching]])


def max_side_squared(corners: Floats) -> Floats:
    """Return the squared length of each triangle's longest side; corners (n, 3, 3)."""
    longest = np.zeros(len(corners))
    for k in range(3):
        side = corners[:, k] - corners[:, k - 1]
        np.maximum(longest, np.einsum("ij,ij->i", side, side), out=longest)
    return longest


def small_patches(topology: Topology, which: Ints) -> Bools:
    """Return which of some edges border a patch of faces that no printer shows: short, or narrower than `thin` on
    average.

    A patch is what edges of two faces connect that run along them in opposite directions.
    """
    edges, faces, limits = topology.edges, topology.mesh.faces, topology.resolution
    sound = edges.first[(edges.size == 2) & edges.balanced]
    patch = components(len(faces), edges.order[sound] // 3, edges.order[sound + 1] // 3)
    n = int(patch.max(initial=-1)) + 1
    area = np.bincount(patch, np.sqrt(np.einsum("ij,ij->i", topology.areas, topology.areas)), n) / 2
    across = diagonals(*extents(topology.mesh.vertices[faces].reshape(-1, 3), np.repeat(patch, 3), n))
    small = (across < limits.feature) | (2 * area < limits.thin * across)
    there = np.repeat(np.arange(len(which)), edges.size[which])
    place = np.arange(len(there)) - np.repeat(np.cumsum(edges.size[which]) - edges.size[which], edges.size[which])
    faces_there = edges.order[edges.first[which][there] + place] // 3
    return np.bincount(there, small[patch[faces_there]], len(which)) > 0
