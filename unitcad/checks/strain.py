"""C310: the hoop strain of stretched silicone against its elongation at break, with a margin.

Strain is the perimeter of the part that passes through over that of the hole, less one. Perimeters are those of the
convex hull, since stretched silicone spans a hollow. The least elongation among the layers is the limit's, though the
innermost stretches most.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from manifold3d import CrossSection, Manifold

from unitcad import catalogue
from unitcad.checks.draw import upright
from unitcad.checks.finding import MouldCheck, MouldFinding, at_most
from unitcad.designs.limits import allowed_strain, lip_strain, tail_strain
from unitcad.kernels.mesh import arrays, thick_parts
from unitcad.moulds.cavities import united
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.pieces import CAST, Way
from unitcad.moulds.plan import Step
from unitcad.spec import Spec

FOOT = 1e-3
"""How far over its lowest point the foot of a part that is peeled off is looked at, mm."""
TOUCHING = 1e-6
"""Area of silicone over the core, mm2, up to which nothing has to stretch: rounding of mating walls."""
CAPTIVE = 1e4
"""The strain written if there is no hole at all for the part that has to pass."""


@dataclass(frozen=True)
class Strain:
    """A strain that the geometry asks for, in percent, at height `z` with `room` mm of perimeter there, or 0 and 0."""

    where: str
    percent: float
    z: float = 0.0
    room: float = 0.0


def strains(moulds: MouldSet) -> list[Strain]:
    """Return the strains that the geometry asks for: of each unit's peel, the tail's way out and the motor's way in."""
    needed = []
    for step in moulds.plan.steps:
        last = step is moulds.plan.steps[-1]
        if not last and not any(removal.piece == CAST for removal in step.removals):
            continue
        pulled = peel(moulds, step)
        for i, (strain, z, room) in enumerate(peel_strain(*each) for each in pulled):
            where = "" if last else f"pour {step.index}: "
            where += "peel off the core" + (f", cell {i + 1}" if len(pulled) > 1 else "")
            if strain > 0:
                where += f", at z = {z:.3g} mm"
            needed.append(Strain(where, 100 * strain, z, room))
    fpcb, slot = moulds.spec.fpcb, moulds.dimensions.exit
    if fpcb and slot:
        needed.append(Strain("tail through the slot", 100 * tail_strain(fpcb, slot)))
    if moulds.dimensions.mouth_radius and moulds.design.opens == "below":
        needed.append(Strain("motor through the lip", 100 * lip_strain(moulds.dimensions)))
    needed += [Strain(where, percent) for where, percent in moulds.plan.stretches]
    return needed


def strain_findings(spec: Spec, needed: Iterable[Strain]) -> list[MouldFinding]:
    """Compare strains with the margin of the spec's silicones. Values in percent."""
    limit = 100 * allowed_strain(spec, catalogue.materials(spec.materials))
    return [at_most("C310", s.where, s.percent, limit, "%", _advice(s, limit)) for s in needed]


def findings(moulds: MouldSet) -> list[MouldFinding]:
    """Compare every strain of a set with the margin of its silicones."""
    return strain_findings(moulds.spec, strains(moulds))


class Peel(NamedTuple):
    """The part that is pulled off along +z, the base that stays, and the outline within which the base is in its way.

    None is the outline of the body itself.
    """

    body: Manifold
    base: Manifold
    outline: CrossSection | None = None


def peel(moulds: MouldSet, step: Step) -> list[Peel]:
    """Return the silicone of each cell pulled off after a pour (all layers, bonded), turned to leave along +z.

    If one layer joins all cells, a cell's part is the silicone within half the pitch of it, or the part that leaves in
    a direction of its own: the parts of cells are the first ones that are taken out.
    """
    lay, base = moulds.plan.layout, moulds.solids[moulds.plan.base_of(step)]
    shapes, cells = (*step.earlier, *step.layer), len(lay.cells)
    ways = [(each.within, each.direction) for each in step.removals if each.piece == CAST and each.within]
    if len(step.layer) == cells and not ways:
        bodies = [united(moulds.meshes(shapes[i::cells])) for i in range(cells)]
        return [Peel(body, base) for body in bodies]
    whole = united(moulds.meshes(shapes))
    if ways:
        return [_turned(whole ^ moulds.mesh_of(within), base, way) for within, way in ways[:cells]]
    half = lay.pitch / 2
    _, _, low, _, _, high = whole.bounding_box()
    column = Manifold.cube((2 * half, 2 * half, high - low)).translate((-half, -half, low))
    bodies = [whole ^ column.translate((c.x, c.y, 0)) for c in lay.cells]
    return [Peel(body, base) for body in bodies]


def _turned(part: Manifold, base: Manifold, direction: Way) -> Peel:
    """Return a part that leaves along a direction. The base is in its way within its foot: next to it is the sheet."""
    turn = np.column_stack([upright(direction), np.zeros(3)])
    body = part.transform(turn)
    foot = body.slice(body.bounding_box()[2] + FOOT)
    return Peel(body, base.transform(turn), foot.hull())


def _advice(strain: Strain, limit: float) -> str:
    if not strain.room:
        return ""
    largest = strain.room * (1 + limit / 100)
    return f"make the part of the core above z = {strain.z:.3g} mm no more than {largest:.3g} mm round (convex hull)"


def peel_strain(body: Manifold, base: Manifold, outline: CrossSection | None = None) -> tuple[float, float, float]:
    """Return (largest hoop strain of `body` pulled up off `base`, height there in mm, perimeter of its hole there, mm).

    At each height the hole in the body must pass whatever the base carries above it, within the outline.
    """
    outline = body.project().hull() if outline is None else outline
    x0, y0, low, x1, y1, high = body.bounding_box()
    base = base ^ Manifold.cube((x1 - x0, y1 - y0, high - low)).translate((x0, y0, low))
    heights = sorted({float(z) for solid in (body, base) for z in arrays(solid)[0][:, 2]})
    levels = [z for z in heights if low <= z <= high]
    worst, passing, top = (0.0, 0.0, 0.0), outline, base.bounding_box()[5]
    for below, above in pairwise(levels):
        z = (below + above) / 2
        if above - below < 1e-6 or z >= top:
            continue
        silicone = body.slice(z)
        # Above a higher level the base carries no more: if nothing was in the way of this section, nothing is.
        if silicone.is_empty() or (passing ^ silicone).area() <= TOUCHING:
            continue
        passing = base.trim_by_plane((0, 0, 1), z).project() ^ outline
        if (passing ^ silicone).area() <= TOUCHING:
            continue
        holes = thick_parts(silicone.hull() - silicone)
        hole = CrossSection.compose(holes) if holes else CrossSection()
        room = _perimeter(hole.hull())
        needed = _perimeter(CrossSection.batch_hull([hole, passing]))
        strain = needed / room - 1 if room * CAPTIVE > needed else CAPTIVE
        worst = max(worst, (strain, z, room))
    return worst


def _perimeter(section: CrossSection) -> float:
    return sum(float(np.hypot(*(np.roll(loop, -1, axis=0) - loop).T).sum()) for loop in section.to_polygons())


CHECK = MouldCheck(
    "C310", "strain: stretched silicone keeps the margin on its elongation", findings, reads_silicone=True
)
