"""The sets of lengths that a target lets vary, each validated by its design, and those that a design refuses."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from unitcad import catalogue
from unitcad.attenuation.inputs import EstimateInput
from unitcad.catalogue import measurements
from unitcad.designs import dimensions
from unitcad.designs import shipped as designs
from unitcad.designs.dimensions import MOTOR_CLEARANCE
from unitcad.errors import Refusal
from unitcad.estimating import drawn_input
from unitcad.search.target_file import MOST_GEOMETRIES, Target
from unitcad.spec import Spec
from unitcad.validation import from_data

Say = Callable[[str], None]


@dataclass(frozen=True)
class Lengths:
    """What is varied of a unit beside its silicones, mm: walls and caps inside out; a design may have no caps."""

    design: str
    motor: str
    walls: tuple[float, ...]
    caps: tuple[float, ...]
    diameter: float


@dataclass(frozen=True)
class Geometry:
    """Lengths that a design accepts: spec and estimate's input, with some silicone in every layer; height in mm."""

    lengths: Lengths
    spec: Spec
    variant: EstimateInput
    height: float


def spec_data(target: Target, lengths: Lengths, materials: tuple[str, ...], name: str = "candidate") -> dict[str, Any]:
    """Return the plain data of a candidate's spec."""
    tables = target.entries
    layers: list[dict[str, Any]] = [
        {"material": material, "wall_mm": wall} for material, wall in zip(materials, lengths.walls, strict=True)
    ]
    for layer, cap in zip(layers, lengths.caps, strict=False):
        layer["cap_mm"] = cap
    return {
        "name": name,
        "design": lengths.design,
        "diameter_mm": lengths.diameter,
        **tables,
        "motor": {"part": lengths.motor, **tables.get("motor", {})},
        "layers": layers,
    }


def height_of(spec: Spec) -> float:
    """Return the height of a unit over the skin, its circuit's pad included, mm."""
    dims = dimensions(spec)
    return max(dims.heights[-1], dims.pad.high if dims.pad else 0.0, dims.motor_height)


def geometry_of(target: Target, lengths: Lengths) -> Geometry:
    """Return the geometry of lengths. Raises Refusal where the design does not accept them."""
    spec = from_data(spec_data(target, lengths, (target.materials[0],) * len(lengths.walls)))
    return Geometry(lengths, spec, drawn_input(spec), height_of(spec))


@dataclass
class Refused:
    """Lengths that a design did not accept for one field: how many, and the first one's reason."""

    count: int
    first: str


def geometries(target: Target, say: Say = lambda stage: None) -> tuple[list[Geometry], dict[str, Refused]]:
    """Return every geometry that the target lets vary, and what was refused, by design and field.

    Raises Refusal for more than `MOST_GEOMETRIES`, and, with the design's own sentence, where none is accepted.
    """
    wanted = list(itertools.islice(_lengths(target), MOST_GEOMETRIES + 1))
    vary = target.asked.vary
    if len(wanted) > MOST_GEOMETRIES:
        limit = f"makes more than {MOST_GEOMETRIES} sets of lengths to try; widen the step or narrow the ranges"
        raise Refusal("vary.step_mm", vary.step_mm, limit, 2 * vary.step_mm)
    found: list[Geometry] = []
    refused: dict[str, Refused] = {}
    last = None
    for i, lengths in enumerate(wanted):
        if i % 200 == 0:
            say(f"lengths {i} of {len(wanted)}")
        try:
            found.append(geometry_of(target, lengths))
        except Refusal as refusal:
            last = refusal
            refused.setdefault(f"{lengths.design}, {refusal.field}", Refused(0, refusal.limit)).count += 1
    if last and not found:
        raise last
    return found, refused


def _lengths(target: Target) -> Iterator[Lengths]:
    vary, known = target.asked.vary, designs()
    caps = grid(vary.cap_mm, vary.step_mm) if vary.cap_mm else ()
    for design, motor, count in itertools.product(target.designs, target.asked.at_hand.motors, sorted(vary.layers)):
        for chosen in itertools.product(grid(vary.walls(count), vary.step_mm), repeat=count):
            if not known[design].caps:
                over: list[tuple[float, ...]] = [()]
            else:
                over = list(itertools.product(caps, repeat=count)) if caps else [chosen]
            for diameter, cap in itertools.product(_diameters(target, motor, chosen), over):
                yield Lengths(design, motor, chosen, cap, diameter)


def _diameters(target: Target, motor: str, walls: tuple[float, ...]) -> tuple[float, ...]:
    """Return the diameters to try: those that are given, else the measured one or the least that takes the motor."""
    vary = target.asked.vary
    if vary.diameter_mm:
        return grid(vary.diameter_mm, vary.diameter_step_mm)
    usual, most = measurements().unit.diameter_mm, target.wish.diameter_max_mm
    least = least_diameter(target, motor, walls)
    return (max(usual if most is None else min(usual, most), least),)


def least_diameter(target: Target, motor: str, walls: tuple[float, ...]) -> float:
    """Return the least diameter that motor, clearance and walls fit, to a tenth of a millimetre above."""
    table: Mapping[str, Any] = target.entries.get("motor", {})
    wide = table.get("diameter_mm") or float(catalogue.motors(target.asked.motors)[motor].diameter_mm)
    clearance = 0.0 if table.get("fill") else MOTOR_CLEARANCE
    return math.ceil(10 * (wide + 2 * (clearance + sum(walls))) - 1e-6) / 10


def grid(ends: tuple[float, float], step: float) -> tuple[float, ...]:
    """Return the values from the least to the largest, a step apart, the largest among them."""
    low, high = ends
    count = math.floor((high - low) / step + 1e-9)
    values = [round(low + i * step, 6) for i in range(count + 1)]
    return tuple(values if np.isclose(values[-1], high) else [*values, high])
