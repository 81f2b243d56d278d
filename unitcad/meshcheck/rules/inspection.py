"""What the rules are given: a mesh, and what several of them need of it, worked out once and when it is asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from unitcad.geometry.ticks import Tick
from unitcad.meshcheck.detail import detail
from unitcad.meshcheck.geometry.crossings import Crossings, crossings_of
from unitcad.meshcheck.geometry.mesh import Mesh
from unitcad.meshcheck.geometry.sieves import Arranged, Stars, arranged, stars_of
from unitcad.meshcheck.geometry.topology import Topology

if TYPE_CHECKING:
    from unitcad.catalogue import Printer
    from unitcad.meshcheck.geometry.rays import Rays


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
        from unitcad.meshcheck.geometry.rays import cast

        assert self.printer is not None
        floors = float(self.printer.least_wall_mm), float(self.printer.least_flat_wall_mm)
        return cast(self.topology, floors, float(self.printer.least_feature_mm), self.tick, side=1)
