"""The one experiment that decides best between two rivals, in a sentence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from unitcad.cache import Store
from unitcad.experiments.information import Information
from unitcad.experiments.lab_file import LabFile, lab_of_specs
from unitcad.experiments.protocol import Ratio
from unitcad.experiments.ranking import singles
from unitcad.experiments.rivals import available
from unitcad.experiments.study import Step, candidates, check_two, predictions, range_of, span_text
from unitcad.spec import Spec

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
