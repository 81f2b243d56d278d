"""A named solid of a unit or its tooling: what every export, mould check and report handles."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from unitcad.shape.tree import Shape

Kind = Literal[
    "layer",
    "printed",
    "motor",
    "circuit",
    "wire",
    "base",
    "cup",
    "lid",
    "tongue",
    "stub",
    "blade",
    "coupon",
    "frame",
    "holder",
]
"""What a body is: a part of the unit (layer to wire) or a piece of tooling."""


@dataclass(frozen=True)
class Body:
    """One solid, as assembled (mm, z = 0 at the skin).

    `name` comes from role and layer number alone ("layer1", "cup2", "base"), never from a material or a variant, since
    files of equal bodies are shared. `made` is "cast", "printed", "cut" (from film or filament) or "bought".
    `step` is the pour that it belongs to. `upside_down`: how it lies on the printer's bed, turned by 180 degrees about
    x. `removal` is the direction in which a piece of tooling is taken away, None for one that stays; the plan
    has the order.
    """

    name: str
    role: Literal["unit", "tool"]
    kind: Kind
    shape: Shape
    colour: tuple[float, float, float]
    made: Literal["cast", "printed", "cut", "bought"] = "printed"
    step: int | None = None
    upside_down: bool = False
    removal: tuple[float, float, float] | None = None

    def __repr__(self) -> str:
        return f"Body({self.name!r}: {self.kind}, {self.made}, {type(self.shape).__name__})"
