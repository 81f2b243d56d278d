"""Additions to the pieces in pictures of the procedure: arrows, tape, grease, card, screwdrivers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from unitcad.designs import layer_colour
from unitcad.moulds.base import GRIP_WIDTH, outline, plate_top
from unitcad.moulds.layout import CORNER_RADIUS, MARK
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape import Extrude, Revolve, Shape, box, cut, cylinder, moved, polygon, rotated, turned, union
from unitcad.shape.extent import extent
from unitcad.shape.tree import Body

ARROW, TAPE, BAND, TOOL = (0.10, 0.36, 0.86), (0.47, 0.78, 0.86), (0.35, 0.33, 0.38), (0.80, 0.86, 0.90)
CARD, GREASE = (0.45, 0.72, 0.38), (0.98, 0.72, 0.16)
CLEAR = 5.0
"""Between a piece that is lifted off and its place, mm."""
Offset = tuple[float, float, float]
DOWN = (0.0, 0.0, -1.0)
HELD = 60.0
"""Length of a cup's side that one strip of tape holds down, mm (assumed)."""
TAPE_WIDTH, TAPE_THICKNESS, BELOW_RIM = 8.0, 0.4, 0.8
ON_PLATE = 0.75
"""Least share of the pad under a grip on the plate: it does not tip over the plate's edge."""


@dataclass(frozen=True)
class Extra:
    """An addition to the pieces: an arrow, tape, silicone; its colour (three numbers 0 to 1), and how it is moved."""

    shape: Shape
    colour: tuple[float, float, float]
    moved: Offset = (0.0, 0.0, 0.0)


def cast_colour(moulds: MouldSet, pour: int) -> tuple[float, float, float]:
    """Return the colour of the silicone of a pour (from 1): that of its body."""
    own = (body.colour for body in moulds.unit if body.made == "cast" and body.step == pour)
    return next(own, layer_colour(pour - 1))


def arrow(way: Offset, x: float, y: float, z: float, length: float, thick: float = 1.0) -> Extra:
    """Draw an arrow along a direction square to y, its middle at (x, y, z); `thick`: a factor for large scenes."""
    tip, shaft, head = min(3.6 * thick, length / 2), 0.55 * thick, 1.5 * thick
    upright = Revolve(polygon((0, 0), (shaft, 0), (shaft, length - tip), (head, length - tip), (0, length)))
    leaning = rotated(moved(upright, 0, 0, -length / 2), "y", math.degrees(math.atan2(way[0], way[2])))
    return Extra(moved(leaning, x, y, z), ARROW)


def led_out(moulds: MouldSet, leads: Sequence[Body], away: float) -> tuple[Extra, ...]:
    """Draw tail or wires led out through their slot, their inner ends with the motor `away` (z, mm) from its place."""
    dims, fpcb, found = moulds.dimensions, moulds.spec.fpcb, list[Extra]()
    mouth = dims.mouth_radius or dims.cavity_radius
    for body in leads:
        x0, y0, low, x1, y1, high = extent(body.shape)
        if body.kind == "wire":
            radius, y, z = (high - low) / 2, (y0 + y1) / 2, (low + high) / 2
            bend, free = min(x0 + radius, mouth - radius), x1 + away
            lower, upper = sorted((z, z + away))

            def lying(end: float, start: float, z: float, radius: float = radius, y: float = y) -> Shape:
                return moved(turned(cylinder(radius, start, end), "y", 1), y=y, z=z)

            down = moved(cylinder(radius, lower - radius, upper + radius), bend, y)
            parts = [lying(bend, min(x0, bend - radius), z + away), down, lying(free, bend, z)]
        elif body.kind == "circuit" and fpcb and dims.pad:
            half, thick = fpcb.tail_width_mm / 2, high - low
            bend, free = min(dims.pad.radius, mouth), max(-x0, x1) + away
            parts = list[Shape]([cylinder(dims.pad.radius, low + away, high + away)])
            for side in dims.sides:
                for a, b, bottom, top in (
                    (0.0, bend, low + away, high + away),
                    (bend - thick, bend, low + away, high),
                    (bend - thick, free, low, high),
                ):
                    x0, x1 = sorted((side * a, side * b))
                    parts.append(box(x0, x1, -half, half, bottom, top))
        else:
            continue
        found.append(Extra(union(parts), body.colour))
    return tuple(found)


def bands(x: float, y: float, low: float, high: float) -> tuple[Extra, ...]:
    """Draw two rubber bands round lid and base, near their ends at -x and x: from -y to y, from z to z."""

    def band(x: float) -> Shape:
        return cut(box(x - 1, x + 1, -y - 1, y + 1, low - 1, high + 1), (box(x - 2, x + 2, -y, y, low, high),))

    return Extra(band(x - 2), BAND), Extra(band(2 - x), BAND)


def on_tongues(moulds: MouldSet, length: float, colour: tuple[float, float, float]) -> tuple[Extra, ...]:
    """Draw grease on `length` mm of every tongue next to the cup's wall."""
    lay, exit = moulds.plan.layout, moulds.dimensions.exit
    if not exit:
        return ()
    half, low, high = exit.width / 2 + 0.15, exit.low - 0.15, exit.high + 0.15
    ends = [(cell.y, *sorted((s * lay.cup[0], s * (lay.cup[0] + length)))) for cell in lay.cells for s in cell.sides]
    return tuple(Extra(box(x0, x1, y - half, y + half, low, high), colour) for y, x0, x1 in ends)


def grease_on_rim(moulds: MouldSet, step: Step) -> Extra:
    """Draw the line of grease near the outer edge of a cup's rim, under its lid."""
    x, y = moulds.plan.layout.cup
    outer, inner = (outline((x - by, y - by), MARK) for by in (0.4, 1.2))
    hole = Extrude(inner, step.rim - 1, step.rim + 1)
    return Extra(cut(Extrude(outer, step.rim, step.rim + 0.3), (hole,)), GREASE)


def screwdrivers(lifted: float, edge: float, low: float) -> tuple[Extra, ...]:
    """Draw a screwdriver at either end along x, an arrow down on each handle.

    Its tip is at `low` under the lifted piece, which ends at x = `lifted`, and it leaves the base at x = `edge`.
    """
    blade = box(lifted - 1, edge + 4, -3, 3, low, low + 0.9)
    handle = moved(turned(Revolve(polygon((0, 0), (2.2, 0), (2.2, 9), (0, 9))), "y", 1), edge + 4, 0, low + 0.45)
    return tuple(
        extra
        for side in (1, -1)
        for extra in (
            Extra(turned(union((blade, handle)), "z", 1 - side), TOOL),
            arrow(DOWN, side * (edge + 9), 0.0, low + 9, 9.0),
        )
    )


def tape_places(moulds: MouldSet) -> tuple[float, ...]:
    """Return x of the first edge of each strip of tape on the front and the back of a cup, mm: one for each `HELD`."""
    half = moulds.plan.layout.cup[0]
    left, right, count = CORNER_RADIUS - half, half - MARK - TAPE_WIDTH, math.ceil(2 * half / HELD)
    if moulds.plan.splits:
        count = max(count, 2 * len(moulds.plan.splits[0].pieces))
    return tuple(left + (right - left) * i / max(count - 1, 1) for i in range(count))


def tape(moulds: MouldSet, step: Step) -> tuple[Extra, ...]:
    """Draw the strips of tape on a pour's cup: its wall, the plate, the plate's edge and underside."""
    lay, (bottom, top), thick = moulds.plan.layout, moulds.plate, TAPE_THICKNESS
    cup, plate = lay.cup[1], lay.plate[1]
    runs = (
        (cup, cup + thick, (top, step.rim - BELOW_RIM)),
        (cup, plate + thick, (top, top + thick)),
        (plate, plate + thick, (bottom - thick, top + thick)),
        (plate - 5.0, plate + thick, (bottom - thick, bottom)),
    )
    strips = [
        box(at, at + TAPE_WIDTH, min(side * a, side * b), max(side * a, side * b), *heights)
        for side in (1, -1)
        for at in tape_places(moulds)
        for a, b, heights in runs
    ]
    return (Extra(union(strips), TAPE),)


@dataclass(frozen=True)
class Prop:
    """A pad of card on the plate, against the cup: its size in mm, and each one's shape in its place."""

    thickness_mm: float
    width_mm: float
    length_mm: float
    pads: tuple[Shape, ...]


def grip_of(moulds: MouldSet) -> str:
    """Return the handle of a tongue: a printed one's grip, or the tab of tape on one that is cut."""
    return "tab" if any(tool.made == "cut" for tool in moulds.plan.of_kind("tongue")) else "grip"


def tongue_prop(moulds: MouldSet) -> Prop | None:
    """Return the pad under the tongues' grips, one on each side that tongues leave to; None without tongues."""
    lay, exit, top = moulds.plan.layout, moulds.dimensions.exit, plate_top(moulds.spec)
    if not exit or not moulds.plan.of_kind("tongue"):
        return None
    width = float(math.floor((lay.plate[0] - lay.cup[0]) / ON_PLATE))
    pads, lengths = [], []
    for side in (1, -1):
        if along := [cell.y for cell in lay.cells if side in cell.sides]:
            x0, x1 = sorted((side * lay.cup[0], side * (lay.cup[0] + width)))
            y0, y1 = min(along) - GRIP_WIDTH / 2 - 1, max(along) + GRIP_WIDTH / 2 + 1
            pads.append(box(x0, x1, y0, y1, top, exit.low))
            lengths.append(y1 - y0)
    return Prop(exit.low - top, width, max(lengths), tuple(pads))
