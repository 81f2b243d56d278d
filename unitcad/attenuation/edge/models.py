"""The models of the edge level: their forms, their fits to measured units, and their stored constants.

A fit takes a table and weights (M, units) of the units to fit to, and returns constants (M, constants).

`rule` is s q^n: n counts the passes of borders whose inside is the softer layer. `published` and `corrected` are the
paper's closed form; its f1 and f2 are not printed, so both have one constant s. `baseline`, the mean level of each of
four classes, is scored with them and gives no estimate.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.contrast import counts
from unitcad.attenuation.edge.measured import CLASSES, MeasuredTable, Moduli, Predict, unit_class
from unitcad.attenuation.edge.scores import scores

MODELS = ("rule", "published", "corrected")
RULE, BASELINE = "rule", "baseline"


@dataclass(frozen=True)
class Model:
    """A model of ln level.

    `fit` takes a table and weights (M, units) and returns constants (M, constants), by weighted least squares of ln
    level. `logs` takes units and constants (..., constants), and returns ln level with the units' rows last.
    `gradient`, by the constants' logarithms, takes one set of constants; its last axis runs over them. `is_level`: 1
    for a constant that is a level, 0 for a factor; the levels multiplied by a number multiply every unit's level.
    """

    names: tuple[str, ...]
    fit: Callable[[MeasuredTable, np.ndarray], np.ndarray]
    logs: Callable[[Units, np.ndarray], Any]
    gradient: Callable[[Units, np.ndarray], Any]
    is_level: np.ndarray

    def levels(self, table: MeasuredTable, weights: np.ndarray) -> np.ndarray:
        """Return the levels of all units by each fit, shape (M, units)."""
        constants = self.fit(table, weights)
        return np.exp(table.mean(lambda units: self.logs(units, constants).T)).T


def log_linear(
    names: tuple[str, ...], columns: Predict, offset: Predict | None = None, levels: int | None = None
) -> Model:
    """Return the model ln level = offset + columns @ ln constants.

    The first `levels` constants (None: all) are levels, the others factors. A constant that no unit determines is the
    mean level, or 1.
    """
    is_level = np.array([levels is None or i < levels for i in range(len(names))], dtype=float)

    def fit(table: MeasuredTable, weights: np.ndarray) -> np.ndarray:
        x, y = table.mean(columns), np.log(table.levels) - (table.mean(offset) if offset else 0.0)
        weights = np.asarray(weights, dtype=float)
        mean = (weights @ y / weights.sum(axis=1))[:, None]
        weighted = x.T * weights[:, None, :]
        moments = np.einsum("mki,mi->mk", weighted, y - mean)
        return np.exp(is_level * mean + np.einsum("mkl,ml->mk", np.linalg.pinv(weighted @ x, hermitian=True), moments))

    def logs(units: Units, constants: np.ndarray) -> Any:
        return np.log(constants) @ np.moveaxis(columns(units), -1, 0) + (offset(units) if offset else 0.0)

    return Model(names, fit, logs, lambda units, constants: columns(units), is_level)


def one_constant(path: Predict) -> Model:
    """Return the model level = s path."""

    def ones(units: Units) -> Any:
        return np.ones((*units.thickness.shape[:-1], 1))

    return log_linear(("s",), ones, lambda units: np.log(path(units)))


def rule(ratio: float = 1.0, signed: bool = False) -> Model:
    """Return s q^n; `ratio`: n of a unit that is passed twice over that of one passed once, over 2.

    `signed`: borders whose inside is the stiffer layer count -1.
    """

    def columns(units: Units) -> Any:
        passes = np.where(units.passes > 1.0, ratio * units.passes, units.passes)
        count = cf.borders(units) if signed else counts(units.place, units.doubt)
        return np.stack([np.ones(passes.shape), passes * count.sum(axis=-1)], axis=-1)

    return log_linear(("s", "q"), columns, levels=1)


def class_means(groups: tuple[int, ...]) -> Model:
    """Return the mean level of groups of the four classes; `groups` has each class's number."""
    rows = np.eye(max(groups) + 1)[list(groups)]
    return log_linear(
        tuple(f"group {i}" for i in range(len(rows[0]))), lambda units: rows[unit_class(units).astype(int)]
    )


COMPARED: dict[str, Model] = {
    "rule": rule(),
    "published": one_constant(cf.published_path),
    "corrected": one_constant(cf.corrected_path),
    BASELINE: log_linear(CLASSES, lambda units: np.eye(len(CLASSES))[unit_class(units).astype(int)]),
}


def stored(moduli: Moduli = "small-strain") -> dict[str, dict[str, float]]:
    """Return the constants of `MODELS` and the baseline, fitted to the nine levels by such moduli, to six digits."""
    return scores(moduli).constants


def edge_levels(units: Units, model: str, constants: Mapping[str, float] | None = None) -> Any:
    """Return the edge level (motor amplitude = 1) by a model, shape (...), NaN if an input is not known.

    By the stored constants of small-strain moduli if none are given.
    """
    found = COMPARED[model]
    own = constants or stored()[model]
    with np.errstate(all="ignore"):  # a legal extreme may under- or overflow
        return np.exp(found.logs(units, np.array([own[name] for name in found.names])))
