"""The laws of a mould: which there are, and a whole set judged by all of them.

C000 shape, C100 balance and leak, C200 overlap, C210 gap (fit), C300 draw, C310 strain, C400 air.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from manifold3d import Manifold

from unitcad.moulds import fit
from unitcad.moulds.air import air_law
from unitcad.moulds.dents import deepest
from unitcad.moulds.draw import draw_law
from unitcad.moulds.finding import Finding, as_dict
from unitcad.moulds.plan import Plan
from unitcad.moulds.strain import Strain, strain_law, strains
from unitcad.shape.body import Body
from unitcad.spec import Spec

CODES = {
    "C000": "shape: every solid has volume, one component and the genus that its drawing means",
    "C100": "balance and leak: the cavity that tools and earlier layers leave is the layer, and nothing more",
    "C200": "overlap: no two solids of an assembled step share volume",
    "C210": "gap: faces that slide have the printer's clearance",
    "C300": "draw: every piece comes out in the person's order",
    "C310": "strain: where silicone stretches it keeps the margin on its elongation",
    "C400": "air: every high region of a cavity meets the rim or a vent, level and tilted",
}

__all__ = ["CODES", "Finding", "Strain", "as_dict", "geometric_laws", "judge", "strain_law", "strains"]


def judge(
    spec: Spec, unit: tuple[Body, ...], plan: Plan, solids: Mapping[str, Manifold], segments: int
) -> list[Finding]:
    """All laws over a unit and its moulds, in a stable order. `solids` has every body of both by name."""
    strained = strain_law(spec, strains(spec, plan, solids, segments))
    cells = fit.cavities(plan, solids, segments)
    found = geometric_laws(spec, unit, plan, solids, segments, cells)
    return sorted(found + strained, key=lambda finding: finding.code)


def geometric_laws(
    spec: Spec,
    unit: tuple[Body, ...],
    plan: Plan,
    solids: Mapping[str, Manifold],
    segments: int,
    cells: Sequence[list[tuple[Manifold, Manifold]]],
) -> list[Finding]:
    """The laws that read no silicone: all but C310. Variants of one geometry share them. `cells`: `fit.cavities`."""
    found = fit.shape_law((*unit, *plan.tools), solids, fit.expected_genus(plan))
    found += fit.unit_overlap_law(unit, solids)
    found += fit.overlap_law(plan, solids, segments)
    for layer, (step, poured) in enumerate(zip(plan.steps, cells, strict=True)):
        found += fit.balance_law(step, poured)
        found += air_law(step, [holding for _, holding in poured], deepest(spec, layer))
    found += fit.gap_law(spec, plan, solids, segments)
    overlapping = any(finding.code == "C200" and not finding.ok for finding in found)
    return found + draw_law(plan, solids, segments, overlapping)
