"""Places of findings on a mesh: faces, edges, points, regions. What the file has of them is added afterwards."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Location, point
from unitcad.meshcheck.geometry.topology import Edges


def at_faces(vertices: Floats, faces: Ints, kept: Ints, which: Iterable[int]) -> Iterator[Location]:
    """Return the middles of the faces `which`; `kept` maps faces to the file's."""
    for i in which:
        yield Location(face=int(kept[i]), xyz=point(vertices[faces[i]].mean(axis=0)))


def at_edges(vertices: Floats, edges: Edges, kept: Ints, which: Iterable[int]) -> Iterator[Location]:
    """Return the middles of the edges `which`, each with its first face; `kept` maps faces to the file's."""
    for i in which:
        middle = (vertices[edges.low[i]] + vertices[edges.high[i]]) / 2
        yield Location(face=int(kept[edges.order[edges.first[i]] // 3]), xyz=point(middle))


def at_region(faces: Ints, xyz: Floats) -> Location:
    """Return a point with the faces, as the file has them, that make up the place; the first of them stands for it."""
    return Location(face=int(faces[0]), xyz=point(xyz), region=faces)
