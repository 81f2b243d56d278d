"""C100: the cavity between tools and earlier layers is the layer, and nothing more.

It compares the drawn unit with the drawn tools, and does not know how either was drawn. In bodies from a file it
ignores films that are no thicker than their facets' distance from the surface.
"""

from __future__ import annotations

from collections.abc import Iterator

from unitcad.checks.check import MouldCheck
from unitcad.checks.each_cavity import each_cavity
from unitcad.checks.finding import MouldFinding, at_most
from unitcad.kernels.mesh import thick_pieces
from unitcad.moulds.cavities import BALANCE, Cavity
from unitcad.moulds.mould_set import MouldSet


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Compare the space that silicone can reach with the layer, in every cavity."""
    return each_cavity(moulds, lambda cavity: _of_cavity(cavity, moulds.facets))


def _of_cavity(cavity: Cavity, facets: float) -> Iterator[MouldFinding]:
    drawn, reached = cavity.drawn, cavity.reached
    # The difference, both ways.
    differ = abs(reached.volume() + drawn.volume() - 2 * (reached ^ drawn).volume())
    if facets and differ > BALANCE * drawn.volume():
        differ = sum(piece.volume() for rest in (reached - drawn, drawn - reached) for piece in thick_pieces(rest))
    yield at_most("C100", cavity.where, differ / drawn.volume(), BALANCE, "share of the layer")


CHECK = MouldCheck(
    "C100", "balance and leak: the cavity that tools and earlier layers leave is the layer, and nothing more", findings
)
