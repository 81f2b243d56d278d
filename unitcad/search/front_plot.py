"""The wishes that pull apart as SVG: probability of the level over mass, time, size and crosstalk, with the front.

A panel for each quantity of which less costs probability; the same data, the same bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from unitcad.export.chart import axis, frame, line, page, text
from unitcad.search.candidates import Candidates
from unitcad.search.ranking_order import front

WIDTH, PANEL, HEIGHT = 820, 400, 280
LEFT, RIGHT, TOP, BOTTOM = 52, 14, 34, 44
_GREY, _FRONT, _MARK = "#b9b4aa", "#0a6b62", "#c2571a"
HEAD = 46


@dataclass(frozen=True)
class Quantity:
    """What pulls against the level: its values by row, and the limit where one is set."""

    name: str
    values: np.ndarray
    limit: float | None


def quantities(found: Candidates, rows: np.ndarray) -> list[Quantity]:
    """Return the quantities of which less costs probability: their front has more than one candidate."""
    wish = found.target.wish
    every = [
        Quantity("mass, g", found.mass_g, wish.mass_max_g),
        Quantity("hours until it is out of the mould", found.hours, wish.cure_hours_max),
        Quantity("height, mm", found.height_mm, wish.height_max_mm),
        Quantity("diameter, mm", found.diameter_mm, wish.diameter_max_mm),
        Quantity("crosstalk ratio", found.crosstalk, wish.crosstalk_ratio_max),
    ]
    known = [one for one in every if np.all(np.isfinite(one.values[rows]))]
    return [one for one in known if front(found, rows, one.values).size > 1]


def front_svg(
    found: Candidates, rows: np.ndarray, marked: Sequence[tuple[str, float, Sequence[float]]], columns: int = 2
) -> str:
    """Return the plot; `marked`: (label, probability, value of each quantity) of the proposals."""
    panels = quantities(found, rows)
    lines = -(-len(panels) // columns)
    height, width = HEAD + HEIGHT * max(lines, 1), WIDTH if columns > 1 else PANEL + 10
    parts = [
        text(12, 22, f"What pulls apart: {rows.size} candidates, front and proposals", size=14),
        f'<circle cx="16" cy="36" r="2.5" fill="{_GREY}"/>',
        text(24, 40, "candidate"),
        f'<path d="M92 36h22" stroke="{_FRONT}" stroke-width="2" fill="none"/>',
        text(120, 40, "front: nothing is better in both"),
        f'<circle cx="312" cy="36" r="5" fill="{_MARK}"/>',
        text(322, 40, "proposal"),
    ]
    for i, one in enumerate(panels):
        at = (PANEL + 10) * (i % columns), HEAD + HEIGHT * (i // columns)
        parts += _panel(found, rows, one, at, [(label, p, values[i]) for label, p, values in marked])
    if not panels:
        parts.append(text(12, HEAD + 30, "Nothing pulls apart: the best is the smallest too."))
    return page(width, height, parts)


def _panel(
    found: Candidates,
    rows: np.ndarray,
    one: Quantity,
    at: tuple[float, float],
    marked: Sequence[tuple[str, float, float]],
) -> list[str]:
    x0, x1 = at[0] + LEFT, at[0] + PANEL - RIGHT
    y0, y1 = at[1] + HEIGHT - BOTTOM, at[1] + TOP - 16
    values = np.concatenate([one.values[rows], [value for _, _, value in marked]])
    low, high = float(values.min()), float(values.max())
    room = 0.05 * (high - low)
    low, high = low - room, high + room
    x_axis, y_axis = axis(values.tolist(), x0, x1, whole=(low, high)), axis([], y0, y1, whole=(0.0, 1.0))
    across, up = x_axis.at, y_axis.at
    parts = frame(x_axis, y_axis, (x0, x1, y1, y0), one.name, "probability of the level", aside=38)
    if one.limit is not None and low <= one.limit <= high:
        parts.append(line(across(one.limit), y0, across(one.limit), y1, _MARK, ' stroke-dasharray="5 4"'))
        parts.append(text(across(one.limit) - 4, y1 + 10, "limit", "end"))
    spots = {(round(across(float(one.values[row])), 1), round(up(float(found.probability[row])), 1)) for row in rows}
    parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2" fill="{_GREY}"/>' for x, y in sorted(spots)]
    best = front(found, rows, one.values)
    steps = [(across(float(one.values[row])), up(float(found.probability[row]))) for row in best]
    path = f"M{steps[0][0]:.1f} {steps[0][1]:.1f}" + "".join(f"H{x:.1f}V{y:.1f}" for x, y in steps[1:])
    parts.append(f'<path d="{path}H{x1:.1f}" stroke="{_FRONT}" stroke-width="2" fill="none"/>')
    parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{_FRONT}"/>' for x, y in steps]
    for label, p, value in marked:
        x, y = across(value), up(p)
        parts.append(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="8" fill="{_MARK}"/>')
        parts.append(text(x, y + 4, label, "middle", fill="#ffffff"))
    return parts
