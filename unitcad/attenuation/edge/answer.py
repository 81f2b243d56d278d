"""The answer of an estimate: the level at a unit's edge with its 80 % range, next to the measurement of that unit.

`answer` returns the one object that every command, table and page prints; `words` has its sentences. A level is a
fraction of the motor's amplitude. It is the leading model's middle, never the measurement, so that two answers are
compared model against model.
"""

from __future__ import annotations

import math
from typing import Any

import msgspec
import numpy as np

from unitcad.attenuation.edge.level import NO_PASSES, edge_level
from unitcad.attenuation.edge.measured import (
    CLASSES,
    LENGTHS,
    coordinates_of,
    differing,
    lengths,
    measured_block,
    measured_table,
    nearest,
    nominal,
    stack_inputs,
    unit_class,
)
from unitcad.attenuation.edge.models import BASELINE, stored
from unitcad.attenuation.edge.ranges import LabFit, Lead, lead_of, own_block
from unitcad.attenuation.edge.scores import scores
from unitcad.attenuation.inputs import EstimateInput
from unitcad.text import number

PAPER = "the paper"
"""Who measured the catalogue's levels."""
WIDEST, MOST = 100.0, 2.0
"""Largest factor between the ends of a range, and its largest end, at which a level is stated."""
_NOTICED = 0.002
"""An input that widens a range by a smaller share is not named."""


class Measured(msgspec.Struct, frozen=True):
    """A measurement of this very unit, with its 95 % interval if there is one; `by`: the paper, or the lab's unit."""

    level: float
    low: float | None
    high: float | None
    by: str


class Nearest(msgspec.Struct, frozen=True):
    """The measured unit that is nearest, and how this unit differs from it."""

    unit: str
    level: float
    differs_in: tuple[str, ...]


class ModelLevel(msgspec.Struct, frozen=True):
    """A level by another model: no value if an input is a range, nothing but the reason if one is not known."""

    value: float | None
    low: float | None
    high: float | None
    reason: str = ""


class Source(msgspec.Struct, frozen=True):
    """The model behind a level and the units that it is fitted to; `lab`: the fit's name, None for the paper's nine.

    `units`: of the paper's nine, or of the fit's own lab; `of_others`: of other labs in that fit.

    Errors are leave-one-out factors, typical and worst; `baseline`: of the means of four classes. `coverage`: how many
    of the nine units lie in their own range, predicted without them.
    """

    model: str
    units: int
    lab: str | None
    of_others: int
    with_paper: bool
    error: float
    worst: float | None
    worst_at: str | None
    baseline: float
    coverage: int | None


class Answer(msgspec.Struct, frozen=True):
    """The level at a unit's edge and its 80 % range, fractions of the motor's amplitude.

    level, low, high   None if the level is not known; only the level is None if the range is too wide to state one
    reason             why there is no level
    wider              the inputs that widen the range, the strongest first: no measured unit had them
    measured           measurements of this very unit, the paper's or the lab's own; a second figure after the first
    elsewhere          the paper's measurement, if a lab's fit leads
    above              the highest measured level, if the range goes beyond it
    printed            what the paper prints of this unit without a level: a share of a control, a direction
    analytic           the paper's model by this unit's moduli, as published and corrected, and its error
    """

    level: float | None
    low: float | None
    high: float | None
    reason: str
    wider: tuple[str, ...]
    measured: tuple[Measured, ...]
    elsewhere: tuple[Measured, ...]
    above: float | None
    printed: dict[str, Any]
    nearest: Nearest
    kind: str
    kind_mean: float
    published: ModelLevel
    corrected: ModelLevel
    analytic_error: float
    source: Source


def answer(variant: EstimateInput, fit: LabFit | None = None) -> Answer:
    """Return the answer for a unit, by the paper's nine units or by a lab's fit."""
    lead = lead_of(variant.moduli, fit)
    found = lead.predictive(stack_inputs([variant]), lengths([variant]))
    low, level, high = (float(end[0]) for end in found.range)
    known = bool(np.isfinite([low, level, high]).all())
    wide = known and (high > WIDEST * low or high > MOST)
    printed = measured_block(variant) or {}
    kind = CLASSES[int(unit_class(nominal(variant))[0])]
    behind = [unit.value for unit in fit.measured] if fit else []
    if fit is None or fit.include_paper_units:
        behind.append(float(measured_table(variant.moduli).levels.max()))
    return Answer(
        level=level if known and not wide else None,
        low=low if known else None,
        high=high if known else None,
        reason="the range is too wide" if wide else "" if known else _reason(variant),
        wider=tuple(_wider(lead, variant)) if known else (),
        measured=_of_paper(printed) if fit is None else _of_lab(fit, variant),
        elsewhere=_of_paper(printed) if fit else (),
        above=max(behind) if known and high > max(behind) else None,
        printed={key: printed[key] for key in ("over_a_control_not_named", "direction_stated") if key in printed},
        nearest=_nearest(variant, fit),
        kind=kind,
        kind_mean=(fit.constants(BASELINE) if fit else stored(variant.moduli)[BASELINE])[kind],
        published=_model_level(variant, "published", fit),
        corrected=_model_level(variant, "corrected", fit),
        analytic_error=leave_one_out_error("published", variant, fit),
        source=_source(lead, variant, fit),
    )


def _reason(variant: EstimateInput) -> str:
    """Return why a unit has no range."""
    if math.isnan(variant.passes):
        return NO_PASSES
    unknown = [layer.material for layer in variant.layers if math.isnan(layer.place)]
    return f"no modulus of {unknown[0]} is known" if unknown else "its lengths are none of a measured unit's"


def leave_one_out_error(model: str, variant: EstimateInput, fit: LabFit | None = None) -> float:
    """Return a model's leave-one-out error, a factor: on the lab's own units, or on the paper's nine."""
    if fit:
        one = fit.model[model]
        return one.own_leave_one_out or one.leave_one_out
    return scores(variant.moduli).models[model].leave_one_out.geometric_mean


def _wider(lead: Lead, variant: EstimateInput) -> list[str]:
    """Return the inputs that widen the range by more than a little, the strongest first; none if it prints the same."""
    units, of = stack_inputs([variant]), lengths([variant])
    found = lead.predictive(units, of)
    whole, (low, level, high) = float(found.scale[0]), (float(end[0]) for end in found.range)
    added = {name: float(one[0]) for name, one in lead.unmeasured(units, of).items()}
    share = math.sqrt(max(1.0 - sum(added.values()) / whole**2, 0.0)) if whole else 1.0
    if all(number(level * (end / level) ** share, 2) == number(end, 2) for end in (low, high)):
        return []
    felt = [name for name, more in added.items() if whole - np.sqrt(max(whole**2 - more, 0.0)) > _NOTICED * whole]
    of_nobody = "silicones (the key like names the one of the catalogue, if it is one)"
    words = {"silicones": of_nobody} if any(layer.other for layer in variant.layers) else {}
    return [words.get(name, name) for name in sorted(felt, key=lambda name: -added[name])]


def _source(lead: Lead, variant: EstimateInput, fit: LabFit | None) -> Source:
    known = scores(variant.moduli)
    best = known.models[lead.model].leave_one_out
    return Source(
        model=lead.model,
        units=fit.units if fit else best.count,
        lab=fit.name if fit else None,
        of_others=len(fit.measured) - fit.units if fit else 0,
        with_paper=fit.include_paper_units if fit else True,
        error=leave_one_out_error(lead.model, variant, fit),
        worst=None if fit else best.worst,
        worst_at=None if fit else best.worst_at,
        baseline=leave_one_out_error(BASELINE, variant, fit),
        coverage=None if fit else known.lead.coverage,
    )


def _model_level(variant: EstimateInput, model: str, fit: LabFit | None) -> ModelLevel:
    return ModelLevel(**edge_level(variant, model, fit))


def _of_lab(fit: LabFit, variant: EstimateInput) -> tuple[Measured, ...]:
    return tuple(Measured(one["value"], one["low"], one["high"], one["unit"]) for one in own_block(fit, variant))


def _of_paper(printed: dict[str, Any]) -> tuple[Measured, ...]:
    if not printed.get("same_size"):
        return ()
    both = [printed[key] for key in ("level", "also_printed") if printed.get(key) is not None]
    return tuple(Measured(level, None, None, PAPER) for level in both)


def _nearest(variant: EstimateInput, fit: LabFit | None) -> Nearest:
    """Return the nearest measured unit as `measured.nearest` does; with a fit, of the lab's own ones if it has any."""
    if fit is None:
        found = nearest(variant)
        return Nearest(found["unit"], found["level"], tuple(found["differs_in"]))
    place = coordinates_of(variant)
    unit = min(fit.own or fit.measured, key=lambda one: float(np.nansum((np.array(one.place) - place) ** 2)))
    apart = place - np.array(unit.place)
    silicones = ["silicones"] if not np.allclose(apart[LENGTHS:], 0.0) else []
    return Nearest(unit.unit, unit.value, (*silicones, *differing(apart)))
