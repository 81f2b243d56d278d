"""Where the cells of a mould lie and how large its plates are (mm, as assembled, z = 0 at the seat)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from unitcad.errors import Refusal
from unitcad.shape.lettering import HEIGHT, text_width
from unitcad.spec import Dimensions, Spec

PLINTH_DRAFT_DEG = 5.0
CORNER_RADIUS = 2.0
KEY = 5.0
"""Leg of the plinth's cut corner: the cup goes on in one attitude only."""
TEXT_MARGIN = 1.0


@dataclass(frozen=True)
class Cell:
    """One cavity: its centre, and the sides (+1, -1 along x) where its tails leave."""

    x: float
    y: float
    sides: tuple[int, ...]


@dataclass(frozen=True)
class Layout:
    """Cells and half sizes along x and y (mm): `plinth` at z = 0, `cup` and `plate` outside."""

    cells: tuple[Cell, ...]
    pitch: float
    plinth: tuple[float, float]
    plinth_foot: tuple[float, float]
    cup: tuple[float, float]
    plate: tuple[float, float]
    label_height: float


def layout(spec: Spec, dims: Dimensions) -> Layout:
    """The layout of a spec's moulds. Raises Refusal where the plate exceeds the bed or a tail reaches no edge."""
    assert spec.moulds.cavities != "fill"
    columns, rows = spec.moulds.cavities
    limit = {0: None, 1: 2, 2: 1}[len(dims.sides)] if spec.design == "encapsulating" else None
    if limit is not None and columns > limit:
        raise Refusal(
            "moulds.cavities", [columns, rows], f"a tail must reach an edge: {limit} column(s) at most", [limit, rows]
        )
    found = _layout(spec, dims, columns, rows)
    bed = spec.moulds.bed_x_mm or 0.0, spec.moulds.bed_y_mm or 0.0
    over = [2 * size - room for size, room in zip(found.plate, bed, strict=True)]
    if max(over) > 1e-9:
        raise _too_large(spec, found, columns, rows, over)
    return found


def _layout(spec: Spec, dims: Dimensions, columns: int, rows: int) -> Layout:
    moulds = spec.moulds
    land, groove, stroke = moulds.land_mm or 0, moulds.groove_width_mm or 0, moulds.engraving_stroke_mm or 0
    pitch = float(math.ceil(2 * dims.outer_radius + 2 * land + groove - 1e-9))
    reach = dims.outer_radius + land + groove
    half = (columns - 1) / 2 * pitch, (rows - 1) / 2 * pitch
    plinth = half[0] + reach, half[1] + reach
    splay = moulds.plinth_height_mm * math.tan(math.radians(PLINTH_DRAFT_DEG))
    foot = plinth[0] + splay, plinth[1] + splay
    skirt = (moulds.plinth_clearance_mm or 0) + (moulds.skirt_wall_mm or 0)
    label = HEIGHT * stroke
    corner = _corner_for_label(reach + 0.6, text_width("00", stroke), label)
    cup = max(foot[0] + skirt, half[0] + corner), max(foot[1] + skirt, half[1] + corner)
    margin = label + 2 * 0.6
    cells = tuple(
        Cell((i - (columns - 1) / 2) * pitch, (j - (rows - 1) / 2) * pitch, _sides(dims, i, columns))
        for j in range(rows)
        for i in range(columns)
    )
    return Layout(cells, pitch, plinth, foot, cup, (cup[0] + margin, cup[1] + margin), label)


def _sides(dims: Dimensions, column: int, columns: int) -> tuple[int, ...]:
    """Where a cell's tails leave: of two columns with one tail each, the left one's leaves to the left."""
    return (-1,) if dims.sides == (1,) and columns == 2 and column == 0 else dims.sides


def _corner_for_label(radius: float, width: float, height: float) -> float:
    """Least half side of a square about a cell whose corner holds a label outside `radius`."""
    half = radius / math.sqrt(2)
    while math.hypot(max(half - TEXT_MARGIN - width, 0), max(half - TEXT_MARGIN - height, 0)) < radius:
        half += 1 / 64
    return half


def _too_large(spec: Spec, found: Layout, columns: int, rows: int, over: list[float]) -> Refusal:
    """The refusal of a plate larger than the bed: fewer cavities if that helps, else a smaller unit or a larger bed."""
    fits = [
        max(1, count - math.ceil(max(excess, 0) / found.pitch - 1e-9))
        for count, excess in zip((columns, rows), over, strict=True)
    ]
    still = max(
        2 * (size - (count - fit) / 2 * found.pitch) - room
        for size, count, fit, room in zip(
            found.plate, (columns, rows), fits, (spec.moulds.bed_x_mm or 0, spec.moulds.bed_y_mm or 0), strict=True
        )
    )
    size = f"the plate of {2 * found.plate[0]:.1f} x {2 * found.plate[1]:.1f} mm exceeds the bed"
    by = f"by {max(over):.1f} mm"
    if still <= 1e-9:
        return Refusal("moulds.cavities", [columns, rows], f"{size} {by}", fits)
    nearest = math.floor((spec.diameter_mm - still - 1) * 100) / 100
    return Refusal("diameter_mm", spec.diameter_mm, f"{size} {by} with one cavity", max(nearest, 0.01))
