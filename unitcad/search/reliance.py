"""What a candidate relies on that no measurement behind the models covers."""

from __future__ import annotations

import numpy as np

from unitcad.catalogue import Measurements, measurements, motors
from unitcad.search.candidates import Candidates
from unitcad.search.geometries import Lengths
from unitcad.text import listed, number

BLIND: dict[str, tuple[str, ...]] = {
    "crossings": ("wall", "cap", "diameter", "frequency"),
    "fitted": ("wall", "cap", "diameter", "frequency"),
    "bush": ("frequency",),
    "paper": ("cap", "diameter"),
    "consistent": ("cap", "diameter"),
}
"""Lengths and other inputs that a model does not read."""
_SAME = 1e-6


def reliance(found: Candidates, row: int) -> list[str]:
    """Return the sentences on what of a candidate lies outside the measured units, the lengths first."""
    return [*length_notes(found, found.lengths(row)), *_kinds(found, row, measurements())]


def length_notes(found: Candidates, lengths: Lengths) -> list[str]:
    """Return what is to be said of walls, caps and diameter that no measured unit had, and which models read them."""
    shared, count = measurements().unit, len(lengths.walls)
    wall = 2 * shared.wall_mm / count
    of = f"the measured units of {_layers(count)} had {wall:g} mm each"
    notes = []
    if any(abs(each - wall) > _SAME for each in lengths.walls):
        notes.append(f"walls of {_mm(lengths.walls)}: {of}{_unread(found, 'wall')}")
    if lengths.caps != lengths.walls and any(abs(each - wall) > _SAME for each in lengths.caps):
        notes.append(f"caps of {_mm(lengths.caps)}: {of}{_unread(found, 'cap')}")
    if abs(lengths.diameter - shared.diameter_mm) > _SAME:
        every = f"every measured unit had {shared.diameter_mm:g} mm"
        notes.append(f"a diameter of {lengths.diameter:g} mm: {every}{_unread(found, 'diameter')}")
    return notes


def _kinds(found: Candidates, row: int, data: Measurements) -> list[str]:
    lengths, names = found.lengths(row), found.materials(row)
    notes = []
    if lengths.design not in data.designs:
        notes.append(f"the design {lengths.design}: none of it was measured")
    tried = {name for unit in _units(data) for name in data.layers(unit)}
    new = [name for name in dict.fromkeys(names) if name not in tried]
    if new:
        notes.append(f"{listed(new)}: in no measured unit")
    elif lengths.design in data.designs and len(names) > 1:
        pairs = {data.layers(unit) for unit in data.designs[lengths.design].levels}
        if names not in pairs:
            notes.append("these silicones in this order: measured in no unit of this design")
    if lengths.motor != data.unit.motor:
        known = motors(found.target.asked.motors)[lengths.motor]
        size = f"{float(known.diameter_mm):g} x {float(known.thickness_mm):g} mm"
        notes.append(f"the motor {lengths.motor} ({size}): every unit was measured with {data.unit.motor}")
    variant = found.geometries[found.geometry[row]].variant
    if not np.isclose(variant.frequency.middle, data.unit.frequency_hz, rtol=0.01):
        hertz, measured = number(variant.frequency.middle, 3), number(data.unit.frequency_hz, 3)
        notes.append(f"{hertz} Hz: measured was at {measured} Hz{_unread(found, 'frequency')}")
    return notes


def _units(data: Measurements) -> list[str]:
    return [*data.controls, *(unit for design in data.designs.values() for unit in design.levels)]


def _unread(found: Candidates, length: str) -> str:
    """Say which of the models that count do not read an input."""
    blind = [model for model in found.predictive.models if length in BLIND.get(model, ())]
    if not blind:
        return ""
    if len(blind) == len(found.predictive.models):
        return ", and no model here reads it"
    return f", and {listed(blind)} {'does' if len(blind) == 1 else 'do'} not read it"


def _layers(count: int) -> str:
    return "one layer" if count == 1 else f"{count} layers"


def _mm(lengths: tuple[float, ...]) -> str:
    return f"{listed(f'{length:g}' for length in lengths)} mm"
