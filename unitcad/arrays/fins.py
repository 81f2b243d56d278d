r"""Fins on the base of a back sheet: they form the notches, open to the skin, that the common circuit is laid into.

skin side of a unit, from below         fin, from the middle of the core to beyond the unit's edge
     .---------.                             .------.
   /   .---.     \                          | core |======|
  |   | pad |=====|== row of the circuit     '------'
   \   '---'     /
     '---------'
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

from unitcad.arrays.array import Array, Box
from unitcad.arrays.circuit.wiring import Wiring
from unitcad.shape import Shape, box
from unitcad.spec import Spec

SEAL = 1.2
"""How far a fin runs on in the wall of the outermost cup, mm: the slit beside it, greased, is the pour's seal."""
_EPS = 1e-6


class Fin(NamedTuple):
    """A way of the circuit out of a place's unit: along +x, -x, +y or -y, `half` wide to either side.

    `reach` is from the unit's centre to the fin's end, mm.
    """

    place: int
    direction: tuple[int, int]
    half: float
    reach: float

    def drawn(self, array: Array, reach: float, wider: float, low: float, high: float) -> Shape:
        """Draw a box along the way, from the unit's centre to `reach`, `wider` to either side, from z to z."""
        x0, y0, x1, y1 = self.taken(array, reach, wider)
        return box(x0, x1, y0, y1, low, high)

    def taken(self, array: Array, reach: float, wider: float) -> Box:
        """Return what that box takes in the plane, mm."""
        at, (x0, x1, y0, y1) = array.places[self.place], self._sides(reach, wider)
        return at.x + x0, at.y + y0, at.x + x1, at.y + y1

    def about_the_axis(self, reach: float, wider: float, low: float, high: float) -> Shape:
        """Draw the same with the unit's axis at x = y = 0."""
        return box(*self._sides(reach, wider), low, high)

    def _sides(self, reach: float, wider: float) -> tuple[float, float, float, float]:
        half, (dx, dy) = self.half + wider, self.direction
        x0, x1 = (min(0.0, dx * reach), max(0.0, dx * reach)) if dx else (-half, half)
        y0, y1 = (min(0.0, dy * reach), max(0.0, dy * reach)) if dy else (-half, half)
        return x0, x1, y0, y1


def fins(array: Array, circuit: Wiring) -> tuple[Fin, ...]:
    """Return the fins of an array's units, for every strip of the circuit that leaves a unit.

    A fin ends a seal's length outside its unit.
    """
    wider = array.unit.moulds.slot_width_clearance_mm / 2
    return tuple(
        Fin(place, direction, half + wider, array.places[place].radius + SEAL)
        for place, direction, half in sorted(set(_ways(array, circuit)))
    )


def least_apart(spec: Spec) -> float:
    """Return the least distance between the edges of two units whose fins come to meet each other, mm."""
    return 2 * (SEAL + spec.moulds.plinth_clearance_mm) + spec.moulds.least_wall_mm


def _ways(array: Array, circuit: Wiring) -> Iterator[tuple[int, tuple[int, int], float]]:
    """Yield place, direction and the strip's half width for every way out of a unit."""
    for strip in circuit.strips:
        (x0, y0), (x1, y1) = strip.start, strip.end
        length = math.hypot(x1 - x0, y1 - y0)
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        for i, place in enumerate(array.places):
            along, across = (place.x - x0) * ux + (place.y - y0) * uy, (place.y - y0) * ux - (place.x - x0) * uy
            if abs(across) < _EPS and -_EPS < along < length + _EPS:
                for sense, rest in ((1, length - along), (-1, along)):
                    if rest > place.radius:
                        yield i, (round(sense * ux), round(sense * uy)), strip.half
