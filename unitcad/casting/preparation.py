"""The steps from the printer to an empty mould, and what to print."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from unitcad.casting.bill import mould_plates
from unitcad.casting.figures import (
    BAKE_H,
    FDM_ERROR,
    MIXING_MIN,
    RESIN_LAYER_S,
    WEIGH_MIN,
    at_room,
    print_min,
    window_length,
)
from unitcad.casting.steps import BenchStep, duration
from unitcad.casting.views import level_on, picture_path
from unitcad.catalogue import Material
from unitcad.designs.rib_leaves import leaf_mm
from unitcad.moulds.cup import window_section
from unitcad.moulds.dents import DENT, TILT_DEG
from unitcad.moulds.layout import BLADE_HEIGHT
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.ribs import ribs
from unitcad.moulds.tongue import GRIP_GAP, GRIP_LENGTH
from unitcad.shape.lettering import seen
from unitcad.spec import MOTOR_SIZES, assumed_lengths, printer_of
from unitcad.text import listed, number, spaced

if TYPE_CHECKING:
    from unitcad.moulds.dovetails import Split

PERIMETERS = 3
SPARE = 2.0
"""What a piece of filament is longer than its way through base and core, mm."""
FOOT_MM = 0.2
PHONE_DEG = 0.1
"""What a phone's level shows (assumed)."""


def printing(moulds: MouldSet, solid_mm3: float, tallest_mm: float = 0.0) -> tuple[str, ...]:
    """Say which file to print and how, a sentence or two each. `solid_mm3`: volume of all printed pieces, solid.

    `tallest_mm`: height of a piece that may stand higher than core and blade.
    """
    spec, plan, lengths = moulds.spec, moulds.plan, moulds.spec.moulds
    printed = [tool for tool in plan.pieces if tool.made == "printed"]
    mixed = {tool.kind for tool in printed if not tool.upside_down}
    turned = listed(
        dict.fromkeys(
            spaced(t.name.partition("-")[0]) if t.kind in mixed else f"{t.kind}s" if t.step else t.kind
            for t in printed
            if t.upside_down
        )
    )
    attitude = f"{turned} upside down, the rest as drawn" if turned else "as drawn"
    files = mould_plates(moulds)
    plates = f"Plate: {next(iter(files))}"
    if len(files) > 1:
        names = (listed(plan.called(one.name).replace(",", "") for one in plate) for plate in files.values())
        there = "; ".join(f"{path} with {each}" for path, each in zip(files, names, strict=True))
        plates = f"{len(files)} plates, for one bed does not hold all: {there}"
    count = "one piece" if len(printed) == 1 else f"{len(printed)} pieces"
    standing = plan.dimensions.core_height - moulds.plate[0]
    time = print_min(spec, solid_mm3, max(standing, BLADE_HEIGHT if plan.of_kind("blade") else 0.0, tallest_mm))
    takes = f"Takes about {duration(5 * max(round(time / 5), 1))}"
    lines = [
        _measuring(moulds),
        f"{plates} ({count}; moulds/ has them singly as STL too). They lie in it as they are printed: {attitude}. "
        "Turn none of them.",
        f"Printer {lengths.printer}, layers of {number(lengths.layer_mm, 3)} mm, no supports.",
    ]
    if in_resin(moulds):
        lines += [
            f"{takes} ({number(RESIN_LAYER_S, 2)} s a layer, assumed).",
            f"At most {number(solid_mm3 / 1000, 2)} ml of resin (computed: the pieces' volume). Flat on the plate, no "
            "tilt: seats and rims are then whole layers. Compensate the first layers' growth (bottom tolerance): what "
            "grows there narrows a bore.",
        ]
    else:
        why = "jams the dovetails" if plan.splits else ""
        why = f"a first layer that is squeezed out {why}" if why else ""
        if plan.of_kind("cup"):
            why = (
                "cups lie on their rims: a first layer that is squeezed out narrows the bore where the layer's edge is"
            )
        foot = f" Elephant foot compensation {number(FOOT_MM, 3)} mm (assumed), for {why}." if why else ""
        low, high = (number(error, 2) for error in FDM_ERROR)
        lines += [
            f"{PERIMETERS} perimeters, 20 % infill (assumed). At most {number(solid_mm3 / 1000, 2)} cm3 of filament "
            f"(computed: the pieces, solid).{foot}",
            f"{takes} (by volume and layer height; PrusaSlicer's times for other sets were {low} to {high} times that, "
            "shortest for thick pieces). Time and filament, piece by piece: run unitcad build "
            f"{moulds.source} --slice -o sliced in this folder, on a machine with PrusaSlicer. The path that it prints "
            "last is the folder that has slicer.json.",
        ]
    if plan.of_kind("cup"):
        fits = ["pins (they have the play of the coupon's plinth)" if plan.pins else "plinth"]
        fits += ["tongue"] * bool(plan.of_kind("tongue")) + ["filament"] * bool(plan.of_kind("stub"))
        lines.append(
            f"First time on this printer: print the fit coupon (unitcad coupon {lengths.printer}): a print of "
            f"its own, whose time the slicer says. It shows whether {listed(fits)} fit, and gives the line for the "
            "spec where they do not."
        )
    return tuple(lines)


def _measuring(moulds: MouldSet) -> str:
    """Say what to measure before printing, and how to build again with other sizes."""
    spec = moulds.spec
    sizes = {f"motor.{size}": getattr(spec.motor, size) for size in MOTOR_SIZES}
    if spec.fpcb:
        sizes["fpcb.thickness_mm"] = spec.fpcb.thickness_mm
    if moulds.plan.of_kind("stub"):
        sizes["moulds.filament_mm"] = spec.moulds.filament_mm
    drawn = ", ".join(f"{key} = {number(value, 3)}" for key, value in sizes.items())
    assumed = assumed_lengths(spec)
    unsure = f" Nobody has measured {listed(assumed)}." if assumed else ""
    again = "run unitcad build spec.toml --set motor.thickness_mm=2.3 in this folder (one --set for each size)"
    if moulds.makes != "unit":
        again = f"change it in {moulds.source}, and run unitcad build {moulds.source} in this folder"
    return (
        f"Measure first, with calipers (mm): {drawn}.{unsure} If a size differs by more than 0.05 mm, build again with "
        f"yours before you print: {again}."
    )


def preparation(moulds: MouldSet, silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe the way from the printer to an empty mould; `silicones` are those that a resin may keep from curing."""
    spec, plan, dims, lengths = moulds.spec, moulds.plan, moulds.plan.dimensions, moulds.spec.moulds
    cups, cells, label = len(plan.steps), len(plan.layout.cells), seen(plan.label)
    own = [f"C{step.index:X} on {spaced(step.cup)}" for step in plan.steps]
    own += [f"L{step.index:X} on {spaced(step.lid)}" for step in plan.steps if step.lid]
    pieces = " Beside it each piece of a tool that is printed in several has its number." if plan.splits else ""
    marks = (
        f"{label[:2]} and {label[2:]} in two corners of {'cups and lids' if plan.of_kind('lid') else 'the cups'}, and "
        f"in a third corner {listed(own)}"
    )
    if any(len(plan.pieces_of(cup.name)) > 1 for cup in plan.of_kind("cup")):
        marks = f"{listed(own)}, and after it {label} where the piece has room"
    yield BenchStep(
        "Sort the pieces",
        f"Print the pieces as they lie in their files, without supports. Engraved are {seen('B')}{label} on the base, "
        f"{marks}.{pieces}",
        picture_path("pieces"),
        minutes=5.0,
    )
    cut = [tongue for tongue in plan.of_kind("tongue") if tongue.made == "cut"]
    if cut and dims.exit:
        length = plan.layout.cup[0] - min(abs(c.x) for c in plan.layout.cells) + GRIP_GAP + GRIP_LENGTH
        yield BenchStep(
            "Cut the tongues",
            f"Cut {'one tongue' if len(cut) == 1 else f'{len(cut)} tongues'} from film or steel "
            f"{number(dims.exit.height, 3)} mm thick: a "
            f"strip {number(dims.exit.width, 3)} mm wide and at least {number(length, 2)} mm long, one end cut hollow "
            f"to a radius of {number(dims.ledge_radius, 3)} mm so that it fits the riser of the core's ledge: a hole "
            "of that radius, punched or drilled at the strip's end and cut through its middle, makes it. No burr. Fold "
            f"tape over the last {number(GRIP_LENGTH, 2)} mm of the other end: this tab is what you pull by, with "
            "fingers or flat pliers.",
            picture_path("cut-tongue"),
            minutes=5.0 * len(cut),
            needs=("flat pliers",),
        )
    yield from cleaning(moulds, silicones)
    yield from joining(moulds)
    needs = ("paper",)
    fits = "Put each cup on the plinth once, dry: its cut corner lets it on one way only."
    standing, leaf = ribs(spec, plan.layout), leaf_mm(printer_of(spec))
    if plan.pins:
        fits = (
            "Put each cup over the pins once, dry: one pin stands off the square of the others, which lets the cup on "
            "in one way only. It must lie flat on the base until no paper goes in between them, on any side. A cup "
            "that rocks: cut off the bulge of the first layer round pins and holes, scrape both faces clean, and try "
            "again."
        )
    elif standing and leaf:
        fits = (
            "Press each cup onto the plinth once, dry, by hand: its cut corner lets it on one way only. Its "
            f"{len(standing)} ribs stand on leaves {number(leaf, 2)} mm thick, which bend and centre it; the seat "
            "bears it. A leaf broken off: print it again."
        )
    elif standing:
        fits = (
            "Press each cup onto the plinth once, dry: its cut corner lets it on one way only. Press evenly at all "
            f"corners, in a vice between two boards where the hand is too weak: its {len(standing)} ribs are crushed "
            "and centre it from then on."
        )
        needs = ("paper", "vice and two boards")
    if not plan.pins:
        fits += (
            f" It must sit down until seat and plinth touch; a slit of {number(lengths.seat_relief_mm, 3)} mm is then "
            "left between cup and plate, all round: the same strip of paper, folded to that thickness, goes in on all "
            "four sides. A cup that rocks or stands higher on one side: scrape plinth and seat clean, and try again."
        )
        fits += " Put each lid on its cup once, cut corner over cut corner." if plan.of_kind("lid") else ""
    yield BenchStep("Try every cup, dry", fits, picture_path("dry-fit"), minutes=5.0 * cups, needs=needs)
    if plan.of_kind("stub"):
        several_rows = len({cell.y for cell in plan.layout.cells}) > 1
        between = " Of a groove that ends under the plate, cut the bent end to its length." if several_rows else ""
        yield BenchStep(
            "Filament in",
            "Warm each piece of filament in hot water and bend it by a right angle, so that one leg has "
            f"{number(dims.core_height - moulds.plate[0] + SPARE, 2)} mm.{between} Push "
            f"{'the' if cells == 1 else 'each'} leg of that length up through the core from below until the bent end "
            "lies wholly in the groove under the plate: it rests on the bench and can't sink. Trim the upper end "
            "flush with the core's top with a knife; a fingernail drawn across must not catch: what stands low or "
            "proud marks the cavity.",
            picture_path("filament"),
            minutes=3.0 * cells,
            needs=("sharp knife",),
        )
    how = f"Lids clear their air up to a tilt of {number(TILT_DEG, 2)} degrees"
    cup = spaced(level_on(moulds).cup)
    yield level(
        f"{how if lengths.pour == 'injected' else fall(moulds)}. Put the base where it will stay and {cup} on it, dry. "
        f"Lay a phone with its level, or a small spirit level, on the rim of {cup}, along the base and across, and put "
        f"paper under a corner of the base until it shows less. Lift {cup} off again. The base stays there: it is "
        "poured and cured on this spot."
    )


def level(text: str) -> BenchStep:
    """Say how level the mould must lie, and how to see it."""
    return BenchStep("Level the bench", text, picture_path("level"), minutes=5.0, needs=("level", "paper"))


def cleaning(moulds: MouldSet, silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe how printed pieces get clean; `silicones` are those that a resin may keep from curing."""
    if not in_resin(moulds):
        yield BenchStep(
            "Clean",
            "Brush off strings and loose bits. Run a fingernail round every bore and rim: cut off what catches.",
            minutes=10.0,
            needs=("hand brush",),
        )
        return
    yield BenchStep(
        "Wash",
        "Wash the pieces in isopropanol until nothing of them feels slippery to a gloved finger, rinse holes and "
        "corners, and let them dry until no spot is dark any more.",
        kind="rest",
        minutes=15.0,
        wait_min=30.0,
        needs=("isopropanol and lint-free wipes",),
    )
    exit = moulds.plan.dimensions.exit
    if exit and tunnels(moulds):
        steps = [step for step in moulds.plan.steps if step.windows]
        lengths = [window_length(moulds, step) for step in steps]
        low, high = number(min(lengths), 2), number(max(lengths), 2)
        windows = [window_section(moulds.spec, exit, step.rim) for step in steps]
        height = number(min(high - low for _, low, high in windows), 2)
        yield BenchStep(
            "Clear the windows",
            f"Clear the windows of {listed(spaced(step.cup) for step in steps)} now, before the post-cure: resin stays "
            f"in a slot {height} mm high that runs {low if low == high else f'{low} to {high}'} mm through the wall. "
            "Rinse each with a syringe of isopropanol, and push a strip of the tongue's film through until it slides "
            "freely. What is cured in it has to be scraped out, or the cup printed again.",
            picture_path("clear-windows"),
            minutes=5.0 * len(steps),
            needs=("isopropanol and lint-free wipes", "rinsing syringe"),
        )
    yield BenchStep(
        "Post-cure, bake",
        "Resin keeps many platinum silicones from curing: post-cure, bake in an oven (60 degC for "
        f"{number(BAKE_H, 2)} h, assumed), and let the pieces cool.",
        kind="cure",
        minutes=10.0,
        wait_min=60 * BAKE_H,
        needs=("oven", "curing lamp"),
    )
    drops = {each.name: at_room(float(each.cure_h), moulds.spec.casting.room_c) for each in silicones}
    yield BenchStep(
        "Test the cure",
        f"Mix a little of each silicone and cure a drop of it on a spot of the base that is no cavity, for its "
        f"whole cure ({', '.join(f'{name} {number(hours, 2)} h' for name, hours in drops.items())}). Lift it: if "
        "its underside is tacky, coat (acrylic varnish, assumed) or print in another resin, and test again.",
        kind="cure",
        minutes=WEIGH_MIN + MIXING_MIN,
        wait_min=60 * max(drops.values()),
        needs=("acrylic varnish",),
    )


def fall(moulds: MouldSet) -> str:
    """Say at which tilt an open pour stands DENT higher on one side than on the other, and what a phone shows of it."""
    what, wide = moulds.poured_across
    tilt = math.degrees(math.atan(DENT / wide))
    finer = (
        f". A phone shows {number(PHONE_DEG, 1)} degrees at best (assumed): take a long spirit level, turn it end for "
        "end, and count half the difference of what it shows; the second strike takes off most of what is left"
    )
    return (
        f"Silicone stays level while it cures: at {number(tilt, 2)} degrees {number(DENT, 3)} mm more stand on the low "
        f"side of a {what} {number(wide, 3)} mm wide (computed){finer if tilt < PHONE_DEG else ''}"
    )


def in_resin(moulds: MouldSet) -> bool:
    """Tell whether the tools are printed in resin."""
    return printer_of(moulds.spec).technology.value == "sla"


def tunnels(moulds: MouldSet) -> tuple[str, ...]:
    """Return the cups through whose wall a window runs that resin may cure shut."""
    return tuple(step.cup for step in moulds.plan.steps if step.windows) if in_resin(moulds) else ()


def joining(moulds: MouldSet) -> Iterator[BenchStep]:
    """Say how the pieces of split tools go together, before the first pour, and how their seams are sealed."""
    plan = moulds.plan
    if not plan.splits:
        return
    called = {split.tool: plan.called(split.tool) for split in plan.splits}
    parts = listed(f"{called[split.tool]} in {len(split.pieces)} pieces" for split in plan.splits)
    (base, *cups), below = plan.splits, called[plan.splits[0].tool]
    upper = [name for tool, name in called.items() if plan.tool(tool).kind == "cup"]
    play = number(base.seams[0].play, 2)
    grid = any(seam.across == "y" for split in plan.splits for seam in split.seams)
    numbered = "each engraved with its number from the left" + ", row by row from the back" * grid
    if any(map(inner, plan.splits)):
        numbered += "; a piece without an outer edge has none"
    rows = ", one row after the other" * grid
    around = ", cut out round the filaments' grooves" * bool(grid and plan.of_kind("stub"))
    text = (
        f"Printed in pieces, since they are larger than the bed: {parts}, {numbered}. "
        "Cut off the bulge of the first layer along their dovetails. Lay a piece flat on the bench, hold the next one "
        f"over it and push it straight down, dovetail into dovetail{rows}, until a fingernail feels no step between "
        f"their faces. They have {play} mm of play all round; scrape dovetails that jam. Then seal each seam from "
        f"outside, never on a face that silicone touches: tape over the underside of the {below}{around} and over the "
        "ends of the seam"
    )
    if upper:
        # The pins hold the pieces of each cup, but where no unit stands between a seam of the base and one of a cup.
        x, y = plan.layout.plate
        same = []
        for seam in base.seams if plan.tool(base.tool).kind == "base" else ():
            middles = [cell.x if seam.across == "x" else cell.y for cell in plan.layout.cells]
            others = [other.at for cup in cups for other in cup.seams if other.across == seam.across]
            if any(not any(min(seam.at, at) < mid < max(seam.at, at) for mid in middles) for at in others):
                off, end = (seam.at + x, "left end") if seam.across == "x" else (y - seam.at, "back")
                same.append(f"{number(off, 3)} mm from the base's {end}")
        in_line = "The pins hold the pieces of each cup in line"
        if same:
            in_line = (
                "The pins hold the pieces of each cup to the base; but where base and cup are cut at the same gap "
                f"({listed(same)}), nothing but dovetails and tape holds them in line. Keep the base on one flat board "
                "from now on, and before each pour lay the blade's edge over that seam on the cup's rim: no light may "
                "show under it on either side"
            )
        text += (
            f"; petroleum jelly rubbed into the underside of {listed(upper)} and wiped off flush, since tape would "
            f"keep a cup off its seat. The tape stays on until the {below} is off. {in_line}"
        )
    yield BenchStep(
        "Join the pieces",
        f"{text}. Silicone that gets into a seam cures to a fin {play} mm thick: pull it off with the flash.",
        picture_path("join"),
        minutes=3.0 * sum(len(split.pieces) - 1 for split in plan.splits),
        needs=("wide adhesive tape", *["petroleum jelly"] * bool(upper)),
    )


def inner(split: Split) -> bool:
    """Tell whether a piece lies between others on all sides."""
    return min(split.columns, len(split.pieces) // split.columns) > 2
