"""Views of casts that are taken out of flat tools and laid in on a base of their own, under a lid, round a limb."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

from unitcad.casting import bench_extras as draw
from unitcad.casting.bench_extras import CLEAR, Extra
from unitcad.casting.bench_view import OVER, UNDER, Offset, Placed, View
from unitcad.casting.mouths import sprue_and_vent
from unitcad.designs import layer_colour
from unitcad.export.picture_letters import Name
from unitcad.kernels.mesh import bounds
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.removal import CAST, Removal, Way
from unitcad.shape import Common, Shape, box, cut, moved, union


def laid_in_views(moulds: MouldSet, cast_flat: MouldSet, flat: Mapping[str, View]) -> Iterator[tuple[str, View]]:
    """Yield the views of a set whose last pour stands on a base of its own.

    `cast_flat`: the set of the flat tools, `flat`: its views.
    """
    plan = moulds.plan
    yield "pieces", View(tuple(Placed(piece.name) for piece in plan.pieces), eye=OVER, group="pieces")
    for name, view in flat.items():
        if name in ("filament-out", "peel"):
            yield f"flat-{name}", view
        elif view.group in ("moulds", "under", "cut"):
            yield name, view
    for name, view in _last_pour(moulds):
        yield f"pour{plan.steps[-1].index}-{name}", view
    yield from _out(moulds)
    bodies = {body.name: body for body in (*cast_flat.unit, *cast_flat.laid_later)}
    for name in ("motor-in", "motor-home"):
        # What lies flat here has the names of what is cast round the limb: it is drawn as its shapes.
        parts = [(bodies[part.name], part.moved) for part in flat[name].parts]
        shapes = (Extra(moved(body.shape, *by), body.colour) for body, by in parts)
        yield name, replace(flat[name], parts=(), extras=(*shapes, *flat[name].extras))


def _last_pour(moulds: MouldSet) -> Iterator[tuple[str, View]]:
    """Yield the views from the empty curved base to the cured sheet without its lid."""
    plan, step = moulds.plan, moulds.plan.steps[-1]
    (base,), (lid,) = plan.standing(step, "base"), plan.standing(step, "lid")
    x0, y0, bottom, x1, y1, high = bounds(moulds.mesh(base))
    seat = step.pins.seat if step.pins else bottom
    standing = (Placed(base.name), *(Placed(stub.name) for stub in plan.standing(step, "stub")))
    yield "filament", _filaments(moulds, (Placed(base.name),), (), up=True)

    names = Name("level", (0.0, -4.0, step.top + 2)), Name("paper", (x0 - 4, y0, bottom))
    level = draw.spirit_level(x1, step.top, (x1, y1), bottom)
    yield "level", View((*standing, Placed(lid.name)), level, group="curved", names=names)

    up, ways = 2 * CLEAR, _ways(moulds)
    raised = [
        Extra(moved(shape, *_times(way, up)), layer_colour(pour))
        for pour, shapes in enumerate(_pours(moulds))
        for shape, way in zip(shapes, ways, strict=True)
    ]
    tops = [_middle(moulds, extra.shape) for extra in raised[-len(ways) :]]
    places = tuple(Name(cell.name, at) for cell, at in zip(plan.layout.cells, tops, strict=True))
    # The nearest row has its arrows; the others would hide what is behind them.
    front = min(y for _, y, _ in tops)
    arrows = tuple(
        draw.along(_times(way, -1.0), x, y - moulds.dimensions.outer_radius - 1.0, z - up / 2, 0.7 * up)
        for way, (x, y, z) in zip(ways, tops, strict=True)
        if y <= front + 1.0
    )
    yield "laid-in", View(standing, (*raised, *arrows), group="curved", names=places)

    casts = [Extra(union(shapes), layer_colour(pour)) for pour, shapes in enumerate(_pours(moulds))]
    lift = high - seat + CLEAR
    off = Placed(lid.name, (0.0, 0.0, lift))
    edges = [box(x0, x1, *ys, seat, step.top) for ys in ((y0 + 0.5, y0 + 1.5), (y1 - 1.5, y1 - 0.5))]
    line = Common((union(step.seals), union((*edges, box(x0, x1, y0, y1, seat + 0.4, seat + 0.9)))))
    pressed = draw.downward(0.0, y0 - 4.0, (high + lift + seat) / 2, 0.6 * lift)
    jelly = Name("grease", (0.0, y0 + 1.0, high))
    view = View((*standing, off), (*casts, Extra(line, draw.GREASE), pressed), group="curved", names=(jelly,))
    yield "lid-on", view

    closed, held = (*standing, Placed(lid.name)), draw.bands(x1, y1, bottom, step.top)
    band = Name("rubber band", (x1 - 2.0, 0.0, step.top + 1))
    yield "lid-held", View(closed, (*casts, *held), group="curved", names=(band,))
    poured, filled = Placed(step.name), Extra(union(step.channels), layer_colour(step.index - 1))
    sprue, vent = sprue_and_vent(moulds, step)
    full = *casts, *held, filled
    names = Name("sprue", sprue), Name("vent", vent, ring=True)
    yield (
        "inject",
        View((*closed, poured), full, group="curved", syringe_on=step.channels[0], names=names),
    )
    yield (
        "filled",
        View((*closed, poured), full, group="curved", names=(Name("touch here", vent, ring=True),)),
    )
    levers = draw.screwdrivers(x1, x1, seat, seat)
    lever = Name("screwdriver", (x1 + 8.0, 0.0, seat))
    yield "lid-off", View((*standing, poured, off), (*casts, *levers), group="curved", names=(lever,))


def _out(moulds: MouldSet) -> Iterator[tuple[str, View]]:
    """Yield the views of the filaments pulled, and of the silicone drawn off, each part in its own direction."""
    plan, step = moulds.plan, moulds.plan.steps[-1]
    base = Placed(plan.base_of(step))
    casts = [Extra(union(shapes), layer_colour(pour)) for pour, shapes in enumerate(_pours(moulds))]
    yield "filament-out", _filaments(moulds, (base, Placed(step.name)), casts, up=False)
    up, ways = step.rim + 2 * CLEAR, _ways(moulds)
    whole = [(union(shapes), layer_colour(pour)) for pour, shapes in enumerate((*_pours(moulds), step.layer))]
    parts = [
        Extra(moved(part, *_times(way, up)), colour) for shape, colour in whole for part, way in _parts(moulds, shape)
    ]
    tops = [_middle(moulds, shape) for shape in step.earlier[-len(ways) :]]
    arrows = [
        draw.along(way, *_plus(at, _times(way, up + 2 * CLEAR)), 1.5 * CLEAR)
        for way, at in zip(ways, tops, strict=True)
    ]
    yield "peel", View((base,), (*parts, *arrows), group="curved")


def _filaments(moulds: MouldSet, there: Sequence[Placed], casts: Sequence[Extra], *, up: bool) -> View:
    """Return the base from below, its filaments halfway out along their cores, on their way up or down."""
    plan = moulds.plan
    _, _, bottom, _, _, high = bounds(moulds.mesh(plan.tool(plan.base_of(plan.steps[-1]))))
    out = 0.8 * (high - bottom)
    stubs, arrows = [], []
    for stub in plan.standing(plan.steps[-1], "stub"):
        way = stub.removal or (0.0, 0.0, -1.0)
        stubs.append(Placed(stub.name, _times(way, out)))
        x, y, z = _plus(_middle(moulds, stub.shape), _times(way, 1.2 * out))
        arrows.append(draw.along(_times(way, -1.0 if up else 1.0), x, y - 4.0, z, 7.0))
    return View((*there, *stubs), (*casts, *arrows), UNDER, "curved")


def _pours(moulds: MouldSet) -> list[tuple[Shape, ...]]:
    """Return what is laid in, pour by pour, in the order of the cells."""
    step, count = moulds.plan.steps[-1], len(moulds.plan.layout.cells)
    return [step.earlier[i : i + count] for i in range(0, len(step.earlier), count)]


def _ways(moulds: MouldSet) -> list[Way]:
    """Return the direction in which the unit of each cell is drawn off."""
    by_part = {removal.part: removal.direction for removal in _drawn_off(moulds)}
    return [by_part[f"at {cell.name}"] for cell in moulds.plan.layout.cells]


def _drawn_off(moulds: MouldSet) -> list[Removal]:
    return [removal for removal in moulds.plan.steps[-1].removals if removal.piece == CAST]


def _parts(moulds: MouldSet, shape: Shape) -> Iterator[tuple[Shape, Way]]:
    """Yield the parts of the silicone that leave in one direction each, and that direction."""
    spaces: dict[Way, list[Shape]] = {}
    *others, last = _drawn_off(moulds)
    for removal in others:
        if removal.within and removal.direction != last.direction:
            spaces.setdefault(removal.direction, []).append(removal.within)
    for way, within in spaces.items():
        yield Common((shape, union(within))), way
    yield cut(shape, [space for within in spaces.values() for space in within]), last.direction


def _middle(moulds: MouldSet, shape: Shape) -> Offset:
    """Return the middle of a shape's box."""
    x0, y0, z0, x1, y1, z1 = bounds(moulds.mesh_of(shape))
    return (x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2


def _plus(at: Offset, further: Offset) -> Offset:
    return at[0] + further[0], at[1] + further[1], at[2] + further[2]


def _times(way: Way, length: float) -> Offset:
    x, y, z = way
    return x * length, y * length, z * length
