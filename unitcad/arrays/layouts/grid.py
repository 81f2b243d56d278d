"""A grid of columns along x and rows along y."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from unitcad.arrays.array_tables import Pitch
from unitcad.arrays.layouts import LayoutKind, Point, named, needs
from unitcad.designs.limits import up
from unitcad.errors import Refusal
from unitcad.spec import convert
from unitcad.spec.raw import Table

Count = Annotated[int, Meta(ge=1, le=100)]


class GridTable(Table, frozen=True, kw_only=True):
    """Columns and rows; `pitch_mm` along x and y, or one for both."""

    kind: Literal["grid"] = "grid"
    columns: Annotated[Count, Meta(description="number of columns")]
    rows: Annotated[Count, Meta(description="number of rows")]
    pitch_mm: Annotated[
        float | tuple[Pitch, Pitch], Meta(description="distance between neighbours: one number, or [x, y]")
    ]  # a Pitch next to the tuple crashes msgspec 0.22: `_OnePitch` has its limits

    @property
    def pitches(self) -> tuple[float, float]:
        """The pitch along x and along y, mm."""
        return self.pitch_mm if isinstance(self.pitch_mm, tuple) else (self.pitch_mm, self.pitch_mm)


class _OnePitch(Table, frozen=True):
    """A pitch along both axes."""

    pitch_mm: Pitch


def points(table: GridTable, radius: float | None) -> tuple[Point, ...]:
    """Return the grid's points by rows from the top, columns along x."""
    across, along = table.pitches
    if not isinstance(table.pitch_mm, tuple):
        convert({"pitch_mm": table.pitch_mm}, _OnePitch, "layout")
    return tuple(
        Point(
            named(row, column),
            (column - (table.columns - 1) / 2) * across,
            ((table.rows - 1) / 2 - row) * along,
            row,
            column,
        )
        for row in range(table.rows)
        for column in range(table.columns)
    )


def wider(table: GridTable, radius: float | None, pair: tuple[Point, Point], distance: float) -> Refusal:
    """Refuse the pitch of a row or of a column."""
    axis = 0 if pair[0].row == pair[1].row else 1
    both = isinstance(table.pitch_mm, tuple)
    field = f"layout.pitch_mm.{axis}" if both else "layout.pitch_mm"
    return Refusal(field, table.pitches[axis], needs(distance, pair), up(distance))


LAYOUT = LayoutKind("grid", "columns and rows", GridTable, points, wider)
