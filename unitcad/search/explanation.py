"""Why a named unit is not among the proposals, or where it stands: every reason, in the order of a target's tables."""

from __future__ import annotations

import itertools
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from msgspec.structs import replace

from unitcad.attenuation.crosstalk import crosstalk_ratio
from unitcad.attenuation.edge.estimates import rounded
from unitcad.attenuation.edge.predictive import stack_of
from unitcad.attenuation.edge.variant_units import MANY_LAYERS, MOST_LAYERS, stacked
from unitcad.attenuation.inputs import EstimateInput
from unitcad.attenuation.receivers import unit_mass
from unitcad.errors import Refusal, unknown_name
from unitcad.estimating import estimate_input
from unitcad.search.candidates import Candidates, probability_of
from unitcad.search.castability import castability
from unitcad.search.finish_time import finish_hours
from unitcad.search.geometries import height_of, spec_data
from unitcad.search.own_measurement import measurement
from unitcad.search.proposals import Inversion, name_of
from unitcad.search.ranking_order import ordered
from unitcad.search.wishes import limits
from unitcad.spec import Spec
from unitcad.text import listed, number
from unitcad.validation import from_data, load, templates
from unitcad.validation.shipped_files import is_path


def explain(made: Inversion, named: str) -> dict[str, Any]:
    """Return what is known of a proposal's or a candidate's name, a template or a spec file.

    {name, listed, nearest_other, rank, of, among, measured, probability_min, probability, edge, reasons}: `listed` is
    the unit's number in the list, None where it does not stand there; `reasons` is empty for a proposal. Raises Refusal
    for a name that is none of these.
    """
    found = made.found
    rows = {name_of(found, row): row for row in range(found.count)}
    if one := next((one for one in made.data["proposals"] if one["name"] == named), None):
        return rounded(_of_listed(made, one, rows.get(named), named))
    if named in rows:
        return rounded(_of_row(made, rows[named], named))
    if is_path(named) or named in templates() or os.path.isfile(named):
        return rounded(_of_spec(made, load(named)))
    raise unknown_name("--explain", named, [*(one["name"] for one in made.data["proposals"]), *templates(), *rows])


def _of_listed(made: Inversion, one: Mapping[str, Any], row: int | None, name: str) -> dict[str, Any]:
    """Explain a unit of the list; `row`: where it stands in the table, None for a refined one."""
    found, reasons = made.found, []
    if one["nearest_other"]:
        why = "was measured outside the wish" if one["measured"] else "is below the probability that is asked for"
        reasons.append(f"it is no proposal: it {why}, and stands among the nearest others as number {one['rank']}")
    place = None if row is None else _place(made, row)
    if row is None:
        place = int(np.sum(found.probability[made.rows] > one["probability"] + 1e-6)) + 1
    shown = {key: one[key] for key in ("measured", "probability_min", "probability", "edge", "nearest_other")}
    listed_as = {"name": name, "listed": one["rank"], "rank": place, "of": int(made.rows.size), "among": True}
    return {**listed_as, **shown, "reasons": reasons}


def _place(made: Inversion, row: int) -> int | None:
    at = np.flatnonzero(ordered(made.found, made.rows) == row)
    return int(at[0]) + 1 if at.size else None


def _of_row(made: Inversion, row: int, name: str) -> dict[str, Any]:
    """Explain a candidate that is not on the list; `name`: its own, or that of a spec which is this unit."""
    found, proposals = made.found, made.data["proposals"]
    reasons = [f"over a limit: {limit.shown(row)}" for limit in limits(found) if not limit.met[row]]
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
    reasons += [f"can't be cast: {fault}" for fault in _faults(made, name_of(found, row))]
    low, middle, high = (float(end[row]) for end in found.range)
    return {
        "name": name,
        "listed": None,
        "nearest_other": False,
        "rank": _place(made, row),
        "of": int(made.rows.size),
        "among": True,
        "measured": made.measured.get(row),
        "probability_min": found.target.wish.probability_min,
        "probability": p,
        "edge": {"p10": low, "p50": middle, "p90": high},
        "reasons": reasons,
    }


def _of_spec(made: Inversion, spec: Spec) -> dict[str, Any]:
    """Explain a spec, which may be a unit of the list or of the table, and need not be made of what is at hand."""
    found = made.found
    cast = [f"can't be cast: {fault}" for fault in castability(spec).failed]
    alike = _alike(found, spec)
    row = next((row for row in alike if _same_unit(spec, _spec_of(found, row))), None)
    for one, own in zip(made.data["proposals"], made.specs, strict=True):
        if _same_unit(spec, own):
            data = _of_listed(made, one, row, spec.name)
            return {**data, "reasons": [*data["reasons"], *cast]}
    if row is not None:
        data = _of_row(made, row, spec.name)
        return {**data, "reasons": list(dict.fromkeys([*data["reasons"], *cast]))}
    reasons = [*_not_at_hand(found, spec), *_not_varied(found, spec)]
    if alike and not reasons:
        reasons.append(f"not tried: it has the lengths of {name_of(found, alike[0])}, with another motor or circuit")
    elif not reasons:
        reasons.append("not tried: its lengths lie between the steps, see vary.step_mm")
    variant = estimate_input(spec, found.target.wish.frequency_hz)
    data: dict[str, Any] = {
        "name": spec.name,
        "listed": None,
        "nearest_other": False,
        "rank": None,
        "of": int(made.rows.size),
        "among": False,
        "measured": measurement(found.target, variant),
        "probability_min": found.target.wish.probability_min,
        "probability": None,
        "edge": None,
    }
    without = [layer for layer in variant.layers if layer.youngs_modulus.value is None]
    if len(variant.layers) > MOST_LAYERS:
        reasons.append(f"no level: {MANY_LAYERS}")
    elif without:
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
    reasons += [*_over(found, spec, variant), *cast]
    return {**data, "reasons": reasons}


def _alike(found: Candidates, spec: Spec) -> list[int]:
    """Return the rows of a spec's design, silicones and lengths."""
    names = tuple(layer.material for layer in spec.layers)
    if spec.design not in found.target.designs or names not in found.sequences:
        return []
    walls = [layer.wall_mm for layer in spec.layers]
    of = [i for i, one in enumerate(found.geometries) if one.lengths.design == spec.design]
    own = [
        i
        for i in of
        if len(found.geometries[i].lengths.walls) == len(walls)
        and np.allclose(found.geometries[i].lengths.walls, walls, atol=1e-9)
        and abs(found.geometries[i].lengths.diameter - spec.diameter_mm) < 1e-9
    ]
    return [int(row) for row in np.flatnonzero(np.isin(found.geometry, own)) if found.materials(int(row)) == names]


def _spec_of(found: Candidates, row: int) -> Spec:
    return from_data(spec_data(found.target, found.lengths(row), found.materials(row)))


def _same_unit(one: Spec, other: Spec) -> bool:
    """Tell whether two specs are one unit; moulds, casting and how the level is estimated may differ."""

    def unit(spec: Spec) -> tuple[object, ...]:
        entries = [spec.materials.get(layer.material) for layer in spec.layers]
        motor = spec.motors.get(spec.motor.part or "")
        return spec.design, spec.diameter_mm, spec.layers, spec.motor, spec.fpcb, spec.wires, entries, motor

    return unit(one) == unit(other)


def _over(found: Candidates, spec: Spec, variant: EstimateInput) -> list[str]:
    """Return the limits that a spec is over; the crosstalk is on the target's body, none where neighbours overlap."""
    wish, body, crosstalk = found.target.wish, found.geometries[0].variant, None
    if wish.crosstalk_ratio_max is not None and wish.pitch_mm is not None and spec.diameter_mm <= wish.pitch_mm + 1e-9:
        on_body = replace(variant, tissue_name=body.tissue_name, tissue=body.tissue)
        crosstalk = crosstalk_ratio(on_body, 1e-3 * wish.pitch_mm, spread=False).middle
    try:
        hours = finish_hours(spec)
    except Refusal:  # its moulds can't be made, which castability says
        hours = None
    values = [
        ("diameter", " mm", spec.diameter_mm, wish.diameter_max_mm),
        ("height", " mm", height_of(spec), wish.height_max_mm),
        ("mass", " g", 1e3 * unit_mass(variant).middle, wish.mass_max_g),
        ("cure", " h", hours, wish.cure_hours_max),
        ("crosstalk ratio", "", crosstalk, wish.crosstalk_ratio_max),
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
    low, high = vary.walls(count)
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
