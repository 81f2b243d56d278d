"""The requested array: the tables of an array file. Lengths in mm, the unit in each name.

None means that the key is left out; `unitcad.arrays.array` has the same array with every value there. The keys of
`[layout]` depend on its kind; each kind's file in `unitcad.arrays.layouts` has its table.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta

from unitcad.catalogue import entries as kinds
from unitcad.spec.asked import CastingTable, EstimateTable, Length, MouldsTable, OutputTable, Table

Construction = Literal["pockets", "back-sheet"]
Cast = Literal["flat", "curved"]
Name = Annotated[str, Meta(min_length=1, max_length=200)]
_UNIT = "a template, a spec file, or a table: the keys of a spec, with like = a template or file for the others"


class PlaceTable(Table, frozen=True, kw_only=True):
    """One place of the layout that differs: `at` is its name ("B2"), or [column, row], counted from 1."""

    at: tuple[int, int] | str
    unit: Annotated[Name | dict[str, Any] | None, Meta(description="another unit there (pockets only)")] = None
    angle_deg: Annotated[
        Annotated[float, Meta(ge=-360, le=360)] | None,
        Meta(description="how far the unit is turned; left out, its tail finds the nearest free way"),
    ] = None


class BodyTable(Table, frozen=True, kw_only=True):
    """What the array is worn on: flat where no radius is given, else a cylinder; cast flat and bent, or cast curved."""

    radius_mm: Annotated[Annotated[float, Meta(ge=10, le=1000)] | None, Meta(description="left out: flat")] = None
    cast: Cast = "flat"


class SheetTable(Table, frozen=True, kw_only=True):
    """The silicone between the units: thickness, margin round the units, corners and slots for straps."""

    material: Annotated[str | None, Meta(description="left out, that of the units' outer layer")] = None
    thickness_mm: Annotated[
        Annotated[float, Meta(ge=0.5, le=50)] | None, Meta(description="left out, 2 for pockets, 1.25 for a back sheet")
    ] = None
    margin_mm: Annotated[float, Meta(ge=1, le=200, description="from the outer units to the edge or strap slot")] = 3.0
    corner_mm: Annotated[
        Annotated[float, Meta(ge=0.5, le=200)] | None, Meta(description="radius; left out, round the corner units")
    ] = None
    strap_slot_mm: Annotated[
        tuple[Annotated[Length, Meta(title="width")], Annotated[Length, Meta(title="length")]] | None,
        Meta(description="width along x and length along y, one at either end"),
    ] = None
    strap_web_mm: Annotated[float, Meta(ge=1, le=200, description="from a strap slot to the end of the sheet")] = 5.0
    hold_mm: Annotated[
        Annotated[float, Meta(ge=0.01, le=5)] | None,
        Meta(description="how much smaller than the unit's a pocket's radius is; left out, 0.2 for pockets"),
    ] = None


class CircuitTable(Table, frozen=True, kw_only=True):
    """The common flexible circuit: rows along one axis, joined by a spine across them, which leaves as a tail."""

    rows: Literal["x", "y"] = "x"
    row_width_mm: Length = 3.0
    spine_mm: Annotated[
        Annotated[float, Meta(ge=-1000, le=1000)] | None,
        Meta(description="where the spine crosses the rows; left out, in the free gap nearest to the array's middle"),
    ] = None
    tail_mm: Annotated[float, Meta(ge=0, le=kinds.LONGEST_MM, description="of the tail, beyond the sheet's edge")] = (
        10.0
    )
    corner_mm: Annotated[float, Meta(ge=0.2, le=20, description="radius of the outline's inner corners")] = 1.0


class AskedArray(Table, frozen=True, kw_only=True):
    """An array of units as asked for. `moulds`, `casting`, `estimate` and `output` override those of its units."""

    name: Annotated[str, Meta(min_length=1, max_length=120)]
    array: Construction
    unit: Annotated[Name | dict[str, Any], Meta(description=_UNIT)]
    layout: Annotated[dict[str, Any], Meta(description="kind, and the keys of that kind")]
    place: tuple[PlaceTable, ...] = ()
    body: BodyTable = BodyTable()
    sheet: SheetTable = SheetTable()
    circuit: CircuitTable | None = None
    moulds: MouldsTable = MouldsTable()
    casting: CastingTable = CastingTable()
    estimate: EstimateTable = EstimateTable()
    output: OutputTable = OutputTable()


Pitch = Annotated[float, Meta(ge=1, le=kinds.LONGEST_MM)]
