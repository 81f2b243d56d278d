"""A section drawing in SVG: bodies cut by a plane of constant y, coloured, named, with dimensions in mm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from manifold3d import CrossSection

from unitcad.designs import Dimensions
from unitcad.export.chart import coord
from unitcad.export.printing import colour_hex
from unitcad.kernels.mesh import realise
from unitcad.shape.profile import GRID_PER_MM
from unitcad.shape.tree import Body
from unitcad.text import xml_attribute, xml_text

Side = Literal["below", "left", "right"]
Point = tuple[float, float]
TEXT_PX = 12.0
CHARACTER_PX = 0.62 * TEXT_PX
"""The room for a character: no common sans-serif is wider on average."""
ARROW_PX = 7.0
HAIR_MM = 1 / 3000
"""The cut is this far off its plane, and so in no plane of the length grid: a face in the plane itself, shared by two
bodies, could be drawn for both or for neither."""
TAIL_MM = 2.5
WIDTH_PX = 520.0
ROW_PX, COLUMN_PX = 26.0, 54.0
LABEL_GAP_PX, EDGE_PX = 14.0, 6.0
"""Between two labels of a row; between a label and the page's edge."""
_UPRIGHT = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 0.0]])
"""Turns (x, y, z) to (x, z, -y): the plane of the section becomes the one that manifold3d slices in."""
_STYLE = (
    f"text{{font:{coord(TEXT_PX)}px Helvetica,Arial,sans-serif;fill:#111}}"
    "path{stroke:#111;stroke-width:.8;stroke-linejoin:round}"
    ".dimension{stroke:#111;stroke-width:.7}.extension{stroke:#777;stroke-width:.5}.arrow{fill:#111}"
    ".leader{stroke:#333;stroke-width:.6}.dot{fill:#111}.axis{stroke:#555;stroke-width:.6;stroke-dasharray:12 3 2 3}"
    ".skin{stroke:#b04a3a;stroke-width:1.4}"
)


@dataclass(frozen=True)
class Region:
    """The section of one body: closed loops in (x, z), mm, holes among them by the even-odd rule."""

    name: str
    colour: tuple[float, float, float]
    loops: tuple[tuple[Point, ...], ...]


@dataclass(frozen=True)
class Measure:
    """A dimension: `start` to `end` along x (drawn below) or z (drawn left or right), in a `row` counted outwards.

    `reach`: start of its extension lines, in the other coordinate. All in mm.
    """

    text: str
    start: float
    end: float
    side: Side
    row: int
    reach: float


@dataclass(frozen=True)
class Note:
    """A label with a leader to a point (x, z) in mm."""

    text: str
    at: Point


def loops_of(flat: CrossSection) -> tuple[tuple[Point, ...], ...]:
    """Return the outlines of a flat area, mm: counter-clockwise, holes clockwise."""
    return tuple(tuple((float(x), float(y)) for x, y in loop) for loop in flat.to_polygons())


def cut(
    bodies: Sequence[Body], segments: int, y: float = 0.0, reach: float = math.inf, swell: float | None = None
) -> list[Region]:
    """Return the sections of `bodies` by the plane at `y` (mm), up to |x| = `reach`, without bodies that it misses.

    `swell` as in `unitcad.kernels.mesh.realise`.
    """
    window = CrossSection.square((2 * reach, 2e4), True) if math.isfinite(reach) else None
    regions = []
    for body in bodies:
        flat: CrossSection = realise(body.shape, segments, swell).transform(_UPRIGHT).slice(HAIR_MM - y)
        if window is not None:
            flat = flat ^ window
        if loops := loops_of(flat):
            regions.append(Region(body.name, body.colour, loops))
    return regions


def section(
    regions: Sequence[Region],
    measures: Sequence[Measure] = (),
    notes: Sequence[Note] = (),
    title: str = "",
    ground: str = "skin",
    px_per_mm: float = 0.0,
    named: bool = True,
    level: float = 0.0,
    both_ends: bool = False,
) -> str:
    """Draw `regions`, every one with its name if `named`, and the measures.

    `ground`: the name of the line at z = `level` (mm), "" for none; `both_ends`: at either end of it. `px_per_mm`: 0
    for a fixed width. The same arguments give the same text.
    """
    labels = [*notes]
    if named:
        labels += names(regions)
    page = _Page(regions, measures, labels, px_per_mm)
    marks = [page.region(region) for region in regions]
    marks += page.frame(ground, level, both_ends)
    for side in ("below", "left", "right"):
        marks += page.measures([m for m in measures if m.side == side])
    marks += page.labels(labels) if labels else []
    if title:
        marks.append(_text(title, (page.width / 2, TEXT_PX)))
    width, height = coord(page.width), coord(page.height)
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" role="img" width="{width}" height="{height}" '
        f'viewBox="0 0 {width} {height}"><title>{xml_text(title or "section")}</title><style>{_STYLE}</style>'
        f'<rect width="{width}" height="{height}" fill="#fff"/>'
    )
    return "\n".join([head, *marks, "</svg>", ""])


def names(regions: Sequence[Region]) -> list[Note]:
    """Return the regions' names, each at a point well inside."""
    anchors = _anchors(regions, [text_width(region.name) for region in regions])
    return [Note(region.name, at) for region, at in zip(regions, anchors, strict=True)]


def unit_section(
    bodies: Sequence[Body],
    dims: Dimensions,
    segments: int,
    concentric: bool = True,
    px_per_mm: float = 0.0,
) -> str:
    """Draw the unit cut along its tail, in the plane y = 0: main dimensions, layers and air named.

    `concentric` as in `unit_view`; `px_per_mm` as in `section`.
    """
    regions, measures, notes = unit_view(bodies, dims, segments, concentric)
    ground = "" if concentric and dims.skin else "skin"
    return section(regions, measures, notes, ground=ground, px_per_mm=px_per_mm)


def unit_view(
    bodies: Sequence[Body], dims: Dimensions, segments: int, concentric: bool = True, tail: float = TAIL_MM
) -> tuple[list[Region], list[Measure], list[Note]]:
    """Return the unit's section in the plane y = 0, its main dimensions, and the name of the air in it.

    `concentric`: the layers are drawn to `dims`. Others get only the dimensions that are measured on their sections.
    `tail`: how far beyond the silicone a tail is drawn, mm.
    """
    if not concentric:
        measures = _measure(bodies, dims, segments)
        reach = max(
            (abs(x) for m in measures if m.side == "below" for x in (m.start, m.end)), default=dims.outer_radius
        )
        return cut(bodies, segments, reach=reach + tail), measures, []
    regions = cut(bodies, segments, reach=dims.outer_radius + tail)
    notes = []
    if dims.air_ring > 0:
        low = dims.core_outline[-2][1]
        at = (dims.motor_radius + dims.cavity_radius) / 2, low + (dims.motor_height - low) / 3
        notes.append(Note("air", at))
    return regions, _unit_measures(dims), notes


def _measure(bodies: Sequence[Body], dims: Dimensions, segments: int) -> list[Measure]:
    """Return width and height of the cast layers together, and the motor's diameter if the plane contains its axis."""
    names = {body.name for body in bodies if body.made == "cast"}
    # A polygon's corners on the circle: a round body is then as wide as it is drawn.
    regions = cut(bodies, segments, swell=1.0)
    cast = [point for region in regions if region.name in names for loop in region.loops for point in loop]
    if not cast:
        return []
    (left, low), (right, high) = np.min(cast, axis=0).tolist(), np.max(cast, axis=0).tolist()
    measures = [
        Measure(_mm(right - left), left, right, "below", 1, low),
        Measure(_mm(high - low), low, high, "left", 0, left),
    ]
    for region in regions:
        across = [x for loop in region.loops for x, _ in loop]
        if region.name == "motor" and abs(max(across) - min(across) - 2 * dims.motor_radius) < 2 / GRID_PER_MM:
            text = f"Ø{_mm(2 * dims.motor_radius)}"
            measures.append(Measure(text, min(across), max(across), "below", 0, low))
    return measures


def _unit_measures(dims: Dimensions) -> list[Measure]:
    inner, walls = [dims.cavity_radius, *dims.radii[:-1]], []
    for low, high in zip(inner, dims.radii, strict=True):
        walls.append(Measure(_mm(high - low), -high, -low, "below", 0, 0))
    if dims.air_ring > 0:
        walls.append(Measure(_mm(dims.air_ring), -dims.cavity_radius, -dims.motor_radius, "below", 0, 0))
    measures = [
        *walls,
        Measure(f"Ø{_mm(2 * dims.motor_radius)}", -dims.motor_radius, dims.motor_radius, "below", 0, 0),
        Measure(f"mouth Ø{_mm(2 * dims.mouth_radius)}", -dims.mouth_radius, dims.mouth_radius, "below", 1, 0)
        if dims.mouth_radius
        else Measure(f"R{_mm(dims.cavity_radius)}", 0, dims.cavity_radius, "below", 1, 0),
        Measure(f"Ø{_mm(2 * dims.outer_radius)}", -dims.outer_radius, dims.outer_radius, "below", 2, 0),
    ]
    levels = sorted({-dims.skin, 0.0, dims.motor_height, dims.core_height, *dims.heights})
    reach = -dims.outer_radius
    inside = [level for level in levels if level != dims.motor_height or level == dims.core_height]
    for low, high in pairwise(inside):
        measures.append(Measure(_mm(high - low), low, high, "left", 0, reach))
    if len(inside) > 2:
        measures.append(Measure(_mm(levels[-1] - levels[0]), levels[0], levels[-1], "left", 1, reach))
    if dims.exit:
        low, high = dims.exit.low, dims.exit.high
        measures.append(
            Measure(f"slot {_mm(high - low)} × {_mm(dims.exit.width)}", low, high, "right", 0, dims.outer_radius)
        )
    return [measure for measure in measures if measure.end > measure.start]


class _Page:
    """The sheet: from mm in the plane to px, and the drawing round the regions."""

    def __init__(
        self, regions: Sequence[Region], measures: Sequence[Measure], notes: Sequence[Note], px_per_mm: float
    ) -> None:
        points = np.array([p for region in regions for loop in region.loops for p in loop])
        self.low, self.high = points.min(axis=0), points.max(axis=0)
        wide = max(self.high[0] - self.low[0], 1e-9)
        self.scale = px_per_mm or WIDTH_PX / wide
        self.across = self.scale * wide
        rows = {s: 1 + max((m.row for m in measures if m.side == s), default=-1) for s in ("below", "left", "right")}
        right = max((text_width(m.text) for m in measures if m.side == "right"), default=0.0)
        self.left = 24 + COLUMN_PX * rows["left"]
        self.top = 84.0 if notes else 30.0
        row = sum(text_width(note.text) + LABEL_GAP_PX for note in notes) - LABEL_GAP_PX + 2 * EDGE_PX
        self.width = max(self.left + self.across + 24 + (ROW_PX + right if rows["right"] else 0.0), row)
        self.height = self.top + (self.high[1] - self.low[1]) * self.scale + 30 + ROW_PX * rows["below"]

    def at(self, point: Point) -> Point:
        """Return px of (x, z) in mm."""
        x, z = point
        return self.left + (x - self.low[0]) * self.scale, self.top + (self.high[1] - z) * self.scale

    def region(self, region: Region) -> str:
        """Draw a filled region with holes, titled."""
        loops = [[self.at(point) for point in loop] for loop in region.loops]
        path = "".join("M" + "L".join(f"{coord(x)} {coord(y)}" for x, y in loop) + "Z" for loop in loops)
        fill = xml_attribute(colour_hex(region.colour))
        return f'<path d="{path}" fill={fill} fill-rule="evenodd"><title>{xml_text(region.name)}</title></path>'

    def frame(self, ground: str, level: float, both_ends: bool) -> list[str]:
        """Draw the line z = `level` and the axis, if they pass through the drawing."""
        skin = self.at((self.low[0], level)), self.at((self.high[0], level))
        top, bottom = self.at((0.0, self.high[1])), self.at((0.0, self.low[1]))
        marks = []
        if self.low[1] <= level <= self.high[1]:
            marks.append(_line(*skin, "skin"))
            ends = (("start", skin[0]), ("end", skin[1]))[not both_ends :] if ground else ()
            marks += [_text(ground, (x, y + TEXT_PX * 0.8), anchor) for anchor, (x, y) in ends]
        if self.low[0] <= 0 <= self.high[0]:
            marks.append(_line((top[0], top[1] - 12), (bottom[0], bottom[1] + 12), "axis"))
        return marks

    def measures(self, measures: Sequence[Measure]) -> list[str]:
        """Draw the dimension lines of one side, their extension lines and their texts."""
        marks = []
        for row in sorted({measure.row for measure in measures}):
            in_row = [measure for measure in measures if measure.row == row]
            middles = []
            for measure in in_row:
                ends = measure.start, measure.end
                if measure.side == "below":
                    y = self.at((0.0, self.low[1]))[1] + ROW_PX * (row + 1)
                    feet = [self.at((end, measure.reach)) for end in ends]
                    tips = [(x, y) for x, _ in feet]
                else:
                    x = self.left + (
                        -14 - COLUMN_PX * row if measure.side == "left" else self.across + 14 + ROW_PX * row
                    )
                    feet = [self.at((measure.reach, end)) for end in ends]
                    tips = [(x, y) for _, y in feet]
                marks += [_line(foot, tip, "extension") for foot, tip in zip(feet, tips, strict=True)]
                marks += _dimension(*tips)
                middles.append(((tips[0][0] + tips[1][0]) / 2, (tips[0][1] + tips[1][1]) / 2))
            # Texts are under a horizontal dimension line, next to a vertical one.
            if in_row[0].side == "below":
                places = spread([x for x, _ in middles], [text_width(m.text) for m in in_row])
                spots, anchor = [(x, middles[0][1] + TEXT_PX * 0.8) for x in places], "middle"
            else:
                beside, anchor = (-6.0, "end") if in_row[0].side == "left" else (6.0, "start")
                places = spread([y for _, y in middles], [TEXT_PX] * len(middles), 2.0)
                spots = [(middles[0][0] + beside, y) for y in places]
            marks += [_text(m.text, spot, anchor) for m, spot in zip(in_row, spots, strict=True)]
        return marks

    def labels(self, notes: Sequence[Note]) -> list[str]:
        """Draw names in a row above the drawing, each with a leader to its point."""
        anchors = [self.at(note.at) for note in notes]
        widths = [text_width(note.text) for note in notes]
        wanted = spread([x for x, _ in anchors], widths, LABEL_GAP_PX)
        middles = within(wanted, widths, (EDGE_PX, self.width - EDGE_PX), LABEL_GAP_PX)
        row = self.top - 38
        marks = []
        for note, (x, y), middle in zip(notes, anchors, middles, strict=True):
            marks.append(_line((middle, row + TEXT_PX * 0.7), (x, y), "leader"))
            marks.append(f'<circle class="dot" cx="{coord(x)}" cy="{coord(y)}" r="2.2"/>')
            marks.append(_text(note.text, (middle, row)))
        return marks


def _mm(value: float) -> str:
    """Format a length as a drawing shows it: three decimals at most."""
    return coord(value, 3)


def text_width(text: str) -> float:
    """Return the room (px) that `text` takes."""
    return len(text) * CHARACTER_PX


def spread(wanted: Sequence[float], sizes: Sequence[float], gap: float = 4.0) -> list[float]:
    """Return middles of items of `sizes` in a row, `gap` apart or more, in the order of `wanted` and close to it.

    Items that would overlap are joined into a run about the mean of their wanted middles (pool adjacent violators).
    """
    order = sorted(range(len(wanted)), key=lambda i: (wanted[i], i))
    before = [0.0]
    for left, right in pairwise(order):
        before.append(before[-1] + (sizes[left] + sizes[right]) / 2 + gap)
    runs: list[list[float]] = []
    for i, offset in zip(order, before, strict=True):
        runs.append([wanted[i] - offset, 1])
        while len(runs) > 1 and runs[-2][0] > runs[-1][0]:
            mean, count = runs.pop()
            runs[-1] = [(runs[-1][0] * runs[-1][1] + mean * count) / (runs[-1][1] + count), runs[-1][1] + count]
    starts = [mean for mean, count in runs for _ in range(int(count))]
    middles = [0.0] * len(wanted)
    for i, start, offset in zip(order, starts, before, strict=True):
        middles[i] = start + offset
    return middles


def within(
    middles: Sequence[float], sizes: Sequence[float], ends: tuple[float, float], gap: float = 4.0
) -> list[float]:
    """Return middles moved between `ends`, each no farther than it must be; if they don't fit, past the far end."""
    found = list(middles)
    order = sorted(range(len(found)), key=lambda i: found[i])
    start, end = ends
    for i in reversed(order):
        found[i] = min(found[i], end - sizes[i] / 2)
        end = found[i] - sizes[i] / 2 - gap
    for i in order:
        found[i] = max(found[i], start + sizes[i] / 2)
        start = found[i] + sizes[i] / 2 + gap
    return found


def _line(start: Point, end: Point, kind: str) -> str:
    (x1, y1), (x2, y2) = start, end
    return f'<line class="{kind}" x1="{coord(x1)}" y1="{coord(y1)}" x2="{coord(x2)}" y2="{coord(y2)}"/>'


def _text(content: str, at: Point, anchor: str = "middle") -> str:
    """Draw a line of text, its middle at the height of `at`."""
    x, y = at
    return f'<text x="{coord(x)}" y="{coord(y + 0.35 * TEXT_PX)}" text-anchor="{anchor}">{xml_text(content)}</text>'


def _dimension(start: Point, end: Point) -> list[str]:
    """Draw a horizontal or vertical dimension line; arrows that don't fit inside are outside."""
    along = (end[0] - start[0], end[1] - start[1])
    length = (along[0] ** 2 + along[1] ** 2) ** 0.5
    unit = (along[0] / length, along[1] / length)
    inside = 1.0 if length > 3 * ARROW_PX else -1.0
    marks = [_line(start, end, "dimension")]
    for tip, sign in ((start, 1.0), (end, -1.0)):
        way = sign * inside * ARROW_PX
        back = (tip[0] + unit[0] * way, tip[1] + unit[1] * way)
        if inside < 0:
            marks.append(_line(tip, (tip[0] + unit[0] * way * 2, tip[1] + unit[1] * way * 2), "dimension"))
        across = (-unit[1] * ARROW_PX * 0.25, unit[0] * ARROW_PX * 0.25)
        corners = (tip, (back[0] + across[0], back[1] + across[1]), (back[0] - across[0], back[1] - across[1]))
        marks.append(f'<polygon class="arrow" points="{" ".join(f"{coord(x)},{coord(y)}" for x, y in corners)}"/>')
    return marks


def _anchors(regions: Sequence[Region], widths: Sequence[float]) -> list[Point]:
    """Return a point in each region for its leader: well inside, and below if a label of its width has room."""
    ends = [point[0] for region in regions for loop in region.loops for point in loop]
    low, span = min(ends, default=0.0), max(ends, default=0.0) - min(ends, default=0.0)
    room, total, anchors = 0.0, sum(widths) or 1.0, []
    room_needed = 0.02 * span
    for region, width in zip(regions, widths, strict=True):
        wanted = low + span * (room + width / 2) / total
        room += width
        starts = np.array([point for loop in region.loops for point in loop])
        stops = np.array([point for loop in region.loops for point in (*loop[1:], loop[0])])
        best, least = region.loops[0][0], (math.inf, 0.0)
        places = np.linspace(low, low + span, 241)[1:-1]
        for x in places[np.argsort(abs(places - wanted), kind="stable")]:
            if abs(x - wanted) - 20 * room_needed > least[0]:
                break  # no place farther away can be better
            for z in _middles(starts, stops, x):
                # Room counts up to a dot's size; beyond that, nearness to the wanted place does.
                clear = min(_distance(starts, stops, np.array([x, z])), room_needed)
                if (abs(x - wanted) - 20 * clear, x) < least:
                    best, least = (float(x), float(z)), (abs(x - wanted) - 20 * clear, x)
        anchors.append(best)
    return anchors


def _middles(starts: np.ndarray, stops: np.ndarray, x: float) -> np.ndarray:
    """Return middles (mm) of the stretches in which the vertical line at `x` runs inside a region."""
    across = (starts[:, 0] > x) != (stops[:, 0] > x)
    (x0, z0), (x1, z1) = starts[across].T, stops[across].T
    crossings = np.sort(z0 + (z1 - z0) * (x - x0) / (x1 - x0))
    return (crossings[::2] + crossings[1::2]) / 2


def _distance(starts: np.ndarray, stops: np.ndarray, point: np.ndarray) -> float:
    """Return the distance (mm) from `point` to the nearest side of a region."""
    along = stops - starts
    share = np.einsum("ij,ij->i", point - starts, along) / np.maximum(np.einsum("ij,ij->i", along, along), 1e-18)
    nearest = starts + np.clip(share, 0, 1)[:, None] * along
    return float(np.linalg.norm(point - nearest, axis=1).min())
