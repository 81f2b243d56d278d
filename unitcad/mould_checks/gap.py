"""C210: faces that must slide have the printer's clearance: skirt and plinth, tongue and window, lid and cup.

The skirt is measured below the seat, where cup and plinth touch on purpose; the lid's below the rim. Round corners are
polygons of as many sides a turn on both pieces: midway along a facet their gap is the clearance's cosine of pi / n.
"""

from __future__ import annotations

import math

from unitcad.mould_checks.check import MouldCheck
from unitcad.mould_checks.finding import MouldFinding, at_least
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.profile import GRID_PER_MM

GRID = 2 / GRID_PER_MM
"""What snapping two faces to the grid may take from the clearance between them, mm."""


def findings(moulds: MouldSet) -> list[MouldFinding]:
    """Measure every pair of sliding faces of every pour."""
    chord = math.cos(math.pi / moulds.segments)
    lengths, solids = moulds.spec.moulds, moulds.solids
    skirt, window = min(lengths.plinth_clearance_mm, lengths.seat_relief_mm), lengths.window_clearance_mm
    play = lengths.plinth_clearance_mm
    found = []
    for step in moulds.plan.steps:
        cup = solids[step.cup]
        gap = cup.trim_by_plane((0, 0, -1), skirt).min_gap(solids["base"], skirt + 1)
        found.append(at_least("C210", f"{step.cup} skirt and plinth", gap, skirt * chord - GRID, "mm"))
        for tongue in moulds.plan.standing(step, "tongue"):
            gap = cup.min_gap(solids[tongue.name], window + 1)
            found.append(at_least("C210", f"{step.cup} window and {tongue.name}", gap, window - GRID, "mm"))
        if step.lid:
            gap = solids[step.lid].trim_by_plane((0, 0, -1), play - step.rim).min_gap(cup, play + 1)
            found.append(at_least("C210", f"{step.lid} skirt and {step.cup}", gap, play * chord - GRID, "mm"))
    return found


CHECK = MouldCheck("C210", "gap: faces that slide have the printer's clearance", findings)
