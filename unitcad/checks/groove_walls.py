"""C230: overflow stays in the groove. Floor and walls of a cup's overflow groove are whole.

Measured on the meshes: a groove is a hollow of a cup that is open at its rim and contains no silicone of the pour. The
distance from it to any other hollow (a hole for a pin, a window, a notch) is its wall. Engraved letters, which are
shallower than a groove, don't count.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold, OpType

from unitcad.checks.cup_features import GRID, hollows, wall_limit
from unitcad.checks.finding import MouldCheck, MouldFinding, at_least
from unitcad.kernels.mesh import shells, thick_pieces
from unitcad.moulds.layout import groove_depth_of
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Measure floor and walls of the groove of every cup."""
    for step in moulds.plan.steps:
        if step.groove:
            yield _of_cup(moulds, step)


def _of_cup(moulds: MouldSet, step: Step) -> MouldFinding:
    """Compare the thinnest wall of a cup's groove with the least wall; under a low rim the floor may be thinner."""
    bottom, letters = step.rim - groove_depth_of(moulds.spec, step.rim), moulds.spec.moulds.engraving_depth_mm
    under_letters = step.rim - letters - GRID
    top = under_letters if under_letters > bottom + GRID else step.rim
    pieces, level, rim = hollows(moulds, moulds.plan.walled(step)), (bottom + top) / 2, step.rim - GRID
    # Most pieces are letters, which end above the level that is looked at.
    high = [piece for piece in pieces if (box := piece.bounding_box())[5] > rim and box[2] < level]
    joined = [piece for piece in high if piece.bounding_box()[2] < bottom - GRID]
    above = [piece for piece in high if piece not in joined]
    above += [part for part in shells(_above(bottom, joined)) if part.bounding_box()[5] > rim]
    sections = [part for solid in above for part in solid.slice(level).decompose()]
    silicone = moulds.meshes((*step.layer, *step.earlier))
    regions = _without(sections, silicone, level)
    if level > under_letters:
        regions = _beside(regions, silicone, level, moulds.spec.moulds.land_mm)
    limit = wall_limit(moulds, step)
    thinnest = farthest = 2 * limit
    if regions:
        groove = CrossSection.batch_boolean(regions, OpType.Add)
        inside = Manifold.extrude(groove.offset(GRID, JoinType.Miter), step.rim - bottom + 2 * GRID)
        deep = Manifold.compose([piece for piece in pieces if piece.bounding_box()[2] < top])
        if others := thick_pieces(deep - inside.translate((0, 0, bottom - GRID))):
            hollow = Manifold.compose(others).trim_by_plane((0, 0, -1), -top)
            thinnest = Manifold.extrude(groove, top - bottom).translate((0, 0, bottom)).min_gap(hollow, farthest)
    advice = "a hole, a window or a notch breaks into the groove, or leaves too thin a wall: move one of the two"
    return at_least("C230", f"{moulds.plan.walled(step)}: wall of the groove", float(thinnest), limit, "mm", advice)


def _above(z: float, pieces: list[Manifold]) -> Manifold:
    """Return the part above a height of pieces that don't touch."""
    return Manifold.compose(pieces).trim_by_plane((0, 0, 1), z)


def _without(sections: list[CrossSection], silicone: list[Manifold], level: float) -> list[CrossSection]:
    """Return the sections without silicone."""
    cast = [part for solid in silicone if not (part := solid.slice(level)).is_empty()]
    grown = [part.offset(GRID, JoinType.Miter) for part in cast]
    boxes = np.array([part.bounds() for part in grown]).reshape(-1, 4)
    free = []
    for section in sections:
        x0, y0, x1, y1 = section.bounds()
        meet = (boxes[:, 0] <= x1) & (boxes[:, 2] >= x0) & (boxes[:, 1] <= y1) & (boxes[:, 3] >= y0)
        there = CrossSection.batch_boolean([grown[i] for i in np.flatnonzero(meet)], OpType.Add)
        if (section ^ there).is_empty():
            free.append(section)
    return free


def _beside(sections: list[CrossSection], silicone: list[Manifold], level: float, land: float) -> list[CrossSection]:
    """Return the sections that begin at the end of the land round the silicone; letters are farther off."""
    cast = CrossSection.batch_boolean([solid.slice(level) for solid in silicone], OpType.Add)
    reach = cast.offset(land + 2 * GRID, JoinType.Round)
    return [section for section in sections if not (section ^ reach).is_empty()]


CHECK = MouldCheck("C230", "groove: floor and walls of an overflow groove are whole", findings)
