"""A lab's stored fit: the models' constants, the prediction for a new unit, the lab's own measurements.

A new unit's ln level is Student-t distributed: `scale`^2 = model_error^2 (1 + g' C g), where g is the gradient of the
model's ln level in the logarithms of its constants, and C their covariance over model_error^2.
"""

from __future__ import annotations

import hashlib
import json
from typing import Annotated, Any, Literal

import numpy as np
from msgspec import Meta, Struct
from scipy.special import stdtrit

from unitcad.attenuation.edge.models import BASELINE, COMPARED, MODELS, edge_levels
from unitcad.attenuation.edge.nearest import COORDINATES
from unitcad.attenuation.edge.variant_units import nominal
from unitcad.attenuation.inputs import EstimateInput
from unitcad.text import some

Positive = Annotated[float, Meta(ge=1e-9, le=1e9)]
PERCENT = (10, 90)
"""Ends of a predictive range."""


class ModelFit(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A model fitted to a lab's units: constants, their stored values, and the predictive.

    `model_error`: standard deviation of a unit's ln level about the model. `covariance`: of the constants' logarithms,
    in the order of `constants`, over model_error^2. `left_out` is the factor with the unit left out.
    `at_bound`: the constant that the search left on its bound, None if the units determine all.
    """

    constants: dict[str, Positive]
    low: dict[str, Positive]
    high: dict[str, Positive]
    stored: dict[str, Positive]
    degrees_of_freedom: Annotated[int, Meta(ge=1, le=100000)]
    model_error: Annotated[float, Meta(ge=1e-6, le=10)]
    covariance: list[list[Annotated[float, Meta(ge=-1e9, le=1e9)]]]
    left_out: Positive
    left_out_low: Positive
    left_out_high: Positive
    own_left_out: Positive | None = None
    own_by_stored: Positive | None = None
    against_baseline: float | None = None
    against_baseline_error: float | None = None
    against_baseline_p: float | None = None
    held: str = ""
    at_bound: str | None = None


class OwnLevel(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A unit's level as the lab measured it, with its 95 % interval; `key` is its `unit_key`.

    `place`: its `nearest.COORDINATES`; `residual`: ln(measured/predicted) by the model that leads.
    """

    unit: str
    key: str
    value: Positive
    low: Positive | None = None
    high: Positive | None = None
    frequency_hz: Positive
    place: Annotated[list[float], Meta(min_length=len(COORDINATES), max_length=len(COORDINATES))]
    residual: float
    source: str = ""


class InputFile(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A file that the fit read."""

    file: str
    sha256: str


class LabFit(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A lab's fit: `units` of its own, with or without the paper's nine, by which moduli; `leads`: `models.leader`.

    `between_labs`: standard deviation between labs of a constant's logarithm over that between units of one lab.
    """

    format: Annotated[int, Meta(ge=1, le=1)]
    name: Annotated[str, Meta(min_length=1, max_length=100)]
    units: Annotated[int, Meta(ge=1, le=100000)]
    moduli: Literal["small-strain", "quasi-static"]
    include_paper_units: bool
    between_labs: Annotated[float, Meta(ge=0, le=100)]
    seed: int
    leads: Literal["rule", "published", "corrected", "divider"]
    model: dict[str, ModelFit]
    measured: Annotated[list[OwnLevel], Meta(min_length=1)]
    input: list[InputFile] = []

    def constants(self, model: str) -> dict[str, float]:
        """Return a model's constants. Raises KeyError for one that it does not have."""
        return self.model[model].constants


def fault(fit: LabFit) -> tuple[str, Any, str] | None:
    """Return (field, value, limit) of the first thing wrong with a fit that its types do not show."""
    for model in (*MODELS, BASELINE):
        names = set(COMPARED[model].names)
        if model not in fit.model:
            return f"model.{model}", None, "is required"
        one = fit.model[model]
        if set(one.constants) != names:
            return f"model.{model}.constants", some(sorted(one.constants)), f"must be {' and '.join(sorted(names))}"
        matrix = one.covariance
        if [len(row) for row in matrix] != [len(names)] * len(names):
            return f"model.{model}.covariance", len(matrix), f"needs {len(names)} rows of as many numbers"
        # A file has six digits; a combination of constants that the units do not determine has eigenvalues near 0.
        size = float(np.max(np.abs(matrix)))
        symmetric = np.allclose(matrix, np.transpose(matrix), rtol=1e-5, atol=1e-5 * size)
        if not symmetric or np.linalg.eigvalsh(matrix).min() < -1e-5 * size:
            return f"model.{model}.covariance", None, "is no covariance: not symmetric, or negative in a direction"
    return None


def predictive(fit: LabFit, model: str, variant: EstimateInput) -> tuple[int, float, float]:
    """Return (degrees of freedom, centre, scale) of the Student-t distribution of a variant's ln level in the lab.

    At the middle of the inputs' ranges, for a unit like the measured ones; centre and scale are NaN if an input is not
    known.
    """
    units, one = nominal(variant), fit.model[model]
    centre = float(np.log(edge_levels(units, model, one.constants))[0])
    own = np.array([one.constants[name] for name in COMPARED[model].names])
    g = COMPARED[model].gradient(units, own)[0]
    scale = one.model_error * float(np.sqrt(1.0 + g @ np.array(one.covariance) @ g))
    return one.degrees_of_freedom, centre, scale if np.isfinite(centre) else float("nan")


def quantiles(df: int, centre: float, scale: float) -> tuple[float, ...]:
    """Return the levels at `PERCENT` of a predictive of ln level."""
    return tuple(float(np.exp(centre + scale * stdtrit(df, percent / 100))) for percent in PERCENT)


def predictive_block(fit: LabFit, model: str, variant: EstimateInput, reason: str) -> dict[str, Any]:
    """Return a variant's predictive as data: P10, P90, and the distribution of ln level; `reason` says why not."""
    df, centre, scale = predictive(fit, model, variant)
    if not np.isfinite(centre):
        return {"p10": None, "p90": None, "reason": reason}
    low, high = quantiles(df, centre, scale)
    return {
        "p10": low,
        "p90": high,
        "degrees_of_freedom": df,
        "centre": centre,
        "scale": scale,
        "model_error": fit.model[model].model_error,
        "what": "where a new unit of this kind is expected in this lab: Student-t of ln level, at the inputs' middle",
    }


def error_block(fit: LabFit, model: str) -> dict[str, Any]:
    """Return a model's error by a fit, as factors: each unit left out, then of the lab's own units alone.

    `own_by_stored`: the own units' by the stored constants, without the fit. `baseline`: of the class means.
    """
    one = fit.model[model]
    return {
        "left_out": {"geometric_mean": one.left_out, "low": one.left_out_low, "high": one.left_out_high},
        "own_left_out": one.own_left_out,
        "own_by_stored": one.own_by_stored,
        "held_80": one.held,
        BASELINE: fit.model[BASELINE].left_out,
    }


def unit_key(variant: EstimateInput) -> str:
    """Return the identity of a unit: a hash of design, silicones and lengths; not of body or frequency."""
    geometry = variant.geometry
    lengths = [
        geometry.cavity_radius,
        geometry.core_height,
        geometry.motor_radius,
        geometry.motor_height,
        *(length for layer in geometry.layers for length in (layer.outer_radius, layer.top, layer.cap)),
    ]
    names = [layer.material for layer in variant.layers]
    text = json.dumps([variant.design, names, [f"{1e3 * length:.6f}" for length in lengths]])
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def own_block(fit: LabFit, variant: EstimateInput) -> list[dict[str, Any]]:
    """Return the lab's own measurements of this unit."""
    key = unit_key(variant)
    return [
        {name: getattr(one, name) for name in ("unit", "value", "low", "high", "frequency_hz", "source")}
        for one in fit.measured
        if one.key == key
    ]
