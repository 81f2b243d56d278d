"""What a person does in one pour, step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from unitcad.casting import figures as fig
from unitcad.casting.bench_step import BenchStep
from unitcad.casting.bench_views import View, picture_path
from unitcad.casting.figures import MOST_ERROR_PCT, STRIKE_AGAIN_MIN, Mix, at_room, window_length
from unitcad.casting.finishing import assembly, holds, lead, shown
from unitcad.casting.holding import cup_held, lid_held
from unitcad.casting.release_agent import agent_faces
from unitcad.casting.tongue_prop import grip_of, tongue_prop
from unitcad.catalogue import Material
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.moulds.ribs import ribs
from unitcad.spec import Spec
from unitcad.text import number, spaced

GREASE = "Grease the flanks"
"""The step that seals slits beside the cavity before the cup hides them."""
TACK = (
    "it is done when a gloved fingertip, pressed on lightly and lifted, comes off without a pull and without a trace, "
    "and the dent of a fingernail springs back. If it still pulls or draws threads, wait half an hour and try again"
)
"""How to tell cured silicone from tacky silicone."""


def pour_steps(
    moulds: MouldSet, step: Step, silicone: Material, mix: Mix, verdict: str, views: dict[str, View]
) -> Iterator[BenchStep]:
    """Describe one pour, from an empty mould to a cured layer on the core."""
    plan, first, tongues = moulds.plan, step.index == 1, moulds.plan.standing(step, "tongue")
    cells, each_tongue = len(plan.layout.cells), "the tongue" if len(tongues) == 1 else "each tongue"
    groove = _groove(step)

    def picture(name: str) -> str:
        path = f"pour{step.index}-{name}"
        return picture_path(path) if path in views else ""

    if not first:
        bond = "Its outside" if plan.concentric else f"The face that Layer {step.index} touches"
        yield BenchStep(
            f"Wipe Layer {step.index - 1}",
            f"Wipe Layer {step.index - 1} with isopropanol and let it dry. {bond} is the bond face: no release "
            "agent on it, ever, no grease, no fingers. No sourced window exists for when to pour the next layer; as "
            "soon as it is cured, on the same day, is the usual practice (assumed), and silicone bonds to cured "
            "silicone of its kind.",
            picture("bond-face"),
            minutes=fig.WIPE_MIN * cells,
        )
    laid = assembly(moulds) if moulds.design.laid_in == step.index else ()
    wet = any("the mix" in text for text in laid)
    for i, text in enumerate(laid):
        if "the mix" in text and not any("the mix" in each for each in laid[:i]):
            yield from mixed(moulds, step, silicone, mix, verdict)
        title = f"Lay in, {i + 1} of {len(laid)}" if len(laid) > 1 else "Lay in"
        yield BenchStep(title, text, picture("laid-in") if i == 0 else "", minutes=fig.LAY_IN_MIN * cells)
    if any(body.kind in ("circuit", "wire") for body in step.inserts):
        yield BenchStep(
            "Grease the lead",
            f"Coat the {lead(moulds)} thinly with petroleum jelly where the slot of cup {step.index} comes, outside "
            "the cavity only: it keeps silicone from weeping out.",
            minutes=fig.GREASE_MIN * cells,
        )
    if flanks := moulds.greased(step):
        yield BenchStep(
            GREASE,
            f"Before cup {step.index} goes on, smear petroleum jelly thinly on {flanks}. A film that shines, no beads: "
            "it keeps silicone out of the slits beside the cup's slots. Wipe off what lies elsewhere.",
            picture("grease"),
            minutes=fig.GREASE_MIN * cells,
        )
    yield BenchStep(
        f"Cup {step.index} on",
        f"{_release_agent(moulds, step)} {_put_on(moulds, step)}",
        picture("cup-on"),
        minutes=fig.CUP_ON_MIN,
    )
    if tongues:
        slot = "" if first else " and the slot that it left in the layer before"
        seat = number(window_length(moulds, step), 2)
        yield BenchStep(
            "Tongue in, grease",
            f"Push {each_tongue} in through the window{slot}, hollow end ahead, until {seat} mm are still to go. Smear "
            f"the {seat} mm just outside the cup thinly, on all four sides, with petroleum jelly: a film that shines, "
            "no beads.",
            picture("tongue-in"),
            minutes=fig.TONGUE_MIN * cells,
        )
        yield _tongue_home(moulds, step, picture("tongue-home"))
    if step.lid:
        yield BenchStep(
            f"Lid {step.index} on",
            f"Draw a thin line of petroleum jelly all round the rim of cup {step.index}, near its outer edge"
            f"{f': outside {groove}, since what creeps under the lid runs in there' if step.groove else ''}. Put lid "
            f"{step.index} on, cut corner over cut corner, and press it down.",
            picture("lid-on"),
            minutes=fig.LIFT_MIN,
        )
        yield lid_held(step, picture("lid-held"))
    else:
        yield cup_held(moulds, step, picture("hold"))
    if not wet:
        yield from mixed(moulds, step, silicone, mix, verdict)
    rests = rest(moulds.spec, step, silicone, verdict)
    if step.lid:
        yield draw_up(mix)
        if not moulds.spec.casting.vacuum:
            yield rests
        yield inject(moulds, picture("inject"))
    else:
        if not moulds.spec.casting.vacuum and not rests.wait_min:
            yield BenchStep("Brush a first coat", verdict, minutes=fig.BRUSH_MIN * cells)
        taken = f"into {groove}" if step.groove else "onto a scrap, since this cup has no groove"
        yield BenchStep(
            "Pour",
            f"{_poured(step, cells)} Prick the bubbles that you see with a pin.",
            picture("pour"),
            kind="pour",
            minutes=fig.pouring_min(cells) - fig.STRIKE_MIN,
        )
        if not moulds.spec.casting.vacuum and rests.wait_min:
            yield rests
        tool = "the blade upright, its narrow edge down"
        if not plan.concentric and plan.dimensions.core_height > step.rim:
            tool = (
                "a straight strip of stiff card or plastic, as wide as the cavity, held upright (what stands on the "
                "base beside the cavity is higher than this rim and in the blade's way)"
            )
        yield BenchStep(
            "Strike off",
            f"Strike off along the rim with {tool}, in one slow stroke from end to end; what it takes goes {taken}.",
            picture("strike"),
            minutes=fig.STRIKE_MIN,
        )
        again = " The window weeps a little." if tongues else ""
        yield BenchStep(
            "Wait, strike again",
            f"Wipe it. Top up and strike again after {number(STRIKE_AGAIN_MIN, 3)} min (assumed).{again} The "
            "film that it leaves on the rim cures too: it lifts off with the cup, and what of it stays on the "
            "layer's "
            "edge is trimmed at the end.",
            picture("strike"),
            kind="rest",
            minutes=fig.STRIKE_MIN,
            wait_min=STRIKE_AGAIN_MIN - fig.STRIKE_MIN,
        )
    yield from _cure_and_open(moulds, step, silicone, picture)


def rest(spec: Spec, step: Step, silicone: Material, verdict: str) -> BenchStep:
    """Say how bubbles rise where there is no vacuum, in the words of the verdict on them."""
    return BenchStep("Let bubbles rise", verdict, kind="rest", wait_min=fig.rest_min(spec, step.rim, silicone))


def _groove(step: Step) -> str:
    """Return what to call the overflow grooves: each cavity has one, which stops beside a window."""
    return "the groove" if len(step.layer) == 1 else "the grooves round the cavities"


def _poured(step: Step, cells: int) -> str:
    """Say how the cavities are filled: one, each by itself, or one that joins all cells."""
    if len(step.layer) > 1:
        return "Pour in a thin thread, one cavity after the other, each at one place until it stands over its rim."
    if cells > 1:
        return (
            "Pour in a thin thread, first beside each unit's earlier layer until that is covered, so that no air stays "
            "in the deep places, then from there outwards until the whole cavity stands over its rim."
        )
    return "Pour in a thin thread at one place until the cavity stands over its rim."


def mixed(moulds: MouldSet, step: Step, silicone: Material, mix: Mix, verdict: str) -> Iterator[BenchStep]:
    """Describe the way from the bottles to a mix without air."""
    cells = len(step.layer)
    yield BenchStep(
        "Weigh",
        f"Weigh {shown(mix.part_a_g)} g of {silicone.name} part A and {shown(mix.part_b_g)} g of part B "
        f"({shown(mix.net_g)} g go into {cells} cavit{'y' if cells == 1 else 'ies'}; so small a batch would be "
        f"{number(mix.net_error_pct, 2)} % wrong in the ratio, this one "
        f"{number(mix.mix_error_pct, 2)} %{_larger_batch(mix)}). Stir each bottle first. Weigh part B into the cup "
        "that part A is in; note what the scale shows.",
        kind="weigh",
        minutes=fig.WEIGH_MIN,
    )
    yield BenchStep(
        "Mix",
        f"Mix for {number(fig.MIXING_MIN, 3)} min (assumed), scraping walls and bottom, until no streak is left; the "
        "pot life runs from now. Keep the mixing cup: if what is left in it never cures, the mix was wrong; if it does "
        "and the mould's does not, a surface inhibits it.",
        kind="mix",
        minutes=fig.MIXING_MIN,
    )
    if moulds.spec.casting.vacuum:
        yield BenchStep("Degas", verdict, minutes=fig.DEGASSING_MIN)


def _tongue_home(moulds: MouldSet, step: Step, picture: str) -> BenchStep:
    """Say how the tongues come to stand, how to see that they do, and what bears their grips."""
    tongues, prop = moulds.plan.standing(step, "tongue"), tongue_prop(moulds)
    each, one = ("the tongue", "its") if len(tongues) == 1 else ("each tongue", "its")
    if step.index == 1:
        again = (
            f" Mark {each} with a pen where it leaves the cup's wall: in the next pour the mark shows where it stops."
            if len(moulds.plan.steps) > 1
            else ""
        )
        stops = (
            f"Push {each} on until {one} hollow end stops against the core: it lies on the core's ledge. Look down "
            f"into the bore: no gap between its end and the core, none under it on the ledge.{again}"
        )
    else:
        stops = (
            f"Push {each} on until it stops: its hollow end lies on the core's ledge again, under Layer 1. The mark "
            "from pour 1 must be at the cup's wall; farther out, it caught on the slot's edge: draw it back and try "
            "again."
        )
    bears = ""
    if prop:
        size = f"{number(prop.width_mm, 2)} x {number(prop.length_mm, 2)} mm"
        pads = "a pad" if len(prop.pads) == 1 else "a pad on each side"
        grip = grip_of(moulds)
        bears = (
            f" Its {grip} hangs free: put {pads} of stacked card {number(prop.thickness_mm, 3)} mm thick under "
            f"{'it' if len(tongues) == 1 else f'the {grip}s'} ({size}; {number(prop.tolerance_mm, 2)} mm more or less "
            "does no harm: computed, the window's clearance), on the plate, against the cup. It must neither lift the "
            "tongue nor leave air under it. Nothing may lean on its outer end."
        )
    return BenchStep(
        "Tongue home",
        f"{stops} Wipe off what grease came into the bore, with a dry cotton bud.{bears}",
        picture,
        minutes=fig.TONGUE_MIN * len(moulds.plan.layout.cells),
    )


def draw_up(mix: Mix) -> BenchStep:
    """Say how the mix gets into the syringe."""
    return BenchStep(
        "Draw up",
        f"Draw all of it into a syringe of {number(mix.syringe_size_ml, 3)} ml: {number(mix.syringe_ml, 3)} ml fill "
        f"the cavities and what tip and plunger hold back, some {number(fig.HELD_BACK_ML, 2)} ml (assumed). The rest "
        f"of the {number(mix.millilitres, 3)} ml is for the beads at the vents, for leaks, and for what stays in the "
        f"mixing cup.{_refilled(mix)} Point it up and push until silicone, no air, stands at the "
        "tip.",
        minutes=fig.STRIKE_MIN,
    )


def _refilled(mix: Mix) -> str:
    """Say so where no syringe holds the whole mix."""
    return " Fill it again while the mix flows." if mix.syringe_size_ml < mix.millilitres else ""


def inject(moulds: MouldSet, picture: str) -> BenchStep:
    """Say how a cavity under a lid is filled."""
    return BenchStep(
        "Inject",
        f"Press the tip into the sprue ({number(moulds.spec.moulds.sprue_mm, 3)} mm) and inject slowly until every "
        "vent shows a bead without bubbles, sprue by sprue. Leave sprue and vents filled.",
        picture,
        kind="pour",
        minutes=fig.pouring_min(len(moulds.plan.layout.cells)) - fig.STRIKE_MIN,
    )


def _cure_and_open(
    moulds: MouldSet, step: Step, silicone: Material, picture: Callable[[str], str]
) -> Iterator[BenchStep]:
    tongues = moulds.plan.standing(step, "tongue")
    yield cure(moulds, step, silicone, picture("filled"))
    if tongues:
        yield BenchStep(
            "Tongue out FIRST",
            f"Pull {'the tongue' if len(tongues) == 1 else 'every tongue'} out FIRST, straight along "
            f"itself, by its {grip_of(moulds)}, over the card, with a steady pull. A cup lifted over a tongue tears "
            "the layer. Then take the card away: it covers the pry slot.",
            picture("tongue-out"),
            minutes=fig.PULL_MIN * len(tongues),
        )
    if step.lid:
        yield BenchStep(
            "Lid off",
            f"Take off what held the lid down. The lid stands out over cup {step.index} all round: push its edge up "
            "from below, with the thumbs or the blunt spatula on two opposite sides, a little at a time, the cup held "
            "down. Then lift it straight up: sprue and vents tear off at the layer. Trim them flush with a knife.",
            picture("lid-off"),
            minutes=fig.LIFT_MIN,
        )
    if all(removal.piece != step.cup for removal in step.removals):
        return
    free = "" if step.lid else "Take off what held the cup down. "
    seat = "base" if moulds.plan.pins else "plinth"
    yield BenchStep(
        f"Cup {step.index} off",
        f"{free}{_pried(moulds, step, seat)} Lift cup {step.index} straight up. "
        f"Layer {step.index} stays on the {holds(moulds)}.",
        picture("cup-off"),
        minutes=fig.LIFT_MIN,
    )


def _pried(moulds: MouldSet, step: Step, seat: str) -> str:
    """Say how a cup is levered off its seat: in pieces, all of them."""
    if len(moulds.plan.pieces_of(step.cup)) > 1:
        return (
            "Lay a screwdriver in every pry slot, its tip under the cup, and press the handles down a little at a "
            "time, one after the other and round again; at a piece of the cup over no slot turn a blunt spatula under "
            f"its outer edge. Its dovetails slide up and down: go on until every piece has come free of the {seat}."
        )
    return (
        "Lay a screwdriver in each of the two pry slots, its tip under the cup. Press both handles down at once, a "
        f"little at a time, until the cup comes free of the {seat}."
    )


def cure(moulds: MouldSet, step: Step, silicone: Material, picture: str) -> BenchStep:
    """Say how long a pour cures, and how to tell that it is done."""
    hours = at_room(float(silicone.cure_h), moulds.spec.casting.room_c)
    touched = (
        "the bead on a vent"
        if step.lid
        else f"the silicone in {_groove(step)}"
        if step.groove
        else "what was struck off"
    )
    return BenchStep(
        "Cure",
        f"Let it cure, level, for {number(hours, 2)} h. Touch {touched}, not the layer, to see whether it is done: "
        f"{TACK}.",
        picture,
        kind="cure",
        wait_min=60 * hours,
    )


def _put_on(moulds: MouldSet, step: Step) -> str:
    """Say how a cup comes to stand where it should: by its ribs, or pushed as the one before."""
    if ribs(moulds.spec, moulds.plan.layout):
        return (
            f"Put cup {step.index} on and press it down evenly until it sits. Its ribs centre it: push it to no side."
        )
    if moulds.plan.pins:
        play = number(moulds.plan.pins.clearance, 2)
        return (
            f"Put cup {step.index} on over the pins, cut corner over cut corner, and press it down flat. The pins let "
            f"it move by {play} mm each way: push it to and fro, along the base and across, and leave it in the middle."
        )
    pushed = ", so that the play lies on one side." if step.index == 1 else ", as the cup before."
    if step.index > 1 and moulds.plan.concentric:
        pushed = f", as the cup before: Layer {step.index} lies between two cup positions."
    return f"Put cup {step.index} on and push it towards the cut corner{pushed}"


def _release_agent(moulds: MouldSet, step: Step) -> str:
    """Say which faces get release agent before a pour, and why no other."""
    faces = agent_faces(moulds, step)
    if not faces:
        return "No release agent on any piece: what is cast here bonds later."
    if moulds.plan.pins:
        earlier = f" or Layer {step.index - 1}" if step.index > 1 else ""
        return (
            f"Release agent, if any, sparingly and only on the sheet's bed and the bores of cup {step.index}: a "
            "printed cup holds a thin sheet fast. Put it on away from the base and let it dry. None in the slots for "
            f"the fins, and none on base{earlier}, ever: what bonds later is cast there."
        )
    where = " and ".join(f"the {face.face} of {spaced(face.tool)}" for face in faces)
    return (
        f"Release agent, if any, sparingly and only on {where}: put it on away from the base and let it dry. No "
        f"other face gets any, the {holds(moulds)} neither."
    )


def _larger_batch(mix: Mix) -> str:
    """Name the batch that would be accurate enough in the ratio, where this one isn't."""
    if mix.mix_error_pct <= MOST_ERROR_PCT:
        return ""
    enough = mix.mix_g * mix.mix_error_pct / MOST_ERROR_PCT
    return f": too much; mix at least {number(enough, 3)} g (casting.minimum_mix_g) or use a finer scale"
