"""A lab's units beside the paper's: models with a unit left out, by each source of moduli, and the fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import get_args

import numpy as np
from msgspec.structs import replace

from unitcad.attenuation.edge.fitted_models import KAPPA, MODELS
from unitcad.attenuation.edge.lab_fit import LabFit, ModelFit, unit_key
from unitcad.attenuation.edge.measured_levels import CONTROL, MeasuredTable, Moduli, measured_table
from unitcad.attenuation.edge.scores import SEED
from unitcad.attenuation.edge.shrunk_fit import Campaigns, Judged, Model, Shrunk, judge, models, paired, shrunk
from unitcad.attenuation.edge.variant_units import nominal
from unitcad.attenuation.inputs import EstimateInput, Quantity
from unitcad.catalogue import materials
from unitcad.errors import Refusal
from unitcad.estimating import estimate_input
from unitcad.lab.fit_lab import FitLab, OwnUnit
from unitcad.spec import to_data
from unitcad.validation import from_data

SOURCES: tuple[Moduli, ...] = get_args(Moduli)
LEAST_ALONE = 4
"""Units of a lab without the paper's: one is left out, two constants are fitted, one degree of freedom is left."""
_SIDES = 0.95
"""Quantile at the upper end of a constant's range, 90 % wide."""


@dataclass(frozen=True)
class Compared:
    """All models by one source of moduli: the units, judged, fitted for the lab; or why there is none."""

    moduli: Moduli
    campaigns: Campaigns | None
    judged: dict[str, Judged]
    fitted: dict[str, Shrunk]
    reason: str = ""

    @property
    def order(self) -> list[str]:
        """The models by their score, the best first; those with a constant on its bound last."""
        return sorted(
            self.judged, key=lambda name: (self.at_bound(name) is not None, round(self.judged[name].score, 4))
        )

    def at_bound(self, name: str) -> str | None:
        """Return the constant of a model that the fit left on the bound of its search, if there is one."""
        if name != "fitted":
            return None
        return "kappa" if np.any(np.isclose(self.fitted[name].constants[0], KAPPA, rtol=1e-6)) else None


@dataclass(frozen=True)
class Fitted:
    """The study of a lab: the chosen source of moduli, the others beside it, and what an estimate takes."""

    lab: FitLab
    by_source: dict[str, Compared]
    fit: LabFit

    @property
    def chosen(self) -> Compared:
        """The comparison by the lab's own choice of moduli."""
        return self.by_source[self.lab.settings.moduli]


def fit_lab(lab: FitLab, say: Callable[[str], None] = lambda stage: None) -> Fitted:
    """Judge and fit every model with the lab's units. Raises Refusal for units that can't be fitted."""
    settings = lab.settings
    if not settings.with_paper and len(lab.units) < LEAST_ALONE:
        limit = f"{len(lab.units)} units; without the paper's {LEAST_ALONE} are needed"
        raise Refusal("unit", None, limit)
    by_source: dict[str, Compared] = {}
    for moduli in SOURCES:
        say(f"{moduli} moduli")
        by_source[moduli] = _compared(lab, moduli)
    chosen = by_source[settings.moduli]
    if chosen.campaigns is None:
        raise Refusal("moduli", settings.moduli, chosen.reason)
    measured = []
    for unit in lab.units:
        variant = estimate_input(unit.spec, unit.frequency_hz)
        measured.append(unit.stored(unit_key(variant), variant.frequency.middle))
    made = models()
    entries = {name: _entry(made[name], name, chosen) for name in made}
    fit = LabFit(
        format=1,
        name=settings.name,
        units=len(lab.units),
        moduli=settings.moduli,
        with_paper=settings.with_paper,
        between_labs=settings.between_labs,
        seed=SEED,
        model={name: entries[name] for name in (*MODELS, "crossings")},
        null=entries["null"],
        measured=measured,
        input=list(lab.inputs),
    )
    return Fitted(lab, by_source, fit)


def _compared(lab: FitLab, moduli: Moduli) -> Compared:
    inputs = [_input(unit, moduli) for unit in lab.units]
    for i, variant in enumerate(inputs):
        for at, layer in enumerate(variant.layers):
            if not layer.youngs_modulus.known:
                return Compared(moduli, None, {}, {}, f"unit.{i}.layers.{at}: {layer.material}: no modulus is known")
    campaigns = campaigns_of(lab, inputs, moduli)
    made = models()
    judged = {name: judge(model, campaigns) for name, model in made.items()}
    fitted = {name: shrunk(model, campaigns) for name, model in made.items()}
    return Compared(moduli, campaigns, judged, fitted)


def campaigns_of(lab: FitLab, inputs: list[EstimateInput], moduli: Moduli) -> Campaigns:
    """Return the paper's units, where they are wanted, and the lab's own after them."""
    paper = measured_table(moduli)
    known = np.array([bool(np.all(np.isfinite(units.youngs_modulus))) for units in paper.inputs])
    kept = np.flatnonzero(known) if lab.settings.with_paper else []
    table = MeasuredTable(
        (*(paper.names[i] for i in kept), *(unit.name for unit in lab.units)),
        (*(paper.designs[i] for i in kept), *(CONTROL if len(v.layers) == 1 else v.design for v in inputs)),
        (*(paper.layers[i] for i in kept), *(tuple(layer.material for layer in v.layers) for v in inputs)),
        np.array([*(paper.levels[i] for i in kept), *(unit.level.value for unit in lab.units)]),
        (*(paper.inputs[i] for i in kept), *(nominal(variant) for variant in inputs)),
    )
    own = np.arange(len(table.names)) >= len(kept)
    error = np.array([*[0.0] * len(kept), *(unit.error for unit in lab.units)])
    return Campaigns(table, own, error, lab.settings.between_labs)


def _input(unit: OwnUnit, moduli: Moduli) -> EstimateInput:
    """Return a unit's input by one source of moduli."""
    data = to_data(unit.built)
    data["estimate"]["moduli"] = "dynamic" if moduli == "data sheet" else moduli
    variant = estimate_input(from_data(data), unit.frequency_hz)
    if moduli != "data sheet":
        return variant
    known = materials(unit.built.materials)
    return replace(
        variant,
        layers=tuple(
            replace(layer, youngs_modulus=Quantity(1e3 * float(known[layer.material].modulus_100pct_kpa)))
            for layer in variant.layers
        ),
    )


def _entry(model: Model, name: str, compared: Compared) -> ModelFit:
    from scipy.special import stdtrit

    judged, found, campaigns = compared.judged[name], compared.fitted[name], compared.campaigns
    assert campaigns is not None
    spread = stdtrit(found.df, _SIDES) * found.sigma * np.sqrt(np.diag(found.covariance))
    paper = ~campaigns.own
    stored = model.fit(campaigns.table, paper.astype(float)) if paper.any() else None
    low, high = judged.range
    against = paired(judged, compared.judged["null"]) if name != "null" else (None, None, None)
    return ModelFit(
        constants=_named(model, found.constants),
        low=_named(model, found.constants * np.exp(-np.minimum(spread, _WIDEST))),
        high=_named(model, found.constants * np.exp(np.minimum(spread, _WIDEST))),
        stored={} if stored is None else _named(model, stored),
        degrees_of_freedom=found.df,
        discrepancy=_short(found.sigma),
        covariance=[[_short(value) for value in row] for row in found.covariance],
        left_out=_short(judged.score),
        left_out_low=_short(low),
        left_out_high=_short(high),
        own_left_out=_short(judged.own_score),
        own_by_stored=None if judged.stored_score is None else _short(judged.stored_score),
        against_null=None if against[0] is None else _short(against[0]),
        against_null_error=None if against[1] is None else _short(against[1]),
        against_null_p=None if against[2] is None else _short(against[2]),
        held=f"{judged.held()} of {judged.errors.size}",
        at_bound=compared.at_bound(name),
    )


_WIDEST = 10.0
"""Largest half-width of a range of ln constant that is written: beyond it the units say nothing of the constant."""


def _named(model: Model, values: np.ndarray) -> dict[str, float]:
    return {name: _short(value) for name, value in zip(model.names, values, strict=True)}


def _short(value: float) -> float:
    return float(f"{float(value):.6g}")
