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
from unitcad.casting.sentences import say
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


def pour_steps(batch: Batch) -> Iterator[BenchStep]:
    """Describe one pour, from an empty mould to a cured layer on the core."""
    moulds, step, n = batch.moulds, batch.step, batch.step.index
    plan, tongues = moulds.plan, moulds.plan.standing(step, "tongue")
    cells, the_tongue = len(plan.layout.cells), "the tongue" if len(tongues) == 1 else "each tongue"
    # Each cavity has a groove, which stops next to a window.
    groove = "the groove" if len(step.layer) == 1 else "the grooves"

    picture = partial(pour_picture, n)
    if n > 1:
        yield BenchStep(
            say("wipe.title", before=n - 1),
            say("wipe.text", "wipe.outside" if plan.concentric else "wipe.face", before=n - 1, n=n),
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
        title = say("lay_in.several" if len(laid) > 1 else "lay_in.one", step=i + 1, steps=len(laid))
        shown = picture("laid-in") if fitting.place else ""
        yield BenchStep(title, fitting.text, shown, minutes=LAY_IN_MIN * cells, required_tools=fitting.required_tools)
    if any(body.kind in ("circuit", "wire") for body in step.inserts):
        yield BenchStep(
            say("grease_lead.title"),
            say("grease_lead.text", lead=lead(moulds), n=n),
            minutes=1.0 * cells,
            required_tools=("petroleum jelly",),
        )
    if flanks := step.greased:
        yield BenchStep(
            say("grease_flanks.title"),
            say("grease_flanks.text", flanks=flanks),
            picture("grease"),
            minutes=1.0 * cells,
            required_tools=("petroleum jelly",),
        )
    # Nothing bonds to the last cup's bore. One by complement may meet a cured layer, to which its own has to bond.
    bare = step is plan.steps[-1] and (plan.concentric or bool(plan.pins) or n == 1)
    agent = ["cup_on.no_agent"]
    if bare and plan.pins:
        agent = ["cup_on.agent_sheet", "cup_on.not_on_layer" if n > 1 else "cup_on.not_on_base"]
    elif bare:
        agent = ["cup_on.agent_bore"]
    # Ribs centre the cup, or a push as for the cup before.
    pushed = "cup_on.first"
    if ribs(moulds.frame):
        pushed = "cup_on.ribs"
    elif plan.pins:
        pushed = "cup_on.pins"
    elif n > 1:
        pushed = "cup_on.as_before_round" if plan.concentric else "cup_on.as_before"
    play = number(plan.pins.clearance, 2) if plan.pins else ""
    yield BenchStep(
        say("cup_on.title", n=n),
        say(*agent, pushed, n=n, before=n - 1, core=holds(moulds), play=play),
        picture("cup-on"),
        minutes=2.0,
        required_tools=("release agent",) if bare else (),
    )
    if tongues:
        yield BenchStep(
            say("tongue_in.title"),
            say("tongue_in.text", tongue=the_tongue, seat=number(window_length(moulds, step), 2)),
            picture("tongue-in"),
            minutes=1.5 * cells,
            required_tools=("petroleum jelly",),
        )
        yield _tongue_home(moulds, n, the_tongue, picture("tongue-home"))
    core = moulds.hung(step)
    if step.lid:
        yield BenchStep(
            say("lid_on.title", n=n),
            say(
                "lid_on.grease_groove" if step.groove else "lid_on.grease",
                "lid_on.core" if core else "lid_on.plain",
                n=n,
                groove=groove,
            ),
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
        poured = "pour.sheet"
        if cells == 1 or len(step.layer) > 1:
            poured = "pour.one" if len(step.layer) == 1 else "pour.several"
        strip = not plan.concentric and plan.dimensions.core_height > step.rim
        yield from struck(
            batch,
            say(poured, "pour.pin"),
            say(
                "strike.strip" if strip else "strike.blade",
                "strike.groove" if step.groove else "strike.no_groove",
                groove=groove,
            ),
            say("strike.film"),
            cells,
            cells,
            picture,
            ("stiff card or plastic",) if strip else (),
        )
    touched = "cure.bead" if step.injected else "cure.groove" if step.groove else "cure.struck"
    yield cure(batch, say(touched, groove=groove), "layer", picture("filled"))
    if tongues:
        yield BenchStep(
            say("tongue_out.title"),
            say(
                "tongue_out.text",
                tongues="the tongue" if len(tongues) == 1 else "every tongue",
                grip=grip_of(moulds),
            ),
            picture("tongue-out"),
            minutes=PULL_MIN * len(tongues),
        )
    if step.lid:
        yield BenchStep(
            say("lid_off.title"),
            say("lid_off.text", "lid_off.core" if core else "", n=n),
            picture("lid-off"),
            minutes=LIFT_MIN,
            required_tools=("sharp knife", "blunt spatula"),
        )
    if all(removal.piece != step.cup for removal in step.removals):
        return
    split = len(plan.pieces_of(step.cup)) > 1
    yield BenchStep(
        say("cup_off.title", n=n),
        say(
            "" if step.lid else "cup_off.tape",
            "cup_off.split" if split else "cup_off.whole",
            "cup_off.lift_last" if step is plan.steps[-1] else "cup_off.lift",
            "cup_off.trim" if step.gated else "",
            n=n,
            core=holds(moulds),
        ),
        picture("cup-off"),
        minutes=LIFT_MIN,
        required_tools=("blunt spatula",) if split else ("sharp knife",) if step.gated else (),
    )


def _cup_held(moulds: MouldSet, cup: int, picture: str) -> BenchStep:
    """Say how an open cup is held down while it is struck off: how many strips of tape, and where they stick."""
    count, split = len(tape_places(moulds)), moulds.plan.splits
    strips = "hold.one_strip" if count == 1 else "hold.two_strips" if count == 2 else "hold.more_strips"
    return BenchStep(
        say("hold.cup", n=cup),
        say(
            strips,
            "hold.split" if split else "",
            "hold.level_again",
            sides=say("hold.split_sides" if split else "hold.whole_sides"),
            count=count,
        ),
        picture,
        minutes=2.0,
        required_tools=("paper",),
    )


def lid_held(step: Step, picture: str) -> BenchStep:
    """Say how a lid is held down while silicone is injected."""
    return BenchStep(
        say("hold.lid", n=step.index),
        say("hold.bands", "hold.level_again"),
        picture,
        minutes=2.0,
        required_tools=("paper",),
    )


def _tongue_home(moulds: MouldSet, pour: int, the_tongue: str, picture: str) -> BenchStep:
    """Say how the tongues are set, how to check it, and what bears their grips."""
    marked, grip, one = len(moulds.plan.steps) > 1 and pour == 1, grip_of(moulds), the_tongue == "the tongue"
    stops = ["tongue_home.later"]
    if pour == 1:
        stops = ["tongue_home.first", "tongue_home.mark" if marked else ""]
    bears = ""
    if prop := tongue_prop(moulds):
        bears = "tongue_home.one_pad" if len(prop.pads) == 1 else "tongue_home.two_pads"
    return BenchStep(
        say("tongue_home.title"),
        say(
            *stops,
            "tongue_home.wipe",
            bears,
            tongue=the_tongue,
            it="it" if one else "each",
            grip=f"its free {grip}" if one else f"their free {grip}s",
        ),
        picture,
        minutes=1.5 * len(moulds.plan.layout.cells),
        required_tools=("pen", "cotton buds") if marked else ("cotton buds",),
    )


def mixing_steps(batch: Batch) -> Iterator[BenchStep]:
    """Describe the way from the bottles to a mix without air."""
    mix, pot, room = batch.mix, batch.pot_min, batch.moulds.spec.casting.room_c
    yield BenchStep(
        say("weigh.title"),
        say(
            "weigh.text",
            "weigh.too_little" if mix.mix_error_pct > MOST_ERROR_PCT else "",
            part_a=shown(mix.part_a_g),
            silicone=batch.silicone.name,
            part_b=shown(mix.part_b_g),
            error=number(mix.mix_error_pct, 2),
            enough=number(mix.mix_g * mix.mix_error_pct / MOST_ERROR_PCT, 3),
        ),
        kind="weigh",
        minutes=WEIGH_MIN,
    )
    yield BenchStep(
        say("mix.title"),
        say(
            "mix.text",
            "mix.no_pot_life" if pot is None else "mix.pot_life",
            "mix.rooms",
            minutes=number(MIXING_MIN, 3),
            pot_life="" if pot is None else in_room(pot, "min", room),
            other_rooms=other_rooms(room),
        ),
        kind="mix",
        minutes=MIXING_MIN,
    )
    if batch.vacuum:
        yield BenchStep(say("bubbles.degas"), batch.verdict, minutes=DEGASSING_MIN)


def injection_steps(batch: Batch, picture: str) -> Iterator[BenchStep]:
    """Say how the mix gets into the syringe, and from there into a cavity under a lid."""
    mix = batch.mix
    yield BenchStep(
        say("draw_up.title"),
        say(
            "draw_up.text",
            "draw_up.refill" if mix.syringe_size_ml < mix.millilitres else "",
            "draw_up.air",
            millilitres=number(mix.millilitres, 3),
            size=number(mix.syringe_size_ml, 3),
            filled=number(mix.syringe_ml, 3),
        ),
        minutes=STRIKE_MIN,
    )
    if not batch.vacuum:
        yield BenchStep(say("bubbles.rise"), batch.verdict, kind="rest", wait_min=batch.rest_min)
    yield BenchStep(
        say("inject.title"),
        say("inject.text", sprue=number(batch.moulds.spec.moulds.sprue_mm, 3)),
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
        yield BenchStep(say("bubbles.brush"), batch.verdict, minutes=minutes, required_tools=("small brush",))
    minutes = pouring_min(cells) - STRIKE_MIN
    yield BenchStep(say("pour.title"), poured, picture("pour"), kind="pour", minutes=minutes, required_tools=("pin",))
    if not batch.vacuum and rest:
        yield BenchStep(say("bubbles.rise"), batch.verdict, kind="rest", wait_min=rest)
    yield BenchStep(say("strike.title"), strike, picture("strike"), minutes=STRIKE_MIN, required_tools=required_tools)
    yield BenchStep(
        say("strike.again_title"),
        f"{say('strike.again', minutes=number(STRIKE_AGAIN_MIN, 3))} {film}".rstrip(),
        picture("strike"),
        kind="rest",
        minutes=STRIKE_MIN,
        wait_min=STRIKE_AGAIN_MIN - STRIKE_MIN,
    )


def cure(batch: Batch, touched: str, cast: str, picture: str) -> BenchStep:
    """Say how long a pour cures, and how to tell that it is done."""
    room = batch.moulds.spec.casting.room_c
    return BenchStep(
        say("cure.title"),
        say("cure.text", "cure.done", time=in_room(batch.cure_h, "h", room), touched=touched, cast=cast),
        picture,
        kind="cure",
        wait_min=60 * batch.cure_h,
    )


def release(moulds: MouldSet, first: Material) -> Iterator[BenchStep]:
    """Describe the way from the last cured layer to a unit in the hand; `first` is Layer 1's silicone."""
    plan, cells, last = moulds.plan, len(moulds.plan.layout.cells), moulds.plan.steps[-1]
    cup, removed = spaced(last.cup), {removal.piece for removal in last.removals}
    if plan.of_kind("filament"):
        force = ""
        if first.tensile_mpa:
            force = number(float(first.tensile_mpa) * math.pi * (moulds.spec.moulds.filament_mm / 2) ** 2, 2)
        yield BenchStep(
            say("filament_out.title"),
            say(
                "filament_out.text",
                "filament_out.never_torn" if force else "filament_out.never",
                each="the" if cells == 1 else "each",
                force=force,
                silicone=first.name,
            ),
            picture_path("filament-out"),
            minutes=PULL_MIN * cells,
        )
    if any(base.name in removed for base in plan.standing(last, "base")):
        split = any(split.tool == "base" for split in plan.splits)
        yield BenchStep(
            say("base_off.title"),
            say(
                "base_off.leave",
                "base_off.split" if split else "base_off.whole",
                "base_off.stays",
                cup=cup,
                makes=moulds.plan.makes,
            ),
            picture_path("base-off"),
            minutes=LIFT_MIN * 2,
            required_tools=("blunt spatula",) if split else (),
        )
    title, out, path = "peel.title", "peel.off", "peel"
    if CAST in removed:
        title, out, path = "peel.push_title", "peel.push", "push-out"
    yield BenchStep(
        say(title),
        say(
            out,
            "peel.trim" if last.injected else "peel.trim_film",
            core=holds(moulds),
            makes=moulds.plan.makes,
            cup=cup,
        ),
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
        title = say("motor_in.several" if len(steps) > 1 else "motor_in.one", step=i + 1, steps=len(steps))
        path = picture_path(f"motor-{fitting.place}") if fitting.place else ""
        minutes = LAY_IN_MIN * len(moulds.plan.layout.cells)
        yield BenchStep(title, fitting.text, path, minutes=minutes, required_tools=fitting.required_tools)
    mouth, motor = ("cavity's mouth", "motor") if moulds.plan.makes == "unit" else ("cavities' mouths", "motors")
    ring = next((fitting for fitting in steps if fitting.mixed), None)
    if ring:
        silicone = _of_layer(silicones, ring.silicone)
        hours = cure_hours(silicone, casting.room_c)
        what, said = (
            ring.mixed,
            say("let_cure.silicone", silicone=silicone.name, time=in_room(hours, "h", casting.room_c)),
        )
    elif any(ADHESIVE in fitting.required_tools for fitting in steps):
        what, hours = "adhesive", ADHESIVE_CURE_H
        said = say("let_cure.adhesive", time=in_room(hours, "h", DATASHEET_C))
    else:
        return
    lies = "let_cure.mouth_up" if moulds.design.opens == "below" else "let_cure.skin_down"
    yield BenchStep(
        say("let_cure.title", cast=what),
        f"{said} {say(lies, makes=moulds.plan.makes, mouth=mouth, motor=motor)}",
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
    hours = cure_hours(film.silicone, spec.casting.room_c)
    yield from _mixed_later(film, spec)
    yield BenchStep(
        say("skin_tray.title"),
        say("skin_tray.blade" if moulds.plan.of_kind("blade") else "skin_tray.straight_edge"),
        picture_path("skin-tray"),
        minutes=pouring_min(cells),
        required_tools=("level", "pin"),
    )
    yield BenchStep(
        say("skin_on.title"),
        say("skin_on.text"),
        picture_path("skin-on"),
        minutes=LAY_IN_MIN * cells,
    )
    yield BenchStep(
        say("skin_cure.title"),
        say("skin_cure.text", time=in_room(hours, "h", spec.casting.room_c)),
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
    yield BenchStep(
        say("mix_later.title", use=mix.use),
        say(
            "mix_later.text",
            "mix_later.no_pot_life" if pot_min is None else "mix_later.pot_life",
            part_a=shown(mix.grams - part_b),
            silicone=mix.silicone.name,
            part_b=shown(part_b),
            mix=say("mix_later.mix_and_degas" if spec.casting.vacuum else "mix_later.mix"),
            pot_life="" if pot_min is None else in_room(pot_min, "min", spec.casting.room_c),
        ),
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
    drawn = dims.heights[-1] if moulds.plan.concentric else moulds.height
    high = next((each.printed_mm for each in off_layers(moulds) if each.what == OVER_ALL), drawn)
    height = "measure.height_layers" if high != drawn else "measure.height"
    if dims.skin:
        height = "measure.height_layers_skin" if high != drawn else "measure.height_skin"
    yield say(
        height,
        high=shown(high, 2),
        drawn=shown(drawn, 2),
        layer=number(spec.moulds.layer_mm, 3),
        closed=shown(high + dims.skin, 2),
    )
    if moulds.plan.concentric:
        yield say("measure.diameter", diameter=shown(2 * dims.outer_radius, 2))
        walls = "measure.walls"
        if len(masses_g) > 1:
            walls = "measure.walls_ribs" if off.ribs else "measure.walls_pushed"
        yield say(walls, off=number(off.at_worst_mm, 2), twice=number(2 * off.at_worst_mm, 2))
    else:
        yield moulds.plan.across
    if exit:
        opening = "measure.notch" if exit.high >= dims.heights[0] else "measure.slot"
        yield say(opening, width=shown(exit.width, 2), height=shown(exit.height, 2))
    weights = " + ".join(shown(each) for each in masses_g) + (f" = {shown(sum(masses_g))}" if len(masses_g) > 1 else "")
    grams = say(
        "measure.grams_skin" if skin_g else "measure.grams", weights=weights, closed=shown(sum(masses_g) + skin_g)
    )
    weigh = "measure.weigh" if spec.motor.absent else "measure.weigh_empty"
    if moulds.design.laid_in:
        weigh = "measure.weigh_laid_in"
    less = "measure.less_low" if high < drawn - 0.05 else "measure.less"
    if not moulds.plan.steps[-1].injected:
        less = "measure.less_strike_low" if high < drawn - 0.05 else "measure.less_strike"
    yield say(
        weigh,
        less,
        makes=moulds.plan.makes,
        motor="motor" if moulds.plan.makes == "unit" else "motors",
        grams=grams,
        high=shown(high, 2),
        drawn=shown(drawn, 2),
    )


def holds(moulds: MouldSet) -> str:
    """Return the tool that the silicone is cast on: "core"; moulds by complement need not have one."""
    return "core" if moulds.plan.concentric else "base"


def shown(value: float, decimals: int = 3) -> str:
    """Return grams, or mm to two decimals, as a scale or a caliper shows them."""
    return min(number(value, 3, zeros=True), f"{value:.{decimals}f}", key=len)
