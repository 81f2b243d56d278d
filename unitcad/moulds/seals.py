"""The seals of a pour: space without tool that silicone is kept from."""

from __future__ import annotations

from unitcad.designs import Dimensions, design_of
from unitcad.designs.tooling import Layout
from unitcad.moulds import filament
from unitcad.moulds.base import core, notch
from unitcad.moulds.cup import bores, cup_blank, windows
from unitcad.moulds.tongue import tongues
from unitcad.shape import Common, Shape, cut, moved
from unitcad.spec import Spec


def seals(spec: Spec, dims: Dimensions, lay: Layout, layer: int) -> list[Shape]:
    """Draw the space without tool that silicone is kept from: grease round a tongue, the annulus round a filament.

    A window's seal is the part of the cup removed by the window, less the tongue; never a solid built a second time.
    """
    seals: list[Shape] = []
    if dims.exit:
        around = [shape for _, shape in tongues(dims, lay)]
        walls = cut(cup_blank(spec, lay, dims.heights[layer]), bores(dims, lay, layer))
        seals += [cut(Common((walls, window)), around) for window in windows(spec, dims, lay, dims.heights[layer])]
        seals += [
            cut(Common((moved(core(dims), c.x, c.y), moved(notch(spec, dims, dims.exit, s), c.x, c.y))), around)
            for c in lay.cells
            for s in c.sides
        ]
    if design_of(spec).suction:
        seals += [filament.annulus(spec, dims, c) for c in lay.cells]
    return seals
