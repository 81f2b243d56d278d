"""The tape that holds an open cup down on its base: where its strips stick, and how they are drawn."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

from unitcad.casting.bench_extras import TAPE, Extra
from unitcad.moulds.base import PRY_HALF_WIDTH
from unitcad.moulds.layout import CORNER_RADIUS, MARK
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape import Shape, box, union

if TYPE_CHECKING:
    from unitcad.moulds.dovetails import Axis, Interval, Split

BESIDE = 3.0
"""From a filament's middle to tape, mm."""
HELD = 60.0
"""Length of a cup's side that one strip of tape holds down, mm (assumed)."""
TAPE_WIDTH, TAPE_THICKNESS, BELOW_RIM = 8.0, 0.4, 0.8


def tape_places(moulds: MouldSet) -> tuple[float, ...]:
    """Return where the strips of tape on the front and the back of a cup begin along x, mm.

    One for each `HELD` mm of it, the outer two at its ends, the others beside filaments, which leave in the middle.
    Each piece of a split tool that reaches these sides has one; where it is too narrow, the strip reaches over a seam.
    """
    plan, half = moulds.plan, moulds.plan.layout.cup[0]
    left, right, count = CORNER_RADIUS - half, half - MARK - TAPE_WIDTH, math.ceil(2 * half / HELD)
    if count == 1 and not _across(plan.splits, "x"):
        return (left,)
    beside = [at for cell in plan.layout.cells for at in (cell.x + BESIDE, cell.x - BESIDE - TAPE_WIDTH)]
    free = [at for at in beside if all(not at < cell.x < at + TAPE_WIDTH for cell in plan.layout.cells)]

    def nearest(wanted: float, among: list[float]) -> float:
        return min(among, key=lambda at: (abs(at - wanted), at))

    inner = [left + (right - left) * i / (count - 1) for i in range(1, count - 1)]
    places = {left, right, *(nearest(wanted, free) for wanted in inner if free)}
    seams = sorted({seam.at for split in plan.splits for seam in split.seams if seam.across == "x"})
    for low, high in pairwise((-half, *seams, half)):
        there = [at for at in free if low <= at <= high - TAPE_WIDTH]
        if there and not any(low <= at <= high - TAPE_WIDTH for at in places):
            places.add(nearest((low + high - TAPE_WIDTH) / 2, there))
    for low, high in _pieces(plan.splits, "x", half):
        if free and not any(low <= at <= high - TAPE_WIDTH for at in places):
            places.add(_most_on((low, high), free))
    return tuple(sorted(places))


def side_places(moulds: MouldSet) -> tuple[float, ...]:
    """Return where strips on the two other sides begin along y, mm: for pieces in rows between others, clear of slots.

    () where every piece that has an outer edge reaches the front or the back.
    """
    half = moulds.plan.layout.cup[1]
    places: set[float] = set()
    beside = PRY_HALF_WIDTH + 1.0
    for low, high in _pieces(moulds.plan.splits, "y", half):
        middle = (low + high - TAPE_WIDTH) / 2
        choices = [at for at in (middle, beside, -beside - TAPE_WIDTH) if not -beside - TAPE_WIDTH < at < beside]
        if low > -half and high < half:
            places.add(_most_on((low, high), choices))
    return tuple(sorted(places))


def tape(moulds: MouldSet, step: Step) -> tuple[Extra, ...]:
    """Draw the strips of tape on a pour's cup: its wall, the plate, the plate's edge and underside."""
    lay = moulds.plan.layout
    (bottom, top), thick = moulds.plate, TAPE_THICKNESS
    strips: list[Extra] = []
    for axis, places in ((1, tape_places(moulds)), (0, side_places(moulds))):
        cup, plate = lay.cup[axis], lay.plate[axis]
        runs = [
            (cup, cup + thick, top, step.rim - BELOW_RIM),
            (cup, plate + thick, top, top + thick),
            (plate, plate + thick, bottom - thick, top + thick),
            (plate - 5.0, plate + thick, bottom - thick, bottom),
        ]
        for side in (1, -1) if places else ():
            boxes = [
                _strip(axis, at, min(side * a, side * b), max(side * a, side * b), low, high)
                for at in places
                for a, b, low, high in runs
            ]
            strips.append(Extra(union(boxes), TAPE))
    return tuple(strips)


def _strip(axis: int, at: float, near: float, far: float, low: float, high: float) -> Shape:
    """Draw a stretch of tape that begins at `at` along the side, from `near` to `far` square to it (`axis`)."""
    end = at + TAPE_WIDTH
    return box(at, end, near, far, low, high) if axis else box(near, far, at, end, low, high)


def _across(splits: Sequence[Split], axis: Axis) -> bool:
    """Tell whether a tool is cut across an axis."""
    return any(seam.across == axis for split in splits for seam in split.seams)


def _pieces(splits: Sequence[Split], axis: Axis, half: float) -> Iterator[Interval]:
    """Yield from where to where each piece of split tools goes along an axis, at the two edges along it."""
    for split in splits:
        lines = [seam.line for seam in split.seams if seam.across == axis]
        ends = sorted((min(line[0][0], line[-1][0]), max(line[0][0], line[-1][0])) for line in lines)
        yield from ((a[1], b[0]) for a, b in pairwise([(-half, -half), *ends, (half, half)]))


def _most_on(piece: Interval, places: Sequence[float]) -> float:
    """Return the place whose strip lies most on a piece, the nearest to its middle of those alike."""
    low, high = piece

    def rank(at: float) -> tuple[float, float, float]:
        return max(low - at, at + TAPE_WIDTH - high, 0.0), abs(at + TAPE_WIDTH / 2 - (low + high) / 2), at

    return min(places, key=rank)
