"""What each picture of the procedure shows: which pieces stand where, which one moves, what holds or fills them.

Data: `bench_pictures` draws it. Meshed here is only what tells a place: a lid's channels, an array's motors, what is
laid into a curved base.
A view's name is the name of its file.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from unitcad.casting import bench_extras as draw
from unitcad.casting.bench_extras import CARD, CLEAR, Extra
from unitcad.casting.bench_view import ABOVE, OVER, UNDER, Offset, Placed, View
from unitcad.casting.figures import window_length
from unitcad.casting.laid_in_views import laid_in_views
from unitcad.casting.mouths import sprue_and_vent
from unitcad.casting.piece_views import joining_views, resin_views
from unitcad.casting.tape import tape, tape_places
from unitcad.casting.tongue_prop import tongue_prop
from unitcad.casting.tray_views import tray_views
from unitcad.casting.way_out import motor_views, way_out
from unitcad.designs import layer_colour
from unitcad.designs.tooling import Cell
from unitcad.export.picture_letters import Name
from unitcad.kernels.mesh import arrays
from unitcad.moulds.layout import MARK
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.moulds.tongue import GRIP_WIDTH
from unitcad.shape import box, cylinder, moved, union
from unitcad.text import number

FOLDER = "steps"
"""The pictures' folder in a result."""


def views(moulds: MouldSet) -> dict[str, View]:
    """Return every view of a procedure by its name, in the order of the steps."""
    return moulds.once_a_geometry("views", lambda blank: dict(_all(blank)))


def _all(moulds: MouldSet) -> Iterator[tuple[str, View]]:
    if moulds.cast_flat:
        return laid_in_views(moulds, moulds.cast_flat, views(moulds.cast_flat))
    return _views(moulds) if moulds.plan.of_kind("cup") else tray_views(moulds)


def picture_path(name: str) -> str:
    """Return the path of a view's picture in a result's folder."""
    return f"{FOLDER}/{name}.png"


def _views(moulds: MouldSet) -> Iterator[tuple[str, View]]:
    plan = moulds.plan
    standing = tuple(Placed(tool.name) for kind in ("base", "stub") for tool in plan.of_kind(kind))
    base = tuple(Placed(tool.name) for tool in plan.of_kind("base"))
    yield "pieces", View(tuple(Placed(piece.name) for piece in plan.pieces), eye=OVER, group="pieces")
    first, (cup_x, cup_y) = plan.steps[0], plan.layout.cup
    yield from resin_views(moulds)
    yield from joining_views(moulds)
    paper = () if plan.pins else draw.paper_in_slit(moulds)
    pressed = tuple(
        draw.downward(x * 0.8 * cup_x, y * 0.8 * cup_y, first.rim + 5, 8.0) for x in (1, -1) for y in (1, -1)
    )
    slit = (Name("paper", (cup_x + 6.0, 5.0 - cup_y, moulds.plate[1])),) if paper else ()
    yield "dry-fit", View((*base, Placed(first.cup)), (*paper, *pressed), names=(*slit, _corner(moulds, first.rim)))
    if plan.of_kind("stub"):
        down = 1.2 * (moulds.dimensions.core_height - moulds.plate[0])
        stubs = tuple(Placed(tool.name, (0.0, 0.0, -down)) for tool in plan.of_kind("stub"))
        arrows = tuple(
            draw.upward(cell.x + 4.0, cell.y - 4.0, moulds.plate[0] - down / 2, 7.0) for cell in plan.layout.cells
        )
        cell = plan.layout.cells[0]
        bent = cell.x, -plan.layout.plate[1] * 0.8, moulds.plate[0] - down
        names = Name("filament", bent), Name("groove", (cell.x, -plan.layout.plate[1] * 0.7, moulds.plate[0]))
        yield "filament", View((*base, *stubs), arrows, UNDER, "under", names=names)
    on = level_on(moulds)
    names = (
        Name("level", (0.0, -4.0, on.rim + 2)),
        Name("paper", (-plan.layout.plate[0] - 4, -plan.layout.plate[1], moulds.plate[0])),
    )
    yield "level", View((*standing, Placed(on.cup)), draw.level_on_rim(moulds, on.rim), names=names)
    for step in plan.steps:
        for name, view in _pour(moulds, step, standing):
            yield f"pour{step.index}-{name}", view
    yield from way_out(moulds)
    yield from motor_views(moulds)


def _pour(moulds: MouldSet, step: Step, standing: tuple[Placed, ...]) -> Iterator[tuple[str, View]]:
    plan, lay = moulds.plan, moulds.plan.layout
    before = plan.steps[: step.index - 1]
    inserts = tuple(Placed(body.name) for body in step.inserts)
    cured = (*standing, *(Placed(each.name) for each in before))
    if before:
        earlier = before[-1].inserts
        cell = min(lay.cells, key=lambda each: (each.y, each.x))
        face = Name("bond face", (cell.x, cell.y - moulds.dimensions.radii[step.index - 2], 0.6 * before[-1].rim))
        names = (face,) if plan.concentric else ()
        yield "bond-face", View((*cured, *(Placed(body.name) for body in earlier)), names=names)
    if moulds.design.laid_in == step.index:
        raised = tuple(Placed(body.name, (0.0, 0.0, 2 * CLEAR)) for body in step.inserts)
        yield "laid-in", View((*cured, *raised), (draw.downward(-lay.cup[0], -lay.cup[1], step.rim + CLEAR, 6.0),))
    cured = (*cured, *inserts)
    up = max(step.rim, moulds.dimensions.core_height) - moulds.plate[1] + CLEAR
    beside = 0.0, -lay.cup[1] - 4.0, moulds.plate[1] + up / 2
    raised = Placed(step.cup, (0.0, 0.0, up))
    key = _corner(moulds, step.rim + up)
    if moulds.greased(step):
        film = Extra(union(step.seals), draw.GREASE)
        yield "grease", View(cured, (film,), names=_greased(moulds, step))
    yield "cup-on", View((*cured, raised), (draw.downward(*beside, up * 0.6),), names=(key,))
    cup, tongues = Placed(step.cup), plan.standing(step, "tongue")
    home = tuple(Placed(tool.name) for tool in tongues)
    exits, prop = moulds.dimensions.exit, tongue_prop(moulds) if tongues else None
    pads = tuple(Extra(pad, CARD) for pad in prop.pads) if prop else ()
    tabs = draw.tabs(moulds) if tongues else ()
    if tongues and exits:
        seat = window_length(moulds, step)
        out = tuple(
            Placed(tool.name, (seat * tool.removal[0], 0.0, 0.0)) for tool in tongues if tool.removal is not None
        )
        arrows = tuple(
            draw.sideways(-side, side * (lay.cup[0] + seat + 10.0), cell.y, exits.high + 3.0, 10.0)
            for cell in lay.cells
            for side in cell.sides
        )
        opened = Placed(step.cup, half=True)
        cell, side = _nearest_exit(moulds)
        wall = side * lay.cup[0], cell.y - exits.width / 2, exits.high
        greased = Name(f"grease {number(seat, 2)} mm", (wall[0] + side * seat / 2, *wall[1:]))
        pushed = *arrows, *draw.grease(moulds, step, seat), *draw.tabs(moulds, seat)
        yield "tongue-in", View((*cured, opened, *out), pushed, names=(greased,))
        marks = draw.pen_marks(moulds) if len(plan.steps) > 1 else ()
        marked = (Name("pen mark", (wall[0] + side * 0.3, *wall[1:])),) if marks else ()
        card = (Name("card", _on_pad(moulds, side)),) if pads else ()
        yield "tongue-home", View((*cured, opened, *home), (*pads, *marks, *tabs), names=(*marked, *card))
    closed = (*cured, cup, *home)
    poured, colour = Placed(step.name), layer_colour(step.index - 1)
    if step.lid:
        lift = step.top - step.rim + 2 * CLEAR
        yield (
            "lid-on",
            View(
                (*closed, Placed(step.lid, (0.0, 0.0, lift))),
                (
                    *pads,
                    *tabs,
                    draw.grease_on_rim(moulds, step),
                    draw.downward(0.0, beside[1], step.rim + lift / 2, lift),
                ),
                names=(Name("grease", (0.4 * lay.cup[0], 0.8 - lay.cup[1], step.rim)),),
            ),
        )
        closed = (*closed, Placed(step.lid))
        held = (*pads, *draw.bands(lay.cup[0], lay.plate[1], moulds.plate[0], step.top))
        filled = Extra(union(step.channels), colour)
        band = Name("rubber band", (lay.cup[0] - 2.0, 0.0, step.top + 1))
        yield "lid-held", View(closed, (*held, *tabs), names=(band,))
        sprue, vent = sprue_and_vent(moulds, step)
        names = Name("sprue", sprue), Name("vent", vent, ring=True)
        yield "inject", View((*closed, poured), (*held, *tabs, filled), syringe_on=step.channels[0], names=names)
        yield "filled", View((*closed, poured), (*held, *tabs, filled), names=(Name("touch here", vent, ring=True),))
        held = (*held, filled)
    else:
        held = (*pads, *tape(moulds, step))
        # In pieces, to show that each has its tape.
        pieces = tuple(
            replace(part, name=piece.name)
            for part in closed
            for piece in (plan.pieces_of(part.name) if any(part.name == s.tool for s in plan.splits) else (part,))
        )
        yield (
            "hold",
            View(
                pieces,
                (*held, *tabs),
                names=(Name("tape", (tape_places(moulds)[0] + 4.0, -lay.plate[1], moulds.plate[1])),),
            ),
        )
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
            View(
                (*closed, poured), (*held, *tabs, *mounds, Extra(moved(thread, cell.x - 0.5 * reach, cell.y), colour))
            ),
        )
        blades, strips = _strikers(moulds, step)
        yield (
            "strike",
            View(
                (*closed, poured, *blades),
                (*held, *tabs, *strips, draw.sideways(1, -0.2 * lay.cup[0], 0.0, step.rim + 9.0, lay.cup[0])),
            ),
        )
        yield "filled", View((*closed, poured), (*held, *tabs), names=_touched(moulds, step))
    if tongues:
        out = tuple(Placed(t.name, (t.removal[0] * lay.cup[0], 0.0, 0.0)) for t in tongues if t.removal is not None)
        arrows = tuple(
            draw.sideways(
                side, side * (lay.cup[0] + 2.0), cell.y, (exits.high if exits else 0.0) + 3.0, lay.cup[0] * 0.7
            )
            for cell in lay.cells
            for side in cell.sides
        )
        lid, pulled = (Placed(step.lid),) if step.lid else (), draw.tabs(moulds, lay.cup[0])
        card = (Name("card", _on_pad(moulds, _nearest_exit(moulds)[1])),) if pads else ()
        yield (
            "tongue-out",
            View((*cured, cup, *lid, poured, *out), (*held, *arrows, *pulled), names=card),
        )
    if step.lid:
        lift = step.top - step.rim + 2 * CLEAR
        off = Placed(step.lid, (0.0, 0.0, lift))
        pushed = tuple(draw.upward(side * (lay.cup[0] + 3.0), 0.0, step.rim + lift / 2, lift) for side in (1, -1))
        yield "lid-off", View((*cured, cup, poured, off), pushed)
    if all(removal.piece != step.cup for removal in step.removals):
        return
    lever = Name("screwdriver", (lay.plate[0] + 8.0, 0.0, moulds.plate[1]))
    yield "cup-off", View((*cured, poured, raised), draw.in_pry_slots(moulds), names=(lever,))


def level_on(moulds: MouldSet) -> Step:
    """Return the first pour on whose rim a level lies flat: nothing on the base stands higher."""
    steps, core = moulds.plan.steps, moulds.dimensions.core_height
    return next((step for step in steps if step.rim >= core - 1e-9), steps[-1])


def _corner(moulds: MouldSet, z: float) -> Name:
    """Name the cut corner of a cup whose rim is at `z`."""
    x, y = moulds.plan.layout.cup
    return Name("cut corner", (x - MARK / 2, y - MARK / 2, z))


def _nearest_exit(moulds: MouldSet) -> tuple[Cell, int]:
    """Return the cell nearest the eye that a tongue leaves, and the side to which: to the right where one does."""
    cells = sorted(moulds.plan.layout.cells, key=lambda cell: (cell.y, -max(cell.sides, default=0)))
    return cells[0], max(cells[0].sides, default=1)


def _on_pad(moulds: MouldSet, side: int) -> Offset:
    """Return the middle of the nearer end of the card under the grips on a side."""
    prop, lay = tongue_prop(moulds), moulds.plan.layout
    if prop is None:
        return 0.0, 0.0, 0.0
    near = min(cell.y for cell in lay.cells if side in cell.sides) - GRIP_WIDTH / 2 - 1
    return side * (lay.cup[0] + prop.width_mm / 2), near, moulds.plate[1] + prop.thickness_mm / 3


def _touched(moulds: MouldSet, step: Step) -> tuple[Name, ...]:
    """Name the place in the overflow groove that shows whether a pour is cured."""
    if not step.groove or not moulds.plan.concentric:
        return ()
    cell, lengths = min(moulds.plan.layout.cells, key=lambda each: (each.y, each.x)), moulds.spec.moulds
    out = moulds.dimensions.radii[step.index - 1] + lengths.land_mm + lengths.groove_width_mm / 2
    return (Name("touch here", (cell.x - 0.5 * out, cell.y - 0.866 * out, step.rim - lengths.groove_depth_mm)),)


def _strikers(moulds: MouldSet, step: Step) -> tuple[tuple[Placed, ...], tuple[Extra, ...]]:
    """Return the blade on a rim, or a strip as wide as the cavity where what stands on the base is in its way."""
    plan, back = moulds.plan, -0.55 * moulds.plan.layout.cup[0]
    if not plan.concentric and plan.dimensions.core_height > step.rim:
        half = plan.dimensions.radii[step.index - 1]
        return (), (Extra(box(back, back + 0.8, -half, half, step.rim, step.rim + 12.0), CARD),)
    lift = step.rim - plan.steps[0].rim
    return tuple(Placed(tool.name, (back, 0.0, lift)) for tool in plan.of_kind("blade")), ()


def _greased(moulds: MouldSet, step: Step) -> tuple[Name, ...]:
    """Name the grease where a seal lies nearest the eye."""
    meshes = moulds.meshes(step.seals[:1])
    if not meshes or meshes[0].is_empty():
        return ()
    points = np.asarray(arrays(meshes[0])[0], float)
    x, y, z = points[np.argmax(points @ np.array(ABOVE))].tolist()
    return (Name("grease", (x, y, z)),)
