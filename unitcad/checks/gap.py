"""C210: faces that must slide have the printer's clearance: skirt and plinth, or pins, tongue and window, lid and cup.

Pins and the slits next to a base's fins have the clearance of the spec, and no less than the printer's own play.

The skirt is measured below the seat, at which cup and plinth touch on purpose, and next to its ribs, which reach into
the plinth; the lid's below the rim. Round corners are polygons of as many sides a turn on both pieces: midway along a
facet their gap is the clearance's cosine of pi / n. In moulds by complement the gap to the parts on the base is that of
sections: above it the cup may touch its edge.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np
from manifold3d import CrossSection, Manifold

from unitcad.checks.finding import MouldCheck, MouldFinding, at_least
from unitcad.kernels.mesh import arrays
from unitcad.kernels.mesh import gap as gap_between
from unitcad.moulds.cavities import united
from unitcad.moulds.cup import PIN_RADIUS, Pins
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import cylinder, moved
from unitcad.shape.profile import GRID_PER_MM
from unitcad.spec.raw import MouldsTable
from unitcad.text import number

KNIFE = (
    "the base ends in an edge without thickness under the body: round that corner, or draw a level step there, {} mm "
    "wide or wider"
)
THIN = 1e-3
"""Two heights nearer than this have no slice between them, mm."""
GRID = 2 / GRID_PER_MM
"""Clearance that snapping two faces to the grid may take, mm."""


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Measure every pair of sliding faces of every pour."""
    chord = math.cos(math.pi / moulds.segments)
    lengths, solids = moulds.spec.moulds, moulds.solids
    skirt, window = min(lengths.plinth_clearance_mm, lengths.seat_relief_mm), lengths.window_clearance_mm
    play = lengths.plinth_clearance_mm
    pins = moulds.plan.pins
    beside_base, advice = (
        (least_play(lengths), too_tight(lengths)) if pins else (window, KNIFE.format(number(lengths.least_wall_mm, 3)))
    )
    for step in moulds.plan.steps:
        base = solids[moulds.plan.base_of(step)]
        if step.cup not in solids:
            if step.lid and step.pins:
                yield _on_pins(moulds, step.lid, solids[step.lid], base, step.pins)
            continue  # a part without neighbour slides on nothing
        cup = solids[step.cup]
        beside = cup - moulds.rib_spaces
        if pins:
            yield _on_pins(moulds, step.cup, beside, base, pins)
        else:
            gap = beside.trim_by_plane((0, 0, -1), skirt).min_gap(base, skirt + 1)
            yield at_least("C210", f"{step.cup} skirt and plinth", gap, skirt * chord - GRID, "mm")
        if not moulds.plan.concentric:
            gap = _sideways((beside, base), _above_seat((beside, base)), beside_base + 1)
            where = f"{step.cup} and what stands on the base"
            yield at_least("C210", where, gap, beside_base * chord - GRID, "mm", advice)
        for tongue in moulds.plan.standing(step, "tongue"):
            gap = cup.min_gap(solids[tongue.name], window + 1)
            yield at_least("C210", f"{step.cup} window and {tongue.name}", gap, window - GRID, "mm")
        if step.lid:
            gap = solids[step.lid].trim_by_plane((0, 0, -1), play - step.rim).min_gap(cup, play + 1)
            yield at_least("C210", f"{step.lid} skirt and {step.cup}", gap, play * chord - GRID, "mm")


def _on_pins(moulds: MouldSet, name: str, piece: Manifold, base: Manifold, pins: Pins) -> MouldFinding:
    """Measure the gap between pins and the holes of the piece that they centre."""
    play, reach, seat = pins.clearance, pins.hole_radius + 1, pins.seat
    columns, rooms = (
        united(moulds.meshes(moved(cylinder(radius, 0.0, 1.0), *at) for at in pins.places)).project()
        for radius in (PIN_RADIUS + play, reach)
    )
    corners = np.concatenate([arrays(solid)[0] for solid in (piece, base)])
    beside = np.min([np.hypot(corners[:, 0] - x, corners[:, 1] - y) for x, y in pins.places], axis=0) <= reach
    top = seat + pins.height
    heights = [seat, *corners[beside & (corners[:, 2] > seat) & (corners[:, 2] < top), 2].tolist(), top]
    gap = _sideways((piece, base), heights, play + 1, (rooms, columns))
    lengths = moulds.spec.moulds
    limit = max(play, least_play(lengths)) * math.cos(math.pi / moulds.segments) - GRID
    return at_least("C210", f"{name} holes and pins", gap, limit, "mm", too_tight(lengths))


def least_play(lengths: MouldsTable) -> float:
    """Return the clearance of pieces without ribs, mm: that of the spec, or the printer's own play if larger."""
    return max(lengths.plinth_clearance_mm, lengths.xy_play_mm)


def play_missing(moulds: MouldSet) -> list[str]:
    """Return a sentence if pieces without ribs have too little play, known before anything is drawn; otherwise []."""
    lengths, plan = moulds.spec.moulds, moulds.plan
    codes = [*(["C210"] if plan.pins else []), *(["C250"] if plan.splits else [])]
    if not codes or lengths.plinth_clearance_mm >= least_play(lengths):
        return []
    return [f"{too_tight(lengths)}, or the pieces do not go together ({' and '.join(codes)})"]


def too_tight(lengths: MouldsTable) -> str:
    """Write the remedy for pieces with less than `least_play` between them."""
    asked, play = lengths.plinth_clearance_mm, lengths.xy_play_mm
    if asked >= play:
        return "the clearance (moulds.plinth_clearance_mm) is missing"
    return (
        f"moulds.plinth_clearance_mm = {asked:g} is less than the printer's own play, moulds.xy_play_mm = {play:g}: "
        f"give it {play:g} or more"
    )


def _above_seat(solids: Iterable[Manifold]) -> Iterator[float]:
    """Yield the seat's height, and those of all corners above it."""
    yield 0.0
    for solid in solids:
        heights = arrays(solid)[0][:, 2]
        yield from heights[heights > 0].tolist()


def _sideways(
    solids: tuple[Manifold, Manifold],
    heights: Iterable[float],
    most: float,
    within: tuple[CrossSection, CrossSection] | None = None,
) -> float:
    """Return the least distance of two solids in any section between two heights, at most `most`, mm.

    `within` are regions outside which nothing of either is looked at.
    """
    least = most
    for below, above in pairwise(sorted(set(heights))):
        if above - below <= THIN:
            continue
        sections = [solid.slice((below + above) / 2) for solid in solids]
        if within:
            sections = [section ^ region for section, region in zip(sections, within, strict=True)]
        if not any(section.is_empty() for section in sections):
            least = gap_between(sections[0], sections[1], least)  # looked for no farther than the least so far
            if least == 0:
                break
    return least


CHECK = MouldCheck("C210", "gap: faces that slide have the printer's clearance", findings)
