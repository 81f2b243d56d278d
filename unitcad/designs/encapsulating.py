"""The encapsulating design: each layer a wall and a cap over the one inside it; the circuit touches Layer 1 only.

.-----------------.  heights[1]
| .-------------. |  heights[0]
| |  FPCB pad   | |  core_height
|L|L|  motor  |L|L=  the slot, where a tail leaves
|2|1|         |1|2|
======= skin ======
"""

from __future__ import annotations

from unitcad.designs.common import slots
from unitcad.shape import Revolve, Shape, cut, polygon
from unitcad.spec import Dimensions


def layers(dims: Dimensions) -> tuple[Shape, ...]:
    """Layer i: wall and cap in one profile, less the slots of tails or wires."""
    inner = zip((dims.cavity_radius, *dims.radii[:-1]), (dims.core_height, *dims.heights[:-1]), strict=True)
    return tuple(
        cut(Revolve(polygon((r0, 0), (r1, 0), (r1, z1), (0, z1), (0, z0), (r0, z0))), slots(dims))
        for (r0, z0), r1, z1 in zip(inner, dims.radii, dims.heights, strict=True)
    )
