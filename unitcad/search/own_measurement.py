"""The level that was measured of a candidate itself, and whether it lies within what is wished for."""

from __future__ import annotations

from typing import Any

import numpy as np

from unitcad.attenuation.edge.lab_fit import own_block
from unitcad.attenuation.edge.paper_units import measured_block
from unitcad.attenuation.inputs import EstimateInput
from unitcad.catalogue import measurements
from unitcad.estimating import estimate_input
from unitcad.search.candidates import Candidates
from unitcad.search.geometries import spec_data
from unitcad.search.ranking_order import novelty
from unitcad.search.target_file import Target
from unitcad.validation import from_data

_LOOKED_UP = 50
"""Of candidates with lengths that the paper did not measure, so many of the best are looked up in a lab's fit."""


def measurement(target: Target, variant: EstimateInput) -> dict[str, Any] | None:
    """Return {level, also, by, meets, note} of this very unit, in the lab first; None where it was not measured.

    also: a second figure that the paper prints. meets: whether the level is within the wish.
    """
    own = own_block(target.fit, variant) if target.fit else []
    if own:
        level = own[0]["value"]
        return {"level": level, "also": None, "by": f"your lab ({own[0]['unit']})", "meets": meets(target, level)}
    block = measured_block(variant)
    if not block or not block.get("same_size") or block["level"] is None:
        return None
    level, also = block["level"], block.get("also_printed")
    by = "the paper" if len(variant.layers) > 1 else "the paper, of which design is not said"
    return {"level": level, "also": also, "by": by, "meets": meets(target, level)}


def meets(target: Target, level: float) -> bool:
    """Tell whether a measured level is within the wish."""
    least, most = target.wish.edge_min, target.wish.edge_max
    return (least is None or level >= least) and (most is None or level <= most)


def measured_rows(found: Candidates, rows: np.ndarray) -> dict[int, dict[str, Any]]:
    """Return the measurements of rows that were measured themselves, by row."""
    names = set(measurements().names.values())
    looked = [
        int(row)
        for row in rows[novelty(found)[rows] == 0]
        if found.lengths(row).motor == measurements().unit.motor and names.issuperset(found.materials(row))
    ]
    if found.target.fit:
        looked += [int(row) for row in rows[np.argsort(-found.probability[rows], kind="stable")][:_LOOKED_UP]]
    known = {}
    for row in dict.fromkeys(looked):
        spec = from_data(spec_data(found.target, found.lengths(row), found.materials(row)))
        if one := measurement(found.target, estimate_input(spec)):
            known[row] = one
    return known
