"""Laws C000 to C210, on meshes: shape, balance and leak, overlap, gap.

A law compares what was drawn as a unit with what was drawn as tools. Nothing here knows how either was drawn.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from itertools import combinations

import manifold3d
from manifold3d import Manifold

from unitcad.kernels.mesh import realise
from unitcad.moulds.finding import Finding, at_least, at_most, exactly
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


def shape_law(bodies: Iterable[Body], solids: Mapping[str, Manifold], genus: Mapping[str, int]) -> list[Finding]:
    """C000: volume above zero, one component, and the genus that the drawing means, where `genus` names one."""
    found = []
    for body in bodies:
        solid = solids[body.name]
        found.append(exactly("C000", f"{body.name} components", len(solid.decompose()), 1, ""))
        found.append(Finding("C000", f"{body.name} volume", solid.volume() > 0, solid.volume(), 0.0, "mm3"))
        if body.name in genus:
            found.append(exactly("C000", f"{body.name} genus", solid.genus(), genus[body.name], ""))
    return found


def expected_genus(plan: Plan) -> dict[str, int]:
    """Through holes of each tool: a filament hole a core; a bore a cell and a closed window a tail in a cup; a sprue
    and its vents in a lid.
    """
    cells = len(plan.layout.cells)
    genus = {tool.name: 0 for tool in plan.tools}
    genus["base"] = sum(tool.name.startswith("stub") for tool in plan.tools)
    for step in plan.steps:
        genus[step.cup] = cells + step.windows
        if step.lid:
            genus[step.lid] = len(step.channels)
    return genus


def cavities(plan: Plan, solids: Mapping[str, Manifold], segments: int) -> list[list[tuple[Manifold, Manifold]]]:
    """For each pour and each cell what was drawn (layer, and what stands in sprue and vents) and the component of what
    silicone can reach that holds it.
    """
    found, cured = [], Manifold()
    for step in plan.steps:
        layers = [realise(shape, segments) for shape in step.layer]
        held = _held(step, layers, _reached(step, solids, cured, segments), segments)
        if any(abs(holding.volume() - drawn.volume()) > BALANCE * drawn.volume() for drawn, holding in held):
            # Among very fine facets the union of all that touches can lose a wedge: a second opinion, piece by piece.
            held = _held(step, layers, _reached(step, solids, cured, segments, one_by_one=True), segments)
        found.append(held)
        cured = Manifold.batch_boolean([cured, *layers], manifold3d.OpType.Add)
    return found


def _reached(
    step: Step, solids: Mapping[str, Manifold], cured: Manifold, segments: int, *, one_by_one: bool = False
) -> list[Manifold]:
    """What silicone can reach, in components: block - tools - cured layers - seals, at once or `one_by_one`.

    The block is larger than the tools and reaches below the base, so a leak joins the outside to the cavity. It ends at
    the rim plane, where the pour is open and the blade runs, or at the lid's upper face, where sprue and vents open.
    """
    around = [solids[name] for name in step.tools]
    x0, y0, z0, x1, y1, _ = _box_of(around)
    block = realise(box(x0 - 5, x1 + 5, y0 - 5, y1 + 5, z0 - 5, step.top), segments)
    filled = [*around, cured, *(realise(shape, segments) for shape in step.seals)]
    if one_by_one:
        for piece in filled:
            block = block - piece
            block.num_tri()  # evaluated here, or all of it is joined into one operation again
        return block.decompose()
    return Manifold.batch_boolean([block, *filled], manifold3d.OpType.Subtract).decompose()


def _held(
    step: Step, layers: list[Manifold], components: list[Manifold], segments: int
) -> list[tuple[Manifold, Manifold]]:
    channels = [realise(shape, segments) for shape in step.channels]
    share = len(channels) // len(layers)
    found = []
    for i, layer in enumerate(layers):
        drawn = Manifold.batch_boolean([layer, *channels[i * share : (i + 1) * share]], manifold3d.OpType.Add)
        near = [c for c in components if boxes_meet(c, layer)]
        volumes = [(c ^ layer).volume() if len(near) > 1 else 1.0 for c in near]
        found.append((drawn, near[volumes.index(max(volumes))] if near else Manifold()))
    return found


def balance_law(step: Step, cells: list[tuple[Manifold, Manifold]]) -> list[Finding]:
    """C100: each component that holds a layer equals it."""
    found = []
    for i, (drawn, holding) in enumerate(cells):
        # What one has and the other lacks, both ways.
        differ = abs(holding.volume() + drawn.volume() - 2 * (holding ^ drawn).volume())
        where = f"pour {step.index}" + (f" cell {i + 1}" if len(cells) > 1 else "")
        found.append(at_most("C100", where, differ / drawn.volume(), BALANCE, "share of the layer"))
    return found


def overlap_law(plan: Plan, solids: Mapping[str, Manifold], segments: int) -> list[Finding]:
    """C200: no two solids of an assembled pour share volume: tools, cured layers and the one being cast.

    The cells of a layer are put to each other, then count as one solid.
    """
    found: list[Finding] = []
    cast: list[tuple[str, Manifold]] = []
    shared: dict[tuple[str, str], float] = {}
    for step in plan.steps:
        cells = [realise(shape, segments) for shape in step.layer]
        found += _overlaps(f"pour {step.index}", [(f"{step.name}.{i + 1}", c) for i, c in enumerate(cells)], shared)
        cast.append((step.name, Manifold.batch_boolean(cells, manifold3d.OpType.Add)))
        found += _overlaps(f"pour {step.index}", [(name, solids[name]) for name in step.tools] + cast, shared)
    return found


def unit_overlap_law(bodies: Iterable[Body], solids: Mapping[str, Manifold]) -> list[Finding]:
    """C200 for the unit itself."""
    return _overlaps("unit", [(body.name, solids[body.name]) for body in bodies], {})


def gap_law(spec: Spec, plan: Plan, solids: Mapping[str, Manifold], segments: int) -> list[Finding]:
    """C210: faces that must slide have the printer's clearance: skirt and plinth, tongue and window, lid and cup.

    The skirt is measured below the seat, where cup and plinth touch on purpose; the lid's below the rim. Round corners
    are polygons of `segments` a turn on both sides: midway along a facet their gap is the clearance's cosine of pi / n.
    """
    chord = math.cos(math.pi / segments)
    moulds = spec.moulds
    skirt = min(moulds.plinth_clearance_mm, moulds.seat_relief_mm)
    window = moulds.window_clearance_mm
    found = []
    for step in plan.steps:
        cup = solids[step.cup]
        gap = cup.trim_by_plane((0, 0, -1), skirt).min_gap(solids["base"], skirt + 1)
        found.append(at_least("C210", f"{step.cup} skirt and plinth", gap, skirt * chord - GRID, "mm"))
        for tongue in (tool for tool in step.tools if tool.startswith("tongue")):
            gap = cup.min_gap(solids[tongue], window + 1)
            found.append(at_least("C210", f"{step.cup} window and {tongue}", gap, window - GRID, "mm"))
        if step.lid:
            play = moulds.plinth_clearance_mm
            gap = solids[step.lid].trim_by_plane((0, 0, -1), play - step.rim).min_gap(cup, play + 1)
            found.append(at_least("C210", f"{step.lid} skirt and {step.cup}", gap, play * chord - GRID, "mm"))
    return found


def boxes_meet(a: Manifold, b: Manifold) -> bool:
    """Whether the bounding boxes of two solids touch."""
    p, q = a.bounding_box(), b.bounding_box()
    return all(p[i] <= q[i + 3] and q[i] <= p[i + 3] for i in range(3))


def _overlaps(where: str, there: list[tuple[str, Manifold]], shared: dict[tuple[str, str], float]) -> list[Finding]:
    """The pair that shares most, and every pair that shares too much.

    `shared` keeps the volumes by name: a pair that stands together in several pours is cut once.
    """
    pairs = []
    for (a, solid), (b, other) in combinations(there, 2):
        if boxes_meet(solid, other):
            if (a, b) not in shared:
                shared[a, b] = (solid ^ other).volume()
            pairs.append(at_most("C200", f"{where}: {a} and {b}", shared[a, b], OVERLAP, "mm3"))
    return [f for f in pairs if not f.ok] or sorted(pairs, key=lambda f: -f.value)[:1]


def _box_of(solids: list[Manifold]) -> tuple[float, ...]:
    boxes = [solid.bounding_box() for solid in solids]
    return tuple(min(b[i] for b in boxes) for i in range(3)) + tuple(max(b[i] for b in boxes) for i in range(3, 6))
