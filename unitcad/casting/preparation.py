"""The steps from the printer to an empty mould."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from unitcad.casting import figures as fig
from unitcad.casting.bench_step import BenchStep
from unitcad.casting.bench_views import View, level_on, picture_path
from unitcad.casting.figures import at_room, window_length
from unitcad.casting.joining import joining
from unitcad.casting.plates import mould_plates
from unitcad.casting.time_line import duration
from unitcad.catalogue import Material
from unitcad.designs.rib_leaves import leaf_mm
from unitcad.moulds.cup import window_section
from unitcad.moulds.dents import DENT, TILT_DEG
from unitcad.moulds.layout import BLADE_HEIGHT
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Plan
from unitcad.moulds.ribs import ribs
from unitcad.moulds.tongue import GRIP_GAP, GRIP_LENGTH
from unitcad.shape.lettering import seen
from unitcad.spec import printer_of
from unitcad.text import listed, number, spaced

PERIMETERS = 3
SPARE = 2.0
"""What a piece of filament is longer than its way through base and core, mm."""
FOOT_MM = 0.2
PHONE_DEG = 0.1
"""What a phone's level shows (assumed)."""


def on_plates(moulds: MouldSet, count: str) -> str:
    """Say which files to print, and what is in each where one bed does not hold all; `count`: the pieces in words."""
    files = mould_plates(moulds)
    singly = "moulds/ has them singly as STL too"
    if len(files) == 1:
        return f"Plate: {next(iter(files))} ({count}; {singly})."
    names = {path: [moulds.plan.called(one.name).replace(",", "") for one in plate] for path, plate in files.items()}
    each = (f"{path} with {listed(there)}" for path, there in names.items())
    return f"{len(files)} plates, for one bed does not hold all: {'; '.join(each)} ({count}; {singly})."


def printing(moulds: MouldSet, solid_mm3: float, tallest_mm: float = 0.0) -> tuple[str, ...]:
    """Say which file to print and how, a sentence or two each. `solid_mm3`: volume of all printed pieces, solid.

    `tallest_mm`: height of a piece that may stand higher than core and blade.
    """
    spec, plan = moulds.spec, moulds.plan
    printed = [tool for tool in plan.pieces if tool.made == "printed"]
    mixed = {tool.kind for tool in printed if not tool.upside_down}
    names = (
        spaced(t.name.partition("-")[0]) if t.kind in mixed else f"{t.kind}s" if t.step else t.kind
        for t in printed
        if t.upside_down
    )
    turned = listed(dict.fromkeys(names)) if any(tool.upside_down for tool in printed) else ""
    attitude = f"{turned} upside down, the rest as drawn" if turned else "as drawn"
    count = "one piece" if len(printed) == 1 else f"{len(printed)} pieces"
    lines = [
        f"{on_plates(moulds, count)} They lie in it as they are printed: {attitude}. Turn none of them.",
        f"Printer {spec.moulds.printer}, layers of {number(spec.moulds.layer_mm, 3)} mm, no supports.",
    ]
    standing = plan.dimensions.core_height - moulds.plate[0]
    blade = BLADE_HEIGHT if plan.of_kind("blade") else 0.0
    time = fig.print_min(spec, solid_mm3, max(standing, blade, tallest_mm))
    takes = f"Takes about {duration(5 * max(round(time / 5), 1))}"
    if in_resin(moulds):
        lines.append(f"{takes} ({number(fig.RESIN_LAYER_S, 2)} s a layer, assumed).")
        lines.append(
            f"At most {number(solid_mm3 / 1000, 2)} ml of resin (computed: the pieces' volume). Flat on the plate, no "
            "tilt: seats and rims are then whole layers. Compensate the first layers' growth (bottom tolerance): what "
            "grows there narrows a bore."
        )
    else:
        lines.append(
            f"{PERIMETERS} perimeters, 20 % infill (assumed). At most {number(solid_mm3 / 1000, 2)} cm3 of filament "
            f"(computed: the pieces, solid).{_elephant_foot(plan)}"
        )
        low, high = (number(error, 2) for error in fig.FDM_ERROR)
        lines.append(
            f"{takes} (by volume and layer height; PrusaSlicer's times for other sets were {low} to {high} times that, "
            "shortest for thick pieces). Time and filament, piece by piece: run unitcad build "
            f"{moulds.source} --slice -o sliced in this folder, on a machine with PrusaSlicer. The path that it prints "
            "last is the folder that has slicer.json."
        )
    if not plan.of_kind("cup"):
        return tuple(lines)
    there = [
        "pins (they have the play of the coupon's plinth)" if plan.pins else "plinth",
        *(["tongue"] if plan.of_kind("tongue") else []),
        *(["filament"] if plan.of_kind("stub") else []),
    ]
    lines.append(
        f"First time on this printer: print the fit coupon (unitcad coupon {spec.moulds.printer}): a print of "
        f"its own, whose time the slicer says. It shows whether {listed(there)} fit, and gives the line for the spec "
        "where they do not."
    )
    return tuple(lines)


def _elephant_foot(plan: Plan) -> str:
    """Say why the first layer must not grow; "" where nothing has to fit there."""
    if plan.of_kind("cup"):
        why = "cups lie on their rims: a first layer that is squeezed out narrows the bore where the layer's edge is"
    elif plan.splits:
        why = "a first layer that is squeezed out jams the dovetails"
    else:
        return ""
    return f" Elephant foot compensation {number(FOOT_MM, 3)} mm (assumed), for {why}."


def preparation(moulds: MouldSet, views: dict[str, View], silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe the way from the printer to an empty mould; `silicones` are those that a resin may keep from curing."""
    plan, lengths = moulds.plan, moulds.spec.moulds
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
        minutes=fig.SORT_MIN,
    )
    yield from _cut_tongues(moulds)
    yield from cleaning(moulds, silicones)
    yield from joining(moulds, picture_path("join"))
    lids = " Put each lid on its cup once, cut corner over cut corner." if plan.of_kind("lid") else ""
    on = "Put each cup on the plinth once, dry: its cut corner lets it on one way only. It must sit down"
    if standing := ribs(moulds.spec, plan.layout):
        on = (
            "Press each cup onto the plinth once, dry: its cut corner lets it on one way only. Press evenly at all "
            f"corners, in a vice between two boards where the hand is too weak: its {len(standing)} ribs are crushed "
            "and centre it from then on. It must sit down"
        )
        if leaf := leaf_mm(printer_of(moulds.spec)):
            on = (
                "Press each cup onto the plinth once, dry, by hand: its cut corner lets it on one way only. Its "
                f"{len(standing)} ribs stand on leaves {number(leaf, 2)} mm thick, which bend and centre it; the seat "
                "bears it. A leaf broken off: print it again. It must sit down"
            )
    if plan.pins:
        fits = (
            "Put each cup over the pins once, dry: one pin stands off the square of the others, which lets the cup on "
            "in one way only. It must lie flat on the base until no paper goes in between them, on any side. A cup "
            "that rocks: cut off the bulge of the first layer round pins and holes, scrape both faces clean, and try "
            "again."
        )
        yield BenchStep("Try every cup, dry", fits, picture_path("dry-fit"), minutes=fig.DRY_FIT_MIN * cups)
    else:
        yield BenchStep(
            "Try every cup, dry",
            f"{on} until seat and plinth touch; a slit of {number(lengths.seat_relief_mm, 3)} mm is then left between "
            "cup and plate, all "
            "round: the same strip of paper, folded to that thickness, goes in on all four sides. A cup that rocks or "
            f"stands higher on one side: scrape plinth and seat clean, and try again.{lids}",
            picture_path("dry-fit"),
            minutes=fig.DRY_FIT_MIN * cups,
        )
    if plan.of_kind("stub"):
        each = "the" if len(plan.layout.cells) == 1 else "each"
        yield BenchStep(
            "Filament in",
            f"{_bend(moulds)} Push {each} leg of that length up through the core from below until the bent end "
            "lies wholly in the groove under the plate: it rests on the bench and can't sink. Trim the upper end "
            "flush with the core's top with a knife; a fingernail drawn across must not catch: what stands low or "
            "proud marks the cavity.",
            picture_path("filament"),
            minutes=fig.FILAMENT_MIN * cells,
        )
    yield BenchStep("Level the bench", level_text(moulds), picture_path("level"), minutes=fig.LEVEL_MIN)


def _bend(moulds: MouldSet) -> str:
    """Say how a piece of filament gets its bent end."""
    leg = moulds.plan.dimensions.core_height - moulds.plate[0] + SPARE
    between = " Of a groove that ends under the plate, cut the bent end to its length."
    inner = between if len({cell.y for cell in moulds.plan.layout.cells}) > 1 else ""
    bent = f"bend it by a right angle, so that one leg has {number(leg, 2)} mm"
    return f"Warm each piece of filament in hot water and {bent}.{inner}"


def cleaning(moulds: MouldSet, silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe how printed pieces get clean; `silicones` are those that a resin may keep from curing."""
    if in_resin(moulds):
        yield BenchStep(
            "Wash",
            "Wash the pieces in isopropanol until nothing of them feels slippery to a gloved finger, rinse holes and "
            "corners, and let them dry until no spot is dark any more.",
            kind="rest",
            minutes=fig.WASH_MIN,
            wait_min=fig.DRY_MIN,
        )
        if tunnels(moulds):
            yield BenchStep(
                "Clear the windows",
                _clear_tunnels(moulds),
                picture_path("clear-windows"),
                minutes=fig.CLEAR_MIN * len(tunnels(moulds)),
            )
        yield BenchStep(
            "Post-cure, bake",
            "Resin keeps many platinum silicones from curing: post-cure, bake in an oven (60 degC for "
            f"{number(fig.BAKE_H, 2)} h, assumed), and let the pieces cool.",
            kind="cure",
            minutes=fig.CLEAN_MIN,
            wait_min=60 * fig.BAKE_H,
        )
        drops = {each.name: at_room(float(each.cure_h), moulds.spec.casting.room_c) for each in silicones}
        yield BenchStep(
            "Test the cure",
            f"Mix a little of each silicone and cure a drop of it on a spot of the base that is no cavity, for its "
            f"whole cure ({', '.join(f'{name} {number(hours, 2)} h' for name, hours in drops.items())}). Lift it: if "
            "its underside is tacky, coat (acrylic varnish, assumed) or print in another resin, and test again.",
            kind="cure",
            minutes=fig.WEIGH_MIN + fig.MIXING_MIN,
            wait_min=60 * max(drops.values()),
        )
    else:
        yield BenchStep(
            "Clean",
            "Brush off strings and loose bits. Run a fingernail round every bore and rim: cut off what catches.",
            minutes=fig.CLEAN_MIN,
        )


def level_text(moulds: MouldSet) -> str:
    """Say how level the mould must lie, and how to see it."""
    if moulds.spec.moulds.pour == "injected":
        how = f"Lids clear their air up to a tilt of {number(TILT_DEG, 2)} degrees"
    else:
        how = fall(moulds)
    cup = spaced(level_on(moulds).cup)
    return (
        f"{how}. Put the base where it will stay and {cup} on it, dry. Lay a phone with its level, or a small spirit "
        f"level, on the rim of {cup}, along the base and across, and put paper under a corner of the base until it "
        f"shows less. Lift {cup} off again. The base stays there: it is poured and cured on this spot."
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


def _clear_tunnels(moulds: MouldSet) -> str:
    """Say how the windows are cleared before the post-cure closes them for good."""
    steps = [step for step in moulds.plan.steps if step.windows]
    low, high = (number(pick(window_length(moulds, step) for step in steps), 2) for pick in (min, max))
    exit = moulds.plan.dimensions.exit
    windows = [window_section(moulds.spec, exit, step.rim) for step in steps] if exit else []
    height = number(min(high - low for _, low, high in windows), 2)
    return (
        f"Clear the windows of {listed(spaced(step.cup) for step in steps)} now, before the post-cure: resin stays in "
        f"a slot {height} mm high that runs {low if low == high else f'{low} to {high}'} mm through the wall. Rinse "
        "each with a syringe of isopropanol, and push a strip of the tongue's film through until it slides freely. "
        "What is cured in it has to be scraped out, or the cup printed again."
    )


def _cut_tongues(moulds: MouldSet) -> Iterator[BenchStep]:
    """Say how to cut the tongues that are not printed."""
    dims, tongues = moulds.plan.dimensions, [t for t in moulds.plan.of_kind("tongue") if t.made == "cut"]
    if tongues and dims.exit:
        length = moulds.plan.layout.cup[0] - min(abs(c.x) for c in moulds.plan.layout.cells) + GRIP_GAP + GRIP_LENGTH
        count = "one tongue" if len(tongues) == 1 else f"{len(tongues)} tongues"
        yield BenchStep(
            "Cut the tongues",
            f"Cut {count} from film or steel {number(dims.exit.height, 3)} mm thick: a "
            f"strip {number(dims.exit.width, 3)} mm wide and at least {number(length, 2)} mm long, one end cut hollow "
            f"to a radius of {number(dims.ledge_radius, 3)} mm so that it fits the riser of the core's ledge: a hole "
            "of that radius, punched or drilled at the strip's end and cut through its middle, makes it. No burr. Fold "
            f"tape over the last {number(GRIP_LENGTH, 2)} mm of the other end: this tab is what you pull by, with "
            "fingers or flat pliers.",
            picture_path("cut-tongue"),
            minutes=fig.CUT_MIN * len(tongues),
        )
