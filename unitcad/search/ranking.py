"""The order of candidates: by probability; those that the evidence can't tell apart by how easily they are made."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from unitcad.attenuation.edge.measured import measured_block, nearest
from unitcad.attenuation.edge.ranges import own_block
from unitcad.attenuation.inputs import EstimateInput
from unitcad.search.candidates import Candidates
from unitcad.search.target_file import Target

EQUAL = 0.1
"""Probabilities that differ by less are equal: nine units don't tell them apart."""


@dataclass(frozen=True)
class Kind:
    """Candidates that differ only in lengths: their rows, best first, and the range of their probabilities.

    `group`: kinds of one number are equal in probability.
    """

    rows: np.ndarray
    least: float
    most: float
    group: int = 0

    @property
    def best(self) -> int:
        """The row of the best one."""
        return int(self.rows[0])


def ordered(found: Candidates, rows: np.ndarray) -> np.ndarray:
    """Return rows by their probability, equal ones by novelty, then by mass."""
    return rows[np.lexsort((rows, *_ease(found, rows)[:0:-1], -np.round(found.probability[rows], 6)))]


def _ease(found: Candidates, rows: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return sort keys, the first counts most: layers, lengths that nobody measured, hours, thinnest wall, mass."""
    layers = np.array([len(found.materials(row)) for row in rows])
    wall = np.array([min(found.lengths(row).walls) for row in rows])
    hours = np.nan_to_num(found.cure_hours[rows], nan=np.inf)
    return layers, found.novelty[rows], np.round(hours, 6), -wall, np.round(found.mass_g[rows], 6)


def kinds(found: Candidates, rows: np.ndarray) -> list[Kind]:
    """Return the kinds among rows, the most probable first; equal kinds, and equal rows of one, by ease."""
    by_kind: dict[object, list[int]] = {}
    for row in rows:
        by_kind.setdefault(found.kind(row), []).append(int(row))
    made = []
    for own in by_kind.values():
        at = np.array(own)
        p = found.probability[at]
        step = np.floor((p.max() - p) / EQUAL)
        order = np.lexsort((at, *_ease(found, at)[::-1], step))
        made.append(Kind(at[order], float(p.min()), float(p.max())))
    made.sort(key=lambda kind: (-kind.most, kind.best))
    groups, top = [], np.inf
    for kind in made:
        if kind.most <= top - EQUAL:
            top = kind.most
            groups.append([])
        groups[-1].append(replace(kind, group=len(groups)))
    for group in groups:
        best = np.array([kind.best for kind in group])
        order = np.lexsort((best, *_ease(found, best)[::-1]))
        group[:] = [group[i] for i in order]
    return [kind for group in groups for kind in group]


def unmeasured(variant: EstimateInput) -> list[str]:
    """Return the inputs in which a candidate differs from the nearest measured unit."""
    return nearest(variant)["differs_in"]


def measurement(target: Target, variant: EstimateInput) -> dict[str, Any] | None:
    """Return {level, also, by, meets} of this very unit, first in the lab; None if it was not measured.

    also: a second figure that the paper prints. meets: whether the level is within the target.
    """
    own = own_block(target.fit, variant) if target.fit else []
    block = measured_block(variant)
    if own:
        level, also, by = own[0]["value"], None, f"your lab ({own[0]['unit']})"
    elif block and block.get("same_size") and block["level"] is not None:
        level, also = block["level"], block.get("also_printed")
        by = "the paper" if len(variant.layers) > 1 else "the paper, of which design is not said"
    else:
        return None
    least, most = target.goals.edge_min or 0.0, target.goals.edge_max or np.inf
    return {"level": level, "also": also, "by": by, "meets": bool(least <= level <= most)}


def measured_rows(found: Candidates) -> dict[int, dict[str, Any]]:
    """Return the measurements of rows that were measured themselves, by row."""
    looked = range(found.count) if found.target.fit else np.flatnonzero(found.novelty == 0)
    every = ((int(row), measurement(found.target, found.variant(int(row)))) for row in looked)
    return {row: one for row, one in every if one}
