"""How an array is cast: the procedures of a back sheet, a curved mould and pockets."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import groupby

from msgspec import structs

from unitcad import catalogue
from unitcad.arrays.array import Array
from unitcad.arrays.constructions.pockets import hold_strain
from unitcad.arrays.layouts import layouts
from unitcad.arrays.patch import PatchMoulds
from unitcad.arrays.tails import covered_tails, named
from unitcad.casting.bill import Item, bill, list_consumables, list_pieces, motor_name
from unitcad.casting.figures import LAY_IN_MIN, LIFT_MIN, PEEL_MIN, PULL_MIN, Batch
from unitcad.casting.plates import mould_plates
from unitcad.casting.pouring import (
    after_pours,
    cure,
    injection_steps,
    lid_held,
    mixing_steps,
    motor_in,
    pour_steps,
    shown,
    struck,
)
from unitcad.casting.pouring import release as flat_release
from unitcad.casting.pouring import shown as grams_shown
from unitcad.casting.preparation import Printing, Size, cleaning, fall, joining, level, printing
from unitcad.casting.procedure import Procedure, pour_of, procedure, times
from unitcad.casting.sentences import say, written
from unitcad.casting.steps import REQUIRED_TOOLS, BenchStep, Phase, duration, phases
from unitcad.casting.troubles import troubles
from unitcad.casting.views import picture_path, pour_picture
from unitcad.catalogue import Material
from unitcad.designs.printed import OVER_ALL
from unitcad.meshcheck.findings import counted
from unitcad.moulds.heights import height_warnings, unit_heights
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape.lettering import seen
from unitcad.spec import Spec
from unitcad.text import join_words, number, spaced

say_back_sheet = partial(written, "arrays/constructions/back_sheet.toml")
say_curved = partial(written, "arrays/constructions/curved.toml")
say_pockets = partial(written, "arrays/constructions/pockets.toml")


def motors_in(steps: Sequence[BenchStep]) -> tuple[BenchStep, ...]:
    """Return the steps of the assembly, each with its own title."""
    solder, lay_in, cure = steps
    return (
        replace(solder, title=say_back_sheet("motor_in.solder")),
        replace(lay_in, title=say_back_sheet("motor_in.lay_circuit")),
        cure,
    )


def curved_procedure(moulds: PatchMoulds, layer_volumes_mm3: Sequence[float], printed_mm3: float) -> Procedure:
    """Return the procedure of an array that is cast round the limb; volumes as for `array_procedure`."""
    flat = moulds.inner
    assert flat is not None
    made = procedure(flat, layer_volumes_mm3[:-1], printed_mm3)
    spec, step = moulds.spec, moulds.plan.steps[-1]
    injected_spec = structs.replace(spec, moulds=structs.replace(spec.moulds, pour="injected"))
    under_lid = replace(moulds, spec=injected_spec)
    known, cells = catalogue.materials(spec.materials), len(flat.plan.layout.cells)
    silicones = [known[each.material] for each in moulds.plan.steps]
    # In the words of the whole set: flat castings bond later, so their cups get no release agent.
    flat_batches = [
        Batch(moulds, each, silicone, volume, cells)
        for each, silicone, volume in zip(flat.plan.steps, silicones[:-1], layer_volumes_mm3[:-1], strict=True)
    ]
    batch = Batch(under_lid, step, silicones[-1], layer_volumes_mm3[-1], 1)
    flat_pours = tuple(pour_of(each, pour_steps(each)) for each in flat_batches)
    steps = (
        *_laid_in(moulds, flat, silicones[0]),
        *_lid_on(moulds, step),
        *mixing_steps(batch),
        *injection_steps(batch, pour_picture(step.index, "inject")),
        cure(batch, say("cure.bead"), "layer", pour_picture(step.index, "filled")),
        _lid_off(moulds, step),
    )
    pours, prepared = (*flat_pours, pour_of(batch, steps)), (_sort_curved(moulds), *made.preparation[1:])
    out, together = tuple(_out_of_curved(moulds)), motors_in(tuple(motor_in(moulds, silicones)))
    every = [*prepared, *(each for one in pours for each in one.steps), *out, *together]
    grams = [v * float(s.density_g_cm3) / 1000 for v, s in zip(layer_volumes_mm3, silicones, strict=True)]
    last = [tool for tool in moulds.plan.pieces if tool.step == step.index and tool.made == "printed"]
    ends = [moulds.mesh(tool).bounding_box()[2::3] for tool in last]
    return replace(
        made,
        name=spec.name,
        label=moulds.plan.label,
        # The flat tools are those of the inner layers only.
        unit_heights=tuple(each for each in made.unit_heights if each.what != OVER_ALL),
        **times(prepared, pours, out, "motors and circuit in", together),
        printing=printing(moulds, printed_mm3, max(high - low for low, high in ends)),
        preparation=prepared,
        pours=pours,
        release=out,
        assembly=together,
        measure=tuple(_measure_curved(moulds, grams)),
        bill=tuple(_bill(moulds, [*flat_batches, batch], every)),
        last="Motors and circuit in",
    )


def _base(moulds: PatchMoulds) -> str:
    """Return the name of the last pour's base."""
    return spaced(moulds.plan.base_of(moulds.plan.steps[-1]))


def _sort_curved(moulds: PatchMoulds) -> BenchStep:
    plan, label = moulds.plan, seen(moulds.plan.label)
    last = plan.steps[-1]
    cups = ", ".join(f"{spaced(step.cup)} (C{step.index:X})" for step in plan.steps[:-1])
    return BenchStep(
        say("sort.title"),
        say_curved(
            "sort.text",
            label=label,
            cups=cups,
            base=_base(moulds),
            n=f"{last.index:X}",
            lid=spaced(last.lid or ""),
        ),
        picture_path("pieces"),
        minutes=5.0,
    )


def _laid_in(moulds: PatchMoulds, flat: MouldSet, inner: Material) -> Iterator[BenchStep]:
    """Return the steps by which the inner layers move from their flat base to the curved one."""
    units, base, step = len(moulds.array.places), _base(moulds), moulds.plan.steps[-1]
    lid = spaced(step.lid or "")
    cast = say_curved("layers_out.layer" if step.index == 2 else "layers_out.layers", last=step.index - 1)
    pulled = next(iter(flat_release(flat, inner)))
    yield replace(pulled, title=say_curved("flat_filament_out.title"), picture=picture_path("flat-filament-out"))
    yield BenchStep(
        say_curved("layers_out.title", layers=cast),
        say_curved("layers_out.text", layers=cast),
        picture_path("flat-peel"),
        minutes=PEEL_MIN * units,
        required_tools=("small scissors", "blunt spatula", "paper"),
    )
    yield BenchStep(
        say_curved("filament.title", base=base),
        say_curved("filament.text", units=units, lengths=_lengths(moulds), base=base),
        pour_picture(step.index, "filament"),
        minutes=3.0 * units,
        required_tools=("sharp knife",),
    )
    yield BenchStep(
        say_curved("level.title", base=base),
        say_curved("level.text", base=base, lid=lid),
        minutes=5.0,
        required_tools=("level", "paper"),
    )
    yield BenchStep(
        say_curved("wipe.title", layers=cast),
        say_curved("wipe.text", layers=cast),
        minutes=2.0 * units,
        required_tools=("isopropanol and lint-free wipes",),
    )
    yield BenchStep(
        say_curved("lay_in.title", layers=cast),
        say_curved("lay_in.text", base=base),
        pour_picture(step.index, "laid-in"),
        minutes=LAY_IN_MIN * units / 2,
    )


def _lengths(moulds: PatchMoulds) -> str:
    """Return the lengths of the straight filaments, mm: along the unit's axis, from the core's top to the bench."""
    array = moulds.array
    radius, middle = array.radius_mm or 0.0, array.middle_radius_mm or 1.0
    bottom = moulds.plan.tool(moulds.plan.base_of(moulds.plan.steps[-1])).shape
    low = moulds.mesh_of(bottom).bounding_box()[2]
    found: Counter[str] = Counter()
    for place in array.places:
        length = radius + moulds.plan.dimensions.core_height - (radius + low) / math.cos(place.x / middle)
        found[number(math.ceil(length) + 1, 3)] += 1
    return join_words(f"{count} of {length}" for length, count in found.items())


def _lid_on(moulds: PatchMoulds, step: Step) -> Iterator[BenchStep]:
    lid, base = spaced(step.lid or ""), _base(moulds)
    slit = number(moulds.spec.moulds.seat_relief_mm, 3)
    yield BenchStep(
        say("lid_on.title", n=step.index),
        say_curved("lid_on.text", base=base, lid=lid, slit=slit),
        pour_picture(step.index, "lid-on"),
        minutes=LIFT_MIN,
        required_tools=("petroleum jelly",),
    )
    yield lid_held(step, pour_picture(step.index, "lid-held"))


def _lid_off(moulds: PatchMoulds, step: Step) -> BenchStep:
    return BenchStep(
        say_curved("lid_off.title", n=step.index),
        say_curved("lid_off.text", lid=spaced(step.lid or "")),
        pour_picture(step.index, "lid-off"),
        minutes=LIFT_MIN,
        required_tools=("sharp knife",),
    )


def _out_of_curved(moulds: PatchMoulds) -> Iterator[BenchStep]:
    """Describe the way from the cured sheet to a sleeve in the hand."""
    units, base = len(moulds.array.places), _base(moulds)
    yield BenchStep(
        say("filament_out.title"),
        say_curved("filament_out.text", base=base),
        picture_path("filament-out"),
        minutes=PULL_MIN * units,
        required_tools=("narrow pliers",),
    )
    yield BenchStep(
        say("peel.title"),
        say_curved("peel.text"),
        picture_path("peel"),
        minutes=PEEL_MIN * units,
        required_tools=("small scissors", "blunt spatula"),
    )


def _measure_curved(moulds: PatchMoulds, grams: Sequence[float]) -> Iterator[str]:
    yield moulds.plan.across
    yield say_curved("measure.sheet", thick=grams_shown(moulds.array.sheet.thickness_mm, 2))
    weights = " + ".join(grams_shown(each) for each in grams) + f" = {grams_shown(sum(grams))}"
    yield say_curved("measure.weigh", makes=moulds.plan.makes, weights=weights)


def _bill(moulds: PatchMoulds, batches: Sequence[Batch], steps: Sequence[BenchStep]) -> Iterator[Item]:
    """Yield the bill of the whole set, with bent and straight filaments as separate items."""
    places = len(moulds.array.places)
    for item in bill(moulds, batches, steps, after_pours(moulds, [batch.silicone for batch in batches])):
        if item.item == "filament":
            filament = number(moulds.spec.moulds.filament_mm, 3)
            note = say_curved("filament.note", filament=filament, lengths=_lengths(moulds))
            yield replace(item, quantity=item.quantity - places)
            yield Item(say_curved("filament.item"), places, "piece", "cut", note)
        else:
            yield item


ONCE = frozenset((name, unit) for name, (unit, _, _) in REQUIRED_TOOLS.items())
"""Things, by name and unit, of which one piece, dab or roll is enough for every casting: a roll of tape, no strips."""


def pocket_bill(
    moulds: PatchMoulds, batch: Batch, steps: Sequence[BenchStep], units: Mapping[str, Procedure]
) -> tuple[Item, ...]:
    """Return the bill of units and sheet. `batch` and `steps`: of the sheet; `units` by their folder."""
    silicone, mix, covered = batch.silicone, batch.mix, covered_tails(moulds.array)
    net = f"sheet: {number(mix.net_g, 3)} g net"
    # A motor has two poles.
    wires = [Item("lead wire", 2 * len(covered), "piece", "bought", say_pockets("wires.item"))] if covered else []
    own = [
        *(replace(item, note=f"for the sheet: {item.note}") for item in list_pieces(moulds)),
        Item(f"{silicone.name} part A", mix.part_a_g, "g", "bought", net),
        Item(f"{silicone.name} part B", mix.part_b_g, "g", "bought", net),
        *wires,
        *list_consumables(moulds, [batch], steps),
    ]
    return tuple(_added([*_scaled(moulds.array, units), *own]))


def kinds(array: Array, units: Mapping[str, Procedure]) -> list[tuple[Spec, str, Procedure, int, int]]:
    """Return each distinct unit with its folder, procedure and places, and how often its mould has to be filled."""
    held = Counter(array.units.index(place.unit) for place in array.places)
    return [
        (spec, folder, unit, held[i], math.ceil(held[i] / unit.cells))
        for i, (spec, (folder, unit)) in enumerate(zip(array.units, units.items(), strict=True))
    ]


def _scaled(array: Array, units: Mapping[str, Procedure]) -> Iterator[Item]:
    """Yield the lines of the units' bills for all units: their pieces once, consumables as often as they are used."""
    for spec, folder, unit, count, castings in kinds(array, units):
        inside = {motor_name(spec), "flexible circuit", "wire"}
        for item in unit.bill:
            if item.made.startswith(("printed", "cut")):
                yield replace(item, note=f"for {folder}{f': {item.note}' if item.note else ''}")
            elif item.unit == "g":
                often = "1 casting" if castings == 1 else f"{castings} castings"
                yield replace(item, quantity=castings * item.quantity, note=f"{folder}, {often}: {item.note}")
            elif item.item in inside:
                yield replace(item, quantity=count * item.quantity / unit.cells)
            elif item.made == "bought" and (item.item, item.unit) not in ONCE:
                yield replace(item, quantity=castings * item.quantity)
            else:
                yield item


def _added(items: Iterable[Item]) -> list[Item]:
    """Return a bill with one line a thing: consumables are added, of reused things the largest number counts.

    A consumable in two sizes has a line for each; of a tool in two sizes the larger one remains.
    """
    found: dict[tuple[str, str, str], Item] = {}
    for item in items:
        once = (item.item, item.unit) in ONCE or item.made == "tool"
        key = item.item, item.unit, "" if item.unit == "g" or once else item.note
        there = found.get(key)
        if there is None:
            found[key] = item
        elif item.unit == "g":
            quantity, note = there.quantity + item.quantity, f"{there.note}; {item.note}"
            found[key] = replace(there, quantity=quantity, note=note)
        elif item.made == "bought" and not once:
            found[key] = replace(there, quantity=there.quantity + item.quantity)
        else:
            larger = max(there, item, key=lambda each: each.least_ml or 0.0)
            found[key] = replace(larger, quantity=max(there.quantity, item.quantity))
    return list(found.values())


PUSH_MIN = 1.0
"""To push one unit into its pocket and turn it (assumed)."""
SOLDER_MIN = 3.0
"""To solder wires to one tail (assumed)."""


def pocket_procedure(
    moulds: PatchMoulds, sheet_mm3: float, printed_mm3: float, units: Mapping[str, Procedure]
) -> Procedure:
    """Return the procedure of an array whose units are cast apart.

    `units`: the procedure of each distinct unit by its folder, in the order of `Array.units`.
    """
    array, spec, (step,) = moulds.array, moulds.spec, moulds.plan.steps
    silicone = catalogue.materials(spec.materials)[step.material]
    batch = Batch(moulds, step, silicone, sheet_mm3, 1)
    cast = tuple(_units(array, units))
    enough, level_tool = fall(moulds)
    prepared = (
        BenchStep(say("sort.title"), _sort(moulds), picture_path("pieces"), minutes=5.0),
        *cleaning(moulds, [silicone]),
        *joining(moulds),
        # The sheet must not get thinner at one end by more than a dent.
        level(
            say_pockets("level.text", enough=enough),
            level_tool,
        ),
    )
    poured = (
        *mixing_steps(batch),
        *struck(
            batch,
            say_pockets("pour.text"),
            say_pockets("strike.text"),
            say_pockets("strike.film"),
            len(array.places),
            1,
            picture_path,
        ),
        cure(batch, say("cure.groove", groove="the groove"), "sheet", picture_path("filled")),
    )
    out = tuple(_out(moulds))
    together = tuple(_together(array, moulds))
    sheet = [("sheet: preparation", prepared), ("sheet: pour", poured), ("sheet: out of the mould", out)]
    until = [*phases([("units", cast)]), *_later(phases(sheet), _first_cure(units))]
    until.sort(key=lambda phase: phase.start_min)
    finish = max(phase.end_min for phase in until)
    line = (*until, *_later(phases([("units in", together)]), finish))
    pour = replace(pour_of(batch, poured), layer="sheet")
    grams = sheet_mm3 * float(silicone.density_g_cm3) / 1000
    return Procedure(
        name=array.name,
        label=moulds.plan.label,
        cells=1,
        vacuum=spec.casting.vacuum,
        earliest_finish_min=finish,
        bench_min=sum(phase.bench_min for phase in until),
        time_line=line,
        printing=_printing(moulds, printed_mm3, units),
        preparation=(*cast, *prepared),
        unit_heights=tuple(unit_heights(moulds)),
        warnings=tuple(height_warnings(moulds)),
        pours=(pour,),
        release=out,
        assembly=together,
        measure=tuple(_measure(array, grams, units)),
        troubles=troubles(moulds),
        bill=pocket_bill(moulds, batch, [*prepared, *poured, *out, *together], units),
        makes="sheet",
        last="Units in",
        castings=sum(castings for *_, castings in kinds(array, units)),
    )


def _first_cure(units: Mapping[str, Procedure]) -> float:
    """Return when the first pour of the first units cures, min: until then the bench is theirs."""
    first = next(iter(units.values()), None)
    poured = first and next((phase for phase in first.time_line if phase.name == "pour 1"), None)
    return poured.end_min - 60 * first.pours[0].cure_h if first and poured else 0.0


def _later(line: Iterable[Phase], by: float) -> tuple[Phase, ...]:
    """Return phases that begin later."""
    return tuple(replace(phase, start_min=phase.start_min + by) for phase in line)


def _units(array: Array, units: Mapping[str, Procedure]) -> Iterator[BenchStep]:
    """Say how the units are made first: by their own procedures, as often as their mould has to be filled."""
    for i, (_, folder, unit, count, castings) in enumerate(kinds(array, units)):
        cavities = "one cavity" if unit.cells == 1 else f"{unit.cells} cavities"
        whole, bench = unit.time_line[-1].end_min, sum(phase.bench_min for phase in unit.time_line)  # motors in
        # One sheet is cast, at the same time as the first of them.
        after = duration(_first_cure(units)) if not i else ""
        yield BenchStep(
            say_pockets("units.title"),
            say_pockets(
                "units.once" if castings == 1 else "units.again",
                "units.beside" if after else "",
                "" if unit.cells >= count else "units.more",
                "units.motors",
                count=count,
                unit=unit.name,
                folder=folder,
                castings=castings,
                cavities=cavities,
                time=duration(castings * whole),
                bench=duration(castings * bench),
                after=after,
            ),
            kind="cure",
            minutes=castings * bench,
            wait_min=castings * (whole - bench),
        )


def _sort(moulds: PatchMoulds) -> str:
    tray = join_words(f"moulds/{piece.name}.stl" for piece in moulds.plan.pieces_of("base"))
    files = join_words(mould_plates(moulds))
    printed = all(blade.made == "printed" for blade in moulds.plan.of_kind("blade"))
    return say_pockets(
        "sort.tray_and_blade" if printed else "sort.tray",
        "sort.mark",
        tray=tray,
        files=files,
        mark=seen(f"B{moulds.plan.label}"),
    )


def _printing(moulds: PatchMoulds, solid_mm3: float, units: Mapping[str, Procedure]) -> Printing:
    sheet, of_units = printing(moulds, solid_mm3), [unit.printing for unit in units.values()]
    files = [f"{folder}/{plate}" for folder, unit in units.items() for plate in unit.printing.plates]
    return replace(
        sheet,
        sizes=tuple(_sizes(moulds.array, of_units)),
        plates=(*sheet.plates, *files),
        minutes=sheet.minutes + sum(each.minutes for each in of_units),
        cm3=sheet.cm3 + sum(each.cm3 for each in of_units),
        how=(*sheet.how, say_pockets("print.units", files=join_words(files))),
    )


def _sizes(array: Array, of_units: Sequence[Printing]) -> Iterator[Size]:
    """Yield the lengths of each distinct unit's bought parts, with their paths in the array's file."""
    for unit, own in zip(array.units, of_units, strict=True):
        name = f"{unit.name}: " if len(of_units) > 1 else ""
        for size in own.sizes:
            keys = tuple(path + key for path in array.paths_of(unit) for key in size.keys)
            yield replace(size, what=name + size.what, keys=keys)


def _out(moulds: PatchMoulds) -> Iterator[BenchStep]:
    thick = number(moulds.array.sheet.thickness_mm, 3)
    yield BenchStep(
        say("peel.title"),
        say_pockets("peel.text", thick=thick),
        picture_path("peel"),
        minutes=PEEL_MIN * 2,
        required_tools=("small scissors", "blunt spatula"),
    )


def _together(array: Array, moulds: PatchMoulds) -> Iterator[BenchStep]:
    """Say how the units go in, and which way each one's tail points."""
    if covered := covered_tails(array):
        yield BenchStep(
            say_pockets("wires.title"),
            say_pockets("wires.text", tails=counted(len(covered), "tail"), places=named(covered)),
            minutes=SOLDER_MIN * len(covered),
            required_tools=("soldering iron and solder",),
        )
    strains = {unit.diameter_mm: hold_strain(unit.diameter_mm / 2, array.sheet.hold_mm) for unit in array.units}
    stretch = join_words(
        f"{number(100 * one, 2)} % round {number(size, 3)} mm" for size, one in sorted(strains.items())
    )
    ordered = sorted(array.places, key=lambda place: place.angle_deg)
    ways = join_words(
        f"{number(angle, 3)} degrees: {' '.join(place.name for place in places)}"
        for angle, places in groupby(ordered, key=lambda place: place.angle_deg)
    )
    turned = any(unit.fpcb or unit.wires for unit in array.units)
    over = number(array.sheet.low, 3)
    names = layouts()[array.layout["kind"]].naming
    yield BenchStep(
        say_pockets("units_in.title"),
        say_pockets("units_in.text", "units_in.turn" if turned else "", over=over, stretch=stretch, ways=ways)
        + f" {names}",
        picture_path("units-in"),
        minutes=PUSH_MIN * len(array.places),
    )


def _measure(array: Array, grams: float, units: Mapping[str, Procedure]) -> Iterator[str]:
    sheet = array.sheet
    yield say_pockets("measure.sheet", thick=shown(sheet.thickness_mm, 2))
    for size in sorted({unit.diameter_mm for unit in array.units}):
        yield say_pockets("measure.pocket", unit=shown(size, 2), pocket=shown(size - 2 * sheet.hold_mm, 2))
    yield say_pockets("measure.weigh", grams=shown(grams))
    yield say_pockets("measure.units")


def array_procedure(
    moulds: PatchMoulds, layer_volumes_mm3: Sequence[float], printed_mm3: float, of_units: Mapping[str, Procedure]
) -> Procedure:
    """Return the procedure of an array's construction.

    layer_volumes_mm3: a volume a pour of the sheet's tools; printed_mm3: volume of these tools; of_units: the procedure
    of each distinct unit by its folder, read if units are cast apart.
    """
    way = moulds.construction
    if way.own_tails:
        return pocket_procedure(moulds, layer_volumes_mm3[0], printed_mm3, of_units)
    if way.cast == "curved":
        return curved_procedure(moulds, layer_volumes_mm3, printed_mm3)
    made = procedure(moulds, layer_volumes_mm3, printed_mm3)
    *line, last = made.time_line
    return replace(
        made,
        assembly=motors_in(made.assembly),
        time_line=(*line, replace(last, name="motors and circuit in")),
        last="Motors and circuit in",
    )
