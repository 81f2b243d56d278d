"""Measured units as data, their classes, and the catalogue's own table: the paper's nine levels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from typing import Any, Literal

import numpy as np

from unitcad.attenuation.edge.closed_form import Units, softer_passes
from unitcad.catalogue import Material, materials, measurements

CONTROL = "single"
"""Word in place of the design in a control's name."""
CLASSES = ("control", "stiff inside", "soft inside, one pass", "soft inside, two passes")
"""One layer; no border with the softer layer inside; such a border, passed once (open rings); passed more often."""
Moduli = Literal["small-strain", "quasi-static", "data sheet"]
"""As the paper prints them, or from a test at the motor's frequency; of a slow pull; of the data sheet, at 100 %."""
Predict = Callable[[Units], Any]
"""Values of units of one number of layers, shape (...)."""


@dataclass(frozen=True)
class MeasuredTable:
    """Measured units: names, design (`CONTROL`: one layer), layers inside out, level (motor = 1), the models' input.

    Each input has a row for each shape that the unit may have; a model's ln level is the mean over them.
    """

    names: tuple[str, ...]
    designs: tuple[str, ...]
    layers: tuple[tuple[str, ...], ...]
    levels: np.ndarray
    inputs: tuple[Units, ...]

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """(unit, control): each layered unit with the controls of its own materials."""
        single = {layers[0]: i for i, layers in enumerate(self.layers) if len(layers) == 1}
        return [(i, single[name]) for i, layers in enumerate(self.layers) if len(layers) > 1 for name in layers]

    @property
    def classes(self) -> np.ndarray:
        """The number of each unit's class in `CLASSES`."""
        return np.round(self.mean(unit_class)).astype(int)

    def mean(self, predict: Predict) -> np.ndarray:
        """Return `predict` of every unit, the mean over its shapes."""
        return np.array([np.mean(predict(units), axis=0) for units in self.inputs])

    def rows(self, kept: list[int]) -> MeasuredTable:
        """Return the table of some of its units."""
        names, designs, layers, inputs = (
            tuple(values[i] for i in kept) for values in (self.names, self.designs, self.layers, self.inputs)
        )
        return MeasuredTable(names, designs, layers, self.levels[kept], inputs)  # pyright: ignore[reportArgumentType]

    def without(self, index: int) -> MeasuredTable:
        """Return the table without one unit."""
        return self.rows([i for i in range(len(self.names)) if i != index])


def unit_class(units: Units) -> Any:
    """Return the number of each unit's class in `CLASSES`, shape (...)."""
    count, passes = softer_passes(units), np.broadcast_to(units.passes, units.thickness.shape[:-1])
    if units.thickness.shape[-1] == 1:
        return np.zeros(passes.shape)
    return np.where(count <= 0.0, 1.0, np.where(passes <= 1.0, 2.0, 3.0))


@cache
def whole_ratio(moduli: Moduli = "small-strain") -> float:
    """Return the least ratio of moduli, the softer layer inside, at which a unit was measured, by such moduli."""
    data = measurements()
    pairs = [data.layers(unit) for design in data.designs.values() for unit in design.levels]
    values = [[_modulus(materials()[name], moduli) for name in pair] for pair in pairs]
    return min(outer / inner for inner, outer in values if outer > inner)


@cache
def measured_table(moduli: Moduli = "small-strain") -> MeasuredTable:
    """Return the nine levels of the catalogue's measurements, as the results section prints them.

    `moduli`: which of the silicones' moduli stand in the models' input.
    """
    data = measurements()
    names, designs, layers, levels = [], [], [], []
    for design, measured in {CONTROL: data.controls, **{name: d.levels for name, d in data.designs.items()}}.items():
        for unit, level in measured.items():
            names.append(f"{design} {unit}")
            designs.append(design)
            layers.append(data.layers(unit))
            levels.append(level)
    inputs = tuple(_units(design, unit, moduli) for design, unit in zip(designs, layers, strict=True))
    return MeasuredTable(tuple(names), tuple(designs), tuple(layers), np.array(levels), inputs)


@cache
def measured_slopes(moduli: Moduli = "small-strain") -> dict[tuple[str, int], list[float]]:
    """Return d ln level / d ln modulus between measured units that differ in the silicone of one layer.

    By kind (the first word of a class) and the number of the layer, from 0.
    """
    table, found = measured_table(moduli), dict[tuple[str, int], list[float]]()
    for i, j in combinations(range(len(table.names)), 2):
        one, other = table.layers[i], table.layers[j]
        differ = [at for at, (a, b) in enumerate(zip(one, other, strict=False)) if a != b]
        same = table.designs[i] == table.designs[j] and table.classes[i] == table.classes[j]
        if not same or len(one) != len(other) or len(differ) != 1:
            continue
        at = differ[0]
        e = [table.inputs[row].youngs_modulus[0, at] for row in (i, j)]
        slope = np.log(table.levels[j] / table.levels[i]) / np.log(e[1] / e[0])
        found.setdefault((CLASSES[table.classes[i]].split(" ")[0], at), []).append(float(slope))
    return found


def _units(design: str, layers: tuple[str, ...], moduli: Moduli) -> Units:
    """Return the input of a unit of the paper at the catalogue's nominal values; a control's in every design."""
    known = [materials()[name] for name in layers]
    data, shared = measurements(), measurements().unit
    shapes = [shape for name, shape in data.designs.items() if design in (CONTROL, name)]
    one = {
        "youngs_modulus": [_modulus(material, moduli) for material in known],
        "density": [1e3 * float(m.density_g_cm3) for m in known],
        "poisson_ratio": [float(m.poisson_ratio) for m in known],
        "tan_delta": [float(m.loss_factor) for m in known],
        "thickness": [2e-3 * shared.wall_mm / len(layers)] * len(layers),
        "omega": 2 * np.pi * shared.frequency_hz,
        "whole": whole_ratio(moduli),
    }
    return Units(
        **{key: [value] * len(shapes) for key, value in one.items()}, passes=[shape.passes for shape in shapes]
    )


def _modulus(material: Material, moduli: Moduli) -> float:
    """Return Young's modulus in Pa, NaN if there is none."""
    by_source = {
        "small-strain": material.youngs_modulus_kpa,
        "quasi-static": material.quasistatic_modulus_kpa,
        "data sheet": material.modulus_100pct_kpa,
    }
    value = by_source[moduli]
    return np.nan if value is None else 1e3 * float(value)
