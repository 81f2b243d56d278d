"""A named solid of a unit or its tooling: the unit of every export, mould check and report."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from unitcad.shape.tree import UNTURNED, Place, Shape

Kind = Literal[
    "layer",
    "film",
    "printed",
    "motor",
    "circuit",
    "wire",
    "base",
    "cup",
    "lid",
    "tongue",
    "filament",
    "blade",
    "tray",
    "coupon",
    "frame",
    "holder",
]
"""Kind of a body: a part of the unit (layer to wire) or a piece of tooling."""


@dataclass(frozen=True)
class Body:
    """One solid, as assembled (mm, z = 0 at the skin).

    `name` comes only from role and layer number ("layer1", "cup2", "base"), never from a material or a variant, since
    files of equal bodies are shared. `made` is "cast", "printed", "cut" (from film or filament) or "bought".
    `step` is the pour that it belongs to. `upside_down`: it is printed turned by 180 degrees about x. `removal` is the
    direction in which a piece of tooling is taken away, None for one that stays; the plan has the order. `file` is the
    shape in its files if a printer's error is made up for there.
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
    file: Shape | None = None

    @property
    def in_file(self) -> Body:
        """The body as its files have it."""
        return replace(self, shape=self.file, file=None) if self.file else self

    def __repr__(self) -> str:
        return f"Body({self.name!r}: {self.kind}, {self.made}, {type(self.shape).__name__})"


def copies(bodies: Sequence[Body]) -> list[list[int]]:
    """Return the places in the list of bodies that differ by name and a move alone: as they are printed, one solid."""
    found: dict[object, list[int]] = {}
    for i, body in enumerate(bodies):
        like = (_unmoved(body.shape), body.kind, body.step, body.colour, body.made, body.upside_down)
        found.setdefault(like, []).append(i)
    return list(found.values())


def part_names(bodies: Sequence[Body], parts: Sequence[Sequence[int]]) -> list[str]:
    """Return a name for each part: its body's, or for several copies that of their kind, which no other body has."""
    taken, names = {body.name for body in bodies}, []
    for part in parts:
        first = bodies[part[0]]
        kind = f"{first.kind}{first.step or ''}"
        several = (f"{kind}-{i}" if i else kind for i in itertools.count())
        others = taken - {bodies[i].name for i in part}
        names.append(first.name if len(part) == 1 else next(name for name in several if name not in others))
        taken.add(names[-1])
    return names


def _unmoved(shape: Shape) -> Shape:
    """Return a shape before the last moves that turned nothing."""
    while isinstance(shape, Place) and shape.turn == UNTURNED:
        shape = shape.shape
    return shape
