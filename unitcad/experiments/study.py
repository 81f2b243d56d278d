"""From a lab to the ranked experiments as JSON-ready data, and the sentence that says what would settle it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from unitcad.cache import Store
from unitcad.errors import Missing, Refusal
from unitcad.experiments.conditioning import FEW, Held, drawn
from unitcad.experiments.draws import Rival
from unitcad.experiments.lab_file import Lab
from unitcad.experiments.protocol import Ratio, ratios
from unitcad.experiments.range_plot import BELOW, is_below
from unitcad.experiments.ranking import Predictions, Ranked, best_sets, singles
from unitcad.experiments.rivals import Available, available

LARGEST_SET = 3
SIGNIFICANT_DIGITS = 6
RANGE = (0.1, 0.5, 0.9)
"""Parts of the draws that lie below the low end, the middle and the high end of what a rival predicts."""
LEAST_BITS = 0.005
"""What is shown as 0.00 bits lies below."""
NAMED = 3
"""Experiments that are named beside the first one where the errors do not tell them apart."""
Step = Callable[[str], None]


def study(lab: Lab, step: Step = lambda stage: None, store: Store | None = None) -> dict[str, Any]:
    """Return {lab, rivals, left_out, most_bits, experiments, sets, settles, ...} as JSON-ready data.

    `store` keeps the solutions of finite elements. The same lab gives the same numbers. Raises Refusal where fewer than
    two rivals or no ratio is left, Missing where that is for want of a library.
    """
    asked = available(lab.settings.rivals, store, lab.settings.smallest_um * 1e-6)
    check_two(asked)
    predicted = predictions(lab, asked.rivals, step)
    prior = predicted.most_bits
    predicted = predicted.updated(lab.measured)
    ranked = singles(predicted, candidates(lab, predicted), step)
    sets = best_sets(predicted, ranked, LARGEST_SET, step)
    return {
        "lab": lab.name,
        "noise": lab.settings.noise,
        "discrepancy": lab.settings.discrepancy,
        "draws": lab.settings.draws,
        "element_draws": lab.settings.element_draws,
        "seed": lab.settings.seed,
        "held_to_levels": lab.settings.held_to_levels,
        "rivals": _rivals(asked, predicted),
        "left_out": asked.left_out,
        "few_draws": few_draws(predicted),
        "measured": [{"experiment": str(ratio), "ratio": value} for ratio, value in lab.measured],
        "most_bits_before": _number(prior),
        "most_bits": _number(predicted.most_bits),
        "experiments": [_experiment(one, predicted) for one in ranked],
        "sets": [_set(one) for one in sets],
        "settles": settles(sets, predicted, ranked),
    }


def check_two(asked: Available) -> None:
    """Check that two rivals are left. Raises Missing where others lack a library, else Refusal."""
    names = [rival.name for rival in asked.rivals]
    if len(names) < 2 and asked.left_out:
        others = "; ".join(f"{name} {reason}" for name, reason in asked.left_out.items())
        raise Missing(f"two rivals or more are needed, {' and '.join(names) or 'none'} can be asked here: {others}")
    if len(names) < 2:
        raise Refusal("rivals", names, "two rivals or more are needed")


def predictions(lab: Lab, rivals: Sequence[Rival], step: Step = lambda stage: None) -> Predictions:
    """Return what each rival predicts for every condition of a lab.

    Each rival's draws are held to the measured levels first, unless the lab's settings say otherwise. Conditions are
    left out for which a rival has no finite answer. Raises Refusal where fewer than two conditions remain.
    """
    settings, logs, unread = lab.settings, [], []
    held = tuple(drawn(rival, settings, step) for rival in rivals)
    for rival, draws in zip(rivals, (one.draws for one in held), strict=True):
        columns = []
        for i, (condition, variant) in enumerate(lab.variants.items()):
            step(f"{rival.name}: {condition} ({i + 1} of {len(lab.variants)})")
            columns.append(rival.levels(variant, draws))
        logs.append(np.log(np.stack(columns, axis=-1)))
        read_all = np.zeros(len(draws.indices), dtype=bool)
        below = [rival.unread(variant, draws) if rival.unread else read_all for variant in lab.variants.values()]
        unread.append(np.stack(below, axis=-1))
    finite = np.all([np.isfinite(log).all(axis=0) for log in logs], axis=0)
    if finite.sum() < 2:
        raise Refusal("units", list(settings.units), "the rivals have an answer for fewer than two readings")
    return Predictions(
        tuple(rival.name for rival in rivals),
        tuple(condition for condition, kept in zip(lab.conditions, finite, strict=True) if kept),
        tuple(log[:, finite] for log in logs),
        settings.noise,
        settings.discrepancy,
        settings.seed,
        shares=tuple(one.shares for one in held),
        unread=tuple(one[:, finite] for one in unread),
        indices=tuple(np.array(one.draws.indices) for one in held),
        held=held,
    )


def candidates(lab: Lab, predicted: Predictions) -> list[Ratio]:
    """Return the ratios that a lab could measure and has not. Raises Refusal where there is none."""
    known = {ratio for ratio, _ in lab.measured}
    found = [ratio for ratio in ratios(predicted.conditions, lab.settings.compare) if ratio not in known]
    if not found:
        raise Refusal("compare", lab.settings.compare, "the lab has no two readings that differ in one of these alone")
    return found


def _rivals(asked: Available, predicted: Predictions) -> list[dict[str, Any]]:
    rows = zip(asked.rivals, predicted.weights, predicted.effective_draws, predicted.held, strict=True)
    return [
        {
            "name": rival.name,
            "says": rival.says,
            "costly": rival.costly,
            "probability": _number(weight),
            "effective_draws": _number(draws),
            "held": _held(held),
        }
        for rival, weight, draws, held in rows
    ]


def _held(held: Held) -> dict[str, float] | None:
    if held.effective is None or held.misses is None:
        return None
    return {
        "pool": held.draws.count,
        "effective_draws": _number(held.effective),
        "kept": len(held.draws.indices),
        "misses": _number(held.misses),
    }


def few_draws(predicted: Predictions) -> list[str]:
    """Return a line for each rival whose predictions stand on too few draws, with what makes them few."""
    lines = []
    for name, left, weight, held in zip(
        predicted.rivals, predicted.effective_draws, predicted.weights, predicted.held, strict=True
    ):
        pooled = left if held.effective is None else min(left, held.effective)
        if pooled < FEW and weight > 0.01:
            lines.append(
                f"{name}: what is measured leaves {pooled:.1f} effective draws of {held.draws.count}, so that its "
                "predictions are little known; more draws may help"
            )
    return lines


def range_of(ratio: Ratio, predicted: Predictions, rival: str) -> dict[str, float]:
    """Return {low, middle, high, unread} of a ratio: 10, 50 and 90 % of a rival's draws, without a reading's errors.

    unread: the share of the draws in which one of the two readings is below what the lab can read.
    """
    at = predicted.rivals.index(rival)
    log, share = predicted.log_ratios([ratio])[0][at][:, 0], predicted.shares[at]
    order = np.argsort(log)
    below = np.cumsum(share[order]) - share[order] / 2.0
    ends = np.exp(np.interp(RANGE, below, log[order]))
    ends_of = [predicted.conditions.index(end) for end in (ratio.above, ratio.below)]
    unread = float(share @ predicted.unread[at][:, ends_of].any(axis=1))
    return dict(zip(("low", "middle", "high", "unread"), map(_number, (*ends, unread)), strict=True))


def span_text(span: Mapping[str, float]) -> str:
    """Return a predicted ratio with its range; in words where half of the draws or more can't be read."""
    if is_below(span):
        return BELOW
    low, middle, high = (f"{span[end]:.3g}" for end in ("low", "middle", "high"))
    return middle if low == high else f"{middle} ({low} to {high})"


def _experiment(one: Ranked, predicted: Predictions) -> dict[str, Any]:
    ratio = one.ratios[0]
    return {
        "experiment": str(ratio),
        "changed": ratio.changed[0],
        **{
            end: {"unit": c.unit, "frequency_hz": c.frequency_hz, "body": c.body}
            for end, c in (("above", ratio.above), ("below", ratio.below))
        },
        **_bits(one),
        "predicted": {name: range_of(ratio, predicted, name) for name in predicted.rivals},
    }


def _set(one: Ranked) -> dict[str, Any]:
    return {
        "experiments": [str(ratio) for ratio in one.ratios],
        **_bits(one),
        "not_told_apart": [{"rivals": [a, b], "bits": _number(bits)} for a, b, bits in one.open],
    }


def _bits(one: Ranked) -> dict[str, float]:
    found = one.information
    return {
        "bits": _number(found.bits),
        "error": _number(found.error),
        "low": _number(found.low),
        "high": _number(found.high),
        "standard_error": _number(found.standard_error),
    }


def tells(bits: float, error: float) -> bool:
    """Tell whether a figure of bits says anything: it is above its error, and not shown as 0.00."""
    return bits > error and bits >= LEAST_BITS


def equals(ranked: Sequence[Ranked]) -> list[Ranked]:
    """Return the others of a ranking that say as much as the first, within the two errors (root of their squares)."""
    first = ranked[0].information
    return [
        one
        for one in ranked[1:]
        if first.bits - one.information.bits <= np.hypot(first.error, one.information.error)
        and tells(one.information.bits, one.information.error)
    ]


def _ties(ranked: Sequence[Ranked]) -> str:
    """Say which other experiments may be as good a first one."""
    others = equals(ranked)
    if not others:
        return ""
    named = "; ".join(f"{one.ratios[0]} ({one.information.bits:.2f})" for one in others[:NAMED])
    more = f"; and {len(others) - NAMED} more" if len(others) > NAMED else ""
    return f" Within the errors it says no more than {named}{more}."


def settles(sets: Sequence[Ranked], predicted: Predictions, ranked: Sequence[Ranked]) -> str:
    """Say in a few sentences what to measure, what may be as good, and what is still open after it."""
    first, last = sets[0], sets[-1]
    most = predicted.most_bits
    if not any(tells(one.information.bits, one.information.error) for one in sets):
        found = last.information
        return (
            f"Nothing here tells these rivals apart: the best measurements say {found.bits:.2f} ± {found.error:.2f} of "
            f"{most:.2f} bits."
        )
    text = f"Measure first {first.ratios[0]}: {first.information.bits:.2f} ± {first.information.error:.2f} "
    text += f"of {most:.2f} bits.{_ties(ranked)}"
    if len(sets) > 1:
        rest = "; then ".join(str(ratio) for ratio in last.ratios[1:])
        text += f" Then {rest}: {last.information.bits:.2f} bits together."
    if not last.open:
        return f"{text} After that every pair of rivals is told apart by half a bit or more."
    pairs = ", ".join(f"{a} and {b}" for a, b, _ in last.open[:3])
    more = f" and {len(last.open) - 3} more pairs" if len(last.open) > 3 else ""
    return f"{text} That still does not tell apart {pairs}{more}."


def _number(value: float) -> float:
    return float(f"{value:.{SIGNIFICANT_DIGITS}g}")
