"""Places of a mould's cells and sizes of its plates (mm, as assembled, z = 0 at the seat)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from unitcad.catalogue import printers
from unitcad.designs import Dimensions
from unitcad.designs.design import Cell, Layout
from unitcad.errors import Refusal
from unitcad.shape.lettering import HEIGHT, text_width
from unitcad.spec import Spec
from unitcad.spec.layers import layers_of

PLINTH_DRAFT_DEG = 5.0
CORNER_RADIUS = 2.0
BLADE_HEIGHT = 12.0
KEY = 5.0
"""Leg of the plinth's cut corner: the cup goes on in one attitude only. Less on a plinth too small for it."""
KEY_SHARE = 2 - math.sqrt(2)
"""The leg over a cell's half side, at most: the cut then stays as far from the bore as the plinth's sides."""
MARK = 3.5
"""Leg of the cut corner outside, above the plinth's: which way round a piece goes is seen before it is tried."""
TEXT_MARGIN, TEXT_GAP = 1.0, 0.3
EPS = 1e-6
_LABEL_GAP = 0.6
MOST_CELLS = 255
"""Cells are numbered by two hexadecimal digits."""


@dataclass(frozen=True)
class Frame:
    """The inputs of every tool's drawing: the spec, the lengths of the silicone as it is poured, and the layout."""

    spec: Spec
    dims: Dimensions
    lay: Layout

    @classmethod
    def of(cls, spec: Spec, dims: Dimensions) -> Frame:
        """Return the frame of a spec with its layout. Raises Refusal as `layout` does."""
        return cls(spec, dims, layout(spec, dims))


def layout(spec: Spec, dims: Dimensions) -> Layout:
    """Return the layout of a spec's moulds; "fill" is as many cavities as the bed takes.

    Raises Refusal if a plate or a piece's height exceeds the bed, or a tail reaches no edge.
    """
    most = most_columns(dims)
    if spec.moulds.cavities == "fill":
        columns, rows = _fill(spec, dims, most, MOST_CELLS)
    else:
        columns, rows = spec.moulds.cavities
    if columns > most or columns * rows > MOST_CELLS:
        limit = f"a tail must reach an edge: {most} column{'s' if most > 1 else ''} at most"
        if columns <= most:
            limit = f"cells are numbered up to {MOST_CELLS}"
        raise Refusal("moulds.cavities", [columns, rows], limit, list(_fill(spec, dims, min(columns, most), rows)))
    lay = _layout(spec, dims, columns, rows)
    over = _excess(spec, lay)
    if max(over) > 1e-9:
        raise _too_large(spec, dims, lay, columns, rows, over)
    tallest = spec.moulds.plinth_height_mm + spec.moulds.plate_mm + dims.heights[-1]
    if tallest > spec.moulds.bed_z_mm + 1e-9:
        raise _too_tall(spec, tallest)
    return lay


def most_columns(dims: Dimensions) -> int:
    """Return the most columns of a gang: a tail, or its tongue, must reach an edge along x."""
    return {0: MOST_CELLS, 1: 2, 2: 1}[len(dims.exits)]


def _fill(spec: Spec, dims: Dimensions, most_columns: int, most_rows: int) -> tuple[int, int]:
    """Return the columns and rows of the most cells that the bed takes and that can be numbered; (1, 1) if none fits.

    Each is tried, since the pitch depends on their number; of two with as many cells, the one with more columns.
    """
    rows = max(1, min(most_rows, math.floor(spec.moulds.bed_y_mm / (2 * dims.outer_radius))))
    best = 1, 1
    for columns in range(1, most_columns + 1):
        # One more column leaves room for no more rows.
        while rows and (columns * rows > MOST_CELLS or max(_excess(spec, _layout(spec, dims, columns, rows))) > 1e-9):
            rows -= 1
        if not rows:
            break
        best = max(best, (columns, rows), key=lambda split: (math.prod(split), split))
    return best


def _excess(spec: Spec, lay: Layout) -> list[float]:
    """Return by how much the plate exceeds the bed along x and y (mm)."""
    bed = spec.moulds.bed_x_mm, spec.moulds.bed_y_mm
    return [2 * size - room for size, room in zip(lay.plate, bed, strict=True)]


def _layout(spec: Spec, dims: Dimensions, columns: int, rows: int) -> Layout:
    moulds = spec.moulds
    land, groove, stroke = moulds.land_mm, moulds.groove_width_mm, moulds.engraving_stroke_mm
    reach = dims.outer_radius + land + groove
    count, label = columns * rows, HEIGHT * stroke
    digits = 0 if count == 1 else 1 if count < 16 else 2
    pitch = float(math.ceil(2 * dims.outer_radius + 2 * land + groove - 1e-9))
    number = text_width("0" * digits, stroke) / 2 if digits else 0.0, label / 2
    while digits and math.hypot(max(pitch / 2 - number[0], 0), max(pitch / 2 - number[1], 0)) < reach + TEXT_GAP:
        pitch += 1.0
    half = (columns - 1) / 2 * pitch, (rows - 1) / 2 * pitch
    plinth = half[0] + reach, half[1] + reach
    splay = moulds.plinth_height_mm * math.tan(math.radians(PLINTH_DRAFT_DEG))
    foot = plinth[0] + splay, plinth[1] + splay
    skirt = moulds.plinth_clearance_mm + moulds.skirt_wall_mm
    # Letters as deep as a low rim's groove leave a wall between the two.
    deep = any(groove_depth_of(spec, rim) <= moulds.engraving_depth_mm + EPS for rim in dims.heights)
    clear = reach + (max(_LABEL_GAP, moulds.least_wall_mm) if deep else _LABEL_GAP)
    # The least half side of a square about a cell whose corner has room for a label outside that radius.
    corner, text = clear / math.sqrt(2), (text_width("00", stroke) + TEXT_MARGIN, label + TEXT_MARGIN)
    while math.hypot(max(corner - text[0], 0), max(corner - text[1], 0)) < clear:
        corner += 1 / 64
    # The numbers of the last column and row are outside its bores too, and behind the cut corner.
    beside = [pitch / 2 + size + MARK / 2 + 0.1 if digits else 0.0 for size in number]
    cup = max(foot[0] + skirt, half[0] + max(corner, beside[0])), max(foot[1] + skirt, half[1] + max(corner, beside[1]))
    margin = label + 2 * _LABEL_GAP
    cells = tuple(
        Cell(
            (i - (columns - 1) / 2) * pitch,
            (j - (rows - 1) / 2) * pitch,
            # In two columns with one tail each, the left one's leaves to the left.
            (-1,) if dims.sides == (1,) and columns == 2 and i == 0 else dims.sides,
            f"{j * columns + i + 1:0{digits}X}" if digits else "",
        )
        for j in range(rows)
        for i in range(columns)
    )
    key = min(KEY, KEY_SHARE * reach)
    return Layout(cells, key, pitch, plinth, cup, (cup[0] + margin, cup[1] + margin), label)


def groove_depth_of(spec: Spec, rim: float) -> float:
    """Return the depth of an overflow groove: the printer's, or half a low rim's height, down to a whole layer."""
    depth = min(spec.moulds.groove_depth_mm, rim / 2)
    return layers_of(spec).down(depth) or depth


def _too_tall(spec: Spec, tallest: float) -> Refusal:
    """Refuse a piece higher than the printer prints: its largest length, or a lowered bed_z_mm."""
    lengths = {"motor.thickness_mm": spec.motor.thickness_mm, "moulds.plate_mm": spec.moulds.plate_mm}
    lengths |= {f"layers.{i}.cap_mm": layer.cap_mm for i, layer in enumerate(spec.layers)}
    lengths["moulds.plinth_height_mm"] = spec.moulds.plinth_height_mm
    bed = spec.moulds.bed_z_mm
    if bed < float(printers(spec.printers)[spec.moulds.printer].bed_z_mm):
        nearest = math.ceil(tallest * 100) / 100
        return Refusal("moulds.bed_z_mm", bed, f"the tallest piece has {tallest:.4g} mm", nearest)
    field = max(lengths, key=lambda name: lengths[name])
    nearest = math.floor((lengths[field] - (tallest - bed)) * 100 + 1e-6) / 100
    limit = f"the tallest piece has {tallest:.4g} mm, and the printer's height (moulds.bed_z_mm) is {bed:g} mm"
    return Refusal(field, lengths[field], limit, nearest if nearest > 0 else None)


def _too_large(spec: Spec, dims: Dimensions, lay: Layout, columns: int, rows: int, over: list[float]) -> Refusal:
    """Refuse a plate larger than the bed; name fewer cavities if that helps, else a smaller unit or a larger bed."""
    size = f"the plate of {2 * lay.plate[0]:.1f} x {2 * lay.plate[1]:.1f} mm exceeds the bed"
    by = f"by {max(over):.1f} mm"
    moulds, (x, y) = spec.moulds, lay.plate
    if 2 * x <= moulds.bed_y_mm and 2 * y <= moulds.bed_x_mm:
        by += f"; turned by a quarter it fits: moulds.bed_x_mm = {moulds.bed_y_mm:g}, bed_y_mm = {moulds.bed_x_mm:g}"
    fits = _fill(spec, dims, columns, rows)
    alone = _layout(spec, dims, *fits)
    still = max(_excess(spec, alone))
    if still <= 1e-9:
        return Refusal("moulds.cavities", [columns, rows], f"{size} {by}", list(fits))
    nearest = math.floor((spec.diameter_mm - still - 1) * 100) / 100
    if nearest < spec.diameter_mm - 2 * dims.air_ring:
        axis = over.index(max(over))
        field, bed = [("bed_x_mm", spec.moulds.bed_x_mm), ("bed_y_mm", spec.moulds.bed_y_mm)][axis]
        needed = math.ceil(20 * alone.plate[axis]) / 10
        return Refusal(f"moulds.{field}", bed, f"{size} {by} with one cavity", needed)
    return Refusal("diameter_mm", spec.diameter_mm, f"{size} {by} with one cavity", nearest)
