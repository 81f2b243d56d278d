"""The one experiment that decides best, in a sentence: between two rival models, or between two candidate units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs
from scipy.special import ndtr, ndtri

from unitcad.attenuation.edge.lab_fit import LabFit
from unitcad.cache import Store
from unitcad.errors import Refusal
from unitcad.experiments.draws import Draws, Rival
from unitcad.experiments.information import Information, entropy, expected_information
from unitcad.experiments.lab_file import Lab, LabFile, lab_of_specs
from unitcad.experiments.protocol import Ratio
from unitcad.experiments.ranking import Predictions, singles
from unitcad.experiments.rivals import CLOSED_FORMS, available, of_lab
from unitcad.experiments.study import Step, candidates, check_two, predictions, range_of, span_text
from unitcad.spec import Spec
from unitcad.text import listed

USUAL = LabFile(units={}, frequencies_hz=[60.0, 125.0, 200.0], bodies=["rigid-plate", "gel-50kpa"])
"""What a lab can do where nothing else is said."""


@dataclass(frozen=True)
class Telling:
    """An experiment between two rivals: what it says about the two, of 1 bit, and the sentence."""

    ratio: Ratio
    information: Information
    sentence: str


def most_telling(
    rivals: tuple[str, str],
    specs: Mapping[str, Spec],
    settings: LabFile = USUAL,
    step: Step = lambda stage: None,
    store: Store | None = None,
) -> Telling:
    """Return the ratio of two readings that decides best between two rivals, with the units of `specs` by name.

    The rivals are names as in a lab's file; `settings` says at which frequencies, on which bodies and how well the lab
    measures (its units are not read). Raises Refusal and Missing as `study` does.
    """
    lab = lab_of_specs(specs, settings)
    asked = available(rivals, store, settings.smallest_um * 1e-6)
    check_two(asked)
    predicted = predictions(lab, asked.rivals, step)
    best = singles(predicted, candidates(lab, predicted), step)[0]
    ratio, found = best.ratios[0], best.information
    says = " and ".join(f"{name} {span_text(range_of(ratio, predicted, name))}" for name in rivals)
    sentence = (
        f"Measure {ratio}: {says} are what the two expect, and the ratio is worth {found.bits:.2f} ± {found.error:.2f} "
        "of the one bit between them."
    )
    return Telling(ratio, found, sentence)


SURE = 0.99
"""The probability of one order of two candidates above which no measurement is needed for it."""


@dataclass(frozen=True)
class Decision:
    """What a measurement of two candidates would decide.

    ratio         the first candidate's reading over the second's, each at its frequency and on its body
    predicted     of each rival {low, middle, high, unread} of the ratio: 10, 50 and 90 % of its draws
    first_higher  probability, before the measurement, that the first candidate's level is the higher one
    order         what the measurement says about that, in bits
    open_bits     what there is to say: the entropy of `first_higher`
    rivals        what the measurement says about which rival holds, in bits
    sentence      all of it for a person
    """

    ratio: Ratio
    predicted: dict[str, dict[str, float]]
    first_higher: float
    order: Information
    open_bits: float
    rivals: Information
    sentence: str


def decision_between(
    specs: Mapping[str, Spec],
    rivals: Sequence[str] | Mapping[str, float] = CLOSED_FORMS,
    settings: LabFile = USUAL,
    store: Store | None = None,
    fit: LabFit | None = None,
) -> Decision:
    """Return what measuring two candidate units, `specs` by name, would decide: which one has the higher level.

    Every candidate is read at the frequency and on the body of its own spec; of `settings` noise, discrepancy, draws,
    seed and modulus_factor count. The rivals are equally probable, or as probable as a mapping's weights say; one that
    has no answer for a candidate is left out. With a lab's `fit` its constants stand in for the draws held to the
    paper's levels. The closed forms, which are the default, take some 20 ms. Raises Refusal where there are not two
    specs, where a unit can't be estimated, and where no rival has an answer.
    """
    if len(specs) != 2:
        raise Refusal("specs", list(specs), "two candidates are compared")
    first, second = specs
    if fit:
        settings = structs.replace(settings, held_to_levels=False)
    lab = _on_their_own(specs, settings)
    ratio = Ratio(*lab.conditions)
    asked = available(tuple(rivals), store, settings.smallest_um * 1e-6).rivals
    asked = of_lab(asked, fit) if fit else asked
    answered = [rival for rival in asked if _answers(rival, lab)]
    if not answered:
        raise Refusal("rivals", list(rivals), f"none of them has an answer for {first} and {second}")
    predicted = predictions(lab, answered)
    if isinstance(rivals, Mapping):
        weights = np.array([rivals[name] for name in predicted.rivals])
        predicted = replace(predicted, weights=weights / weights.sum())
    order, higher = _about_order(predicted, ratio)
    open_bits = entropy(np.array([higher, 1.0 - higher]))
    spans = {name: range_of(ratio, predicted, name) for name in predicted.rivals}
    about_rivals = predicted.information([ratio])
    says = listed(f"{name} {span_text(span)}" for name, span in spans.items())
    above, sure = (first, higher) if higher >= 0.5 else (second, 1.0 - higher)
    if sure >= SURE:
        sentence = (
            f"No measurement is needed to order the two: {above} has the higher level with a probability of "
            f"{'more than 99' if sure > 0.995 else '99'} % by these models ({ratio}: {says})."
        )
    else:
        sentence = (
            f"Measure {ratio}: {says}; {above} has the higher level with a probability of {100 * sure:.0f} % by these "
            f"models, and the measurement says {order.bits:.2f} ± {order.error:.2f} of the {open_bits:.2f} bits that "
            "are open about it."
        )
    return Decision(ratio, spans, higher, order, open_bits, about_rivals, sentence)


def _on_their_own(specs: Mapping[str, Spec], settings: LabFile) -> Lab:
    """Return a lab with one reading of each spec, at its own frequency and on its own body."""
    variants = {}
    for name, spec in specs.items():
        own = structs.replace(settings, frequencies_hz=[spec.estimate.frequency_hz], bodies=[spec.estimate.tissue])
        variants.update(lab_of_specs({name: spec}, own).variants)
    return Lab("candidates", settings, variants)


def _answers(rival: Rival, lab: Lab) -> bool:
    """Tell whether a rival has an answer for every reading of a lab: two draws tell."""
    two = Draws(2, lab.settings.seed, rival.name)
    return all(bool(np.isfinite(np.log(rival.levels(variant, two))).all()) for variant in lab.variants.values())


def _about_order(predicted: Predictions, ratio: Ratio) -> tuple[Information, float]:
    """Return what a ratio's measurement says about the order of the true levels, and the prior P(first is higher).

    The true log ratio is a rival's prediction and its discrepancy; the measurement adds the noise of two readings.
    """
    logs, covariance = predicted.log_ratios([ratio])
    missed = replace(predicted, noise=0.0).log_ratios([ratio])[1][0, 0]
    draws = [Draws(len(log), predicted.seed, name) for name, log in zip(predicted.rivals, logs, strict=True)]
    off = [np.sqrt(missed) * ndtri(one.uniform("discrepancy")) for one in draws]
    true = np.concatenate([log[:, 0] + one for log, one in zip(logs, off, strict=True)])
    share = np.concatenate([w * s for w, s in zip(predicted.weights, predicted.shares, strict=True)])
    higher = float(share @ ndtr(np.concatenate(logs)[:, 0] / np.sqrt(missed))) if missed else share[true > 0].sum()
    sides = [true > 0, true <= 0]
    if min(np.count_nonzero(side) for side in sides) < 2:
        return Information(0.0, entropy(np.array([higher, 1.0 - higher])), 0.0), higher
    return expected_information(
        [true[side, None] for side in sides],
        covariance - missed,
        np.array([higher, 1.0 - higher]),
        [share[side] / share[side].sum() for side in sides],
        predicted.seed,
    ), higher
