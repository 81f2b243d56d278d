"""A unit beside the paper's measured ones: its own measurement if there is one, and what no measured unit had."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from unitcad.attenuation.edge.bush import sections
from unitcad.attenuation.edge.closed_form import Section
from unitcad.attenuation.edge.measured_levels import CONTROL, measured_table
from unitcad.attenuation.inputs import EstimateInput, Geometry
from unitcad.catalogue import measurements, motors

_SAME = 1e-6
"""Lengths that differ by less are the same, m."""


def measured_block(variant: EstimateInput) -> dict[str, Any] | None:
    """Return the paper's measurement of a unit of this design and materials, in both prints; None if there is none.

    `same_size`: whether it is this unit; else `differs_in` names what is another one.
    """
    table, layers = measured_table(), tuple(layer.material for layer in variant.layers)
    design = CONTROL if len(layers) == 1 else variant.design
    rows = [i for i in range(len(table.names)) if table.designs[i] == design and table.layers[i] == layers]
    extra = printed_besides(design, layers)
    if not rows:
        return extra and {"level": None, **extra}
    index = rows[0]
    lengths = _other_lengths(sections([variant.geometry]), table.inputs[index].section)
    differs, shared = [*_differs_from_all(variant), *lengths], measurements().unit
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
        "note": "measured at 0 mm by laser vibrometer on a skin phantom; axis and phantom are not given"
        + (f"; not this unit, which differs in {', '.join(differs)}" if differs else "")
        + ("; the paper does not say which shape its controls had" if design == CONTROL else ""),
    }


def unlike_measured(variant: EstimateInput) -> list[str]:
    """Return what of a unit no measured one had, against the nearest of those of its design and number of layers."""
    table, count = measured_table(), len(variant.layers)
    alike = [i for i, layers in enumerate(table.layers) if len(layers) == count]
    design = CONTROL if count == 1 else variant.design
    own = [i for i in alike if table.designs[i] == design]
    measured = {name for layers in table.layers for name in layers}
    kinds = {
        "number of layers": not alike,
        "design": bool(alike) and not own,
        "silicones": any(layer.material not in measured for layer in variant.layers),
    }
    lengths = _nearest(variant.geometry, tuple(own or alike))
    return [*(name for name, other in kinds.items() if other), *_differs_from_all(variant), *lengths]


@lru_cache(maxsize=64)
def _nearest(geometry: Geometry, rows: tuple[int, ...]) -> tuple[str, ...]:
    """Return which lengths of a unit are not as in the nearest of some rows of the table."""
    shape, table = sections([geometry]), measured_table()
    return tuple(min((_other_lengths(shape, table.inputs[i].section) for i in rows), key=len, default=[]))


def _differs_from_all(variant: EstimateInput) -> tuple[str, ...]:
    """Return what of a unit is not as in the measured ones, of what these share."""
    geometry, frequency = variant.geometry, variant.frequency.middle
    lengths = geometry.motor_height, geometry.motor_radius, variant.diameter
    return _differs(*lengths, variant.drive, variant.tissue_name, frequency)


@lru_cache(maxsize=64)
def _differs(height: float, radius: float, diameter: float, drive: str, body: str, frequency: float) -> tuple[str, ...]:
    shared = measurements().unit
    motor = motors()[shared.motor]
    of_all = {
        "motor": not np.isclose(height, 1e-3 * float(motor.thickness_mm), atol=_SAME)
        or not np.isclose(radius, 5e-4 * float(motor.diameter_mm), atol=_SAME),
        "diameter": not np.isclose(diameter, 1e-3 * shared.diameter_mm, atol=_SAME),
        "drive": motor.drive is not None and drive != motor.drive.value,
        "body": body != shared.tissue,
        "frequency": not np.isclose(frequency, shared.frequency_hz),
    }
    return tuple(name for name, other in of_all.items() if other)


def _other_lengths(own: Section, shapes: Section | None) -> list[str]:
    """Return which lengths of a unit are not as in a measured one, against the nearest of its possible shapes."""
    by_shape = []
    assert shapes is not None  # every unit of the catalogue's table has a section
    walls = _walls(own, 0)
    for i in range(len(np.atleast_1d(shapes.cavity_radius))):
        of_shape = {
            "walls": np.any(np.abs(walls - _walls(shapes, i)) > _SAME),
            "caps": np.any(np.abs(own.caps[0] - shapes.caps[i]) > _SAME),
            "height of the cavity": abs(own.core_height[0] - shapes.core_height[i]) > _SAME,
        }
        by_shape.append([name for name, other in of_shape.items() if other])
    return min(by_shape, key=len)


def _walls(section: Section, row: int) -> np.ndarray:
    """Return the walls of a row of a section, from the inside out, m."""
    return np.diff(np.append(section.cavity_radius[row], section.outer_radii[row]))


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
