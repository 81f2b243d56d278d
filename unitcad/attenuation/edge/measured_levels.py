"""Measured units as data, what a model's levels of them are, and the catalogue's own table: the paper's nine levels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np

from unitcad.attenuation.edge.closed_form import CONTROL_PASSES, Section, Units
from unitcad.catalogue import Material, materials, measurements, motors

CONTROL = "single"
"""What stands for the design in a control's name."""

Moduli = Literal["dynamic", "quasi-static", "data sheet"]
"""At the motor's frequency, as the paper has them; of a slow pull; of the data sheet, at 100 % strain."""
Predict = Callable[[Units], Any]
"""Levels of units of one number of layers, shape (...)."""


@dataclass(frozen=True)
class MeasuredTable:
    """Measured units: names, design (`CONTROL`: one layer), layers inside out, level (motor = 1), the models' input.

    A unit of which more than one shape is possible has an input with a row for each; its level is the geometric mean.
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
    def soft_inside(self) -> np.ndarray:
        """Whether the innermost layer of a unit is softer than the outermost, a truth value each."""
        return self.evaluate(lambda units: units.youngs_modulus[..., -1] / units.youngs_modulus[..., 0]) > 1

    def evaluate(self, predict: Predict) -> np.ndarray:
        """Return `predict` of every unit."""
        return np.array([np.exp(np.mean(np.log(predict(units)))) for units in self.inputs])

    @property
    def contrast(self) -> np.ndarray:
        """n E_outer/E_inner of every unit, the divider's variable."""
        return self.evaluate(lambda u: u.passes * u.youngs_modulus[..., -1] / u.youngs_modulus[..., 0])

    def without(self, index: int) -> MeasuredTable:
        """Return the table without one unit."""
        kept = [i for i in range(len(self.names)) if i != index]
        return MeasuredTable(
            tuple(self.names[i] for i in kept),
            tuple(self.designs[i] for i in kept),
            tuple(self.layers[i] for i in kept),
            self.levels[kept],
            tuple(self.inputs[i] for i in kept),
        )

    def units(self, index: int) -> Units:
        """Return the closed forms' input for one unit of the table."""
        return self.inputs[index]


@cache
def measured_table(moduli: Moduli = "dynamic") -> MeasuredTable:
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


def _units(design: str, layers: tuple[str, ...], moduli: Moduli) -> Units:
    """Return the input of a unit of the paper, at the catalogue's nominal values; a control's in every design."""
    known = [materials()[name] for name in layers]
    all_designs, shared = measurements().designs, measurements().unit
    shapes = list(all_designs.values()) if design == CONTROL else [all_designs[design]]
    motor = motors()[shared.motor]
    height, radius = float(motor.thickness_mm) * 1e-3, shared.diameter_mm * 1e-3 / 2
    walls = 2 * shared.wall_mm * 1e-3
    wall = walls / len(layers)
    section = Section(
        cavity_radius=[radius - walls] * len(shapes),
        motor_radius=[float(motor.diameter_mm) * 1e-3 / 2] * len(shapes),
        core_height=[height + (shared.circuit_mm * 1e-3 if shape.caps else 0.0) for shape in shapes],
        outer_radii=[[radius - wall * i for i in reversed(range(len(layers)))]] * len(shapes),
        caps=[[wall if shape.caps else 0.0] * len(layers) for shape in shapes],
    )
    return Units(
        youngs_modulus=[_modulus(material, moduli) for material in known],
        density=[1e3 * float(m.density_g_cm3) for m in known],
        poisson_ratio=[float(m.poisson_ratio) for m in known],
        tan_delta=[float(m.loss_factor) for m in known],
        thickness=[wall] * len(layers),
        omega=2 * np.pi * shared.frequency_hz,
        passes=CONTROL_PASSES if design == CONTROL else all_designs[design].passes,
        section=section,
    )


def _modulus(material: Material, moduli: Moduli) -> float:
    """Return Young's modulus in Pa, NaN where there is none."""
    by_source = {
        "dynamic": material.youngs_modulus_kpa,
        "quasi-static": material.quasistatic_modulus_kpa,
        "data sheet": material.modulus_100pct_kpa,
    }
    value = by_source[moduli]
    return np.nan if value is None else 1e3 * float(value)
