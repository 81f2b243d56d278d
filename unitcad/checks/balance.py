"""C100: the cavity between tools and earlier layers is the layer, and nothing more.

It compares the drawn unit with the drawn tools, and does not know how either was drawn. In bodies from a file it
ignores films that are no thicker than twice their facets' distance from the surface.
"""

from __future__ import annotations

from collections.abc import Iterator

from manifold3d import Manifold

from unitcad.checks.finding import MouldCheck, MouldFinding, at_most
from unitcad.designs.dimensions import growth, poured
from unitcad.kernels.mesh import realise, thick_pieces
from unitcad.moulds.cavities import BALANCE, Cavity
from unitcad.moulds.complement import films
from unitcad.moulds.lid import films as skin_films
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step, tool_dimensions
from unitcad.shape import cylinder, moved
from unitcad.shape.extent import extent

SHRUNK = 2e-4
"""Share of a length by which cast and cured layer may differ after shrinking: the grid moves either by 1/2048 mm."""


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Compare the space that silicone can reach with the layer, in every cavity, and with the film in a skin's tray."""
    least = films(moulds.spec) if moulds.facets else 0.0
    for cavity in moulds.cavities:
        yield _of_cavity(cavity, least)
    if moulds.spec.moulds.shrinkage_percent:
        for step in moulds.plan.steps:
            cast, cured = moulds.mesh_of(step.layer[0]).volume(), _cured(moulds, step).volume()
            off = abs((cast / cured) ** (1 / 3) / growth(moulds.spec) - 1)
            yield at_most("C100", f"pour {step.index}: as it shrinks", off, SHRUNK, "share of its length")
    for tray in moulds.plan.of_kind("tray"):
        solid, dims = moulds.mesh(tray), moulds.plan.dimensions
        rim, reach = dims.heights[-1], dims.outer_radius + moulds.spec.moulds.land_mm / 2
        floor = extent(tray.shape)[2]
        for i, (cell, drawn) in enumerate(zip(moulds.plan.layout.cells, skin_films(moulds.frame), strict=True), 1):
            film = moulds.mesh_of(drawn)
            column = realise(moved(cylinder(reach, floor, rim), cell.x, cell.y), moulds.segments)
            hollow = column - solid
            differ = hollow.volume() + film.volume() - 2 * (hollow ^ film).volume()
            yield at_most("C100", f"{tray.name} cell {i}", differ / film.volume(), BALANCE, "share of the film")


def _cured(moulds: MouldSet, step: Step) -> Manifold:
    """Return the layer as it should cure: the unit's, or one as high as the whole layers of its tools make it."""
    spec = moulds.spec
    if moulds.origin or not moulds.plan.concentric:
        return moulds.solids[step.name]
    tools = tool_dimensions(spec)
    if tools == poured(spec, moulds.dimensions):
        return moulds.solids[step.name]
    return moulds.mesh_of(moulds.design.layers(spec, tools.scaled(1 / growth(spec)))[step.name])


def _of_cavity(cavity: Cavity, least: float) -> MouldFinding:
    drawn, reached = cavity.drawn, cavity.reached
    # The difference, both ways.
    differ = abs(reached.volume() + drawn.volume() - 2 * (reached ^ drawn).volume())
    if differ > BALANCE * drawn.volume():
        # Of solids that are alike but for a rounding, the intersection can be larger than either: a second opinion.
        rests = reached - drawn, drawn - reached
        differ = sum(piece.volume() for rest in rests for piece in (thick_pieces(rest, least) if least else [rest]))
    return at_most("C100", cavity.where, differ / drawn.volume(), BALANCE, "share of the layer")


CHECK = MouldCheck(
    "C100", "balance and leak: the cavity that tools and earlier layers leave is the layer, and nothing more", findings
)
