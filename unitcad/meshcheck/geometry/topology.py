"""The topology of a mesh: edges, shells, what is open, wound wrongly or pinched."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints, distinct, distinct_values, extent, sorted_with_order
from unitcad.geometry.ticks import Tick
from unitcad.meshcheck.geometry import edges as mesh_edges
from unitcad.meshcheck.geometry import volumes
from unitcad.meshcheck.geometry.edges import Edges, Turns
from unitcad.meshcheck.geometry.triangle_mesh import Mesh, area_vectors

Found = tuple[Any, ...]
"""Some of what a `Topology` has beside its surface."""


@dataclass(frozen=True, eq=False)
class OpenEdges:
    """Edges of one face, before vertices were welded and after it.

    `edges` are those before, of the faces `kept`; of them `shut` are the ones that welding closes. `left` are edges of
    the welded faces that are open still; `split` says which of those have a vertex in between.
    """

    edges: Edges
    kept: Ints
    shut: Ints
    left: Ints
    split: Bools


@dataclass(frozen=True, eq=False)
class Surface:
    """A mesh without degenerate faces whose open edges are welded.

    `kept` maps its faces to the file's; `areas` are twice the area vectors, mm2. `stored` are the faces before welding
    moved any, with vertices in one place joined. `repeated` are the file's faces that use a vertex twice, `unused`
    counts vertices that no face uses, `opened` has the edges of one face, if any.
    """

    mesh: Mesh
    kept: Ints
    edges: Edges
    areas: Floats
    stored: Ints
    repeated: Ints
    unused: int
    opened: OpenEdges | None

    @cached_property
    def stored_areas(self) -> Floats:
        """Twice the area vectors of the faces as stored, mm2."""
        if self.stored is self.mesh.faces:
            return self.areas
        return area_vectors(self.mesh.vertices, self.stored)


@dataclass(frozen=True, eq=False)
class Topology(Surface):
    """A surface, and what follows from its edges.

    `shells` labels faces, `turns` has those round edges of four and more. `low` and `high`: each shell's box, mm;
    `volumes`: what it encloses, mm3, below zero where its faces look inwards; `closed`: whether it has an inside.
    `pinched` are vertices of several fans, `twice` faces with the vertices of another one, `unbalanced` edges of an
    even number of faces along which more run one way than the other.
    """

    turns: Turns | None
    shells: Ints
    n_shells: int
    low: Floats
    high: Floats
    volumes: Floats
    closed: Bools
    pinched: Ints
    twice: Ints
    unbalanced: Ints

    @cached_property
    def watertight(self) -> bool:
        """Whether every edge has an even number of faces."""
        return bool(len(self.mesh.faces)) and bool((self.edges.size % 2 == 0).all())

    @property
    def oriented(self) -> bool:
        """Whether neighbours are wound alike."""
        return not len(self.unbalanced)


def topology_of(mesh: Mesh, tick: Tick) -> Topology:
    """Work out the topology of a mesh with finite vertices."""
    surface = surface_of(mesh, tick)
    return topology_on(surface, [work(surface, tick) for work in works_on(surface)], tick)


def surface_of(mesh: Mesh, tick: Tick) -> Surface:
    """Work out the edges and areas of a mesh with finite vertices, and weld what is open."""
    mesh, unused = _referenced(mesh) if mesh.indexed else (mesh, 0)
    faces, vertices = mesh.faces, mesh.vertices
    repeated = (faces[:, 0] == faces[:, 1]) | (faces[:, 1] == faces[:, 2]) | (faces[:, 2] == faces[:, 0])
    kept = np.arange(len(faces), dtype=np.int32)
    if repeated.any():
        kept = np.flatnonzero(~repeated).astype(np.int32)
        faces = faces[kept]
    edges = mesh_edges.edges_of(faces, len(vertices))
    tick()
    stored, opened = faces, None
    if not edges.closed and (edges.size == 1).any():
        faces, stored, kept, edges, opened = _welded(vertices, faces, kept, edges)
    tick()
    areas, mesh = area_vectors(vertices, faces), replace(mesh, faces=faces, normals=None)
    tick()
    return Surface(mesh, kept, edges, areas, stored, np.flatnonzero(repeated), unused, opened)


def works_on(surface: Surface) -> list[Callable[[Surface, Tick], Found]]:
    """Return what is to be worked out for `topology_on`, each alone."""
    return [_by_vertex, _pinched_and_twice_of_closed] if surface.edges.closed else [_by_shell, _pinched_and_twice]


def topology_on(surface: Surface, found: Sequence[Found], tick: Tick) -> Topology:
    """Return the topology of a surface from the results of `works_on`."""
    by_shell, (pinched, twice, same) = found
    if surface.edges.closed and len(pinched):
        by_shell = _by_shell(surface, tick)
    turns, shells, low, high, volume, closed = by_shell
    if same is not None and len(twice):
        twice = np.setdiff1d(twice, _facing(same[0], same[1], surface.areas, shells, volume * closed))
    edges, unbalanced = surface.edges, np.empty(0, int)
    if not edges.closed:
        unbalanced = np.flatnonzero((edges.size % 2 == 0) & ~edges.balanced)
    return Topology(
        **{each.name: getattr(surface, each.name) for each in fields(surface)},
        turns=turns,
        shells=shells,
        n_shells=len(low),
        low=low,
        high=high,
        volumes=volume,
        closed=closed,
        pinched=pinched,
        twice=twice,
        unbalanced=unbalanced,
    )


def _by_vertex(surface: Surface, tick: Tick) -> Found:
    """Return what `_by_shell` does of a surface whose edges have two faces each, wound alike, if no vertex is pinched.

    Then faces with a common vertex are of one shell, and there are half as many vertices as faces.
    """
    shells = mesh_edges.shells_by_vertex(surface.mesh.faces, surface.edges, len(surface.mesh.vertices))
    return None, *_of_shells(surface, shells, tick)


def _pinched_and_twice_of_closed(surface: Surface, tick: Tick) -> Found:
    """Return what `_pinched_and_twice` does of a surface whose edges have two faces each, wound alike."""
    faces = surface.mesh.faces
    across = mesh_edges.opposite(surface.edges, 3 * len(faces))
    tick()
    pinched = mesh_edges.pinched_closed(faces, across, len(surface.mesh.vertices))
    return pinched, np.flatnonzero(across[0::3] // 3 == across[1::3] // 3), None


def _by_shell(surface: Surface, tick: Tick) -> Found:
    """Return `turns`, `shells`, `low`, `high`, `volumes` and `closed` of a `Topology`."""
    vertices, faces, edges = surface.mesh.vertices, surface.mesh.faces, surface.edges
    turns = mesh_edges.turns_of(vertices, faces, edges)
    return turns, *_of_shells(surface, mesh_edges.shells_of(faces, edges, turns), tick)


def _of_shells(surface: Surface, shells: Ints, tick: Tick) -> tuple[Ints, Floats, Floats, Floats, Bools]:
    """Return `shells`, `low`, `high`, `volumes` and `closed` of a `Topology`."""
    vertices, faces = surface.mesh.vertices, surface.mesh.faces
    tick()
    low, high = _boxes(vertices, faces, shells)
    volume = volumes.signed(vertices, faces, surface.areas, shells, len(low))
    return shells, low, high, volume, volumes.closed(surface.edges, shells, len(low))


def _pinched_and_twice(surface: Surface, tick: Tick) -> Found:
    """Return the vertices of several fans, the faces with the vertices of others, and `_same_vertices`.

    Shells that touch in a face are among the faces still.
    """
    faces = surface.mesh.faces
    pinched = mesh_edges.pinched_open(faces, surface.edges, len(surface.mesh.vertices))
    tick()
    same = _same_vertices(faces)
    return pinched, np.sort(same[0][same[1]]), same


def _referenced(mesh: Mesh) -> tuple[Mesh, int]:
    """Return the mesh without vertices that no face uses, which have no part in its size, and their number."""
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces.reshape(-1)] = True
    n = len(used) - int(np.count_nonzero(used))
    if not n:
        return mesh, 0
    place = np.cumsum(used, dtype=np.int32) - np.int32(1)
    return replace(mesh, vertices=mesh.vertices[used], faces=place[mesh.faces]), n


def _welded(vertices: Floats, faces: Ints, kept: Ints, edges: Edges) -> tuple[Ints, Ints, Ints, Edges, OpenEdges]:
    """Return the faces welded and as stored, what they are in the file, the edges of the former, and the open edges."""
    from unitcad.meshcheck.geometry.seams import connected, join, t_junctions  # most meshes are closed

    open_ = np.flatnonzero(edges.size == 1)
    seams = join(vertices, faces, distinct_values(np.concatenate([edges.low[open_], edges.high[open_]])))
    joined, stored, whole = seams.joined, seams.stored, seams.whole
    if not whole.all():
        joined, stored, whole_kept = joined[whole], stored[whole], kept[whole]
    else:
        whole_kept = kept
    if np.array_equal(joined, stored):
        stored = joined
    after = mesh_edges.edges_of(joined, len(vertices))
    left = np.flatnonzero(after.size == 1)
    shut, split = open_, np.zeros(len(left), bool)
    if len(left):  # only what belongs to shells without a boundary left
        part = connected(joined, len(vertices))
        at = seams.joined[edges.order[edges.first[open_]] // 3, 0]
        shut = open_[~np.isin(part[at], part[after.low[left]])]
        split = t_junctions(vertices, after.low[left], after.high[left], seams.reach)
    return joined, stored, whole_kept, after, OpenEdges(edges, kept, shut, left, split)


def _boxes(vertices: Floats, faces: Ints, shells: Ints) -> tuple[Floats, Floats]:
    """Return low and high corner of each shell, (n, 3) mm."""
    n = int(shells.max(initial=-1)) + 1
    if n == 1:
        low, high = extent(vertices)
        return low[None], high[None]
    low, high, label = np.full((3, n), np.inf), np.full((3, n), -np.inf), shells.astype(np.intp)
    for axis in range(3):
        column = np.ascontiguousarray(vertices[:, axis])
        one, two, three = (column.take(faces[:, k]) for k in range(3))
        np.minimum.at(low[axis], label, np.minimum(np.minimum(one, two), three))
        np.maximum.at(high[axis], label, np.maximum(np.maximum(one, two), three))
    return low.T, high.T


def diagonals(low: Floats, high: Floats) -> Floats:
    """Return the diagonals of boxes, mm."""
    sides = high - low
    return np.sqrt(np.einsum("ij,ij->i", sides, sides))


def _same_vertices(faces: Ints) -> tuple[Ints, Bools]:
    """Return an order of the faces that may have others' vertices, and where in it one has those of the one before."""
    a, b, c = np.ascontiguousarray(faces.T)
    low, high = np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)
    ordered = np.stack([low, a ^ b ^ c ^ low ^ high, high])
    # Equal for equal faces, and for others now and then.
    key = (ordered[0].astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15) + ordered[1].astype(np.uint64)) * np.uint64(
        0xC2B2AE3D27D4EB4F
    )
    key += high.astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
    kept = 64 - max(len(key) - 1, 1).bit_length()
    key, order = sorted_with_order(key >> np.uint64(64 - kept), kept)
    again = ~distinct(key)
    some = np.sort(order[again | np.append(again[1:], False)[: len(again)]]).astype(np.int64)
    ordered = ordered[:, some]
    by_vertices = np.lexsort(ordered)
    some, ordered = some[by_vertices], ordered[:, by_vertices]
    same = (ordered[:, 1:] == ordered[:, :-1]).all(axis=0)
    return some, np.append(False, same)[: len(some)]


def _facing(order: Ints, same: Bools, areas: Floats, shells: Ints, volume: Floats) -> Ints:
    """Return duplicates that are none: two faces back to back, of two closed shells that lie on either side of them.

    Where a cavity reaches the wall's outer face, the wall has no thickness. `order` and `same` are of `_same_vertices`.
    """
    first = np.flatnonzero(same) - 1
    alone = ~same[first] & ~np.append(same, False)[first + 2]  # no third face there
    one, other = order[first[alone]], order[first[alone] + 1]
    shell, beside = shells[one], shells[other]
    opposite = np.einsum("ij,ij->i", areas[one], areas[other]) < 0
    touching = opposite & (shell != beside) & volumes.side_by_side(volume[shell], volume[beside])
    return np.concatenate([one[touching], other[touching]])


def max_side_squared(corners: Floats) -> Floats:
    """Return the squared length of each triangle's longest side; corners (n, 3, 3)."""
    longest = np.zeros(len(corners))
    for k in range(3):
        side = corners[:, k] - corners[:, k - 1]
        np.maximum(longest, np.einsum("ij,ij->i", side, side), out=longest)
    return longest
