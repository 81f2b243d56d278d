"""The cavities of a mould: what silicone can reach in each pour, beside what was drawn as the layer."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import manifold3d
from manifold3d import Manifold

from unitcad.kernels.mesh import realise
from unitcad.moulds.plan import Plan, Step
from unitcad.shape import box

BALANCE = 1e-6
"""Largest share of a layer's volume by which cavity and layer may differ."""


class Cavity(NamedTuple):
    """One cell of a pour: the layer as drawn with what stands in sprue and vents, and what silicone can reach there."""

    drawn: Manifold
    reached: Manifold


def cavities(plan: Plan, solids: Mapping[str, Manifold], segments: int) -> list[list[Cavity]]:
    """Return the cavities of each pour, one a cell."""
    found, cured = [], Manifold()
    for step in plan.steps:
        layers = [realise(shape, segments) for shape in step.layer]
        held = _held(step, layers, _reached(step, solids, cured, segments), segments)
        if any(abs(cell.reached.volume() - cell.drawn.volume()) > BALANCE * cell.drawn.volume() for cell in held):
            # Among very fine facets the union of all that touches can lose a wedge: a second opinion, piece by piece.
            held = _held(step, layers, _reached(step, solids, cured, segments, one_by_one=True), segments)
        found.append(held)
        cured = Manifold.batch_boolean([cured, *layers], manifold3d.OpType.Add)
    return found


def boxes_meet(a: Manifold, b: Manifold) -> bool:
    """Tell whether the bounding boxes of two solids touch."""
    p, q = a.bounding_box(), b.bounding_box()
    return all(p[i] <= q[i + 3] and q[i] <= p[i + 3] for i in range(3))


def _reached(
    step: Step, solids: Mapping[str, Manifold], cured: Manifold, segments: int, *, one_by_one: bool = False
) -> list[Manifold]:
    """Return what silicone can reach, in components: block - tools - cured layers - seals, at once or `one_by_one`.

    The block is larger than the tools and reaches below the base, so a leak joins the outside to the cavity. It ends at
    the rim plane, where the pour is open and the blade runs, or at the lid's upper face, where sprue and vents open.
    """
    around = [solids[name] for name in step.tools]
    x0, y0, z0, x1, y1, _ = _box_of(around)
    block = realise(box(x0 - 5, x1 + 5, y0 - 5, y1 + 5, z0 - 5, step.top), segments)
    filled = [*around, cured, *(realise(shape, segments) for shape in step.seals)]
    if one_by_one:
        for piece in filled:
            block = block - piece
            block.num_tri()  # evaluated here, or all of it is joined into one operation again
        return block.decompose()
    return Manifold.batch_boolean([block, *filled], manifold3d.OpType.Subtract).decompose()


def _held(step: Step, layers: list[Manifold], components: list[Manifold], segments: int) -> list[Cavity]:
    """Return the component that holds each layer."""
    channels = [realise(shape, segments) for shape in step.channels]
    share = len(channels) // len(layers)

    def cells() -> Iterator[Cavity]:
        for i, layer in enumerate(layers):
            drawn = Manifold.batch_boolean([layer, *channels[i * share : (i + 1) * share]], manifold3d.OpType.Add)
            near = [c for c in components if boxes_meet(c, layer)]
            volumes = [(c ^ layer).volume() if len(near) > 1 else 1.0 for c in near]
            yield Cavity(drawn, near[volumes.index(max(volumes))] if near else Manifold())

    return list(cells())


def _box_of(solids: list[Manifold]) -> tuple[float, ...]:
    boxes = [solid.bounding_box() for solid in solids]
    return tuple(min(b[i] for b in boxes) for i in range(3)) + tuple(max(b[i] for b in boxes) for i in range(3, 6))
