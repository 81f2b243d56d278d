"""A chart as SVG: curves and points over linear or logarithmic axes, with a legend. The same data, the same bytes."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from unitcad.export.plot_elements import COLOURS, line, round_step, text, upward_name

WIDTH, HEIGHT = 760, 460
LEFT, RIGHT, TOP, BOTTOM = 72, 210, 40, 52
LEGEND_LETTERS = 28
MOST_POINTS = 2000
"""Points of a series that are drawn: more can't be told apart."""
_GREY, _DARK = "#e2e2e2", "#444444"


_NIL = 0.005
"""An axis starts at zero where values lie below it by at most this part of their span, less than a point's size."""


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


def chart(
    series: Sequence[Series],
    title: str,
    x_label: str,
    y_label: str,
    log_x: bool = False,
    log_y: bool = False,
    shaded: tuple[float, float] | None = None,
    shaded_name: str = "",
    x_range: tuple[float, float] | None = None,
) -> str:
    """Return the chart as an SVG document. What an axis can't show is left out.

    `shaded` marks a range of x, which the legend names where `shaded_name` does; `x_range` is what a linear axis of x
    shows, where the series don't say it.
    """
    kept = [(one, _kept(one, log_x, log_y)) for one in series]
    across = _axis(np.concatenate([xy[0] for _, xy in kept] or [np.zeros(0)]), log_x, LEFT, WIDTH - RIGHT, x_range)
    ends = [np.ravel(np.asarray(one.bars, float)) for one in series]
    up = _axis(np.concatenate([*(xy[1] for _, xy in kept), *ends] or [np.zeros(0)]), log_y, HEIGHT - BOTTOM, TOP)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        text(LEFT, 22, title, size=14),
    ]
    if shaded:
        low, high = (min(max(across.at(end), LEFT), WIDTH - RIGHT) for end in shaded)
        height = HEIGHT - TOP - BOTTOM
        parts.append(f'<rect x="{low:.1f}" y="{TOP}" width="{high - low:.1f}" height="{height}" fill="#f3ead8"/>')
    for value, label in across.ticks:
        x = across.at(value)
        parts += [line(x, HEIGHT - BOTTOM, x, TOP, _GREY), text(x, HEIGHT - BOTTOM + 16, label, "middle")]
    for value, label in up.ticks:
        y = up.at(value)
        parts += [line(LEFT, y, WIDTH - RIGHT, y, _GREY), text(LEFT - 6, y + 4, label, "end")]
    parts += [
        line(LEFT, HEIGHT - BOTTOM, WIDTH - RIGHT, HEIGHT - BOTTOM, _DARK),
        line(LEFT, HEIGHT - BOTTOM, LEFT, TOP, _DARK),
        text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 14, x_label, "middle"),
        upward_name(16, (TOP + HEIGHT - BOTTOM) / 2, y_label),
    ]
    y = TOP + 12
    for i, (one, (xs, ys)) in enumerate(kept):
        colour = COLOURS[i % len(COLOURS)]
        spots = [(across.at(float(a)), up.at(float(b))) for a, b in zip(xs, ys, strict=True)]
        for (x, _), ends_of_one in zip(spots, one.bars, strict=False):
            low, high = (up.at(float(end)) for end in ends_of_one)
            parts.append(line(x, low, x, high, colour))
        parts += _drawn(one, spots, colour)
        parts += _drawn(one, [(WIDTH - RIGHT + 10.0, y - 4.0), (WIDTH - RIGHT + 24.0, y - 4.0)], colour)
        for words in textwrap.wrap(one.name, LEGEND_LETTERS):
            parts.append(text(WIDTH - RIGHT + 30, y, words))
            y += 15
        y += 4
    if shaded and shaded_name:
        parts.append(f'<rect x="{WIDTH - RIGHT + 10}" y="{y - 10}" width="14" height="12" fill="#f3ead8"/>')
        for words in textwrap.wrap(shaded_name, LEGEND_LETTERS):
            parts.append(text(WIDTH - RIGHT + 30, y, words))
            y += 15
    return "\n".join([*parts, "</svg>", ""])


@dataclass(frozen=True)
class _Axis:
    at: Callable[[float], float]
    ticks: list[tuple[float, str]]


def _kept(one: Series, log_x: bool, log_y: bool) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.asarray(one.x, float), np.asarray(one.y, float)
    shown = np.isfinite(x) & np.isfinite(y) & ((x > 0) | (not log_x)) & ((y > 0) | (not log_y))
    x, y = x[shown], y[shown]
    step = max(1, math.ceil(len(x) / MOST_POINTS))
    return x[::step], y[::step]


def _axis(values: np.ndarray, log: bool, start: float, end: float, whole: tuple[float, float] | None = None) -> _Axis:
    low, high = (float(values.min()), float(values.max())) if values.size else (1.0, 10.0)
    if log:
        first, last = math.floor(math.log10(low) + 1e-9), math.ceil(math.log10(high) - 1e-9)
        last = max(last, first + 1)
        step = max(1, math.ceil((last - first) / 8))
        ticks = [(10.0**d, f"{10.0**d:g}") for d in range(first, last + 1, step)]
        return _Axis(lambda v: start + (math.log10(v) - first) / (last - first) * (end - start), ticks)
    if whole is not None and whole[1] > whole[0]:
        low, high = whole
        step = round_step(high - low, 6)
        inside = range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
        ticks = [(k * step, f"{k * step:.6g}") for k in inside]
        return _Axis(lambda v: start + (v - low) / (high - low) * (end - start), ticks)
    low = 0.0 if -_NIL * (high - low) <= low < 0.0 else low
    low, high = min(low, 0.0) if low > 0 and low < 0.3 * high else low, high if high > low else low + 1.0
    step = round_step(high - low, 6)
    first, last = math.floor(low / step + 1e-9), math.ceil(high / step - 1e-9)
    ticks = [(k * step, f"{k * step:.6g}") for k in range(first, last + 1)]
    return _Axis(lambda v: start + (v / step - first) / (last - first) * (end - start), ticks)


def _drawn(one: Series, spots: list[tuple[float, float]], colour: str) -> list[str]:
    if one.points:
        return [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{colour}"/>' for x, y in spots]
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in spots)
    dashes = ' stroke-dasharray="5 4"' if one.dashed else ""
    return [f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{one.width:.3g}"{dashes}/>']
