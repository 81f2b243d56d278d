"""The casting of a curved mould: the inner layers in their flat tools, then laid in round the limb and injected."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

from msgspec import structs

from unitcad import catalogue
from unitcad.arrays.array import Array
from unitcad.arrays.back_sheet_procedure import motors_in
from unitcad.arrays.patch_moulds import PatchMoulds
from unitcad.casting.bill import Item, bill, injecting
from unitcad.casting.figures import (
    LAY_IN_MIN,
    LIFT_MIN,
    PEEL_MIN,
    PULL_MIN,
    Batch,
)
from unitcad.casting.pouring import (
    BondFace,
    Face,
    after_pours,
    cure,
    injected,
    lid_held,
    mixed,
    motor_in,
    never_pushed,
    pour_steps,
)
from unitcad.casting.pouring import release as flat_release
from unitcad.casting.pouring import shown as grams_shown
from unitcad.casting.preparation import printing
from unitcad.casting.procedure import Procedure, pour_of, procedure, times
from unitcad.casting.steps import BenchStep
from unitcad.casting.views import picture_path, views
from unitcad.catalogue import Material
from unitcad.moulds.plan import Step
from unitcad.shape.lettering import seen
from unitcad.text import listed, number, spaced


def curved_procedure(moulds: PatchMoulds, layer_volumes_mm3: Sequence[float], printed_mm3: float) -> Procedure:
    """Return the procedure of an array that is cast round the limb: nothing is meshed or drawn.

    `layer_volumes_mm3`: of each pour, of all units together. `printed_mm3`: of all printed pieces.
    """
    flat = moulds.cast_flat
    assert flat is not None
    made, shown = procedure(flat, layer_volumes_mm3[:-1], printed_mm3), views(flat)
    spec, step = moulds.spec, moulds.plan.steps[-1]
    injected_spec = structs.replace(spec, moulds=structs.replace(spec.moulds, pour="injected"))
    under_lid = PatchMoulds(injected_spec, moulds.plan, array=moulds.array)
    known, cells = catalogue.materials(spec.materials), len(flat.plan.layout.cells)
    silicones = [known[each.material] for each in moulds.plan.steps]
    # In the words of the whole set: what is cast flat bonds later, so its cup gets no release agent.
    flat_batches = [
        Batch(moulds, each, silicone, volume, cells)
        for each, silicone, volume in zip(flat.plan.steps, silicones[:-1], layer_volumes_mm3[:-1], strict=True)
    ]
    batch = Batch(under_lid, step, silicones[-1], layer_volumes_mm3[-1], 1)
    flat_pours = tuple(
        replace(each, agent=(), steps=tuple(pour_steps(of, shown)))
        for each, of in zip(made.pours, flat_batches, strict=True)
    )
    steps = (
        *_laid_in(moulds, flat, silicones[0]),
        *_lid_on(moulds, step),
        *mixed(batch),
        *injected(batch, _picture(step, "inject")),
        cure(batch, "the bead on a vent", "layer", _picture(step, "filled")),
        _lid_off(moulds, step),
    )
    pours, prepared = (*flat_pours, pour_of(batch, steps)), (_sort(moulds), *made.preparation[1:])
    out, together = tuple(_out(moulds, silicones[0])), motors_in(tuple(motor_in(moulds, silicones)))
    every = [*prepared, *(each for one in pours for each in one.steps), *out, *together]
    grams = [v * float(s.density_g_cm3) / 1000 for v, s in zip(layer_volumes_mm3, silicones, strict=True)]
    return replace(
        made,
        name=spec.name,
        label=moulds.plan.label,
        **times(prepared, pours, out, "motors and circuit in", together),
        printing=printing(moulds, printed_mm3, max(_heights(moulds))),
        preparation=prepared,
        pours=pours,
        bonds=tuple(_bonds(moulds)),
        release=out,
        assembly=together,
        measure=tuple(_measure(moulds, grams)),
        bill=(*_bill(moulds, [*flat_batches, batch], every), *injecting([batch])),
        last="Motors and circuit in",
    )


def _picture(step: Step, name: str) -> str:
    """Return the path of a view of the last pour."""
    return picture_path(f"pour{step.index}-{name}")


def _heights(moulds: PatchMoulds) -> Iterator[float]:
    """Yield the heights of base and lid of the last pour as they are printed, mm."""
    for tool in moulds.plan.tools:
        if tool.step == len(moulds.plan.steps) and tool.made == "printed":
            _, _, low, _, _, high = moulds.mesh(tool).bounding_box()
            yield high - low


def _base(moulds: PatchMoulds) -> str:
    """Return what the base of the last pour is called."""
    return spaced(moulds.plan.base_of(moulds.plan.steps[-1]))


def _sort(moulds: PatchMoulds) -> BenchStep:
    plan, label = moulds.plan, seen(moulds.plan.label)
    last = plan.steps[-1]
    cups = listed(f"C{step.index:X} is {spaced(step.cup)}" for step in plan.steps[:-1])
    return BenchStep(
        "Sort the pieces",
        f"Print the pieces as they lie in their files, without supports. All are engraved {label}. The flat ones are "
        f"for Layer 1: the base has a b before it, and of the cups {cups}. The curved ones are for the last pour: "
        f"{_base(moulds)} has B{last.index:X} before it, {spaced(last.lid or '')} L{last.index:X}.",
        picture_path("pieces"),
        minutes=5.0,
    )


def _laid_in(moulds: PatchMoulds, flat: PatchMoulds, inner: Material) -> Iterator[BenchStep]:
    """Say how the inner layers leave their flat base and come to lie on the curved one."""
    units, base, step = len(moulds.arranged.places), _base(moulds), moulds.plan.steps[-1]
    lid = spaced(step.lid or "")
    cast = "Layer 1" if step.index == 2 else f"Layers 1 to {step.index - 1}"
    pulled = next(iter(flat_release(flat, inner)))
    yield replace(pulled, title="Filament out of the flat base", picture=picture_path("flat-filament-out"))
    yield BenchStep(
        f"{cast} out",
        f"Peel {cast} of each unit straight up off the flat base, its edge loosened with a blunt spatula. They differ "
        "in the notches of the circuit: lay each down on paper at its own place, the same way round as in the mould. "
        "Trim the flash with small scissors.",
        picture_path("flat-peel"),
        minutes=PEEL_MIN * units,
        needs=("small scissors", "blunt spatula", "paper"),
    )
    yield BenchStep(
        f"Filament into {base}",
        f"Cut {units} straight pieces of filament, {_lengths(moulds)} mm long. Hold {base} in the hand and push one "
        "up through each core from below, until its lower end is flush with the underside. Then stand it down on a "
        "flat board: it bears the filaments, so none can sink. Trim the upper end flush with the core's top with a "
        "knife.",
        _picture(step, "filament"),
        minutes=3.0 * units,
        needs=("sharp knife",),
    )
    yield BenchStep(
        f"Level {base}",
        f"Put {base} where it will stay and {lid} on it, dry. Lay a phone with its level, or a small spirit level, on "
        f"{lid}, along it and across, and put paper under a corner of {base} until it shows less than 5 degrees: so "
        f"much the vents clear (C400). Lift {lid} off again. {base.capitalize()} stays there: it is filled and cured "
        "on this spot.",
        _picture(step, "level"),
        minutes=5.0,
        needs=("level", "paper"),
    )
    yield BenchStep(
        f"Wipe {cast}",
        f"Wipe {cast} with isopropanol and let it dry. Its outside is the bond face: no release agent on it, ever, no "
        "grease, no fingers.",
        minutes=2.0 * units,
        needs=("isopropanol and lint-free wipes",),
    )
    yield BenchStep(
        f"Lay {cast} in",
        f"Lay each one over its core of {base}, at the place where it was cast: A1 on A1, its notches over the fins. "
        "Press its edge down all round until it lies on the floor of its moat and its top flat on the core: what "
        "creeps under it fills the cavity's mouth. No release agent and no grease on core or moat.",
        _picture(step, "laid-in"),
        minutes=LAY_IN_MIN * units / 2,
    )


def _lengths(moulds: PatchMoulds) -> str:
    """Return the lengths of the straight filaments, mm: along the unit's axis, from the core's top to the bench."""
    array = moulds.arranged
    radius, middle = array.radius_mm or 0.0, array.middle_radius_mm or 1.0
    bottom = moulds.plan.tool(moulds.plan.base_of(moulds.plan.steps[-1])).shape
    low = moulds.mesh_of(bottom).bounding_box()[2]
    found: Counter[str] = Counter()
    for place in array.places:
        length = radius + moulds.plan.dimensions.core_height - (radius + low) / math.cos(place.x / middle)
        found[number(math.ceil(length) + 1, 3)] += 1
    return listed(f"{count} of {length}" for length, count in found.items())


def _lid_on(moulds: PatchMoulds, step: Step) -> Iterator[BenchStep]:
    lid, base = spaced(step.lid or ""), _base(moulds)
    slit = number(moulds.spec.moulds.seat_relief_mm, 3)
    yield BenchStep(
        f"Lid {step.index} on",
        f"Draw a thin line of petroleum jelly on the curved land of {base} round the sheet's bed, near its outer edge. "
        f"Put {lid} on over the pins: one of them stands off the rectangle of the others, so it goes on one way only. "
        f"Press it down until it bears on the land all round; at both ends, beside the pins, a slit of {slit} mm stays "
        "open.",
        _picture(step, "lid-on"),
        minutes=LIFT_MIN,
        needs=("petroleum jelly",),
    )
    yield lid_held(step, _picture(step, "lid-held"))


def _lid_off(moulds: PatchMoulds, step: Step) -> BenchStep:
    return BenchStep(
        f"Lid {step.index} off",
        "Take off what held the lid down. Lay a screwdriver into the slit at either end, beside the pins, and turn "
        f"both a little at a time, until {spaced(step.lid or '')} comes free. Lift it straight up: sprue and vents "
        "tear off at the sheet. Trim them flush with a knife.",
        _picture(step, "lid-off"),
        minutes=LIFT_MIN,
        needs=("sharp knife",),
    )


def _out(moulds: PatchMoulds, inner: Material) -> Iterator[BenchStep]:
    """Describe the way from the cured sheet to a sleeve in the hand."""
    units, base = len(moulds.arranged.places), _base(moulds)
    yield BenchStep(
        "Filament out",
        f"Lift the mould off the bench and lay {base} on its side. Take each filament with pliers in its pocket and "
        f"pull it out along itself: {never_pushed(moulds.spec, inner)}",
        picture_path("filament-out"),
        minutes=PULL_MIN * units,
        needs=("narrow pliers",),
    )
    yield BenchStep(
        "Peel off",
        "Loosen the sheet's edge all round with a blunt spatula. Begin at one end: lift it, and draw each unit off its "
        "core square to the base at its place, row after row. Straight up only the middle ones come. The "
        "picture shows the way of each part; the sheet stays in one piece. Trim the flash with small scissors.",
        picture_path("peel"),
        minutes=PEEL_MIN * units,
        needs=("small scissors", "blunt spatula"),
    )


def _bonds(moulds: PatchMoulds) -> Iterator[BondFace]:
    """Yield every face of the tools that forms what bonds later."""
    *inner, last = moulds.plan.steps
    for step in inner:
        yield BondFace(Face(step.cup, "bore"), f"layer {step.index + 1}")
    yield BondFace(Face(moulds.plan.base_of(inner[0]), "core"), "motor")
    yield BondFace(Face(moulds.plan.base_of(inner[0]), "seat"), "the next layer")
    yield BondFace(Face(moulds.plan.base_of(last), "core and moat"), f"layer {last.index - 1}")


def _measure(moulds: PatchMoulds, grams: Sequence[float]) -> Iterator[str]:
    array: Array = moulds.arranged
    yield moulds.across
    yield (
        f"The sheet between the units: {grams_shown(array.sheet.thickness_mm, 2)} mm thick, at its four edges and in "
        "its middle. A lid that did not sit down shows here."
    )
    weights = " + ".join(grams_shown(each) for each in grams) + f" = {grams_shown(sum(grams))}"
    yield f"Weigh one {moulds.makes}, trimmed, without motors and circuit: {weights} g. Less means air."


def _bill(moulds: PatchMoulds, batches: Sequence[Batch], steps: Sequence[BenchStep]) -> Iterator[Item]:
    """Yield the bill of the whole set, its filaments told apart: bent ones, and straight ones."""
    places = len(moulds.arranged.places)
    for item in bill(moulds, batches, steps, after_pours(moulds, [batch.silicone for batch in batches])):
        if item.item == "filament stub":
            size = f"{number(moulds.spec.moulds.filament_mm, 3)} mm printer filament"
            yield replace(item, quantity=item.quantity - places)
            yield Item("filament stub, straight", places, "piece", "cut", f"{size}: {_lengths(moulds)} mm long")
        elif item.item == "adhesive tape":
            # The last pour is held by bands.
            yield replace(item, quantity=item.quantity * (1 - 1 / len(moulds.plan.steps)))
        else:
            yield item
