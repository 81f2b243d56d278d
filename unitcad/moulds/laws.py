"""The laws of a mould, judged on meshes: shape, balance and leak, overlap, gap. Each returns findings, not a verdict.

A law compares what was drawn as a unit with what was drawn as tools. Nothing here knows how either was drawn.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import combinations

import manifold3d
from manifold3d import Manifold

from unitcad.kernels.mesh import realise
from unitcad.moulds.plan import Plan, Step
from unitcad.shape import box
from unitcad.shape.body import Body
from unitcad.shape.profile import GRID_PER_MM
from unitcad.spec import Spec

BALANCE = 1e-6
"""Largest share of a layer's volume by which cavity and layer may differ."""
GRID = 2 / GRID_PER_MM
"""What snapping two faces to the grid may take from the clearance between them, mm."""
OVERLAP = 1e-6
"""Largest volume two pieces may share, mm3: what rounding leaves where faces touch."""


@dataclass(frozen=True)
class Finding:
    """One law at one place: `value` against `limit` in `unit`, and whether it holds."""

    code: str
    where: str
    ok: bool
    value: float
    limit: float
    unit: str


def shape_law(bodies: Iterable[Body], solids: Mapping[str, Manifold], genus: Mapping[str, int]) -> list[Finding]:
    """C000: volume above zero, one component, and the genus that the drawing means, where `genus` names one."""
    found = []
    for body in bodies:
        solid = solids[body.name]
        found.append(_finding("C000", f"{body.name} components", len(solid.decompose()), 1, "", exact=True))
        found.append(Finding("C000", f"{body.name} volume", solid.volume() > 0, solid.volume(), 0.0, "mm3"))
        if body.name in genus:
            found.append(_finding("C000", f"{body.name} genus", solid.genus(), genus[body.name], "", exact=True))
    return found


def balance_law(step: Step, solids: Mapping[str, Manifold], segments: int) -> list[Finding]:
    """C100: block(0..rim) - tools - earlier layers - seals; each component that holds a layer must equal it.

    The block is larger than the tools, so a leak joins the outside to the cavity; it ends at the rim plane, where the
    pour is open and the blade runs.
    """
    around = [solids[name] for name in step.tools]
    x0, y0, _, x1, y1, _ = _box_of(around)
    block = realise(box(x0 - 5, x1 + 5, y0 - 5, y1 + 5, 0, step.rim), segments)
    filled = around + [realise(shape, segments) for shape in (*step.earlier, *step.seals)]
    rest = Manifold.batch_boolean([block, *filled], manifold3d.OpType.Subtract)
    components = rest.decompose()
    layers = [realise(shape, segments) for shape in step.layer]
    found = []
    for i, layer in enumerate(layers):
        holding = max(components, key=lambda c, layer=layer: (c ^ layer).volume(), default=Manifold())
        differ = (holding - layer).volume() + (layer - holding).volume()
        where = f"pour {step.index}" + (f" cell {i + 1}" if len(layers) > 1 else "")
        found.append(_finding("C100", where, differ / layer.volume(), BALANCE, "share of the layer"))
    return found


def overlap_law(step: Step, solids: Mapping[str, Manifold], segments: int) -> list[Finding]:
    """C200: no two solids of an assembled step share volume: tools, cured layers and the one being cast."""
    there = [(name, solids[name]) for name in step.tools]
    there += [(f"{step.name}.{i + 1}", realise(shape, segments)) for i, shape in enumerate(step.layer)]
    there += [(f"cured.{i + 1}", realise(shape, segments)) for i, shape in enumerate(step.earlier)]
    return _overlaps(f"pour {step.index}", there)


def unit_overlap_law(bodies: Iterable[Body], solids: Mapping[str, Manifold]) -> list[Finding]:
    """C200 for the unit itself."""
    return _overlaps("unit", [(body.name, solids[body.name]) for body in bodies])


def _overlaps(where: str, there: list[tuple[str, Manifold]]) -> list[Finding]:
    """The pair that shares most, and every pair that shares too much."""
    pairs = [
        _finding("C200", f"{where}: {a} and {b}", (solid ^ other).volume(), OVERLAP, "mm3")
        for (a, solid), (b, other) in combinations(there, 2)
        if _boxes_meet(solid, other)
    ]
    return [f for f in pairs if not f.ok] or sorted(pairs, key=lambda f: -f.value)[:1]


def gap_law(spec: Spec, plan: Plan, solids: Mapping[str, Manifold]) -> list[Finding]:
    """C210: faces that must slide have the printer's clearance: skirt and plinth, tongue and window.

    The skirt is measured below the seat, where cup and plinth touch on purpose.
    """
    moulds = spec.moulds
    skirt = min(moulds.plinth_clearance_mm or 0, moulds.seat_relief_mm or 0)
    window = moulds.window_clearance_mm or 0
    found = []
    for step in plan.steps:
        name = step.tools[1]
        below_seat = solids[name].trim_by_plane((0, 0, -1), skirt)
        gap = below_seat.min_gap(solids["base"], skirt + 1)
        found.append(_at_least("C210", f"{name} skirt and plinth", gap, skirt - GRID))
        for tongue in (tool for tool in step.tools if tool.startswith("tongue")):
            gap = solids[name].min_gap(solids[tongue], window + 1)
            found.append(_at_least("C210", f"{name} window and {tongue}", gap, window - GRID))
    return found


def expected_genus(spec: Spec, plan: Plan) -> dict[str, int]:
    """Through holes of each tool: a filament hole a core; a bore a cell and a window a tail in a cup."""
    cells = plan.layout.cells
    tails = sum(len(c.sides) for c in cells) if spec.design == "encapsulating" else 0
    genus = {"base": len(cells) if spec.design == "encapsulating" else 0, "blade": 0}
    genus.update({f"cup{step.index}": len(cells) + tails for step in plan.steps})
    genus.update({tool.name: 0 for tool in plan.tools if tool.name.startswith(("tongue", "stub"))})
    return genus


def judge(
    spec: Spec, unit: tuple[Body, ...], plan: Plan, solids: Mapping[str, Manifold], segments: int
) -> list[Finding]:
    """Laws 0, 1 and 2 over a unit and its moulds, in a stable order."""
    found = shape_law((*unit, *plan.tools), solids, expected_genus(spec, plan))
    found += unit_overlap_law(unit, solids)
    for step in plan.steps:
        found += balance_law(step, solids, segments)
        found += overlap_law(step, solids, segments)
    return found + gap_law(spec, plan, solids)


def _finding(code: str, where: str, value: float, limit: float, unit: str, exact: bool = False) -> Finding:
    ok = value == limit if exact else value <= limit
    return Finding(code, where, bool(ok), float(value), float(limit), unit)


def _at_least(code: str, where: str, value: float, limit: float) -> Finding:
    return Finding(code, where, bool(value >= limit), float(value), float(limit), "mm")


def _boxes_meet(a: Manifold, b: Manifold) -> bool:
    p, q = a.bounding_box(), b.bounding_box()
    return all(p[i] <= q[i + 3] and q[i] <= p[i + 3] for i in range(3))


def _box_of(solids: list[Manifold]) -> tuple[float, ...]:
    boxes = [solid.bounding_box() for solid in solids]
    return tuple(min(b[i] for b in boxes) for i in range(3)) + tuple(max(b[i] for b in boxes) for i in range(3, 6))
