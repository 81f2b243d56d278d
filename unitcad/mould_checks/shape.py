"""C000: every solid has volume, one component, and the genus that its drawing means."""

from __future__ import annotations

from unitcad.mould_checks.check import MouldCheck
from unitcad.mould_checks.finding import MouldFinding, exactly
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Plan


def findings(moulds: MouldSet) -> list[MouldFinding]:
    """Look at every body of unit and tooling; genus only where the drawing means one."""
    genus, found = expected_genus(moulds.plan), []
    for body in (*moulds.unit, *moulds.plan.tools):
        solid = moulds.solids[body.name]
        found.append(exactly("C000", f"{body.name} components", len(solid.decompose()), 1, ""))
        found.append(MouldFinding("C000", f"{body.name} volume", solid.volume() > 0, solid.volume(), 0.0, "mm3"))
        if body.name in genus:
            found.append(exactly("C000", f"{body.name} genus", solid.genus(), genus[body.name], ""))
    return found


def expected_genus(plan: Plan) -> dict[str, int]:
    """Return the through holes of each tool: a filament hole a core; a bore a cell and a closed window a tail in a cup;
    a sprue and its vents in a lid. Of moulds by complement only the blade's is known.
    """
    if plan.by_complement:
        return {tool.name: 0 for tool in plan.of_kind("blade")}
    genus = {tool.name: 0 for tool in plan.tools}
    genus["base"] = len(plan.of_kind("stub"))
    for step in plan.steps:
        genus[step.cup] = len(plan.layout.cells) + step.windows
        if step.lid:
            genus[step.lid] = len(step.channels)
    return genus


CHECK = MouldCheck(
    "C000", "shape: every solid has volume, one component and the genus that its drawing means", findings
)
