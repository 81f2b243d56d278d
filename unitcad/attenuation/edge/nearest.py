"""How far a unit is from the measured ones: its own measurement if there is one, the nearest, and the differences."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from unitcad.attenuation.edge.closed_form import Units, borders
from unitcad.attenuation.edge.measured_levels import CONTROL, measured_table, unit_class
from unitcad.attenuation.edge.variant_units import stacked
from unitcad.attenuation.inputs import EstimateInput
from unitcad.catalogue import measurements, motors

FREQUENCIES = (100.0, 150.0)
"""The frequencies of the measured units, Hz (section III-A of the paper)."""
COORDINATES = (
    "diameter", "motor's diameter", "motor's height", "cavity's height", "frequency", "walls", "caps",
    "place of the borders", "place of the borders in the caps", "modulus inside", "modulus outside", "passes",
)  # fmt: skip
"""Logarithms of a unit's inputs over those that all measured units share, then the differences of measured units."""
LENGTHS = 9
"""How many of the `COORDINATES` all measured units of the paper share: they are 0 for them."""
_NAMES = ("diameter", "motor", "motor", "height of the cavity", "frequency", "walls", "caps", "walls", "caps")
_SAME = 1e-4
"""Lengths whose logarithms differ by less are the same."""


@dataclass(frozen=True)
class Lengths:
    """Lengths of units of N layers, m: arrays without the layers' axis, but for the caps (0: open rings)."""

    diameter: np.ndarray
    motor_radius: np.ndarray
    motor_height: np.ndarray
    core_height: np.ndarray
    caps: np.ndarray


def lengths(variants: Sequence[EstimateInput]) -> Lengths:
    """Return the lengths of variants of one number of layers, a row each."""
    shapes = [variant.geometry for variant in variants]
    return Lengths(
        np.array([variant.diameter for variant in variants]),
        np.array([shape.motor_radius for shape in shapes]),
        np.array([shape.motor_height for shape in shapes]),
        np.array([shape.core_height for shape in shapes]),
        np.array([[layer.cap for layer in shape.layers] for shape in shapes]),
    )


def coordinates(units: Units, of: Lengths) -> np.ndarray:
    """Return the `COORDINATES` of units, shape (rows, 12). They change continuously with the body, however it is cut.

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
        np.log(units.youngs_modulus[..., 0]),
        np.log(units.youngs_modulus[..., -1]),
        units.passes * counts.sum(axis=-1),
    ]
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def coordinates_of(variant: EstimateInput) -> np.ndarray:
    """Return the `COORDINATES` of one variant, shape (12,)."""
    return coordinates(stacked([variant]), lengths([variant]))[0]


def measured_block(variant: EstimateInput) -> dict[str, Any] | None:
    """Return the paper's measurement of a unit of this design and materials, in both prints; None if there is none.

    `same_size`: whether it is this unit; otherwise `differs_in` names what differs.
    """
    table, layers = measured_table(), tuple(layer.material for layer in variant.layers)
    design = CONTROL if len(layers) == 1 else variant.design
    rows = [i for i in range(len(table.names)) if table.designs[i] == design and table.layers[i] == layers]
    extra = printed_besides(design, layers)
    if not rows:
        return extra and {"level": None, **extra}
    index, shared, differs = rows[0], measurements().unit, _differs_from_all(variant)
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
    """Return {unit, level, differs_in, not_read} of the paper's unit that is nearest to a variant.

    `differs_in`: inputs that widen the range; `not_read`: inputs that the range does not know.

    Among units of its class, of its design if there are any, the one whose moduli are nearest.
    """
    table, layers = measured_table(), tuple(layer.material for layer in variant.layers)
    known = _moduli(variant.moduli)
    own = CONTROL if len(layers) == 1 else variant.design
    kind = int(unit_class(stacked([variant]))[0])
    alike = [i for i, group in enumerate(table.classes) if group == kind]
    alike = [i for i in alike if table.designs[i] == own] or alike
    ends = np.log([layer.youngs_modulus.middle for layer in (variant.layers[0], variant.layers[-1])])
    row = min(alike, key=lambda i: (table.layers[i] != layers, float(np.abs(np.nan_to_num(known[i] - ends)).sum())))
    differs = {
        "number of layers": len(layers) != len(table.layers[row]),
        "design": table.designs[row] != own,
        "silicones": table.layers[row] != layers,
    }
    return {
        "unit": table.names[row],
        "level": float(table.levels[row]),
        "differs_in": [*(name for name, other in differs.items() if other), *differing(coordinates_of(variant))],
        "not_read": _not_read(variant),
    }


@cache
def _moduli(moduli: Any) -> np.ndarray:
    """Return ln modulus of the innermost and outermost layer of each unit of the table, shape (units, 2)."""
    return measured_table(moduli).mean(lambda units: np.log(units.youngs_modulus[..., [0, -1]]))


def _differs_from_all(variant: EstimateInput) -> list[str]:
    """Return the inputs that the measured units share and this unit does not."""
    return [*differing(coordinates_of(variant)), *_not_read(variant)]


def _not_read(variant: EstimateInput) -> list[str]:
    """Return the inputs that the measured units share, this unit does not, and neither model nor range reads."""
    shared = measurements().unit
    motor = motors()[shared.motor]
    return [
        *(["drive"] if motor.drive is not None and variant.drive != motor.drive.value else []),
        *(["body"] if variant.tissue_name != shared.tissue else []),
        *variant.unread,
    ]


def differing(place: np.ndarray) -> list[str]:
    """Return the names of the coordinates of a unit, (12,), that are not as in the measured ones."""
    own = zip(_NAMES, place[:LENGTHS], strict=True)
    return list(dict.fromkeys(name for name, far in own if abs(far) > _SAME))


def printed_besides(design: str, layers: tuple[str, ...]) -> dict[str, Any] | None:
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
