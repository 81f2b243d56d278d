"""The strike-off blade."""

from __future__ import annotations

from unitcad.designs.tooling import Layout
from unitcad.moulds.layout import BLADE_HEIGHT
from unitcad.shape import Extrude, Shape, moved, polygon, turned

BLADE_THICKNESS, BLADE_EDGE = 3.0, 0.8


def blade(lay: Layout, rim: float) -> Shape:
    """Draw the strike-off blade, edge down on the rim: a bar as long as the plate, bevelled to a flat edge."""
    return bar(lay.plate[1], rim)


def bar(half: float, rim: float) -> Shape:
    """Draw a bevelled bar of the length 2 `half` along y, its edge at the height `rim`."""
    t, e, h = BLADE_THICKNESS, BLADE_EDGE, BLADE_HEIGHT
    section = polygon((0, 0), (e, 0), (t, 2 * (t - e)), (t, h), (0, h))
    # Drawn in (x, z) and stood up: x to x, y to z, extrusion to -y.
    return moved(turned(Extrude(section, -half, half), "x", 1), 0, 0, rim)
