"""The answer of an estimate in a few sentences: the level to go by, its error, what is not known. Levels in per cent.

The level to go by is a measurement of this very unit where there is one. Otherwise it is that of the model with the
least error on units that it was not fitted to: the paper's nine, or those of the lab's own fit.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from unitcad.attenuation.edge.fitted_models import assessments
from unitcad.attenuation.edge.lab_fit import LabFit
from unitcad.attenuation.edge.measured_levels import Moduli
from unitcad.attenuation.edge.predictive import Predictive
from unitcad.text import listed, number

_WORDS = {
    "wall_mm": "walls",
    "cap_mm": "caps",
    "youngs_modulus_kpa": "moduli",
    "density_g_cm3": "densities",
    "poisson_ratio": "Poisson's ratios",
    "loss_factor": "loss factors",
    "diameter_mm": "diameter",
    "motor.diameter_mm": "motor's diameter",
    "motor.thickness_mm": "motor's height",
    "motor mass": "motor's mass",
    "fpcb.pad_diameter_mm": "circuit's pad",
    "fpcb.thickness_mm": "circuit's thickness",
    "estimate.frequency_hz": "frequency",
}
_LAYER = re.compile(r"layers\.\d+\.(\w+)")
NULL = "A null of two constants, the softer layer inside or not,"
PAPER = "the paper"
"""Who measured the catalogue's levels."""
QUASI_STATIC = (
    "Moduli of a slow pull, not at the motor's frequency: the constants and all errors are those of the nine units "
    "with such moduli."
)
SKIN_MM = (5, 10, 20)
"""Distances from the edge that the sentence on the skin names."""


def answer(
    estimated: dict[str, Any], expected: Predictive | None, unlike: Sequence[str] = (), held: int | None = None
) -> dict[str, Any]:
    """Return the answer of an estimate (`estimates.estimate`) as data; `lines` say it, the level first.

    `level`, and p10 to p90 of the distribution `expected` over the models with `weights`, are fractions of the motor's
    amplitude; None where no number can be given. `typical_error` and `worst_error` are factors with the unit left out;
    a lab's fit has no worst one. `better_null`: the models that two constants beat, `null_error` how far these are off.
    `unlike`, kept as `not_measured`, names what of the unit no measured one had: there no error is known. `held`: how
    many of the nine measured units lay in their ranges from p10 to p90, each predicted without the unit.
    """
    models, errors = estimated["models"], _errors(estimated)
    order = _order(estimated, errors)
    best = next((name for name in order if _middle(models[name]["edge_level"]) is not None), None)
    block = models[best] if best else None
    low, median, high = _points(expected)
    typical, worst, worst_at = errors[best] if best else (None, None, None)
    null = errors["null"][0]
    beaten = [name for name in order if errors[name][0] > null]
    data = {
        "model": best,
        "level": block and block["edge_level"]["value"],
        "low": block and block["edge_level"]["low"],
        "high": block and block["edge_level"]["high"],
        "p10": low,
        "p50": median,
        "p90": high,
        "weights": {}
        if low is None or expected is None
        else dict(zip(expected.models, expected.weights.tolist(), strict=True)),
        "typical_error": typical,
        "worst_error": worst,
        "worst_at": worst_at,
        "held": held,
        "not_measured": list(unlike),
        "measured": _measured(estimated),
        "not_seen": _unread(block),
        "null_error": null,
        "better_null": beaten,
    }
    return {**data, "lines": list(_lines(estimated, data, order, errors))}


def _points(expected: Predictive | None) -> tuple[float | None, float | None, float | None]:
    """Return the level's 10, 50 and 90 % points; None where an input is not known."""
    if expected is None or not np.all(np.isfinite(expected.centre)):
        return None, None, None
    low, median, high = (float(one[0]) for one in expected.range)
    return low, median, high


def typical_errors(fit: LabFit | None = None, moduli: Moduli = "dynamic") -> dict[str, float]:
    """Return each model's typical factor with the unit left out: on the lab's units, else on the paper's nine.

    Without a fit by `moduli`.
    """
    if fit:
        return {name: one.left_out for name, one in fit.model.items()}
    return {name: one.left_out.geometric_mean for name, one in assessments(moduli).items()}


def percent(level: float) -> str:
    """Return a fraction in per cent, with two digits."""
    return f"{number(100 * level, 2, zeros=True)} %"


def _range(low: float, high: float) -> str:
    """Return two fractions as a range in per cent; one number where both round to the same."""
    first, last = percent(low), percent(high)
    return last if first == last else f"{first.removesuffix(' %')} to {last}"


Error = tuple[float, float | None, str | None]
"""Typical factor with the unit left out, the worst one, and the unit that has it."""


def _errors(estimated: dict[str, Any]) -> dict[str, Error]:
    """Return each model's error and the null's: those of the lab's fit where there is one."""
    if fit := estimated.get("fit"):
        return {name: (one["geometric_mean"], None, None) for name, one in fit["left_out"].items()}
    table = estimated["table_error"]
    scores = {name: table[name]["leave_one_unit_out"]["levels"] for name in table["order"]}
    return {name: (one["geometric_mean"], one["worst"], one["worst_at"]) for name, one in scores.items()}


def _slow_pull(estimated: dict[str, Any]) -> bool:
    """Return whether the errors are those of the paper's units by quasi-static moduli."""
    return estimated["table_error"]["moduli"] == "quasi-static" and "fit" not in estimated


def _order(estimated: dict[str, Any], errors: dict[str, Error]) -> list[str]:
    """Return the models, the least error first; those of a constant on its bound or of another drive last."""
    models, at_bound = estimated["models"], estimated.get("fit", {}).get("at_bound", {})
    return sorted(
        models, key=lambda name: ("not_of_this_drive" in models[name], name in at_bound, round(errors[name][0], 3))
    )


def _middle(level: dict[str, Any]) -> float | None:
    """Return a level's value, or an end of its range where it has no value."""
    return level["value"] if level["value"] is not None else level["low"]


def _measured(estimated: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the measurements of this very unit, the lab's own ones first."""
    own = [
        {"level": one["value"], "low": one["low"], "high": one["high"], "by": one["unit"]}
        for one in estimated.get("own_measured", ())
    ]
    found = estimated["measured"] or {}
    if found.get("same_size"):
        printed = [found[key] for key in ("level", "also_printed") if found.get(key) is not None]
        own += [{"level": level, "low": None, "high": None, "by": PAPER} for level in printed]
    return own


def _unread(block: dict[str, Any] | None) -> list[str]:
    """Name what a model does not read, in words: what it reads of no layer in one word, the body in one."""
    seen: dict[str, Any] = (block or {}).get("inputs_seen") or {}
    if not seen.get("not_seen"):
        return []
    names: list[str] = []
    for name in seen["not_seen"]:
        layer = _LAYER.fullmatch(name)
        key = layer[1] if layer else name
        read = layer and any(other.endswith(f".{key}") for other in seen["by"] if _LAYER.fullmatch(other))
        names.append("body" if name.startswith("tissue ") else name if read or key not in _WORDS else _WORDS[key])
    return list(dict.fromkeys(names))


def _lines(
    estimated: dict[str, Any], data: dict[str, Any], order: list[str], errors: dict[str, Error]
) -> Iterator[str]:
    yield _first(estimated, data)
    found = estimated["measured"] or {}
    if found.get("differs_in") and found.get("level") is not None:
        printed = [found[key] for key in ("level", "also_printed") if found.get(key) is not None]
        levels = listed(number(100 * level, 3) for level in printed)
        at = f"{number(found['diameter_mm'])} mm and {number(found['frequency_hz'])} Hz"
        yield f"Measured in the paper at {at}: {levels} %; this unit differs in {listed(found['differs_in'])}."
    if _slow_pull(estimated):
        yield QUASI_STATIC
    for name, constant in estimated.get("fit", {}).get("at_bound", {}).items():
        yield f"{name}: the fit's {constant} lies on the bound of its search, the units do not determine it."
    if data["not_seen"]:
        yield f"{data['model']} does not read: {', '.join(data['not_seen'])}."
    others = [name for name in order if name != data["model"]]
    if data["model"] and others:
        levels = {name: _level(estimated["models"][name]["edge_level"]) for name in others}
        yield f"Other models: {'; '.join(f'{name} {levels[name]} ({_how(name, data, errors)})' for name in others)}."
    yield from _skin(estimated["layered"])


def _first(estimated: dict[str, Any], data: dict[str, Any]) -> str:
    """Say the level, its error, and what was measured."""
    expected = _expected(estimated, data)
    if not data["measured"]:
        return expected or "No model gives a level."
    first, *others = data["measured"]
    by: dict[str, list[str]] = {}
    for one in others:
        by.setdefault(_where(one), []).append(_spread(one))
    also = f" (also {listed(f'{listed(levels)} {where}' for where, levels in by.items())})" if others else ""
    return f"{_spread(first)} of the motor's amplitude at the edge, measured {_where(first)}{also}. {expected}".strip()


def _spread(one: dict[str, Any]) -> str:
    ends = f" ({number(100 * one['low'], 3)} to {number(100 * one['high'], 3)})" if one["low"] is not None else ""
    return f"{number(100 * one['level'], 3)} %{ends}"


def _where(one: dict[str, Any]) -> str:
    return f"in {PAPER}" if one["by"] == PAPER else f"on {one['by']}"


def _expected(estimated: dict[str, Any], data: dict[str, Any]) -> str:
    model = data["model"]
    if model is None:
        reasons = [block["edge_level"].get("reason") for block in estimated["models"].values()]
        return "; ".join(dict.fromkeys(f"Not known: {reason}" for reason in reasons if reason))
    level = _level(estimated["models"][model]["edge_level"])
    at = (
        f"The model {model} expects {level}"
        if data["measured"]
        else f"{level} of the motor's amplitude at the edge, by {model}"
    )
    off = f"{model} was typically off by a factor of {number(data['typical_error'], 2)}"
    worst = f", at worst {number(data['worst_error'], 2)}" if data["worst_error"] else ""
    whose = f"the units of the fit {estimated['fit']['name']}" if "fit" in estimated else "the nine measured units"
    whose += " by moduli of a slow pull" if _slow_pull(estimated) else ""
    null = f" {NULL} does better: x {number(data['null_error'], 2)}." if model in data["better_null"] else ""
    new = data["not_measured"]
    here = f" None of them is like this one in {listed(new)}: how far off {model} is here is not known." if new else ""
    return f"{at}.{_likely(data)} {off}{worst} on {whose}, each left out.{null}{here}"


def _likely(data: dict[str, Any]) -> str:
    """Say the range of the models together, whose they are, and how often such ranges held."""
    if data["p10"] is None:
        return ""
    held = f" ({data['held']} of the nine measured units lay in theirs)" if data["held"] is not None else ""
    return f" The 80 % range by {listed(data['weights'])} is {_range(data['p10'], data['p90'])}{held}."


def _how(name: str, data: dict[str, Any], errors: dict[str, Error]) -> str:
    """Say a model's typical factor, and the null's where that is smaller."""
    typical = f"x {number(errors[name][0], 2)}"
    worse = f", worse than the null's x {number(data['null_error'], 2)}" if name in data["better_null"] else ""
    return f"{typical}{worse}"


def _level(level: dict[str, Any]) -> str:
    if level["value"] is not None:
        return percent(level["value"])
    if level["low"] is None:
        return "not known"
    return _range(level["low"], level["high"])


def _skin(layered: dict[str, Any]) -> Iterator[str]:
    """Say how the skin's motion decays beyond the edge."""
    drive = (layered.get("drives") or {}).get(layered.get("drive"))
    if drive is None:
        return
    places = [(r, layered["r_mm"].index(r)) for r in SKIN_MM if r in layered["r_mm"]]
    told = [f"{percent(drive['u']['value'][i])} after {r} mm" for r, i in places]
    yield f"On the skin ({layered['tissue']}), of the motion at the edge: {listed(told)}."
