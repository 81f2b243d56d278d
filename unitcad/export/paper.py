"""Sheets of A4 as PDF: lines, texts, filled outlines and tables at their places on paper, and the title block.

Lengths in mm on paper, from the lower left corner of the sheet. reportlab is loaded only to measure texts and to write.
"""

from __future__ import annotations

import io
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

import numpy as np

from unitcad.extras import missing_extra

MM = 72 / 25.4
"""Points of a millimetre."""
PORTRAIT, LANDSCAPE = (210.0, 297.0), (297.0, 210.0)
LEFT_MM, MARGIN_MM = 20.0, 10.0
"""From the frame to the sheet's edge: on the left, where it is filed, and elsewhere (ISO 5457)."""
TEXT_MM, LARGE_MM = 2.5, 3.5
"""Size of a text: its capitals are 1.8 and 2.5 mm high, as in ISO 3098."""
CAPITAL, BELOW = 0.72, 0.21
"""Height of a capital and depth below the line, as shares of a text's size."""
TITLE_MM = 180.0, 24.0
ARROW_MM = 2.2
CLEAR_MM = 0.25
"""Between a text and the nearest line."""

Point = tuple[float, float]
Box = tuple[float, float, float, float]
Kind = Literal["outline", "edge", "dimension", "extension", "leader", "centre", "cut", "end", "frame"]
_WIDTH = {"outline": 0.35, "edge": 0.18, "end": 0.6, "frame": 0.5}
_DASH = {"centre": (4, 1, 0.6, 1), "cut": (4, 1, 0.6, 1)}
_YIELDING = ("extension", "leader", "centre", "cut")
"""Kinds of line that are interrupted at a text."""


@dataclass(frozen=True)
class Line:
    """A straight line."""

    start: Point
    end: Point
    kind: Kind = "dimension"


@dataclass(frozen=True)
class Arrow:
    """The head of an arrow: its tip, and the direction in which it points."""

    tip: Point
    way: Point


@dataclass(frozen=True)
class Ring:
    """A circle, drawn as a line, broken if it is `hidden`; a dot if `filled`."""

    centre: Point
    radius: float
    filled: bool = False
    hidden: bool = False


@dataclass(frozen=True)
class Fill:
    """An outline with holes by the even-odd rule, filled with a colour; `hatch`: its lines' direction, degrees."""

    loops: tuple[tuple[Point, ...], ...]
    colour: tuple[float, float, float]
    hatch: float | None = None
    kind: Kind = "outline"


@dataclass(frozen=True)
class Text:
    """A text on one line; `at`: the start, middle or end of its base line. `upright`: read from the right."""

    text: str
    at: Point
    anchor: Literal["start", "middle", "end"] = "middle"
    size: float = TEXT_MM
    upright: bool = False

    @property
    def box(self) -> Box:
        """The rectangle of its letters, without their depth below the line if it has only figures and capitals."""
        wide = text_width(self.text, self.size)
        left = -wide * {"start": 0.0, "middle": 0.5, "end": 1.0}[self.anchor]
        low = -BELOW * self.size if any(letter in "gjpqy,;()" for letter in self.text) else 0.0
        (x, y), high = self.at, CAPITAL * self.size
        if self.upright:
            return x - high, y + left, x - low, y + left + wide
        return x + left, y + low, x + left + wide, y + high


Mark = Line | Arrow | Ring | Fill | Text


@dataclass(frozen=True)
class Page:
    """A sheet: its size and all that is drawn on it."""

    size: Point
    marks: tuple[Mark, ...]


@lru_cache(maxsize=4096)
def text_width(text: str, size: float) -> float:
    """Return the width of a text, mm. Raises Missing without reportlab."""
    try:
        from reportlab.pdfbase.pdfmetrics import stringWidth
    except ImportError:
        raise missing_extra("pdf", "the format pdf needs reportlab") from None
    return float(stringWidth(latin(text), "Helvetica", size))


def latin(text: str) -> str:
    """Return a text in the characters of the PDF's own fonts."""
    return text.encode("cp1252", "replace").decode("cp1252")


def moved(marks: Iterable[Mark], dx: float, dy: float) -> Iterator[Mark]:
    """Yield marks at another place."""

    def at(point: Point) -> Point:
        return point[0] + dx, point[1] + dy

    for mark in marks:
        if isinstance(mark, Line):
            yield replace(mark, start=at(mark.start), end=at(mark.end))
        elif isinstance(mark, Arrow):
            yield replace(mark, tip=at(mark.tip))
        elif isinstance(mark, Ring):
            yield replace(mark, centre=at(mark.centre))
        elif isinstance(mark, Fill):
            yield replace(mark, loops=tuple(tuple(at(point) for point in loop) for loop in mark.loops))
        else:
            yield replace(mark, at=at(mark.at))


def segments(marks: Iterable[Mark]) -> np.ndarray:
    """Return the straight lines that marks consist of besides texts and hatching, each (x0, y0, x1, y1)."""
    found: list[tuple[float, float, float, float]] = []
    for mark in marks:
        if isinstance(mark, Line):
            found.append((*mark.start, *mark.end))
        loops: Sequence[Sequence[Point]] = ()
        if isinstance(mark, Fill):
            loops = mark.loops
        elif isinstance(mark, Arrow):
            loops = (_head(mark),)
        elif isinstance(mark, Ring):
            turns = [math.tau * i / 24 for i in range(24)]
            (x, y), r = mark.centre, mark.radius
            loops = ([(x + r * math.cos(turn), y + r * math.sin(turn)) for turn in turns],)
        found += [(*a, *b) for loop in loops for a, b in zip(loop, (*loop[1:], loop[0]), strict=True)]
    return np.array(found).reshape(-1, 4)


def crossed(box: Box, lines: np.ndarray, clear: float = CLEAR_MM) -> np.ndarray:
    """Return which of the lines (n, 4) pass through a box or nearer to it than `clear`."""
    return _inside(box, lines, clear)[2]


def _inside(box: Box, lines: np.ndarray, clear: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return from where to where along each line, from 0 to 1, it is in a box, and whether it is (Liang and Barsky)."""
    first, last = np.zeros(len(lines)), np.ones(len(lines))
    apart = np.zeros(len(lines), bool)
    for axis in (0, 1):
        low, high = box[axis] - clear, box[axis + 2] + clear
        start, along = lines[:, axis], lines[:, axis + 2] - lines[:, axis]
        level = abs(along) < 1e-12
        apart |= level & ((start < low) | (start > high))
        slope = np.where(level, 1.0, along)
        ends = np.sort([(low - start) / slope, (high - start) / slope], axis=0)
        first = np.where(level, first, np.maximum(first, ends[0]))
        last = np.where(level, last, np.minimum(last, ends[1]))
    return first, last, ~apart & (first < last)


def overlap(one: Box, other: Box, clear: float = CLEAR_MM) -> bool:
    """Return whether two boxes overlap, or are nearer to each other than `clear`."""
    return all(one[i] < other[i + 2] + clear and other[i] < one[i + 2] + clear for i in (0, 1))


def interrupted(marks: Sequence[Mark]) -> Iterator[Mark]:
    """Yield marks, with lines that give way to a text interrupted there."""
    boxes = [mark.box for mark in marks if isinstance(mark, Text)]
    for mark in marks:
        if not isinstance(mark, Line) or mark.kind not in _YIELDING:
            yield mark
            continue
        line, gone = np.array([(*mark.start, *mark.end)]), [(1.0, 1.0)]
        (x0, x1), (y0, y1) = (sorted(ends) for ends in zip(mark.start, mark.end, strict=True))
        for box in boxes:
            if not overlap((x0, y0, x1, y1), box, 2 * CLEAR_MM):
                continue
            first, last, met = _inside(box, line, 2 * CLEAR_MM)
            if met[0]:
                gone.append((float(first[0]), float(last[0])))
        done, along = 0.0, line[0, 2:] - line[0, :2]
        for first, last in sorted(gone):
            if first - done > 1e-9:
                start, end = line[0, :2] + done * along, line[0, :2] + first * along
                yield replace(mark, start=(float(start[0]), float(start[1])), end=(float(end[0]), float(end[1])))
            done = max(done, last)


def extent(marks: Iterable[Mark]) -> Box:
    """Return the least box round marks."""
    marks = list(marks)
    corners = segments(marks).reshape(-1, 2)
    boxes = [mark.box for mark in marks if isinstance(mark, Text)]
    points = np.vstack([corners, *(np.reshape(box, (2, 2)) for box in boxes)])
    (x0, y0), (x1, y1) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return x0, y0, x1, y1


def frame(size: Point) -> Box:
    """Return the frame of a sheet."""
    return LEFT_MM, MARGIN_MM, size[0] - MARGIN_MM, size[1] - MARGIN_MM


def table(rows: Sequence[Sequence[str]], widths: Sequence[float], at: Point, row_mm: float = 4.4) -> Iterator[Mark]:
    """Draw rows of texts with lines between them, the upper left corner at `at`; the first row is the head."""
    (left, top), wide, high = at, sum(widths), row_mm * len(rows)
    for i in range(len(rows) + 1):
        yield Line((left, top - i * row_mm), (left + wide, top - i * row_mm), "frame" if i < 2 else "edge")
    x = left
    for i, width in enumerate((*widths, 0.0)):
        yield Line((x, top), (x, top - high), "frame" if i in (0, len(widths)) else "edge")
        for j, row in enumerate(rows if i < len(widths) else ()):
            yield fitted(row[i], (x + 1.0, top - (j + 0.5) * row_mm - CAPITAL / 2 * TEXT_MM), width - 2.0)
        x += width


def fitted(text: str, at: Point, room: float, size: float = TEXT_MM) -> Text:
    """Return a text that starts at `at`, smaller if it is wider than the room for it."""
    return Text(text, at, "start", min(size, size * room / max(text_width(text, size), 1e-9)))


def title_block(size: Point, cells: Sequence[Sequence[tuple[str, str, float]]]) -> Iterator[Mark]:
    """Draw the frame and the title block: rows of cells, each with its name, its text and its share of the width.

    The cell named "projection" has the symbol of the first angle in place of a text.
    """
    x0, y0, x1, y1 = frame(size)
    corners = (x0, y0), (x1, y0), (x1, y1), (x0, y1)
    yield from (Line(a, b, "frame") for a, b in zip(corners, (*corners[1:], corners[0]), strict=True))
    left, high = x1 - TITLE_MM[0], TITLE_MM[1] / len(cells)
    yield Line((left, y0), (left, y0 + TITLE_MM[1]), "frame")
    for i, row in enumerate(cells):
        top = y0 + TITLE_MM[1] - i * high
        yield Line((left, top), (x1, top), "edge" if i else "frame")
        x, all_of = left, sum(share for *_, share in row)
        for name, text, share in row:
            if x > left:
                yield Line((x, top), (x, top - high), "edge")
            wide = TITLE_MM[0] * share / all_of
            yield fitted(name, (x + 1.2, top - 2.6), wide - 2.4, 2.0)
            if name == "projection":
                yield from _first_angle((x + 16.0, top - high / 2))
            else:
                yield fitted(text, (x + 1.2, top - high + 1.4), wide - 2.4, LARGE_MM)
            x += wide


def _first_angle(at: Point) -> Iterator[Mark]:
    """Draw a cut cone from the side, its small end on the left, and what is seen from there on its right (ISO 5456)."""
    (x, y), small, large = at, 1.0, 2.0
    cone = (x, y - small), (x + 4.0, y - large), (x + 4.0, y + large), (x, y + small)
    yield from (Line(a, b, "outline") for a, b in zip(cone, (*cone[1:], cone[0]), strict=True))
    yield Line((x - 1.0, y), (x + 5.0, y), "centre")
    eye = x + 8.5, y
    yield from (Ring(eye, radius) for radius in (small, large))
    yield Line((eye[0] - large - 1, y), (eye[0] + large + 1, y), "centre")
    yield Line((eye[0], y - large - 1), (eye[0], y + large + 1), "centre")


def _head(arrow: Arrow) -> tuple[Point, Point, Point]:
    (x, y), (dx, dy) = arrow.tip, arrow.way
    back, side = (x - ARROW_MM * dx, y - ARROW_MM * dy), ARROW_MM / 6
    return arrow.tip, (back[0] - side * dy, back[1] + side * dx), (back[0] + side * dy, back[1] - side * dx)


def content(pages: Sequence[Page]) -> bytes:
    """Return the bytes of a PDF; they follow from the pages and the version of reportlab.

    Raises Missing without reportlab.
    """
    try:
        from reportlab.pdfgen.canvas import Canvas
    except ImportError:
        raise missing_extra("pdf", "the format pdf needs reportlab") from None
    file = io.BytesIO()
    canvas = Canvas(file, invariant=1, pageCompression=1)
    canvas.setTitle("unitcad drawing")
    canvas.setCreator("unitcad")
    for page in pages:
        canvas.setPageSize((page.size[0] * MM, page.size[1] * MM))
        canvas.scale(MM, MM)
        canvas.setLineJoin(1)
        for mark in page.marks:
            _draw(canvas, mark)
        canvas.showPage()
    canvas.save()
    return file.getvalue()


def _draw(canvas: Any, mark: Mark) -> None:
    canvas.setDash([])
    canvas.setStrokeGray(0)
    canvas.setFillGray(0)
    canvas.setLineWidth(0.18)
    if isinstance(mark, Line):
        canvas.setLineWidth(_WIDTH.get(mark.kind, 0.18))
        canvas.setDash(list(_DASH.get(mark.kind, ())))
        canvas.line(*mark.start, *mark.end)
    elif isinstance(mark, Ring):
        canvas.setDash([1.2, 0.6] if mark.hidden else [])
        canvas.circle(*mark.centre, mark.radius, stroke=not mark.filled, fill=mark.filled)
    elif isinstance(mark, Arrow):
        canvas.drawPath(_path(canvas, [_head(mark)]), stroke=0, fill=1)
    elif isinstance(mark, Fill):
        canvas.setFillColorRGB(*mark.colour)
        canvas.setLineWidth(_WIDTH.get(mark.kind, 0.18))
        path = _path(canvas, mark.loops)
        if mark.hatch is not None:
            canvas.drawPath(path, stroke=0, fill=1, fillMode=0)
            _hatch(canvas, mark, mark.hatch)
        canvas.drawPath(path, stroke=1, fill=mark.hatch is None, fillMode=0)
    else:
        canvas.saveState()
        canvas.translate(*mark.at)
        canvas.rotate(90 if mark.upright else 0)
        canvas.setFont("Helvetica", mark.size)
        write = {"middle": canvas.drawCentredString, "end": canvas.drawRightString}
        write.get(mark.anchor, canvas.drawString)(0, 0, latin(mark.text))
        canvas.restoreState()


def _path(canvas: Any, loops: Iterable[Sequence[Point]]) -> Any:
    path = canvas.beginPath()
    for loop in loops:
        for i, point in enumerate(loop):
            (path.lineTo if i else path.moveTo)(*point)
        path.close()
    return path


def _hatch(canvas: Any, fill: Fill, degrees: float, step: float = 1.4) -> None:
    canvas.saveState()
    canvas.clipPath(_path(canvas, fill.loops), stroke=0, fill=0, fillMode=0)
    canvas.setStrokeGray(0.35)
    canvas.setLineWidth(0.1)
    x0, y0, x1, y1 = extent([fill])
    dx, dy = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    along, across = [[x * u + y * v for x in (x0, x1) for y in (y0, y1)] for u, v in ((dx, dy), (-dy, dx))]
    for i in range(math.ceil(min(across) / step), math.floor(max(across) / step) + 1):
        a, b, c = min(along), max(along), i * step
        canvas.line(a * dx - c * dy, a * dy + c * dx, b * dx - c * dy, b * dy + c * dx)
    canvas.restoreState()
