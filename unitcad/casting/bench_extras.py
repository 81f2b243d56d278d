"""What pictures of the procedure show beside the pieces: arrows, tape, grease, paper, screwdrivers. Shapes alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from unitcad.moulds.base import outline, plate_bottom, plate_top, pry_floor
from unitcad.moulds.cup import skirt_end
from unitcad.moulds.layout import CORNER_RADIUS, MARK
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.moulds.tongue import GRIP_GAP, GRIP_LENGTH
from unitcad.shape import Extrude, Revolve, Shape, box, cut, moved, polygon, ring, rotated, turned, union

ARROW, TAPE, BAND, TOOL = (0.10, 0.36, 0.86), (0.47, 0.78, 0.86), (0.35, 0.33, 0.38), (0.80, 0.86, 0.90)
CARD, PAPER, GREASE, INK = (0.45, 0.72, 0.38), (0.96, 0.93, 0.62), (0.98, 0.72, 0.16), (0.10, 0.10, 0.12)
TAB = (0.93, 0.90, 0.78)
CLEAR = 5.0
"""Between a piece that is lifted off and what it was on, mm."""
_FILM, _MARK = 0.15, 0.6
"""Grease on a tongue, and the width of a pen's mark on it, mm."""


@dataclass(frozen=True)
class Extra:
    """Something beside the pieces: an arrow, tape, a thread of silicone; its colour as three numbers 0 to 1."""

    shape: Shape
    colour: tuple[float, float, float]


@lru_cache(maxsize=64)
def _arrow(length: float) -> Shape:
    """Draw an arrow along +z, its middle at the origin."""
    shaft, head = 0.55, 1.5
    tip = min(3.6, length / 2)
    outline = polygon((0, 0), (shaft, 0), (shaft, length - tip), (head, length - tip), (0, length))
    return moved(Revolve(outline), 0, 0, -length / 2)


def upward(x: float, y: float, z: float, length: float) -> Extra:
    """Draw an arrow upwards, its middle at (x, y, z)."""
    return Extra(moved(_arrow(length), x, y, z), ARROW)


def downward(x: float, y: float, z: float, length: float) -> Extra:
    """Draw an arrow downwards, its middle at (x, y, z)."""
    return Extra(moved(turned(_arrow(length), "x", 2), x, y, z), ARROW)


def sideways(side: int, x: float, y: float, z: float, length: float) -> Extra:
    """Draw an arrow along x to the given side, its middle at (x, y, z)."""
    return Extra(moved(turned(_arrow(length), "y", 1 if side > 0 else 3), x, y, z), ARROW)


def along(way: tuple[float, float, float], x: float, y: float, z: float, length: float) -> Extra:
    """Draw an arrow along a direction square to y, its middle at (x, y, z)."""
    return Extra(moved(rotated(_arrow(length), "y", math.degrees(math.atan2(way[0], way[2]))), x, y, z), ARROW)


def bands(x: float, y: float, low: float, high: float) -> tuple[Extra, ...]:
    """Draw two rubber bands round lid and base, near their ends at -x and x: from -y to y, from z to z."""
    bands = []
    for side in (1, -1):
        x0, x1 = sorted((side * (x - 1.0), side * (x - 3.0)))
        runs = [
            (-y - 1, y + 1, high, high + 1),
            (-y - 1, -y, low - 1, high + 1),
            (y, y + 1, low - 1, high + 1),
            (-y - 1, y + 1, low - 1, low),
        ]
        bands.append(Extra(union(box(x0, x1, *run) for run in runs), BAND))
    return tuple(bands)


def grease(moulds: MouldSet, step: Step, length: float) -> tuple[Extra, ...]:
    """Draw the greased stretch of every tongue: `length` mm beside the wall of a pour's cup."""
    lay, exit = moulds.plan.layout, moulds.dimensions.exit
    if not exit:
        return ()
    half = exit.width / 2 + _FILM
    return tuple(
        Extra(
            _between(
                side * lay.cup[0], side * (lay.cup[0] + length), cell.y, half, exit.low - _FILM, exit.high + _FILM
            ),
            GREASE,
        )
        for cell in lay.cells
        for side in cell.sides
    )


def tabs(moulds: MouldSet, out: float = 0.0) -> tuple[Extra, ...]:
    """Draw the folded tape on every tongue that is cut, where it is pulled out by `out` mm; none on printed ones."""
    lay, exit = moulds.plan.layout, moulds.dimensions.exit
    if not exit or all(tool.made != "cut" for tool in moulds.plan.of_kind("tongue")):
        return ()
    half, edge = exit.width / 2 + 0.5, max(lay.cup[0] - abs(cell.x) for cell in lay.cells) + GRIP_GAP
    return tuple(
        Extra(
            _between(
                cell.x + side * (edge + out),
                cell.x + side * (edge + out + GRIP_LENGTH + 0.5),
                cell.y,
                half,
                exit.low - _FILM,
                exit.high + _FILM,
            ),
            TAB,
        )
        for cell in lay.cells
        for side in cell.sides
    )


def punched_hole(moulds: MouldSet) -> Extra:
    """Draw the edge of the hole that makes the hollow end of the first cell's tongue, on its upper face."""
    cell, exit, radius = moulds.plan.layout.cells[0], moulds.dimensions.exit, moulds.dimensions.ledge_radius
    high = exit.high if exit else 0.0
    return Extra(moved(ring(radius - 0.1, radius, high - 0.05, high + 0.05), cell.x, cell.y), INK)


def pen_marks(moulds: MouldSet) -> tuple[Extra, ...]:
    """Draw a pen's mark on every tongue where it leaves the cup's wall."""
    lay, exit = moulds.plan.layout, moulds.dimensions.exit
    if not exit:
        return ()
    half = exit.width / 2 + _FILM / 2
    return tuple(
        Extra(_between(side * lay.cup[0], side * (lay.cup[0] + _MARK), cell.y, half, exit.low, exit.high + _FILM), INK)
        for cell in lay.cells
        for side in cell.sides
    )


def _between(x0: float, x1: float, y: float, half: float, low: float, high: float) -> Shape:
    return box(min(x0, x1), max(x0, x1), y - half, y + half, low, high)


def grease_on_rim(moulds: MouldSet, step: Step) -> Extra:
    """Draw the line of grease near the outer edge of a cup's rim, under its lid."""
    cup = moulds.plan.layout.cup
    inner = outline((cup[0] - 1.2, cup[1] - 1.2), MARK)
    ring = cut(
        Extrude(outline((cup[0] - 0.4, cup[1] - 0.4), MARK), step.rim, step.rim + 0.3),
        (Extrude(inner, step.rim - 1, step.rim + 1),),
    )
    return Extra(ring, GREASE)


def paper_in_slit(moulds: MouldSet) -> tuple[Extra, ...]:
    """Draw strips of paper in the slit between a cup's skirt and the plate, one a side."""
    spec, (x, y) = moulds.spec, moulds.plan.layout.cup
    low, high, half, out = plate_top(spec), skirt_end(spec), 3.0, 9.0
    along, across = y - CORNER_RADIUS - half, x - CORNER_RADIUS - half
    strips = [
        *(_between(s * (x - 1), s * (x + out), -along, half, low, high) for s in (1, -1)),
        *(moved(turned(box(y - 1, y + out, -half, half, low, high), "z", 1 if s > 0 else 3), -across) for s in (1, -1)),
    ]
    return tuple(Extra(strip, PAPER) for strip in strips)


def in_pry_slots(moulds: MouldSet) -> tuple[Extra, ...]:
    """Draw a screwdriver in every pry slot, its tip under the cup's skirt."""
    spec, lay, (bottom, top) = moulds.spec, moulds.plan.layout, moulds.plate
    return screwdrivers(lay.cup[0], lay.plate[0], pry_floor(spec) - plate_bottom(spec) + bottom, top)


def screwdrivers(lifted: float, edge: float, low: float, top: float) -> tuple[Extra, ...]:
    """Draw a screwdriver at either end along x, an arrow down on each handle.

    Its tip is at `low` under what is lifted, which ends at x = `lifted`, and it leaves the base at x = `edge`, whose
    upper face is at `top`.
    """
    tip, half = lifted - 1.0, 3.0
    blade = box(tip, edge + 4, -half, half, low, low + 0.9)
    handle = moved(turned(Revolve(polygon((0, 0), (2.2, 0), (2.2, 9), (0, 9))), "y", 1), edge + 4, 0, low + 0.45)
    found: list[Extra] = []
    for side in (1, -1):
        both = turned(union((blade, handle)), "z", 0 if side > 0 else 2)
        found += [
            Extra(both, TOOL),
            downward(side * (edge + 9), 0.0, low + 9, 9.0),
            upward(side * (lifted + 3), -5.0, top + 6, 9.0),
        ]
    return tuple(found)


def level_on_rim(moulds: MouldSet, z: float) -> tuple[Extra, ...]:
    """Draw a spirit level on a rim at `z`, and paper under a corner of the plate."""
    lay = moulds.plan.layout
    return spirit_level(lay.cup[0], z, lay.plate, moulds.plate[0])


def spirit_level(half: float, z: float, plate: tuple[float, float], bottom: float) -> tuple[Extra, ...]:
    """Draw a spirit level that lies along x on what is `half` wide to either side and ends at `z`.

    Paper lies under a corner of the base, whose half sizes are `plate` and whose underside is at `bottom`.
    """
    long = min(1.5 * half, 30.0)
    glass = box(-4.0, 4.0, -2.0, 2.0, z + 4.0, z + 5.0)
    x, y = plate
    return (
        Extra(box(-long, long, -4.0, 4.0, z, z + 4.5), TOOL),
        Extra(glass, (0.75, 0.93, 0.35)),
        Extra(box(-1.2, 1.2, -1.5, 1.5, z + 4.5, z + 5.3), PAPER),
        Extra(box(-x - 6, -x + 5, -y - 3, -y + 6, bottom - 0.8, bottom), PAPER),
    )
