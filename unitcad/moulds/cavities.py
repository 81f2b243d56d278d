"""The cavities of a mould: what silicone can reach in each pour, beside what was drawn as the layer."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from manifold3d import Manifold, OpType

from unitcad.kernels.mesh import realise
from unitcad.moulds.plan import Plan, Step
from unitcad.shape import box

BALANCE = 1e-6
"""Largest share of a layer's volume by which cavity and layer may differ."""


class Cavity(NamedTuple):
    """One cell of a pour: the layer as drawn with what stands in sprue and vents, and what silicone can reach there."""

    step: Step
    where: str
    drawn: Manifold
    reached: Manifold


def cavities(plan: Plan, solids: Mapping[str, Manifold], segments: int) -> tuple[Cavity, ...]:
    """Return the cavities of all pours in their order, one a cell."""
    filled: list[Cavity] = []
    cured = Manifold()
    for step in plan.steps:
        layers = [realise(shape, segments) for shape in step.layer]
        cells = list(_cells(step, layers, _reached(step, solids, cured, segments), segments))
        if any(abs(cell.reached.volume() - cell.drawn.volume()) > BALANCE * cell.drawn.volume() for cell in cells):
            # Among very fine facets the union of all that touches can lose a wedge: a second opinion, piece by piece.
            pieces = _reached(step, solids, cured, segments, one_by_one=True)
            cells = list(_cells(step, layers, pieces, segments))
        filled += cells
        cured = united([cured, *layers])
    return tuple(filled)


def boxes_meet(a: Manifold, b: Manifold) -> bool:
    """Tell whether the bounding boxes of two solids touch."""
    p, q = a.bounding_box(), b.bounding_box()
    return all(p[i] <= q[i + 3] and q[i] <= p[i + 3] for i in range(3))


def united(solids: Iterable[Manifold]) -> Manifold:
    """Return the union of solids."""
    return Manifold.batch_boolean(list(solids), OpType.Add)


def _reached(
    step: Step, solids: Mapping[str, Manifold], cured: Manifold, segments: int, *, one_by_one: bool = False
) -> list[Manifold]:
    """Return what silicone can reach, in components: block - tools - cured layers - seals, at once or `one_by_one`.

    The block is larger than the tools and reaches below the base, so a leak joins the outside to the cavity. It ends at
    the rim plane, where the pour is open and the blade runs, or at the lid's upper face, where sprue and vents open.
    """
    tools = [solids[name] for name in step.tools]
    x0, y0, z0, x1, y1, _ = Manifold.compose(tools).bounding_box()
    block = realise(box(x0 - 5, x1 + 5, y0 - 5, y1 + 5, z0 - 5, step.top), segments)
    laid = [body.shape for body in step.inserts]
    filled = [*tools, cured, *(realise(shape, segments) for shape in (*laid, *step.seals))]
    if one_by_one:
        for piece in filled:
            block = block - piece
            block.num_tri()  # evaluated here, or all of it is joined into one operation again
        return block.decompose()
    return Manifold.batch_boolean([block, *filled], OpType.Subtract).decompose()


def _cells(step: Step, layers: list[Manifold], components: list[Manifold], segments: int) -> Iterator[Cavity]:
    """Yield each layer with the component that holds it."""
    channels = [realise(shape, segments) for shape in step.channels]
    share = len(channels) // len(layers)
    for i, layer in enumerate(layers):
        where = f"pour {step.index}" + (f" cell {i + 1}" if len(layers) > 1 else "")
        drawn = united([layer, *channels[i * share : (i + 1) * share]])
        near = [c for c in components if boxes_meet(c, layer)]
        volumes = [(c ^ layer).volume() if len(near) > 1 else 1.0 for c in near]
        yield Cavity(step, where, drawn, near[volumes.index(max(volumes))] if near else Manifold())
