"""A named solid of a unit or its tooling: what every export, law and report handles."""

from __future__ import annotations

from dataclasses import dataclass

from unitcad.shape.tree import Shape


@dataclass(frozen=True)
class Body:
    """One solid, as assembled (mm, z = 0 at the skin).

    `name` comes from role and layer number alone ("layer1", "cup2", "base"), never from a material or a variant, since
    files of equal bodies are shared. `made` is "cast", "printed", "cut" (from film or filament) or "bought".
    `upside_down`: how it lies on the printer's bed, turned by 180 degrees about x.
    """

    name: str
    role: str  # unit | tool
    shape: Shape
    colour: tuple[float, float, float]
    made: str = "printed"
    step: int | None = None
    upside_down: bool = False
