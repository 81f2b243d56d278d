"""Why a named unit is not among the proposals, or where it stands."""

from __future__ import annotations

import itertools
import os
from collections.abc import Mapping
from typing import Any

import numpy as np
from msgspec import structs

from unitcad.attenuation.edge.estimates import rounded
from unitcad.attenuation.edge.variant_units import MANY_LAYERS, MOST_LAYERS
from unitcad.errors import unknown_name
from unitcad.estimating import estimate_input
from unitcad.search.candidates import Candidates, Geometry, Lengths, tabulate
from unitcad.search.limits import limits
from unitcad.search.proposals import Inversion, castability, name_from, name_of
from unitcad.search.ranking import measurement, ordered
from unitcad.spec import Spec
from unitcad.text import listed
from unitcad.validation import load, templates
from unitcad.validation.shipped_files import is_path


def explain(made: Inversion, named: str) -> dict[str, Any]:
    """Return the answer for the name of a proposal or a candidate, a template or a spec file.

    {name, listed, nearest_other, rank, of, among, measured, probability_min, probability, edge, reasons}: `listed` is
    the unit's number in the list, None if it is not listed; `reasons` is empty for a proposal. Raises Refusal for any
    other name.
    """
    found = made.found
    rows = {name_of(found, row): row for row in range(found.count)}
    listed_names = [one["name"] for one in made.data["proposals"]]
    if named in rows or named in listed_names:
        return rounded(_of_name(made, named, rows.get(named)))
    if not (is_path(named) or named in templates() or os.path.isfile(named)):
        raise unknown_name("--explain", named, [*listed_names, *templates(), *rows])
    spec = load(named)
    faults = [f"can't be cast: {fault}" for fault in castability(spec)[1]]
    own = next((one for one in made.specs if _is_same_unit(spec, one)), None)
    names = [layer.material for layer in spec.layers]
    name = own.name if own else name_from(found.target, _lengths(spec), names)
    if own or (name in rows and _is_same_unit(spec, found.spec(rows[name]))):
        data = {**_of_name(made, name, rows.get(name)), "name": spec.name}
    else:
        data = _of_spec(made, spec, name if name in rows else None)
    return rounded({**data, "reasons": list(dict.fromkeys([*data["reasons"], *faults]))})


def _of_name(made: Inversion, name: str, row: int | None) -> dict[str, Any]:
    """Explain a candidate of the table or, without a row, a proposal between the grid's steps."""
    found, proposals, reasons = made.found, made.data["proposals"], []
    one = next((one for one in proposals if one["name"] == name), None)
    if one:
        if one["nearest_other"]:
            why = "was measured outside the wish" if one["measured"] else "is below the probability that is asked for"
            reasons.append(f"it is no proposal: it {why}, and stands among the nearest others as number {one['rank']}")
        level = {key: one[key] for key in ("nearest_other", "probability", "edge")}
        data = _data(made, name, one["measured"], listed=one["rank"], **level)
    else:
        assert row is not None
        reasons += [f"over a limit: {limit.shown(row)}" for limit in limits(found) if not limit.met[row]]
        kind = [one for one in proposals if (one["design"], one["motor"], tuple(one["materials"])) == found.kind(row)]
        if kind:
            reasons.append(f"{kind[0]['name']} is the best of its kind: it has {kind[0]['probability']:.2f}")
        else:
            last = f"{proposals[-1]['name']}, has {proposals[-1]['probability']:.2f}"
            reasons.append(f"{len(proposals)} kinds come before it; the last of them, {last}")
        out = [one["failed"] for one in made.data["not_castable"] if one["name"] == name]
        reasons += [f"can't be cast: {fault}" for failed in out for fault in failed]
        data = _data(made, name, made.measured.get(row), **_level(found, row))
    place = _place(made, data["probability"])
    if row is not None:
        at = np.flatnonzero(ordered(found, made.rows) == row)
        place = int(at[0]) + 1 if at.size else None
    return {**data, "rank": place, "among": True, "reasons": reasons}


def _of_spec(made: Inversion, spec: Spec, alike: str | None) -> dict[str, Any]:
    """Explain a spec that is no candidate; `alike`: the candidate of its lengths, with another motor or circuit."""
    found, reasons = made.found, _not_tried(made.found, spec)
    if not reasons:
        other = f"it has the lengths of {alike}, with another motor or circuit"
        reasons.append(f"not tried: {other if alike else 'its lengths lie between the steps, see vary.step_mm'}")
    variant, body = estimate_input(spec, found.target.wish.frequency_hz), found.geometries[0].variant
    data = _data(made, spec.name, measurement(found.target, variant))
    if len(variant.layers) > MOST_LAYERS:
        return {**data, "reasons": [*reasons, f"no level: {MANY_LAYERS}"]}
    unknown = [layer for layer in variant.layers if layer.youngs_modulus.value is None]
    if unknown:
        names = listed(dict.fromkeys(layer.material for layer in unknown))
        return {**data, "reasons": [*reasons, f"{names}: {unknown[0].youngs_modulus.note}"]}
    on_body = structs.replace(variant, tissue_name=body.tissue_name, tissue=body.tissue)
    silicones, names = {layer.material: layer for layer in variant.layers}, tuple(one.material for one in spec.layers)
    table = tabulate(found.target, [Geometry(_lengths(spec), spec, on_body)], silicones, only=names)
    p, best = float(table.probability[0]), made.data["proposals"][0]
    if p < best["probability"] - 0.005:
        reasons.append(f"{best['name']} has a probability of {best['probability']:.2f}, this unit {p:.2f}")
    reasons += [f"over a limit: {limit.shown(0)}" for limit in limits(table) if not limit.met[0]]
    return {**data, **_level(table, 0), "rank": _place(made, p), "reasons": reasons}


def _data(made: Inversion, name: str, measured: Mapping[str, Any] | None, **level: Any) -> dict[str, Any]:
    least, of = made.found.target.wish.probability_min, int(made.rows.size)
    empty = {"listed": None, "nearest_other": False, "rank": None, "probability": None, "edge": None, "among": False}
    return {"name": name, "of": of, "measured": measured, "probability_min": least, **empty, **level}


def _level(table: Candidates, row: int) -> dict[str, Any]:
    edge = {name: float(end[row]) for name, end in zip(("p10", "p50", "p90"), table.range, strict=True)}
    return {"probability": float(table.probability[row]), "edge": edge}


def _place(made: Inversion, probability: float) -> int:
    return int(np.sum(made.found.probability[made.rows] > probability + 1e-6)) + 1


def _lengths(spec: Spec) -> Lengths:
    caps = tuple(layer.cap_mm for layer in spec.layers if layer.cap_mm)
    walls = tuple(layer.wall_mm for layer in spec.layers)
    return Lengths(spec.design, spec.motor.part or "", walls, caps, spec.diameter_mm)


def _is_same_unit(one: Spec, other: Spec) -> bool:
    """Tell whether two specs are one unit; moulds, casting and how the level is estimated may differ."""

    def unit(spec: Spec) -> tuple[object, ...]:
        entries = [spec.materials.get(layer.material) for layer in spec.layers]
        motor = spec.motors.get(spec.motor.part or "")
        return spec.design, spec.diameter_mm, spec.layers, spec.motor, spec.fpcb, spec.wires, entries, motor

    return unit(one) == unit(other)


def _not_tried(found: Candidates, spec: Spec) -> list[str]:
    """Return why the target does not try a spec."""
    target, vary, count = found.target, found.target.asked.vary, len(spec.layers)
    names, reasons = [layer.material for layer in spec.layers], []
    if missing := [name for name in dict.fromkeys(names) if name not in target.materials]:
        reasons.append(f"not at hand: {listed(missing)}")
    if spec.design not in target.designs:
        reasons.append(f"the design {spec.design} is not among {listed(target.designs)}")
    if spec.motor.part not in target.asked.at_hand.motors:
        reasons.append(f"the motor {spec.motor.part or 'of its own size'} is not at hand")
    if count not in vary.layers:
        reasons.append(f"vary.layers has no {count}")
    low, high = vary.walls(count)
    if outside := [layer.wall_mm for layer in spec.layers if not low - 1e-9 <= layer.wall_mm <= high + 1e-9]:
        reasons.append(f"vary.wall_mm goes from {low:g} to {high:g} mm, and a wall is {outside[0]:g}")
    low, high = vary.diameter_mm or (float(found.diameter_mm.min()), float(found.diameter_mm.max()))
    if not low - 1e-9 <= spec.diameter_mm <= high + 1e-9:
        reasons.append(f"diameters from {low:g} to {high:g} mm are tried (vary.diameter_mm), not {spec.diameter_mm:g}")
    if any(a == b for a, b in itertools.pairwise(names)):
        reasons.append("neighbouring layers are of one silicone, which is tried as one layer")
    return reasons
