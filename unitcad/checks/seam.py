"""C250: every printed piece fits the bed, and the pieces of a split tool fit together.

Measured on the meshes. The gap is the difference of a tool and its pieces: it is as wide as the spec's play, and no
narrower than the printer's own. The pieces share no volume and slide together along z. The part of the gap that a
pour's silicone can reach, with tape or petroleum jelly under each tool, fills with silicone.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, pairwise

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold

from unitcad.checks.draw import BLOCKED, blocked
from unitcad.checks.finding import GRID, MouldCheck, MouldFinding, at_least, at_most
from unitcad.checks.gap import least_play, too_tight
from unitcad.checks.overlap import OVERLAP
from unitcad.kernels.mesh import arrays, thick_pieces
from unitcad.moulds.cavities import united
from unitcad.moulds.cuts import Split
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step

WEEP = 0.01
"""Silicone in the seams of a pour, at most, as a share of its layer (assumed): far less than what is mixed over."""
THIN = 1e-3
"""Two heights nearer than this have no slice between them, and nearer borders count as touching, mm."""


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Look at the size of the pieces, at every seam of a split tool, then at the silicone in the seams of each pour."""
    yield _largest(moulds)
    gaps = {
        split.tool: moulds.solids[split.tool] - united(moulds.mesh(piece) for piece in split.pieces)
        for split in moulds.plan.splits
    }
    for split in moulds.plan.splits:
        yield from _of_split(moulds, split, gaps[split.tool])
    for step in moulds.plan.steps:
        there = [gaps[name] for name in step.tools if name in gaps]
        if there:
            yield _weep(moulds, step, there)


def _largest(moulds: MouldSet) -> MouldFinding:
    """Compare the piece that has least room on the bed with the bed, laid along or across it."""
    lengths = moulds.spec.moulds
    bed = lengths.bed_x_mm, lengths.bed_y_mm
    worst = None
    for piece in moulds.plan.pieces:
        if piece.made != "printed":
            continue
        solid = moulds.solids.get(piece.name) or moulds.mesh(piece)
        x0, y0, _, x1, y1, _ = solid.bounding_box()
        size = x1 - x0, y1 - y0
        ways = [max(zip(each, bed, strict=True), key=lambda pair: pair[0] - pair[1]) for each in (size, size[::-1])]
        length, room = min(ways, key=lambda pair: pair[0] - pair[1])
        if worst is None or length - room > worst[1] - worst[2]:
            worst = piece.name, length, room
    name, length, room = worst or ("no piece", 0.0, lengths.bed_x_mm)
    return at_most("C250", f"{name} on the bed", length, room + 1e-6, "mm", "it is larger than the printer's bed")


def _of_split(moulds: MouldSet, split: Split, gap: Manifold) -> Iterator[MouldFinding]:
    """Look at overlap, gap and way in of neighbouring pieces, at the widest gap, and at material outside the tool."""
    whole, pieces = moulds.solids[split.tool], [(piece.name, moulds.mesh(piece)) for piece in split.pieces]
    lengths = moulds.spec.moulds
    play, least = lengths.plinth_clearance_mm, least_play(lengths)
    # Pieces and gap have the tool's volume, plus any material outside of it or shared by two of them.
    beyond = max(sum(float(piece.volume()) for _, piece in pieces) + float(gap.volume() - whole.volume()), 0.0)
    if beyond > OVERLAP / 2:
        beyond = sum(float((piece - whole).volume()) for _, piece in pieces)
    yield at_most("C250", f"{split.tool}: pieces beyond it", beyond, OVERLAP, "mm3")
    for (name, piece), (after, other) in pairwise(pieces):
        where = f"{name} and {after}"
        yield at_most("C250", f"{where}: overlap", float((piece ^ other).volume()), OVERLAP, "mm3")
        narrowest = float(piece.min_gap(other, least + 1))
        yield at_least("C250", f"{where}: narrowest gap", narrowest, least - GRID, "mm", too_tight(lengths))
        caught = min(sum(blocked(other, {name: piece}, (0, 0, way)).values()) for way in (1, -1))
        yield at_most("C250", f"{where}: slide together", caught, BLOCKED, "mm3", "one piece is caught in the other")
    heights = sorted({float(z) for z in arrays(gap)[0][:, 2]}) if not gap.is_empty() else []
    levels = [(low + high) / 2 for low, high in pairwise(heights) if high - low > THIN]
    widest = max((_inscribed(gap.slice(level)) for level in levels), default=0.0)
    missing = "something of the tool is missing"
    yield at_most("C250", f"{split.tool}: widest gap", widest, play + GRID, "mm", missing)


def _inscribed(section: CrossSection) -> float:
    """Return the diameter of the largest circle in a section, mm."""
    low, high = 0.0, 0.0 if section.is_empty() else float(np.ptp(np.concatenate(section.to_polygons()), axis=0).max())
    while high - low > 1e-4:
        middle = (low + high) / 2
        gone = section.offset(-middle / 2, JoinType.Miter).is_empty()
        low, high = (low, middle) if gone else (middle, high)
    return high


def _weep(moulds: MouldSet, step: Step, gaps: list[Manifold]) -> MouldFinding:
    """Compare the volume of the gaps that touch the layer, under the rim, with the layer's.

    Each tool's seams are sealed from below: nothing gets from a cup's into the base's.
    """
    layers = moulds.meshes(step.layer)
    reached = 0.0
    for part in chain.from_iterable(thick_pieces(gap.trim_by_plane((0, 0, -1), -step.rim), GRID) for gap in gaps):
        if any(part.min_gap(layer, 2 * THIN) < THIN for layer in layers):
            reached += float(part.volume())
    limit = WEEP * sum(float(layer.volume()) for layer in layers)
    advice = "the seams take silicone that the layer lacks: a deeper sheet, or fewer seams"
    return at_most("C250", f"pour {step.index}: silicone in the seams", reached, limit, "mm3", advice)


CHECK = MouldCheck("C250", "seams: every piece fits the bed, and the pieces of a split tool fit together", findings)
