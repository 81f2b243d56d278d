"""From a target to proposals as JSON-ready data: the best of each kind, with moulds drawn, and with reasons."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from msgspec import structs

from unitcad.attenuation.curve import crosstalk_ratio
from unitcad.attenuation.edge.answer import answer
from unitcad.attenuation.edge.measured import measured_block
from unitcad.attenuation.edge.ranges import lead_of, own_block
from unitcad.attenuation.edge.words import first_line
from unitcad.attenuation.inputs import EstimateInput
from unitcad.catalogue import measurements
from unitcad.checks import check_moulds
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_input
from unitcad.json_text import rounded
from unitcad.moulds.mould_set import MouldSet
from unitcad.search.candidates import (
    Candidates,
    Say,
    candidates,
    check_possible,
    label,
    meets_level,
    within,
)
from unitcad.search.target_file import Target
from unitcad.spec import Spec
from unitcad.text import number
from unitcad.validation import warnings

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


def order_rows(found: Candidates, rows: np.ndarray) -> np.ndarray:
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
        by = "the paper" if len(variant.layers) > 1 else "the paper, which does not name the design"
    else:
        return None
    least, most = target.goals.edge_min or 0.0, target.goals.edge_max or np.inf
    return {"level": level, "also": also, "by": by, "meets": bool(least <= level <= most)}


def measured_rows(found: Candidates) -> dict[int, dict[str, Any]]:
    """Return the measurements of rows that were measured themselves, by row."""
    looked = range(found.count) if found.target.fit else np.flatnonzero(found.novelty == 0)
    every = ((int(row), measurement(found.target, found.variant(int(row)))) for row in looked)
    return {row: one for row, one in every if one}


SHOWN = 5
_TRIES = 3
"""Candidates of a kind that are judged until one can be cast."""
RANKS = "design and which side is soft"
NOT_RANKED = (
    "walls, caps, diameter, frequency, or silicones with the same side soft, except by an assumed line between equal "
    "silicones and the measured pairs"
)
"""The measured units do not tell these apart: another value only widens the range."""


@dataclass(frozen=True)
class Inversion:
    """The result: every candidate, the rows within the limits, the specs of the proposals, all as data.

    `measured`: the measurements of rows that were measured themselves.
    """

    found: Candidates
    rows: np.ndarray
    specs: tuple[Spec, ...]
    data: dict[str, Any]
    measured: dict[int, dict[str, Any]]


def invert(target: Target, check: bool = True, say: Say = lambda stage: None) -> Inversion:
    """Try everything at hand, and return the best with their reasons; without `check` no moulds are drawn.

    The same target gives the same data. Raises Refusal, with the nearest accepted values, if nothing meets the target.
    """
    found = candidates(target, say)
    rows, measured = within(found), measured_rows(found)
    check_possible(found, measured)
    ranked = kinds(found, rows[meets_level(found, measured)[rows]])
    ranked.sort(key=lambda kind: kind.best not in measured)
    chosen, out = _choose(found, ranked, check, say)
    if not chosen:
        limit = f"none of the best can be cast: {out[0]['candidate']}: {out[0]['failed'][0]}"
        raise Refusal("at_hand.printer", target.asked.at_hand.printer, limit)
    specs = tuple(spec for spec, _ in chosen)
    proposals = [{**one, "rank": i} for i, (_, one) in enumerate(chosen, 1)]
    for one in proposals:
        first = next(other for other in proposals if other["group"] == one["group"])
        one["equal_to"] = None if first is one else first["rank"]
    data = {
        "name": target.name,
        "target": {key: value for key, value in structs.asdict(target.goals).items() if value is not None},
        "tried": {
            "candidates": found.count,
            "geometries": int(np.unique(found.geometry).size),
            "within_limits": int(rows.size),
            "refused": [
                {"what": what, "count": len(why), "first": why[0]} for what, why in sorted(found.refused.items())
            ],
        },
        "leads": leads_block(target),
        "skipped": found.skipped,
        "proposals": proposals,
        "not_castable": out,
    }
    return Inversion(found, rows, specs, rounded(data), measured)


def leads_block(target: Target) -> dict[str, Any]:
    """Return the leading model, the units behind it, the keys that the evidence ranks and those that it does not."""
    slow = ", by the moduli of a slow pull" if target.asked.estimate.moduli == "quasi-static" else ""
    by = f"the paper's nine levels{slow}" if target.fit is None else f"the lab's fit {target.fit.name}"
    model = lead_of(target.asked.estimate.moduli, target.fit).model
    return {"model": model, "by": by, "ranks": RANKS, "does_not_rank": NOT_RANKED}


def _choose(
    found: Candidates, ranked: Sequence[Kind], check: bool, say: Say
) -> tuple[list[tuple[Spec, dict[str, Any]]], list[dict[str, Any]]]:
    """Return the best of each kind that can be cast, at most `SHOWN`, and the candidates that can't be cast."""
    chosen: list[tuple[Spec, dict[str, Any]]] = []
    out: list[dict[str, Any]] = []
    for kind in ranked:
        if len(chosen) == SHOWN:
            break
        say(f"{len(chosen) + 1} of {SHOWN}: {label(found, kind.best)}")
        for row in map(int, kind.rows[:_TRIES]):
            spec = found.spec(row, name_of(found, row))
            checked, failed = castability(spec) if check else (None, [])
            if not failed:
                chosen.append((spec, proposal(found, row, spec, kind, checked)))
                break
            out.append({"name": spec.name, "candidate": label(found, row), "failed": failed})
    return chosen, out


def castability(spec: Spec) -> tuple[int, list[str]]:
    """Draw the moulds of a spec; return how many places were checked, and a sentence with its code for each fault."""
    try:
        every = check_moulds(MouldSet(spec))
    except Refusal as refusal:
        return 0, [str(refusal)]
    failed = [one for one in every if not one.ok]
    return len(every), [
        f"{one.code} {one.where}: {one.value:.3g} against {one.limit:.3g} {one.unit}".rstrip() for one in failed
    ]


def proposal(found: Candidates, row: int, spec: Spec, kind: Kind, checked: int | None) -> dict[str, Any]:
    """Return a candidate as data: its kind, its probability and range, its measurement, unmeasured inputs."""
    variant, lengths, goals = estimate_input(spec), found.lengths(row), found.target.goals
    one, measured = answer(variant, found.target.fit), measurement(found.target, variant)
    data: dict[str, Any] = {
        "name": spec.name,
        "label": label(found, row),
        "design": lengths.design,
        "materials": list(found.materials(row)),
        "walls_mm": list(lengths.walls),
        "caps_mm": list(lengths.caps),
        "motor": lengths.motor,
        "measured": measured,
        "probability": float(found.probability[row]),
        "group": kind.group,
        "edge": {"level": one.level, "low": one.low, "high": one.high, "line": first_line(one)},
        "diameter_mm": float(found.diameter_mm[row]),
        "height_mm": float(found.height_mm[row]),
        "mass_g": float(found.mass_g[row]),
        "cure_hours": float(found.cure_hours[row]),
        "checks": checked,
        "lengths_measured": not found.novelty[row],
        "relies_on": list(one.wider),
        "lengths_gain": _gain(kind),
        "remarks": warnings(spec),
    }
    if goals.pitch_mm is not None:
        ratio = crosstalk_ratio(variant, 1e-3 * goals.pitch_mm)
        data["crosstalk"] = {
            "value": ratio.value,
            "low": ratio.low,
            "high": ratio.high,
            "pitch_mm": goals.pitch_mm,
            "neighbour": None if one.level is None else (ratio.value or ratio.middle) * one.level,
        }
        if goals.crosstalk_ratio_max is not None and (ratio.high or 0.0) > goals.crosstalk_ratio_max:
            data["remarks"].append(
                f"the crosstalk ratio may reach {number(ratio.high or 0.0, 2)}: the body's range goes over the limit"
            )
    return data


def name_of(found: Candidates, row: int) -> str:
    """Return a candidate's name: its design, short names of silicones, walls."""
    lengths, materials = found.lengths(row), found.materials(row)
    short = {full: name.lower() for name, full in measurements().names.items()}
    parts = [lengths.design, *(short.get(name, name) for name in materials)]
    parts += [f"{wall:g}" for wall in lengths.walls]
    if lengths.caps and lengths.caps != lengths.walls:
        parts += ["caps", *(f"{cap:g}" for cap in lengths.caps)]
    if lengths.diameter != measurements().unit.diameter_mm:
        parts.append(f"d{lengths.diameter:g}")
    if len(found.target.asked.at_hand.motors) > 1:
        parts.append(lengths.motor.lower())
    return re.sub(r"[^a-z0-9.]+", "-", "-".join(parts).lower()).strip("-")[:110]


def _gain(kind: Kind) -> str:
    """Say how lengths change a kind's probability."""
    if kind.rows.size < 2:
        return "no other lengths meet the target"
    return (
        f"{kind.rows.size} sets of lengths meet the target: the evidence does not rank them; the farther from "
        f"the measured ones, the wider the range (probability {kind.least:.2f} to {kind.most:.2f})"
    )
