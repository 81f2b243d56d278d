"""Engraved characters as polygons: seven-bar hexadecimal digits, and L, on a grid of 3 by 5 strokes.

One outline a character, with its islands as holes: a boolean costs a kernel far more than a polygon's corners do.
"""

from __future__ import annotations

from functools import lru_cache

from unitcad.shape.profile import Profile, polygon
from unitcad.shape.tree import Extrude, Shape, moved, union

#        top, upper right, lower right, bottom, lower left, upper left, middle
_BARS = {
    "a": (0, 4, 2, 4),
    "b": (2, 2, 2, 4),
    "c": (2, 0, 2, 2),
    "d": (0, 0, 2, 0),
    "e": (0, 0, 0, 2),
    "f": (0, 2, 0, 4),
    "g": (0, 2, 2, 2),
}
_GLYPHS = {
    "0": "abcdef",
    "1": "bc",
    "2": "abged",
    "3": "abgcd",
    "4": "fgbc",
    "5": "afgcd",
    "6": "afgedc",
    "7": "abc",
    "8": "abcdefg",
    "9": "abcdfg",
    "A": "abcefg",
    "B": "cdefg",
    "C": "adef",
    "D": "bcdeg",
    "E": "adefg",
    "F": "aefg",
    "L": "def",
}
WIDTH, HEIGHT, PITCH = 3, 5, 4
"""Of a character, in strokes; PITCH from one to the next."""


def engraving(text: str, stroke: float, z0: float, z1: float) -> Shape:
    """`text` as a solid to cut with: lower left corner at the origin, reading along +x, from z0 to z1 (mm).

    `text` has one or more hexadecimal digits in capitals, or L. Raises KeyError for another character.
    """
    return union(
        moved(Extrude(outer, z0, z1, holes), x=i * PITCH * stroke)
        for i, character in enumerate(text)
        for outer, holes in [outlines(character, stroke)]
    )


def seen(text: str) -> str:
    """Return a text as its bars look: B and D are those of small letters, or they would be 8 and 0."""
    return text.replace("B", "b").replace("D", "d")


def text_width(text: str, stroke: float) -> float:
    """Width of the engraved text in mm."""
    return (len(text) * PITCH - 1) * stroke


@lru_cache
def outlines(character: str, stroke: float) -> tuple[Profile, tuple[Profile, ...]]:
    """Return a character's outer outline and islands: the border of its cells, walked with the ink on the left."""
    ink = {
        (x, y)
        for bar in _GLYPHS[character]
        for x0, y0, x1, y1 in [_BARS[bar]]
        for x in range(x0, x1 + 1)
        for y in range(y0, y1 + 1)
    }
    follows: dict[tuple[int, int], tuple[int, int]] = {}
    for x, y in ink:
        for beside, start, end in (
            ((x, y - 1), (x, y), (x + 1, y)),
            ((x + 1, y), (x + 1, y), (x + 1, y + 1)),
            ((x, y + 1), (x + 1, y + 1), (x, y + 1)),
            ((x - 1, y), (x, y + 1), (x, y)),
        ):
            if beside not in ink:
                follows[start] = end
    loops = []
    while follows:
        start = min(follows)
        loop = [start]
        while (after := follows.pop(loop[-1])) != start:
            loop.append(after)
        loops.append(_corners(loop))
    outer, *islands = loops
    return (
        polygon(*((x * stroke, y * stroke) for x, y in outer)),
        tuple(polygon(*((x * stroke, y * stroke) for x, y in reversed(island))) for island in islands),
    )


def _corners(loop: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return a loop of unit steps without the points in the middle of a straight run."""
    return [
        p
        for before, p, after in zip([loop[-1], *loop[:-1]], loop, [*loop[1:], loop[0]], strict=True)
        if (p[0] - before[0], p[1] - before[1]) != (after[0] - p[0], after[1] - p[1])
    ]
