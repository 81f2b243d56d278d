"""What each rival predicts for the best experiments, as SVG: a bar from 10 to 90 % of its draws, a mark at the middle.

Where half of a rival's draws or more can't be read, words stand instead of the bar.

The same data, the same bytes.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

from unitcad.export.chart import COLOURS, line, text

WIDTH, LEFT, RIGHT, TOP, BOTTOM = 860, 300, 24, 64, 44
BAR, GAP = 14, 18
_LETTERS = 44
BELOW = "below what can be read"


def is_below(span: Mapping[str, float]) -> bool:
    """Tell whether half of a prediction's draws or more are below what can be read."""
    return span["unread"] >= 0.5


def svg(experiments: Sequence[Mapping[str, Any]], rivals: Sequence[str]) -> str:
    """Return the plot of experiments, each as `study` gives it, one below the other over a logarithmic axis."""
    spans = [span for one in experiments for span in one["predicted"].values() if not is_below(span)]
    low = math.log10(min((span["low"] for span in spans), default=1.0)) - 0.05
    high = math.log10(max((span["high"] for span in spans), default=1.0)) + 0.05
    row = BAR * len(rivals) + GAP
    height = TOP + row * len(experiments) + BOTTOM

    def across(ratio: float) -> float:
        return LEFT + (math.log10(ratio) - low) / (high - low) * (WIDTH - LEFT - RIGHT)

    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" '
        'font-size="12">',
        f'<rect width="{WIDTH}" height="{height}" fill="#ffffff"/>',
        text(12, 20, "What each rival predicts: 10 to 90 % of its draws", size=14),
    ]
    at = 12.0
    for name, colour in zip(rivals, _colours(rivals), strict=True):
        parts += [f'<rect x="{at:.1f}" y="33" width="10" height="10" fill="{colour}"/>', text(at + 14, 43, name)]
        at += 26 + 6.6 * len(name)
    bottom = height - BOTTOM
    for ratio in _ticks(low, high):
        x = across(ratio)
        stroke = "#888888" if ratio == 1.0 else "#e2e2e2"
        parts += [
            line(x, TOP - 8, x, bottom, stroke),
            text(x, bottom + 16, f"{ratio:g}", "middle"),
        ]
    parts.append(text((LEFT + WIDTH - RIGHT) / 2, height - 10, "ratio of the two readings", "middle"))
    for i, one in enumerate(experiments):
        y = TOP + i * row
        lines = [*textwrap.wrap(one["experiment"], _LETTERS), f"{one['bits']:.2f} ± {one['error']:.2f} bits"]
        parts += [text(12, y + 12 + 15 * n, words) for n, words in enumerate(lines)]
        for n, (name, colour) in enumerate(zip(rivals, _colours(rivals), strict=True)):
            span, middle = one["predicted"][name], y + BAR * n + BAR / 2
            if is_below(span):
                parts.append(text(LEFT, middle + 4, BELOW, size=10, fill=colour))
                continue
            x0, at_middle, x1 = (across(span[part]) for part in ("low", "middle", "high"))
            parts += [
                f'<rect x="{x0 - 1:.1f}" y="{middle - 4:.1f}" width="{x1 - x0 + 2:.1f}" height="8" fill="{colour}" '
                'fill-opacity="0.45"/>',
                line(at_middle, middle - 5, at_middle, middle + 5, colour, ' stroke-width="3"'),
            ]
    return "\n".join([*parts, "</svg>", ""])


def _colours(rivals: Sequence[str]) -> list[str]:
    return [COLOURS[i % len(COLOURS)] for i in range(len(rivals))]


def _ticks(low: float, high: float) -> list[float]:
    """Return 1, 2 and 5 times powers of ten between the ends, powers alone where those are many."""
    steps = (1.0, 2.0, 5.0) if high - low < 3.0 else (1.0,)
    every = [step * 10.0**power for power in range(math.floor(low) - 1, math.ceil(high) + 1) for step in steps]
    return [float(f"{ratio:.6g}") for ratio in every if low <= math.log10(ratio) <= high]
