"""What a lab can do: readings of a unit at a frequency on a body, and the ratios of two of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Literal

import numpy as np

Factor = Literal["unit", "frequency", "body"]


@dataclass(frozen=True)
class Condition:
    """Where a reading is taken: the unit's name, the frequency of the drive (Hz), the body's name."""

    unit: str
    frequency_hz: float
    body: str

    def __str__(self) -> str:
        return f"{self.unit} at {self.frequency_hz:g} Hz on {self.body}"


@dataclass(frozen=True)
class Ratio:
    """An experiment: the reading `above` over the reading `below`."""

    above: Condition
    below: Condition

    @property
    def changed(self) -> tuple[Factor, ...]:
        """What differs between the two readings."""
        pairs: tuple[tuple[Factor, bool], ...] = (
            ("unit", self.above.unit != self.below.unit),
            ("frequency", self.above.frequency_hz != self.below.frequency_hz),
            ("body", self.above.body != self.below.body),
        )
        return tuple(factor for factor, differs in pairs if differs)

    def __str__(self) -> str:
        a, b = self.above, self.below
        match self.changed:
            case ("unit",):
                return f"{a.unit} over {b.unit}, at {a.frequency_hz:g} Hz on {a.body}"
            case ("frequency",):
                return f"{a.unit} on {a.body}, at {a.frequency_hz:g} over {b.frequency_hz:g} Hz"
            case ("body",):
                return f"{a.unit} at {a.frequency_hz:g} Hz, on {a.body} over {b.body}"
        return f"{a} over {b}"


def ratios(conditions: Sequence[Condition], compare: Sequence[Factor]) -> tuple[Ratio, ...]:
    """Return every ratio of two conditions that differ in one of `compare` and in nothing else.

    The earlier condition is above, of two frequencies the higher one.
    """
    found = []
    for first, second in combinations(conditions, 2):
        higher_second = second.frequency_hz > first.frequency_hz
        ratio = Ratio(second, first) if higher_second else Ratio(first, second)
        if len(ratio.changed) == 1 and ratio.changed[0] in compare:
            found.append(ratio)
    return tuple(found)


def contrasts(chosen: Sequence[Ratio], conditions: Sequence[Condition]) -> np.ndarray:
    """Return the matrix (ratios, conditions) that makes log ratios of log readings: 1 above, -1 below."""
    at = {condition: i for i, condition in enumerate(conditions)}
    matrix = np.zeros((len(chosen), len(conditions)))
    for row, ratio in enumerate(chosen):
        matrix[row, at[ratio.above]] += 1.0
        matrix[row, at[ratio.below]] -= 1.0
    return matrix
