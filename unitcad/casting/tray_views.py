"""Views of a tray: a mould without cups, poured, struck off and peeled off as it stands on the bench."""

from __future__ import annotations

from collections.abc import Iterator

from unitcad.casting import bench_extras as draw
from unitcad.casting.bench_extras import CLEAR, Extra
from unitcad.casting.bench_view import OVER, Placed, View
from unitcad.casting.cast_colour import cast_colour
from unitcad.casting.piece_views import joining_views
from unitcad.export.picture_letters import Name
from unitcad.kernels.mesh import bounds
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import cylinder, moved


def tray_views(moulds: MouldSet) -> Iterator[tuple[str, View]]:
    """Yield the views of a tray's one pour, in the order of its steps."""
    plan, (x, y) = moulds.plan, moulds.plan.layout.plate
    (step,) = plan.steps
    tray = tuple(Placed(tool.name) for tool in plan.of_kind("base"))
    filled = (*tray, Placed(step.name))
    yield "pieces", View(tuple(Placed(piece.name) for piece in plan.pieces), eye=OVER, group="pieces")
    yield from joining_views(moulds)
    names = Name("level", (0.0, -4.0, step.rim + 2)), Name("paper", (-x - 4, -y, moulds.plate[0]))
    yield "level", View(tray, draw.level_on_rim(moulds, step.rim), names=names)
    x0, y0, _, _, y1, _ = bounds(moulds.meshes(step.layer)[0])
    thread = moved(cylinder(0.6, step.rim - 1.0, step.rim + 14.0), x0 + 3.0, (y0 + y1) / 2)
    yield "pour", View(filled, (Extra(thread, cast_colour(moulds, 1)),))
    back = -0.55 * x
    blades = tuple(Placed(tool.name, (back, 0.0, 0.0)) for tool in plan.of_kind("blade"))
    yield "strike", View((*filled, *blades), (draw.sideways(1, -0.2 * x, 0.0, step.rim + 9.0, x),))
    out = moulds.spec.moulds.land_mm + moulds.spec.moulds.groove_width_mm / 2
    touched = Name("touch here", ((x0 + 2 * x) / 3, y0 - out, step.rim - moulds.spec.moulds.groove_depth_mm))
    yield "filled", View(filled, names=(touched,))
    up = step.rim + 2 * CLEAR
    yield "peel", View((*tray, Placed(step.name, (0.0, 0.0, up))), (draw.upward(0.0, -y, up / 2, up * 0.8),))
    if moulds.pushed_in:
        yield "units-in", _units_in(moulds)


def _units_in(moulds: MouldSet) -> View:
    """Return the sheet, its back up, and the units under their pockets, each named by its place."""
    high = {body.name.partition("-")[0]: bounds(moulds.mesh(body)) for body in moulds.pushed_in if body.made == "cast"}
    down = max(top for *_, top in high.values()) + CLEAR
    units = tuple(Placed(body.name, (0.0, 0.0, -down)) for body in moulds.pushed_in)
    rim = moulds.plan.steps[-1].rim
    names = [Name(name, ((x0 + x1) / 2, (y0 + y1) / 2, rim), on=True) for name, (x0, y0, _, x1, y1, _) in high.items()]
    arrows = [
        draw.upward((x0 + x1) / 2, y0 - 2.0, -down / 2, 0.6 * down) for x0, y0, _, x1, _, _ in list(high.values())[-1:]
    ]
    return View((*(Placed(body.name) for body in moulds.unit), *units), tuple(arrows), OVER, "unit", names=tuple(names))
