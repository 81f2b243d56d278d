"""The cavities of a mould: the space that silicone can reach in each pour, and the layer as drawn."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from manifold3d import Manifold, OpType

from unitcad.kernels.mesh import realise
from unitcad.moulds.plan import Plan, Step
from unitcad.moulds.surroundings import MARGIN, column_round, crop, once_each, reaching
from unitcad.shape import Shape, box
from unitcad.shape.column import Standing

BALANCE = 1e-6
"""Largest share of a layer's volume by which cavity and layer may differ."""
_SAME_MM = 1e-6


class Cavity(NamedTuple):
    """One cell of a pour: layer and silicone in sprue and vents, as drawn, and the space that silicone can reach.

    `first` is the index, among all cavities, of the first one in like surroundings; its findings apply here.
    """

    step: Step
    where: str
    drawn: Manifold
    reached: Manifold
    first: int


def cavities(
    plan: Plan, solids: Mapping[str, Manifold], segments: int, cells: Sequence[Sequence[int]]
) -> tuple[Cavity, ...]:
    """Return the cavities of all pours in their order, one a cell; a pour's `cells` are equal in like surroundings."""
    filled: list[Cavity] = []
    for step, numbers in zip(plan.steps, cells, strict=True):
        if len(step.layer) == 1:
            filled.append(_alone(step, solids, segments, len(filled)))
        else:
            filled += _gang(step, solids, segments, numbers, len(filled))
    return tuple(filled)


def _alone(step: Step, solids: Mapping[str, Manifold], segments: int, first: int) -> Cavity:
    """Return the cavity of a pour that casts one solid."""
    tools = [solids[name] for name in step.tools]
    others = [realise(shape, segments) for shape in _not_tools(step)]
    layer, channels = realise(step.layer[0], segments), [realise(shape, segments) for shape in step.channels]
    cavity = _one(layer, channels, [*tools, *others], _block_round(tools, step.top))
    return Cavity(step, f"pour {step.index}", *cavity, first)


def _gang(step: Step, solids: Mapping[str, Manifold], segments: int, cells: Sequence[int], first: int) -> list[Cavity]:
    """Return the cavities of a pour's cells, worked out once for all cells in like surroundings.

    A cell is examined in a column that is a little larger than its silicone; if silicone leaves it, on the whole plate.
    """
    tools, others = [solids[name] for name in step.tools], _not_tools(step)
    beside = Standing(others)
    layers, share = [realise(shape, segments) for shape in step.layer], len(step.channels) // len(step.layer)

    def channels(i: int) -> list[Manifold]:
        return [realise(shape, segments) for shape in step.channels[i * share : (i + 1) * share]]

    def cavity(i: int) -> tuple[Manifold, Manifold]:
        column = column_round([layers[i], *channels(i)], MARGIN)
        filled = [*reaching(tools, column), *(realise(others[k], segments) for k in beside.inside(column))]
        filled = [solid for whole in filled if not (solid := crop(whole, column)).is_empty()]
        return _one(layers[i], channels(i), filled, _block_round(filled, step.top))

    @cache
    def of_plate() -> list[Manifold]:
        whole = [*tools, *(realise(shape, segments) for shape in others)]
        return Manifold.batch_boolean([_block_round(whole, step.top), *whole], OpType.Subtract).decompose()

    # Of an array's tools the layout's cells need not be those of every pour.
    numbers = cells if len(cells) == len(layers) else range(len(layers))
    found: list[Cavity] = []
    for i, (k, (drawn, reached)) in enumerate(once_each(numbers, cavity)):
        if _leaks(drawn, reached):
            # How far silicone gets that leaves the column, the whole plate tells: cells may differ in that.
            drawn = united([layers[i], *channels(i)])
            reached, k = _holding(layers[i], drawn, of_plate()), i
        elif k != i:
            by = np.subtract(layers[i].bounding_box()[:3], layers[k].bounding_box()[:3])
            drawn, reached = drawn.translate(tuple(by)), reached.translate(tuple(by))
        found.append(Cavity(step, f"pour {step.index} cell {i + 1}", drawn, reached, first + k))
    return found


def _not_tools(step: Step) -> list[Shape]:
    """Return the solids that keep silicone out besides the tools: cured layers, inserts, seals."""
    return [*step.earlier, *(body.shape for body in step.inserts), *step.seals]


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


def _one(
    layer: Manifold, channels: Sequence[Manifold], filled: Sequence[Manifold], block: Manifold
) -> tuple[Manifold, Manifold]:
    """Return a cell's silicone as drawn, and the part of a block less `filled` that contains the layer."""
    drawn = united([layer, *channels])
    reached = _holding(layer, drawn, Manifold.batch_boolean([block, *filled], OpType.Subtract).decompose())
    if _leaks(drawn, reached):
        # Among very fine facets the union of all that touches can lose a wedge: a second opinion, piece by piece.
        for piece in filled:
            block = block - piece
            block.num_tri()  # evaluated here, or all of it is joined into one operation again
        reached = _holding(layer, drawn, block.decompose())
    return drawn, reached


def _leaks(drawn: Manifold, reached: Manifold) -> bool:
    return abs(reached.volume() - drawn.volume()) > BALANCE * drawn.volume()


def _holding(layer: Manifold, drawn: Manifold, components: Iterable[Manifold]) -> Manifold:
    """Return the component that is the layer and its channels as drawn, or has most of the layer; otherwise nothing."""
    near = [component for component in components if boxes_meet(component, layer)]
    found = next((component for component in near if _alike(component, drawn)), None)
    return found or max(
        near, key=lambda component: (component ^ layer).volume() if len(near) > 1 else 1.0, default=Manifold()
    )


def _alike(a: Manifold, b: Manifold) -> bool:
    """Tell whether volume and bounding box are the same: only one component of a pour can be so."""
    if abs(a.volume() - b.volume()) > BALANCE * b.volume():
        return False
    return all(abs(p - q) < _SAME_MM for p, q in zip(a.bounding_box(), b.bounding_box(), strict=True))
