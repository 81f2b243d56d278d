"""C240: any two hollows of a cup have a wall between them: bores, grooves, windows and holes for pins.

Measured on the meshes. A hole that breaks into another hollow makes one of the two: C000 counts it, or C100 finds the
leak. Engraved letters don't count: nothing flows through them, and their strokes are closer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from manifold3d import Manifold

from unitcad.checks.finding import GRID, MouldCheck, MouldFinding, at_least
from unitcad.kernels.mesh import thick_pieces
from unitcad.moulds.layout import groove_depth_of
from unitcad.moulds.mould_set import MouldSet

SHOWN = 2.0
"""Walls thicker than this times the limit are not told apart."""


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Measure the thinnest wall between two hollows of every cup."""
    lengths = moulds.spec.moulds
    letters = lengths.engraving_depth_mm + GRID
    for step in moulds.plan.steps:
        solid = moulds.solids[moulds.plan.walled(step)]
        limit = min(lengths.least_wall_mm, lengths.land_mm) - GRID
        if step.groove:  # under a low rim its floor may be thinner
            limit = min(limit, step.rim - groove_depth_of(moulds.spec, step.rim) - GRID)
        farthest = SHOWN * limit
        deep = [
            piece for piece in thick_pieces(solid.hull() - solid) if (box := piece.bounding_box())[5] - box[2] > letters
        ]
        thinnest = farthest
        for i, k in near(deep, farthest):
            thinnest = min(thinnest, float(deep[i].min_gap(deep[k], thinnest)))
        yield at_least(
            "C240", f"{moulds.plan.walled(step)}: wall between two hollows", thinnest, limit, "mm", "move them apart"
        )


def near(pieces: Sequence[Manifold], gap: float) -> list[tuple[int, int]]:
    """Return every two of the pieces, by their places, whose boxes are `gap` (mm) apart at most."""
    boxes = np.array([piece.bounding_box() for piece in pieces]).reshape(-1, 6)
    low, high = boxes[:, None, :3], boxes[None, :, 3:]
    reaches = np.all(low <= high + gap, axis=2)
    first, second = np.nonzero(np.triu(reaches & reaches.T, 1))
    return list(zip(first.tolist(), second.tolist(), strict=True))


CHECK = MouldCheck("C240", "walls: the wall between any two hollows of a cup is the least wall or more", findings)
