"""Why a named unit is not among the proposals, or where it stands: every reason, in the order of a target's tables."""

from __future__ import annotations

import itertools
import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from unitcad.attenuation.edge.estimates import rounded
from unitcad.attenuation.edge.predictive import stack_of
from unitcad.attenuation.edge.variant_units import stacked
from unitcad.attenuation.receivers import unit_mass
from unitcad.errors import Refusal, unknown_name
from unitcad.estimating import estimate_input
from unitcad.inverse.candidates import Candidates, probability_of
from unitcad.inverse.castability import castability
from unitcad.inverse.finish_time import finish_hours
from unitcad.inverse.geometries import height_of
from unitcad.inverse.proposals import Inversion, name_of
from unitcad.inverse.ranking_order import ordered
from unitcad.inverse.wishes import limits
from unitcad.spec import Spec
from unitcad.text import listed, number
from unitcad.validation import load, templates
from unitcad.validation.shipped_files import is_path


def explain(made: Inversion, named: str) -> dict[str, Any]:
    """Return {name, label, rank, probability, edge, reasons} of a candidate's name, a template or a spec file.

    `reasons` is empty for a unit that is among the proposals. Raises Refusal for a name that is none of these.
    """
    found = made.found
    rows = {name_of(found, row): row for row in range(found.count)}
    if named in rows:
        return rounded(_of_row(made, rows[named], named))
    if is_path(named) or named in templates() or os.path.isfile(named):
        return rounded(_of_spec(made, load(named)))
    raise unknown_name("--explain", named, [*(one["name"] for one in made.data["proposals"]), *templates(), *rows])


def _of_row(made: Inversion, row: int, name: str) -> dict[str, Any]:
    found, proposals = made.found, made.data["proposals"]
    reasons = []
    order = ordered(found, made.rows)
    place = np.flatnonzero(order == row)
    if next((one for one in proposals if one["name"] == name), None) is None:
        reasons += [f"over a limit: {limit.shown(row)}" for limit in limits(found) if not limit.met[row]]
        kind = [one for one in proposals if (one["design"], one["motor"], tuple(one["materials"])) == found.kind(row)]
        p = float(found.probability[row])
        if kind:
            words = _less(p, kind[0]["probability"], "relies on more that was not measured, or is heavier")
            reasons.append(
                f"{kind[0]['name']} is the best of its kind: it has {kind[0]['probability']:.2f}; this one {words}"
            )
        elif proposals:
            last = f"{proposals[-1]['name']}, has {proposals[-1]['probability']:.2f}"
            reasons.append(f"{len(proposals)} kinds come before it; the last of them, {last}")
        reasons += [f"can't be cast: {fault}" for fault in _faults(made, name)]
    low, middle, high = (float(end[row]) for end in found.range)
    return {
        "name": name,
        "rank": int(place[0]) + 1 if place.size else None,
        "of": int(made.rows.size),
        "probability": float(found.probability[row]),
        "edge": {"p10": low, "p50": middle, "p90": high},
        "reasons": reasons,
    }


def _of_spec(made: Inversion, spec: Spec) -> dict[str, Any]:
    """Explain a spec, which need not be made of what is at hand."""
    found = made.found
    reasons = [*_not_at_hand(found, spec), *_not_varied(found, spec)]
    data: dict[str, Any] = {
        "name": spec.name,
        "rank": None,
        "of": int(made.rows.size),
        "among": not reasons,
        "probability": None,
        "edge": None,
    }
    variant = estimate_input(spec, found.target.wish.frequency_hz)
    without = [layer for layer in variant.layers if layer.youngs_modulus.value is None]
    if without:
        names = listed(dict.fromkeys(layer.material for layer in without))
        reasons.append(f"{names}: {without[0].youngs_modulus.note}")
    else:
        stack = stack_of(found.target.models, found.target.fit, variant.moduli)
        predictive = stack.predictive(stacked([variant]))
        p = float(probability_of(found.target, predictive)[0])
        low, middle, high = (float(end[0]) for end in predictive.range)
        better = int(np.sum(found.probability[made.rows] > p + 1e-6))
        best = made.data["proposals"][0]
        data |= {"probability": p, "edge": {"p10": low, "p50": middle, "p90": high}, "rank": better + 1}
        if p < best["probability"] - 0.005:
            reasons.append(f"{best['name']} has a probability of {best['probability']:.2f}, this unit {p:.2f}")
    reasons += _over(found, spec, 1e3 * unit_mass(variant).middle)
    reasons += [f"can't be cast: {fault}" for fault in castability(spec).failed]
    return {**data, "reasons": reasons}


def _over(found: Candidates, spec: Spec, mass: float) -> list[str]:
    """Return the limits that a spec is over; the crosstalk's is left to its diameter."""
    wish = found.target.wish
    try:
        hours = finish_hours(spec)
    except Refusal:  # its moulds can't be made, which castability says
        hours = None
    values = [
        ("diameter", " mm", spec.diameter_mm, wish.diameter_max_mm),
        ("height", " mm", height_of(spec), wish.height_max_mm),
        ("mass", " g", mass, wish.mass_max_g),
        ("cure", " h", hours, wish.cure_hours_max),
        ("diameter, so that neighbours do not touch,", " mm", spec.diameter_mm, wish.pitch_mm),
    ]
    return [
        f"over a limit: {what} {number(value, 3)} of at most {number(most, 3)}{unit}"
        for what, unit, value, most in values
        if value is not None and most is not None and value > most * (1 + 1e-9)
    ]


def _not_at_hand(found: Candidates, spec: Spec) -> list[str]:
    target = found.target
    missing = [m for m in dict.fromkeys(layer.material for layer in spec.layers) if m not in target.materials]
    reasons = [f"not at hand: {listed(missing)}"] if missing else []
    if spec.design not in target.designs:
        reasons.append(f"the design {spec.design} is not among {listed(target.designs)}")
    if spec.motor.part not in target.asked.at_hand.motors:
        reasons.append(f"the motor {spec.motor.part or 'of its own size'} is not at hand")
    return reasons


def _not_varied(found: Candidates, spec: Spec) -> list[str]:
    vary, count = found.target.asked.vary, len(spec.layers)
    reasons = []
    if count not in vary.layers:
        reasons.append(f"vary.layers has no {count}")
    low, high = vary.wall_mm
    outside = [layer.wall_mm for layer in spec.layers if not low - 1e-9 <= layer.wall_mm <= high + 1e-9]
    if outside:
        reasons.append(f"vary.wall_mm goes from {low:g} to {high:g} mm, and a wall is {outside[0]:g}")
    tried = sorted({one.lengths.diameter for one in found.geometries})
    low, high = vary.diameter_mm or (tried[0], tried[-1])
    if not low - 1e-9 <= spec.diameter_mm <= high + 1e-9:
        span = f"{low:g}" if low == high else f"{low:g} to {high:g}"
        reasons.append(
            f"diameters of {span} mm are tried, and this one's is {spec.diameter_mm:g}: see vary.diameter_mm"
        )
    names = [layer.material for layer in spec.layers]
    if any(a == b for a, b in itertools.pairwise(names)):
        reasons.append("neighbouring layers are of one silicone, which is tried as one layer")
    return reasons


def _faults(made: Inversion, name: str) -> Sequence[str]:
    return [fault for one in made.data["not_castable"] if one["name"] == name for fault in one["failed"]]


def _less(p: float, best: float, else_: str) -> str:
    return f"has {p:.2f}" if p < best - 0.005 else f"has as much and {else_}"
