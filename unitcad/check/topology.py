"""Topology rules, T001 to T013, and V002: edges, winding, pinches, duplicates, degenerate faces, stored normals."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import chain

import numpy as np

from unitcad.check import edges as mesh_edges
from unitcad.check import volumes
from unitcad.check.edges import Edges
from unitcad.check.findings import Finding, Location, counted, number
from unitcad.check.limits import Deadline, keeping
from unitcad.check.mesh import Mesh, area_vectors, extent, extents, float32_step, float32_steps
from unitcad.check.rulebook import finding
from unitcad.check.seams import connected, join, t_junctions
from unitcad.geometry.arrays import Bools, Floats, Ints

FAR = 1e-4  # V002: float32 step over the bounding box's diagonal
SLIVER = 1e-3  # T011: shortest length of a sliver, as part of the diagonal
NORMAL_COS = float(np.cos(np.radians(15.0)))  # T013
_EXACT = 2000  # faces looked at with exact arithmetic before the float verdict is taken


@dataclass(frozen=True)
class Topology:
    """What the topology rules found out; `mesh` is without degenerate faces, and its open edges are welded.

    `kept` maps its faces to the file's; `areas` are twice the area vectors, mm2; `shells` labels faces. `stored` are
    the faces before welding moved any, with vertices in one place joined. `low` and `high`: each shell's box, mm;
    `volumes`: what it holds, mm3, below zero where its faces look inwards; `closed`: whether it has an inside.
    """

    mesh: Mesh
    kept: Ints
    edges: Edges
    shells: Ints
    n_shells: int
    areas: Floats
    watertight: bool
    oriented: bool
    findings: tuple[Finding, ...]
    stored: Ints
    low: Floats
    high: Floats
    volumes: Floats
    closed: Bools

    def as_stored(self) -> Topology:
        """The same with every face where the file has it."""
        if self.stored is self.mesh.faces:
            return self
        edges = mesh_edges.edges_of(self.stored, len(self.mesh.vertices))
        areas = area_vectors(self.mesh.vertices, self.stored)
        return replace(self, mesh=replace(self.mesh, faces=self.stored), edges=edges, areas=areas)


def judge(mesh: Mesh, deadline: Deadline) -> Topology:
    """Apply the topology rules to a mesh with finite vertices."""
    found: list[Finding] = []
    if mesh.indexed:
        mesh, found = _referenced(mesh)
    with keeping(found):
        return _judged(mesh, deadline, found)


def _judged(mesh: Mesh, deadline: Deadline, found: list[Finding]) -> Topology:
    faces, vertices = mesh.faces, mesh.vertices
    repeated = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 2] == faces[:, 0])
    kept = np.arange(len(faces), dtype=np.int32)
    if repeated.any():
        kept = np.flatnonzero(~repeated).astype(np.int32)
        faces = faces[kept]
    edges = mesh_edges.edges_of(faces, len(vertices))
    deadline.tick()
    stored = faces
    if not edges.closed and (edges.size == 1).any():
        faces, stored, kept, edges, extra = _open_edges(mesh, faces, kept, edges)
        found += extra
    areas = stored_areas = area_vectors(vertices, stored)
    if mesh.normals is not None:
        found += _stored_normals(mesh, kept, areas)
    if stored is not faces:
        areas = area_vectors(vertices, faces)
    deadline.tick()
    found += _many_faces(mesh, faces, kept, edges)
    across = mesh_edges.opposite(edges, 3 * len(faces)) if edges.closed else None
    if across is not None:
        pinched = mesh_edges.pinched_closed(faces, across, len(vertices))
        twice = np.flatnonzero(across[0::3] // 3 == across[1::3] // 3)
    else:
        pinched = mesh_edges.pinched_open(faces, edges, len(vertices))
        twice = _duplicates(faces)
    deadline.tick()
    shells = mesh_edges.shells_of(vertices, faces, edges)
    low, high = _boxes(vertices, faces, shells)
    volume = volumes.signed(vertices, faces, areas, shells, len(low))
    closed = volumes.closed(faces, edges, shells, len(low))
    size = diagonals(low, high)
    found += too_far(np.stack([low, high], axis=1), size)
    found += _thin(mesh, stored, kept, stored_areas, np.flatnonzero(repeated), size[shells])
    if across is None and len(twice):
        twice = np.setdiff1d(twice, _facing(faces, areas, shells, volume * closed))
    deadline.tick()
    if len(pinched):
        found.append(
            finding(
                "T004",
                counted(len(pinched), "pinch vertex", "pinch vertices"),
                len(pinched),
                _points(mesh, vertices[pinched]),
            )
        )
    if len(twice):
        found.append(
            finding("T009", counted(len(twice), "duplicate face"), len(twice), _at_faces(mesh, kept, faces, twice))
        )
    wrong = np.empty(0, int)
    if not edges.closed:
        wrong = np.flatnonzero((edges.size % 2 == 0) & ~mesh_edges.balanced(faces, edges))
    if len(wrong):
        text = f"{counted(len(wrong), 'edge')} along which more faces run one way than the other"
        found.append(finding("T007", text, len(wrong), _at_edges(mesh, edges, kept, wrong)))
    watertight = bool(len(faces)) and bool((edges.size % 2 == 0).all())
    return Topology(
        replace(mesh, faces=faces, normals=None),
        kept,
        edges,
        shells,
        len(low),
        areas,
        watertight,
        not len(wrong),
        tuple(found),
        stored,
        low,
        high,
        volume,
        closed,
    )


def _points(mesh: Mesh, points: Floats) -> Iterator[Location]:
    for point in points:
        yield Location(xyz=(float(point[0]), float(point[1]), float(point[2])), object=mesh.name)


def _at_faces(mesh: Mesh, kept: Ints, faces: Ints, which: Ints) -> Iterator[Location]:
    for i in which:
        centre = mesh.vertices[faces[i]].mean(axis=0)
        yield Location(face=int(kept[i]), xyz=tuple(float(v) for v in centre), object=mesh.name)  # type: ignore[arg-type]


def _at_edges(mesh: Mesh, edges: Edges, kept: Ints, which: Ints) -> Iterator[Location]:
    for i in which:
        middle = (mesh.vertices[edges.low[i]] + mesh.vertices[edges.high[i]]) / 2
        face = int(kept[edges.order[edges.first[i]] // 3])
        yield Location(face=face, xyz=tuple(float(v) for v in middle), object=mesh.name)  # type: ignore[arg-type]


def _referenced(mesh: Mesh) -> tuple[Mesh, list[Finding]]:
    """The mesh without the vertices that no face uses (T012): they have no part in its size."""
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces.reshape(-1)] = True
    n = len(used) - int(np.count_nonzero(used))
    if not n:
        return mesh, []
    place = np.cumsum(used, dtype=np.int32) - np.int32(1)
    said = finding("T012", f"{counted(n, 'vertex', 'vertices')} that no face uses", n)
    return replace(mesh, vertices=mesh.vertices[used], faces=place[mesh.faces]), [said]


def _boxes(vertices: Floats, faces: Ints, shells: Ints) -> tuple[Floats, Floats]:
    """Low and high corner of each shell, (n, 3) mm."""
    n = int(shells.max(initial=-1)) + 1
    if n == 1:
        low, high = extent(vertices)
        return low[None], high[None]
    return extents(vertices[faces.reshape(-1)], np.repeat(shells, 3), n)


def diagonals(low: Floats, high: Floats) -> Floats:
    """The diagonals of boxes, mm."""
    sides = high - low
    return np.sqrt(np.einsum("ij,ij->i", sides, sides))


def too_far(corners: Floats, size: Floats) -> list[Finding]:
    """V002 for shells or instances: the low and high corner of each one's box, (n, 2, 3) mm, and its diagonal, mm."""
    step = float32_steps(corners)
    far = np.flatnonzero((step > FAR * size) & (size > 0))
    if not len(far):
        return []
    worst = far[np.argmax(step[far] / size[far])]
    text = (
        f"coordinates are {number(step[worst], 3)} mm apart in float32, the part is {number(size[worst], 3)} mm across"
    )
    return [finding("V002", text, len(far))]


def _open_edges(mesh: Mesh, faces: Ints, kept: Ints, edges: Edges) -> tuple[Ints, Ints, Ints, Edges, list[Finding]]:
    """Boundary edges: closed by welding (T006), or T-junctions (T005) and boundaries (T001).

    Returns the faces welded and as stored, what they are in the file, and the edges of the former.
    """
    vertices = mesh.vertices
    open_ = np.flatnonzero(edges.size == 1)
    seams = join(vertices, faces, np.unique(np.concatenate([edges.low[open_], edges.high[open_]])))
    joined, stored, whole = seams.joined, seams.stored, seams.whole
    if not whole.all():
        joined, stored, whole_kept = joined[whole], stored[whole], kept[whole]
    else:
        whole_kept = kept
    if np.array_equal(joined, stored):
        stored = joined
    after = mesh_edges.edges_of(joined, len(vertices))
    left = np.flatnonzero(after.size == 1)
    found = []
    shut = open_
    if len(left):  # only what belongs to shells without a boundary left
        part = connected(joined, len(vertices))
        at = seams.joined[edges.order[edges.first[open_]] // 3, 0]
        shut = open_[~np.isin(part[at], part[after.low[left]])]
    if len(shut):
        text = f"{counted(len(shut), 'open edge')} that welding within the tolerance closes"
        found.append(finding("T006", text, len(shut), _at_edges(mesh, edges, kept, shut)))
    if len(left):
        n = len(left)
        split = t_junctions(vertices, after.low[left], after.high[left], seams.reach)
        if split.any():
            which = left[split]
            places = _at_edges(mesh, after, whole_kept, which)
            text = f"{counted(len(which), 'open edge')} with a vertex in between"
            found.append(finding("T005", text, len(which), places))
        found.append(finding("T001", counted(n, "boundary edge"), n, _at_edges(mesh, after, whole_kept, left)))
    return joined, stored, whole_kept, after, found


def _many_faces(mesh: Mesh, faces: Ints, kept: Ints, edges: Edges) -> list[Finding]:
    if edges.closed:
        return []
    found = []
    for code, odd, word in (("T002", 1, "odd"), ("T003", 0, "even")):
        which = np.flatnonzero((edges.size > 2) & (edges.size % 2 == odd))
        if len(which):
            text = f"{counted(len(which), 'edge')} with more than two faces, an {word} number"
            found.append(finding(code, text, len(which), _at_edges(mesh, edges, kept, which)))
    return found


def _same_vertices(faces: Ints) -> tuple[Ints, Bools]:
    """An order of the faces, and where in it a face has the vertices of the one before."""
    ordered = np.sort(faces, axis=1)
    order = np.lexsort(ordered.T)
    same = (ordered[order[1:]] == ordered[order[:-1]]).all(axis=1)
    return order, np.append(False, same)[: len(faces)]


def _duplicates(faces: Ints) -> Ints:
    order, same = _same_vertices(faces)
    return np.sort(order[same])


def _facing(faces: Ints, areas: Floats, shells: Ints, volume: Floats) -> Ints:
    """Duplicates that are none: two faces back to back, of two closed shells that lie on either side of them.

    Where a cavity reaches the wall's outer face, the wall has no thickness.
    """
    order, same = _same_vertices(faces)
    first = np.flatnonzero(same) - 1
    alone = ~same[first] & ~np.append(same, False)[first + 2]  # no third face there
    one, other = order[first[alone]], order[first[alone] + 1]
    shell, beside = shells[one], shells[other]
    opposite = np.einsum("ij,ij->i", areas[one], areas[other]) < 0
    touching = opposite & (shell != beside) & volumes.side_by_side(volume[shell], volume[beside])
    return np.concatenate([one[touching], other[touching]])


def _thin(mesh: Mesh, faces: Ints, kept: Ints, areas: Floats, repeated: Ints, size: Floats) -> list[Finding]:
    """Degenerate faces (T010) and slivers (T011); `size` is the diagonal of each face's shell.

    A sliver harms where it is long: its height is below the float32 step, so rounding alone decides where it faces,
    and it is longer than SLIVER of its shell. Short ones vanish in a slicer's own resolution.
    """
    found, vertices = [], mesh.vertices
    double = np.abs(areas[:, 0]) + np.abs(areas[:, 1]) + np.abs(areas[:, 2])
    whole, step = float(size.max(initial=0)), float32_step(vertices)
    suspect = np.flatnonzero(double < 8 * max(step, 1e-7 * whole) * whole)
    corners = vertices[faces[suspect]]
    longest = np.sqrt(max_side_squared(corners))
    flat = _exactly_flat(corners, areas[suspect])
    lines = suspect[flat]
    n = len(repeated) + len(lines)
    if n:
        places = (Location(face=int(i), object=mesh.name) for i in repeated)
        text = f"{counted(n, 'face')} without area"
        found.append(finding("T010", text, n, chain(places, _at_faces(mesh, kept, faces, lines))))
    height = np.sqrt(np.einsum("ij,ij->i", areas[suspect], areas[suspect])) / np.maximum(longest, 1e-300)
    thin = suspect[~flat & (height < float32_steps(corners)) & (longest > SLIVER * size[suspect])]
    if len(thin):
        found.append(finding("T011", counted(len(thin), "sliver"), len(thin), _at_faces(mesh, kept, faces, thin)))
    return found


def max_side_squared(corners: Floats) -> Floats:
    """The squared length of each triangle's longest side; corners (n, 3, 3)."""
    found = np.zeros(len(corners))
    for k in range(3):
        side = corners[:, k] - corners[:, k - 1]
        np.maximum(found, np.einsum("ij,ij->i", side, side), out=found)
    return found


def _exactly_flat(corners: Floats, double: Floats) -> Bools:
    """Whether three points lie on one line: the float answer where its error bound decides, fractions on the rest."""
    first = np.abs(corners[:, 1] - corners[:, 0])
    second = np.abs(corners[:, 2] - corners[:, 0])
    bound = 8 * np.finfo(float).eps * (_abs_cross(first, second) + np.abs(corners).max(axis=(1, 2), initial=0)[:, None]
                                       * (first + second + second[:, [1, 2, 0]] + first[:, [1, 2, 0]]))  # fmt: skip
    maybe = (np.abs(double) <= bound).all(axis=1)
    for i in np.flatnonzero(maybe)[:_EXACT]:
        a, b, c = ([Fraction(float(v)) for v in point] for point in corners[i])
        u = [q - p for p, q in zip(a, b, strict=True)]
        v = [q - p for p, q in zip(a, c, strict=True)]
        maybe[i] = all(u[j] * v[k] == u[k] * v[j] for j, k in ((0, 1), (1, 2), (2, 0)))
    return maybe


def _abs_cross(a: Floats, b: Floats) -> Floats:
    pairs = ((1, 2), (2, 0), (0, 1))
    return np.stack([a[:, i] * b[:, j] + a[:, j] * b[:, i] for i, j in pairs], axis=1)


def _stored_normals(mesh: Mesh, kept: Ints, areas: Floats) -> list[Finding]:
    """T013; a stored normal of zeros means none, and a face lower than a thousandth of its length has none worth it."""
    assert mesh.normals is not None
    stored = mesh.normals[kept]
    lengths = np.sqrt(np.einsum("ij,ij->i", stored, stored, dtype=np.float64))
    dot = np.einsum("ij,ij->i", stored, areas)
    real = np.sqrt(np.einsum("ij,ij->i", areas, areas))
    off = np.flatnonzero(~(dot >= NORMAL_COS * lengths * real * (1 - 1e-6)))
    if not len(off):
        return []
    corners = mesh.vertices[mesh.faces[kept[off]]]
    sound = real[off] > 1e-3 * max_side_squared(corners)
    wrong = off[(sound & (lengths[off] > 0)) | ~np.isfinite(lengths[off])]
    if not len(wrong):
        return []
    text = f"{counted(len(wrong), 'stored normal')} unlike the face's own"
    return [finding("T013", text, len(wrong), (Location(face=int(kept[i]), object=mesh.name) for i in wrong))]
