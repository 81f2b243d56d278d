"""The steps from an empty mould to a unit with its motor in, and the measures to take."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial

from unitcad.casting.drawings import grip_of, tape_places, tongue_prop
from unitcad.casting.figures import (
    ADHESIVE_CURE_H,
    DATASHEET_C,
    DEGASSING_MIN,
    LAY_IN_MIN,
    LIFT_MIN,
    MIXING_MIN,
    MOST_ERROR_PCT,
    PEEL_MIN,
    PULL_MIN,
    STRIKE_AGAIN_MIN,
    STRIKE_MIN,
    WEIGH_MIN,
    AfterPours,
    Batch,
    cure_hours,
    eccentricity,
    for_casting,
    in_room,
    other_rooms,
    pot_life,
    pouring_min,
    window_length,
)
from unitcad.casting.fittings import fittings, lead
from unitcad.casting.steps import BenchStep
from unitcad.casting.views import picture_path, pour_picture
from unitcad.catalogue import Material
from unitcad.designs.design import ADHESIVE
from unitcad.designs.printed import OVER_ALL
from unitcad.moulds.cup import ribs
from unitcad.moulds.heights import off_layers
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.pieces import CAST
from unitcad.moulds.plan import Step
from unitcad.spec import Spec
from unitcad.text import number, spaced

TACK = "It is done if a gloved finger comes off clean and a fingernail's dent springs back. If not, wait half an hour"
"""How to tell cured silicone from tacky silicone."""
LEVEL_AGAIN = "Correct the level with paper."
"""How the step that holds a cup or a lid ends: nothing is moved between it and the cure."""


def pour_steps(batch: Batch) -> Iterator[BenchStep]:
    """Describe one pour, from an empty mould to a cured layer on the core."""
    moulds, step, n = batch.moulds, batch.step, batch.step.index
    plan, tongues = moulds.plan, moulds.plan.standing(step, "tongue")
    cells, the_tongue = len(plan.layout.cells), "the tongue" if len(tongues) == 1 else "each tongue"
    # Each cavity has a groove, which stops next to a window.
    groove = "the groove" if len(step.layer) == 1 else "the grooves"

    picture = partial(pour_picture, n)
    if n > 1:
        bond = "Its outside" if plan.concentric else f"The face that Layer {n} touches"
        yield BenchStep(
            f"Wipe Layer {n - 1}",
            f"Wipe Layer {n - 1} with isopropanol and pour on the same day. {bond} is the bond face: no release "
            "agent on it, ever, no grease, no fingers.",
            picture("bond-face"),
            minutes=2.0 * cells,
            required_tools=("isopropanol and lint-free wipes",),
        )
    laid = fittings(moulds) if moulds.design.laid_in == n else ()
    dry = True
    for i, fitting in enumerate(laid):
        if fitting.mix and dry:
            yield from mixing_steps(batch)
            dry = False
        title = f"Lay in, {i + 1} of {len(laid)}" if len(laid) > 1 else "Lay in"
        shown = picture("laid-in") if fitting.place else ""
        yield BenchStep(title, fitting.text, shown, minutes=LAY_IN_MIN * cells, required_tools=fitting.required_tools)
    if any(body.kind in ("circuit", "wire") for body in step.inserts):
        yield BenchStep(
            "Grease the lead",
            f"Coat the {lead(moulds)} thinly with petroleum jelly where the slot of cup {n} comes, outside the cavity "
            "only: silicone then can't weep out.",
            minutes=1.0 * cells,
            required_tools=("petroleum jelly",),
        )
    if flanks := step.greased:
        yield BenchStep(
            "Grease the flanks",
            f"Smear petroleum jelly on {flanks}: a film that shines, no beads. It keeps silicone out of the slits "
            "next to the cup's slots.",
            picture("grease"),
            minutes=1.0 * cells,
            required_tools=("petroleum jelly",),
        )
    # Nothing bonds to the last cup's bore. One by complement may meet a cured layer, to which its own has to bond.
    bare = step is plan.steps[-1] and (plan.concentric or bool(plan.pins) or n == 1)
    agent = "No release agent: what is cast here bonds later."
    if bare and plan.pins:
        earlier = f" and Layer {n - 1}" if n > 1 else ""
        agent = (
            f"Release agent, if any, thinly and only on the sheet's bed and the bores of cup {n}, away from the base: "
            f"a printed cup holds a thin sheet fast. None in the fins' slots, on the base{earlier}."
        )
    elif bare:
        agent = f"Release agent, if any, thinly and only on the bore of cup {n}, away from the {holds(moulds)}."
    # Ribs centre the cup, or a push as for the cup before.
    if ribs(moulds.frame):
        on = "on and press it down evenly until it sits; its ribs centre it."
    elif plan.pins:
        on = (
            "on over the pins, cut corner over cut corner, and press it flat, in the middle of the pins' play of "
            f"{number(plan.pins.clearance, 2)} mm each way."
        )
    else:
        on = "on and push it towards the cut corner, "
        on += "as the cup before" if n > 1 else "so that all play is on one side"
        on += f": Layer {n} lies between two cup positions." if n > 1 and plan.concentric else "."
    yield BenchStep(
        f"Cup {n} on",
        f"{agent} Put cup {n} {on}",
        picture("cup-on"),
        minutes=2.0,
        required_tools=("release agent",) if bare else (),
    )
    if tongues:
        seat = number(window_length(moulds, step), 2)
        yield BenchStep(
            "Tongue in, grease",
            f"Push {the_tongue} through the window, hollow end ahead. Stop {seat} mm before it is home. Grease that "
            "length on all sides with petroleum jelly: a film that shines, no beads.",
            picture("tongue-in"),
            minutes=1.5 * cells,
            required_tools=("petroleum jelly",),
        )
        yield _tongue_home(moulds, n, the_tongue, picture("tongue-home"))
    core = moulds.hung(step)
    if step.lid:
        outside = f", outside {groove}" if step.groove else ""
        yield BenchStep(
            f"Lid {n} on",
            f"Draw a thin line of petroleum jelly round the rim of cup {n}, near its outer edge{outside}. "
            f"{f'Hang the core: lower it with lid {n} straight into the cavity' if core else f'Put lid {n} on'}, "
            "cut corner over cut corner, and press it down.",
            picture("lid-on"),
            minutes=LIFT_MIN,
            required_tools=("petroleum jelly",),
        )
        yield lid_held(step, picture("lid-held"))
    else:
        yield _cup_held(moulds, n, picture("hold"))
    if dry:
        yield from mixing_steps(batch)
    if step.injected:
        yield from injection_steps(batch, picture("inject"))
    else:
        if cells == 1 or len(step.layer) > 1:
            where = "the cavity stands" if len(step.layer) == 1 else "it stands"
            each = "" if len(step.layer) == 1 else ", one cavity after the other"
            poured = f"Pour in a thin thread at one place until {where} over its rim{each}."
        else:
            poured = (
                "Pour in a thin thread, first next to each unit's earlier layer until that is covered, then outwards "
                "until the cavity stands over its rim."
            )
        strip = not plan.concentric and plan.dimensions.core_height > step.rim
        tool = "the blade, upright, its narrow edge down,"
        if strip:
            tool = (
                "a strip of stiff card or plastic, as wide as the cavity (what stands beside it is in the blade's way),"
            )
        yield from struck(
            batch,
            f"{poured} Prick bubbles with a pin.",
            f"Draw {tool} along the rim in one slow stroke. The rest goes "
            f"{f'into {groove}' if step.groove else 'onto a scrap: this cup has no groove'}.",
            " The film on the rim lifts off with the cup.",
            cells,
            cells,
            picture,
            ("stiff card or plastic",) if strip else (),
        )
    touched = (
        "the bead on a vent" if step.injected else f"the silicone in {groove}" if step.groove else "what was struck off"
    )
    yield cure(batch, touched, "layer", picture("filled"))
    if tongues:
        yield BenchStep(
            "Tongue out FIRST",
            f"Pull {'the tongue' if len(tongues) == 1 else 'every tongue'} straight out by its {grip_of(moulds)}, over "
            "the card: a cup lifted over it tears the layer. Take the card away.",
            picture("tongue-out"),
            minutes=PULL_MIN * len(tongues),
        )
    if step.lid:
        yield BenchStep(
            "Lid off",
            "Remove its tape or bands. Push the lid's edge up from below on two opposite sides, with thumbs "
            f"or a blunt spatula, bit by bit, cup {n} held down. Lift it straight up: sprue and vents tear off. "
            f"Trim them flush with a knife.{' Peel off silicone that came up on the core.' if core else ''}",
            picture("lid-off"),
            minutes=LIFT_MIN,
            required_tools=("sharp knife", "blunt spatula"),
        )
    if all(removal.piece != step.cup for removal in step.removals):
        return
    split = len(plan.pieces_of(step.cup)) > 1
    if split:
        pried = (
            "Lay a screwdriver in every pry slot, its tip under the cup. Press the handles down in turn, little by "
            "little, until every piece is free; at a piece over no slot turn a blunt spatula under its outer edge."
        )
    else:
        pried = (
            "Lay a screwdriver in each pry slot, its tip under the cup. Press both handles down together, little by "
            "little."
        )
    back = "from the skin's side" if step is plan.steps[-1] else "and put it back"
    trimmed = " Sprue and vents tear off: trim them flush with a knife." if step.gated else ""
    yield BenchStep(
        f"Cup {n} off",
        f"{'' if step.lid else 'Remove its tape or bands. '}{pried} Lift cup {n} straight up. Layer {n} should stay on "
        f"the {holds(moulds)}: if it comes off in the cup, push it out {back}.{trimmed}",
        picture("cup-off"),
        minutes=LIFT_MIN,
        required_tools=("blunt spatula",) if split else ("sharp knife",) if step.gated else (),
    )


def _cup_held(moulds: MouldSet, cup: int, picture: str) -> BenchStep:
    """Say how an open cup is held down while it is struck off: how many strips of tape, and where they stick."""
    count, split = len(tape_places(moulds)), moulds.plan.splits
    strips = "a strip of tape" if count == 1 else f"{count} strips of tape"
    where = "" if count == 1 else ": one at either end"
    if count > 2:
        where += ", the others evenly between them, clear of the filaments"
    pieces = " Each piece needs one; a strip over a seam holds both." if split else ""
    return BenchStep(
        f"Hold cup {cup} down",
        f"On both sides {'where the filaments come out' if split else 'without a pry slot'} run {strips} "
        f"from the cup's wall, below the rim, to the plate's underside{where}."
        f"{pieces} {LEVEL_AGAIN}",
        picture,
        minutes=2.0,
        required_tools=("paper",),
    )


def lid_held(step: Step, picture: str) -> BenchStep:
    """Say how a lid is held down while silicone is injected."""
    return BenchStep(
        f"Hold lid {step.index} down",
        f"Put rubber bands round lid and base, or a clamp, clear of sprue and vents. {LEVEL_AGAIN}",
        picture,
        minutes=2.0,
        required_tools=("paper",),
    )


def _tongue_home(moulds: MouldSet, pour: int, the_tongue: str, picture: str) -> BenchStep:
    """Say how the tongues are set, how to check it, and what bears their grips."""
    marked, grip, one = len(moulds.plan.steps) > 1 and pour == 1, grip_of(moulds), the_tongue == "the tongue"
    if pour == 1:
        mark = f" Mark {'it' if one else 'each'} with a pen at the cup's wall." if marked else ""
        stops = f"Push {the_tongue} on until it stops on the core's ledge: no gap at its end, none under it.{mark}"
    else:
        stops = (
            f"Push {the_tongue} on until it stops on the ledge under Layer 1, the pen mark at the cup's wall. If it "
            "stays out, it caught on the slot's edge: try again."
        )
    bears = ""
    if prop := tongue_prop(moulds):
        pads = "the pad of stacked card" if len(prop.pads) == 1 else "a pad of stacked card on each side"
        bears = f" Under {'its' if one else 'their'} free {grip}{'' if one else 's'}, against the cup, put {pads}."
    return BenchStep(
        "Tongue home",
        f"{stops} Wipe grease out of the bore with a cotton bud.{bears}",
        picture,
        minutes=1.5 * len(moulds.plan.layout.cells),
        required_tools=("pen", "cotton buds") if marked else ("cotton buds",),
    )


def mixing_steps(batch: Batch) -> Iterator[BenchStep]:
    """Describe the way from the bottles to a mix without air."""
    mix, pot, larger, room = batch.mix, batch.pot_min, "", batch.moulds.spec.casting.room_c
    if mix.mix_error_pct > MOST_ERROR_PCT:
        enough = number(mix.mix_g * mix.mix_error_pct / MOST_ERROR_PCT, 3)
        error = number(mix.mix_error_pct, 2)
        larger = f" Your scale makes {error} % of error in so little: mix {enough} g (casting.minimum_mix_g)."
    yield BenchStep(
        "Weigh",
        f"Weigh {shown(mix.part_a_g)} g of {batch.silicone.name} part A and {shown(mix.part_b_g)} g of part B. Stir "
        f"both bottles first, weigh B onto A, and note both.{larger}",
        kind="weigh",
        minutes=WEIGH_MIN,
    )
    lasts = "The pot life, which its data sheet has," if pot is None else f"The pot life of {in_room(pot, 'min', room)}"
    yield BenchStep(
        "Mix",
        f"Mix for {number(MIXING_MIN, 3)} min, scraping walls and bottom, until no streak is left. {lasts} runs from "
        f"now. {other_rooms(room)} Keep the mixing cup.",
        kind="mix",
        minutes=MIXING_MIN,
    )
    if batch.vacuum:
        yield BenchStep("Degas", batch.verdict, minutes=DEGASSING_MIN)


def injection_steps(batch: Batch, picture: str) -> Iterator[BenchStep]:
    """Say how the mix gets into the syringe, and from there into a cavity under a lid."""
    mix = batch.mix
    refilled = " Fill it again while the mix flows." if mix.syringe_size_ml < mix.millilitres else ""
    yield BenchStep(
        "Draw up",
        f"Draw all of the {number(mix.millilitres, 3)} ml into a syringe of {number(mix.syringe_size_ml, 3)} ml; "
        f"{number(mix.syringe_ml, 3)} ml fill cavities, tip and plunger.{refilled} Point it up and push out the air.",
        minutes=STRIKE_MIN,
    )
    if not batch.vacuum:
        yield BenchStep("Let bubbles rise", batch.verdict, kind="rest", wait_min=batch.rest_min)
    yield BenchStep(
        "Inject",
        f"Press the tip into the sprue ({number(batch.moulds.spec.moulds.sprue_mm, 3)} mm) and inject slowly until "
        "every vent shows a bead without bubbles, sprue by sprue. Leave sprue and vents filled.",
        picture,
        kind="pour",
        minutes=pouring_min(len(batch.moulds.plan.layout.cells)) - STRIKE_MIN,
    )


def struck(
    batch: Batch,
    poured: str,
    strike: str,
    film: str,
    cells: int,
    coats: int,
    picture: Callable[[str], str],
    required_tools: tuple[str, ...] = (),
) -> Iterator[BenchStep]:
    """Say how an open mould is filled and struck off, in its words; `coats`: cavities that are brushed at first."""
    rest = batch.rest_min
    if not batch.vacuum and not rest:
        minutes = 1.0 * coats
        yield BenchStep("Brush a first coat", batch.verdict, minutes=minutes, required_tools=("small brush",))
    minutes = pouring_min(cells) - STRIKE_MIN
    yield BenchStep("Pour", poured, picture("pour"), kind="pour", minutes=minutes, required_tools=("pin",))
    if not batch.vacuum and rest:
        yield BenchStep("Let bubbles rise", batch.verdict, kind="rest", wait_min=rest)
    yield BenchStep("Strike off", strike, picture("strike"), minutes=STRIKE_MIN, required_tools=required_tools)
    yield BenchStep(
        "Wait, strike again",
        f"Wipe the blade. After {number(STRIKE_AGAIN_MIN, 3)} min top up and strike again.{film}",
        picture("strike"),
        kind="rest",
        minutes=STRIKE_MIN,
        wait_min=STRIKE_AGAIN_MIN - STRIKE_MIN,
    )


def cure(batch: Batch, touched: str, cast: str, picture: str) -> BenchStep:
    """Say how long a pour cures, and how to tell that it is done."""
    room = batch.moulds.spec.casting.room_c
    return BenchStep(
        "Cure",
        f"Cure for {in_room(batch.cure_h, 'h', room)}, level. Then touch {touched}, not the {cast}. {TACK}.",
        picture,
        kind="cure",
        wait_min=60 * batch.cure_h,
    )


def release(moulds: MouldSet, first: Material) -> Iterator[BenchStep]:
    """Describe the way from the last cured layer to a unit in the hand; `first` is Layer 1's silicone."""
    plan, cells, last = moulds.plan, len(moulds.plan.layout.cells), moulds.plan.steps[-1]
    cup, removed = spaced(last.cup), {removal.piece for removal in last.removals}
    if plan.of_kind("filament"):
        each = "the" if cells == 1 else "each"
        torn = ""
        if first.tensile_mpa:
            tear = float(first.tensile_mpa) * math.pi * (moulds.spec.moulds.filament_mm / 2) ** 2
            torn = f": {number(tear, 2)} N tear {first.name} (computed)"
        yield BenchStep(
            "Filament out",
            f"Lift the mould off the bench. Pull {each} filament out downwards, by its bent end: it lets air in under "
            f"the unit. Never push it through{torn}.",
            picture_path("filament-out"),
            minutes=PULL_MIN * cells,
        )
    if any(base.name in removed for base in plan.standing(last, "base")):
        split = next((split for split in plan.splits if split.tool == "base"), None)
        levered = (
            f"Hold the mould off the bench by {cup}. With a screwdriver in each pry slot lever the base off downwards, "
            "on both sides at once and a little at a time, until it is free of the silicone. It must come straight."
        )
        if split:
            levered = (
                f"Leave the tape on the underside: it ties the pieces together. Hold the mould off the bench by {cup}. "
                "Lever the base off downwards and straight: a screwdriver in every pry slot, or a blunt spatula at the "
                "outer edge of a piece that has none. Go round and round, a little at each place, so that no piece "
                "runs ahead of the next."
            )
        yield BenchStep(
            "Base off, downwards",
            f"Remove its tape or bands. Leave {cup} on: silicone lies over it. {levered} The {moulds.plan.makes} "
            f"stays in {cup}.",
            picture_path("base-off"),
            minutes=LIFT_MIN * 2,
            required_tools=("blunt spatula",) if split else (),
        )
    film = "" if last.injected else " and the blade's film"
    title, what, out, path = (
        "Peel off",
        "unit's edge",
        f", then peel it off the {holds(moulds)} straight up",
        "peel",
    )
    if CAST in removed:
        title, what, path = "Push out", f"edge of the {moulds.plan.makes}", "push-out"
        out = f". Push it up out of {cup} from below with the thumbs, first at the edge, then unit by unit"
    yield BenchStep(
        title,
        f"Loosen the {what} all round with a blunt spatula{out}. Trim flash{film} with small scissors.",
        picture_path(path),
        minutes=PEEL_MIN * cells,
        required_tools=("small scissors", "blunt spatula"),
    )


def motor_in(moulds: MouldSet, silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe how motor and circuit go in after casting; nothing if they were laid in, or there is no motor."""
    if moulds.design.laid_in or moulds.spec.motor.absent:
        return
    steps, casting = fittings(moulds), moulds.spec.casting
    later = {each.use: each for each in after_pours(moulds, silicones)}
    for i, fitting in enumerate(steps):
        if fitting.mixed:
            yield from _mixed_later(later[fitting.mixed], moulds.spec)
        title = f"Motor in, {i + 1} of {len(steps)}" if len(steps) > 1 else "Motor in"
        path = picture_path(f"motor-{fitting.place}") if fitting.place else ""
        minutes = LAY_IN_MIN * len(moulds.plan.layout.cells)
        yield BenchStep(title, fitting.text, path, minutes=minutes, required_tools=fitting.required_tools)
    mouth, motor = ("cavity's mouth", "motor") if moulds.plan.makes == "unit" else ("cavities' mouths", "motors")
    up = f"the {mouth} up" if moulds.design.opens == "below" else "its skin side down"
    ring = next((fitting for fitting in steps if fitting.mixed), None)
    if ring:
        silicone = _of_layer(silicones, ring.silicone)
        hours = cure_hours(silicone, casting.room_c)
        what, said = ring.mixed, f"{silicone.name} cures {in_room(hours, 'h', casting.room_c)}."
    elif any(ADHESIVE in fitting.required_tools for fitting in steps):
        what, hours = "adhesive", ADHESIVE_CURE_H
        said = f"{in_room(hours, 'h', DATASHEET_C)}, or as its tube says."
    else:
        return
    yield BenchStep(
        f"Let the {what} cure",
        f"{said} Lay the {moulds.plan.makes} level, {up}; don't run the {motor} before.",
        picture_path("motor-home"),
        kind="cure",
        wait_min=60 * hours,
    )


def skin_on(moulds: MouldSet, silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe how a film closes the skin side, the motor already in."""
    spec, cells = moulds.spec, len(moulds.plan.layout.cells)
    film = next((each for each in after_pours(moulds, silicones) if each.use == "skin"), None)
    if not film:
        return
    blade = "the blade" if moulds.plan.of_kind("blade") else "a straight edge"
    hours = cure_hours(film.silicone, spec.casting.room_c)
    yield from _mixed_later(film, spec)
    yield BenchStep(
        "Fill the skin tray",
        f"Level the skin tray, fill it and draw {blade} along its rim. Prick bubbles with a pin.",
        picture_path("skin-tray"),
        minutes=pouring_min(cells),
        required_tools=("level", "pin"),
    )
    yield BenchStep(
        "Skin on",
        "Lower the unit onto the wet film, skin side down, one edge first so that no air stays, and press it down "
        "lightly. No release agent on its skin side.",
        picture_path("skin-on"),
        minutes=LAY_IN_MIN * cells,
    )
    yield BenchStep(
        "Let the skin cure",
        f"{in_room(hours, 'h', spec.casting.room_c)}, level. Loosen the film's edge with a blunt spatula, lift "
        "the unit out, and trim the film with small scissors.",
        picture_path("skin-cure"),
        kind="cure",
        minutes=PEEL_MIN * cells,
        wait_min=60 * hours,
        required_tools=("small scissors", "blunt spatula"),
    )


def _mixed_later(mix: AfterPours, spec: Spec) -> Iterator[BenchStep]:
    """Describe the way from the bottles to a mix after the pours; the bench page has no fields for it."""
    ratio = float(for_casting(mix.silicone, "mix_ratio"))
    part_b = mix.grams / (1 + ratio)
    pot_min = pot_life(mix.silicone, spec.casting.room_c)
    lasts = (
        "pot life as on its data sheet"
        if pot_min is None
        else f"pot life {in_room(pot_min, 'min', spec.casting.room_c)}"
    )
    mixed = "Mix and degas" if spec.casting.vacuum else "Mix"
    yield BenchStep(
        f"Mix for the {mix.use}",
        f"Weigh {shown(mix.grams - part_b)} g of {mix.silicone.name} part A and {shown(part_b)} g of part B. "
        f"{mixed} as for a pour; {lasts}.",
        minutes=WEIGH_MIN + MIXING_MIN + (DEGASSING_MIN if spec.casting.vacuum else 0.0),
    )


def after_pours(moulds: MouldSet, silicones: Sequence[Material]) -> list[AfterPours]:
    """Return the silicones that are mixed after the pours, for rings round motors and for skins, one batch each."""
    cells, casting, dims = len(moulds.plan.layout.cells), moulds.spec.casting, moulds.dimensions
    steps = () if moulds.design.laid_in else fittings(moulds)
    wanted = [(each.mixed, _of_layer(silicones, each.silicone), each.volume_mm3) for each in steps if each.mixed]
    if dims.skin:
        wanted.append(("skin", silicones[-1], film_mm3(moulds)))
    found = []
    for use, material, volume in wanted:
        net = cells * volume * float(material.density_g_cm3) / 1000
        found.append(AfterPours(material, use, max(net * (1 + casting.waste), casting.minimum_mix_g)))
    return found


def film_mm3(moulds: MouldSet) -> float:
    """Return the volume of the film over one unit's skin side; 0 if it has none."""
    return math.pi * moulds.dimensions.outer_radius**2 * moulds.dimensions.skin


def _of_layer(silicones: Sequence[Material], layer: int) -> Material:
    """Return the silicone of a layer (from 1, -1 the last); of one that is not there the last."""
    return silicones[min(layer, len(silicones)) - (layer > 0)]


def measurements(moulds: MouldSet, masses_g: Sequence[float], skin_g: float) -> Iterator[str]:
    """Name the measures of the first part, and their expected values.

    `masses_g`: of each layer of one unit, trimmed; `skin_g`: of its skin.
    """
    spec, dims, off, exit = moulds.spec, moulds.dimensions, eccentricity(moulds), moulds.dimensions.exit
    layers = f"in layers of {number(spec.moulds.layer_mm, 3)}"
    drawn = dims.heights[-1] if moulds.plan.concentric else moulds.height
    high = next((each.printed_mm for each in off_layers(moulds) if each.what == OVER_ALL), drawn)
    by_layers = f" ({shown(drawn, 2)} drawn, {layers})" if high != drawn else ""
    over = f", with the skin {shown(high + dims.skin, 2)} mm" if dims.skin else ""
    yield f"Height over all: {shown(high, 2)} mm{by_layers}{over}."
    if moulds.plan.concentric:
        yield f"Diameter at the skin: {shown(2 * dims.outer_radius, 2)} mm, in two directions."
        pushed = "" if off.ribs else " unless both cups were pushed the same way"
        further = f", each further layer by {number(2 * off.at_worst_mm, 2)} mm{pushed}"
        yield (
            f"Walls at the skin, at four places: Layer 1 may vary by {number(off.at_worst_mm, 2)} mm either way"
            f"{further if len(masses_g) > 1 else ''}."
        )
    else:
        yield moulds.plan.across
    if exit:
        opening = "notch" if exit.high >= dims.heights[0] else "slot"
        size = f"{shown(exit.width, 2)} wide, {shown(exit.height, 2)} high"
        yield f"The {opening}: {size}, open all the way."
    weights = " + ".join(shown(each) for each in masses_g) + (f" = {shown(sum(masses_g))}" if len(masses_g) > 1 else "")
    low = "" if moulds.plan.steps[-1].injected else " or a low strike"
    low += (
        f", or only the layers' lower height ({shown(high, 2)} for {shown(drawn, 2)} mm)" if high < drawn - 0.05 else ""
    )
    motor = "motor" if moulds.plan.makes == "unit" else "motors"
    without = "" if spec.motor.absent else f", without {motor} and circuit"
    closed = f", with the skin {shown(sum(masses_g) + skin_g)} g" if skin_g else ""
    weighed = f"Weigh one {moulds.plan.makes}, trimmed{without}: {weights} g{closed}."
    if moulds.design.laid_in:
        weighed = (
            f"The silicone of one unit, trimmed, weighs {weights} g{closed}. What was laid in comes on top: weigh that "
            "before."
        )
    yield f"{weighed} Less means air{low}."


def holds(moulds: MouldSet) -> str:
    """Return the tool that the silicone is cast on: "core"; moulds by complement need not have one."""
    return "core" if moulds.plan.concentric else "base"


def shown(value: float, decimals: int = 3) -> str:
    """Return grams, or mm to two decimals, as a scale or a caliper shows them."""
    return min(number(value, 3, zeros=True), f"{value:.{decimals}f}", key=len)
