"""Views of the way out of the mould, and of what goes in afterwards: filament, base, cast, motor and circuit."""

from __future__ import annotations

from collections.abc import Iterator

from unitcad.casting import bench_extras as draw
from unitcad.casting.bench_extras import CLEAR
from unitcad.casting.bench_view import LOW, UNDER, Placed, View
from unitcad.casting.piece_views import fed_through
from unitcad.export.picture_letters import Name
from unitcad.kernels.mesh import bounds
from unitcad.moulds.mould_set import MouldSet


def way_out(moulds: MouldSet) -> Iterator[tuple[str, View]]:
    """Yield the views from the last cured layer to the cast in the hand."""
    plan, bottom = moulds.plan, moulds.plate[0]
    base, stubs = ([Placed(tool.name) for tool in plan.of_kind(kind)] for kind in ("base", "stub"))
    last = plan.steps[-1]
    cast = [*(step.name for step in plan.steps), *(body.name for body in last.inserts)]
    stays = last.cup if all(removal.piece != last.cup for removal in last.removals) else ""
    cured = (*base, *map(Placed, cast), *((Placed(stays),) if stays else ()))
    if stubs:
        arrows = [draw.downward(cell.x + 4.0, cell.y - 4.0, bottom - 2.0, 7.0) for cell in plan.layout.cells]
        away = tuple(Placed(stub.name, (0.0, 0.0, 1.2 * (bottom - moulds.dimensions.core_height))) for stub in stubs)
        yield "filament-out", View((*cured, *away), tuple(arrows), UNDER, "under")
    up = last.rim + CLEAR
    raised = tuple(Placed(name, (0.0, 0.0, up)) for name in cast)
    x, y = plan.layout.cup
    if stays:
        down = moulds.dimensions.core_height + max(last.rim, 2 * CLEAR)
        parts = [piece for tool in plan.of_kind("base") for piece in plan.pieces_of(tool.name)]
        below = tuple(Placed(part.name, (0.0, 0.0, -down)) for part in parts)
        boxes = [bounds(moulds.mesh(piece)) for piece in parts if plan.splits]
        front = min((box[1] for box in boxes), default=0.0)
        # Every piece of a split base is pulled at.
        between = sorted((box[0] + box[3]) / 2 for box in boxes if box[1] == front)[1:-1]
        at = (x + 5.0, *between, -x - 5.0)
        pulled = tuple(draw.downward(each, -y, moulds.plate[1] - down / 2, down * 0.6) for each in at)
        levered = Name("base", (0.0, -plan.layout.plate[1], moulds.plate[1] - down))
        held = Name("cup stays on", (0.0, -y, last.rim / 2))
        yield "base-off", View((*below, *map(Placed, cast), Placed(stays)), pulled, names=(levered, held))
        pushed = tuple(draw.upward(side * 0.6 * x, -y - 3.0, 0.0, 2 * up) for side in (1, -1))
        yield "push-out", View((Placed(stays), *raised), pushed)
        return
    yield "peel", View((*base, *raised), (draw.upward(0.0, -y, up / 2, up * 0.8),))


def motor_views(moulds: MouldSet) -> Iterator[tuple[str, View]]:
    """Yield the views of motor and circuit going in: a unit that opens to the skin lies on its back."""
    inside = [body for body in (*moulds.unit, *moulds.laid_later) if body.made != "cast"]
    if not inside or moulds.design.laid_in:
        return
    below, patch = moulds.design.opens == "below", bool(moulds.laid_later)
    high = moulds.dimensions.heights[-1]
    away = (-1.0 if below else 1.0) * (high + CLEAR)
    cast = tuple(Placed(body.name, half=not patch) for body in moulds.unit if body.made == "cast")
    laid = tuple(Placed(body.name, (0.0, 0.0, away)) for body in inside)
    x = y = 0.0
    z = high / 2
    if patch:
        # Round a limb a motor stands off the height that it has flat.
        boxes = (bounds(moulds.mesh(body)) for body in inside if body.kind == "motor")
        middles = [((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2) for x0, y0, z0, x1, y1, z1 in boxes]
        x, y, z = min(middles, key=lambda at: (at[1], at[0]))
    arrow = draw.upward if below else draw.downward
    shown = arrow(x - moulds.dimensions.outer_radius * 0.8, y - 2.0, z + away / 2, 5.0)
    eye = UNDER if below else LOW
    fed = fed_through(moulds)
    yield "motor-in", fed or View((*cast, *laid), (shown,), eye, "unit", turned=below)
    home = (*cast, *(Placed(body.name) for body in inside))
    yield "motor-home", View(home, eye=eye, group="unit", turned=below)
