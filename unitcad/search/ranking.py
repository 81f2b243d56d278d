"""The order of candidates: by probability, then by the number of their inputs that no measured unit had."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from unitcad.attenuation.edge.lab_fit import own_block
from unitcad.attenuation.edge.paper_units import measured_block, unlike_measured
from unitcad.attenuation.inputs import EstimateInput
from unitcad.search.candidates import Candidates
from unitcad.search.target_file import Target
from unitcad.text import listed

ALIKE = 0.02
"""Between probabilities that differ by less, the number of unmeasured inputs decides: no model knows them better."""
_BLIND = {
    "crossings": ("walls", "caps", "diameter", "frequency"),
    "fitted": ("walls", "caps", "diameter", "frequency"),
    "bush": ("frequency",),
    "paper": ("caps", "diameter"),
    "consistent": ("caps", "diameter"),
}
"""The inputs that a model does not read."""


@dataclass(frozen=True)
class Kind:
    """Candidates that differ only in lengths: their rows, best first, and the range of their probabilities."""

    rows: np.ndarray
    least: float
    most: float

    @property
    def best(self) -> int:
        """The row of the best one."""
        return int(self.rows[0])


def novelty(found: Candidates) -> np.ndarray:
    """Return the number of inputs of each row that no measured unit had; silicones do not count."""
    counts = [len(set(unlike_measured(one.variant)) - {"silicones"}) for one in found.geometries]
    return np.array(counts)[found.geometry]


def ordered(found: Candidates, rows: np.ndarray) -> np.ndarray:
    """Return rows by their probability, equal ones by novelty, then by mass."""
    p, new = found.probability[rows], novelty(found)[rows]
    return rows[np.lexsort((rows, np.round(found.mass_g[rows], 6), new, -np.round(p, 6)))]


def kinds(found: Candidates, rows: np.ndarray) -> list[Kind]:
    """Return the kinds among rows, the best first.

    In a kind, rows within `ALIKE` of the best are ordered by novelty.
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
        key=lambda kind: (-round(found.probability[kind.best], 2), len(unmeasured(found, kind.best)), kind.best),
    )


def unmeasured(found: Candidates, row: int) -> list[str]:
    """Return the inputs of a candidate that no measured unit had, together with the models that do not read them."""
    variant, models = found.variant(row), found.predictive.models
    names = unlike_measured(variant)
    by_blind: dict[tuple[str, ...], list[str]] = {}
    for name in names:
        by_blind.setdefault(tuple(model for model in models if name in _BLIND.get(model, ())), []).append(name)
    notes = []
    for blind, own in by_blind.items():
        unread = (
            "" if not blind else f" (not read by {'any model here' if len(blind) == len(models) else listed(blind)})"
        )
        notes.append(f"{listed(own)}{unread}")
    if not {"number of layers", "design", "silicones"} & set(names) and measured_block(variant) is None:
        notes.append("these silicones in this order in this design")
    return notes


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
    looked = range(found.count) if found.target.fit else np.flatnonzero(novelty(found) == 0)
    every = ((int(row), measurement(found.target, found.variant(int(row)))) for row in looked)
    return {row: one for row, one in every if one}
