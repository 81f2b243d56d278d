"""C230: overflow stays in the groove. Floor and walls of a cup's overflow groove are whole.

Measured on the meshes: a groove is a hollow of a cup that is open at its rim and contains no silicone of the pour. The
distance from it to any other hollow (a hole for a pin, a window, a notch) is its wall. Engraved letters, which are
shallower than a groove, don't count.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold, OpType
from scipy.spatial import KDTree

from unitcad.checks.cup_features import GRID, hollows, wall_limit
from unitcad.checks.finding import MouldCheck, MouldFinding, at_least
from unitcad.kernels.mesh import shells, thick_pieces
from unitcad.moulds.layout import groove_depth_of
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.moulds.surroundings import Congruence, crop, once_each, reaching
from unitcad.shape.column import Column

SLACK = 0.1
"""Margin round a cell, beyond its groove, within which the groove is examined, mm."""


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
        tiles = _tiles(moulds, groove, farthest, (bottom - farthest, top))
        deep = [piece for piece in pieces if piece.bounding_box()[2] < top]

        def wall(i: int) -> float:
            """Return the distance from the groove in a tile to the nearest other hollow, mm, `farthest` at most."""
            near, there, beside = groove, groove, deep
            if tiles:
                there = groove ^ _circle(tiles[i], farthest)
                near = there ^ _circle(tiles[i], -farthest)
                beside = [crop(piece, tiles[i]) for piece in reaching(deep, tiles[i])]
            inside = Manifold.extrude(there.offset(GRID, JoinType.Miter), step.rim - bottom + 2 * GRID)
            others = Manifold.compose(beside) - inside.translate((0, 0, bottom - GRID))
            whole = thick_pieces(others)
            if not whole:
                return farthest
            others = Manifold.compose(whole).trim_by_plane((0, 0, -1), -top)
            return float(Manifold.extrude(near, top - bottom).translate((0, 0, bottom)).min_gap(others, farthest))

        piece = moulds.plan.tool(moulds.plan.walled(step))
        alike = Congruence([piece.shape], [moulds.solids[piece.name]]) if tiles else None
        numbers = [alike.number(tile) for tile in tiles] if alike else [0]
        thinnest = min(value for _, value in once_each(numbers, wall))
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


def _tiles(moulds: MouldSet, groove: CrossSection, beside: float, ends: tuple[float, float]) -> list[Column]:
    """Return a column about each of several cells, wider by `beside` than its part of the plate; none for the whole.

    The whole is examined if the cells' parts don't cover the groove.
    """
    lay = moulds.plan.layout
    if len(lay.cells) == 1:
        return []

    middles = np.array([(cell.x, cell.y) for cell in lay.cells])
    reach = float(KDTree(middles).query(_border(groove))[0].max()) + SLACK
    tiles = [Column(cell.x, cell.y, reach + beside, *ends) for cell in lay.cells]
    covered = CrossSection.batch_boolean([_circle(tile, -beside) for tile in tiles], OpType.Add)
    return tiles if (groove - covered).is_empty() else []


def _border(section: CrossSection) -> np.ndarray:
    """Return points (n, 2) of a section's border, SLACK apart at most: between two cells a side's ends are nearest."""
    loops = section.to_polygons()
    starts = np.concatenate(loops)
    sides = np.concatenate([np.roll(loop, -1, axis=0) for loop in loops]) - starts
    parts = np.ceil(np.hypot(*sides.T) / SLACK).astype(int).clip(1)
    share = (np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)) / np.repeat(parts, parts)
    return np.repeat(starts, parts, axis=0) + share[:, None] * np.repeat(sides, parts, axis=0)


def _circle(column: Column, more: float) -> CrossSection:
    return CrossSection.circle(column.radius + more, 48).translate((column.x, column.y))


CHECK = MouldCheck("C230", "groove: floor and walls of an overflow groove are whole", findings)
