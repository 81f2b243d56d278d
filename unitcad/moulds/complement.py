"""Moulds for any cast shape, by complement: the rest of a block round the layers cast so far.

        lug    .---------------------.   rim: the top of the silicone so far, or under a lid with the cores that hang
     ----------'                     |
     | support |   .-------------.   |   cup      not under silicone, and joined to the block's outside
     |         |   |    core     |   |   base     under silicone (core, support), or alone in a hole (post)
    =======================================  seat, z = 0

Mould under silicone can't be lifted past it, so it is part of the base; the rest is lifted off upwards. The cup is cut
back by the printer's clearance from the parts of the base that it slides along, and that slit is the pour's seal.
Balance (C100) is true by construction here and proves nothing: draw, strain, air, opening and printability decide.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from manifold3d import Manifold, OpType

from unitcad.designs import design_of, dimensions, inserts
from unitcad.designs.design import BEYOND, Tooling
from unitcad.designs.limits import check_seat
from unitcad.errors import UNIT_ALONE, Refusal
from unitcad.kernels.mesh import (
    area_true,
    arrays,
    bounds,
    gap,
    realise,
    segment_count,
    shells,
    thick_parts,
    thick_pieces,
    widest,
)
from unitcad.moulds import lid
from unitcad.moulds.base import stand
from unitcad.moulds.cup import cup_blank, groove, grooves, recess, skirt_end
from unitcad.moulds.layout import Frame
from unitcad.moulds.pieces import base_piece, blade, blade_piece, cup_piece, lid_piece
from unitcad.shape import Below, Common, Component, Cut, Shape, box, cut, moved, union
from unitcad.shape.profile import FACETS, GRID_PER_MM
from unitcad.spec import Spec
from unitcad.spec.custom_code import is_body_file

LEAST_AREA = 2.0
"""Of an opening that silicone is poured or injected into, mm2 (assumed): a thread or a needle of 1.6 mm."""
LEAST_WIDTH = 0.4
"""Of that opening, and of a vent, mm (assumed): less than the thinnest wall that a spec may have."""
_UNDER = 1 / 4096
"""Depth of the section under the plane of the opening, mm."""
FILM = 0.1
"""Area up to which films are left, mm2: they reach less far than the clearance."""
FLAT = math.ceil(10 * math.sqrt(4 * LEAST_AREA / math.pi)) / 10
"""Diameter of a disc that is large enough to pour through, mm."""
LEVEL = 1 / GRID_PER_MM
"""Heights nearer than this are one, mm."""
MITRE = 3.0
"""How many clearances a sharp corner's copy moves out, at most: as far as a corner of 39 degrees needs."""


Channels = Callable[[int, Manifold, float], Sequence[tuple[Shape, Shape]]]
"""From a pour (from 0), its layer and the top of its closed cup to the channels: each as drilled, and as filled."""


def complement(spec: Spec, cast: Sequence[Shape], roof: float = 0.0, gates: Channels | None = None) -> Tooling:
    """Return the moulds of the layers `cast`, in the order of their pours, drawn about the unit's axis.

    With `gates` a cup whose layer has too small an opening above is closed by a roof of `roof` mm, and filled through
    them.

    If inserts of the design lead out of the silicone, the base carries them, and the cup has a slot for them, open
    downwards. Raises Refusal, with the pour and the place, for layers that leave a loose piece of mould.
    """
    if spec.moulds.shrinkage_percent:
        value, limit = (
            spec.moulds.shrinkage_percent,
            "moulds by complement make up for no shrinkage: draw the unit larger",
        )
        raise Refusal("moulds.shrinkage_percent", value, limit, 0.0)
    check_seat(spec)
    given, clearance = dimensions(spec), spec.moulds.window_clearance_mm
    segments = segment_count(given.outer_radius, spec.output.tolerance_mm)
    laid, laid_in = [body.shape for body in inserts(spec)], design_of(spec).laid_in
    solids = [realise(shape, segments) for shape in cast]
    rims, radii = _extent(spec, solids, segments)

    def there(layer: int) -> Sequence[Shape]:
        return laid if layer + 1 >= laid_in else ()

    injected, least = spec.moulds.pour == "injected", films(spec)
    standing, hung, tops = _carried(spec, cast, there, solids, rims, max(radii), segments)
    closed = [gates is not None and not _is_open(spec, solid, rim) for solid, rim in zip(solids, rims, strict=True)]
    for i, (solid, rim) in enumerate(zip(solids, rims, strict=True)):
        if not closed[i]:
            _check_opening(spec, i, solid, rim)
    rims = tuple(rim + roof * shut for rim, shut in zip(rims, closed, strict=True))
    gated = [gates(i, solids[i], rims[i]) if gates and shut else () for i, shut in enumerate(closed)]
    if laid:
        seat = max(radii) + spec.moulds.land_mm + spec.moulds.groove_width_mm
        standing = [Common((piece, box(-seat, seat, -seat, seat, -BEYOND, tops))) for piece in standing]
    dims = replace(given, radii=radii, heights=rims, core_height=tops, exit=None, sides=())
    frame = Frame.of(spec, dims)
    lay = frame.lay

    def in_cells(shapes: Sequence[Shape]) -> list[Shape]:
        return [moved(shape, cell.x, cell.y) for cell in lay.cells for shape in shapes]

    base = stand(frame, in_cells(standing))
    solid_of = [realise(piece, segments).trim_by_plane((0, 0, 1), 0.0) for piece in standing]
    cups, sealed, grooved = [], [], []
    wall_kept = min(spec.moulds.least_wall_mm, spec.moulds.land_mm) - LEVEL
    for i, rim in enumerate(rims):
        blank, under = cup_blank(frame, rim), Below(union(cast[: i + 1]), -BEYOND)
        slots = [_grown(Below(shape, skirt_end(spec) - BEYOND), clearance) for shape in there(i)]
        wall = Manifold.batch_boolean(
            [realise(shape, segments) for shape in (blank, under, recess(frame), *standing, *slots)],
            OpType.Subtract,
        )
        slid = slots + [
            _slid(spec, piece, solid, wall, rim, segments)
            for piece, solid in zip(standing, solid_of, strict=True)
            if wall.min_gap(solid, 2 * clearance) < clearance
        ]
        overflow = [] if closed[i] else grooves(frame, i)
        own = realise(groove(frame, i, replace(lay.cells[0], x=0.0, y=0.0)), segments)
        if any(own.min_gap(realise(hole, segments), wall_kept) < wall_kept for hole in slid):
            overflow = []
        grooved.append(bool(overflow))
        bores, holes = in_cells([under]), in_cells(slid)
        drilled = in_cells([shape for shape, _ in gated[i]])
        cup = cut(blank, [recess(frame), *bores, *holes, *overflow, *drilled])
        parted = shells(realise(cup, segments))
        if len(parted) > 1:  # pieces, or films
            parted = _pieces(realise(cup, segments), least)
            cup = Component(cup, (lay.cup[0] - spec.moulds.skirt_wall_mm / 2, 0.0, skirt_end(spec) + LEVEL))
            elsewhere = [realise(shape, segments) for shape in (cup, base, *in_cells(hung[i]))]
            for lost in _pieces(Manifold.batch_boolean([Manifold.compose(parted), *elsewhere], OpType.Subtract), least):
                raise _refused(spec, i, f"the base goes all round a piece of the cup, {_place(lost)}")
        cups.append(cup)
        # Down into the plinth too: faces that only touch could leave a passage of no width.
        rest = Cut(blank, tuple(bores))
        sealed.append((Cut(Common((union(holes), rest)), tuple(in_cells([*standing, *there(i)]))),) if holes else ())
    tools, channels = [base_piece(base), *(cup_piece(i + 1, cup) for i, cup in enumerate(cups))], []
    for i, (solid, rim) in enumerate(zip(solids, rims, strict=True)) if injected and not any(closed) else ():
        drilled, poured = (lid.channels_over(frame, i, solid.slice(rim - _UNDER), by) for by in (BEYOND, 0.0))
        tools.append(lid_piece(i + 1, lid.lid(frame, i, drilled, in_cells(hung[i]))))
        channels.append(tuple(poured))
    tools += [] if injected or all(closed) else [blade_piece(blade(lay, dims.heights[-1]))]
    if any(closed):
        filled = tuple(tuple(moved(shape, c.x, c.y) for c in lay.cells for _, shape in each) for each in gated)
        seals, grooved_of = tuple(sealed), tuple(grooved)
        return Tooling(dims, lay, tuple(tools), seals, filled, grooved_of, tops=rims, gated=tuple(closed))
    return Tooling(dims, lay, tuple(tools), tuple(sealed), tuple(channels), tuple(grooved))


def _extent(spec: Spec, solids: Sequence[Manifold], segments: int) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the rim plane and the bounding radius of the silicone up to each pour, mm."""
    rims: list[float] = []
    radii: list[float] = []
    for i, solid in enumerate(solids):
        if solid.is_empty():
            raise _refused(spec, i, "the layer has no volume")
        low, high = bounds(solid)[2], bounds(solid)[5]
        if low < -LEVEL:
            raise _refused(spec, i, f"the layer reaches {-low:.3g} mm below the skin z = 0, the seat of the mould")
        # A circle's polygon has its area, so its corners are outside by that factor.
        radius = float(np.hypot(*arrays(solid)[0][:, :2].T).max()) / area_true(segments)
        # Rounded down, so that no film of mould is over the layer's top.
        rims.append(max([math.floor(high * GRID_PER_MM + 1e-6) / GRID_PER_MM, *rims]))
        radii.append(max([math.ceil(radius * GRID_PER_MM - 0.01) / GRID_PER_MM, *radii]))
    return tuple(rims), tuple(radii)


def _least_width(spec: Spec) -> float:
    return lid.LEAST_VENT if spec.moulds.pour == "injected" else LEAST_WIDTH


def _is_open(spec: Spec, solid: Manifold, rim: float) -> bool:
    """Tell whether a layer's opening at its rim is large enough to pour silicone through, or for the vents of a lid."""
    width, area = max(regions(solid, rim), default=(0.0, 0.0))
    return area >= LEAST_AREA and width >= _least_width(spec)


def _check_opening(spec: Spec, layer: int, solid: Manifold, rim: float) -> None:
    """Raise Refusal if a layer's opening at its rim is too small."""
    if _is_open(spec, solid, rim):
        return
    injected, wide = spec.moulds.pour == "injected", _least_width(spec)
    width, area = max(regions(solid, rim), default=(0.0, 0.0))
    corners = arrays(solid)[0]
    x, y, z = corners[corners[:, 2].argmax()]
    opening = f"an opening of {area:.2g} mm2 in the rim that takes a circle of {width:.2g} mm"
    least = (
        f"{'a lid with vents' if injected else 'to pour silicone'} takes {LEAST_AREA:g} mm2 and a circle of {wide:g} mm"
    )
    why = f"the layer's top, at x = {x:.3g}, y = {y:.3g}, z = {z:.3g} mm, leaves {opening}; {least}: "
    raise _refused(spec, layer, f"{why}give it a flat top, such as a disc of {FLAT:g} mm, or turn it over")


def _carried(
    spec: Spec,
    cast: Sequence[Shape],
    there: Callable[[int], Sequence[Shape]],
    solids: Sequence[Manifold],
    rims: Sequence[float],
    radius: float,
    segments: int,
) -> tuple[list[Shape], list[list[Shape]], float]:
    """Return the pieces on the base in every pour, sunk into it, those under the lid of each pour, and the highest top.

    Raises Refusal for a piece that would hang in the air, and for one in the place of a later layer.
    """
    filled = (*cast, *there(len(cast) - 1))
    least = films(spec)
    under = _without_films(Cut(Below(union(filled), 0.0), filled), segments, least)
    held = _pieces(realise(under, segments), least)
    for piece in held:
        if not _stands(piece):
            raise _refused(spec, len(cast) - 1, f"a hollow of {_place(piece)} is closed in by silicone below and above")
    standing: list[Shape] = [Component(under, _inside(piece)) for piece in held]
    hung: list[list[Shape]] = [[] for _ in cast]
    edge = radius + BEYOND
    for i, rim in reversed(list(enumerate(rims))):
        if any(bounds(realise(shape, segments))[5] > rim + LEVEL for shape in there(i)):
            raise _refused(spec, i, f"an insert reaches above the rim at z = {rim:.4g} mm")
        beneath = Below(union((*cast[: i + 1], *there(i))), -BEYOND)
        beside = Cut(box(-edge, edge, -edge, edge, -BEYOND, rim), (beneath,))
        for piece in _pieces(realise(beside, segments), least):
            if bounds(piece)[3] > edge - LEVEL:
                continue
            if not _stands(piece):
                if spec.moulds.pour == "open":
                    why = f"pour {i + 1} has a core of {_place(piece)} with silicone on all sides but above, for a lid"
                    raise Refusal("moulds.pour", "open", why, "injected")
                # Of the silicone's own faces: columns leave films between them.
                free = Cut(box(-edge, edge, -edge, edge, -BEYOND, rim), tuple(cast[: i + 1]))
                hung[i].append(Cut(Component(free, _inside(piece)), (beneath,)))
                continue
            above = piece.trim_by_plane((0, 0, 1), 0.0)
            if i == len(rims) - 1:
                held.append(above)
                standing.append(Component(beside, _inside(piece)))
            elif thick_pieces(above - Manifold.compose(held), least):
                why = f"a loose piece of {_place(above)} is in layer {i + 1}, and a later layer takes its place"
                raise _refused(spec, i, why)
        needed = realise(Cut(Below(union(cast[: i + 1]), 0.0), tuple(cast[: i + 1])), segments)
        for j in range(i + 1, len(cast)):
            lost = needed ^ solids[j]
            if thick_pieces(lost, least):
                why = f"layer {j + 1} is under layer {i + 1} in a space of {_place(lost)}, in the place of its core"
                raise _refused(spec, i, why)
    return standing, hung, max([bounds(piece)[5] for piece in held], default=LEVEL)


def films(spec: Spec) -> float:
    """Return the thickness up to which a piece is a film of facets or rounding, mm.

    In a body from a file, facets on either side of a film are each off the surface that was meant, and on the grid; those
    of a layer by offset are off twice, by its lattice and as they are joined.
    """
    return 2 * (FACETS * (2 if spec.body else 1) + LEVEL) if is_body_file(spec.design) else FACETS


def _pieces(solid: Manifold, least: float) -> list[Manifold]:
    """Return the connected pieces, lowest first, without films up to `least` (mm) of facets and rounding."""
    return sorted(thick_pieces(solid, least), key=bounds)


def _stands(piece: Manifold) -> bool:
    """Tell whether a piece has a foot on the seat that is wider than scraps of facets and rounding."""
    return bool(thick_parts(piece.slice(LEVEL / 2)))


def _without_films(shape: Shape, segments: int, least: float) -> Shape:
    """Return a shape whose pieces have no films, which rounding leaves upright between two faces in one plane.

    A film has area and no volume, and faces nowhere upwards: none is under the upward faces.
    """
    kept = _pieces(realise(shape, segments), least)
    if not kept:
        return shape
    whole = Manifold.compose(kept)
    low, area = bounds(whole)[2], whole.surface_area()
    cleared, smallest = shape, area - FILM
    for other in (Below(shape, low), Common((shape, Below(shape, low - BEYOND)))):
        solid = realise(other, segments)
        if solid.surface_area() < smallest and abs(solid.volume() - whole.volume()) < LEVEL**2 * area:
            cleared, smallest = other, solid.surface_area()
    return cleared


def _inside(piece: Manifold) -> tuple[float, float, float]:
    """Return a point well inside a piece: the middle of the largest disc in it that is as thick as it is wide.

    A film that rounding leaves between two faces may be tall, but has no width.
    """
    levels = sorted({float(z) for z in arrays(piece)[0][:, 2]})
    best, point = -1.0, (0.0, 0.0, levels[0])
    for low, high in sorted(pairwise(levels), key=lambda pair: pair[0] - pair[1]):
        if high - low <= best:
            break
        z = (low + high) / 2
        diameter, (x, y) = widest(piece.slice(z))
        if min(diameter, high - low) > best:
            best, point = min(diameter, high - low), (x, y, z)
    return point


def _slid(spec: Spec, piece: Shape, solid: Manifold, wall: Manifold, rim: float, segments: int) -> Shape:
    """Return the hole in a cup for a piece of the base, wider by the clearance.

    It is open at the rim if a skin there would be too thin to print, unless the cup would fall in two.
    """
    clearance = spec.moulds.window_clearance_mm
    top, under = bounds(solid)[5], Below(piece, -2 * BEYOND)
    hole, least = _grown(under, clearance), clearance * math.cos(math.pi / segments) - LEVEL
    corners = _past_corners(solid, wall - realise(hole, segments), clearance, least)
    if corners:
        hole = _grown(under, clearance, corners)
    if rim - spec.moulds.least_wall_mm < top < rim:
        column = _grown(Below(moved(piece, z=rim), -2 * BEYOND), clearance, corners)
        if len(_pieces(wall - realise(column, segments), FACETS)) <= len(_pieces(wall, FACETS)):
            return column
    return hole


def _grown(piece: Shape, clearance: float, corners: Sequence[tuple[float, float]] = ()) -> Shape:
    """Return a piece and copies of it: eight moved by `clearance` along the axes and diagonally, one for each corner.

    Every upright face moves out by `clearance` or more. So does an upright edge whose faces both look into one
    quadrant, by a diagonal copy. A vertex on an axis, of a circle of n sides, moves out by the copy along that axis:
    `clearance` times the cosine of pi / n, as C210 allows.
    """
    steps = (-clearance, 0.0, clearance)
    moves = [(x, y) for x in steps for y in steps if x or y]
    return union((piece, *(moved(piece, x, y) for x, y in (*moves, *corners))))


def _past_corners(solid: Manifold, wall: Manifold, clearance: float, least: float) -> list[tuple[float, float]]:
    """Return the moves that take sharp corners out by `clearance`, mm, in the level sections of a piece from which the
    wall round it is nearer than `least`.

    A corner sharper than MITRE allows is left: C210 finds it.
    """
    ways = np.array([(x, y) for x in (-clearance, 0, clearance) for y in (-clearance, 0, clearance) if x or y])
    moves: list[tuple[float, float]] = []
    for low, high in pairwise(sorted({float(z) for z in arrays(solid)[0][:, 2]})):
        one, other = (each.slice((low + high) / 2) for each in (solid, wall))
        if high - low < LEVEL or one.is_empty() or other.is_empty() or gap(one, other, clearance) >= least:
            continue
        for loop in one.to_polygons():
            sides = np.roll(loop, -1, axis=0) - loop
            # Past a side that is shorter its neighbours' corner moves out.
            sides = sides[np.hypot(*sides.T) > clearance / 2]
            first = np.column_stack([sides[:, 1], -sides[:, 0]]) / np.hypot(*sides.T)[:, None]
            for here, there in zip(first, np.roll(first, -1, axis=0), strict=True):
                sharp, cosine = here[0] * there[1] - here[1] * there[0] > 0, float(here @ there)
                short = not ((ways @ here >= least) & (ways @ there >= least)).any()
                if sharp and short and 1 + cosine >= 2 / MITRE**2:
                    x, y = clearance * (here + there) / (1 + cosine)
                    moves.append((float(x), float(y)))
                    ways = np.vstack([ways, moves[-1]])
    return moves


def _place(piece: Manifold) -> str:
    """Return a piece's volume and a point in it."""
    x, y, z = _inside(max(piece.decompose(), key=Manifold.volume))
    return f"{piece.volume():.3g} mm3 at x = {x:.3g}, y = {y:.3g}, z = {z:.3g} mm"


def _refused(spec: Spec, layer: int, why: str) -> Refusal:
    return Refusal("design", spec.design, f"pour {layer + 1} can't be cast: {why}{UNIT_ALONE}")


def regions(cavity: Manifold, top: float) -> list[tuple[float, float]]:
    """Return (width in mm, area in mm2) of each region of a cavity's section just under z = `top`, the widest last.

    Width is the diameter of the largest circle that fits.
    """
    return sorted((widest(part)[0], part.area()) for part in cavity.slice(top - _UNDER).decompose())
