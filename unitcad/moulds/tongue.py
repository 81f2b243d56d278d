"""The tongues: strips that form the slot and are pulled out sideways, first of all."""

from __future__ import annotations

from unitcad.designs import Dimensions
from unitcad.designs.dimensions import Exit
from unitcad.designs.parts import strip
from unitcad.designs.tooling import Layout
from unitcad.shape import Shape, box, moved, turned, union

GRIP_LENGTH, GRIP_WIDTH, GRIP_GAP, GRIP_APART = 8.0, 10.0, 3.0, 0.5


def tongue(dims: Dimensions, lay: Layout, exit: Exit, cut: bool = False) -> Shape:
    """Draw the strip that forms the slot, with a grip outside the cup; for a single cell on the axis, leaving along +x.

    Its tip is round and stops against the core's riser, its underside rests on the ledge. One that is `cut` from film
    is a plain strip: tape makes its grip.
    """
    low, high = exit.low, exit.high
    edge = max(lay.cup[0] - abs(c.x) for c in lay.cells)
    reach = edge + GRIP_GAP + GRIP_LENGTH
    if cut:
        return strip(dims, 1, reach, exit.width / 2, low, high)
    half = max(GRIP_WIDTH, exit.width + 4) / 2
    if len(lay.cells) > 1:
        half = max(min(half, lay.pitch / 2 - GRIP_APART), exit.width / 2)
    grip = box(edge + GRIP_GAP, reach, -half, half, low, high)
    return union((strip(dims, 1, reach - 1, exit.width / 2, low, high), grip))


def tongues(dims: Dimensions, lay: Layout, cut: bool = False) -> list[tuple[int, Shape]]:
    """Draw every tongue in its place, with the side (+1, -1 along x) that it is pulled out to; printed, or `cut`."""
    if not dims.exit:
        return []
    one = tongue(dims, lay, dims.exit, cut)
    return [(s, moved(turned(one, "z", 0 if s > 0 else 2), c.x, c.y)) for c in lay.cells for s in c.sides]
