"""From a target to proposals as JSON-ready data: the best of each kind, judged, with what speaks for and against it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from unitcad.attenuation.crosstalk import RANGE as CROSSTALK_RANGE
from unitcad.attenuation.crosstalk import crosstalk_ratio
from unitcad.attenuation.edge.estimates import rounded
from unitcad.attenuation.edge.predictive import Stack, stack_of
from unitcad.casting.figures import MOST_ERROR_PCT, mix
from unitcad.catalogue import materials as silicones
from unitcad.catalogue import measurements
from unitcad.errors import Refusal
from unitcad.estimating import estimate_input
from unitcad.search.best_two import best_two
from unitcad.search.candidates import Candidates, candidates, probability_by_model
from unitcad.search.castability import Verdict, castability
from unitcad.search.geometries import Lengths, Say, spec_data
from unitcad.search.nearest_wish import check_possible
from unitcad.search.own_measurement import measured_rows, measurement
from unitcad.search.ranking_order import ALIKE, Kind, kinds
from unitcad.search.refinement import alone, refined
from unitcad.search.reliance import length_notes, reliance
from unitcad.search.target_file import Target
from unitcad.search.wishes import label, limits, within
from unitcad.spec import Spec
from unitcad.text import listed, number
from unitcad.validation import from_data, warnings

SHOWN = 5
LEAST_SHOWN = 0.005
"""A kind whose probability is smaller, 0.00 with two digits, is no proposal."""
TRIES = 3
"""Candidates of a kind that are judged until one can be cast."""


@dataclass(frozen=True)
class Inversion:
    """What was found: every candidate, the rows within the limits, the specs of the proposals, all as data.

    `measured`: the measurements of rows that were measured themselves.
    """

    found: Candidates
    rows: np.ndarray
    specs: tuple[Spec, ...]
    data: dict[str, Any]
    measured: dict[int, dict[str, Any]]


def invert(target: Target, check: bool = True, say: Say = lambda stage: None) -> Inversion:
    """Try everything at hand, and return the best with their reasons; without `check` no moulds are drawn.

    The same target gives the same data. Raises Refusal, with the nearest that is possible, where a limit or the level
    can't be met.
    """
    found = candidates(target, say)
    rows = within(found)
    measured = measured_rows(found, rows)
    check_possible(found, rows, measured)
    chosen, out = _chosen(found, _ranked(found, rows, measured), check, say)
    if not chosen:
        limit = f"none of the best can be cast: {out[0]['candidate']}: {out[0]['failed'][0]}"
        raise Refusal("at_hand.printer", target.asked.at_hand.printer, limit)
    specs = tuple(one.spec for one in chosen)
    say("what would decide between the best two")
    decides, decision = best_two(target, specs, [one.data for one in chosen])
    data = {
        "name": target.name,
        "wish": {key: value for key, value in _wish(target).items() if value is not None},
        "tried": {
            "candidates": found.count,
            "geometries": int(np.unique(found.geometry).size),
            "within_limits": int(rows.size),
            "refused": [
                {"what": what, "count": one.count, "first": one.first} for what, one in sorted(found.refused.items())
            ],
        },
        "models": models_block(target),
        "left_out": found.silicones.left_out,
        "proposals": [one.data for one in chosen],
        "not_castable": out,
        "decides": decides,
        "decision": decision,
    }
    return Inversion(found, rows, specs, rounded(data), measured_rows(found, np.arange(found.count)))


def models_block(target: Target) -> dict[str, Any]:
    """Return which models were stacked, with their weights, and by which units."""
    stack = stack_of(target.models, target.fit, target.asked.estimate.moduli)
    slow = ", by the moduli of a slow pull" if target.asked.estimate.moduli == "quasi-static" else ""
    by = f"the paper's nine levels{slow}" if target.fit is None else f"the lab's fit {target.fit.name}"
    weights = {model: float(weight) for model, weight in zip(stack.models, stack.weights, strict=True)}
    left_out = list(stack.left_out) if isinstance(stack, Stack) else [m for m in target.models if m not in weights]
    return {"weights": weights, "without_weight": left_out, "by": by}


@dataclass(frozen=True)
class _Chosen:
    spec: Spec
    data: dict[str, Any]


def _chosen(found: Candidates, ranked: list[Kind], check: bool, say: Say) -> tuple[list[_Chosen], list[dict[str, Any]]]:
    """Return the best of each kind that can be cast, at most `SHOWN`, and what was judged and fell out."""
    chosen: list[_Chosen] = []
    out: list[dict[str, Any]] = []
    for kind in ranked:
        if len(chosen) == SHOWN or (chosen and kind.most < LEAST_SHOWN):
            break
        say(f"{len(chosen) + 1} of {SHOWN}: {label(found, kind.best)}")
        tried = [(found, int(row)) for row in kind.rows[:TRIES]]
        if kind.most - kind.least > ALIKE and (better := refined(found, kind.best)):
            tried.insert(0, (better, 0))
        for table, row in tried:
            spec = from_data(spec_data(found.target, table.lengths(row), table.materials(row), name_of(table, row)))
            verdict = castability(spec) if check else Verdict(0, ())
            if verdict.castable:
                checked = verdict.checked if check else None
                data = proposal(table, row, spec, kind, len(chosen) + 1, checked, refined=table is not found)
                chosen.append(_Chosen(spec, data))
                break
            out.append({"name": spec.name, "candidate": label(table, row), "failed": list(verdict.failed)})
    chosen.sort(key=lambda one: one.data["nearest_other"])  # a refined one may have become a proposal
    return [replace(one, data={**one.data, "rank": i}) for i, one in enumerate(chosen, 1)], out


def _is_other(found: Candidates, probability: float, measured: Mapping[str, Any] | None) -> bool:
    """Tell whether a candidate is no proposal but one of the nearest others.

    It was measured outside the wish, or is less probable than is asked for and was not measured within it.
    """
    return not measured["meets"] if measured else probability < found.target.wish.probability_min


def _ranked(found: Candidates, rows: np.ndarray, measured: Mapping[int, Mapping[str, Any]]) -> list[Kind]:
    """Return the kinds in their order, those measured within the wish first, the nearest others last.

    A measured unit within the wish stands for its kind where the kind's best is less probable than is asked for.
    """
    least = found.target.wish.probability_min
    made = []
    for kind in kinds(found, rows):
        inside = [int(row) for row in kind.rows if measured.get(int(row), {}).get("meets")]
        if inside and found.probability[kind.best] < least:
            kind = replace(kind, rows=np.array([*inside, *(row for row in kind.rows if row not in inside)]))
        made.append(kind)

    def group(kind: Kind) -> int:
        own = measured.get(kind.best)
        return 2 if _is_other(found, float(found.probability[kind.best]), own) else 0 if own else 1

    return sorted(made, key=group)


def proposal(
    found: Candidates, row: int, spec: Spec, kind: Kind, rank: int, checked: int | None, refined: bool
) -> dict[str, Any]:
    """Return a candidate as data: what it is, its probability and range, its measurement, limits, what it relies on."""
    variant, lengths = estimate_input(spec), found.lengths(row)
    low, middle, high = (float(end[row]) for end in found.range)
    each, wish = probability_by_model(found.target, found.predictive), found.target.wish
    measured = measurement(found.target, variant)
    data: dict[str, Any] = {
        "rank": rank,
        "name": spec.name,
        "label": label(found, row),
        "design": lengths.design,
        "materials": list(found.materials(row)),
        "walls_mm": list(lengths.walls),
        "caps_mm": list(lengths.caps),
        "motor": lengths.motor,
        "measured": measured,
        "nearest_other": _is_other(found, float(found.probability[row]), measured),
        "probability_min": wish.probability_min,
        "probability": float(found.probability[row]),
        "by_model": dict(zip(found.predictive.models, map(float, each[row]), strict=True)),
        "edge": {"p10": low, "p50": middle, "p90": high},
        "diameter_mm": float(found.diameter_mm[row]),
        "height_mm": float(found.height_mm[row]),
        "mass_g": float(found.mass_g[row]),
        "cure_hours": float(found.hours[row]),
        "refined": refined,
        "within": [limit.shown(row) for limit in limits(found)],
        "checks": checked,
        "lengths_measured": not length_notes(found, lengths),
        "relies_on": reliance(found, row),
        "lengths_gain": _gain(kind, refined),
        "remarks": [*warnings(spec), *_scale(spec, found, row)],
    }
    if wish.pitch_mm is not None:
        ratio = crosstalk_ratio(variant, 1e-3 * wish.pitch_mm)
        data["crosstalk"] = {
            "value": ratio.value,
            "low": ratio.low,
            "high": ratio.high,
            "pitch_mm": wish.pitch_mm,
            "drive": variant.drive,
            "range": CROSSTALK_RANGE,
            "neighbour": (ratio.value or ratio.middle) * middle,
        }
        if wish.crosstalk_ratio_max is not None and (ratio.high or 0.0) > wish.crosstalk_ratio_max:
            data["remarks"].append(
                f"the crosstalk ratio may reach {number(ratio.high or 0.0, 2)}: the body's range goes over the limit"
            )
    if sibling := _sibling(found, row, data["measured"]):
        data["measured_sibling"] = sibling
    return data


def name_of(found: Candidates, row: int) -> str:
    """Return a candidate's name: its design, short names of silicones, walls."""
    short = {full: name.lower() for name, full in measurements().names.items()}
    lengths = found.lengths(row)
    parts = [lengths.design, *(short.get(name, name) for name in found.materials(row))]
    parts += [f"{wall:g}" for wall in lengths.walls]
    if lengths.caps and lengths.caps != lengths.walls:
        parts += ["caps", *(f"{cap:g}" for cap in lengths.caps)]
    if lengths.diameter != measurements().unit.diameter_mm:
        parts.append(f"d{lengths.diameter:g}")
    if len(found.target.asked.at_hand.motors) > 1:
        parts.append(lengths.motor.lower())
    return re.sub(r"[^a-z0-9.]+", "-", "-".join(parts).lower()).strip("-")[:110]


def _wish(target: Target) -> dict[str, Any]:
    return {key: getattr(target.wish, key) for key in target.wish.__struct_fields__}


def _sibling(found: Candidates, row: int, measured: dict[str, Any] | None) -> dict[str, Any] | None:
    """Return the measured unit of a candidate's kind where the candidate is not it: its level and probability."""
    lengths, shared, names = found.lengths(row), measurements().unit, found.materials(row)
    walls = (2 * shared.wall_mm / len(names),) * len(names)
    if measured or lengths.motor != shared.motor:
        return None
    there = Lengths(lengths.design, lengths.motor, walls, walls if lengths.caps else (), shared.diameter_mm)
    try:
        table = alone(found, there, names)
        spec = from_data(spec_data(found.target, there, names, "measured"))
    except Refusal:
        return None
    level = measurement(found.target, estimate_input(spec))
    return level and {**level, "label": label(table, 0), "probability": float(table.probability[0])}


def _gain(kind: Kind, refined: bool) -> str:
    """Say what the lengths change of a kind's probability; `refined`: the proposal lies between the steps."""
    if kind.rows.size < 2:
        return "its lengths are the only ones within the limits"
    of = f"{kind.rows.size} sets of lengths within the limits"
    if kind.most - kind.least < 1e-6:
        return f"lengths gain nothing: the probability is the same for all {of}"
    return f"lengths change the probability from {kind.least:.2f} to {kind.most:.2f} over the {of}" + (
        "; this one lies between the steps" if refined else ""
    )


def _scale(spec: Spec, found: Candidates, row: int) -> list[str]:
    """Say where the scale is too coarse for the smaller part of a pour's mix."""
    known = silicones(spec.materials)
    poor = [
        name
        for name in dict.fromkeys(found.materials(row))
        if mix(spec, known[name], 1.0).mix_error_pct > MOST_ERROR_PCT
    ]
    if not poor:
        return []
    digit = number(spec.casting.scale_resolution_g, 3)
    least = number(spec.casting.minimum_mix_g, 3)
    return [f"a scale of {digit} g is off by more than {MOST_ERROR_PCT:g} % on a part of {least} g of {listed(poor)}"]
