"""The tray of the film that closes a unit's skin side: filled, struck off, and the unit set onto the wet film.

        .---.  .------------------.  .---.   rim, with the blade's groove round each recess
        |   '--'   film, skin_mm  '--'   |
        '--------------------------------'   floor

It has the outline of the cups, and its rim the height of the last one: the blade and the labels fit both.
"""

from __future__ import annotations

import math
from dataclasses import replace

from unitcad.designs import Dimensions
from unitcad.designs.parts import BEYOND
from unitcad.designs.tooling import Layout
from unitcad.moulds.base import outline
from unitcad.moulds.cup import grooves
from unitcad.moulds.layout import MARK
from unitcad.shape import Extrude, Shape, cut, cylinder, moved
from unitcad.spec import Spec

FLOOR_MM = 2.0
"""Least thickness under the film, mm, before it ends a whole layer."""


def skin_tray(spec: Spec, dims: Dimensions, lay: Layout) -> Shape:
    """Draw the tray, its rim at the top of the last layer."""
    rim, layer = dims.heights[-1], spec.moulds.layer_mm
    floor = math.ceil((FLOOR_MM + dims.skin) / layer - 1e-6) * layer - dims.skin
    film = cylinder(dims.outer_radius, rim - dims.skin, rim + BEYOND)
    recesses = [moved(film, cell.x, cell.y) for cell in lay.cells]
    closed = replace(dims, exit=None)
    blank = Extrude(outline(lay.cup, MARK), rim - dims.skin - floor, rim)
    return cut(blank, [*recesses, *grooves(spec, closed, lay, len(dims.heights) - 1)])


def films(dims: Dimensions, lay: Layout) -> list[Shape]:
    """Draw the films in their tray, one a cell."""
    film = cylinder(dims.outer_radius, dims.heights[-1] - dims.skin, dims.heights[-1])
    return [moved(film, cell.x, cell.y) for cell in lay.cells]
