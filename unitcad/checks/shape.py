"""C000: every solid has volume, one component, and the genus that its drawing means."""

from __future__ import annotations

from collections.abc import Iterator

from manifold3d import Manifold

from unitcad.checks.finding import MouldCheck, MouldFinding
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Plan


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Look at every body of unit and tooling and the pieces of split tools; the genus if one is expected."""
    genus = expected_genus(moulds.plan)
    several = {step.name: step.solids for step in moulds.plan.steps}
    for name, solid in moulds.solids.items():
        yield from _whole(name, solid, several.get(name, 1))
        if name in genus:
            yield _count(f"{name} genus", solid.genus(), genus[name])
    for split in moulds.plan.splits:
        pieces = {piece.name: moulds.mesh(piece) for piece in split.pieces}
        for name, solid in pieces.items():
            yield from _whole(name, solid, 1)
        # A seam that meets no hole leaves as many of them.
        holes, whole = sum(solid.genus() for solid in pieces.values()), moulds.solids[split.tool].genus()
        yield _count(f"{split.tool} genus, all pieces", holes, whole)


def _whole(name: str, solid: Manifold, pieces: int) -> Iterator[MouldFinding]:
    yield _count(f"{name} components", len(solid.decompose()), pieces)
    yield MouldFinding("C000", f"{name} volume", solid.volume() > 0, solid.volume(), 0.0, "mm3")


def _count(where: str, found: int, wanted: int) -> MouldFinding:
    return MouldFinding("C000", where, found == wanted, float(found), float(wanted), "")


def expected_genus(plan: Plan) -> dict[str, int]:
    """Return the number of through holes of each tool.

    A base has a filament hole a core; a cup a bore a cell and a closed window a tail; a lid a sprue and its vents. For
    moulds by complement only the blade's is known; a plan may state others.
    """
    if not plan.concentric:
        return {tool.name: 0 for tool in plan.of_kind("blade")} | dict(plan.genus)
    genus = {tool.name: 0 for tool in plan.tools}
    genus["base"] = len(plan.of_kind("filament"))
    for step in plan.steps:
        genus[step.cup] = len(plan.layout.cells) + step.windows
        if step.lid:
            genus[step.lid] = len(step.channels)
    return genus


CHECK = MouldCheck(
    "C000", "shape: every solid has volume, one component and the genus that its drawing means", findings
)
