"""What each picture of the procedure shows: which pieces stand where, which one moves, what holds or fills them.

Data alone: `bench_pictures` draws it. A view's name is the name of its file.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from unitcad.casting.figures import window_length
from unitcad.casting.tongue_prop import tongue_prop
from unitcad.designs import layer_colour
from unitcad.moulds.base import plate_bottom, plate_top
from unitcad.moulds.layout import CORNER_RADIUS
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape import Revolve, Shape, box, cylinder, moved, polygon, turned, union

FOLDER = "steps"
"""The pictures' folder in a result."""
ABOVE, UNDER = (0.55, -1.0, 0.62), (0.55, -1.0, -0.6)
"""Directions towards the eye."""
ARROW, TAPE, BAND, TOOL = (0.10, 0.36, 0.86), (0.47, 0.78, 0.86), (0.35, 0.33, 0.38), (0.80, 0.86, 0.90)
CARD = (0.45, 0.72, 0.38)
CLEAR = 5.0
"""Between a piece that is lifted off and what it was on, mm."""
TAPE_WIDTH, TAPE_THICKNESS, BELOW_RIM = 8.0, 0.4, 0.8

Offset = tuple[float, float, float]


@dataclass(frozen=True)
class Placed:
    """A piece by its name, moved from its place (mm); `half`: without its half nearer the eye."""

    name: str
    moved: Offset = (0.0, 0.0, 0.0)
    half: bool = False


@dataclass(frozen=True)
class Extra:
    """Something beside the pieces: an arrow, tape, a thread of silicone; its colour as three numbers 0 to 1."""

    shape: Shape
    colour: tuple[float, float, float]


@dataclass(frozen=True)
class View:
    """One picture. Views of one `eye` and `group` share their scale. `syringe_on`: channels that one stands on."""

    parts: tuple[Placed, ...]
    extras: tuple[Extra, ...] = ()
    eye: Offset = ABOVE
    group: Literal["moulds", "under", "pieces", "unit"] = "moulds"
    syringe_on: Shape | None = None


def views(moulds: MouldSet) -> dict[str, View]:
    """Return every view of a procedure by its name, in the order of the steps."""
    return dict(_views(moulds))


def picture_path(name: str) -> str:
    """Return the path of a view's picture in a result's folder."""
    return f"{FOLDER}/{name}.png"


def _views(moulds: MouldSet) -> Iterator[tuple[str, View]]:
    plan, spec = moulds.plan, moulds.spec
    standing = tuple(Placed(tool.name) for kind in ("base", "stub") for tool in plan.of_kind(kind))
    base = tuple(Placed(tool.name) for tool in plan.of_kind("base"))
    yield "pieces", View(tuple(Placed(tool.name) for tool in plan.tools), group="pieces")
    first = plan.steps[0]
    tried = Placed(first.cup, (0.0, 0.0, spec.moulds.plinth_height_mm + moulds.dimensions.core_height + CLEAR))
    yield "dry-fit", View((*base, tried), eye=UNDER, group="moulds")
    if plan.of_kind("stub"):
        down = 1.2 * (moulds.dimensions.core_height - plate_bottom(spec))
        stubs = tuple(Placed(tool.name, (0.0, 0.0, -down)) for tool in plan.of_kind("stub"))
        arrows = tuple(
            _upward(cell.x + 4.0, cell.y - 4.0, plate_bottom(spec) - down / 2, 7.0) for cell in plan.layout.cells
        )
        yield "filament", View((*base, *stubs), arrows, UNDER, "under")
    for step in plan.steps:
        for name, view in _pour(moulds, step, standing):
            yield f"pour{step.index}-{name}", view
    if plan.of_kind("stub"):
        arrows = tuple(
            _downward(cell.x + 4.0, cell.y - 4.0, plate_bottom(spec) - 2.0, 7.0) for cell in plan.layout.cells
        )
        cured = tuple(Placed(step.name) for step in plan.steps)
        yield "filament-out", View((*base, *stubs, *cured), arrows, UNDER, "under")
    up = plan.steps[-1].rim + CLEAR
    unit = tuple(Placed(step.name, (0.0, 0.0, up)) for step in plan.steps)
    unit += tuple(Placed(body.name, (0.0, 0.0, up)) for body in plan.steps[-1].inserts)
    yield "peel", View((*(base if plan.of_kind("stub") else standing), *unit), (_raised(moulds, up),))
    inside = [body for body in moulds.unit if body.made != "cast"]
    if inside and not moulds.design.laid_in:
        below = moulds.design.opens == "below"
        away = (-1.0 if below else 1.0) * (moulds.dimensions.heights[-1] + CLEAR)
        cast = tuple(Placed(body.name, half=True) for body in moulds.unit if body.made == "cast")
        laid = tuple(Placed(body.name, (0.0, 0.0, away)) for body in inside)
        at = moulds.dimensions.outer_radius * 0.8
        arrow = (_upward if below else _downward)(-at, -2.0, away / 2 + moulds.dimensions.heights[-1] / 2, 5.0)
        yield "motor-in", View((*cast, *laid), (arrow,), UNDER if below else ABOVE, "unit")


def _pour(moulds: MouldSet, step: Step, standing: tuple[Placed, ...]) -> Iterator[tuple[str, View]]:
    plan, spec, lay = moulds.plan, moulds.spec, moulds.plan.layout
    before = plan.steps[: step.index - 1]
    inserts = tuple(Placed(body.name) for body in step.inserts)
    cured = (*standing, *(Placed(each.name) for each in before))
    if before:
        earlier = before[-1].inserts
        yield "bond-face", View((*cured, *(Placed(body.name) for body in earlier)))
    if moulds.design.laid_in == step.index:
        raised = tuple(Placed(body.name, (0.0, 0.0, 2 * CLEAR)) for body in step.inserts)
        yield "laid-in", View((*cured, *raised), (_downward(-lay.cup[0], -lay.cup[1], step.rim + CLEAR, 6.0),))
    cured = (*cured, *inserts)
    up = spec.moulds.plinth_height_mm + max(step.rim, moulds.dimensions.core_height) + CLEAR
    beside = 0.0, -lay.cup[1] - 4.0, plate_top(spec) + up / 2
    raised = Placed(step.cup, (0.0, 0.0, up))
    yield "cup-on", View((*cured, raised), (_downward(*beside, up * 0.6),))
    cup, tongues = Placed(step.cup), plan.standing(step, "tongue")
    home = tuple(Placed(tool.name) for tool in tongues)
    exits, prop = moulds.dimensions.exit, tongue_prop(moulds) if tongues else None
    pads = tuple(Extra(pad, CARD) for pad in prop.pads) if prop else ()
    if tongues and exits:
        seat = window_length(moulds, step) + lay.cup[0] * 0.35
        out = tuple(
            Placed(tool.name, (seat * tool.removal[0], 0.0, 0.0)) for tool in tongues if tool.removal is not None
        )
        arrows = tuple(
            _sideways(-side, side * (lay.cup[0] + seat), cell.y, exits.high + 3.0, seat)
            for cell in lay.cells
            for side in cell.sides
        )
        opened = Placed(step.cup, half=True)
        yield "tongue-in", View((*cured, opened, *out), arrows)
        yield "tongue-home", View((*cured, opened, *home), pads)
    closed = (*cured, cup, *home)
    poured, colour = Placed(step.name), layer_colour(step.index - 1)
    if step.lid:
        lift = step.top - step.rim + 2 * CLEAR
        yield (
            "lid-on",
            View(
                (*closed, Placed(step.lid, (0.0, 0.0, lift))),
                (*pads, _downward(0.0, beside[1], step.rim + lift / 2, lift)),
            ),
        )
        closed, held = (*closed, Placed(step.lid)), (*pads, *_bands(moulds, step))
        filled = Extra(union(step.channels), colour)
        yield "lid-held", View(closed, held)
        yield "inject", View((*closed, poured), (*held, filled), syringe_on=step.channels[0])
        yield "filled", View((*closed, poured), (*held, filled))
        held = (*held, filled)
    else:
        held = (*pads, *_tape(moulds, step))
        yield "hold", View(closed, held)
        thread = cylinder(0.6, step.rim - 1.0, step.rim + 14.0)
        cell = min(lay.cells, key=lambda each: (each.y, each.x))
        reach = (
            moulds.dimensions.radii[step.index - 1] + (moulds.dimensions.radii[step.index - 2] if before else 0.0)
        ) / 2
        mounds = (
            tuple(
                Extra(
                    moved(
                        cylinder(moulds.dimensions.radii[step.index - 1] + 0.6, step.rim, step.rim + 0.5),
                        each.x,
                        each.y,
                    ),
                    colour,
                )
                for each in lay.cells
            )
            if plan.concentric
            else ()
        )
        yield (
            "pour",
            View((*closed, poured), (*held, *mounds, Extra(moved(thread, cell.x - 0.5 * reach, cell.y), colour))),
        )
        blades, strips = _strikers(moulds, step)
        yield (
            "strike",
            View(
                (*closed, poured, *blades),
                (*held, *strips, _sideways(1, -0.2 * lay.cup[0], 0.0, step.rim + 9.0, lay.cup[0])),
            ),
        )
        yield "filled", View((*closed, poured), held)
    if tongues:
        out = tuple(Placed(t.name, (t.removal[0] * lay.cup[0], 0.0, 0.0)) for t in tongues if t.removal is not None)
        arrows = tuple(
            _sideways(side, side * (lay.cup[0] + 2.0), cell.y, (exits.high if exits else 0.0) + 3.0, lay.cup[0] * 0.7)
            for cell in lay.cells
            for side in cell.sides
        )
        lid = (Placed(step.lid),) if step.lid else ()
        yield "tongue-out", View((*cured, cup, *lid, poured, *out), (*held, *arrows))
    if step.lid:
        lift = step.top - step.rim + 2 * CLEAR
        yield (
            "lid-off",
            View(
                (*cured, cup, poured, Placed(step.lid, (0.0, 0.0, lift))),
                (_upward(0.0, beside[1], step.rim + lift / 2, lift),),
            ),
        )
    yield "cup-off", View((*cured, poured, raised), (_upward(*beside, up * 0.6),))


def _strikers(moulds: MouldSet, step: Step) -> tuple[tuple[Placed, ...], tuple[Extra, ...]]:
    """Return the blade on a rim, or a strip as wide as the cavity where what stands on the base is in its way."""
    plan, back = moulds.plan, -0.55 * moulds.plan.layout.cup[0]
    if not plan.concentric and plan.dimensions.core_height > step.rim:
        half = plan.dimensions.radii[step.index - 1]
        return (), (Extra(box(back, back + 0.8, -half, half, step.rim, step.rim + 12.0), CARD),)
    lift = step.rim - plan.steps[0].rim
    return tuple(Placed(tool.name, (back, 0.0, lift)) for tool in plan.of_kind("blade")), ()


def _arrow(length: float) -> Shape:
    """Draw an arrow along +z, its middle at the origin."""
    shaft, head = 0.55, 1.5
    tip = min(3.6, length / 2)
    outline = polygon((0, 0), (shaft, 0), (shaft, length - tip), (head, length - tip), (0, length))
    return moved(Revolve(outline), 0, 0, -length / 2)


def _upward(x: float, y: float, z: float, length: float) -> Extra:
    return Extra(moved(_arrow(length), x, y, z), ARROW)


def _downward(x: float, y: float, z: float, length: float) -> Extra:
    return Extra(moved(turned(_arrow(length), "x", 2), x, y, z), ARROW)


def _sideways(side: int, x: float, y: float, z: float, length: float) -> Extra:
    """Draw an arrow along x to the given side, its middle at (x, y, z)."""
    return Extra(moved(turned(_arrow(length), "y", 1 if side > 0 else 3), x, y, z), ARROW)


def _raised(moulds: MouldSet, up: float) -> Extra:
    lay = moulds.plan.layout
    return _upward(0.0, -lay.cup[1], up / 2, up * 0.8)


def _tape(moulds: MouldSet, step: Step) -> tuple[Extra, ...]:
    """Draw the strips of tape on the two sides without a pry slot: cup's wall, plate, plate's edge, underside."""
    spec, lay = moulds.spec, moulds.plan.layout
    top, bottom, thick = plate_top(spec), plate_bottom(spec), TAPE_THICKNESS
    left = CORNER_RADIUS - lay.cup[0]  # beside the filaments, which leave in the middle
    strips: list[Extra] = []
    for side in (1, -1):
        runs = [
            (lay.cup[1], lay.cup[1] + thick, top, step.rim - BELOW_RIM),
            (lay.cup[1], lay.plate[1] + thick, top, top + thick),
            (lay.plate[1], lay.plate[1] + thick, bottom - thick, top + thick),
            (lay.plate[1] - 5.0, lay.plate[1] + thick, bottom - thick, bottom),
        ]
        boxes = [
            box(left, left + TAPE_WIDTH, min(side * a, side * b), max(side * a, side * b), low, high)
            for a, b, low, high in runs
        ]
        strips.append(Extra(union(boxes), TAPE))
    return tuple(strips)


def _bands(moulds: MouldSet, step: Step) -> tuple[Extra, ...]:
    """Draw two rubber bands round lid and base, beyond the outermost cells."""
    spec, lay = moulds.spec, moulds.plan.layout
    low, high, y = plate_bottom(spec), step.top, lay.plate[1]
    bands = []
    for side in (1, -1):
        x0, x1 = sorted((side * (lay.cup[0] - 1.0), side * (lay.cup[0] - 3.0)))
        runs = [
            (-y - 1, y + 1, high, high + 1),
            (-y - 1, -y, low - 1, high + 1),
            (y, y + 1, low - 1, high + 1),
            (-y - 1, y + 1, low - 1, low),
        ]
        bands.append(Extra(union(box(x0, x1, *run) for run in runs), BAND))
    return tuple(bands)
