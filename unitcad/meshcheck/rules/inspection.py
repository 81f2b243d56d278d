"""The input of the rules: a mesh, properties of it that several rules need, a printer, options; places of findings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol, SupportsFloat

from unitcad.geometry.arrays import Floats, Ints
from unitcad.geometry.boxes import Tick
from unitcad.meshcheck.findings import Location, point
from unitcad.meshcheck.geometry.crossings import Crossings, crossings_of
from unitcad.meshcheck.geometry.mesh import Mesh
from unitcad.meshcheck.geometry.rays import Rays, cast
from unitcad.meshcheck.geometry.topology import Edges, Topology
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
    for pictures.
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

    def wants(self, code: str) -> bool:
        """Return whether findings of `code` are reported, unless they ended the check: those always are."""
        chosen = max((len(p) for p in self.select if code.startswith(p)), default=-1 if self.select else 0)
        dropped = max((len(p) for p in self.ignore if code.startswith(p)), default=-1)
        return chosen >= 0 and chosen > dropped and not code.startswith(self.unwanted or ("-",))
