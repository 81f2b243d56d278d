"""Parts of a technical drawing in SVG: dimension lines, leaders, text clear of other text. In px, y downwards."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from unitcad.text import xml_attribute, xml_text

TEXT_PX = 12.0
CHARACTER_PX = 0.62 * TEXT_PX
"""The room for a character: no common sans-serif is wider on average."""
ARROW_PX = 7.0

Point = tuple[float, float]


def number(value: float) -> str:
    """Format a coordinate: two decimals, no trailing zeros, no minus zero."""
    return f"{round(value, 2) + 0.0:.2f}".rstrip("0").rstrip(".")


def millimetres(value: float) -> str:
    """Format a length as a drawing shows it: three decimals at most."""
    return f"{value + 0.0:.3f}".rstrip("0").rstrip(".")


def text_width(text: str) -> float:
    """Return the room (px) that `text` takes."""
    return len(text) * CHARACTER_PX


def spread(wanted: Sequence[float], sizes: Sequence[float], gap: float = 4.0) -> list[float]:
    """Return middles of items of `sizes` in a row, `gap` apart or more, in the order of `wanted` and close to it.

    Items that would overlap are joined into a run about the mean of their wanted middles (pool adjacent violators).
    """
    order = sorted(range(len(wanted)), key=lambda i: (wanted[i], i))
    before = [0.0]
    for left, right in pairwise(order):
        before.append(before[-1] + (sizes[left] + sizes[right]) / 2 + gap)
    runs: list[list[float]] = []
    for i, offset in zip(order, before, strict=True):
        runs.append([wanted[i] - offset, 1])
        while len(runs) > 1 and runs[-2][0] > runs[-1][0]:
            mean, count = runs.pop()
            runs[-1] = [(runs[-1][0] * runs[-1][1] + mean * count) / (runs[-1][1] + count), runs[-1][1] + count]
    starts = [mean for mean, count in runs for _ in range(int(count))]
    middles = [0.0] * len(wanted)
    for i, start, offset in zip(order, starts, before, strict=True):
        middles[i] = start + offset
    return middles


def within(
    middles: Sequence[float], sizes: Sequence[float], ends: tuple[float, float], gap: float = 4.0
) -> list[float]:
    """Return middles moved between `ends`, each no farther than it must be; where they don't fit, past the far end."""
    found = list(middles)
    order = sorted(range(len(found)), key=lambda i: found[i])
    start, end = ends
    for i in reversed(order):
        found[i] = min(found[i], end - sizes[i] / 2)
        end = found[i] - sizes[i] / 2 - gap
    for i in order:
        found[i] = max(found[i], start + sizes[i] / 2)
        start = found[i] + sizes[i] / 2 + gap
    return found


def line(start: Point, end: Point, kind: str) -> str:
    """Draw a line of the style `kind`."""
    (x1, y1), (x2, y2) = start, end
    return f'<line class="{kind}" x1="{number(x1)}" y1="{number(y1)}" x2="{number(x2)}" y2="{number(y2)}"/>'


def text(content: str, at: Point, anchor: str = "middle") -> str:
    """Draw a line of text, its middle at the height of `at`."""
    x, y = at
    return f'<text x="{number(x)}" y="{number(y + 0.35 * TEXT_PX)}" text-anchor="{anchor}">{xml_text(content)}</text>'


def dot(at: Point) -> str:
    """Draw the end of a leader."""
    return f'<circle class="dot" cx="{number(at[0])}" cy="{number(at[1])}" r="2.2"/>'


def outline(loops: Sequence[Sequence[Point]], fill: str, name: str) -> str:
    """Draw a filled region with holes, titled."""
    path = "".join("M" + "L".join(f"{number(x)} {number(y)}" for x, y in loop) + "Z" for loop in loops)
    return f'<path d="{path}" fill={xml_attribute(fill)} fill-rule="evenodd"><title>{xml_text(name)}</title></path>'


def dimension(start: Point, end: Point) -> list[str]:
    """Draw a horizontal or vertical dimension line; arrows that don't fit inside stand outside."""
    along = (end[0] - start[0], end[1] - start[1])
    length = (along[0] ** 2 + along[1] ** 2) ** 0.5
    unit = (along[0] / length, along[1] / length)
    inside = 1.0 if length > 3 * ARROW_PX else -1.0
    marks = [line(start, end, "dimension")]
    for tip, sign in ((start, 1.0), (end, -1.0)):
        way = sign * inside * ARROW_PX
        back = (tip[0] + unit[0] * way, tip[1] + unit[1] * way)
        if inside < 0:
            marks.append(line(tip, (tip[0] + unit[0] * way * 2, tip[1] + unit[1] * way * 2), "dimension"))
        across = (-unit[1] * ARROW_PX * 0.25, unit[0] * ARROW_PX * 0.25)
        corners = (tip, (back[0] + across[0], back[1] + across[1]), (back[0] - across[0], back[1] - across[1]))
        marks.append(f'<polygon class="arrow" points="{" ".join(f"{number(x)},{number(y)}" for x, y in corners)}"/>')
    return marks
