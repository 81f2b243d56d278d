"""The steps from the last cured layer to a unit with its motor in, and what to measure."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence

from unitcad.casting import figures as fig
from unitcad.casting.bench_step import BenchStep
from unitcad.casting.bench_views import picture_path
from unitcad.casting.eccentricity import eccentricity
from unitcad.casting.figures import at_room
from unitcad.casting.joining import inner
from unitcad.catalogue import Material
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.removal import CAST
from unitcad.spec import Spec
from unitcad.text import number, spaced


def never_pushed(spec: Spec, inner: Material) -> str:
    """Say what pulling a filament does, and what pushing it would: `inner` is Layer 1's silicone."""
    tear = float(inner.tensile_mpa) * math.pi * (spec.moulds.filament_mm / 2) ** 2
    return (
        f"it lets air in under the unit. Never push it through: {number(tear, 2)} N on its end tear {inner.name} "
        f"(computed: tensile strength, {inner.tensile_mpa.status}, x its area)."
    )


def release(moulds: MouldSet, inner: Material) -> Iterator[BenchStep]:
    """Describe the way from the last cured layer to a unit in the hand; `inner` is Layer 1's silicone."""
    if moulds.plan.of_kind("stub"):
        each = "the" if len(moulds.plan.layout.cells) == 1 else "each"
        yield BenchStep(
            "Filament out",
            f"Lift the mould off the bench first: {each} bent end lies under its plate. Pull {each} filament out "
            f"downwards, by its bent end: {never_pushed(moulds.spec, inner)}",
            picture_path("filament-out"),
            minutes=fig.PULL_MIN * len(moulds.plan.layout.cells),
        )
    order = moulds.plan.steps[-1].removals
    held = moulds.plan.standing(moulds.plan.steps[-1], "base")
    if any(removal.piece == piece.name for removal in order for piece in held):
        cup = spaced(moulds.plan.steps[-1].cup)
        yield BenchStep(
            "Base off, downwards",
            f"Take off what held the cup down. Leave {cup} on: it can't be lifted past the silicone that lies over it. "
            f"{_levered(moulds, cup)} The {moulds.makes} stays in {cup}.",
            picture_path("base-off"),
            minutes=fig.LIFT_MIN * 2,
        )
    film = ", and the film that the blade left along the edge," if moulds.spec.moulds.pour == "open" else ""
    if any(removal.piece == CAST for removal in order):
        yield BenchStep(
            "Push out",
            f"Loosen the edge of the {moulds.makes} all round with a blunt spatula. Push it up out of "
            f"{spaced(moulds.plan.steps[-1].cup)} from below with the thumbs, first at the edge, then unit by unit. "
            f"Trim the flash{film} with small scissors.",
            picture_path("push-out"),
            minutes=fig.PEEL_MIN * len(moulds.plan.layout.cells),
        )
        return
    yield BenchStep(
        "Peel off",
        f"Loosen the unit's edge all round with a blunt spatula, then peel it off the {holds(moulds)} straight up. "
        f"Trim the flash{film} with small scissors.",
        picture_path("peel"),
        minutes=fig.PEEL_MIN * len(moulds.plan.layout.cells),
    )


def _levered(moulds: MouldSet, cup: str) -> str:
    """Say how the base is levered off downwards: in pieces, all of them together."""
    held = f"Hold the mould off the bench by {cup}"
    split = next((split for split in moulds.plan.splits if split.tool == "base"), None)
    if not split:
        return (
            f"{held}, put a screwdriver in each of the two pry slots, and lever the base off downwards, on both sides "
            "at once and a little at a time, until it comes free of the silicone. It must come straight."
        )
    text = (
        "Leave the tape over the seams of the underside on: it ties the pieces together. Dovetails slide up and down, "
        f"so a piece that nothing levers stays on its cores. {held}. Lever the base off downwards with a screwdriver "
        "in every pry slot; at a piece that has none, push a blunt spatula in between it and the cup, at its outer "
        "edge, and turn it. Go round and round, a little at each place, so that no piece runs ahead of the next one "
        "and all come free of the silicone together. The base must come straight."
    )
    if inner(split):
        text += (
            " A piece without an outer edge hangs by the tape alone: before you lever, stick more tape across it from "
            "neighbour to neighbour, both ways, but not over the holes of the filaments, which let air in. Let its "
            "neighbours get a millimetre ahead at most, and pull at the tape under it."
        )
    return text


def motor_in(moulds: MouldSet, silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe how motor and circuit go in after casting; nothing where they were laid in."""
    if moulds.design.laid_in:
        return
    texts = assembly(moulds)
    for i, text in enumerate(texts):
        minutes = fig.LAY_IN_MIN * len(moulds.plan.layout.cells)
        title = f"Motor in, {i + 1} of {len(texts)}" if len(texts) > 1 else "Motor in"
        yield BenchStep(title, text, picture_path("motor-in" if i == 0 else "motor-home"), minutes=minutes)
    room = moulds.spec.casting.room_c
    cures = {silicone.name: at_room(float(silicone.cure_h), room) for silicone in smeared(texts, silicones)}
    hours = ", ".join(f"{name} {number(hour, 2)} h" for name, hour in cures.items())
    mouth, motor = ("cavity's mouth", "motor") if moulds.makes == "unit" else ("cavities' mouths", "motors")
    yield BenchStep(
        "Let the smear cure",
        f"A smear of silicone is mixed like any batch ({number(moulds.spec.casting.minimum_mix_g, 3)} g at least) and "
        f"spread as thin as butter. It needs its whole cure ({hours}): lay the {moulds.makes} down with the {mouth} "
        f"up, level, and don't run the {motor} before. Without a smear there is nothing to wait for.",
        picture_path("motor-home"),
        kind="cure",
        wait_min=60 * max(cures.values()),
    )


def smears(moulds: MouldSet, silicones: Sequence[Material]) -> list[Material]:
    """Return the silicones of the smears that hold motors, one batch each; where none is named Layer 1's serves."""
    texts = () if moulds.design.laid_in else assembly(moulds)
    if not any("smear" in text for text in texts):
        return []
    return list(dict.fromkeys(smeared(texts, silicones if layers_named(texts) else silicones[:1])))


def smeared(texts: Sequence[str], silicones: Sequence[Material]) -> list[Material]:
    """Return the silicones that an assembly's words name by their layer, of `silicones` from the inside out.

    All of them where it names none.
    """
    return [silicones[min(i, len(silicones) - 1)] for i in layers_named(texts)] or list(silicones)


def layers_named(texts: Iterable[str]) -> list[int]:
    """Return the layers (from 0, -1 for the last) whose silicone an assembly's words ask for."""
    said = re.findall(r"(?:Layer (\d+)|(last) layer)'s silicone", " ".join(texts))
    return [-1 if last else int(layer) - 1 for layer, last in said]


def measurements(moulds: MouldSet, masses_g: Sequence[float], slot_height: float | None) -> Iterator[str]:
    """Name what to measure on the first part, and what it should be.

    `masses_g`: of each layer of one unit, trimmed. `slot_height`: of the slot as the slicer makes the tongue (mm), None
    where it is the drawn one.
    """
    spec, dims = moulds.spec, moulds.plan.dimensions
    off = eccentricity(moulds)
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
    if dims.exit:
        opening = "notch" if dims.exit.high >= dims.heights[0] else "slot"
        layers = f"in layers of {number(spec.moulds.layer_mm, 3)}"
        printed = f" ({shown(slot_height, 2)} if the tongue was printed {layers})" if slot_height else ""
        size = f"{shown(dims.exit.width, 2)} wide, {shown(dims.exit.height, 2)} high{printed}"
        yield f"The {opening}: {size}, open all the way."
    weights = " + ".join(shown(each) for each in masses_g) + (f" = {shown(sum(masses_g))}" if len(masses_g) > 1 else "")
    low = "" if spec.moulds.pour == "injected" else " or a low strike"
    if moulds.design.laid_in:
        yield (
            f"The silicone of one unit, trimmed, weighs {weights} g. What was laid in comes on top: weigh it before. "
            f"Less means air{low}."
        )
    else:
        motor = "motor" if moulds.makes == "unit" else "motors"
        yield f"Weigh one {moulds.makes}, trimmed, without {motor} and circuit: {weights} g. Less means air{low}."


def assembly(moulds: MouldSet) -> tuple[str, ...]:
    """Describe how motor and circuit go into the body, or into the mould: in the design's words, where it has any."""
    return moulds.assembly or tuple(_by_opening(moulds))


def _by_opening(moulds: MouldSet) -> Iterator[str]:
    """Describe the assembly of a design that says nothing of it, from the side that it opens to."""
    spec, design, leaves = moulds.spec, moulds.design, lead(moulds)
    if spec.fpcb:
        yield "Solder the motor to the circuit's pad, and try the motor."
    elif spec.wires:
        yield "Try the motor on its wires."
    if design.laid_in:
        yield "Lay everything that is not silicone where the drawing of this pour shows it."
        return
    ahead = ", the pad ahead," if spec.fpcb and design.opens == "below" else ""
    way = f", and lay the {leaves} in the notch" if leaves else ""
    yield f"Push the motor{ahead} into the cavity from {'the skin' if design.opens == 'below' else 'above'}{way}."
    yield (
        "A smear of Layer 1's silicone holds it (assumed: silicone bonds poorly to bare metal and polyimide). The "
        "design's file says nothing more of the assembly; a Design with an assembly of its own can."
    )


def lead(moulds: MouldSet) -> str:
    """Return what leads out of the silicone."""
    return "tail" if moulds.spec.fpcb else "wires" if moulds.spec.wires else ""


def holds(moulds: MouldSet) -> str:
    """Return what the silicone is cast on: "core"; moulds by complement need not have one."""
    return "core" if moulds.plan.concentric else "base"


def shown(value: float, decimals: int = 3) -> str:
    """Return grams, or mm to two decimals, as a scale or a caliper shows them."""
    return min(number(value, 3, zeros=True), f"{value:.{decimals}f}", key=len)


def _each(moulds: MouldSet) -> str:
    return "the" if len(moulds.plan.layout.cells) == 1 else "each"
