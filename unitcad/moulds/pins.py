r"""Pins on a base and blind holes in its cups: they centre cups that are too large for a skirt.

          .----------------- cup -----.
          |    .--------.   blind hole, wider by the clearance and deeper by its relief
    ------'    | /----\ |    '--------  seat, z = 0
               |_| pin|_|
    ----------- base ------------------

A pin's end is chamfered, and the hole's mouth: a first printed layer that is squeezed out narrows it.
"""

from __future__ import annotations

from dataclasses import dataclass

from unitcad.designs.parts import BEYOND
from unitcad.shape import Revolve, Shape, moved, polygon

PIN_RADIUS = 2.0
CHAMFER = 0.4
"""Of a pin's end, and of a hole's mouth, mm."""
DEEPER = 0.4
"""How much deeper than its pin a hole is, mm: the cup bears on its seat."""


@dataclass(frozen=True)
class Pins:
    """Pins at `places` (x, y), all of one `height` over the `seat`, in holes wider by `clearance` all round (mm)."""

    places: tuple[tuple[float, float], ...]
    height: float
    clearance: float
    seat: float = 0.0

    @property
    def hole_radius(self) -> float:
        """Of a hole above its mouth, mm."""
        return PIN_RADIUS + self.clearance


def standing_pins(pins: Pins) -> list[Shape]:
    """Draw the pins, sunk into the base."""
    r, h = PIN_RADIUS, pins.height
    drawn = Revolve(polygon((0, -BEYOND), (r, -BEYOND), (r, h - CHAMFER), (r - CHAMFER, h), (0, h)))
    return [moved(drawn, x, y, pins.seat) for x, y in pins.places]


def pin_holes(pins: Pins) -> list[Shape]:
    """Draw the blind holes in a cup whose lower face is the seat."""
    r, h = pins.hole_radius, pins.height + DEEPER
    wide = r + CHAMFER + BEYOND
    drawn = Revolve(polygon((0, -BEYOND), (wide, -BEYOND), (r, CHAMFER), (r, h), (0, h)))
    return [moved(drawn, x, y, pins.seat) for x, y in pins.places]
