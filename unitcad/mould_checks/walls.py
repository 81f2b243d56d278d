"""C240: between any two hollows of a cup stands a wall: bores, grooves, windows and holes for pins keep apart.

Measured on the meshes. Engraved letters don't count: nothing flows through them, and their strokes lie closer.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from unitcad.mould_checks.check import MouldCheck
from unitcad.mould_checks.finding import MouldFinding, at_least
from unitcad.mould_checks.hollows import GRID, hollows, least_wall
from unitcad.moulds.mould_set import MouldSet

SHOWN = 2.0
"""Walls thicker than this times the limit are not told apart."""


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Measure the thinnest wall between two hollows of every cup."""
    limit, letters = least_wall(moulds), moulds.spec.moulds.engraving_depth_mm + GRID
    farthest = SHOWN * limit
    for step in moulds.plan.steps:
        deep = []
        for piece in hollows(moulds, moulds.plan.walled(step)):
            box = piece.bounding_box()
            if box[5] - box[2] > letters:
                deep.append((piece, box))
        thinnest = farthest
        for (piece, p), (other, q) in combinations(deep, 2):
            if all(p[i] <= q[i + 3] + thinnest and q[i] <= p[i + 3] + thinnest for i in range(3)):
                thinnest = min(thinnest, float(piece.min_gap(other, thinnest)))
        yield at_least(
            "C240", f"{moulds.plan.walled(step)}: wall between two hollows", thinnest, limit, "mm", "move them apart"
        )


CHECK = MouldCheck("C240", "walls: between any two hollows of a cup stands the least wall or more", findings)
