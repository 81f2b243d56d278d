"""The input of the rules: a mesh, properties of it that several rules need, a printer; and the places of findings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, SupportsFloat

from unitcad.geometry.arrays import Floats, Ints
from unitcad.geometry.boxes import Tick
from unitcad.meshcheck.findings import Location, detail, point
from unitcad.meshcheck.geometry.crossings import Crossings, crossings_of
from unitcad.meshcheck.geometry.mesh import Mesh
from unitcad.meshcheck.geometry.rays import Rays, cast
from unitcad.meshcheck.geometry.sieves import Arranged, Stars, arranged, stars_of
from unitcad.meshcheck.geometry.topology import Edges, Topology


class Printer(Protocol):
    """The properties of a printer that the rules read, as the catalogue's entries have them: mm, degrees.

    `support` has the value "none" if the printer prints without support.
    """

    @property
    def name(self) -> str: ...
    @property
    def bed_x_mm(self) -> SupportsFloat: ...
    @property
    def bed_y_mm(self) -> SupportsFloat: ...
    @property
    def bed_z_mm(self) -> SupportsFloat: ...
    @property
    def layer_mm(self) -> SupportsFloat: ...
    @property
    def xy_play_mm(self) -> SupportsFloat: ...
    @property
    def least_wall_mm(self) -> SupportsFloat: ...
    @property
    def least_flat_wall_mm(self) -> SupportsFloat: ...
    @property
    def least_feature_mm(self) -> SupportsFloat: ...
    @property
    def overhang_deg(self) -> SupportsFloat: ...
    @property
    def bridge_mm(self) -> SupportsFloat: ...
    @property
    def support(self) -> Any: ...


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


@dataclass(frozen=True, eq=False)
class Inspection:
    """A mesh with finite vertices, as the file has it, with its topology.

    `tick` is called now and then by what takes long; `cross`: whether faces are compared with each other; `ready`: what
    that needs, where it is known already. `strict`: whether crossings too shallow for a printer are errors.
    """

    mesh: Mesh
    topology: Topology
    tick: Tick
    cross: bool = True
    printer: Printer | None = None
    ready: tuple[Arranged, Stars] | None = None
    strict: bool = False

    @property
    def solid(self) -> bool:
        """Whether the mesh has an inside."""
        return self.topology.watertight and self.topology.oriented

    @cached_property
    def crossings(self) -> Crossings:
        """How its faces meet each other; nothing where they are not compared."""
        if not self.cross or not len(self.topology.kept):
            return Crossings()
        every = detail().meshes is not None
        ready, stars = self.ready or (arranged(self.topology), stars_of(self.topology))
        return crossings_of(self.topology, ready, stars, self.tick, every=every)

    @cached_property
    def material(self) -> Rays:
        """How much material lies behind points of its faces, as far as matters for the printer."""
        assert self.printer is not None
        floors = float(self.printer.least_wall_mm), float(self.printer.least_flat_wall_mm)
        return cast(self.topology, floors, float(self.printer.least_feature_mm), self.tick, side=1)
