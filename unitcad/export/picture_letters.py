"""Letters in a picture: letters and digits as strokes of a round pen, so that no font file is needed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

PEN = 0.45
"""Half a stroke's width, in units of which a small letter is 4 high."""
GAP, SPACE, ABOVE, BELOW = 1.9, 3.0, 6.0, 2.0
"""Between letters, between words, and how far letters reach above and below the line they stand on."""
_RING = "0,1.2 0,2.8 1.2,4 2.8,4 4,2.8 4,1.2 2.8,0 1.2,0 0,1.2"
_ARCH = "0,2.8 1.4,4 2.8,4 4,2.8 4,0"
# Strokes of a letter, one after the other: x,y from its lower left corner.
_LETTERS = {
    "a": f"{_RING};4,4 4,0",
    "b": f"{_RING};0,6 0,0",
    "c": "4,3.2 2.8,4 1.2,4 0,2.8 0,1.2 1.2,0 2.8,0 4,.8",
    "d": f"{_RING};4,6 4,0",
    "e": "0,2 4,2 4,2.8 2.8,4 1.2,4 0,2.8 0,1.2 1.2,0 2.8,0 3.8,.7",
    "f": "3,6 2.2,6 1.3,5 1.3,0;0,4 2.8,4",
    "g": f"{_RING};4,4 4,-1 3,-2 .6,-2",
    "h": f"0,6 0,0;{_ARCH}",
    "i": "0,4 0,0;0,5.6 0,5.7",
    "j": "1,4 1,-1.2 .2,-2;1,5.6 1,5.7",
    "k": "0,6 0,0;3.6,4 0,1.4;1.4,2.4 3.8,0",
    "l": "0,6 0,0",
    "m": "0,4 0,0;0,2.8 1.2,4 2,4 3,2.9 3,0;3,2.8 4.2,4 5,4 6,2.9 6,0",
    "n": f"0,4 0,0;{_ARCH}",
    "o": _RING,
    "p": f"{_RING};0,4 0,-2",
    "q": f"{_RING};4,4 4,-2",
    "r": "0,4 0,0;0,2.6 1.2,4 2.6,4",
    "s": "3.6,3.3 2.6,4 1,4 .2,3.2 .6,2.3 3,1.7 3.6,.9 2.8,0 .9,0 0,.7",
    "t": "1.2,5.6 1.2,.9 2,0 3,0;0,4 2.8,4",
    "u": "0,4 0,1.2 1.2,0 2.6,0 4,1.2;4,4 4,0",
    "v": "0,4 2,0 4,4",
    "w": "0,4 1.4,0 3,4 4.6,0 6,4",
    "x": "0,4 3.8,0;0,0 3.8,4",
    "y": "0,4 2,0;4,4 1.4,-1.4 .4,-2",
    "z": "0,4 3.6,4 0,0 3.6,0",
    "A": "0,0 2.2,6 4.4,0;.8,2 3.6,2",
    "B": "0,0 0,6 2.6,6 3.7,5.2 3.7,4 2.6,3.2 0,3.2;2.6,3.2 4,2.3 4,.9 2.8,0 0,0",
    "C": "4,4.8 2.9,6 1.4,6 0,4.6 0,1.4 1.4,0 2.9,0 4,1.2",
    "D": "0,0 0,6 2.4,6 4,4.4 4,1.6 2.4,0 0,0",
    "E": "3.8,6 0,6 0,0 3.8,0;0,3.1 3,3.1",
    "F": "3.8,6 0,6 0,0;0,3.1 3,3.1",
    "G": "4,4.8 2.9,6 1.4,6 0,4.6 0,1.4 1.4,0 2.9,0 4,1 4,2.8 2.4,2.8",
    "H": "0,0 0,6;4,0 4,6;0,3.1 4,3.1",
    "I": "0,0 2,0;0,6 2,6;1,6 1,0",
    "J": "3,6 3,1.2 2,0 .9,0 0,1",
    "K": "0,0 0,6;4,6 0,2.3;1.5,3.7 4.2,0",
    "L": "0,6 0,0 3.6,0",
    "M": "0,0 0,6 2.4,2 4.8,6 4.8,0",
    "N": "0,0 0,6 4,0 4,6",
    "O": "0,1.5 0,4.5 1.4,6 2.9,6 4.3,4.5 4.3,1.5 2.9,0 1.4,0 0,1.5",
    "P": "0,0 0,6 2.7,6 4,5 4,3.7 2.7,2.7 0,2.7",
    "Q": "0,1.5 0,4.5 1.4,6 2.9,6 4.3,4.5 4.3,1.5 2.9,0 1.4,0 0,1.5;2.7,1.6 4.4,-.3",
    "R": "0,0 0,6 2.7,6 4,5 4,3.7 2.7,2.7 0,2.7;1.8,2.7 4.2,0",
    "S": "3.8,5 2.8,6 1.2,6 .1,5 .3,3.8 1.2,3.2 2.8,2.8 3.8,2 3.9,1 2.8,0 1.1,0 0,1",
    "T": "0,6 4.2,6;2.1,6 2.1,0",
    "U": "0,6 0,1.4 1.3,0 2.7,0 4,1.4 4,6",
    "V": "0,6 2.2,0 4.4,6",
    "W": "0,6 1.5,0 3,4.6 4.5,0 6,6",
    "X": "0,6 4.2,0;0,0 4.2,6",
    "Y": "0,6 2.1,3 4.2,6;2.1,3 2.1,0",
    "Z": "0,6 4.2,6 0,0 4.2,0",
    "0": "0,1.5 0,4.5 1.3,6 2.7,6 4,4.5 4,1.5 2.7,0 1.3,0 0,1.5",
    "1": ".6,4.6 2.2,6 2.2,0",
    "2": "0,4.6 1.2,6 2.9,6 4,4.7 3.8,3.4 0,0 4,0",
    "3": "0,5.1 1.2,6 2.8,6 3.9,4.8 3,3.3 1.6,3.2;3,3.2 4,1.9 4,1.3 2.8,0 1.2,0 0,.9",
    "4": "3,0 3,6 0,1.9 4,1.9",
    "5": "3.7,6 .5,6 .2,3.3 1.4,3.8 2.8,3.7 4,2.5 4,1.3 2.8,0 1.2,0 0,.8",
    "6": "3.5,5.4 2.5,6 1.5,6 0,4 0,1.3 1.2,0 2.8,0 4,1.3 4,2.3 2.8,3.6 1.2,3.6 0,2.3",
    "7": "0,6 4,6 1.4,0",
    "8": "1.3,3.3 .3,4.2 .3,5 1.3,6 2.7,6 3.7,5 3.7,4.2 2.7,3.3 1.3,3.3 0,2.2 0,1.1 1.2,0 2.8,0 4,1.1 4,2.2 2.7,3.3",
    "9": ".5,.6 1.5,0 2.5,0 4,2 4,4.7 2.8,6 1.2,6 0,4.7 0,3.7 1.2,2.4 2.8,2.4 4,3.7",
    ".": "0,0 0,.1",
    "-": "0,2 2.4,2",
}


@dataclass(frozen=True)
class Name:
    """A name and the point (x, y, z) mm of what it names: under a dot, or in a `ring` where a dot would cover it.

    `on`: the name itself is written there, without a line to it.
    """

    text: str
    at: tuple[float, float, float]
    ring: bool = False
    on: bool = False


@lru_cache(maxsize=256)
def written(text: str, unit: float) -> np.ndarray:
    """Return a text as a picture (height, width) of truth values, row 0 the highest; `unit` in pixels.

    A character that there is no letter for is written as a hyphen.
    """
    strokes: list[np.ndarray] = []
    x = 0.0
    for character in text:
        if character == " ":
            x += SPACE
            continue
        letter = [
            np.array([pair.split(",") for pair in stroke.split()], float)
            for stroke in _LETTERS.get(character, _LETTERS["-"]).split(";")
        ]
        strokes += [points + np.array([x, 0.0]) for points in letter]
        x += max(float(points[:, 0].max()) for points in letter) + GAP
    width, height = (
        math.ceil(unit * (max(x - GAP, 0.0) + 2 * PEN)),
        math.ceil(unit * (ABOVE + BELOW + 2 * PEN)),
    )
    column = (np.arange(width) + 0.5) / unit - PEN
    row = ABOVE + PEN - (np.arange(height) + 0.5) / unit
    ink = np.zeros((height, width), bool)
    for points in strokes:
        for start, end in pairwise(points):
            # A stroke reaches the pixels of its own box alone; a pixel more for the rounding.
            (x0, y0), (x1, y1) = np.minimum(start, end) - PEN, np.maximum(start, end) + PEN
            across = slice(max(math.floor((x0 + PEN) * unit) - 1, 0), math.ceil((x1 + PEN) * unit) + 1)
            down = slice(max(math.floor((ABOVE + PEN - y1) * unit) - 1, 0), math.ceil((ABOVE + PEN - y0) * unit) + 1)
            right, up = column[across] - start[0], (row[down] - start[1])[:, None]
            along = end - start
            share = np.clip((right * along[0] + up * along[1]) / max(float(along @ along), 1e-12), 0, 1)
            ink[down, across] |= np.hypot(right - share * along[0], up - share * along[1]) <= PEN
    return ink
