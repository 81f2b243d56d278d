"""A plot as SVG: points or curves over logarithmic axes (x also linear), a legend. The same data, the same bytes."""

from __future__ import annotations

import math

from benchmarks.accuracy.result import Plot, frontier
from unitcad.export.chart import COLOURS, axis, frame, legend, line, page, text

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
    xs, right, bottom = [x for x, _ in everything], WIDTH - RIGHT, HEIGHT - BOTTOM
    whole = (min(xs, default=0.0), max(xs, default=1.0)) if plot.linear_x else None
    across = axis(xs, LEFT, right, not plot.linear_x, whole)
    up = axis([y for _, y in everything], bottom, TOP, log=True)
    parts = [text(LEFT, 20, plot.title, size=14)]
    parts += frame(across, up, (LEFT, right, TOP, bottom), plot.x_label, plot.y_label, aside=54)
    best = {point for point, on in zip(everything, frontier(everything), strict=True) if on} if plot.frontier else None
    drawn, key, y, marked = [], [], TOP + 12, 0
    for i, (name, points) in enumerate(series.items()):
        colour = COLOURS[i % len(COLOURS)]
        spots = [(across.at(x), up.at(y)) for x, y in points]
        curve = name in plot.curves
        one = []
        if (plot.lines or curve) and len(spots) > 1:
            path = " ".join(f"{x:.1f},{y:.1f}" for x, y in spots)
            stroke = 'stroke-width="2"' if curve else 'stroke-opacity="0.5"'
            one.append(f'<polyline points="{path}" fill="none" stroke="{colour}" {stroke}/>')
        if curve:
            key.append(line(right + 10, y - 4, right + 22, y - 4, colour))
        else:
            size = 3.5 + 1.2 * (marked % 4) + 0.6 * (marked // 4)
            filled = [best is None or point in best for point in points]
            one += [_marker(marked, *spot, size, colour, full) for spot, full in zip(spots, filled, strict=True)]
            key.append(_marker(marked, right + 16, y - 4, 4.0, colour, True))
            marked += 1
        drawn.append(one)
        words = legend(right + 26, y, name, LEGEND_LETTERS)
        key += words
        y += 15 * len(words) + 4
    if best is not None:
        key += [
            text(right + 10, y + 6 + 15 * i, words)
            for i, words in enumerate(("filled: on the frontier", "hollow: beaten in both"))
        ]
    # The last series has the largest markers: where series coincide, the smaller ones lie on top of it.
    return page(WIDTH, HEIGHT, [*parts, *(part for one in reversed(drawn) for part in one), *key])


def _marker(kind: int, x: float, y: float, size: float, colour: str, full: bool) -> str:
    """Draw a circle, square, diamond or triangle of that half-width; hollow ones let others be seen through them."""
    fill = f'fill="{colour}" stroke="#ffffff" stroke-width="0.7"' if full else f'fill="none" stroke="{colour}"'
    corners = _CORNERS[kind % len(_CORNERS)]
    if not corners:
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size:g}" {fill}/>'
    path = " ".join(f"{x + size * dx:.1f},{y + size * dy:.1f}" for dx, dy in corners)
    return f'<polygon points="{path}" {fill}/>'
