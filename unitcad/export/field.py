"""A field on a plane as a picture: colours on a logarithmic scale, a contour, circles with names, lines of words.

The same drawing as SVG or as PNG. Lengths of the plane in mm, y upward.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Literal

import numpy as np
from PIL import Image, ImageDraw

from unitcad.export.chart import coord, page
from unitcad.export.raster import encode_png, picture_font

DECADES = 2.0
"""Decades of the scale below the largest value."""
SCALE = ((13, 27, 62), (32, 82, 138), (41, 143, 158), (134, 203, 146), (251, 246, 190))
"""Colours from the least to the largest value: their lightness grows steadily."""
CONTOUR, _EDGE, _INK = "#ff6a13", "#ffffff", "#111111"
_WIDE, _LEFT, _SIZE, _LINE = 640.0, 14.0, 12, 17.0
_SHARPER = 2

Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Circle:
    """A circle with a name: x, y and radius in mm; `on`: whether what it stands for moves."""

    name: str
    x: float
    y: float
    radius: float
    on: bool = True


@dataclass(frozen=True, eq=False)
class Field:
    """A field at the nodes of a grid.

    box: its corners x0, y0, x1, y1 (mm); values: (rows, columns), the first row at y0; unit: of the values; contour:
    the values and the limit of the line that is drawn, or None; words: lines under the picture.
    """

    title: str
    box: Box
    values: np.ndarray
    unit: str
    circles: Sequence[Circle]
    contour: tuple[np.ndarray, float, str] | None
    words: Sequence[str]


def field_picture(field: Field, form: Literal["svg", "png"]) -> bytes:
    """Return the picture of a field as a file."""
    return (_svg if form == "svg" else _png)(field)


def shades(values: np.ndarray, largest: float) -> np.ndarray:
    """Return the colours of values, bytes of shape (..., 3); those below the scale have its darkest colour."""
    with np.errstate(divide="ignore"):
        share = np.log10(np.asarray(values, dtype=float) / (largest or 1.0)) / DECADES + 1.0
    place = np.clip(share, 0.0, 1.0) * (len(SCALE) - 1)
    channels = [np.interp(place, range(len(SCALE)), [colour[i] for colour in SCALE]) for i in range(3)]
    return np.round(np.stack(channels, axis=-1)).astype(np.uint8)


def contour_lines(values: np.ndarray, limit: float) -> np.ndarray:
    """Return the segments on which values at grid nodes pass a limit, shape (n, 2, 2): ends as (column, row).

    Marching triangles: each cell is cut along both diagonals, so no case is ambiguous.
    """
    rows, columns = np.mgrid[0 : values.shape[0], 0 : values.shape[1]]
    at = np.stack([columns, rows, values - limit], axis=-1).astype(float)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    middle = (a + b + c + d) / 4.0
    triangles = [np.stack([one, two, middle], axis=-2) for one, two in ((a, b), (b, c), (c, d), (d, a))]
    corner = np.concatenate([each.reshape(-1, 3, 3) for each in triangles])
    inside = corner[..., 2] >= 0.0
    corner = corner[inside.any(axis=1) & ~inside.all(axis=1)]
    inside = corner[..., 2] >= 0.0
    # The one corner that is alone on its side, and the points on the two sides from it.
    alone = np.argmax(inside == (inside.sum(axis=1) == 1)[:, None], axis=1)
    row = np.arange(len(corner))
    first = corner[row, alone]
    ends = []
    for step in (1, 2):
        other = corner[row, (alone + step) % 3]
        ends.append(first + (first[:, 2] / (first[:, 2] - other[:, 2]))[:, None] * (other - first))
    return np.stack(ends, axis=1)[..., :2]


@dataclass(frozen=True)
class _Layout:
    """Pixels: scale (px/mm), the map's left, top, width and height, and the whole picture's size."""

    scale: float
    left: float
    top: float
    wide: float
    high: float
    size: tuple[float, float]
    lines: tuple[str, ...]


def _layout(field: Field) -> _Layout:
    x0, y0, x1, y1 = field.box
    scale = min(_WIDE / (x1 - x0), _WIDE / (y1 - y0))
    wide, high = (x1 - x0) * scale, (y1 - y0) * scale
    across = max(wide + 110.0, 520.0)
    most = int(across / (0.52 * _SIZE))
    lines = tuple(part for line in field.words for part in _wrapped(line, most))
    top = 34.0
    return _Layout(scale, _LEFT, top, wide, high, (across + 2 * _LEFT, top + high + _LINE * (len(lines) + 1.5)), lines)


def _wrapped(line: str, most: int) -> list[str]:
    rows = [""]
    for word in line.split():
        if rows[-1] and len(rows[-1]) + len(word) >= most:
            rows.append("")
        rows[-1] = f"{rows[-1]} {word}".strip()
    return rows


def _ticks(largest: float) -> list[float]:
    """Return round values of the scale: 1, 2 and 5 of each decade."""
    first = math.floor(math.log10(largest)) - int(DECADES)
    every = [m * 10.0**d for d in range(first, first + int(DECADES) + 2) for m in (1, 2, 5)]
    return [value for value in every if largest * 10.0**-DECADES <= value <= largest]


def _paint(field: Field, at: _Layout, stroke: Callable[..., None], write: Callable[..., None]) -> None:
    """Draw everything but the colours: `stroke` a list of polylines (px), `write` a text at a point."""
    x0, _, _, y1 = field.box
    write(at.left, 20.0, field.title, "start", 14)
    for one in field.circles:
        turn = np.linspace(0.0, 2.0 * np.pi, 73)
        x = at.left + (one.x - x0 + one.radius * np.cos(turn)) * at.scale
        y = at.top + (y1 - one.y + one.radius * np.sin(turn)) * at.scale
        stroke([np.stack([x, y], axis=1)], _EDGE, 1.6 if one.on else 0.7)
        size = min(13.0, 0.7 * one.radius * at.scale)
        here = at.left + (one.x - x0) * at.scale, at.top + (y1 - one.y) * at.scale + 0.35 * size
        write(*here, one.name, "middle", size)
    bar = 10.0 if at.wide / at.scale < 200.0 else 50.0
    low = at.top + at.high - 12.0
    stroke([np.array([[at.left + 12.0, low], [at.left + 12.0 + bar * at.scale, low]])], _EDGE, 3.0)
    write(at.left + 12.0 + bar * at.scale / 2.0, low - 6.0, f"{bar:g} mm", "middle", 11)
    if field.contour is not None:
        values, limit, _ = field.contour
        rows, columns = values.shape
        ends = contour_lines(values, limit) * [at.wide / (columns - 1), at.high / (rows - 1)]
        ends = np.stack([at.left + ends[..., 0], at.top + at.high - ends[..., 1]], axis=-1)
        stroke(list(ends), CONTOUR, 2.0)
    largest = float(field.values.max())
    bar, tall = at.left + at.wide + 18.0, min(at.high, 260.0)
    for value in _ticks(largest):
        y = at.top - tall * math.log10(value / largest) / DECADES
        stroke([np.array([[bar + 14.0, y], [bar + 19.0, y]])], _INK, 1.0)
        write(bar + 23.0, y + 4.0, f"{value:.3g}", "start", 11)
    write(bar, at.top + tall + 16.0, field.unit, "start", 11)
    for i, line in enumerate(at.lines):
        write(at.left, at.top + at.high + _LINE * (i + 1.4), line, "start", _SIZE)


def _images(field: Field, at: _Layout) -> list[tuple[np.ndarray, tuple[float, float, float, float]]]:
    """Return the map and the bar of its scale: colours (rows from above), and left, top, width, height in px."""
    largest, (rows, columns) = float(field.values.max()), field.values.shape
    bar = np.logspace(0.0, -DECADES, 128)[:, None] * largest
    x, y = at.wide / (columns - 1), at.high / (rows - 1)  # a pixel has its node in its middle
    whole = at.left - x / 2.0, at.top - y / 2.0, at.wide + x, at.high + y
    return [
        (shades(field.values[::-1], largest), whole),
        (shades(bar, largest), (at.left + at.wide + 18.0, at.top, 14.0, min(at.high, 260.0))),
    ]


def _svg(field: Field) -> bytes:
    at, parts = _layout(field), list[str]()

    def stroke(lines: Sequence[np.ndarray], colour: str, width: float) -> None:
        path = "".join("M" + "L".join(f"{coord(x)} {coord(y)}" for x, y in line) for line in lines)
        parts.append(f'<path d="{path}" fill="none" stroke="{colour}" stroke-width="{width}"/>')

    def write(x: float, y: float, content: str, anchor: str, size: float) -> None:
        on_map = anchor == "middle"
        halo = f' fill="{_EDGE}" stroke="#102040" stroke-width="2" paint-order="stroke"' if on_map else ""
        parts.append(
            f'<text x="{coord(x)}" y="{coord(y)}" font-size="{coord(size)}" text-anchor="{anchor}"{halo}>'
            f"{escape(content)}</text>"
        )

    for colours, (left, top, wide, high) in _images(field, at):
        data = base64.b64encode(encode_png(Image.fromarray(colours))).decode()
        parts.append(
            f'<image x="{coord(left)}" y="{coord(top)}" width="{coord(wide)}" height="{coord(high)}" '
            f'preserveAspectRatio="none" href="data:image/png;base64,{data}"/>'
        )
    _paint(field, at, stroke, write)
    return page(*at.size, parts).encode()


def _png(field: Field) -> bytes:
    at = _layout(field)
    picture = Image.new("RGB", tuple(math.ceil(_SHARPER * side) for side in at.size), "white")  # type: ignore[arg-type]
    pen = ImageDraw.Draw(picture)

    def stroke(lines: Sequence[np.ndarray], colour: str, width: float) -> None:
        for line in lines:
            points = [(_SHARPER * x, _SHARPER * y) for x, y in line.tolist()]
            pen.line(points, colour, round(_SHARPER * width), joint="curve")

    def write(x: float, y: float, content: str, anchor: str, size: float) -> None:
        on_map = anchor == "middle"
        pen.text(
            (_SHARPER * x, _SHARPER * y),
            content,
            _EDGE if on_map else _INK,
            picture_font(_SHARPER * size),
            "ms" if on_map else "ls",
            stroke_width=2 if on_map else 0,
            stroke_fill="#102040",
        )

    for colours, (left, top, wide, high) in _images(field, at):
        size = round(_SHARPER * wide), round(_SHARPER * high)
        image = Image.fromarray(colours).resize(size, Image.Resampling.BILINEAR)
        picture.paste(image, (round(_SHARPER * left), round(_SHARPER * top)))
    _paint(field, at, stroke, write)
    return encode_png(picture)
