"""The paper's measured table, and how far a model is from it: levels, ratios to controls, directions, leave-one-out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from unitcad.attenuation.edge.closed_form import CONTROL_PASSES, Units
from unitcad.catalogue import materials, measurements

CONTROL = "single"
"""What stands for the design in a control's name."""
_WALL = 1.25e-3  # m, section II-B
_OMEGA = 2 * np.pi * 125.0  # rad/s, the middle of the 100 to 150 Hz of section III-A

Predict = Callable[[Units], Any]
"""Levels of units of one number of layers, shape (...)."""
Fit = Callable[["MeasuredTable", np.ndarray], "Callable[[MeasuredTable], np.ndarray]"]
"""From a table and a mask of the units to use, a function that gives the levels of a table's units."""


@dataclass(frozen=True)
class MeasuredTable:
    """The measured units, controls first: names, design (`CONTROL`: one layer), layers inside out, level."""

    names: tuple[str, ...]
    designs: tuple[str, ...]
    layers: tuple[tuple[str, ...], ...]
    levels: np.ndarray

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """(unit, control): each layered unit with the controls of its own materials."""
        single = {layers[0]: i for i, layers in enumerate(self.layers) if len(layers) == 1}
        return [(i, single[name]) for i, layers in enumerate(self.layers) if len(layers) > 1 for name in layers]

    @property
    def soft_inside(self) -> np.ndarray:
        """Whether the innermost layer of a unit is softer than the outermost, a truth value each."""
        return self.evaluate(lambda units: units.youngs_modulus[..., -1] - units.youngs_modulus[..., 0]) > 0

    def evaluate(self, predict: Predict) -> np.ndarray:
        """Return `predict` of every unit, at the nominal values of the catalogue."""
        return np.array([float(predict(self.units(i))) for i in range(len(self.names))])

    @property
    def contrast(self) -> np.ndarray:
        """n E_outer/E_inner of every unit, the divider's variable."""
        return self.evaluate(lambda u: u.passes * u.youngs_modulus[..., -1] / u.youngs_modulus[..., 0])

    def units(self, index: int) -> Units:
        """Return the closed forms' input for one unit of the table."""
        return _units(self.designs[index], self.layers[index])


@cache
def _units(design: str, layers: tuple[str, ...]) -> Units:
    known = [materials()[name] for name in layers]
    return Units(
        youngs_modulus=[1e3 * float(m.youngs_modulus_kpa or np.nan) for m in known],
        density=[1e3 * float(m.density_g_cm3) for m in known],
        poisson_ratio=[float(m.poisson_ratio) for m in known],
        tan_delta=[float(m.loss_factor) for m in known],
        thickness=[2 * _WALL / len(known)] * len(known),
        omega=_OMEGA,
        passes=CONTROL_PASSES if design == CONTROL else measurements().designs[design].passes,
    )


@cache
def measured_table() -> MeasuredTable:
    """Return the nine levels of the catalogue's measurements, as the results section prints them."""
    data = measurements()
    names, designs, layers, levels = [], [], [], []
    for design, measured in {CONTROL: data.controls, **{name: d.levels for name, d in data.designs.items()}}.items():
        for unit, level in measured.items():
            names.append(f"{design} {unit}")
            designs.append(design)
            layers.append(data.layers(unit))
            levels.append(level)
    return MeasuredTable(tuple(names), tuple(designs), tuple(layers), np.array(levels))


@dataclass(frozen=True)
class Score:
    """Geometric-mean and worst factor error (1 is exact) of a set of figures, and which one is the worst."""

    geometric_mean: float
    worst: float
    worst_at: str
    count: int


@dataclass(frozen=True)
class Assessment:
    """A model against the table. `directions`: of how many ratios the side of 1 is right.

    `left_out` and `left_out_ratios`: each unit predicted by constants fitted without it (None: none in it).
    """

    levels: Score
    ratios: Score
    directions: int
    left_out: Score
    left_out_ratios: Score | None


def assess(fit: Fit, fitted_ratios: bool, table: MeasuredTable | None = None) -> Assessment:
    """Fit to all units and to all but one, and compare. `fitted_ratios`: a fitted constant enters the ratios too."""
    table = table or measured_table()
    everyone = np.ones(len(table.names), dtype=bool)
    levels = fit(table, everyone)(table)
    without = [fit(table, _all_but(everyone, i))(table) for i in range(everyone.size)]
    left_out = np.array([predicted[i] for i, predicted in enumerate(without)])
    pairs = table.pairs
    measured = np.array([table.levels[i] / table.levels[c] for i, c in pairs])
    ratios = np.array([levels[i] / levels[c] for i, c in pairs])
    names = [f"{table.names[i]} to {table.names[c]}" for i, c in pairs]
    return Assessment(
        levels=_score(levels, table.levels, table.names),
        ratios=_score(ratios, measured, names),
        directions=int(np.sum(np.sign(_log(ratios)) == np.sign(np.log(measured)))),
        left_out=_score(left_out, table.levels, table.names),
        left_out_ratios=_score(np.array([without[i][i] / without[i][c] for i, c in pairs]), measured, names)
        if fitted_ratios
        else None,
    )


def _log(ratios: np.ndarray) -> np.ndarray:
    return np.where(np.abs(ratios - 1.0) < 1e-9, 0.0, np.log(ratios))


def _all_but(everyone: np.ndarray, index: int) -> np.ndarray:
    chosen = everyone.copy()
    chosen[index] = False
    return chosen


def _score(predicted: np.ndarray, measured: np.ndarray, names: Any) -> Score:
    off = np.abs(np.log(predicted / measured))
    worst = int(np.argmax(off))
    return Score(float(np.exp(off.mean())), float(np.exp(off[worst])), str(names[worst]), off.size)
