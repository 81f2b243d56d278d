"""In which order candidates stand: by probability, then by how much they rely on that was not measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.search.candidates import Candidates
from unitcad.search.reliance import length_notes, reliance

ALIKE = 0.02
"""Between probabilities that differ by less, what a candidate relies on decides: no model knows them better."""


@dataclass(frozen=True)
class Kind:
    """Candidates that differ in lengths alone: their rows, best first, and the range of their probabilities."""

    rows: np.ndarray
    least: float
    most: float

    @property
    def best(self) -> int:
        """The row of the best one."""
        return int(self.rows[0])


def novelty(found: Candidates) -> np.ndarray:
    """Return how many kinds of length (walls, caps, diameter) of each row are not as in the measured units."""
    counts = [len(length_notes(found, one.lengths)) for one in found.geometries]
    return np.array(counts)[found.geometry]


def ordered(found: Candidates, rows: np.ndarray) -> np.ndarray:
    """Return rows by their probability, equal ones by what they rely on, then by mass."""
    p, new = found.probability[rows], novelty(found)[rows]
    return rows[np.lexsort((rows, np.round(found.mass_g[rows], 6), new, -np.round(p, 6)))]


def kinds(found: Candidates, rows: np.ndarray) -> list[Kind]:
    """Return the kinds among rows, the best first.

    Of a kind those within `ALIKE` of its best stand first, by what they rely on and by mass.
    """
    by_kind: dict[object, list[int]] = {}
    for row in rows:
        by_kind.setdefault(found.kind(row), []).append(int(row))
    new, made = novelty(found), []
    for own in by_kind.values():
        at = np.array(own)
        p = found.probability[at]
        step = np.floor((p.max() - p) / ALIKE)
        order = np.lexsort((at, np.round(found.mass_g[at], 6), new[at], step))
        made.append(Kind(at[order], float(p.min()), float(p.max())))
    return sorted(
        made,
        key=lambda kind: (-round(found.probability[kind.best], 2), len(reliance(found, kind.best)), kind.best),
    )


def front(found: Candidates, rows: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the rows that no other one beats in both: a higher probability and a smaller value; by rising value."""
    order = rows[np.lexsort((rows, -found.probability[rows], values[rows]))]
    kept, best = [], -1.0
    for row in order:
        if found.probability[row] > best + 1e-9:
            kept.append(row)
            best = found.probability[row]
    return np.array(kept, dtype=int)
