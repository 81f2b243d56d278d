"""The embedded design: concentric open rings round the motor; the circuit's pad lies on top and touches every layer.

------------------- FPCB pad over all layers
| L2 | L1 |  motor  | L1 | L2 |
============== skin ===========
"""

from __future__ import annotations

from unitcad.designs.common import slots
from unitcad.shape import Shape, cut, ring
from unitcad.spec import Dimensions


def layers(dims: Dimensions) -> tuple[Shape, ...]:
    """Layer i: the tube from the radius of the one inside it to its own, as high as the motor, less the wires' way."""
    inner = (dims.cavity_radius, *dims.radii[:-1])
    return tuple(
        cut(ring(r0, r1, 0, height), slots(dims))
        for r0, r1, height in zip(inner, dims.radii, dims.heights, strict=True)
    )
