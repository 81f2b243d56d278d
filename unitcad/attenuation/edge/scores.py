"""Stored constants and scores of the models on the paper's nine units: scores.json, which `scoring` makes."""

from __future__ import annotations

from functools import cache
from importlib.resources import files

import msgspec

from unitcad.attenuation.edge.measured import Moduli
from unitcad.json_text import parse_message

FILE = "scores.json"
MODULI: tuple[Moduli, ...] = ("small-strain", "quasi-static")


class Factor(msgspec.Struct, frozen=True):
    """Geometric-mean and worst factor error of a set of figures (1 is exact), and which one is the worst."""

    geometric_mean: float
    worst: float
    worst_at: str
    count: int


class Range(msgspec.Struct, frozen=True):
    """Ends of the score over units drawn again with replacement, in the scores' percent."""

    low: float
    high: float


class ModelScore(msgspec.Struct, frozen=True):
    """A model against the table. `directions`: of how many ratios to a control the side of 1 is right.

    `leave_one_out`: each unit predicted by constants fitted without it; its ratios: None if no constant is in them.
    """

    levels: Factor
    ratios: Factor
    directions: int
    leave_one_out: Factor
    leave_one_out_range: Range
    leave_one_out_ratios: Factor | None = None


class ChosenWithout(msgspec.Struct, frozen=True):
    """The rule's score if its form is chosen without the unit too, among `forms`, and the form chosen for each unit."""

    score: Factor
    range: Range
    forms: list[str]
    chosen: list[str]


class LeadScore(msgspec.Struct, frozen=True):
    """The model that leads: standard deviation of its left-out residuals, ln(measured/model) of each unit.

    `common_slope`: standard error of d ln level / d place over the one-material units; `contrast_slope`: root mean
    square of the slope between units that differ in one silicone. `coverage`: how many units lie in their 80 % range,
    predicted without them.
    """

    model: str
    sigma: float
    residuals: list[float]
    common_slope: float
    contrast_slope: float
    coverage: int


class Scores(msgspec.Struct, frozen=True):
    """Everything that an estimate reads of the comparison with the nine units, by moduli of one kind."""

    constants: dict[str, dict[str, float]]
    lead: LeadScore
    order: list[str]
    models: dict[str, ModelScore]
    chosen_without: ChosenWithout
    by_class: dict[str, dict[str, float]]
    percent: tuple[float, float]


@cache
def _stored() -> dict[str, Scores]:
    return parse_message((files("unitcad.attenuation.edge") / FILE).read_bytes(), dict[str, Scores], FILE)


def scores(moduli: Moduli = "small-strain") -> Scores:
    """Return the stored scores by such moduli."""
    return _stored()[moduli]
