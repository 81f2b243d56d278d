"""Charts as SVG: axes, linear or logarithmic, with curves, points and a legend. The same data, the same bytes.

Other drawings in SVG take their elements from here: coordinates, lines, texts, the page.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

COLOURS = ("#1f6fb2", "#c8553d", "#3c8d5a", "#8059a8", "#b8860b", "#4d4d4d", "#d1478c", "#17868c")
WIDTH, HEIGHT = 760, 460
LEFT, RIGHT, TOP, BOTTOM = 72, 210, 40, 52
LEGEND_LETTERS = 28
MOST_POINTS = 2000
"""Points of a series that are drawn: more can't be told apart."""
_GRID, _DARK, _SHADE = "#e2e2e2", "#444444", "#f3ead8"
_NIL = 0.005
"""An axis starts at zero if values are below it by at most this part of their span, less than a point's size."""


@dataclass(frozen=True)
class Series:
    """A series: x and y of the same length; drawn as `points`, else as a curve, `dashed` or not.

    `bars`: (low, high) of y at each point, drawn as a line. `width`: of a curve, px.
    """

    name: str
    x: Sequence[float] | np.ndarray
    y: Sequence[float] | np.ndarray
    points: bool = False
    dashed: bool = False
    bars: Sequence[tuple[float, float]] = ()
    width: float = 1.8


@dataclass(frozen=True)
class Axis:
    """`at` gives a value's place (px); `ticks` are values with their labels."""

    at: Callable[[float], float]
    ticks: list[tuple[float, str]]


def chart(
    series: Sequence[Series],
    title: str,
    x_label: str,
    y_label: str,
    log_x: bool = False,
    log_y: bool = False,
    shaded: tuple[float, float] | None = None,
    x_range: tuple[float, float] | None = None,
) -> str:
    """Return the chart as an SVG document. Points that an axis can't show are skipped.

    `shaded` marks a range of x; `x_range` is the range of a linear axis of x, by default that of the series.
    """
    right, bottom = WIDTH - RIGHT, HEIGHT - BOTTOM
    kept = [(one, *_kept(one, log_x, log_y)) for one in series]
    across = axis([value for _, xs, _ in kept for value in xs], LEFT, right, log_x, x_range)
    bars = [end for one in series for ends in one.bars for end in ends]
    up = axis([*bars, *(value for _, _, ys in kept for value in ys)], bottom, TOP, log_y)
    parts = [text(LEFT, 22, title, size=14)]
    if shaded:
        low, high = (min(max(across.at(end), LEFT), right) for end in shaded)
        parts.append(_box(round(low, 1), TOP, round(high - low, 1), bottom - TOP))
    parts += frame(across, up, (LEFT, right, TOP, bottom), x_label, y_label)
    y = TOP + 12
    for i, (one, xs, ys) in enumerate(kept):
        colour = COLOURS[i % len(COLOURS)]
        spots = [(across.at(float(a)), up.at(float(b))) for a, b in zip(xs, ys, strict=True)]
        for (x, _), (low, high) in zip(spots, one.bars, strict=False):
            parts.append(line(x, up.at(float(low)), x, up.at(float(high)), colour))
        parts += _draw_curves(one, spots, colour)
        parts += _draw_curves(one, [(right + 10.0, y - 4.0), (right + 24.0, y - 4.0)], colour)
        words = legend(right + 30, y, one.name)
        parts += words
        y += 15 * len(words) + 4
    return page(WIDTH, HEIGHT, parts)


@dataclass(frozen=True)
class Estimated:
    """A row of `dot_plot`: a value with its range, None if it has none, and the measured value if there is one.

    `reason`: why there is neither value nor range.
    """

    name: str
    value: float | None
    low: float | None
    high: float | None
    measured: float | None = None
    reason: str = ""


ROW, NAME_WIDTH = 30, 200
"""Height of a row of a dot plot, and the width of its names, px."""


def dot_plot(rows: Sequence[Estimated], title: str, label: str, range_name: str) -> str:
    """Return rows of a dot with its range and the measured value on one logarithmic axis, as an SVG document.

    Values must be positive. A row without range has its reason as text.
    """
    left, right, top = NAME_WIDTH, WIDTH - 24, 66
    bottom = top + ROW * len(rows)
    shown = [one for row in rows for one in (row.value, row.low, row.high, row.measured) if one]
    low, high = (min(shown), max(shown)) if shown else (1.0, 10.0)
    ticks = _steps_of_125(low, high)
    first, last = math.log(ticks[0]), math.log(ticks[-1])

    def at(value: float) -> float:
        return left + (math.log(value) - first) / (last - first) * (right - left)

    parts = [text(12, 22, title, size=14)]
    parts += [_spot(left + 6, 42), text(left + 18, 46, "estimate")]
    parts += [_reach(left + 96, left + 126, 42), text(left + 132, 46, range_name)]
    parts += [_diamond(left + 246, 42), text(left + 258, 46, "measured")]
    for tick in ticks:
        parts.append(line(at(tick), top, at(tick), bottom, _GRID))
        parts.append(text(at(tick), bottom + 16, f"{tick:g}", "middle"))
    parts.append(line(left, bottom, right, bottom, _DARK))
    for i, row in enumerate(rows):
        y = top + ROW * (i + 0.5)
        name = row.name if len(row.name) <= LEGEND_LETTERS else f"{row.name[: LEGEND_LETTERS - 1]}…"
        parts.append(text(left - 10, y + 4, name, "end"))
        if row.low and row.high:
            parts.append(_reach(at(row.low), at(row.high), y))
        elif row.reason:
            parts.append(text(left + 6, y + 4, f"no level: {row.reason}", size=11))
        parts += [_spot(at(row.value), y)] if row.value else []
        parts += [_diamond(at(row.measured), y)] if row.measured else []
    parts.append(text((left + right) / 2, bottom + 36, label, "middle"))
    return page(WIDTH, bottom + 48, parts)


def _steps_of_125(low: float, high: float) -> list[float]:
    """Return 1, 2 and 5 times powers of ten from below `low` to above `high`, two or more."""
    powers = range(math.floor(math.log10(low)) - 1, math.ceil(math.log10(high)) + 2)
    every = [step * 10.0**power for power in powers for step in (1, 2, 5)]
    first = max(i for i, value in enumerate(every) if value <= low * (1 + 1e-9))
    last = min(i for i, value in enumerate(every) if value >= high * (1 - 1e-9))
    return every[first : max(last, first + 1) + 1]


def _spot(x: float, y: float) -> str:
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5" fill="{COLOURS[0]}"/>'


def _reach(x0: float, x1: float, y: float) -> str:
    return line(x0, y, x1, y, COLOURS[0], ' stroke-width="8" stroke-opacity="0.3" stroke-linecap="round"')


def _diamond(x: float, y: float) -> str:
    points = " ".join(f"{x + dx:.1f},{y + dy:.1f}" for dx, dy in ((0, -6), (6, 0), (0, 6), (-6, 0)))
    return f'<polygon points="{points}" fill="none" stroke="{_DARK}" stroke-width="1.8"/>'


def page(width: float, height: float, parts: Sequence[str]) -> str:
    """Return a drawing as an SVG document on white."""
    size = f'width="{coord(width)}" height="{coord(height)}"'
    head = (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {coord(width)} {coord(height)}" {size} '
        f'font-family="sans-serif" font-size="12">\n<rect {size} fill="#ffffff"/>'
    )
    return "\n".join([head, *parts, "</svg>", ""])


def frame(
    across: Axis, up: Axis, box: tuple[float, float, float, float], x_label: str, y_label: str, aside: float = 56
) -> list[str]:
    """Draw two axes with grid, ticks and names; `box`: left, right, top, bottom; `aside`: from it to the name of y."""
    left, right, top, bottom = box
    parts = []
    for value, label in across.ticks:
        x = across.at(value)
        parts += [line(x, bottom, x, top, _GRID), text(x, bottom + 16, label, "middle")]
    for value, label in up.ticks:
        y = up.at(value)
        parts += [line(left, y, right, y, _GRID), text(left - 6, y + 4, label, "end")]
    return [
        *parts,
        line(left, bottom, right, bottom, _DARK),
        line(left, bottom, left, top, _DARK),
        text((left + right) / 2, bottom + 38, x_label, "middle"),
        upward_name(left - aside, (top + bottom) / 2, y_label),
    ]


def axis(
    values: Sequence[float], start: float, end: float, log: bool = False, whole: tuple[float, float] | None = None
) -> Axis:
    """Return an axis from `start` to `end` (px) that shows all values; a linear one shows `whole` instead."""
    low, high = (float(min(values)), float(max(values))) if len(values) else (1.0, 10.0)
    if log:
        first, last = math.floor(math.log10(low) + 1e-9), math.ceil(math.log10(high) - 1e-9)
        last = max(last, first + 1)
        step = max(1, math.ceil((last - first) / 8))
        powers = range(first, last + 1, step)
        ticks = [(10.0**d, f"{10.0**d:g}" if -5 < d < 6 else f"1e{d}") for d in powers]
        return Axis(lambda v: start + (math.log10(v) - first) / (last - first) * (end - start), ticks)
    if whole is not None and whole[1] > whole[0]:
        low, high = whole
        step = round_step(high - low)
    else:
        low = 0.0 if -_NIL * (high - low) <= low < 0.0 or 0 < low < 0.3 * high else low
        high = high if high > low else low + 1.0
        step = round_step(high - low)
        low, high = math.floor(low / step + 1e-9) * step, math.ceil(high / step - 1e-9) * step
    inside = range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    return Axis(
        lambda v: start + (v - low) / (high - low) * (end - start), [(k * step, f"{k * step:.6g}") for k in inside]
    )


def round_step(span: float, count: int = 6) -> float:
    """Return the smallest 1, 2 or 5 times a power of ten of which at most `count` fit into the span."""
    rough = max(span, 1e-300) / count
    unit = 10.0 ** math.floor(math.log10(rough))
    return next(unit * k for k in (1, 2, 5, 10) if unit * k >= rough)


def coord(value: float, digits: int = 2) -> str:
    """Format a coordinate: so many decimals at most, no trailing zeros, no minus zero."""
    return f"{round(value, digits) + 0.0:.{digits}f}".rstrip("0").rstrip(".")


def line(x0: float, y0: float, x1: float, y1: float, stroke: str, more: str = "") -> str:
    """Draw a line, px; `more`: further attributes, each with a space before it."""
    return f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}" stroke="{stroke}"{more}/>'


def text(x: float, y: float, content: str, anchor: str = "start", size: int = 12, fill: str = "") -> str:
    """Draw a line of text from its base line, px; `fill`: default the colour of the document."""
    style = f' fill="{fill}"' if fill else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}"{style}>{escape(content)}</text>'


def upward_name(x: float, y: float, content: str) -> str:
    """Draw the name of an upward axis, its middle at that place, px."""
    at = f"translate({x:g} {y:.1f}) rotate(-90)"
    return f'<text transform="{at}" text-anchor="middle">{escape(content)}</text>'


def legend(x: float, y: float, name: str, letters: int = LEGEND_LETTERS) -> list[str]:
    """Draw a name in a legend, in as many lines as it takes, 15 px apart."""
    return [text(x, y + 15 * i, words) for i, words in enumerate(textwrap.wrap(name, letters))]


def _box(x: float, y: float, width: float, height: float) -> str:
    return f'<rect x="{x}" y="{y}" width="{width}" height="{height}" fill="{_SHADE}"/>'


def _kept(one: Series, log_x: bool, log_y: bool) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.asarray(one.x, float), np.asarray(one.y, float)
    shown = np.isfinite(x) & np.isfinite(y) & ((x > 0) | (not log_x)) & ((y > 0) | (not log_y))
    x, y = x[shown], y[shown]
    step = max(1, math.ceil(len(x) / MOST_POINTS))
    return x[::step], y[::step]


def _draw_curves(one: Series, spots: list[tuple[float, float]], colour: str) -> list[str]:
    if one.points:
        return [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{colour}"/>' for x, y in spots]
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in spots)
    dashes = ' stroke-dasharray="5 4"' if one.dashed else ""
    return [f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{one.width:.3g}"{dashes}/>']
