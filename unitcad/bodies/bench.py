"""The bench of a parted mould: its steps, and the pictures of them.

A tray is a base without cups, halves are a base and one cup, side pieces stand on a base in a frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from unitcad.casting import pouring
from unitcad.casting.drawings import CLEAR, Extra, cast_colour
from unitcad.casting.figures import LIFT_MIN, PEEL_MIN, Batch
from unitcad.casting.plates import made_pieces
from unitcad.casting.pouring import cure, injection_steps, mixing_steps, struck
from unitcad.casting.preparation import cleaning, fall, level
from unitcad.casting.preparation import preparation as with_cup
from unitcad.casting.steps import BenchStep
from unitcad.casting.views import (
    OVER,
    Placed,
    View,
    Views,
    cup_views,
    injected_views,
    picture_path,
    place_pieces,
    pour_picture,
)
from unitcad.catalogue import Material
from unitcad.checks import draw, strains
from unitcad.kernels.mesh import bounds
from unitcad.moulds.lid import TILT_DEG
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import cylinder, moved, union
from unitcad.shape.lettering import seen
from unitcad.shape.tree import Body
from unitcad.text import join_words, number, spaced

APART_MIN = 1.0
"""Time to take one side piece off, or to put it in its place, min (assumed)."""
NOTED_MM, NOTED_PCT = 0.02, 2.0
"""Depth by which silicone is pressed aside, mm, and stretch of a peel, percent, from which the sheet says so."""


def preparation(moulds: MouldSet, silicones: Sequence[Material]) -> Iterator[BenchStep]:
    """Describe the way from the printer to an empty mould."""
    plan, label, sides = moulds.plan, seen(moulds.plan.label), _sides(moulds)
    lies = f" The body is cast {plan.way.partition(':')[0]}."
    if plan.of_kind("cup") and not sides:
        sort, *rest = with_cup(moulds, silicones)
        yield replace(sort, text=sort.text + lies)
        yield from rest
        return
    marks = (
        f"{seen('B')}{label} on the base; C1, {label[:2]} and {label[2:]} on the side pieces. The frame has no mark."
    )
    if not sides:
        marks = f"{seen('B')}, {label[:2]} and {label[2:]} in the tray's corners."
    yield BenchStep("Sort the pieces", f"Engraved: {marks}{lies}", picture_path("pieces"), minutes=5.0)
    yield from cleaning(moulds, silicones)
    enough, tool = fall(moulds)
    if plan.steps[-1].injected:
        enough, tool = f"Within {number(TILT_DEG, 2)} degrees is good enough for the vents.", "level"
    if not sides:
        text = "Put the tray in its final place. Lay a level on its rim, along and across, and shim its corners with paper."
        yield level(f"{text} {enough}", tool)
        return
    yield BenchStep(
        "Try the pieces, dry",
        f"Stand the {len(sides)} side pieces on the base, keys in their grooves, and push them together. Press the "
        "frame down over their taper by hand until it sits tight all round; it must not touch the plate. No light may "
        "show through a joint: scrape what keeps it open.",
        picture_path("dry-fit"),
        minutes=5.0,
    )
    text = "Put the mould, together, in its final place. Lay a level on the rim, along and across, and shim the base's"
    yield level(f"{text} corners with paper. {enough} Take frame and side pieces off.", tool)


def pour_steps(batch: Batch) -> Iterator[BenchStep]:
    """Describe the pour, from an empty mould to a cured body on the base."""
    moulds, step = batch.moulds, batch.step
    sides = _sides(moulds)
    if moulds.plan.of_kind("cup") and not sides:
        for each in pouring.pour_steps(batch):
            yield replace(each, text=each.text + _pressed(moulds)) if each.title.endswith("off") else each
        return

    def picture(name: str) -> str:
        return pour_picture(step.index, name) if sides else picture_path(name)

    inside = "faces that will touch silicone, not on the joints" if sides else "inside of the tray"
    agent = f"Release agent, if any, thinly and only on the {inside}."
    if sides:
        yield BenchStep(
            "Side pieces together",
            f"{agent} Stand the side pieces on the base, keys in their grooves, and push them together.",
            picture("sides-on"),
            minutes=APART_MIN * len(sides),
            required_tools=("release agent",),
        )
        yield BenchStep(
            "Frame on",
            "Press the frame down evenly until it sits tight: it holds the joints shut. Correct the level with paper.",
            picture("frame-on"),
            minutes=2.0,
            required_tools=("paper",),
        )
    else:
        yield BenchStep("Release agent", agent, minutes=1.0, required_tools=("release agent",))
    yield from mixing_steps(batch)
    if step.injected:
        yield from injection_steps(batch, picture("inject"))
        touched = "the bead on a vent"
    else:
        groove = "the groove" if len(step.layer) == 1 else "the grooves"
        cells, many = len(step.layer), len(step.layer) > 1
        each = ", one cavity after the other" if many else ""
        vented = " Silicone comes up in the vents: leave it." if step.channels else ""
        yield from struck(
            batch,
            f"Pour in a thin thread at one place until {'it' if many else 'the cavity'} stands over its rim{each}."
            f"{vented} Prick bubbles with a pin.",
            "Draw the blade, upright, its narrow edge down, along the rim in one slow stroke. The rest goes "
            f"{f'into {groove}' if step.groove else 'onto a scrap: this mould has no groove'}.",
            "",
            cells,
            cells,
            picture,
        )
        touched = f"the silicone in {groove}" if step.groove else "what was struck off"
    yield cure(batch, touched, "body", picture("filled"))
    if not sides:
        return
    torn = " Gate and vents tear off: trim them flush with a knife." if step.channels else ""
    yield BenchStep(
        "Frame off",
        "Push the frame up from below on two opposite sides, bit by bit, with thumbs or a blunt spatula.",
        picture("frame-off"),
        minutes=LIFT_MIN,
        required_tools=("blunt spatula",),
    )
    order = [removal.piece for removal in step.removals if removal.piece in {side.name for side in sides}]
    yield BenchStep(
        "Side pieces off",
        f"Turn a blunt spatula in a joint until it opens. Pull the side pieces straight outwards along the plate, one "
        f"after the other: {join_words([spaced(name) for name in order])}.{torn}{_pressed(moulds)}",
        picture("sides-off"),
        minutes=APART_MIN * len(sides),
        required_tools=("blunt spatula", "sharp knife") if step.channels else ("blunt spatula",),
    )


def release(moulds: MouldSet, first: Material) -> Iterator[BenchStep]:
    """Describe the way from the cured body to one in the hand."""
    plan = moulds.plan
    if plan.of_kind("cup"):
        for each in pouring.release(moulds, first):
            yield replace(each, text=each.text + _stretched(moulds)) if each.title == "Peel off" else each
        return
    yield BenchStep(
        "Peel out",
        "Loosen the unit's edge all round with a blunt spatula. Lift one side and peel the unit up out of the tray. "
        f"Trim flash and the blade's film with small scissors.{_stretched(moulds)}",
        picture_path("peel"),
        minutes=PEEL_MIN * len(plan.layout.cells),
        required_tools=("small scissors", "blunt spatula"),
    )


def _sides(moulds: MouldSet) -> tuple[Body, ...]:
    """Return the side pieces, which a frame holds; () for a tray and for cups that lift off."""
    return moulds.plan.of_kind("cup") if moulds.plan.of_kind("frame") else ()


def _pressed(moulds: MouldSet) -> str:
    """Return the sentence on silicone that is in a piece's way, " " before it; "" if none is."""
    found = moulds.once("pressed aside", lambda: draw.pressed_aside(moulds))
    depth = max((each for _, each, _ in found), default=0.0)
    if depth < NOTED_MM:
        return ""
    return f" The silicone is pressed aside by up to {number(depth, 2)} mm there: go slowly, and let it give way."


def _stretched(moulds: MouldSet) -> str:
    """Return the sentence on silicone that stretches as it is peeled, " " before it; "" if it hardly does."""
    percent = max((strain.percent for strain in strains(moulds)), default=0.0)
    return f" It stretches by up to {number(percent, 2)} % on the way (computed)." if percent >= NOTED_PCT else ""


def views(moulds: MouldSet) -> Views:
    """Yield the views of the procedure, by their names."""
    plan, step, (base,) = moulds.plan, moulds.plan.steps[0], moulds.plan.of_kind("base")
    yield "pieces", View(place_pieces(made_pieces(moulds)), eye=OVER, group="pieces")
    sides = _sides(moulds)
    if not sides:
        yield from cup_views(moulds)
        return
    standing, frames = place_pieces([base]), plan.of_kind("frame")
    box = {body.name: bounds(moulds.mesh(body)) for body in (base, *sides, *frames)}
    held = place_pieces(frames)
    colour, silicone = cast_colour(moulds, 1), place_pieces([step])

    def pour(name: str) -> str:
        return f"pour{step.index}-{name}"

    out = max(2 * CLEAR, 0.35 * plan.layout.cup[0])
    apart = tuple(Placed(s.name, (s.removal[0] * out, s.removal[1] * out, 0.0)) for s in sides if s.removal)
    lift = tuple(Placed(f.name, (0.0, 0.0, step.rim + CLEAR - box[f.name][2])) for f in frames)
    yield "dry-fit", View((*standing, *place_pieces(sides), *lift))
    yield pour("sides-on"), View((*standing, *apart))
    yield pour("frame-on"), View((*standing, *place_pieces(sides), *lift))
    closed = (*standing, *place_pieces(sides), *held)
    if step.injected:
        yield from ((pour(name), view) for name, view in injected_views(moulds, step, closed, ()))
    else:
        cell = plan.layout.cells[0]
        x0, _, _, x1, _, _ = bounds(moulds.meshes(step.layer)[0])
        thread = moved(cylinder(0.6, step.rim - 1.0, step.rim + 14.0), x0 + 0.3 * (x1 - x0), cell.y)
        filled = (Extra(union(step.channels), colour),) if step.channels else ()
        blades = place_pieces(plan.of_kind("blade"), -0.55 * plan.layout.cup[0])
        yield pour("pour"), View((*closed, *silicone), (*filled, Extra(thread, colour)))
        yield pour("strike"), View((*closed, *silicone, *blades), filled)
        yield pour("filled"), View((*closed, *silicone), filled)
    yield pour("frame-off"), View((*standing, *place_pieces(sides), *silicone, *lift), way=1)
    yield pour("sides-off"), View((*standing, *apart, *silicone), way=1)
    low = min(bounds(mesh)[2] for mesh in moulds.meshes(step.layer))
    up = max(box[base.name][5], 0.0) - low + 2 * CLEAR
    yield "peel", View((*standing, *place_pieces([step], z=math.ceil(up))), way=1)
