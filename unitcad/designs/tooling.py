"""Tooling of a design: blank tools and their cells (mm, as assembled, seat at z = 0)."""

from __future__ import annotations

from dataclasses import dataclass

from unitcad.designs.dimensions import Dimensions
from unitcad.shape import Shape
from unitcad.shape.body import Body


@dataclass(frozen=True)
class Cell:
    """One cavity: its centre, the sides (+1, -1 along x) of its tails, and its number among several ("")."""

    x: float
    y: float
    sides: tuple[int, ...]
    name: str = ""


@dataclass(frozen=True)
class Layout:
    """Cells and half sizes along x and y (mm): `plinth` at z = 0, `cup` and `plate` outside; `key` is a leg."""

    cells: tuple[Cell, ...]
    key: float
    pitch: float
    plinth: tuple[float, float]
    cup: tuple[float, float]
    plate: tuple[float, float]
    label_height: float


@dataclass(frozen=True)
class Tooling:
    """The tools of all pours, without labels, and the other seals.

    dimensions   the lengths that the tools are drawn to; `heights` are the rims of the pours
    layout       cells and plates; the labels go into the plates' corners
    tools        in the order in which a person needs them: "base", and "cup1", "cup2" ... with their pour as `step`; a
                 tool without `step`, except a blade, is part of every pour
    seals        for each pour, space without tool that silicone is kept from
    channels     for each pour under a lid, the silicone in sprue and vents, as many a cell; () if all pours are open
    grooves      for each pour, whether its cup has an overflow groove; () if all have one
    concentric   whether the tools are those of rings: then the dimensions define every hole and gap in them
    """

    dimensions: Dimensions
    layout: Layout
    tools: tuple[Body, ...]
    seals: tuple[tuple[Shape, ...], ...]
    channels: tuple[tuple[Shape, ...], ...] = ()
    grooves: tuple[bool, ...] = ()
    concentric: bool = False

    def __repr__(self) -> str:
        return f"Tooling({', '.join(tool.name for tool in self.tools)})"
