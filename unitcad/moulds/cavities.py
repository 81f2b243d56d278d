"""The cavities of a mould: the space that silicone can reach in each pour, and the layer as drawn."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from manifold3d import Manifold, OpType

from unitcad.kernels.mesh import realise
from unitcad.moulds.plan import Plan, Step
from unitcad.shape import box

BALANCE = 1e-6
"""Largest share of a layer's volume by which cavity and layer may differ."""
_SAME_MM = 1e-6


class Cavity(NamedTuple):
    """One cell of a pour: layer and silicone in sprue and vents, as drawn, and the space that silicone can reach."""

    step: Step
    where: str
    drawn: Manifold
    reached: Manifold


def cavities(plan: Plan, solids: Mapping[str, Manifold], segments: int) -> tuple[Cavity, ...]:
    """Return the cavities of all pours in their order, one a cell."""
    return tuple(cavity for step in plan.steps for cavity in _of_pour(step, solids, segments))


def _of_pour(step: Step, solids: Mapping[str, Manifold], segments: int) -> Iterator[Cavity]:
    """Yield the cavities of a pour: parts of a block round the tools without all that keeps silicone out."""
    tools = [solids[name] for name in step.tools]
    others = (*step.earlier, *(body.shape for body in step.inserts), *step.seals)
    filled = [*tools, *(realise(shape, segments) for shape in others)]
    block, count = _block_round(tools, step.top), len(step.layer)
    share = len(step.channels) // count

    @cache
    def parts(piece_by_piece: bool) -> list[Manifold]:
        if not piece_by_piece:
            return Manifold.batch_boolean([block, *filled], OpType.Subtract).decompose()
        left = block
        for piece in filled:
            left = left - piece
            left.num_tri()  # evaluated here, or all of it is joined into one operation again
        return left.decompose()

    for i, shape in enumerate(step.layer):
        layer = realise(shape, segments)
        drawn = united([layer, *(realise(each, segments) for each in step.channels[i * share : (i + 1) * share])])
        reached = _holding(layer, drawn, parts(False))
        if abs(reached.volume() - drawn.volume()) > BALANCE * drawn.volume():
            # Among very fine facets the union of all that touches can lose a wedge: a second opinion.
            reached = _holding(layer, drawn, parts(True))
        yield Cavity(step, f"pour {step.index}" + (f" cell {i + 1}" if count > 1 else ""), drawn, reached)


def boxes_meet(a: Manifold, b: Manifold) -> bool:
    """Tell whether the bounding boxes of two solids touch."""
    p, q = a.bounding_box(), b.bounding_box()
    return all(p[i] <= q[i + 3] and q[i] <= p[i + 3] for i in range(3))


def united(solids: Iterable[Manifold]) -> Manifold:
    """Return the union of solids."""
    return Manifold.batch_boolean(list(solids), OpType.Add)


def _block_round(solids: Sequence[Manifold], top: float) -> Manifold:
    """Return a block that is larger than the tools and reaches below them, so that a leak joins outside and cavity.

    It ends at the rim plane, at which the pour is open and the blade runs, or at the lid's upper face with sprue and
    vents.
    """
    boxes = np.array([solid.bounding_box() for solid in solids])
    (x0, y0, z0), (x1, y1) = boxes[:, :3].min(axis=0).tolist(), boxes[:, 3:5].max(axis=0).tolist()
    # On the grid, as everything drawn is: a film above the tools would close every cavity.
    return realise(box(x0 - 5, x1 + 5, y0 - 5, y1 + 5, z0 - 5, top), 4)


def _holding(layer: Manifold, drawn: Manifold, components: Iterable[Manifold]) -> Manifold:
    """Return the component that is the layer and its channels as drawn, or has most of the layer; otherwise nothing."""
    near = [component for component in components if boxes_meet(component, layer)]
    for component in near:  # only one component of a pour can have that volume and that box
        box_off = np.abs(np.subtract(component.bounding_box(), drawn.bounding_box())).max()
        if abs(component.volume() - drawn.volume()) <= BALANCE * drawn.volume() and box_off < _SAME_MM:
            return component
    return max(near, key=lambda component: (component ^ layer).volume() if len(near) > 1 else 1.0, default=Manifold())
