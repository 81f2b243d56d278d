"""A plot as SVG: points or curves over logarithmic axes (x also linear), a legend. The same data, the same bytes."""

from __future__ import annotations

import math
import textwrap

from benchmarks.accuracy.result import Plot, frontier
from unitcad.export.chart import COLOURS, line, round_step, text, upward_name

WIDTH, HEIGHT = 720, 440
LEFT, RIGHT, TOP, BOTTOM = 70, 190, 36, 52
LEGEND_LETTERS = 24
_CORNERS = (
    (),
    ((-1, -1), (1, -1), (1, 1), (-1, 1)),
    ((0, -1.3), (1.3, 0), (0, 1.3), (-1.3, 0)),
    ((-1.1, 1), (0, -1.2), (1.1, 1)),
)
"""Corners of each marker, about its middle; the first one is a circle."""


def svg(plot: Plot) -> str:
    """Return the plot as an SVG document. Points that an axis can't show (not above zero, infinite) are left out."""
    least = -math.inf if plot.linear_x else 0.0
    series = {
        name: sorted((x, y) for x, y in points if x > least and y > 0 and math.isfinite(x) and math.isfinite(y))
        for name, points in plot.series.items()
    }
    everything = [point for points in series.values() for point in points]
    xs = [x for x, _ in everything]
    x0, x1 = (min(xs, default=0.0), max(xs, default=1.0)) if plot.linear_x else _decades(xs)
    y0, y1 = _decades([y for _, y in everything])

    def at(x: float, y: float) -> tuple[float, float]:
        across = ((x if plot.linear_x else math.log10(x)) - x0) / ((x1 - x0) or 1)
        up = (math.log10(y) - y0) / (y1 - y0)
        return LEFT + across * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - up * (HEIGHT - TOP - BOTTOM)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
        text(LEFT, 20, plot.title, size=14),
    ]
    for value, label in _ticks(x0, x1) if plot.linear_x else _powers(int(x0), int(x1)):
        x, low = at(value, 10.0**y0)
        parts += [line(x, low, x, TOP, "#e2e2e2"), text(x, low + 16, label, "middle")]
    for value, label in _powers(y0, y1):
        left, y = at(x0 if plot.linear_x else 10.0**x0, value)
        parts += [line(left, y, WIDTH - RIGHT, y, "#e2e2e2"), text(left - 6, y + 4, label, "end")]
    parts += [
        line(LEFT, HEIGHT - BOTTOM, WIDTH - RIGHT, HEIGHT - BOTTOM, "#444444"),
        line(LEFT, HEIGHT - BOTTOM, LEFT, TOP, "#444444"),
        text((LEFT + WIDTH - RIGHT) / 2, HEIGHT - 14, plot.x_label, "middle"),
        upward_name(16, (TOP + HEIGHT - BOTTOM) / 2, plot.y_label),
    ]
    best = {point for point, on in zip(everything, frontier(everything), strict=True) if on} if plot.frontier else None
    drawn, legend, y, marked = [], [], TOP + 12, 0
    for i, (name, points) in enumerate(series.items()):
        colour = COLOURS[i % len(COLOURS)]
        spots = [at(x, y) for x, y in points]
        curve = name in plot.curves
        one = []
        if (plot.lines or curve) and len(spots) > 1:
            path = " ".join(f"{x:.1f},{y:.1f}" for x, y in spots)
            stroke = 'stroke-width="2"' if curve else 'stroke-opacity="0.5"'
            one.append(f'<polyline points="{path}" fill="none" stroke="{colour}" {stroke}/>')
        if curve:
            legend.append(line(WIDTH - RIGHT + 10, y - 4, WIDTH - RIGHT + 22, y - 4, colour))
        else:
            size = 3.5 + 1.2 * (marked % 4) + 0.6 * (marked // 4)
            filled = [best is None or point in best for point in points]
            one += [_marker(marked, *spot, size, colour, full) for spot, full in zip(spots, filled, strict=True)]
            legend.append(_marker(marked, WIDTH - RIGHT + 16, y - 4, 4.0, colour, True))
            marked += 1
        drawn.append(one)
        for words in textwrap.wrap(name, LEGEND_LETTERS):
            legend.append(text(WIDTH - RIGHT + 26, y, words))
            y += 15
        y += 4
    if best is not None:
        legend += [
            text(WIDTH - RIGHT + 10, y + 6 + 15 * i, words)
            for i, words in enumerate(("filled: on the frontier", "hollow: beaten in both"))
        ]
    # The last series has the largest markers: where series coincide, the smaller ones lie on top of it.
    return "\n".join([*parts, *(part for one in reversed(drawn) for part in one), *legend, "</svg>", ""])


def _marker(kind: int, x: float, y: float, size: float, colour: str, full: bool) -> str:
    """Draw a circle, square, diamond or triangle of that half-width; hollow ones let others be seen through them."""
    fill = f'fill="{colour}" stroke="#ffffff" stroke-width="0.7"' if full else f'fill="none" stroke="{colour}"'
    corners = _CORNERS[kind % len(_CORNERS)]
    if not corners:
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size:g}" {fill}/>'
    path = " ".join(f"{x + size * dx:.1f},{y + size * dy:.1f}" for dx, dy in corners)
    return f'<polygon points="{path}" {fill}/>'


def _powers(low: int, high: int) -> list[tuple[float, str]]:
    """Return nine powers of ten or fewer between the ends, and how they are written."""
    decades = range(low, high + 1, max(1, math.ceil((high - low) / 8)))
    return [(10.0**d, f"{10.0**d:g}" if -3 <= d <= 4 else f"1e{d}") for d in decades]


def _ticks(low: float, high: float) -> list[tuple[float, str]]:
    """Return six round numbers or fewer between the ends."""
    step = round_step(high - low, 6)
    return [
        (k * step, f"{k * step:g}") for k in range(math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) + 1)
    ]


def _decades(values: list[float]) -> tuple[int, int]:
    if not values:
        return 0, 1
    low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    return low, max(high, low + 1)
