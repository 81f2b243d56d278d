"""Content of each picture of the procedure: the pieces in their places, the moving one, tape and fillings.

Data: `pictures` draws it. Meshed here are only parts that define a place: a lid's channels, an array's motors, inserts
of a curved base. A view's name is the name of its file.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from unitcad.casting.drawings import (
    CARD,
    CLEAR,
    DOWN,
    GREASE,
    TOOL,
    Extra,
    Offset,
    arrow,
    bands,
    cast_colour,
    grease_on_rim,
    led_out,
    on_tongues,
    screwdrivers,
    tape,
    tape_places,
    tongue_prop,
)
from unitcad.casting.figures import window_length
from unitcad.casting.fittings import fittings
from unitcad.casting.plates import made_pieces
from unitcad.designs import layer_colour
from unitcad.designs.design import ADHESIVE
from unitcad.export import raster
from unitcad.export.printing import layout
from unitcad.export.raster import Name, Surface
from unitcad.kernels.mesh import arrays, bounds, realise
from unitcad.moulds.base import GRIP_WIDTH, plate_bottom, pry_floor
from unitcad.moulds.layout import MARK
from unitcad.moulds.lid import films
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.pieces import CAST, Way
from unitcad.moulds.plan import Step, place_in_cell
from unitcad.rooms import load
from unitcad.shape import Common, Revolve, Shape, box, cut, cylinder, moved, polygon, union
from unitcad.shape.extent import extent
from unitcad.shape.tree import Body
from unitcad.text import number

ABOVE, UNDER, OVER, LOW = (0.55, -1.0, 0.62), (0.55, -1.0, -0.6), (0.25, -1.0, 1.2), (0.55, -1.0, 0.3)
"""Directions towards the eye."""
SINGLE, LEAST_ARROW = 25.0, 7.0
"""Half width of a single unit's plate, for which arrows are drawn, and the least length of an arrow on it, mm."""
Views = Iterator[tuple[str, "View"]]
Group = Literal["moulds", "under", "pieces", "unit", "curved"]


@dataclass(frozen=True)
class Placed:
    """A piece by its name, moved from its place (mm); `half`: without its half nearer the eye."""

    name: str
    moved: Offset = (0.0, 0.0, 0.0)
    half: bool = False


@dataclass(frozen=True)
class View:
    """One picture. Views of one `eye` and `group` share their scale.

    `names` are next to the points that they name; pieces laid out side by side are named by their own names. `turned`:
    the picture upside down, for parts on their back. A moved part has an arrow, back to its place (`way` -1) or on (1);
    none if it stays (0).
    """

    parts: tuple[Placed, ...]
    extras: tuple[Extra, ...] = ()
    eye: Offset = ABOVE
    group: Group = "moulds"
    names: tuple[Name, ...] = ()
    turned: bool = False
    way: int = -1


def place_pieces(
    these: Iterable[Body | Step], x: float = 0.0, z: float = 0.0, half: bool = False
) -> tuple[Placed, ...]:
    """Return pieces, or cast layers, in their places or next to them."""
    return tuple(Placed(each.name, (x, 0.0, z), half) for each in these)


def views(moulds: MouldSet) -> dict[str, View]:
    """Return every view of a procedure by its name, in the order of the steps."""

    def made() -> dict[str, View]:
        return {
            name: replace(view, extras=(*view.extras, *_arrows(moulds, view)), way=0) for name, view in _views(moulds)
        }

    return moulds.once("views", made)


def _arrows(moulds: MouldSet, view: View) -> Iterator[Extra]:
    """Yield an arrow for each way in which a view moves things, in front of them."""
    moving: dict[Offset, list[tuple[float, ...]]] = {}
    thick = max(1.0, max(moulds.plan.layout.plate) / SINGLE)
    for item in (*view.parts, *view.extras):
        if any(item.moved) and view.way:
            for shape, _ in shapes(moulds, item, view.group == "unit"):
                box = bounds(moulds.mesh_of(shape)) if view.group == "curved" else extent(shape)
                moving.setdefault(item.moved, []).append(box)
    for (dx, dy, dz), boxes in moving.items():
        if not (dx or dz):
            continue  # it would point at the eye
        (x0, y0, z0), (x1, _, z1) = np.min(boxes, axis=0)[:3].tolist(), np.max(boxes, axis=0)[3:].tolist()
        x, z = (x0 + x1 + dx) / 2, (z0 + z1 + dz) / 2
        if not dz:
            # A sliding part has it above.
            x, z = x + dx / 2, z1 + 3.0
        length = max(0.6 * math.hypot(dx, dz), LEAST_ARROW * thick if thick > 1 else 0.0)
        yield arrow((view.way * dx, 0.0, view.way * dz), x, y0 + dy - 4.0 * (dz != 0), z, length, thick)


def shapes(moulds: MouldSet, item: Placed | Extra, unit: bool) -> list[tuple[Shape, tuple[float, float, float]]]:
    """Return the shapes of a view's content, not moved, and their colours; `unit`: of the unit, not of its moulds."""
    if isinstance(item, Extra):
        return [(item.shape, item.colour)]
    plan = moulds.plan
    if unit:
        bodies = *moulds.unit, *moulds.plan.laid_later, *moulds.plan.pushed_in
    else:
        bodies = dict.fromkeys((*plan.tools, *made_pieces(moulds), *plan.steps[-1].inserts))
    cast = [(step, shape) for step in plan.steps if step.name == item.name and not unit for shape in step.layer]
    found = [(shape, cast_colour(moulds, step.index)) for step, shape in cast]
    return found + [(body.shape, body.colour) for body in bodies if body.name == item.name]


def picture_path(name: str) -> str:
    """Return the path of a view's picture in a result's folder."""
    return f"steps/{name}.png"


def pour_picture(pour: int, name: str) -> str:
    """Return the path of a pour's view (from 1)."""
    return picture_path(f"pour{pour}-{name}")


def _views(moulds: MouldSet) -> Views:
    plan = moulds.plan
    yield "pieces", View(place_pieces(made_pieces(moulds)), eye=OVER, group="pieces")
    if moulds.inner:
        yield from _curved(moulds, moulds.inner, views(moulds.inner))
        return
    if plan.bench:
        yield from load(f"{plan.bench}:views")(moulds)
        return
    yield from cup_views(moulds)


def cup_views(moulds: MouldSet) -> Views:
    """Yield the views of moulds with cups that lift off, after that of their pieces; or of a tray."""
    plan, bottom = moulds.plan, moulds.plate[0]
    base, first = place_pieces(plan.of_kind("base")), plan.steps[0]
    if not plan.of_kind("cup"):
        yield from tray_views(moulds, base, first)
        return
    pressed = arrow(DOWN, 0.0, -0.8 * plan.layout.cup[1], first.rim + 5, 8.0)
    yield "dry-fit", View((*base, Placed(first.cup)), (pressed,), names=(_corner(moulds, first.rim),))
    if filaments := plan.of_kind("filament"):
        down = 1.2 * (moulds.dimensions.core_height - bottom)
        x, y = plan.layout.cells[0].x, -plan.layout.plate[1]
        names = Name("filament", (x, y * 0.8, bottom - down)), Name("groove", (x, y * 0.7, bottom))
        up = _beside_filaments(moulds, 1)
        yield "filament", View((*base, *place_pieces(filaments, z=-down)), up, UNDER, "under", names=names, way=0)
    standing = *base, *place_pieces(filaments)
    for step in plan.steps:
        for name, view in _pour(moulds, step, standing):
            yield f"pour{step.index}-{name}", view
    yield from _demoulding(moulds)
    yield from _motor_in(moulds)
    yield from _skin_on(moulds)


def _pour(moulds: MouldSet, step: Step, standing: tuple[Placed, ...]) -> Views:
    plan, lay, dims, (bottom, top) = moulds.plan, moulds.plan.layout, moulds.dimensions, moulds.plate
    (cup_x, cup_y), before, radius = lay.cup, plan.steps[: step.index - 1], dims.radii[step.index - 1]
    near, lengths = min(lay.cells, key=lambda each: (each.y, each.x)), moulds.spec.moulds
    cured = *standing, *place_pieces(before)
    if before:
        face = Name("bond face", (near.x, near.y - dims.radii[step.index - 2], 0.6 * before[-1].rim))
        yield "bond-face", View((*cured, *place_pieces(before[-1].inserts)), names=(face,) if plan.concentric else ())
    if moulds.design.laid_in == step.index:
        yield "laid-in", View((*cured, *place_pieces(step.inserts, z=2 * CLEAR)))
    cured = *cured, *place_pieces(step.inserts)
    if step.greased:
        meshes = [mesh for mesh in moulds.meshes(step.seals[:1]) if not mesh.is_empty()]
        points = [max(np.asarray(arrays(mesh)[0], float).tolist(), key=np.array(ABOVE).dot) for mesh in meshes]
        yield (
            "grease",
            View(
                cured, (Extra(union(step.seals), GREASE),), names=tuple(Name("grease", (x, y, z)) for x, y, z in points)
            ),
        )
    up = max(step.rim, dims.core_height) - top + CLEAR
    raised = Placed(step.cup, (0.0, 0.0, up))
    yield "cup-on", View((*cured, raised), names=(_corner(moulds, step.rim + up),))
    tongues, exit = plan.standing(step, "tongue"), dims.exit
    prop = tongue_prop(moulds) if tongues else None
    on, card = (), ()
    if prop and exit:

        def slid(out: float) -> tuple[Placed, ...]:
            return tuple(Placed(each.name, ((each.removal or DOWN)[0] * out, 0.0, 0.0)) for each in tongues)

        seat, opened = window_length(moulds, step), Placed(step.cup, half=True)
        cell = min(lay.cells, key=lambda each: (each.y, -max(each.sides, default=0)))
        side = max(cell.sides, default=1)
        wall = cell.y - exit.width / 2, exit.high
        pushed = on_tongues(moulds, seat, GREASE)
        greased = Name(f"grease {number(seat, 2)} mm", (side * (cup_x + seat / 2), *wall))
        yield "tongue-in", View((*cured, opened, *slid(seat)), pushed, names=(greased,))
        on = tuple(Extra(pad, CARD) for pad in prop.pads)
        front = min(cell.y for cell in lay.cells if side in cell.sides) - GRIP_WIDTH / 2 - 1
        card = (Name("card", (side * (cup_x + prop.width_mm / 2), front, top + prop.thickness_mm / 3)),)
        yield "tongue-home", View((*cured, opened, *place_pieces(tongues)), on, names=card)
    closed = *cured, Placed(step.cup), *place_pieces(tongues)
    lift, poured, colour = step.top - step.rim + 2 * CLEAR, place_pieces([step]), layer_colour(step.index - 1)
    off = Placed(step.lid or "", (0.0, 0.0, lift + moulds.hung(step)))
    if step.lid:
        grease = Name("grease", (0.4 * cup_x, 0.8 - cup_y, step.rim))
        yield "lid-on", View((*closed, off), (*on, grease_on_rim(moulds, step)), names=(grease,))
        held = *on, *bands(cup_x, lay.plate[1], bottom, step.top)
        yield from _injected(moulds, step, (*closed, Placed(step.lid)), held, cup_x - 2.0)
        held = *held, Extra(union(step.channels), colour)
    elif step.gated:
        held = *on, *tape(moulds, step)
        yield "hold", View(closed, held)
        yield from injected_views(moulds, step, closed, held)
        held = *held, Extra(union(step.channels), colour)
    else:
        held = *on, *tape(moulds, step)
        names = (Name("tape", (tape_places(moulds)[0] + 4.0, -lay.plate[1], top)),)
        yield "hold", View(closed, held, names=names)
        reach = (radius + (dims.radii[step.index - 2] if before else 0.0)) / 2
        mound = cylinder(radius + 0.6, step.rim, step.rim + 0.5)
        mounds = [moved(mound, cell.x, cell.y) for cell in lay.cells if plan.concentric]
        thread = moved(cylinder(0.6, step.rim - 1.0, step.rim + 14.0), near.x - 0.5 * reach, near.y)
        yield "pour", View((*closed, *poured), (*held, *(Extra(each, colour) for each in (*mounds, thread))))
        back, strikers = -0.55 * cup_x, held
        blades = place_pieces(plan.of_kind("blade"), back, step.rim - (*before, step)[0].rim)
        if not plan.concentric and plan.dimensions.core_height > step.rim:
            # A strip as wide as the cavity, since parts on the base are in the blade's way.
            half, blades = plan.dimensions.radii[step.index - 1], ()
            strikers = *held, Extra(box(0.0, 0.8, -half, half, step.rim, step.rim + 12.0), CARD, (back, 0.0, 0.0))
        yield "strike", View((*closed, *poured, *blades), strikers)
        out = radius + lengths.land_mm + lengths.groove_width_mm / 2
        touched = Name("touch here", (near.x - 0.5 * out, near.y - 0.866 * out, step.rim - lengths.groove_depth_mm))
        names = (touched,) if step.groove and plan.concentric else ()
        yield "filled", View((*closed, *poured), held, names=names)
    parts = *cured, Placed(step.cup), *poured
    if prop and exit:
        lid = (Placed(step.lid),) if step.lid else ()
        yield "tongue-out", View((*parts, *lid, *slid(cup_x)), held, names=card, way=1)
    if step.lid:
        yield "lid-off", View((*parts, off), way=1)
    if any(removal.piece == step.cup for removal in step.removals):
        lever = Name("screwdriver", (lay.plate[0] + 8.0, 0.0, top))
        low = pry_floor(moulds.spec) - plate_bottom(moulds.spec) + bottom
        yield "cup-off", View((*cured, *poured, raised), screwdrivers(cup_x, lay.plate[0], low), names=(lever,), way=1)


def _injected(
    moulds: MouldSet,
    step: Step,
    closed: tuple[Placed, ...],
    held: tuple[Extra, ...],
    band: float,
    group: Group = "moulds",
) -> Views:
    """Yield the views of a lid that is held down, filled and cured, with a band at x = `band`."""
    names = (Name("rubber band", (band, 0.0, step.top + 1)),)
    yield "lid-held", View(closed, held, group=group, names=names)
    yield from injected_views(moulds, step, closed, held, group)


def injected_views(
    moulds: MouldSet, step: Step, closed: tuple[Placed, ...], held: tuple[Extra, ...], group: Group = "moulds"
) -> Views:
    """Yield the views of a closed mould that is injected and cured."""
    # Of the second cavity, if there are several: clear of the syringe. The vent nearest the eye.
    count = len(step.channels) // len(step.layer)
    first = count if len(step.channels) > count else 0
    sprue, *vents = (_middle(moulds, shape, top=True) for shape in step.channels[first : first + count])
    vent = max(vents, key=lambda at: ABOVE[0] * at[0] + ABOVE[1] * at[1])
    closed, held = (*closed, *place_pieces([step])), (*held, Extra(union(step.channels), layer_colour(step.index - 1)))
    names = Name("sprue", sprue), Name("vent", vent, ring=True)
    x0, y0, _, x1, y1, z = bounds(moulds.mesh_of(step.channels[0]))
    tip = (x1 - x0) / 2
    profile = polygon((0, -1), (0.6 * tip, -1), (tip, 6), (4, 8), (4, 26), (6, 26), (6, 27), (0, 27))
    syringe = Extra(moved(Revolve(profile), (x0 + x1) / 2, (y0 + y1) / 2, z), TOOL)
    yield "inject", View(closed, (*held, syringe), group=group, names=names)
    yield "filled", View(closed, held, group=group, names=(Name("touch here", vent, ring=True),))


def _beside_filaments(moulds: MouldSet, up: int) -> tuple[Extra, ...]:
    """Draw an arrow, up (1) or down (-1), next to each upright end: the plate would hide one at a bent end."""
    bottom = moulds.plate[0]
    z = bottom - 0.6 * (moulds.dimensions.core_height - bottom)
    return tuple(arrow((0, 0, up), cell.x + 4.0, cell.y - 4.0, z, 7.0) for cell in moulds.plan.layout.cells)


def _corner(moulds: MouldSet, z: float) -> Name:
    """Name the cut corner of a cup whose rim is at `z`."""
    x, y = moulds.plan.layout.cup
    return Name("cut corner", (x - MARK / 2, y - MARK / 2, z))


def _demoulding(moulds: MouldSet) -> Views:
    """Yield the views from the last cured layer to the cast in the hand."""
    plan, (bottom, top), y = moulds.plan, moulds.plate, moulds.plan.layout.cup[1]
    base, last = plan.of_kind("base"), plan.steps[-1]
    cast = *plan.steps, *last.inserts
    stays = () if any(removal.piece == last.cup for removal in last.removals) else (Placed(last.cup),)
    if filaments := plan.of_kind("filament"):
        away = place_pieces(filaments, z=1.2 * (bottom - moulds.dimensions.core_height))
        out = _beside_filaments(moulds, -1)
        yield "filament-out", View((*place_pieces((*base, *cast)), *stays, *away), out, UNDER, "under", way=0)
    up = last.rim + CLEAR
    raised = place_pieces(cast, z=up)
    if not stays:
        yield "peel", View((*place_pieces(base), *raised), way=1)
        return
    down = moulds.dimensions.core_height + max(last.rim, 2 * CLEAR)
    names = Name("base", (0.0, -plan.layout.plate[1], top - down)), Name("cup stays on", (0.0, -y, last.rim / 2))
    yield "base-off", View((*place_pieces(base, z=-down), *place_pieces(cast), *stays), names=names, way=1)
    yield "push-out", View((*stays, *raised), way=1)


def _motor_in(moulds: MouldSet) -> Views:
    """Yield the views of motor and circuit going in: a unit that opens to the skin is on its back."""
    steps, dims = fittings(moulds), moulds.dimensions
    inside = [body for body in (*moulds.unit, *moulds.plan.laid_later) if body.made != "cast"]
    if not inside or moulds.design.laid_in:
        return
    below, places = moulds.design.opens == "below", {fitting.place for fitting in steps}
    cast = place_pieces((body for body in moulds.unit if body.kind == "layer"), half=not moulds.plan.laid_later)
    eye = UNDER if below else LOW

    def view(parts: Iterable[Placed], extras: tuple[Extra, ...] = (), way: int = -1) -> View:
        return View((*cast, *parts), extras, eye, "unit", turned=below, way=way)

    away = (-1.0 if below else 1.0) * (dims.heights[-1] + CLEAR)
    leads: tuple[Extra, ...] = ()
    if "beside" in places:
        # On the same bench: the body stands on its top.
        off = dims.outer_radius + dims.motor_radius + CLEAR, 0.0, dims.heights[-1] - dims.motor_height
        yield "motor-beside", view((Placed(body.name, off) for body in inside), way=0)
    if "fed" in places:
        away = -(dims.core_height + CLEAR / 2)
        leads = led_out(moulds, inside, away)
        inside = [body for body in inside if body.kind not in ("circuit", "wire")]
        ends = tuple(
            arrow((side, 0.0, 0.0), side * (dims.outer_radius + 3.0), -4.0, dims.core_height, 6.0)
            for side in dims.sides
        )
        yield "motor-fed", view(place_pieces(inside, z=away), (*leads, *ends), way=0)
    if "in" in places:
        yield "motor-in", view(place_pieces(inside, z=away), leads)
    if "home" in places or any(fitting.mixed or ADHESIVE in fitting.required_tools for fitting in steps):
        whole = [body for body in (*moulds.unit, *moulds.plan.laid_later) if body.made != "cast"]
        yield "motor-home", view(place_pieces(whole))


def _skin_on(moulds: MouldSet) -> Views:
    """Yield the views of the film that closes the skin side: alone, under the unit, and with the unit on it."""
    trays, plan, dims = place_pieces(moulds.plan.of_kind("tray")), moulds.plan, moulds.dimensions
    if not trays:
        return
    rim, colour = dims.heights[-1], layer_colour(len(plan.steps) - 1)
    film = Extra(union(films(moulds.frame)), colour)
    names = (Name("film", (plan.layout.cells[0].x, plan.layout.cells[0].y, rim), on=True),)
    inside = [body for body in moulds.unit if body.made == "bought"]

    def lowered(lift: float) -> tuple[tuple[Placed, ...], tuple[Extra, ...]]:
        """Return the units, motor and circuit in, with their skin side at z = `lift`."""
        within = (
            Extra(place_in_cell(body.shape, dims, cell), body.colour, (0.0, 0.0, lift))
            for body in inside
            for cell in plan.layout.cells
        )
        return place_pieces(plan.steps, z=lift), tuple(within)

    yield "skin-tray", View(trays, (film,), names=names)
    units, within = lowered(rim + 2 * CLEAR)
    yield "skin-on", View((*trays, *units), (film, *within), names=names)
    units, within = lowered(rim)
    yield "skin-cure", View((*trays, *units), (film, *within), way=0)


def tray_views(moulds: MouldSet, tray: tuple[Placed, ...], step: Step) -> Views:
    """Yield the views of the one pour of a tray, a mould without cups."""
    x, lengths = moulds.plan.layout.plate[0], moulds.spec.moulds
    filled = *tray, *place_pieces([step])
    x0, y0, _, _, y1, _ = bounds(moulds.meshes(step.layer)[0])
    thread = moved(cylinder(0.6, step.rim - 1.0, step.rim + 14.0), x0 + 3.0, (y0 + y1) / 2)
    yield "pour", View(filled, (Extra(thread, cast_colour(moulds, 1)),))
    yield "strike", View((*filled, *place_pieces(moulds.plan.of_kind("blade"), -0.55 * x)))
    groove = y0 - lengths.land_mm - lengths.groove_width_mm / 2
    touched = Name("touch here", ((x0 + 2 * x) / 3, groove, step.rim - lengths.groove_depth_mm))
    yield "filled", View(filled, names=(touched,))
    up = step.rim + 2 * CLEAR
    yield "peel", View((*tray, *place_pieces([step], z=up)), way=1)
    if cast := {
        body.name.partition("-")[0]: bounds(moulds.mesh(body)) for body in moulds.plan.pushed_in if body.made == "cast"
    }:
        # The sheet, its back up, and the units under their pockets, each named by its place.
        down = max(high for *_, high in cast.values()) + CLEAR
        middles = {name: ((box[0] + box[3]) / 2, (box[1] + box[4]) / 2, step.rim) for name, box in cast.items()}
        names = tuple(Name(name, at, on=True) for name, at in middles.items())
        parts = *place_pieces(moulds.unit), *place_pieces(moulds.plan.pushed_in, z=-down)
        yield "units-in", View(parts, (), OVER, "unit", names=names)


def _curved(moulds: MouldSet, cast_flat: MouldSet, flat: Mapping[str, View]) -> Views:
    """Yield the views of a set whose last pour has a base of its own, round a limb.

    `cast_flat`: the set of the flat tools, `flat`: its views.
    """
    plan, step = moulds.plan, moulds.plan.steps[-1]
    for name, view in flat.items():
        if name in ("filament-out", "peel"):
            yield f"flat-{name}", view
        elif view.group in ("moulds", "under"):
            yield name, view
    count = len(plan.layout.cells)
    # Inserts, pour by pour, in the order of the cells; and the direction in which the unit of each cell is drawn off.
    laid = [step.earlier[i : i + count] for i in range(0, len(step.earlier), count)]
    drawn_off = [removal for removal in step.removals if removal.piece == CAST]
    by_part = {removal.part: removal.direction for removal in drawn_off}
    ways = [by_part[f"at {cell.name}"] for cell in plan.layout.cells]
    casts = tuple(Extra(union(shapes), layer_colour(pour)) for pour, shapes in enumerate(laid))
    (base,), (lid,), filaments = (plan.standing(step, kind) for kind in ("base", "lid", "filament"))
    x0, y0, bottom, x1, y1, high = bounds(moulds.mesh(base))
    seat, standing = step.pins.seat if step.pins else bottom, place_pieces((base, *filaments))

    def pulled(there: tuple[Placed, ...], casts: tuple[Extra, ...], way: int) -> View:
        """Return the base from below, its filaments halfway out along their cores, on their way up or down."""
        out = 0.8 * (high - bottom)
        away = (Placed(piece.name, _along(piece.removal or DOWN, out)) for piece in filaments)
        return View((*there, *away), casts, UNDER, "curved", way=way)

    def last_pour() -> Views:
        """Yield the views from the empty curved base to the cured sheet without its lid."""
        yield "filament", pulled(place_pieces([base]), (), -1)
        raised = [
            Extra(shape, layer_colour(pour), _along(way, 2 * CLEAR))
            for pour, shapes in enumerate(laid)
            for shape, way in zip(shapes, ways, strict=True)
        ]
        tops = (_middle(moulds, moved(extra.shape, *extra.moved)) for extra in raised[-count:])
        names = tuple(Name(cell.name, at) for cell, at in zip(plan.layout.cells, tops, strict=True))
        yield "laid-in", View(standing, tuple(raised), group="curved", names=names)
        lift = high - seat + CLEAR
        off = place_pieces([lid], z=lift)
        edges = [box(x0, x1, *ys, seat, step.top) for ys in ((y0 + 0.5, y0 + 1.5), (y1 - 1.5, y1 - 0.5))]
        line = Common((union(step.seals), union((*edges, box(x0, x1, y0, y1, seat + 0.4, seat + 0.9)))))
        names = (Name("grease", (0.0, y0 + 1.0, high)),)
        yield "lid-on", View((*standing, *off), (*casts, Extra(line, GREASE)), group="curved", names=names)
        held = *casts, *bands(x1, y1, bottom, step.top)
        yield from _injected(moulds, step, (*standing, *place_pieces([lid])), held, x1 - 2.0, "curved")
        levers = *casts, *screwdrivers(x1, x1, seat)
        names = (Name("screwdriver", (x1 + 8.0, 0.0, seat)),)
        yield "lid-off", View((*standing, *place_pieces([step]), *off), levers, group="curved", names=names, way=1)

    for name, view in last_pour():
        yield f"pour{step.index}-{name}", view
    yield "filament-out", pulled(place_pieces([base, step]), casts, 1)
    # The silicone drawn off, each part in its own direction.
    up = step.rim + 2 * CLEAR
    *others, last = drawn_off
    spaces: dict[Way, list[Shape]] = {}
    for removal in others:
        if removal.within and removal.direction != last.direction:
            spaces.setdefault(removal.direction, []).append(removal.within)
    rest = [space for within in spaces.values() for space in within]
    extras = []
    for pour, shapes in enumerate((*laid, step.layer)):
        whole = union(shapes)
        apart = ((Common((whole, union(within))), way) for way, within in spaces.items())
        parts = *apart, (cut(whole, rest), last.direction)
        extras += [Extra(part, layer_colour(pour), _along(way, up)) for part, way in parts]
    yield "peel", View(place_pieces([base]), tuple(extras), group="curved", way=1)
    bodies = {body.name: body for body in (*cast_flat.unit, *cast_flat.plan.laid_later)}
    for name in ("motor-in", "motor-home"):
        # Flat parts here have the names of those cast round the limb: they are drawn by their shapes.
        shapes = (Extra(bodies[part.name].shape, bodies[part.name].colour, part.moved) for part in flat[name].parts)
        yield name, replace(flat[name], parts=(), extras=(*shapes, *flat[name].extras), way=0)


def _middle(moulds: MouldSet, shape: Shape, top: bool = False) -> Offset:
    """Return the middle of a shape's box, or of the box's upper face."""
    x0, y0, z0, x1, y1, z1 = bounds(moulds.mesh_of(shape))
    return (x0 + x1) / 2, (y0 + y1) / 2, z1 if top else (z0 + z1) / 2


def _along(way: Way, length: float) -> Offset:
    """Return a way as long as that."""
    x, y, z = way
    return x * length, y * length, z * length


SIZE, MANY = (540, 360), (540, 560)
"""Size of a picture, px; of that of the pieces if tools are printed in several."""
_GAP = 9.0
"""Between pieces laid out side by side, mm."""
_Key = tuple[Placed | Extra, bool]
"""The content of a view, and whether it is of the unit, not of its moulds."""


class BenchPictures:
    """The pictures of a set's procedure, each drawn when it is asked for.

    Views of one kind show like scenes, from one side, at one scale: a drawing made for one of them serves all. Ask for
    `names` in their order, or backwards.
    """

    def __init__(self, moulds: MouldSet) -> None:
        self._moulds, self._views = moulds, views(moulds)
        self._kind: object = None
        kinds = [_kind(view) for view in self._views.values()]
        self.names = sorted(self._views, key=lambda name: kinds.index(_kind(self._views[name])))

    def picture(self, name: str) -> bytes:
        """Return the PNG of a view."""
        view = self._views[name]
        if self._kind != _kind(view):
            self._kind, self._drawn, self.written = _kind(view), {}, view.names
            alike = (key for other in self._views.values() if _kind(other) == self._kind for key in _keys(other))
            self._solids = {key: list(_solids(self._moulds, *key)) for key in dict.fromkeys(alike)}
            size = MANY if view.group == "pieces" and self._moulds.plan.splits else SIZE
            if view.group == "pieces":
                self._solids, self.written = _laid_out(self._moulds, self._solids)
            points = np.concatenate([solid.vertices for each in self._solids.values() for solid in each])
            self._camera = raster.aim(view.eye, points, size, turned=view.turned)
        bodies = []
        for key in _keys(view):
            if key not in self._drawn:
                self._drawn[key] = [raster.render(solid, self._camera) for solid in self._solids[key]]
            bodies += self._drawn[key]
        return raster.finish(bodies, self._camera, self.written if view.group == "pieces" else view.names)


def _kind(view: View) -> object:
    return view.group, view.eye, view.turned


def _keys(view: View) -> list[_Key]:
    return [(item, view.group == "unit") for item in (*view.parts, *view.extras)]


def _solids(moulds: MouldSet, item: Placed | Extra, unit: bool) -> Iterator[Surface]:
    """Yield the meshes of a view's content, in place; a layer has one mesh a cell."""
    near = 0.0 if unit else min(cell.y for cell in moulds.plan.layout.cells)
    for shape, colour in shapes(moulds, item, unit):
        solid = realise(shape, moulds.segments)
        if isinstance(item, Placed) and item.half:
            solid = solid.trim_by_plane((0, 1, 0), near + 1 / 512)
        if not solid.is_empty():
            yield Surface(*arrays(solid.translate(item.moved)), colour)


def _laid_out(
    moulds: MouldSet, solids: dict[_Key, list[Surface]]
) -> tuple[dict[_Key, list[Surface]], tuple[Name, ...]]:
    """Lay pieces out side by side in rows, on one plane, and name them; like ones of several cavities together."""
    plan = moulds.plan
    points = [np.concatenate([solid.vertices for solid in each]) for each in solids.values()]
    lows, highs = (np.array([pick(own, axis=0) for own in points]) for pick in (np.min, np.max))
    sizes = [tuple(size) for size in (highs - lows)[:, :2] + _GAP]
    corners = layout(sizes, (1.25 * float(np.sqrt(np.prod(sizes, axis=1).sum())), 0.0))
    laid: dict[_Key, list[Surface]] = {}
    found: dict[str, list[tuple[float, float, float]]] = {}
    for (key, each), own, low, high, (x, y) in zip(solids.items(), points, lows, highs, corners, strict=True):
        by = np.array((x - low[0], -y - high[1], -low[2]))
        laid[key] = [replace(solid, vertices=solid.vertices + by) for solid in each]
        # Its name is near the front edge.
        middle, front = (low[0] + high[0]) / 2, 0.9 * low[1] + 0.1 * high[1]
        off = np.hypot(own[:, 0] - middle, own[:, 1] - front).round(1)
        at = own[np.lexsort((-own[:, 2], off))[0]] + by
        name = getattr(key[0], "name", "")
        tool = next(piece for piece in made_pieces(moulds) if piece.name == name)
        filament = "straight filament" if tool.step else "filament"
        called = {"tongue": "tongue", "filament": filament}.get(tool.kind, plan.called(name))
        found.setdefault(called, []).append((float(at[0]), float(at[1]), float(at[2])))
    names = (Name(f"{len(at)} {name}s" if len(at) > 1 else name, at[0]) for name, at in found.items())
    return laid, tuple(names)
