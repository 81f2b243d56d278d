"""Elements of a plot as SVG: a line, a text, the name of an upward axis, and the step of round ticks."""

from __future__ import annotations

import math
from html import escape

COLOURS = ("#1f6fb2", "#c8553d", "#3c8d5a", "#8059a8", "#b8860b", "#4d4d4d", "#d1478c", "#17868c")
"""Colours of series, in turn."""


def line(x0: float, y0: float, x1: float, y1: float, stroke: str, more: str = "") -> str:
    """Return a line, px; `more`: further attributes, each with a space before it."""
    return f'<line x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}" stroke="{stroke}"{more}/>'


def text(x: float, y: float, content: str, anchor: str = "start", size: int = 12, fill: str = "") -> str:
    """Return a line of text from its base line, px; `fill`: else the colour of the document."""
    style = f' fill="{fill}"' if fill else ""
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" font-size="{size}"{style}>{escape(content)}</text>'


def upward_name(x: float, y: float, content: str) -> str:
    """Return the name of an upward axis, its middle at that place, px."""
    at = f"translate({x:g} {y:.1f}) rotate(-90)"
    return f'<text transform="{at}" text-anchor="middle">{escape(content)}</text>'


def round_step(span: float, count: int) -> float:
    """Return the smallest 1, 2 or 5 times a power of ten of which at most `count` fit into the span."""
    rough = max(span, 1e-300) / count
    unit = 10.0 ** math.floor(math.log10(rough))
    return next(unit * k for k in (1, 2, 5, 10) if unit * k >= rough)
