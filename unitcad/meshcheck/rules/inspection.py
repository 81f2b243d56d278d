"""The input of the rules: a mesh, properties of it that several rules need, a printer, options; places of findings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol, SupportsFloat

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.geometry.boxes import Tick
from unitcad.meshcheck.findings import Location, point
from unitcad.meshcheck.geometry.crossings import Crossings, crossing_boxes, crossings_of, through_edges
from unitcad.meshcheck.geometry.disputed import Disputed, disputed_of
from unitcad.meshcheck.geometry.mesh import Mesh
from unitcad.meshcheck.geometry.nesting import Nesting, nesting_of
from unitcad.meshcheck.geometry.rays import Rays, cast
from unitcad.meshcheck.geometry.sheets import Sheets, sheets_of
from unitcad.meshcheck.geometry.topology import Edges, Topology, by_place
from unitcad.meshcheck.rules.f_file import Limits


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

    `tick` is called now and then by what takes long. `strict`: whether crossings too shallow for a printer are errors.
    """

    mesh: Mesh
    topology: Topology
    tick: Tick
    printer: Printer | None = None
    strict: bool = False

    @property
    def solid(self) -> bool:
        """Whether the mesh has an inside."""
        return self.topology.watertight and self.topology.oriented

    @cached_property
    def crossings(self) -> Crossings:
        """How its faces meet each other."""
        return crossings_of(self.topology, self.tick) if len(self.topology.kept) else Crossings()

    @cached_property
    def nesting(self) -> Nesting:
        """How its shells lie in each other."""
        return nesting_of(self.topology, self.crossings, self.tick)

    @cached_property
    def placed(self) -> Topology:
        """The topology with vertices in one place as one, whether or not the file lists them apart."""
        return by_place(self.topology)

    @cached_property
    def through(self) -> Ints:
        """Edges of `placed` at which a shell passes through itself."""
        return through_edges(self.placed.turns, self.placed.shells)

    @cached_property
    def disputed(self) -> Disputed:
        """The space that slicers fill by different rules."""
        placed, crossings, nesting = self.placed, self.crossings, self.nesting
        stopped = crossings.stopped or nesting.stopped
        if stopped or not self._closed(crossings):  # an open surface has no inside
            return Disputed(shows=True, stopped=stopped)
        overlaps = np.array(nesting.overlaps, np.int64).reshape(-1, 2)
        low, high = self.topology.low[overlaps].max(axis=1), self.topology.high[overlaps].min(axis=1)
        boxes, shells = [np.stack([low, high], axis=1)], [overlaps.reshape(-1)]
        if crossings.faces is not None and len(crossings.deep):
            boxes.append(crossing_boxes(crossings.faces, crossings.deep))
            shells.append(crossings.faces.shell[crossings.deep].reshape(-1))
        if len(self.through):
            ends = np.stack([placed.edges.low[self.through], placed.edges.high[self.through]], axis=1)
            corners = placed.mesh.vertices[ends]
            boxes.append(np.stack([corners.min(axis=1), corners.max(axis=1)], axis=1))
            shells.append(placed.shells[placed.edges.order[placed.edges.first[self.through]] // 3])
        return disputed_of(self.topology, np.unique(np.concatenate(shells)), np.concatenate(boxes), self.tick)

    def _closed(self, crossings: Crossings) -> bool:
        """Return whether the shells whose faces cross have an inside, but for cracks."""
        if crossings.faces is None:
            return True
        return bool(self.topology.sealed[crossings.faces.shell[crossings.deep]].all())

    @cached_property
    def sheets(self) -> Sheets:
        """The places at which a wall or a gap has no thickness."""
        topology, crossings = self.topology, self.crossings
        vertices, one, other = topology.mesh.vertices, *np.empty((2, 0, 3, 3))
        if crossings.faces is not None:
            one, other = crossings.faces.corners_of(*crossings.kinds(topology)[1].T)
        return sheets_of(topology.mesh, one, other, vertices[topology.mesh.faces[topology.twice]], topology.resolution)

    @cached_property
    def material(self) -> Rays:
        """How much material lies behind points of its faces, as far as matters for the printer."""
        assert self.printer is not None
        floors = float(self.printer.least_wall_mm), float(self.printer.least_flat_wall_mm)
        return cast(self.topology, floors, float(self.printer.least_feature_mm), self.tick, side=1)


@dataclass(frozen=True)
class Options:
    """Options of a check: the rules, the output and the printer.

    `select`, `ignore`: prefixes of codes, the longest that fits decides, ignore on a tie; empty select: all. An error
    that ended the check of a file (not readable, a limit reached, no mesh) is always kept.
    `unit`: unit of formats that have none (a key of UNITS_MM); `printer`: D and S002 rules for it.
    `shells`: the number of shells expected (G005). `strict`: crossings too shallow for a printer are errors too.
    `strict_3mf`: content that the 3MF specification forbids and common programs write is an error, not a warning.
    `unwanted`: prefixes of codes that no select brings back. `draw`: keep the meshes with the report, and more places,
    for pictures. `every_place`: keep more places, for a baseline.
    """

    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    unit: str | None = None
    printer: Printer | None = None
    shells: int | None = None
    strict: bool = False
    strict_3mf: bool = False
    limits: Limits = field(default_factory=Limits)
    unwanted: tuple[str, ...] = ()
    draw: bool = False
    every_place: bool = False

    def wants(self, code: str) -> bool:
        """Return whether findings of `code` are reported, unless they ended the check: those always are."""
        chosen = max((len(p) for p in self.select if code.startswith(p)), default=-1 if self.select else 0)
        dropped = max((len(p) for p in self.ignore if code.startswith(p)), default=-1)
        return chosen >= 0 and chosen > dropped and not code.startswith(self.unwanted or ("-",))
