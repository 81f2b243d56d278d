"""What a person does, in words: one function a stage of the procedure."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

from unitcad.casting.figures import MIXING_MIN, MOST_ERROR_PCT, Mix
from unitcad.casting.release_agent import agent_faces
from unitcad.catalogue import Material
from unitcad.moulds.lid import SKIRT_WALL
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.spec import printer_of
from unitcad.text import spaced

STRIKE_AGAIN_MIN = 10


def preparation(moulds: MouldSet) -> Iterator[str]:
    """Describe the way from the printer to an empty mould."""
    plan = moulds.plan
    yield (
        "Print the pieces as they lie in their files: cups and blade upside down, the rest as drawn. Base and cups are "
        f"engraved {plan.label}."
    )
    yield (
        "Brush off strings and loose bits. Put each cup on the plinth once, dry: its cut corner lets it on one way "
        "only, and it must sit down until seat and plinth touch."
    )
    if printer_of(moulds.spec).technology.value == "sla":
        yield (
            "Resin keeps many platinum silicones from curing: wash, post-cure, bake (60 degC for 8 h, assumed), then "
            "cure a drop of each silicone on a spot of the base that is no cavity. If it stays tacky, coat or reprint."
        )
    if plan.of_kind("stub"):
        yield (
            f"Push {_each(moulds)} filament stub up through the core from below until its end is flush with the core's "
            "top, its bent end lying in the groove under the plate and on the bench. Trim its tip flush with a blade: "
            "0.5 mm low shows."
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
    pushed = (
        ": the play is then on one side."
        if first
        else ", the same way as the cup before: Layer 2 lies between two cup positions."
    )
    yield (f"{_release_agent(moulds, step)} Put cup {step.index} on and push it towards the cut corner{pushed}")
    if step.seals and not moulds.plan.concentric:
        yield "Grease the flanks of what stands on the base beside the cavity thinly, and wipe off the rest."
    if tongues:
        slot = "" if first else " and the slot that it left in the layer before"
        yield (
            f"Grease {'the tongue' if len(tongues) == 1 else 'each tongue'} and the window thinly with petroleum "
            "jelly, the tip not; wipe off what comes out into the bore. Push it in through the window"
            f"{slot} until its round tip stops in the core and it lies on the ledge."
        )
    if step.lid:
        yield (
            f"Put lid {step.index} on. Seal it with a thin line of petroleum jelly on the rim outside the groove, and "
            f"hold it down with a rubber band or a clamp across its skirt ({SKIRT_WALL:g} mm)."
        )
    yield (
        f"Weigh {mix.part_a_g:.2f} g of {silicone.name} part A and {mix.part_b_g:.2f} g of part B ({mix.net_g:.3f} g "
        f"go into {cells} cavit{'y' if cells == 1 else 'ies'}; so small a batch would be {mix.net_error_pct:.1f} % "
        f"wrong in the ratio, this one {mix.mix_error_pct:.2f} %{_larger_batch(mix)}). Mix for {MIXING_MIN:g} min "
        "(assumed), scraping the walls; the pot life runs from now."
    )
    yield verdict
    if step.lid:
        yield (
            f"Draw the silicone into a syringe, press its tip into the sprue ({sprue:g} mm) and inject slowly until "
            "every vent shows a bead without bubbles. Leave sprue and vents filled."
        )
    else:
        taken = "into the groove" if step.groove else "onto a scrap, since this cup has no groove"
        yield (
            f"Pour in a thin thread at one place until {'the' if cells == 1 else 'every'} cavity stands over its rim. "
            "Wait for the bubbles, prick what you see. Strike off along the rim with the blade held upright; what it "
            f"takes goes {taken}."
        )
        if not moulds.plan.concentric and moulds.plan.dimensions.core_height > step.rim:
            yield "What stands on the base beside the cavity is higher than this rim: draw the blade past it."
        again = " The window weeps a little." if tongues else ""
        yield f"Top up and strike again after {STRIKE_AGAIN_MIN} min (assumed).{again}"
    yield "Let it cure, level, for the time above. Touch the overflow, not the layer, to see whether it is done."
    if tongues:
        each = "the tongue" if len(tongues) == 1 else "every tongue"
        yield f"Pull {each} out FIRST, sideways. A cup lifted over a tongue tears the layer."
    if step.lid:
        yield "Lift the lid: sprue and vents tear off at the layer. Trim them flush with a blade."
    yield (
        f"Lift cup {step.index} straight up, a screwdriver in each pry slot. Layer {step.index} stays on the "
        f"{_holds(moulds)}."
    )


def release(moulds: MouldSet, inner: Material) -> Iterator[str]:
    """Describe the way from the last cured layer to a unit in the hand; `inner` is Layer 1's silicone."""
    tear = float(inner.tensile_mpa) * math.pi * (moulds.spec.moulds.filament_mm / 2) ** 2
    if moulds.plan.of_kind("stub"):
        yield (
            f"Pull {_each(moulds)} filament out downwards: it lets air in under the unit. Never push it through: "
            f"{tear:.1f} N on its end tear {inner.name} (computed: tensile strength, {inner.tensile_mpa.status}, x its "
            "area)."
        )
    yield f"Peel the unit off the {_holds(moulds)} straight up, all round first. Trim the flash."


def measurements(moulds: MouldSet, grams: Sequence[float], slot_height: float | None) -> Iterator[str]:
    """Name what to measure on the first part, and what it should be.

    `grams`: of each layer of one unit, trimmed. `slot_height`: of the slot as the slicer makes the tongue (mm), None
    where it is the drawn one.
    """
    spec, dims = moulds.spec, moulds.plan.dimensions
    play = spec.moulds.plinth_clearance_mm
    yield f"Height over all: {dims.heights[-1]:.2f} mm. A cup that did not seat shows here."
    if moulds.plan.concentric:
        yield f"Diameter at the skin: {2 * dims.outer_radius:.2f} mm, in two directions."
        further = f", each further layer by {2 * play:g} mm unless both cups were pushed the same way"
        yield (
            "Walls at the skin, at four places: their spread is the cup's shift. Layer 1 may vary by "
            f"{play:g} mm either way{further if len(grams) > 1 else ''}."
        )
    else:
        yield f"Farthest corner from the motor's axis: {dims.outer_radius:.2f} mm."
    if dims.exit:
        opening = "notch" if dims.exit.high >= dims.heights[0] else "slot"
        layers = f"in layers of {spec.moulds.layer_mm:g}"
        printed = f" ({slot_height:.2f} if the tongue was printed {layers})" if slot_height else ""
        size = f"{dims.exit.width:.2f} wide, {dims.exit.height:.2f} high{printed}"
        yield f"The {opening}: {size}, open all the way."
    weights = " + ".join(f"{each:.3f}" for each in grams) + (f" = {sum(grams):.3f}" if len(grams) > 1 else "")
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


def _each(moulds: MouldSet) -> str:
    return "the" if len(moulds.plan.layout.cells) == 1 else "each"


def _larger_batch(mix: Mix) -> str:
    """Name the batch that would be accurate enough in the ratio, where this one isn't."""
    if mix.mix_error_pct <= MOST_ERROR_PCT:
        return ""
    enough = mix.mix_g * mix.mix_error_pct / MOST_ERROR_PCT
    return f": too much; mix at least {enough:.3g} g (casting.minimum_mix_g) or use a finer scale"
