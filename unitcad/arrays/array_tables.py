"""The tables of an array file as typed. Lengths in mm, the unit in each name.

None means that the key is missing; `unitcad.arrays.array` has the same array with every value there. The keys of
`[layout]` depend on its kind; each kind's file in `unitcad.arrays.layouts` has its table.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal

from msgspec import Meta

from unitcad.catalogue import entries as kinds
from unitcad.catalogue.entries import between
from unitcad.spec.raw import CastingTable, EstimateTable, Length, MouldsTable, OutputTable, Table

Construction = Literal["pockets", "back-sheet"]
Cast = Literal["flat", "curved"]
Name = Annotated[str, Meta(min_length=1, max_length=200)]
_UNIT = "a template, a spec file, or a table: the keys of a spec, with like = a template or file for the others"


class PlaceTable(Table, frozen=True, kw_only=True):
    """One place of the layout that differs from the others."""

    at: Annotated[
        tuple[int, int] | str, Meta(description="name of the place, such as B2, or [column, row] counted from 1")
    ]
    unit: Annotated[Name | dict[str, Any] | None, Meta(description="another unit in this place (only in pockets)")] = (
        None
    )
    angle_deg: Annotated[
        Annotated[float, between(-360, 360)] | None,
        Meta(description="turn of the unit; default: the nearest free way for its tail"),
    ] = None


class LimbTable(Table, frozen=True, kw_only=True):
    """The limb that wears the array."""

    radius_mm: Annotated[
        Annotated[float, between(10, 1000)] | None, Meta(description="radius of the limb; default: flat")
    ] = None
    cast: Annotated[Cast, Meta(description="flat: cast flat and bent; curved: a back sheet cast around the limb")] = (
        "flat"
    )


class SheetTable(Table, frozen=True, kw_only=True):
    """The silicone sheet between the units, with slots for straps."""

    material: Annotated[
        str | None, Meta(description="silicone of the sheet; default: that of the units' outer layer")
    ] = None
    thickness_mm: Annotated[
        Annotated[float, between(0.5, 50)] | None,
        Meta(description="thickness of the sheet; default: 2 for pockets, 1.25 for a back sheet"),
    ] = None
    margin_mm: Annotated[float, between(1, 200, "distance from the outer units to the edge or to the strap slot")] = 3.0
    corner_mm: Annotated[
        Annotated[float, between(0.5, 200)] | None,
        Meta(description="radius of the corners; default: concentric with the corner units"),
    ] = None
    strap_slot_mm: Annotated[
        tuple[Annotated[Length, Meta(title="width")], Annotated[Length, Meta(title="length")]] | None,
        Meta(description="width along x and length along y of the slot at either end"),
    ] = None
    strap_web_mm: Annotated[float, between(1, 200, "silicone between a strap slot and the end of the sheet")] = 5.0
    hold_mm: Annotated[
        Annotated[float, between(0.01, 5)] | None,
        Meta(description="difference of the radii of unit and pocket; default: 0.2 for pockets"),
    ] = None


class CircuitTable(Table, frozen=True, kw_only=True):
    """The common flexible circuit: rows along one axis, a spine across them, and a tail."""

    rows: Annotated[Literal["x", "y"], Meta(description="axis of the rows")] = "x"
    row_width_mm: Annotated[Length, Meta(description="width of rows, spine and tail")] = 3.0
    spine_mm: Annotated[
        Annotated[float, between(-1000, 1000)] | None,
        Meta(description="place at which the spine crosses the rows; default: the free gap nearest to the middle"),
    ] = None
    tail_mm: Annotated[float, between(0, kinds.LONGEST_MM, "length of the tail beyond the sheet's edge")] = 10.0
    corner_mm: Annotated[float, between(0.2, 20, "radius of the outline's inner corners")] = 1.0


class AskedArray(Table, frozen=True, kw_only=True):
    """An array of units. `moulds`, `casting`, `estimate` and `output` override those of its units."""

    removed: ClassVar = {"body": "limb"}
    name: Annotated[
        str, Meta(min_length=1, max_length=120, description="a name of the array; the result's folder begins with it")
    ]
    array: Annotated[
        Construction, Meta(description="construction: units in pockets of a sheet, or cast together with a back sheet")
    ]
    unit: Annotated[Name | dict[str, Any], Meta(description=_UNIT)]
    layout: Annotated[dict[str, Any], Meta(description="kind, and the keys of that kind")]
    place: tuple[PlaceTable, ...] = ()
    limb: LimbTable = LimbTable()
    sheet: SheetTable = SheetTable()
    circuit: CircuitTable | None = None
    moulds: MouldsTable = MouldsTable()
    casting: CastingTable = CastingTable()
    estimate: EstimateTable = EstimateTable()
    output: OutputTable = OutputTable()


Pitch = Annotated[float, between(1, kinds.LONGEST_MM)]
