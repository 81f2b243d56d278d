"""The casting of an array with pockets: the units by their own procedures, the sheet in its tray, the units put in."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import groupby

from unitcad import catalogue
from unitcad.arrays.array import Array
from unitcad.arrays.hidden_tails import hidden_tails, longer_tails, where_they_end
from unitcad.arrays.layouts import layouts
from unitcad.arrays.patch_moulds import PatchMoulds
from unitcad.arrays.pocket_bill import castings, counts, pocket_bill
from unitcad.arrays.tray import hold_strain
from unitcad.casting.bill import mould_plates
from unitcad.casting.figures import PEEL_MIN, Batch
from unitcad.casting.pouring import cure, mixed, shown, struck
from unitcad.casting.preparation import cleaning, fall, joining, level, printing
from unitcad.casting.procedure import Procedure, pour_of
from unitcad.casting.steps import BenchStep, Phase, duration, phases
from unitcad.casting.views import picture_path
from unitcad.meshcheck.findings import counted
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.lettering import seen
from unitcad.text import listed, number

PUSH_MIN = 1.0
"""To push one unit into its pocket and turn it (assumed)."""
SOLDER_MIN = 3.0
"""To solder wires to one tail (assumed)."""


def pocket_procedure(
    moulds: PatchMoulds, sheet_mm3: float, printed_mm3: float, units: Mapping[str, Procedure]
) -> Procedure:
    """Return the procedure of an array whose units are cast apart.

    `sheet_mm3`: volume of the sheet. `printed_mm3`: of tray and blade. `units`: the procedure of each distinct unit
    by its folder, in the order of `Array.units`.
    """
    array, spec, (step,) = moulds.arranged, moulds.spec, moulds.plan.steps
    silicone = catalogue.materials(spec.materials)[step.material]
    batch = Batch(moulds, step, silicone, sheet_mm3, 1)
    cast = tuple(_units(array, units))
    prepared = (
        BenchStep("Sort the pieces", _sort(moulds), picture_path("pieces"), minutes=5.0),
        *cleaning(moulds, [silicone]),
        *joining(moulds),
        # The sheet must not get thinner at one end by more than a dent.
        level(
            f"{fall(moulds)}. Put the tray where it will stay. Lay a phone with its level, or a small spirit level, on "
            "the cores, which are as high as the wall, along the tray and across, and put paper under a corner until "
            "it shows less. The tray stays there: it is poured and cured on this spot."
        ),
    )
    poured = (
        *mixed(batch),
        *struck(
            batch,
            "Pour in a thin thread, first along the wall and round every core, until the tray stands over its rim and "
            "the cores are covered. Prick the bubbles that you see with a pin.",
            "Strike off along the rim with the blade upright, its narrow edge down, in one slow stroke from end to "
            "end: it runs on rim and cores. What it takes goes into the groove.",
            " The film that it leaves on the cores cures too and is trimmed at the end.",
            len(array.places),
            1,
            picture_path,
        ),
        cure(batch, "the silicone in the groove", "sheet", picture_path("filled")),
    )
    out = tuple(_out(moulds))
    together = tuple(_together(array, moulds))
    sheet = [("sheet: preparation", prepared), ("sheet: pour", poured), ("sheet: out of the mould", out)]
    until = _side_by_side(phases([("units", cast)]), phases(sheet), _first_cure(units))
    finish = max(phase.end_min for phase in until)
    line = (*until, *_later(phases([("units in", together)]), finish))
    pour = replace(pour_of(batch, poured), layer="sheet")
    grams = sheet_mm3 * float(silicone.density_g_cm3) / 1000
    return Procedure(
        name=array.name,
        label=moulds.plan.label,
        cells=1,
        vacuum=spec.casting.vacuum,
        tunnels=(),
        earliest_finish_min=finish,
        bench_min=sum(phase.bench_min for phase in until),
        time_line=line,
        printing=tuple(_printing(moulds, printed_mm3, array, units)),
        preparation=(*cast, *prepared),
        off_grid=(),
        unit_heights=(),
        pours=(pour,),
        bonds=(),
        release=out,
        assembly=together,
        measure=tuple(_measure(array, grams, units)),
        eccentricity=None,
        without_ribs=None,
        walls=(),
        bill=pocket_bill(moulds, batch, [*prepared, *poured, *out, *together], units),
        makes="sheet",
        last="Units in",
    )


def _first_cure(units: Mapping[str, Procedure]) -> float:
    """Return when the first pour of the first units cures, min: until then the bench is theirs."""
    first = next(iter(units.values()), None)
    poured = first and next((phase for phase in first.time_line if phase.name == "pour 1"), None)
    return poured.end_min - 60 * first.pours[0].cure_h if first and poured else 0.0


def _later(line: Iterable[Phase], by: float) -> tuple[Phase, ...]:
    """Return phases that begin later."""
    return tuple(replace(phase, start_min=phase.start_min + by) for phase in line)


def _side_by_side(units: Iterable[Phase], sheet: Iterable[Phase], after: float) -> tuple[Phase, ...]:
    """Return the phases of units and sheet in the order of their beginnings; the sheet's begin `after` so long."""
    return tuple(sorted((*units, *_later(sheet, after)), key=lambda phase: phase.start_min))


def _units(array: Array, units: Mapping[str, Procedure]) -> Iterator[BenchStep]:
    """Say how the units are made first: by their own procedures, as often as their mould has to be filled."""
    for i, (count, (folder, unit)) in enumerate(zip(counts(array), units.items(), strict=True)):
        times = castings(count, unit)
        cavities = "one cavity" if unit.cells == 1 else f"{unit.cells} cavities"
        filled = "one casting" if times == 1 else f"{times} castings, one after the other,"
        take = "takes" if times == 1 else "take"
        whole, bench = unit.time_line[-1].end_min, sum(phase.bench_min for phase in unit.time_line)  # motors in
        # One sheet is cast, beside the first of them.
        after = duration(_first_cure(units)) if not i else ""
        beside = f"Begin the sheet beside them, while their first pour cures, {after} from now." if after else ""
        more = "" if unit.cells >= count else " More cavities (moulds.cavities) or a second set of moulds save days."
        yield BenchStep(
            "Cast the units",
            f"Cast {count} of {unit.name} by {folder}/casting.md, motors in: {filled} in moulds of {cavities} {take} "
            f"{duration(times * whole)}, of which {duration(times * bench)} at the bench. "
            f"{beside}{more} Try every motor.",
            kind="cure",
            minutes=times * bench,
            wait_min=times * (whole - bench),
        )


def _sort(moulds: PatchMoulds) -> str:
    tray, files = (
        listed(f"moulds/{piece.name}.stl" for piece in moulds.plan.pieces_of("base")),
        listed(mould_plates(moulds)),
    )
    return (
        f"Print tray ({tray}){_and_blade(moulds)} as they lie in {files}, without supports. The tray is engraved "
        f"{seen(f'B{moulds.plan.label}')}."
    )


def _and_blade(moulds: PatchMoulds) -> str:
    """Name the blade where it is printed too."""
    return " and blade" * all(blade.made == "printed" for blade in moulds.plan.of_kind("blade"))


def _printing(moulds: PatchMoulds, solid_mm3: float, array: Array, folders: Iterable[str]) -> Iterator[str]:
    yield from printing(moulds, solid_mm3)
    of_units = zip(folders, array.units, strict=True)
    files = (f"{folder}/{file}" for folder, unit in of_units for file in mould_plates(MouldSet(unit)))
    yield f"The units' moulds: {listed(files)}, as their casting.md says."


def _out(moulds: PatchMoulds) -> Iterator[BenchStep]:
    thick = number(moulds.arranged.sheet.thickness_mm, 3)
    yield BenchStep(
        "Peel off",
        "Cut the sheet free from the groove's silicone along the land. Loosen a corner with a blunt spatula and peel "
        f"the sheet off slowly, up over the cores: it is {thick} mm thick and tears at a notch. Trim the flash round "
        "the pockets and strap slots with small scissors.",
        picture_path("peel"),
        minutes=PEEL_MIN * 2,
        needs=("small scissors", "blunt spatula"),
    )


def _together(array: Array, moulds: PatchMoulds) -> Iterator[BenchStep]:
    """Say how the units go in, and which way each one's tail points."""
    if hidden := hidden_tails(array):
        yield BenchStep(
            "Wires on hidden tails",
            f"{counted(len(hidden), 'tail')} would end under the sheet, {where_they_end(hidden)}. Nothing can be "
            "joined to them once the units are in. Solder wires to the end of each now, longer than this way by what "
            "the connector needs, and try the motor again. They leave between sheet and skin. Longer tails need none "
            f"where the way is free. {longer_tails(hidden)}",
            minutes=SOLDER_MIN * len(hidden),
            needs=("soldering iron and solder",),
        )
    strains = {unit.diameter_mm: hold_strain(unit.diameter_mm / 2, array.sheet.hold_mm) for unit in array.units}
    stretch = listed(f"{number(100 * one, 2)} % round {number(size, 3)} mm" for size, one in sorted(strains.items()))
    ordered = sorted(array.places, key=lambda place: place.angle_deg)
    ways = listed(
        f"{number(angle, 3)} degrees: {' '.join(place.name for place in places)}"
        for angle, places in groupby(ordered, key=lambda place: place.angle_deg)
    )
    turned = (
        " Turn each one until its tail points where it belongs. Angles count counter-clockwise from the way along a "
        f"row to the right, seen from the back: {ways}."
        if any(unit.fpcb or unit.wires for unit in array.units)
        else ""
    )
    over = number(array.sheet.low, 3)
    names = layouts()[array.layout["kind"]].naming
    yield BenchStep(
        "Units in",
        f"Lay the sheet down with its back up, as it came out of the tray. Push each unit up into its pocket from "
        f"below, back first, until the pocket's lower edge stands {over} mm over the unit's skin side all round: the "
        f"pocket stretches by {stretch} and holds it. Water with a drop of soap helps; it dries.{turned} {names}",
        picture_path("units-in"),
        minutes=PUSH_MIN * len(array.places),
    )


def _measure(array: Array, grams: float, units: Mapping[str, Procedure]) -> Iterator[str]:
    sheet = array.sheet
    yield f"Thickness of the sheet: {shown(sheet.thickness_mm, 2)} mm, at the middle and at the corners."
    for size in sorted({unit.diameter_mm for unit in array.units}):
        yield f"A pocket for a unit of {shown(size, 2)} mm: {shown(size - 2 * sheet.hold_mm, 2)} mm across."
    yield f"Weigh the sheet, trimmed: {shown(grams)} g. Less means air or a low strike."
    yield "Each unit as its own procedure says, before it goes in."
