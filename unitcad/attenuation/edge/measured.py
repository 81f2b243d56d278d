"""Measured units, and how far a unit is from them: the paper's nine levels, their classes, the nearest one. SI."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import combinations
from typing import Any, Literal

import numpy as np
from msgspec.structs import replace

from unitcad.attenuation.edge.closed_form import Units, borders, softer_passes
from unitcad.attenuation.edge.contrast import place_of
from unitcad.attenuation.inputs import EstimateInput, SiliconeLayer
from unitcad.catalogue import Material, materials, measurements, motors

CONTROL = "single"
"""Word in place of the design in a control's name."""
CLASSES = ("control", "stiff inside", "soft inside, one pass", "soft inside, two passes")
"""One layer; no border that is likely to count; such a border, passed once (open rings); passed more often."""
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
    passes = np.broadcast_to(units.passes, units.thickness.shape[:-1])
    if units.thickness.shape[-1] == 1:
        return np.zeros(passes.shape)
    soft = softer_passes(units) >= 0.5 * passes
    return np.where(soft, np.where(passes <= 1.0, 2.0, 3.0), 1.0)


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
        "place": [place_of(material).at for material in known],
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


FIELDS = ("youngs_modulus", "poisson_ratio", "tan_delta")
"""Properties of a silicone that have a range."""


def nominal(variant: EstimateInput) -> Units:
    """Return the variant's middle values as closed-form input."""
    return stack_inputs([variant])


def stack_inputs(variants: Sequence[EstimateInput]) -> Units:
    """Return the middle values of variants of one number of layers as closed-form input, a row each."""
    layers = [variant.layers for variant in variants]
    return Units(
        **{field: [[getattr(layer, field).middle for layer in row] for row in layers] for field in FIELDS},
        density=[[layer.density for layer in row] for row in layers],
        thickness=[[layer.thickness for layer in row] for row in layers],
        omega=[2.0 * np.pi * variant.frequency.middle for variant in variants],
        passes=[variant.passes for variant in variants],
        place=[[layer.place for layer in row] for row in layers],
        doubt=[[layer.doubt for layer in row] for row in layers],
    )


def merge_layers(variant: EstimateInput, within: float = 0.0) -> EstimateInput:
    """Return a unit with neighbouring layers of one material as one layer: a cut between them changes no level.

    `within`: layers whose properties differ by less, relative, are of one material too, that of the innermost.
    """
    layers, shapes = variant.layers, variant.geometry.layers
    groups: list[list[int]] = []

    def alike(one: SiliconeLayer, other: SiliconeLayer) -> bool:
        values = [
            [layer.density, layer.place, *(getattr(layer, field).middle for field in FIELDS)] for layer in (one, other)
        ]
        return one.material == other.material or bool(np.allclose(*values, rtol=within, atol=0.0))

    for i, layer in enumerate(layers):
        if groups and alike(layers[groups[-1][0]], layer):
            groups[-1].append(i)
        else:
            groups.append([i])
    if len(groups) == len(layers):
        return variant
    whole = (replace(layers[g[0]], thickness=sum(layers[i].thickness for i in g), first=g[0]) for g in groups)
    outer = tuple(replace(shapes[g[-1]], cap=sum(shapes[i].cap for i in g)) for g in groups)
    return replace(variant, layers=tuple(whole), geometry=replace(variant.geometry, layers=outer))


FREQUENCIES = (100.0, 150.0)
"""The frequencies of the measured units, Hz (section III-A of the paper)."""
COORDINATES = (
    "diameter", "motor's diameter", "motor's height", "cavity's height", "frequency", "walls", "caps",
    "place of the borders", "place of the borders in the caps", "silicone inside", "silicone outside", "passes",
)  # fmt: skip
"""Logarithms of a unit's inputs over those that all measured units share, then the differences of measured units."""
LENGTHS = 9
"""How many of the `COORDINATES` all measured units of the paper share: they are 0 for them."""
LENGTH_NAMES = ("diameter", "motor", "motor", "height of the cavity", "frequency", "walls", "caps", "walls", "caps")
_SAME = 1e-4
"""Lengths whose logarithms differ by less are the same."""


@dataclass(frozen=True)
class Lengths:
    """Lengths of units of N layers, m: arrays without the layers' axis, but for the caps (0: open rings).

    `features`: for each unit the tuple of those that no measured unit had.
    """

    diameter: np.ndarray
    motor_radius: np.ndarray
    motor_height: np.ndarray
    core_height: np.ndarray
    caps: np.ndarray
    features: np.ndarray


def lengths(variants: Sequence[EstimateInput]) -> Lengths:
    """Return the lengths of variants of one number of layers, a row each."""
    shapes = [variant.geometry for variant in variants]
    features = np.empty(len(shapes), dtype=object)
    features[:] = [variant.features for variant in variants]
    return Lengths(
        np.array([variant.diameter for variant in variants]),
        np.array([shape.motor_radius for shape in shapes]),
        np.array([shape.motor_height for shape in shapes]),
        np.array([shape.core_height for shape in shapes]),
        np.array([[layer.cap for layer in shape.layers] for shape in shapes]),
        features,
    )


@np.errstate(all="ignore")  # a custom design may lack a length
def coordinates(units: Units, of: Lengths) -> np.ndarray:
    """Return the `COORDINATES` of units, shape (rows, 12). They change continuously with the lengths and
    do not depend on cuts within a layer.

    A border between layers counts as much as `borders` says; its place is the silicone outside it over the measured
    units'. Caps count only if a unit has them.
    """
    shared = measurements().unit
    motor = motors()[shared.motor]
    hertz, wall = units.omega / (2.0 * np.pi), 1e-3 * shared.wall_mm
    counts = borders(units)
    capped = of.caps.sum(axis=-1) > 0
    height = 1e-3 * float(motor.thickness_mm)

    def places(each: np.ndarray) -> np.ndarray:
        outside = np.cumsum(each[..., :0:-1], axis=-1)[..., ::-1]
        logs = np.log(np.where(outside > 0, outside, wall) / wall)
        return np.sum(np.abs(counts) * logs, axis=-1)

    columns = [
        np.log(of.diameter / (1e-3 * shared.diameter_mm)),
        np.log(of.motor_radius / (5e-4 * float(motor.diameter_mm))),
        np.log(of.motor_height / height),
        np.log(of.core_height / (height + np.where(capped, 1e-3 * shared.circuit_mm, 0.0))),
        np.log(hertz / np.clip(hertz, *FREQUENCIES)),
        np.log(units.thickness.sum(axis=-1) / (2.0 * wall)),
        np.log(np.where(capped, of.caps.sum(axis=-1), 2.0 * wall) / (2.0 * wall)),
        places(units.thickness),
        places(of.caps),
        units.place[..., 0],
        units.place[..., -1],
        units.passes * counts.sum(axis=-1),
    ]
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def coordinates_of(variant: EstimateInput) -> np.ndarray:
    """Return the `COORDINATES` of one variant, shape (12,)."""
    return coordinates(stack_inputs([variant]), lengths([variant]))[0]


def measured_block(variant: EstimateInput) -> dict[str, Any] | None:
    """Return the paper's measurement of a unit of this design and materials, in both prints; None if there is none.

    `same_size`: whether it is this unit; otherwise `differs_in` names what differs.
    """
    table, layers = measured_table(), tuple(layer.material for layer in variant.layers)
    design = CONTROL if len(layers) == 1 else variant.design
    rows = [i for i in range(len(table.names)) if table.designs[i] == design and table.layers[i] == layers]
    extra = other_prints(design, layers)
    if not rows:
        return extra and {"level": None, **extra}
    index, shared = rows[0], measurements().unit
    differs = [*differing(coordinates_of(variant)), *(feature.name for feature in variant.features)]
    return {
        "level": float(table.levels[index]),
        **(extra or {}),
        "hierarchical_over_control": [
            {"control": table.layers[c][0], "value": float(table.levels[i] / table.levels[c])}
            for i, c in table.pairs
            if i == index
        ]
        or None,
        "same_size": not differs,
        **({"differs_in": differs} if differs else {}),
        "diameter_mm": shared.diameter_mm,
        "frequency_hz": shared.frequency_hz,
        "note": "measured at 0 mm by laser vibrometer on a skin phantom; surface, axis and phantom are not given"
        + (f"; not this unit, which differs in {', '.join(differs)}" if differs else "")
        + ("; the paper does not say which shape its controls had" if design == CONTROL else ""),
    }


def nearest(variant: EstimateInput) -> dict[str, Any]:
    """Return {unit, level, differs_in} of the paper's unit that is nearest to a variant.

    Among units of its class, of its design if there are any, the one whose moduli are nearest.
    """
    table, layers = measured_table(), tuple(layer.material for layer in variant.layers)
    known = _places()
    own = CONTROL if len(layers) == 1 else variant.design
    kind = int(unit_class(stack_inputs([variant]))[0])
    alike = [i for i, group in enumerate(table.classes) if group == kind]
    alike = [i for i in alike if table.designs[i] == own] or alike
    ends = [variant.layers[0].place, variant.layers[-1].place]
    row = min(alike, key=lambda i: (table.layers[i] != layers, float(np.abs(np.nan_to_num(known[i] - ends)).sum())))
    differs = {
        "number of layers": len(layers) != len(table.layers[row]),
        "design": table.designs[row] != own,
        "silicones": table.layers[row] != layers,
    }
    return {
        "unit": table.names[row],
        "level": float(table.levels[row]),
        "differs_in": [
            *(name for name, other in differs.items() if other),
            *differing(coordinates_of(variant)),
            *(feature.name for feature in variant.features),
        ],
    }


@cache
def _places() -> np.ndarray:
    """Return the places of the innermost and outermost silicone of each unit of the table, shape (units, 2)."""
    return measured_table().mean(lambda units: units.place[..., [0, -1]])


def differing(place: np.ndarray) -> list[str]:
    """Return the names of the coordinates of a unit, (12,), that are not as in the measured ones."""
    own = zip(LENGTH_NAMES, place[:LENGTHS], strict=True)
    return list(dict.fromkeys(name for name, far in own if abs(far) > _SAME))


def other_prints(design: str, layers: tuple[str, ...]) -> dict[str, Any] | None:
    """Return the second print of a level, a ratio to an unnamed control, and directions stated without a figure."""
    data = measurements()
    short = {full: name for name, full in data.names.items()}
    if design not in data.designs or any(layer not in short for layer in layers):
        return None
    measured, pair = data.designs[design], "/".join(short[layer] for layer in layers)
    prints = {
        "also_printed": measured.also_printed.get(pair),
        "over_a_control_not_named": measured.over_a_control_not_named.get(pair),
        "direction_stated": measured.directions.get(pair),
    }
    return {key: value for key, value in prints.items() if value is not None} or None
