"""Random specs from documented ranges: one drawing routine; hypothesis chooses in the tests, a seed in the long study.

Each field is drawn independently, so only the ranges decide: a spec inside them may well be refused.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol, TypeVar

from unitcad.designs import estimated_designs

T = TypeVar("T")
MATERIALS = ("ecoflex-00-10", "ecoflex-00-30", "ecoflex-00-50", "dragon-skin-10-medium", "dragon-skin-30")
_STEP = 1000
"""Lengths are drawn in thousandths of a millimetre, as people type them."""


class Choose(Protocol):
    """A source of choices: a seed or hypothesis."""

    def whole(self, low: int, high: int, /) -> int:
        """Return a whole number, both ends included."""
        ...

    def pick(self, options: Sequence[T], /) -> T:
        """Return one of `options`."""
        ...


@dataclass(frozen=True)
class Ranges:
    """The range of each field: (smallest, largest), lengths in mm.

    `tail_share` is half the tail's width over the core's radius, drawn in place of the width if given. `edges`
    is the share of lengths at an end of their range, `singles` that of specs with one cavity.
    """

    diameter_mm: tuple[float, float]
    motor_diameter_mm: tuple[float, float]
    motor_thickness_mm: tuple[float, float]
    layers: tuple[int, int]
    wall_mm: tuple[float, float]
    cap_mm: tuple[float, float]
    tail_width_mm: tuple[float, float]
    fpcb_thickness_mm: tuple[float, float]
    plinth_clearance_mm: tuple[float, float]
    window_clearance_mm: tuple[float, float]
    slot_height_mm: tuple[float, float]
    tolerance_mm: tuple[float, float]
    cavities: tuple[int, int]
    tail_share: tuple[float, float] | None = None
    edges: float = 0.0
    singles: float = 0.0

    def rows(self) -> list[tuple[str, float, float]]:
        """Return (field, least, largest) for a table."""
        return [(f.name, *getattr(self, f.name)) for f in fields(self) if isinstance(getattr(self, f.name), tuple)]


DOCUMENTED = Ranges(
    diameter_mm=(12.0, 60.0),
    motor_diameter_mm=(4.0, 10.0),
    motor_thickness_mm=(1.8, 5.0),
    layers=(1, 3),
    wall_mm=(0.6, 2.5),
    cap_mm=(1.1, 4.0),
    tail_width_mm=(0.6, 4.0),
    fpcb_thickness_mm=(0.05, 0.25),
    plinth_clearance_mm=(0.08, 0.3),
    window_clearance_mm=(0.05, 0.15),
    slot_height_mm=(0.45, 0.7),
    tolerance_mm=(0.002, 0.1),
    cavities=(1, 2),
)
"""The ranges that docs/reference/spec.md calls tried: at least 60 % of the specs drawn here build."""

EXTREME = Ranges(
    diameter_mm=(10.0, 200.0),
    motor_diameter_mm=(3.0, 30.0),
    motor_thickness_mm=(1.0, 12.0),
    layers=(1, 12),
    wall_mm=(0.5, 10.0),
    cap_mm=(0.5, 10.0),
    tail_width_mm=(0.4, 20.0),
    fpcb_thickness_mm=(0.02, 1.0),
    plinth_clearance_mm=(0.005, 1.0),
    window_clearance_mm=(0.005, 0.5),
    slot_height_mm=(0.25, 2.0),
    tolerance_mm=(0.0005, 0.2),
    cavities=(1, 4),
    tail_share=(0.05, 0.75),
    edges=0.2,
    singles=0.5,
)
"""To the limits and past them: most of it is refused."""

RANGES = {"documented": DOCUMENTED, "extreme": EXTREME}


class Seeded:
    """Choices by a seed: the same seed, the same spec, on every machine."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)

    def whole(self, low: int, high: int, /) -> int:
        return self._random.randint(low, high)

    def pick(self, options: Sequence[T], /) -> T:
        return options[self._random.randrange(len(options))]


def random_spec(choose: Choose, ranges: Ranges = DOCUMENTED, formats: Sequence[str] = ("stl",)) -> dict[str, Any]:
    """Return the data of one spec (as `unitcad.validation.from_data` takes it), each field drawn from `ranges`."""

    def length(of: tuple[float, float]) -> float:
        if ranges.edges and choose.whole(1, 100) <= 100 * ranges.edges:
            return choose.pick(of)
        return choose.whole(round(of[0] * _STEP), round(of[1] * _STEP)) / _STEP

    def spread(of: tuple[float, float], digits: int = 4) -> float:
        """Draw uniformly in the logarithm: a range over decades has as many small values as large."""
        share = choose.whole(0, 1000) / 1000
        return round(math.exp(math.log(of[0]) + share * math.log(of[1] / of[0])), digits)

    design = choose.pick(tuple(estimated_designs()))
    motor: dict[str, Any] = {
        "diameter_mm": length(ranges.motor_diameter_mm),
        "thickness_mm": length(ranges.motor_thickness_mm),
        "fill": choose.whole(0, 3) == 0,
    }
    layers = []
    for _ in range(choose.whole(*ranges.layers)):
        layer: dict[str, Any] = {"material": choose.pick(MATERIALS), "wall_mm": length(ranges.wall_mm)}
        if estimated_designs()[design].caps:
            layer["cap_mm"] = length(ranges.cap_mm)
        layers.append(layer)
    diameter = spread(ranges.diameter_mm, 3)
    if ranges.edges and choose.whole(0, 3):
        # Most sums of walls leave no room in a diameter drawn by itself: these are drawn round motor and walls.
        walls = motor["diameter_mm"] / 2 + sum(layer["wall_mm"] for layer in layers)
        diameter = round(min(ranges.diameter_mm[1], 2 * walls + length((0.0, 12.0))), 3)
    alone = ranges.singles and choose.whole(1, 100) <= 100 * ranges.singles
    data: dict[str, Any] = {
        "name": "random",
        "design": design,
        "diameter_mm": diameter,
        "motor": motor,
        "layers": layers,
        "moulds": {
            "plinth_clearance_mm": length(ranges.plinth_clearance_mm),
            "window_clearance_mm": length(ranges.window_clearance_mm),
            "cavities": [1, 1] if alone else [choose.whole(*ranges.cavities), choose.whole(*ranges.cavities)],
        },
        "output": {"formats": list(formats), "tolerance_mm": spread(ranges.tolerance_mm)},
    }
    tail = choose.pick(("none", "one", "both"))
    if tail != "none":
        width = length(ranges.tail_width_mm)
        if ranges.tail_share and choose.whole(0, 1):
            core = motor["diameter_mm"] / 2 if motor["fill"] else diameter / 2 - sum(la["wall_mm"] for la in layers)
            width = round(max(0.001, 2 * core * length(ranges.tail_share)), 3)
        data["fpcb"] = {"tail": tail, "thickness_mm": length(ranges.fpcb_thickness_mm), "tail_width_mm": width}
        if choose.whole(0, 1):
            data["moulds"]["slot_height_mm"] = length(ranges.slot_height_mm)
    return data


def seeded_spec(seed: int, ranges: str = "documented") -> dict[str, Any]:
    """Return the spec of one seed in the named ranges ("documented" or "extreme")."""
    return random_spec(Seeded(seed), RANGES[ranges])
