"""What a person does from an empty mould to a unit with its motor in, step by step, and what to measure."""

from __future__ import annotations

import math
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from dataclasses import dataclass

from unitcad.casting.drawings import grip_of, side_places, tape_places, tongue_prop
from unitcad.casting.figures import (
    DEGASSING_MIN,
    HELD_BACK_ML,
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
    at_room,
    eccentricity,
    pouring_min,
    window_length,
)
from unitcad.casting.preparation import inner
from unitcad.casting.steps import BenchStep
from unitcad.casting.views import fed_through, picture_path
from unitcad.catalogue import Material
from unitcad.designs.design import Fitting
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.moulds.removal import CAST
from unitcad.moulds.ribs import ribs
from unitcad.spec import Spec
from unitcad.text import listed, number, spaced

TACK = (
    "it is done when a gloved fingertip, pressed on lightly and lifted, comes off without a pull and without a trace, "
    "and the dent of a fingernail springs back. If it still pulls or draws threads, wait half an hour and try again"
)
"""How to tell cured silicone from tacky silicone."""
LEVEL_AGAIN = (
    "What runs under the plate may tilt it: look at the level once more, and put paper under until it is right."
)
"""How the step that holds a cup or a lid ends: nothing is moved between it and the cure."""


@dataclass(frozen=True)
class Face:
    """A face of a tool that silicone takes its shape from, such as the bore of "cup1"."""

    tool: str
    face: str


@dataclass(frozen=True)
class BondFace:
    """A face of a tool whose cast bonds later: `to` says what to. Silicone does not bond where agent was."""

    face: Face
    to: str


def bond_faces(moulds: MouldSet) -> tuple[BondFace, ...]:
    """Return every face of the tools that forms what bonds later, or that lies beside it in a later pour."""
    plan, last = moulds.plan, moulds.plan.steps[-1]
    found = []
    for step in plan.steps:
        if step is not last:
            found.append((step.cup, "bore", f"layer {step.index + 1}"))
        if step.lid:
            found.append((step.lid, "underside", "circuit" if step is last else f"layer {step.index + 1}"))
    if not plan.concentric and not plan.pins and len(plan.steps) > 1:
        # Its bore may meet a layer that is cured already, where the last one has to bond; a back sheet's, whose cups
        # stand on pins, meets none.
        found.append((last.cup, "bore", f"layer {last.index - 1}"))
    found.append(("base", "core", "motor"))
    if len(plan.steps) > 1:
        found.append(("base", "seat", "the next layer"))
    return tuple(BondFace(Face(tool, face), to) for tool, face, to in found)


def agent_faces(moulds: MouldSet, step: Step) -> tuple[Face, ...]:
    """Return the faces that may get release agent before a pour: the last cup's bore, where nothing bonds later."""
    bore = Face(step.cup, "bore")
    bonds = any(bond.face == bore for bond in bond_faces(moulds))
    return () if bonds or step is not moulds.plan.steps[-1] else (bore,)


def pour_steps(batch: Batch, views: Container[str]) -> Iterator[BenchStep]:
    """Describe one pour, from an empty mould to a cured layer on the core; `views`: the names of the pictures."""
    moulds, step, n = batch.moulds, batch.step, batch.step.index
    plan, spec, tongues = moulds.plan, moulds.spec, moulds.plan.standing(step, "tongue")
    cells, the_tongue = len(plan.layout.cells), "the tongue" if len(tongues) == 1 else "each tongue"
    # Each cavity has a groove, which stops beside a window.
    groove = "the groove" if len(step.layer) == 1 else "the grooves round the cavities"

    def picture(name: str) -> str:
        path = f"pour{n}-{name}"
        return picture_path(path) if path in views else ""

    if n > 1:
        bond = "Its outside" if plan.concentric else f"The face that Layer {n} touches"
        yield BenchStep(
            f"Wipe Layer {n - 1}",
            f"Wipe Layer {n - 1} with isopropanol and let it dry. {bond} is the bond face: no release "
            "agent on it, ever, no grease, no fingers. No sourced window exists for when to pour the next layer; as "
            "soon as it is cured, on the same day, is the usual practice (assumed), and silicone bonds to cured "
            "silicone of its kind.",
            picture("bond-face"),
            minutes=2.0 * cells,
            needs=("isopropanol and lint-free wipes",),
        )
    laid = assembly(moulds) if moulds.design.laid_in == n else ()
    dry = True
    for i, fitting in enumerate(laid):
        if fitting.mix and dry:
            yield from mixed(batch)
            dry = False
        title = f"Lay in, {i + 1} of {len(laid)}" if len(laid) > 1 else "Lay in"
        shown = "" if i else picture("laid-in")
        yield BenchStep(title, fitting.text, shown, minutes=LAY_IN_MIN * cells, needs=fitting.needs)
    if any(body.kind in ("circuit", "wire") for body in step.inserts):
        yield BenchStep(
            "Grease the lead",
            f"Coat the {lead(moulds)} thinly with petroleum jelly where the slot of cup {n} comes, outside "
            "the cavity only: it keeps silicone from weeping out.",
            minutes=1.0 * cells,
            needs=("petroleum jelly",),
        )
    if flanks := moulds.greased(step):
        yield BenchStep(
            "Grease the flanks",
            f"Before cup {n} goes on, smear petroleum jelly thinly on {flanks}. A film that shines, no beads: "
            "it keeps silicone out of the slits beside the cup's slots. Wipe off what lies elsewhere.",
            picture("grease"),
            minutes=1.0 * cells,
            needs=("petroleum jelly",),
        )
    # Which faces get release agent, and why no other.
    faces, agent = agent_faces(moulds, step), "No release agent on any piece: what is cast here bonds later."
    if faces and plan.pins:
        earlier = f" or Layer {n - 1}" if n > 1 else ""
        agent = (
            f"Release agent, if any, sparingly and only on the sheet's bed and the bores of cup {n}: a "
            "printed cup holds a thin sheet fast. Put it on away from the base and let it dry. None in the slots for "
            f"the fins, and none on base{earlier}, ever: what bonds later is cast there."
        )
    elif faces:
        where = " and ".join(f"the {face.face} of {spaced(face.tool)}" for face in faces)
        agent = (
            f"Release agent, if any, sparingly and only on {where}: put it on away from the base and let it dry. No "
            f"other face gets any, the {holds(moulds)} neither."
        )
    # How the cup comes to stand where it should: by its ribs, or pushed as the one before.
    if ribs(spec, plan.layout):
        on = "on and press it down evenly until it sits. Its ribs centre it: push it to no side."
    elif plan.pins:
        on = (
            "on over the pins, cut corner over cut corner, and press it down flat. The pins let "
            f"it move by {number(plan.pins.clearance, 2)} mm each way: push it to and fro, along the base and across, "
            "and leave it in the middle."
        )
    else:
        on = "on and push it towards the cut corner, "
        on += "as the cup before" if n > 1 else "so that the play lies on one side"
        on += f": Layer {n} lies between two cup positions." if n > 1 and plan.concentric else "."
    yield BenchStep(
        f"Cup {n} on",
        f"{agent} Put cup {n} {on}",
        picture("cup-on"),
        minutes=2.0,
        needs=("release agent",) if faces else (),
    )
    if tongues:
        slot = "" if n == 1 else " and the slot that it left in the layer before"
        seat = number(window_length(moulds, step), 2)
        yield BenchStep(
            "Tongue in, grease",
            f"Push {the_tongue} in through the window{slot}, hollow end ahead, until {seat} mm are still to go. Smear "
            f"the {seat} mm just outside the cup thinly, on all four sides, with petroleum jelly: a film that shines, "
            "no beads.",
            picture("tongue-in"),
            minutes=1.5 * cells,
            needs=("petroleum jelly",),
        )
        yield _tongue_home(moulds, n, the_tongue, picture("tongue-home"))
    if step.lid:
        outside = f": outside {groove}, since what creeps under the lid runs in there" if step.groove else ""
        yield BenchStep(
            f"Lid {n} on",
            f"Draw a thin line of petroleum jelly all round the rim of cup {n}, near its outer edge{outside}. Put lid "
            f"{n} on, cut corner over cut corner, and press it down.",
            picture("lid-on"),
            minutes=LIFT_MIN,
            needs=("petroleum jelly",),
        )
        yield lid_held(step, picture("lid-held"))
    else:
        yield _cup_held(moulds, n, picture("hold"))
    if dry:
        yield from mixed(batch)
    if step.lid:
        yield from injected(batch, picture("inject"))
    else:
        if cells == 1 or len(step.layer) > 1:
            each = ", one cavity after the other, each" if len(step.layer) > 1 else ""
            over = "it stands over its rim" if each else "the cavity stands over its rim"
            poured = f"Pour in a thin thread{each} at one place until {over}."
        else:
            poured = (
                "Pour in a thin thread, first beside each unit's earlier layer until that is covered, so that no air "
                "stays in the deep places, then from there outwards until the whole cavity stands over its rim."
            )
        strip = not plan.concentric and plan.dimensions.core_height > step.rim
        tool = "the blade upright, its narrow edge down"
        if strip:
            tool = (
                "a straight strip of stiff card or plastic, as wide as the cavity, held upright (what stands on the "
                "base beside the cavity is higher than this rim and in the blade's way)"
            )
        yield from struck(
            batch,
            f"{poured} Prick the bubbles that you see with a pin.",
            f"Strike off along the rim with {tool}, in one slow stroke from end to end; what it takes goes "
            f"{f'into {groove}' if step.groove else 'onto a scrap, since this cup has no groove'}.",
            f"{' The window weeps a little.' if tongues else ''} The film that it leaves on the rim cures too: it "
            "lifts off with the cup, and what of it stays on the layer's edge is trimmed at the end.",
            cells,
            cells,
            picture,
            ("stiff card or plastic",) if strip else (),
        )
    touched = (
        "the bead on a vent" if step.lid else f"the silicone in {groove}" if step.groove else "what was struck off"
    )
    yield cure(batch, touched, "layer", picture("filled"))
    if tongues:
        yield BenchStep(
            "Tongue out FIRST",
            f"Pull {'the tongue' if len(tongues) == 1 else 'every tongue'} out FIRST, straight along "
            f"itself, by its {grip_of(moulds)}, over the card, with a steady pull. A cup lifted over a tongue tears "
            "the layer. Then take the card away: it covers the pry slot.",
            picture("tongue-out"),
            minutes=PULL_MIN * len(tongues),
        )
    if step.lid:
        yield BenchStep(
            "Lid off",
            f"Take off what held the lid down. The lid stands out over cup {n} all round: push its edge up "
            "from below, with the thumbs or the blunt spatula on two opposite sides, a little at a time, the cup held "
            "down. Then lift it straight up: sprue and vents tear off at the layer. Trim them flush with a knife.",
            picture("lid-off"),
            minutes=LIFT_MIN,
            needs=("sharp knife", "blunt spatula"),
        )
    if all(removal.piece != step.cup for removal in step.removals):
        return
    seat, split = "base" if plan.pins else "plinth", len(plan.pieces_of(step.cup)) > 1
    if split:
        pried = (
            "Lay a screwdriver in every pry slot, its tip under the cup, and press the handles down a little at a "
            "time, one after the other and round again; at a piece of the cup over no slot turn a blunt spatula under "
            f"its outer edge. Its dovetails slide up and down: go on until every piece has come free of the {seat}."
        )
    else:
        pried = (
            "Lay a screwdriver in each of the two pry slots, its tip under the cup. Press both handles down at once, a "
            f"little at a time, until the cup comes free of the {seat}."
        )
    yield BenchStep(
        f"Cup {n} off",
        f"{'' if step.lid else 'Take off what held the cup down. '}{pried} Lift cup {n} straight up. "
        f"Layer {n} stays on the {holds(moulds)}.",
        picture("cup-off"),
        minutes=LIFT_MIN,
        needs=("blunt spatula",) if split else (),
    )


def _cup_held(moulds: MouldSet, cup: int, picture: str) -> BenchStep:
    """Say how an open cup is held down while it is struck off: how many strips of tape, and where they stick."""
    (left, *others), split = tape_places(moulds), moulds.plan.splits
    strips = f"{len(others) + 1} strips of tape" if others else "a strip of tape"
    between = [number(at - left, 2) for at in others[:-1]]
    where = ": one at either end" if others else ""
    if between:
        where += f", {'one' if len(between) == 1 else 'the others'} {listed(between)} mm from the left one"
    pieces = ""
    if split:
        pieces = " Each piece of cup and base that reaches these sides has one; one over a seam holds both pieces."
        if sides := len(side_places(moulds)):
            count = "a strip" if sides == 1 else f"{sides} strips"
            pieces += f" On each of the two other sides {count} for the pieces between, as the picture shows."
        if any(map(inner, split)):
            pieces += (
                " A piece without an outer edge has none: nothing lifts it while the silicone cures, and its dovetails "
                "keep it in place sideways."
            )
    return BenchStep(
        f"Hold cup {cup} down",
        f"Hold cup {cup} down while it is struck off: on each of the two sides "
        f"{'where the filaments come out' if split else 'without a pry slot'} run "
        f"{strips} from the cup's wall, below the rim, round the plate's edge to its underside, beside the "
        f"filament where there is one{where}.{pieces} Clamps or weights do as well where they leave the rim "
        f"free for the blade. {LEVEL_AGAIN}",
        picture,
        minutes=2.0,
        needs=("paper",),
    )


def lid_held(step: Step, picture: str) -> BenchStep:
    """Say how a lid is held down while silicone is injected."""
    return BenchStep(
        f"Hold lid {step.index} down",
        f"Hold it down with rubber bands round lid and base, or with a clamp, clear of sprue and vents. {LEVEL_AGAIN}",
        picture,
        minutes=2.0,
        needs=("paper",),
    )


def _tongue_home(moulds: MouldSet, pour: int, the_tongue: str, picture: str) -> BenchStep:
    """Say how the tongues come to stand, how to see that they do, and what bears their grips."""
    marked, grip, one = len(moulds.plan.steps) > 1 and pour == 1, grip_of(moulds), the_tongue == "the tongue"
    if pour == 1:
        mark = (
            f" Mark {the_tongue} with a pen where it leaves the cup's wall: in the next pour the mark shows where it "
            "stops."
        )
        stops = (
            f"Push {the_tongue} on until its hollow end stops against the core: it lies on the core's ledge. Look down "
            f"into the bore: no gap between its end and the core, none under it on the ledge.{mark * marked}"
        )
    else:
        stops = (
            f"Push {the_tongue} on until it stops: its hollow end lies on the core's ledge again, under Layer 1. The "
            "mark from pour 1 must be at the cup's wall; farther out, it caught on the slot's edge: draw it back and "
            "try again."
        )
    bears = ""
    if prop := tongue_prop(moulds):
        pads = "a pad" if len(prop.pads) == 1 else "a pad on each side"
        bears = (
            f" Its {grip} hangs free: put {pads} of stacked card {number(prop.thickness_mm, 3)} mm thick under "
            f"{'it' if one else f'the {grip}s'} ({number(prop.width_mm, 2)} x {number(prop.length_mm, 2)} mm; "
            f"{number(prop.tolerance_mm, 2)} mm more or less "
            "does no harm: computed, the window's clearance), on the plate, against the cup. It must neither lift the "
            "tongue nor leave air under it. Nothing may lean on its outer end."
        )
    return BenchStep(
        "Tongue home",
        f"{stops} Wipe off what grease came into the bore, with a dry cotton bud.{bears}",
        picture,
        minutes=1.5 * len(moulds.plan.layout.cells),
        needs=("pen", "cotton buds") if marked else ("cotton buds",),
    )


def mixed(batch: Batch) -> Iterator[BenchStep]:
    """Describe the way from the bottles to a mix without air."""
    mix, cells, larger = batch.mix, len(batch.step.layer), ""
    if mix.mix_error_pct > MOST_ERROR_PCT:
        enough = number(mix.mix_g * mix.mix_error_pct / MOST_ERROR_PCT, 3)
        larger = f": too much; mix at least {enough} g (casting.minimum_mix_g) or use a finer scale"
    yield BenchStep(
        "Weigh",
        f"Weigh {shown(mix.part_a_g)} g of {batch.silicone.name} part A and {shown(mix.part_b_g)} g of part B "
        f"({shown(mix.net_g)} g go into {cells} cavit{'y' if cells == 1 else 'ies'}; so small a batch would be "
        f"{number(mix.net_error_pct, 2)} % wrong in the ratio, this one "
        f"{number(mix.mix_error_pct, 2)} %{larger}). Stir each bottle first. Weigh part B into the cup "
        "that part A is in; note what the scale shows.",
        kind="weigh",
        minutes=WEIGH_MIN,
    )
    yield BenchStep(
        "Mix",
        f"Mix for {number(MIXING_MIN, 3)} min (assumed), scraping walls and bottom, until no streak is left; the "
        "pot life runs from now. Keep the mixing cup: if what is left in it never cures, the mix was wrong; if it does "
        "and the mould's does not, a surface inhibits it.",
        kind="mix",
        minutes=MIXING_MIN,
    )
    if batch.vacuum:
        yield BenchStep("Degas", batch.verdict, minutes=DEGASSING_MIN)


def injected(batch: Batch, picture: str) -> Iterator[BenchStep]:
    """Say how the mix gets into the syringe, and from there into a cavity under a lid."""
    mix = batch.mix
    refilled = " Fill it again while the mix flows." if mix.syringe_size_ml < mix.millilitres else ""
    yield BenchStep(
        "Draw up",
        f"Draw all of it into a syringe of {number(mix.syringe_size_ml, 3)} ml: {number(mix.syringe_ml, 3)} ml fill "
        f"the cavities and what tip and plunger hold back, some {number(HELD_BACK_ML, 2)} ml (assumed). The rest "
        f"of the {number(mix.millilitres, 3)} ml is for the beads at the vents, for leaks, and for what stays in the "
        f"mixing cup.{refilled} Point it up and push until silicone, no air, stands at the tip.",
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
    needs: tuple[str, ...] = (),
) -> Iterator[BenchStep]:
    """Say how an open mould is filled and struck off, in its words; `coats`: cavities that are brushed at first."""
    rest = batch.rest_min
    if not batch.vacuum and not rest:
        minutes = 1.0 * coats
        yield BenchStep("Brush a first coat", batch.verdict, minutes=minutes, needs=("small brush",))
    minutes = pouring_min(cells) - STRIKE_MIN
    yield BenchStep("Pour", poured, picture("pour"), kind="pour", minutes=minutes, needs=("pin",))
    if not batch.vacuum and rest:
        yield BenchStep("Let bubbles rise", batch.verdict, kind="rest", wait_min=rest)
    yield BenchStep("Strike off", strike, picture("strike"), minutes=STRIKE_MIN, needs=needs)
    yield BenchStep(
        "Wait, strike again",
        f"Wipe it. Top up and strike again after {number(STRIKE_AGAIN_MIN, 3)} min (assumed).{film}",
        picture("strike"),
        kind="rest",
        minutes=STRIKE_MIN,
        wait_min=STRIKE_AGAIN_MIN - STRIKE_MIN,
    )


def cure(batch: Batch, touched: str, cast: str, picture: str) -> BenchStep:
    """Say how long a pour cures, and how to tell that it is done."""
    return BenchStep(
        "Cure",
        f"Let it cure, level, for {number(batch.cure_h, 2)} h. Touch {touched}, not the {cast}, to see whether it is "
        f"done: {TACK}.",
        picture,
        kind="cure",
        wait_min=60 * batch.cure_h,
    )


def never_pushed(spec: Spec, inner: Material) -> str:
    """Say what pulling a filament does, and what pushing it would: `inner` is Layer 1's silicone."""
    tear = float(inner.tensile_mpa) * math.pi * (spec.moulds.filament_mm / 2) ** 2
    return (
        f"it lets air in under the unit. Never push it through: {number(tear, 2)} N on its end tear {inner.name} "
        f"(computed: tensile strength, {inner.tensile_mpa.status}, x its area)."
    )


def release(moulds: MouldSet, first: Material) -> Iterator[BenchStep]:
    """Describe the way from the last cured layer to a unit in the hand; `first` is Layer 1's silicone."""
    plan, cells, last = moulds.plan, len(moulds.plan.layout.cells), moulds.plan.steps[-1]
    cup, removed = spaced(last.cup), {removal.piece for removal in last.removals}
    if plan.of_kind("stub"):
        each = "the" if cells == 1 else "each"
        yield BenchStep(
            "Filament out",
            f"Lift the mould off the bench first: {each} bent end lies under its plate. Pull {each} filament out "
            f"downwards, by its bent end: {never_pushed(moulds.spec, first)}",
            picture_path("filament-out"),
            minutes=PULL_MIN * cells,
        )
    if any(base.name in removed for base in plan.standing(last, "base")):
        split = next((split for split in plan.splits if split.tool == "base"), None)
        held = f"Hold the mould off the bench by {cup}"
        levered = (
            f"{held}, put a screwdriver in each of the two pry slots, and lever the base off downwards, on both sides "
            "at once and a little at a time, until it comes free of the silicone. It must come straight."
        )
        if split:
            levered = (
                "Leave the tape over the seams of the underside on: it ties the pieces together. Dovetails slide up "
                f"and down, so a piece that nothing levers stays on its cores. {held}. Lever the base off downwards "
                "with a screwdriver in every pry slot; at a piece that has none, push a blunt spatula in between it "
                "and the cup, at its outer edge, and turn it. Go round and round, a little at each place, so that no "
                "piece runs ahead of the next one and all come free of the silicone together. The base must come "
                "straight."
            )
        if split and inner(split):
            levered += (
                " A piece without an outer edge hangs by the tape alone: before you lever, stick more tape across it "
                "from neighbour to neighbour, both ways, but not over the holes of the filaments, which let air in. "
                "Let its neighbours get a millimetre ahead at most, and pull at the tape under it."
            )
        yield BenchStep(
            "Base off, downwards",
            f"Take off what held the cup down. Leave {cup} on: it can't be lifted past the silicone that lies over it. "
            f"{levered} The {moulds.makes} stays in {cup}.",
            picture_path("base-off"),
            minutes=LIFT_MIN * 2,
            needs=("blunt spatula",) if split else (),
        )
    film = ", and the film that the blade left along the edge," if moulds.spec.moulds.pour == "open" else ""
    title, what, out, path = (
        "Peel off",
        "unit's edge",
        f", then peel it off the {holds(moulds)} straight up",
        "peel",
    )
    if CAST in removed:
        title, what, path = "Push out", f"edge of the {moulds.makes}", "push-out"
        out = f". Push it up out of {cup} from below with the thumbs, first at the edge, then unit by unit"
    yield BenchStep(
        title,
        f"Loosen the {what} all round with a blunt spatula{out}. Trim the flash{film} with small scissors.",
        picture_path(path),
        minutes=PEEL_MIN * cells,
        needs=("small scissors", "blunt spatula"),
    )


def motor_in(moulds: MouldSet, silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe how motor and circuit go in after casting; nothing where they were laid in."""
    if moulds.design.laid_in:
        return
    fittings, casting = assembly(moulds), moulds.spec.casting
    for i, fitting in enumerate(fittings):
        title = f"Motor in, {i + 1} of {len(fittings)}" if len(fittings) > 1 else "Motor in"
        path = picture_path("motor-home" if i or fed_through(moulds) else "motor-in")
        minutes = LAY_IN_MIN * len(moulds.plan.layout.cells)
        yield BenchStep(title, fitting.text, path, minutes=minutes, needs=fitting.needs)
    named = {fitting.silicone for fitting in fittings if fitting.silicone}
    ring = any(fitting.mixed == "ring" for fitting in fittings)
    cures = {
        each.name: at_room(float(each.cure_h), casting.room_c) for each in _by_layer(silicones, named) or silicones
    }
    hours = ", ".join(f"{name} {number(hour, 2)} h" for name, hour in cures.items())
    mouth, motor = ("cavity's mouth", "motor") if moulds.makes == "unit" else ("cavities' mouths", "motors")
    least = f"mixed like any batch ({number(casting.minimum_mix_g, 3)} g at least)"
    smeared = f"A smear of silicone is {least} and spread as thin as butter."
    mixed = f"The silicone of a ring is {least}." if ring else smeared
    yield BenchStep(
        "Let the ring cure" if ring else "Let the smear cure",
        f"{mixed} It needs its whole cure ({hours}): lay the {moulds.makes} down with the {mouth} up, level, and don't "
        f"run the {motor} before.{'' if ring else ' Without a smear there is nothing to wait for.'}",
        picture_path("motor-home"),
        kind="cure",
        wait_min=60 * max(cures.values()),
    )


def after_pours(moulds: MouldSet, silicones: Sequence[Material]) -> list[AfterPours]:
    """Return the silicones that are mixed after the pours to hold the motors, one batch each."""
    cells, casting = len(moulds.plan.layout.cells), moulds.spec.casting
    found: dict[Material, AfterPours] = {}
    for fitting in () if moulds.design.laid_in else assembly(moulds):
        if fitting.mixed:
            (material,) = _by_layer(silicones, [fitting.silicone])
            net = cells * fitting.volume_mm3 * float(material.density_g_cm3) / 1000
            grams = max(net * (1 + casting.waste), casting.minimum_mix_g)
            found.setdefault(material, AfterPours(material, fitting.mixed, grams))
    return list(found.values())


def _by_layer(silicones: Sequence[Material], layers: Iterable[int]) -> list[Material]:
    """Return the silicones of layers (from 1, -1 the last)."""
    return list(dict.fromkeys(silicones[min(i, len(silicones)) - (i > 0)] for i in sorted(layers)))


def assembly(moulds: MouldSet) -> tuple[Fitting, ...]:
    """Describe how motor and circuit go into the body, or into the mould: in the design's words, where it has any."""
    if moulds.assembly:
        return moulds.assembly
    spec, design, leaves = moulds.spec, moulds.design, lead(moulds)
    found = []
    if spec.fpcb:
        found.append(
            Fitting("Solder the motor to the circuit's pad, and try the motor.", ("soldering iron and solder",))
        )
    elif spec.wires:
        found.append(Fitting("Try the motor on its wires."))
    if design.laid_in:
        return (*found, Fitting("Lay everything that is not silicone where the drawing of this pour shows it."))
    ahead = ", the pad ahead," if spec.fpcb and design.opens == "below" else ""
    way = f", and lay the {leaves} in the notch" if leaves else ""
    side = "the skin" if design.opens == "below" else "above"
    return (
        *found,
        Fitting(f"Push the motor{ahead} into the cavity from {side}{way}."),
        Fitting(
            "A smear of Layer 1's silicone holds it (assumed: silicone bonds poorly to bare metal and polyimide). The "
            "design's file says nothing more of the assembly; a Design with an assembly of its own can.",
            silicone=1,
            mixed="smear",
        ),
    )


def measurements(moulds: MouldSet, masses_g: Sequence[float], slot_height: float | None) -> Iterator[str]:
    """Name what to measure on the first part, and what it should be.

    `masses_g`: of each layer of one unit, trimmed. `slot_height`: of the slot as the slicer makes the tongue (mm), None
    where it is the drawn one.
    """
    spec, dims, off, exit = moulds.spec, moulds.plan.dimensions, eccentricity(moulds), moulds.plan.dimensions.exit
    yield f"Height over all: {shown(dims.heights[-1], 2)} mm. A cup that did not seat shows here."
    if moulds.plan.concentric:
        yield f"Diameter at the skin: {shown(2 * dims.outer_radius, 2)} mm, in two directions."
        pushed = "" if off.ribs else " unless both cups were pushed the same way"
        further = f", each further layer by {number(2 * off.at_worst_mm, 2)} mm{pushed}"
        yield (
            "Walls at the skin, at four places: their spread is the cup's shift. Layer 1 may vary by "
            f"{number(off.at_worst_mm, 2)} mm either way{further if len(masses_g) > 1 else ''}."
        )
    else:
        yield moulds.across
    if exit:
        opening = "notch" if exit.high >= dims.heights[0] else "slot"
        layers = f"in layers of {number(spec.moulds.layer_mm, 3)}"
        printed = f" ({shown(slot_height, 2)} if the tongue was printed {layers})" if slot_height else ""
        size = f"{shown(exit.width, 2)} wide, {shown(exit.height, 2)} high{printed}"
        yield f"The {opening}: {size}, open all the way."
    weights = " + ".join(shown(each) for each in masses_g) + (f" = {shown(sum(masses_g))}" if len(masses_g) > 1 else "")
    low = "" if spec.moulds.pour == "injected" else " or a low strike"
    motor = "motor" if moulds.makes == "unit" else "motors"
    weighed = f"Weigh one {moulds.makes}, trimmed, without {motor} and circuit: {weights} g."
    if moulds.design.laid_in:
        weighed = (
            f"The silicone of one unit, trimmed, weighs {weights} g. What was laid in comes on top: weigh it before."
        )
    yield f"{weighed} Less means air{low}."


def lead(moulds: MouldSet) -> str:
    """Return what leads out of the silicone."""
    return "tail" if moulds.spec.fpcb else "wires" if moulds.spec.wires else ""


def holds(moulds: MouldSet) -> str:
    """Return what the silicone is cast on: "core"; moulds by complement need not have one."""
    return "core" if moulds.plan.concentric else "base"


def shown(value: float, decimals: int = 3) -> str:
    """Return grams, or mm to two decimals, as a scale or a caliper shows them."""
    return min(number(value, 3, zeros=True), f"{value:.{decimals}f}", key=len)
