"""Moulds for any cast shape, by complement: what is left of a block round the layers that are cast so far.

        lug    .---------------------.   rim: the top of what is cast so far
     ----------'                     |
     | support |   .-------------.   |   cup      not under silicone, and joined to the block's outside
     |         |   |    core     |   |   base     under silicone (core, support), or alone in a hole (post)
    =======================================  seat, z = 0

What is under silicone can't be lifted past it, so it stands on the base; the rest is lifted off upwards. Where cup and
base slide along each other the cup is cut back by the printer's clearance, and that slit is the pour's seal.
Balance (C100) holds by construction here and proves nothing: draw, strain, air, opening and printability decide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from manifold3d import Manifold, OpType

from unitcad.designs import design_of, dimensions, inserts
from unitcad.designs.parts import BEYOND
from unitcad.designs.tooling import Tooling
from unitcad.errors import UNIT_ALONE, Refusal
from unitcad.kernels.mesh import area_true, arrays, bounds, realise, segment_count
from unitcad.kernels.sections import widest
from unitcad.moulds.base import stand
from unitcad.moulds.blade import blade
from unitcad.moulds.cup import cup_blank, groove, grooves, recess, skirt_end
from unitcad.moulds.layout import layout
from unitcad.moulds.pieces import base_piece, blade_piece, cup_piece
from unitcad.moulds.pour_opening import LEAST_AREA, LEAST_WIDTH, regions
from unitcad.shape import Below, Common, Component, Cut, Shape, box, cut, moved, union
from unitcad.shape.profile import GRID_PER_MM
from unitcad.spec import Spec

SLIVER = 1e-3
"""Volume up to which a piece is what rounding leaves between two faces, mm3."""
FLAT = math.ceil(10 * math.sqrt(4 * LEAST_AREA / math.pi)) / 10
"""Diameter of a disc that is large enough to pour through, mm."""
LEVEL = 1 / GRID_PER_MM
"""Heights nearer than this are one, mm."""


def complement(spec: Spec, cast: Sequence[Shape]) -> Tooling:
    """Return the moulds of the layers `cast`, in the order of their pours, drawn about the unit's axis.

    Where what the design lays into the mould leads out of the silicone, the base carries it, and the cup has a slot
    for it, open downwards. Raises Refusal, with the pour and the place, for layers that leave a piece of mould that
    nothing holds.
    """
    if spec.moulds.pour == "injected":
        raise Refusal("moulds.pour", "injected", "moulds by complement have no lids; they are poured open", "open")
    given, clearance = dimensions(spec), spec.moulds.window_clearance_mm
    segments = segment_count(given.outer_radius, spec.output.tolerance_mm)
    laid, laid_in = [body.shape for body in inserts(spec)], design_of(spec).laid_in
    solids = [realise(shape, segments) for shape in cast]
    rims, radii = _extent(spec, solids, segments)

    def there(layer: int) -> Sequence[Shape]:
        return laid if layer + 1 >= laid_in else ()

    standing, tops = _standing(spec, cast, there, solids, rims, max(radii), segments)
    for i, (solid, rim) in enumerate(zip(solids, rims, strict=True)):
        _check_opening(spec, i, solid, rim)
    if laid:
        seat = max(radii) + spec.moulds.land_mm + spec.moulds.groove_width_mm
        standing = [Common((piece, box(-seat, seat, -seat, seat, -BEYOND, tops))) for piece in standing]
    dims = replace(given, radii=radii, heights=rims, core_height=tops, exit=None, sides=())
    lay = layout(spec, dims)

    def in_cells(shapes: Sequence[Shape]) -> list[Shape]:
        return [moved(shape, cell.x, cell.y) for cell in lay.cells for shape in shapes]

    base = stand(spec, lay, in_cells(standing))
    solid_of = [realise(piece, segments).trim_by_plane((0, 0, 1), 0.0) for piece in standing]
    cups, sealed, grooved = [], [], []
    wall_kept = min(spec.moulds.least_wall_mm, spec.moulds.land_mm) - LEVEL
    for i, rim in enumerate(rims):
        blank, under = cup_blank(spec, lay, rim), Below(union(cast[: i + 1]), -BEYOND)
        slots = [_grown(Below(shape, skirt_end(spec) - BEYOND), clearance) for shape in there(i)]
        wall = Manifold.batch_boolean(
            [realise(shape, segments) for shape in (blank, under, recess(spec, lay), *standing, *slots)],
            OpType.Subtract,
        )
        slid = slots + [
            _slid(spec, piece, solid, wall, rim, segments)
            for piece, solid in zip(standing, solid_of, strict=True)
            if wall.min_gap(solid, 2 * clearance) < clearance
        ]
        overflow = grooves(spec, dims, lay, i)
        own = realise(groove(spec, dims, i, replace(lay.cells[0], x=0.0, y=0.0)), segments)
        if any(own.min_gap(realise(hole, segments), wall_kept) < wall_kept for hole in slid):
            overflow = []
        grooved.append(bool(overflow))
        bores, holes = in_cells([under]), in_cells(slid)
        cup = cut(blank, [recess(spec, lay), *bores, *holes, *overflow])
        pieces = _pieces(realise(cup, segments))
        if len(pieces) > 1:
            cup = Component(cup, (lay.cup[0] - spec.moulds.skirt_wall_mm / 2, 0.0, skirt_end(spec) + LEVEL))
            for lost in _pieces(Manifold.compose(pieces) - realise(cup, segments) - realise(base, segments)):
                raise _refused(spec, i, f"the base goes all round a piece of the cup, {_place(lost)}")
        cups.append(cup)
        # Down into the plinth too: where only faces touch, a way of no width could be left.
        rest = Cut(blank, tuple(bores))
        sealed.append((Cut(Common((union(holes), rest)), tuple(in_cells([*standing, *there(i)]))),) if holes else ())
    tools = (
        base_piece(base),
        *(cup_piece(i + 1, cup) for i, cup in enumerate(cups)),
        blade_piece(blade(lay, dims.heights[-1])),
    )
    return Tooling(dims, lay, tools, seals=tuple(sealed), grooves=tuple(grooved))


def _extent(spec: Spec, solids: Sequence[Manifold], segments: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the rim plane and the bounding radius of what is cast up to each pour, mm."""
    rims: list[float] = []
    radii: list[float] = []
    for i, solid in enumerate(solids):
        if solid.is_empty():
            raise _refused(spec, i, "the layer has no volume")
        low, high = bounds(solid)[2], bounds(solid)[5]
        if low < -LEVEL:
            raise _refused(spec, i, f"the layer reaches {-low:.3g} mm below the skin z = 0, where the seat is")
        # A circle's polygon has its area, so its corners stand out by that factor.
        radius = float(np.hypot(*arrays(solid)[0][:, :2].T).max()) / area_true(segments)
        # Rounded down, so that no film of mould lies over the layer's top.
        rims.append(max([math.floor(high * GRID_PER_MM + 1e-6) / GRID_PER_MM, *rims]))
        radii.append(max([math.ceil(radius * GRID_PER_MM - 0.01) / GRID_PER_MM, *radii]))
    return tuple(rims), tuple(radii)


def _check_opening(spec: Spec, layer: int, solid: Manifold, rim: float) -> None:
    """Raise Refusal where a layer meets its rim in less than what silicone can be poured through."""
    width, area = max(regions(solid, rim), default=(0.0, 0.0))
    if area >= LEAST_AREA and width >= LEAST_WIDTH:
        return
    corners = arrays(solid)[0]
    x, y, z = corners[corners[:, 2].argmax()]
    opening = f"an opening of {area:.2g} mm2 in the rim that takes a circle of {width:.2g} mm"
    least = f"to pour silicone takes {LEAST_AREA:g} mm2 and a circle of {LEAST_WIDTH:g} mm"
    why = f"the layer's top, at x = {x:.3g}, y = {y:.3g}, z = {z:.3g} mm, leaves {opening}; {least}: "
    raise _refused(spec, layer, f"{why}give it a flat top, such as a disc of {FLAT:g} mm, or turn it over")


def _standing(
    spec: Spec,
    cast: Sequence[Shape],
    there: Callable[[int], Sequence[Shape]],
    solids: Sequence[Manifold],
    rims: Sequence[float],
    radius: float,
    segments: int,
) -> tuple[list[Shape], float]:
    """Return the pieces that stand on the base in every pour, sunk into it, and the height of the tallest.

    Raises Refusal for a piece that would hang in the air, and for one that a later layer takes the place of.
    """
    filled = (*cast, *there(len(cast) - 1))
    under = Cut(Below(union(filled), 0.0), filled)
    held = _pieces(realise(under, segments))
    for piece in held:
        if not _stands(piece):
            raise _refused(spec, len(cast) - 1, f"a hollow of {_place(piece)} is closed in by silicone below and above")
    standing: list[Shape] = [Component(under, _inside(piece)) for piece in held]
    edge = radius + BEYOND
    for i, rim in reversed(list(enumerate(rims))):
        if any(bounds(realise(shape, segments))[5] > rim + LEVEL for shape in there(i)):
            raise _refused(spec, i, f"what is laid in stands out of the rim at z = {rim:.4g} mm")
        beneath = Below(union((*cast[: i + 1], *there(i))), -BEYOND)
        beside = Cut(box(-edge, edge, -edge, edge, -BEYOND, rim), (beneath,))
        for piece in _pieces(realise(beside, segments)):
            if bounds(piece)[3] > edge - LEVEL:
                continue
            if not _stands(piece):
                why = f"a piece of {_place(piece)} would hang in the silicone: it touches neither base nor cup"
                raise _refused(spec, i, why)
            above = piece.trim_by_plane((0, 0, 1), 0.0)
            if i == len(rims) - 1:
                held.append(above)
                standing.append(Component(beside, _inside(piece)))
            elif (above - Manifold.compose(held)).volume() > SLIVER:
                why = f"a piece of {_place(above)} stands alone in layer {i + 1}, and a later layer takes its place"
                raise _refused(spec, i, why)
        needed = realise(Cut(Below(union(cast[: i + 1]), 0.0), tuple(cast[: i + 1])), segments)
        for j in range(i + 1, len(cast)):
            lost = needed ^ solids[j]
            if lost.volume() > SLIVER:
                why = f"layer {j + 1} lies under layer {i + 1} in a space of {_place(lost)}, where its core would stand"
                raise _refused(spec, i, why)
    return standing, max([bounds(piece)[5] for piece in held], default=LEVEL)


def _pieces(solid: Manifold) -> list[Manifold]:
    """Return the connected pieces, lowest first, without what rounding leaves."""
    return sorted((p for p in solid.decompose() if p.volume() > SLIVER), key=bounds)


def _stands(piece: Manifold) -> bool:
    """Tell whether a piece has a foot on the seat; by area, since rounding leaves films without thickness."""
    return piece.slice(LEVEL / 2).area() > SLIVER


def _inside(piece: Manifold) -> tuple[float, float, float]:
    """Return a point well inside a piece."""
    levels = sorted({float(z) for z in arrays(piece)[0][:, 2]})
    low, high = max(pairwise(levels), key=lambda pair: pair[1] - pair[0])
    z = (low + high) / 2
    _, (x, y) = widest(piece.slice(z))
    return x, y, z


def _slid(spec: Spec, piece: Shape, solid: Manifold, wall: Manifold, rim: float, segments: int) -> Shape:
    """Return the hole in a cup for a piece of the base: wider by the clearance, and open at the rim where it would
    leave a skin there that is too thin to print, unless the cup would fall in two.
    """
    clearance = spec.moulds.window_clearance_mm
    top = bounds(solid)[5]
    if rim - spec.moulds.least_wall_mm < top < rim:
        column = _grown(Below(moved(piece, z=rim), -2 * BEYOND), clearance)
        if len(_pieces(wall - realise(column, segments))) <= len(_pieces(wall)):
            return column
    return _grown(Below(piece, -2 * BEYOND), clearance)


def _grown(piece: Shape, clearance: float) -> Shape:
    """Return a piece and eight copies of it, moved by `clearance` along the axes and diagonally.

    Every upright face moves out by `clearance` or more. So does an upright edge whose faces both look into one
    quadrant, by a diagonal copy. A vertex of a circle of n sides that lies on an axis moves out by the copy along that
    axis: `clearance` times the cosine of pi / n, as C210 allows. A sharper edge may come out nearer: C210 measures it.
    """
    steps = (-clearance, 0.0, clearance)
    return union((piece, *(moved(piece, x, y) for x in steps for y in steps if x or y)))


def _place(piece: Manifold) -> str:
    """Return a piece's volume and a point in it."""
    x, y, z = _inside(max(piece.decompose(), key=Manifold.volume))
    return f"{piece.volume():.3g} mm3 at x = {x:.3g}, y = {y:.3g}, z = {z:.3g} mm"


def _refused(spec: Spec, layer: int, why: str) -> Refusal:
    return Refusal("design", spec.design, f"pour {layer + 1} can't be cast: {why}{UNIT_ALONE}")
