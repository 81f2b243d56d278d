"""What a person does, in words: one function a stage of the procedure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from unitcad.casting.eccentricity import eccentricity
from unitcad.casting.figures import MIXING_MIN, MOST_ERROR_PCT, Mix, at_room, window_length
from unitcad.casting.release_agent import agent_faces
from unitcad.catalogue import Material
from unitcad.moulds.cup import window_section
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.moulds.ribs import ribs
from unitcad.moulds.tongue import GRIP_GAP, GRIP_LENGTH
from unitcad.spec import printer_of
from unitcad.text import listed, number, spaced

STRIKE_AGAIN_MIN = 10
HOLD = "Hold"
"""How the step begins that keeps an open cup on its base under the blade."""


def preparation(moulds: MouldSet) -> Iterator[str]:
    """Describe the way from the printer to an empty mould."""
    plan, lengths = moulds.plan, moulds.spec.moulds
    printed = [tool for tool in plan.tools if tool.made == "printed"]
    turned = listed(dict.fromkeys(f"{tool.kind}s" if tool.step else tool.kind for tool in printed if tool.upside_down))
    marked = listed(["base", "cups", *(["lids"] if plan.of_kind("lid") else [])])
    yield (
        f"Print the pieces as they lie in their files, without supports: {turned} upside down, the rest as drawn. "
        f"{marked.capitalize()} are engraved {plan.label}; step1-cup.stl is cup 1, and so on."
    )
    yield from _cut_tongues(moulds)
    if in_resin(moulds):
        yield "Wash the pieces until nothing of them feels slippery, rinse holes and corners, and let them dry."
        if tunnels(moulds):
            yield _clear_tunnels(moulds)
        yield (
            "Resin keeps many platinum silicones from curing: post-cure, bake (60 degC for 8 h, assumed), then "
            "cure a drop of each silicone on a spot of the base that is no cavity. If it stays tacky, coat or reprint."
        )
    else:
        yield "Brush off strings and loose bits."
    lids = " Put each lid on its cup once, cut corner over cut corner." if plan.of_kind("lid") else ""
    on = "Put each cup on the plinth once, dry: its cut corner lets it on one way only. It must sit down"
    if standing := ribs(moulds.spec, plan.layout):
        on = (
            "Press each cup onto the plinth once, dry: its cut corner lets it on one way only. Press evenly at all "
            f"corners, in a vice between two boards where the hand is too weak: its {len(standing)} ribs are crushed "
            "and centre it from then on. It must sit down"
        )
    yield (
        f"{on} until seat and "
        f"plinth touch; a slit of {number(lengths.seat_relief_mm, 3)} mm is then left between cup and plate, all "
        f"round.{lids}"
    )
    if plan.of_kind("stub"):
        yield (
            f"Push {_each(moulds)} straight piece of filament up through the core from below until its end is flush "
            "with the core's top, and bend what stands out below by a right angle into the groove under the plate: it "
            "lies on the bench and can't sink. Trim the upper end flush with a knife: 0.5 mm low shows."
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
        "each with a syringe of isopropanol, push a strip of the tongue's film through until it slides freely, and "
        "look through it against the light. What is cured in it has to be scraped out, or the cup printed again."
    )


def _cut_tongues(moulds: MouldSet) -> Iterator[str]:
    """Say how to cut the tongues that are not printed."""
    dims, tongues = moulds.plan.dimensions, [t for t in moulds.plan.of_kind("tongue") if t.made == "cut"]
    if tongues and dims.exit:
        length = moulds.plan.layout.cup[0] - min(abs(c.x) for c in moulds.plan.layout.cells) + GRIP_GAP + GRIP_LENGTH
        yield (
            f"Cut {_counted(len(tongues), 'tongue')} from film or steel {number(dims.exit.height, 3)} mm thick: a "
            f"strip {number(dims.exit.width, 3)} mm wide and at least {number(length, 2)} mm long, one end cut hollow "
            f"to a radius of {number(dims.ledge_radius, 3)} mm so that it fits the riser of the core's ledge. No burr."
        )


def pour_steps(moulds: MouldSet, step: Step, silicone: Material, mix: Mix, verdict: str) -> Iterator[str]:
    """Describe one pour, from an empty mould to a cured layer on the core."""
    first, tongues = step.index == 1, moulds.plan.standing(step, "tongue")
    cells, sprue = len(moulds.plan.layout.cells), moulds.spec.moulds.sprue_mm
    if not first:
        bond = "Its outside" if moulds.plan.concentric else f"The face that Layer {step.index} touches"
        yield (
            f"Wipe Layer {step.index - 1} with isopropanol and let it dry. {bond} is the bond face: no release "
            "agent on it, ever, no grease, no fingers. No sourced window exists for when to pour the next layer; as "
            "soon as it is firm and no longer tacky is the usual practice (assumed), and silicone bonds to cured "
            "silicone of its kind."
        )
    if moulds.design.laid_in == step.index:
        yield from assembly(moulds)
    if any(body.kind in ("circuit", "wire") for body in step.inserts):
        yield (
            f"Coat the {_lead(moulds)} thinly with petroleum jelly where the slot of cup {step.index} comes, outside "
            "the cavity only: it keeps silicone from weeping out."
        )
    yield f"{_release_agent(moulds, step)} {_put_on(moulds, step)}"
    if step.seals and not moulds.plan.concentric:
        yield "Grease the flanks of what stands on the base beside the cavity thinly, and wipe off the rest."
    if tongues:
        slot = "" if first else " and the slot that it left in the layer before"
        seat = number(window_length(moulds, step), 2)
        yield (
            f"Push {'the tongue' if len(tongues) == 1 else 'each tongue'} in through the window{slot} until "
            f"{seat} mm are still to go. Smear the {seat} mm just outside the cup thinly with petroleum jelly, "
            "then push it home: its hollow end stops against the core, and it lies on the ledge. Wipe off what comes "
            "into the bore."
        )
    if step.lid:
        yield (
            f"Put lid {step.index} on, cut corner over cut corner, with a thin line of petroleum jelly on the rim "
            "outside the groove. Hold it down with rubber bands round lid and base, or with a clamp, clear of sprue "
            "and vents."
        )
    else:
        yield (
            f"{HOLD} cup {step.index} down while it is struck off: on each of the two sides without a pry slot run a "
            "strip of tape from the cup's wall, below the rim, round the plate's edge to its underside. Clamps or "
            "weights do as well where they leave the rim free for the blade."
        )
    yield (
        f"Weigh {_shown(mix.part_a_g)} g of {silicone.name} part A and {_shown(mix.part_b_g)} g of part B "
        f"({_shown(mix.net_g)} g go into {cells} cavit{'y' if cells == 1 else 'ies'}; so small a batch would be "
        f"{number(mix.net_error_pct, 2)} % wrong in the ratio, this one "
        f"{number(mix.mix_error_pct, 2)} %{_larger_batch(mix)}). Mix for {number(MIXING_MIN, 3)} min (assumed), "
        "scraping the walls; the pot life runs from now."
    )
    yield verdict
    if step.lid:
        yield (
            f"Draw the silicone into a syringe, press its tip into the sprue ({number(sprue, 3)} mm) and inject slowly "
            "until every vent shows a bead without bubbles. Leave sprue and vents filled."
        )
    else:
        taken = "into the groove" if step.groove else "onto a scrap, since this cup has no groove"
        yield (
            f"Pour in a thin thread at one place until {'the' if cells == 1 else 'every'} cavity stands over its rim. "
            "Prick the bubbles that you see. Strike off along the rim with the blade upright, its narrow edge down; "
            f"what it takes goes {taken}."
        )
        if not moulds.plan.concentric and moulds.plan.dimensions.core_height > step.rim:
            yield "What stands on the base beside the cavity is higher than this rim: draw the blade past it."
        again = " The window weeps a little." if tongues else ""
        yield f"Wipe the blade. Top up and strike again after {STRIKE_AGAIN_MIN} min (assumed).{again}"
    cure = at_room(float(silicone.cure_h), moulds.spec.casting.room_c)
    touched = (
        "the bead on a vent" if step.lid else "the silicone in the groove" if step.groove else "what was struck off"
    )
    yield f"Let it cure, level, for {number(cure, 2)} h. Touch {touched}, not the layer, to see whether it is done."
    if tongues:
        each = "the tongue" if len(tongues) == 1 else "every tongue"
        yield f"Pull {each} out FIRST, sideways. A cup lifted over a tongue tears the layer."
    if step.lid:
        yield (
            "Take off what held the lid down. Lift the lid straight up: sprue and vents tear off at the layer. Trim "
            "them flush with a knife."
        )
    free = "" if step.lid else "Take off what held the cup down. "
    yield (
        f"{free}Lift cup {step.index} straight up, a screwdriver in each pry slot. Layer {step.index} stays on the "
        f"{_holds(moulds)}."
    )


def _put_on(moulds: MouldSet, step: Step) -> str:
    """Say how a cup comes to stand where it should: by its ribs, or pushed as the one before."""
    if ribs(moulds.spec, moulds.plan.layout):
        return (
            f"Put cup {step.index} on and press it down evenly until it sits. Its ribs centre it: push it to no side."
        )
    pushed = ", so that the play lies on one side." if step.index == 1 else ", as the cup before."
    if step.index > 1 and moulds.plan.concentric:
        pushed = f", as the cup before: Layer {step.index} lies between two cup positions."
    return f"Put cup {step.index} on and push it towards the cut corner{pushed}"


def release(moulds: MouldSet, inner: Material) -> Iterator[str]:
    """Describe the way from the last cured layer to a unit in the hand; `inner` is Layer 1's silicone."""
    tear = float(inner.tensile_mpa) * math.pi * (moulds.spec.moulds.filament_mm / 2) ** 2
    if moulds.plan.of_kind("stub"):
        yield (
            f"Pull {_each(moulds)} filament out downwards: it lets air in under the unit. Never push it through: "
            f"{number(tear, 2)} N on its end tear {inner.name} (computed: tensile strength, "
            f"{inner.tensile_mpa.status}, x its area)."
        )
    yield f"Loosen the unit's edge all round, then peel it off the {_holds(moulds)} straight up. Trim the flash."


def measurements(moulds: MouldSet, masses_g: Sequence[float], slot_height: float | None) -> Iterator[str]:
    """Name what to measure on the first part, and what it should be.

    `masses_g`: of each layer of one unit, trimmed. `slot_height`: of the slot as the slicer makes the tongue (mm), None
    where it is the drawn one.
    """
    spec, dims = moulds.spec, moulds.plan.dimensions
    off = eccentricity(moulds)
    yield f"Height over all: {_shown(dims.heights[-1], 2)} mm. A cup that did not seat shows here."
    if moulds.plan.concentric:
        yield f"Diameter at the skin: {_shown(2 * dims.outer_radius, 2)} mm, in two directions."
        pushed = "" if off.ribs else " unless both cups were pushed the same way"
        further = f", each further layer by {number(2 * off.at_worst_mm, 2)} mm{pushed}"
        yield (
            "Walls at the skin, at four places: their spread is the cup's shift. Layer 1 may vary by "
            f"{number(off.at_worst_mm, 2)} mm either way{further if len(masses_g) > 1 else ''}."
        )
    else:
        yield f"Farthest corner from the motor's axis: {_shown(dims.outer_radius, 2)} mm."
    if dims.exit:
        opening = "notch" if dims.exit.high >= dims.heights[0] else "slot"
        layers = f"in layers of {number(spec.moulds.layer_mm, 3)}"
        printed = f" ({_shown(slot_height, 2)} if the tongue was printed {layers})" if slot_height else ""
        size = f"{_shown(dims.exit.width, 2)} wide, {_shown(dims.exit.height, 2)} high{printed}"
        yield f"The {opening}: {size}, open all the way."
    weights = " + ".join(_shown(each) for each in masses_g) + (
        f" = {_shown(sum(masses_g))}" if len(masses_g) > 1 else ""
    )
    low = "" if spec.moulds.pour == "injected" else " or a low strike"
    if moulds.design.laid_in:
        yield (
            f"The silicone of one unit, trimmed, weighs {weights} g. What was laid in comes on top: weigh it before. "
            f"Less means air{low}."
        )
    else:
        yield f"Weigh one unit, trimmed, without motor and circuit: {weights} g. Less means air{low}."


def assembly(moulds: MouldSet) -> tuple[str, ...]:
    """Describe how motor and circuit go into the body, or into the mould: in the design's words, where it has any."""
    return tuple(moulds.design.assembly(moulds.spec, moulds.plan.dimensions)) or tuple(_by_opening(moulds))


def _by_opening(moulds: MouldSet) -> Iterator[str]:
    """Describe the assembly of a design that says nothing of it, from the side that it opens to."""
    spec, design, lead = moulds.spec, moulds.design, _lead(moulds)
    if spec.fpcb:
        yield "Solder the motor to the circuit's pad, and try the motor."
    elif spec.wires:
        yield "Try the motor on its wires."
    if design.laid_in:
        yield "Lay everything that is not silicone where the drawing of this pour shows it."
        return
    ahead = ", the pad ahead," if spec.fpcb and design.opens == "below" else ""
    way = f", and lay the {lead} in the notch" if lead else ""
    yield f"Push the motor{ahead} into the cavity from {'the skin' if design.opens == 'below' else 'above'}{way}."
    yield (
        "A smear of Layer 1's silicone holds it (assumed: silicone bonds poorly to bare metal and polyimide). The "
        "design's file says nothing more of the assembly; a Design with an assembly of its own can."
    )


def _release_agent(moulds: MouldSet, step: Step) -> str:
    """Say which faces get release agent before a pour, and why no other."""
    faces = agent_faces(moulds, step)
    if not faces:
        return "No release agent on any piece: what is cast here bonds later."
    where = " and ".join(f"the {face.face} of {spaced(face.tool)}" for face in faces)
    return (
        f"Release agent, if any, sparingly and only on {where}: put it on away from the base and let it dry. No "
        f"other face gets any, the {_holds(moulds)} neither."
    )


def _lead(moulds: MouldSet) -> str:
    """Return what leads out of the silicone."""
    return "tail" if moulds.spec.fpcb else "wires" if moulds.spec.wires else ""


def _holds(moulds: MouldSet) -> str:
    """Return what the silicone is cast on: "core"; moulds by complement need not have one."""
    return "core" if moulds.plan.concentric else "base"


def _counted(count: int, thing: str) -> str:
    return f"one {thing}" if count == 1 else f"{count} {thing}s"


def _shown(value: float, decimals: int = 3) -> str:
    """Return grams, or mm to two decimals, as a scale or a caliper shows them."""
    return min(number(value, 3, zeros=True), f"{value:.{decimals}f}", key=len)


def _each(moulds: MouldSet) -> str:
    return "the" if len(moulds.plan.layout.cells) == 1 else "each"


def _larger_batch(mix: Mix) -> str:
    """Name the batch that would be accurate enough in the ratio, where this one isn't."""
    if mix.mix_error_pct <= MOST_ERROR_PCT:
        return ""
    enough = mix.mix_g * mix.mix_error_pct / MOST_ERROR_PCT
    return f": too much; mix at least {number(enough, 3)} g (casting.minimum_mix_g) or use a finer scale"
