"""The reason why a named unit is no proposal, or its rank."""

from __future__ import annotations

import itertools
import os
from typing import Any

import numpy as np
from msgspec import structs

from unitcad.attenuation.edge.estimates import rounded
from unitcad.errors import unknown_name
from unitcad.estimate_inputs import estimate_input
from unitcad.search.candidates import Candidates, Geometry, Lengths, tabulate
from unitcad.search.limits import limits
from unitcad.search.proposals import Inversion, castability, name_from, name_of
from unitcad.search.ranking import measurement
from unitcad.spec import Spec
from unitcad.text import listed
from unitcad.validation import load, templates
from unitcad.validation.shipped_files import is_path


def explain(made: Inversion, named: str) -> dict[str, Any]:
    """Return the answer for the name of a proposal or a candidate, a template or a spec file.

    {name, listed, nearest_other, rank, of, among, measured, probability_min, probability, edge, reasons}: `listed` is
    the unit's number in the list, None if it is not listed; `among`: whether it was tried; `reasons` is empty for a
    proposal. Raises Refusal for any other name.
    """
    found, proposals = made.found, made.data["proposals"]
    target, specs = found.target, {spec.name: spec for spec in made.specs}
    rows = {name_of(found, row): row for row in range(found.count)}
    if named in specs or named in rows:
        spec = specs.get(named) or found.spec(rows[named], named)
    elif is_path(named) or named in templates() or os.path.isfile(named):
        spec = load(named)
    else:
        raise unknown_name("--explain", named, [*specs, *templates(), *rows])
    own = next((one for one in proposals if _is_same_unit(spec, specs[one["name"]])), None)
    silicones = tuple(layer.material for layer in spec.layers)
    alike = name_from(target, _lengths(spec), silicones)
    among = own is not None or (alike in rows and _is_same_unit(spec, found.spec(rows[alike])))
    variant = estimate_input(spec, target.goals.frequency_hz)
    data: dict[str, Any] = {
        "name": spec.name,
        "listed": own and own["rank"],
        "nearest_other": bool(own and own["nearest_other"]),
        "of": int(made.rows.size),
        "among": among,
        "measured": measurement(target, variant),
        "probability_min": target.goals.probability_min,
        "probability": own and own["probability"],
        "edge": own and own["edge"],
    }
    reasons = [] if among else _not_tried(found, spec, alike if alike in rows else None)
    unknown = [layer for layer in variant.layers if layer.youngs_modulus.value is None]
    if own and own["nearest_other"]:
        why = "was measured outside the target" if own["measured"] else "is below the probability that is asked for"
        reasons.append(f"it is no proposal: it {why}, and is among the nearest others as number {own['rank']}")
    elif unknown:
        names = listed(dict.fromkeys(layer.material for layer in unknown))
        reasons.append(f"{names}: {unknown[0].youngs_modulus.note}")
    elif not own:
        body = found.geometries[0].variant
        on_body = structs.replace(variant, tissue_name=body.tissue_name, tissue=body.tissue)
        known = {layer.material: layer for layer in variant.layers}
        table = tabulate(target, [Geometry(_lengths(spec), spec, on_body)], known, only=silicones)
        p = data["probability"] = float(table.probability[0])
        data["edge"] = {name: float(end[0]) for name, end in zip(("p10", "p50", "p90"), table.range, strict=True)}
        reasons += [f"over a limit: {limit.shown(0)}" for limit in limits(table) if not limit.met[0]]
        kind = (spec.design, spec.motor.part, list(silicones))
        best = next((one for one in proposals if (one["design"], one["motor"], one["materials"]) == kind), None)
        last = proposals[-1]
        if best and best["probability"] >= p - 1e-6:
            reasons.append(f"{best['name']} is the best of its kind: it has {best['probability']:.2f}")
        elif p <= last["probability"]:
            others = f"{len(proposals)} kinds come before it; the last of them"
            reasons.append(f"{others}, {last['name']}, has {last['probability']:.2f}")
    reasons += [f"can't be cast: {fault}" for fault in castability(spec)[1]]
    level = data["probability"]
    place = None if level is None else int(np.sum(found.probability[made.rows] > level + 1e-6)) + 1
    return rounded({**data, "rank": place, "reasons": reasons})


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


def _not_tried(found: Candidates, spec: Spec, alike: str | None) -> list[str]:
    """Return why the target does not try a spec; `alike`: the candidate of its lengths and silicones."""
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
    other = f"it has the lengths of {alike}, with another motor or circuit"
    between = f"not tried: {other if alike else 'its lengths are between the steps, see vary.step_mm'}"
    return reasons or [between]
