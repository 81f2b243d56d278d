"""Views of single pieces: two that are joined, a tongue that is cut, a resin cup's windows, a circuit in its slot."""

from __future__ import annotations

import math
from collections.abc import Iterator

from unitcad.casting import bench_extras as draw
from unitcad.casting.bench_extras import CLEAR, Extra
from unitcad.casting.bench_view import OVER, UNDER, Placed, View
from unitcad.export.picture_letters import Name
from unitcad.kernels.mesh import bounds
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import Extrude, Shape, cylinder, moved, polygon, turned, union
from unitcad.text import number

BEFORE = 3.0
"""From the cavity's mouth down to what is to go in, mm."""
SHOWN = 0.25
"""Thickness of a circuit in the picture, at least, mm: the drawn one would hardly be seen."""


def joining_views(moulds: MouldSet) -> Iterator[tuple[str, View]]:
    """Yield the view of a piece of a split tool on its way down onto the next one; none where no tool is split."""
    for split in moulds.plan.splits[:1]:
        lying, pushed = split.pieces[:2]
        x0, y0, z0, x1, _, z1 = bounds(moulds.mesh(pushed))
        up = z1 - z0 + max(2 * CLEAR, 0.15 * (x1 - x0))
        left, front, _, right, _, top = bounds(moulds.mesh(lying))
        names = (
            Name("piece 1", ((left + right) / 2, front, top)),
            Name("piece 2", ((x0 + x1) / 2, y0, z1 + up)),
        )
        down = draw.downward((x0 + x1) / 2, y0 - 2.0, z1 + up / 2 - CLEAR, 0.6 * up)
        yield "join", View((Placed(lying.name), Placed(pushed.name, (0.0, 0.0, up))), (down,), names=names)


def resin_views(moulds: MouldSet) -> Iterator[tuple[str, View]]:
    """Yield the views of what resin asks for: tongues that are cut, windows that are cleared."""
    plan, exit = moulds.plan, moulds.dimensions.exit
    cut = [tool for tool in plan.of_kind("tongue") if tool.made == "cut"]
    if not cut or not exit:
        return
    cell = plan.layout.cells[0]
    side, half, radius = cell.sides[0], exit.width / 2, moulds.dimensions.ledge_radius
    end = cell.x + side * (max(plan.layout.cup[0] - abs(c.x) for c in plan.layout.cells) + 6.0)
    names = (
        Name(f"radius {number(radius, 3)} mm", (cell.x - side * radius, cell.y, exit.high)),
        Name(f"{number(exit.width, 3)} mm wide", ((cell.x + end) / 2, cell.y - half, exit.high)),
        Name("tape", (end, cell.y - half, exit.high)),
    )
    yield (
        "cut-tongue",
        View((Placed(cut[0].name),), (draw.punched_hole(moulds), draw.tabs(moulds)[0]), OVER, "cut", names=names),
    )
    step = next((step for step in plan.steps if step.windows), None)
    if step:
        out = side * (plan.layout.cup[0] - abs(cell.x)) * 0.5
        x, high = side * (plan.layout.cup[0] + 8.0), exit.high + 3.0
        arrows = draw.sideways(side, x, cell.y, high, 8.0), draw.sideways(-side, x, cell.y, high + 3.0, 8.0)
        window = Name("window", (side * plan.layout.cup[0], cell.y - half, exit.high))
        parts = Placed(step.cup, half=True), Placed(cut[0].name, (out, 0.0, 0.0))
        yield "clear-windows", View(parts, arrows, names=(window,))


def fed_through(moulds: MouldSet) -> View | None:
    """Return the view of a tail or wires led out through a closed slot, motor and pad before the mouth; else None."""
    dims, exit, spec = moulds.dimensions, moulds.dimensions.exit, moulds.spec
    if not exit or exit.high >= dims.heights[0] or moulds.design.opens != "below":
        return None
    inside = [body for body in moulds.unit if body.made != "cast"]
    led = [body for body in inside if body.kind in ("circuit", "wire")]
    middle = (exit.low + exit.high) / 2
    pad = dims.pad
    away = -(middle + BEFORE)
    if spec.fpcb and pad:
        start, half, long = pad.radius - SHOWN, spec.fpcb.tail_width_mm / 2, spec.fpcb.tail_length_mm
        level, across, thick = (pad.low + pad.high) / 2, (0.0,), max(spec.fpcb.thickness_mm, SHOWN)
    elif spec.wires:
        thick, long = spec.wires.diameter_mm, spec.wires.length_mm
        start, half, level = dims.motor_radius, thick / 2, dims.core_height - thick
        gap = exit.width / (2 * spec.wires.count)
        across = tuple((2 * i + 1 - spec.wires.count) * gap for i in range(spec.wires.count))
    else:
        return None
    mouth = dims.cavity_radius - thick
    slope = math.hypot(mouth - start, middle - level - away)
    end = max(start + dims.outer_radius + long - start - slope, dims.outer_radius + 2.0)
    strips = [
        moved(turned(_bent((start, level + away), (mouth, middle), end, thick, half), "z", 0 if side > 0 else 2), y=y)
        for side in dims.sides
        for y in across
    ]
    if spec.fpcb and pad:
        strips.append(cylinder(pad.radius, level + away - thick / 2, level + away + thick / 2))
    cast = tuple(Placed(body.name, half=True) for body in moulds.unit if body.made == "cast")
    motor = tuple(Placed(body.name, (0.0, 0.0, away)) for body in inside if body not in led)
    side = max(dims.sides)
    pulled = draw.sideways(side, side * (end + 4.0), -half - 1.0, middle + 1.5, 6.0)
    names = (Name("slot", (side * dims.outer_radius, -half, middle)),)
    return View((*cast, *motor), (Extra(union(strips), led[0].colour), pulled), UNDER, "unit", names=names, turned=True)


def _bent(start: tuple[float, float], mouth: tuple[float, float], end: float, thick: float, half: float) -> Shape:
    """Draw a strip along +x, in (x, z): from `start` up to the slot's `mouth`, then level to x = `end`."""
    (x0, z0), (x1, z1), t = start, mouth, thick / 2
    length = math.hypot(x1 - x0, z1 - z0)
    nx, nz = -(z1 - z0) / length * t, (x1 - x0) / length * t
    rising = polygon((x0 - nx, z0 - nz), (x1 - nx, z1 - nz), (x1 + nx, z1 + nz), (x0 + nx, z0 + nz))
    level = polygon((x1 - t, z1 - t), (end, z1 - t), (end, z1 + t), (x1 - t, z1 + t))
    return union(turned(Extrude(profile, -half, half), "x", 1) for profile in (rising, level))
