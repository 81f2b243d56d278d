"""Pry slots in a back sheet's base, seen from above: where a screwdriver lifts the cup, and frees each piece of a base.

.---[slot]-----.------[slot]-.---[slot]----.
|              |             |             |     a piece without a left or right edge has its slots at the front
[     1        |      2      |      3      ]     and at the back
|              |             |             |
'--------------'------[slot]-'-------------'
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

from unitcad.arrays.array import Box
from unitcad.arrays.larger_than_bed import intervals
from unitcad.designs.limits import filament_groove
from unitcad.designs.parts import BEYOND
from unitcad.designs.tooling import Layout
from unitcad.geometry.segments import Point
from unitcad.moulds import filament
from unitcad.moulds.base import PRY_DEPTH, PRY_HALF_WIDTH, PRY_UNDER, plate_top, pry_floor
from unitcad.moulds.cuts import BESIDE
from unitcad.moulds.dovetails import Interval, Seam
from unitcad.moulds.layout import MARK
from unitcad.moulds.pins import PIN_RADIUS
from unitcad.shape import Shape, box
from unitcad.spec import Spec

STEP = 0.5
"""Between two places that are tried for a slot, mm."""
LEAST_DEPTH = 0.8
"""Of a slot over a filament's groove, mm: the tip of a thin screwdriver still gets in (assumed)."""
Side = Literal["left", "right", "front", "back"]
_PAIRS: tuple[tuple[Side, Side], ...] = (("left", "right"), ("front", "back"))


class PrySlot(NamedTuple):
    """A slot: the piece of the base (from 1; of one that is whole 1), its side, its middle along it, its depth, mm."""

    piece: int
    side: Side
    middle: float
    depth: float

    @property
    def customary(self) -> bool:
        """Whether it is one of the two that every base has."""
        return self.side in _PAIRS[0] and self.middle == 0.0

    def taken(self, lay: Layout) -> Box:
        """Return what it takes of the plate, from under the cup to beyond the edge, mm."""
        axis = int(self.side in ("front", "back"))
        sign = 1 if self.side in ("right", "back") else -1
        low, high = sorted((sign * (lay.cup[axis] - PRY_UNDER), sign * (lay.plate[axis] + BEYOND)))
        ends = self.middle - PRY_HALF_WIDTH, self.middle + PRY_HALF_WIDTH
        return (ends[0], low, ends[1], high) if axis else (low, ends[0], high, ends[1])

    def drawn(self, lay: Layout) -> Shape:
        """Draw it in a plate whose upper face is z = 0."""
        x0, y0, x1, y1 = self.taken(lay)
        return box(x0, x1, y0, y1, -self.depth, BEYOND / 4)


class Piece(NamedTuple):
    """A piece of the base: its number, and from where to where it reaches between the teeth, along x and y (mm)."""

    number: int
    across: Interval
    along: Interval

    def sides(self, lay: Layout) -> Iterator[Side]:
        """Yield the sides of the base that it has."""
        (x, y), ends = lay.plate, (*self.across, *self.along)
        for side, end, edge in zip(("left", "right", "front", "back"), ends, (-x, x, -y, y), strict=True):
            if end == edge:
                yield side


def pieces(lay: Layout, seams: Sequence[Seam]) -> list[Piece]:
    """Return the pieces of a base that is cut at seams, row by row from the top."""
    x, y = lay.plate
    rows, columns = intervals((-y, y), seams, "y")[::-1], intervals((-x, x), seams, "x")
    return [Piece(n, column, row) for n, (row, column) in enumerate(((r, c) for r in rows for c in columns), 1)]


def pry_slots(
    spec: Spec, lay: Layout, seams: Sequence[Seam], pins: Sequence[Point], hole: float
) -> tuple[tuple[PrySlot, ...], str]:
    """Return the slots of a base, and why a piece of it can't be freed, "" where all can.

    A slot stands in the middle of the left and of the right edge. A piece that has neither of the two gets its own:
    at its left and right edge, or at the front and the back. `pins` that stand already have holes of the radius
    `hole` (mm).
    """
    depth = plate_top(spec) - pry_floor(spec)
    found: list[PrySlot] = []
    for piece in pieces(lay, seams):
        sides = set(piece.sides(lay))
        own = [
            PrySlot(piece.number, side, 0.0, depth)
            for side in ("right", "left")
            if side in sides and piece.along[0] < 0.0 < piece.along[1]
        ]
        for pair in () if own else _PAIRS:
            own = own or [slot for side in pair if side in sides for slot in _at(spec, lay, piece, side, pins, hole)]
        if not own:
            what = "has no edge of the base" if not sides else "has no room at its edges"
            return tuple(
                found
            ), f"piece {piece.number} of the base {what} for a pry slot, and nothing would lever it off"
        found += own
    return tuple(found), ""


def _at(
    spec: Spec, lay: Layout, piece: Piece, side: Side, pins: Sequence[tuple[float, float]], hole: float
) -> Iterator[PrySlot]:
    """Yield the slot at a piece's side, the nearest to its middle that leaves room for a pin beside it; or none."""
    axis = int(side in ("left", "right"))
    ends, edge = (piece.along if axis else piece.across), lay.plate[axis]
    low, high = (end + sign * (BESIDE if abs(end) < edge else MARK) for end, sign in zip(ends, (1, -1), strict=True))
    near = PRY_HALF_WIDTH + hole + spec.moulds.least_wall_mm
    sign = 1 if side in ("right", "back") else -1
    standing = [pin[axis] for pin in pins if sign * pin[1 - axis] > 0]
    count = math.floor((high - low - 2 * PRY_HALF_WIDTH) / STEP + 1e-9)
    places = (low + PRY_HALF_WIDTH + STEP * i for i in range(count + 1))
    for middle in sorted(places, key=lambda place: (abs(place - (low + high) / 2), place)):
        beside = (ends[0] + 2 * PIN_RADIUS < middle - near, middle + near < ends[1] - 2 * PIN_RADIUS)
        depth = _depth(spec, lay, side, middle)
        if any(beside) and depth and all(abs(middle - pin) >= near for pin in standing):
            yield PrySlot(piece.number, side, middle, depth)
            return


def _depth(spec: Spec, lay: Layout, side: Side, middle: float) -> float:
    """Return a slot's depth, mm: less where a filament's groove lies under it; 0 where it would be too little."""
    moulds, wall = spec.moulds, spec.moulds.least_wall_mm
    most = moulds.plate_mm
    if side == "front":
        grooves = (filament.groove(spec, lay, cell) for cell in lay.cells)
        reach = PRY_HALF_WIDTH + wall
        if any(x0 - reach < middle < x1 + reach and y0 < -lay.cup[1] for x0, y0, x1, _ in grooves):
            most -= filament_groove(spec)
    depth = min(PRY_DEPTH, most - wall)
    # The floor on a whole layer from the plate's lower face.
    floor = math.ceil((moulds.plate_mm - depth) / moulds.layer_mm - 1e-6) * moulds.layer_mm
    return moulds.plate_mm - floor if moulds.plate_mm - floor >= LEAST_DEPTH - 1e-6 else 0.0
