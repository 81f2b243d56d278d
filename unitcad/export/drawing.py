"""A dimensioned drawing for a workshop, as PDF: each body on a sheet of A4, in section and from above, lines and text.

The views are those of `svg`; its lines, texts and filled shapes are drawn again on the sheet.
"""

from __future__ import annotations

import io
import re
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any
from xml.etree import ElementTree

import numpy as np
from manifold3d import CrossSection, Manifold

from unitcad.export import svg
from unitcad.export.chart import coord
from unitcad.export.svg import Measure, Region, Side
from unitcad.extras import missing_extra
from unitcad.kernels.mesh import arrays

MM = 72 / 25.4
"""Points of a millimetre on paper."""
SHEET_MM = 297.0, 210.0
MARGIN_MM, TITLE_MM, GAP_MM = 10.0, 16.0, 4.0
PT_PER_PX = 0.62
"""Of the views on the sheet: their text is then 7.4 points high."""
SCALES = (10.0, 5.0, 4.0, 3.0, 2.0, 1.0, 0.5, 0.2, 0.1)
LEAST_EDGE_MM = 0.45
"""A face that is shorter than this in the section gets no dimension."""
TAPER = 0.15
"""Slope of a face that still counts as upright."""
SAME_MM = 0.02
"""Lengths this close are one: a caliper shows 0.01 mm."""
Loop = Sequence[svg.Point]
_INK = {"extension": 0.5, "leader": 0.3, "axis": 0.4}
_WIDTH = {"extension": 0.25, "leader": 0.3, "axis": 0.3, "dimension": 0.35, "skin": 0.6}


@dataclass(frozen=True)
class Sheet:
    """A body's views, each drawn at a scale in px a mm, and the title block: name and value of each of its cells."""

    views: tuple[Callable[[float], str], ...]
    facts: tuple[tuple[str, str], ...]


def content(sheets: Sequence[Sheet]) -> bytes:
    """Return the bytes of a PDF with a page each; they follow from the arguments and the version of reportlab.

    Raises Missing without reportlab.
    """
    try:
        from reportlab.pdfgen.canvas import Canvas
    except ImportError:
        raise missing_extra("pdf", "the format pdf needs reportlab") from None
    file = io.BytesIO()
    canvas = Canvas(file, pagesize=(SHEET_MM[0] * MM, SHEET_MM[1] * MM), invariant=1, pageCompression=1)
    canvas.setTitle("unitcad drawing")
    canvas.setCreator("unitcad")
    canvas.setLineJoin(1)
    for i, sheet in enumerate(sheets):
        scale, drawn = _fit_views(sheet.views)
        left = (SHEET_MM[0] - sum(_size(root)[0] + GAP_MM for root in drawn) + GAP_MM) / 2
        for root in drawn:
            width, height = _size(root)
            free = SHEET_MM[1] - 2 * MARGIN_MM - TITLE_MM - height
            _draw(canvas, root, left, SHEET_MM[1] - MARGIN_MM - max(free / 2, GAP_MM))
            left += width + GAP_MM
        said = f"{scale:g}:1" if scale >= 1 else f"1:{1 / scale:g}"
        _title(
            canvas, (*sheet.facts, ("lengths", "mm, as drawn"), ("scale", said), ("sheet", f"{i + 1} of {len(sheets)}"))
        )
        canvas.showPage()
    canvas.save()
    return file.getvalue()


def _fit_views(views: Sequence[Callable[[float], str]]) -> tuple[float, list[ElementTree.Element]]:
    """Return the largest scale at which the views have room side by side, and the views at it."""
    for scale in SCALES:
        drawn = [ElementTree.fromstring(view(scale * MM / PT_PER_PX)) for view in views]
        sizes = [_size(root) for root in drawn]
        wide = sum(width + GAP_MM for width, _ in sizes) - GAP_MM
        high = max(height for _, height in sizes) + GAP_MM
        if wide <= SHEET_MM[0] - 2 * MARGIN_MM and high <= SHEET_MM[1] - 2 * MARGIN_MM - TITLE_MM:
            break
    return scale, drawn


def _size(root: ElementTree.Element) -> tuple[float, float]:
    return float(root.get("width", 0)) * PT_PER_PX / MM, float(root.get("height", 0)) * PT_PER_PX / MM


def _draw(canvas: Any, root: ElementTree.Element, left_mm: float, top_mm: float) -> None:
    """Draw a view with its upper left corner there."""
    canvas.saveState()
    canvas.translate(left_mm * MM, top_mm * MM)
    canvas.scale(PT_PER_PX, -PT_PER_PX)
    # Texts come last: a length has the lines that pass behind it blanked out.
    for element in sorted(root, key=lambda one: one.tag.endswith("text")):
        tag, kind = element.tag.rpartition("}")[2], element.get("class", "")
        at = {key: float(value) for key, value in element.items() if re.fullmatch(r"[cxyr]+[12]?", key)}
        canvas.setStrokeGray(_INK.get(kind, 0.0))
        canvas.setLineWidth(_WIDTH.get(kind, 0.4) / PT_PER_PX)
        canvas.setDash([12, 3, 2, 3] if kind == "axis" else [])
        if tag == "line":
            canvas.line(at["x1"], at["y1"], at["x2"], at["y2"])
        elif tag == "circle":
            canvas.setFillGray(0)
            canvas.circle(at["cx"], at["cy"], at["r"], stroke=0, fill=1)
        elif tag == "text":
            canvas.saveState()
            canvas.scale(1, -1)
            text, middle = _latin(element.text or ""), element.get("text-anchor", "")
            if re.match(r"[ØR]?[0-9]", text):
                wide = canvas.stringWidth(text, "Helvetica", svg.TEXT_PX)
                left = at["x"] - {"middle": wide / 2, "end": wide}.get(middle, 0.0)
                canvas.setFillGray(1)
                canvas.rect(left, -at["y"] - 1, wide, 0.75 * svg.TEXT_PX + 1, stroke=0, fill=1)
            canvas.setFillGray(0)
            canvas.setFont("Helvetica", svg.TEXT_PX)
            write = {"middle": canvas.drawCentredString, "end": canvas.drawRightString}
            write.get(middle, canvas.drawString)(at["x"], -at["y"], text)
            canvas.restoreState()
        elif tag in ("path", "polygon"):
            path = canvas.beginPath()
            for loop in (element.get("d") or f"M{element.get('points')}").split("M")[1:]:
                points = re.findall(r"(-?[\d.]+)[ ,](-?[\d.]+)", loop)
                for j, (x, y) in enumerate(points):
                    (path.lineTo if j else path.moveTo)(float(x), float(y))
                path.close()
            canvas.setFillColor(element.get("fill") or "#000000")
            canvas.drawPath(path, stroke=tag == "path", fill=1, fillMode=0)
    canvas.restoreState()


def _title(canvas: Any, facts: Sequence[tuple[str, str]]) -> None:
    """Draw the frame, and the title block along its foot: a cell each, as wide as its text asks for."""
    wide, high = SHEET_MM[0] - 2 * MARGIN_MM, SHEET_MM[1] - 2 * MARGIN_MM
    canvas.setStrokeGray(0)
    canvas.setFillGray(0)
    canvas.setLineWidth(0.7)
    canvas.rect(MARGIN_MM * MM, MARGIN_MM * MM, wide * MM, high * MM)
    canvas.line(MARGIN_MM * MM, (MARGIN_MM + TITLE_MM) * MM, (MARGIN_MM + wide) * MM, (MARGIN_MM + TITLE_MM) * MM)
    facts = [(key, _latin(value)) for key, value in facts]
    asked = [
        max(canvas.stringWidth(value, "Helvetica", 9), canvas.stringWidth(key, "Helvetica", 6)) for key, value in facts
    ]
    room = wide * MM / sum(width + 3 * MM for width in asked)
    x, size = MARGIN_MM * MM, min(9.0, 9 * room)
    for (key, value), width in zip(facts, asked, strict=True):
        canvas.setFont("Helvetica", 6)
        canvas.drawString(x + 1.5 * MM, (MARGIN_MM + TITLE_MM - 4) * MM, key)
        canvas.setFont("Helvetica", size)
        canvas.drawString(x + 1.5 * MM, (MARGIN_MM + 4) * MM, value)
        x += (width + 3 * MM) * room
        canvas.line(x, MARGIN_MM * MM, x, (MARGIN_MM + TITLE_MM) * MM)


def _latin(text: str) -> str:
    """Return a text in the characters of the PDF's own fonts."""
    return text.encode("cp1252", "replace").decode("cp1252")


# Views of a body:


def from_above(solid: Manifold) -> list[Region]:
    """Return the flat faces that are seen from above over the outline, each height a region, higher ones lighter."""
    vertices, faces = arrays(solid)
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    level = corners[:, :, 2].mean(axis=1).round(3)
    flat = across[:, 2] > 0.9999 * np.linalg.norm(across, axis=1)
    heights = sorted({float(z) for z in level[flat]})
    regions = [_region(solid.project(), 0.55)]
    for i, z in enumerate(heights):
        top = CrossSection([triangle[:, :2] for triangle in corners[flat & (level == z)]])
        seen = top - solid.trim_by_plane((0, 0, 1), z + 2e-3).project()
        regions.append(_region(seen, 0.6 + 0.38 * (i + 1) / len(heights)))
    return [region for region in regions if region.loops]


def _region(flat: CrossSection, grey: float) -> Region:
    loops = tuple(tuple((float(x), float(y)) for x, y in loop) for loop in flat.to_polygons())
    return Region("", (grey, grey, grey), loops)


def across(
    loops: Sequence[Loop],
    centres: Sequence[float],
    round_at: Callable[[float, float, float], bool],
    least: float = LEAST_EDGE_MM,
) -> list[Measure]:
    """Return the widths between upright faces of a section that are alike on both sides of one of the `centres`.

    A tapered face is measured at its lower end; one shorter than `least` (mm) is left out. `round_at(half, centre, z)`
    tells whether faces are on a circle there.
    """
    feet: dict[float, tuple[float, float]] = {}
    for (x0, z0), (x1, z1) in _sides(loops):
        if abs(z1 - z0) >= least and abs(x1 - x0) < TAPER * abs(z1 - z0):
            z, x = min((z0, x0), (z1, x1))
            feet[round(x, 2)] = min((z, x), feet.get(round(x, 2), (z, x)))
    found = list[Measure]()
    for centre in dict.fromkeys(centres):
        for z1, right in sorted(feet.values(), key=lambda foot: foot[1]):
            half = right - centre
            z0, left = min(feet.values(), key=lambda foot: abs(centre - half - foot[1]))
            if half > SAME_MM > abs(centre - half - left):
                sign = "Ø" if round_at(half, centre, max(z0, z1) + LEAST_EDGE_MM / 2) else ""
                found.append(Measure(f"{sign}{coord(right - left, 2)}", left, right, "below", len(found), min(z0, z1)))
    return found


def windows(loops: Sequence[Loop], width_at: Callable[[float, float], float | None]) -> list[Measure]:
    """Return the openings in the outer faces of a section; `width_at(x, z)` is an opening's width, None without one."""
    found = list[Measure]()
    sides: tuple[tuple[Side, Callable[..., float]], ...] = (("left", min), ("right", max))
    for side, end in sides:
        edge = end(x for loop in loops for x, _ in loop)
        walls = sorted(sorted((a[1], b[1])) for a, b in _sides(loops) if abs(a[0] - edge) + abs(b[0] - edge) < SAME_MM)
        for (_, low), (high, _) in pairwise(walls):
            wide = width_at(edge, (low + high) / 2) if high - low > SAME_MM else None
            if wide is not None:
                text = f"{coord(wide, 2)} x {coord(high - low, 2)}"
                found.append(Measure(text, low, high, side, 2 if side == "left" else 0, edge))
    return found


def upright(loops: Sequence[Loop]) -> list[Measure]:
    """Return the steps between the level faces of a section, and its height."""
    levels: defaultdict[float, float] = defaultdict(float)
    for (x0, z0), (x1, z1) in _sides(loops):
        if abs(z1 - z0) < SAME_MM / 4:
            levels[round(z0, 2)] += abs(x1 - x0)
    ends = [end(z for loop in loops for _, z in loop) for end in (min, max)]
    heights = sorted({*ends, *(z for z, length in levels.items() if length >= LEAST_EDGE_MM)})
    heights = [z for i, z in enumerate(heights) if not i or z - heights[i - 1] > SAME_MM]
    left = min(x for loop in loops for x, _ in loop)
    steps = [Measure(coord(b - a, 2), a, b, "left", 0, left) for a, b in pairwise(heights)]
    if len(heights) > 2:
        steps.append(Measure(coord(heights[-1] - heights[0], 2), heights[0], heights[-1], "left", 1, left))
    return steps


def _sides(loops: Sequence[Loop]) -> Iterator[tuple[svg.Point, svg.Point]]:
    for loop in loops:
        yield from pairwise((*loop, loop[0]))
