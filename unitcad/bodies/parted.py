r"""The tools of one way to part a mould: tray, halves or side pieces, with gate, vents, keys and frame.

        level, closed                        upright, two pieces (from above)
                                            .------------.------------.
        vent   gate                         |            |            |
    .----| |--\  /--.  top                  |  .------.  key  left    |
    |    | |   ||   |                       | | cavity  | |           |
    |   .-'-----'-. |                       |  '------'  |            |
    | .-'  cavity  '-.  parting, z = 0       |            key          |
    |=================|                     '------------'------------'
    |  base  '---'    |                        frame round both, pressed down on its taper
    '-----------------'

The frame of the tools has the parting of halves at z = 0; side pieces stand on the base at z = 0 and part at x = 0, four
of them at y = 0 too. A core in a pocket belongs to the base if the pocket is open downwards, else to the closed top.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from manifold3d import CrossSection, JoinType, Manifold, OpType
from msgspec import structs

from unitcad.bodies.search import POSES, Way, about_z
from unitcad.checks.air import CREVICE, pocket_volume, pockets
from unitcad.designs import dimensions
from unitcad.designs.design import BEYOND, Layout, Tooling
from unitcad.errors import UnitcadError
from unitcad.kernels.mesh import arrays, bounds, realise, segment_count, thick_parts, thick_pieces, widest
from unitcad.moulds import lid
from unitcad.moulds.base import outline, stand
from unitcad.moulds.complement import LEAST_AREA, LEAST_WIDTH, complement, films, regions
from unitcad.moulds.cup import cup_blank, grooves, recess, skirt_end
from unitcad.moulds.layout import MARK, Frame, layout
from unitcad.moulds.pieces import base_piece, blade, blade_piece, cup_piece
from unitcad.shape import (
    Common,
    Component,
    Cut,
    Extrude,
    Place,
    Revolve,
    Shape,
    box,
    cut,
    cylinder,
    moved,
    polygon,
    union,
)
from unitcad.shape.profile import GRID_PER_MM, mm
from unitcad.shape.tree import Body, by_quarters
from unitcad.spec import Spec
from unitcad.spec.body_file import on_grid

LEVEL = 1 / GRID_PER_MM
ROOF = 4.0
"""Material over a closed cavity, mm: it guides the gate, and holds the riser."""
FLOOR = 2.0
"""Material under a cavity in the base, at least, mm."""
GATE = 1.7
"""Diameter of a gate at the body, mm: an area of more than C410 asks for."""
GATE_WALL, GATE_PLACES = 0.8, 9
"""Wall between a gate and a vent at the mould's top, mm; places that are tried along each side of the body."""
GATE_DEPTHS = (0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0)
"""Depths under the body's top at which a gate is tried, mm."""
VENT, VENT_APART, DRIFT = 1.0, 4.0, 1.0
"""Diameter of a vent, mm, less over a narrow ridge; two placed at once are that far apart; how far from its peak it is."""
MOST_VENTS, ROUNDS = 32, 12
"""Vents of a mould, and rounds in which they are placed, at most."""
KEY, KEY_TIP, KEY_HIGH, KEY_PLAY = 2.4, 0.5, 1.6, 0.1
"""A key of side pieces: half widths at foot and tip, height, and the play in its groove, mm."""
KEY_ROOM = 6.0
"""Room for the keys, beside the cavity's land, mm."""
TAPER_DEG = 8.0
"""Taper of the frame: less than the angle of friction of printed plastic (0.2 or more), so that it stays pressed on."""
LEAST_FRAME = 2.0
"""Least height of the frame, mm (assumed)."""
FRAME_HIGH, FRAME_WALL, FRAME_TRAVEL, FRAME_LOW = 8.0, 5.0, 2.0, 1.0
"""The frame: its height, its wall, the way that it can be pressed down, and its top under the rim, mm."""


class Impossible(UnitcadError):
    """A way that can't be drawn, with the reason as a mould maker would give it."""


@dataclass(frozen=True)
class Mould:
    """A drawn way: the tooling, and the sentence that says how the body is turned and parted."""

    way: Way
    tooling: Tooling


def draw(spec: Spec, body: Shape, way: Way) -> Mould:
    """Draw the tools of a way round a body. Raises Impossible, or Refusal for tools beyond the bed."""
    segments = segment_count(dimensions(spec).outer_radius, spec.output.tolerance_mm)
    cast, solid = _turned(body, way, segments)
    cast, solid = _placed(cast, solid, way)
    radius = _radius(solid)
    if way.open:
        width, area = max(regions(solid, bounds(solid)[5]), default=(0.0, 0.0))
        if area < LEAST_AREA or width < LEAST_WIDTH:
            raise Impossible(f"its top leaves an opening of {area:.2g} mm2 to pour through")
    top = math.floor(bounds(solid)[5] * GRID_PER_MM + 1e-6) / GRID_PER_MM
    rim = top if way.open else mm(top + ROOF)
    dims = replace(
        dimensions(spec), radii=(radius,), heights=(rim,), core_height=0.0, exit=None, sides=(), cavity_radius=0.0
    )
    lay = layout(spec, dims)
    if way.kind in ("two", "four"):
        if len(lay.cells) > 1:
            raise Impossible("side pieces take one cavity: set moulds.cavities = [1, 1]")
        lay = _with_keys(lay, way)
    frame = Frame(spec, dims, lay)
    channels = _channels(spec, solid, way, rim, segments)
    drilled = [shape for shape, _ in channels]
    if way.kind == "tray":
        return Mould(way, _tray(frame, cast))
    cores = _cores(spec, cast, solid, way, rim, radius, segments)
    whole = _cup(frame, cast, drilled, rim, segments, sides=way.kind != "level")
    base = _base(frame, cast, cores, bounds(solid)[2] if way.kind == "level" else 0.0)
    tools = [base_piece(base)]
    tools += [cup_piece(1, whole)] if way.kind == "level" else _side_pieces(frame, whole, rim, way)
    if way.open:
        tools.append(blade_piece(blade(lay, rim)))
    silicone = tuple(moved(each, c.x, c.y) for c in lay.cells for each in (shape for _, shape in channels))
    return Mould(
        way,
        Tooling(
            dims,
            lay,
            tuple(tools),
            seals=((),),
            channels=(silicone,) if silicone else (),
            grooves=(way.open and not channels,),
            gated=(not way.open,),
            cast=(cast,),
            tops=(rim,),
        ),
    )


def closed_cups(spec: Spec, cast: Sequence[Shape]) -> Tooling:
    """Draw the tools of several pours by complement, their cups closed if a layer has too small an opening above.

    Raises Impossible, or Refusal.
    """
    segments = segment_count(dimensions(spec).outer_radius, spec.output.tolerance_mm)
    way = Way("as drawn", POSES[0][1], "level", (0.0, 0.0), 0.0, open=False, caught=0.0)

    def gates(pour: int, solid: Manifold, rim: float) -> list[tuple[Shape, Shape]]:
        return _channels(spec, solid, way, rim, segments)

    return complement(spec, cast, ROOF, gates)


def _turned(body: Shape, way: Way, segments: int) -> tuple[Shape, Manifold]:
    """Return a body in its pose, its parting turned to the planes of the tools."""
    turn = about_z(-way.angle - (45.0 if way.kind == "four" else 0.0)) @ np.array(way.turn, float)
    rows = [(float(x), float(y), float(z)) for x, y, z in np.round(turn, 12) + 0.0]
    if by_quarters((rows[0], rows[1], rows[2])):
        (a, b, c), (d, e, f), (g, h, i) = np.round(turn).astype(int).tolist()
        shape: Shape = Place(body, turn=((a, b, c), (d, e, f), (g, h, i)))
    else:
        corners, faces = arrays(realise(body, segments))
        # Off the grid, faces that should mate would leave leaks.
        shape = on_grid("", "layer1", corners @ turn.T, faces)
    return shape, realise(shape, segments)


def _placed(cast: Shape, solid: Manifold, way: Way) -> tuple[Shape, Manifold]:
    """Move a turned body into the frame of the tools."""
    x0, y0, z0, x1, y1, _ = bounds(solid)
    x, y, z = (x0 + x1) / 2, (y0 + y1) / 2, z0
    if way.kind == "level":
        z = _parting(solid, way.at)
    elif way.kind == "two":
        x = _parting(solid.rotate((0, -90, 0)), way.at)
    elif way.kind == "four":
        x, y = (about_z(-45.0) @ np.array([*way.at, 0.0]))[:2].tolist()
    move = mm(-x), mm(-y), mm(-z)
    return moved(cast, *move), solid.translate(move)


def _parting(solid: Manifold, within: Sequence[float]) -> float:
    """Return the level of the parting: where a level section has the whole outline of the body, or misses least of it.

    Of equal ones the lowest: an edge of the body hides the flash, and the base stays shallow.
    """
    low, high = within
    z0, z1 = bounds(solid)[2], bounds(solid)[5]
    corners = np.unique([*arrays(solid)[0][:, 2].round(6), round((z0 + z1) / 2, 6)])
    levels = corners[(corners >= low) & (corners <= high)]
    levels = levels[:: max(1, len(levels) // 40)] if len(levels) else np.array([(low + high) / 2])
    shadow = _filled(solid.project()).area()

    def missing(level: float) -> float:
        sections = (_filled(solid.slice(level + by)).area() for by in (-LEVEL, LEVEL))
        return shadow - max(sections)

    missed = [missing(float(level)) for level in levels]
    least = min(missed)
    return float(next(z for z, area in zip(levels, missed, strict=True) if area <= least + 1e-4 * shadow))


def _filled(section: CrossSection) -> CrossSection:
    """Return a section without its holes."""
    return CrossSection([loop for loop in section.to_polygons() if _area(loop) > 0])


def _area(loop: np.ndarray) -> float:
    x, y = loop.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2


def _radius(solid: Manifold) -> float:
    corners = arrays(solid)[0]
    return math.ceil(float(np.hypot(*corners[:, :2].T).max()) * GRID_PER_MM - 0.01) / GRID_PER_MM


def _with_keys(lay: Layout, way: Way) -> Layout:
    """Return a layout with room for keys at the ends of the parting planes, and for the frame's taper."""
    x, y = (KEY_ROOM if way.kind == "four" else 0.0), KEY_ROOM
    taper = (FRAME_HIGH + FRAME_TRAVEL) * math.tan(math.radians(TAPER_DEG))
    return replace(
        lay,
        cup=(lay.cup[0] + x, lay.cup[1] + y),
        plate=(lay.plate[0] + x + taper, lay.plate[1] + y + taper),
        ribs=False,
    )


def _tray(frame: Frame, cast: Shape) -> Tooling:
    """Draw the one piece of a mould without parting: a plate as high as the body, with a recess for it."""
    spec, lay, rim = frame.spec, frame.lay, frame.dims.heights[0]
    blank = Extrude(outline(lay.cup, MARK), -spec.moulds.plate_mm, rim)
    recesses = [moved(cast, cell.x, cell.y) for cell in lay.cells]
    base = cut(blank, [*recesses, *grooves(frame, 0)])
    lay = replace(lay, plate=lay.cup, ribs=False)
    return Tooling(
        frame.dims,
        lay,
        (base_piece(base), blade_piece(blade(lay, rim))),
        seals=((),),
        grooves=(True,),
        cast=(cast,),
        tops=(rim,),
    )


def _cores(spec: Spec, cast: Shape, solid: Manifold, way: Way, rim: float, radius: float, segments: int) -> list[Shape]:
    """Return the cores over z = 0 that stand on the base: they fill holes and pockets that are open downwards."""
    edge, least = radius + BEYOND, films(spec)
    high = rim if way.open else bounds(solid)[5] + 1.0
    # From the seat upwards only: under it the space of every core is one with that round the body.
    beside = Cut(box(-edge, edge, -edge, edge, 0.0, high), (cast,))
    found: list[Shape] = []
    for piece in thick_pieces(realise(beside, segments), least):
        x0, _, low, x1, _, top = bounds(piece)
        if x1 > edge - LEVEL and x0 < LEVEL - edge:
            continue
        if top >= high - LEVEL and not way.open:
            continue  # it hangs from the closed top
        place = inside(piece)
        where = f"x = {place[0]:.3g}, y = {place[1]:.3g}, z = {place[2]:.3g} mm"
        if low > LEVEL and top >= high - LEVEL:
            raise Impossible(f"a core of {piece.volume():.3g} mm3 at {where} would have to hang from a lid")
        if low > LEVEL:
            raise Impossible(f"a hollow of {piece.volume():.3g} mm3 at {where} is closed all round")
        found.append(Component(beside, place))
    return found


def inside(piece: Manifold) -> tuple[float, float, float]:
    """Return a point in a piece: the middle of the largest disc among some level sections."""
    low, high = bounds(piece)[2], bounds(piece)[5]
    levels = [low + (high - low) * (i + 0.5) / 8 for i in range(8)]
    (_, (x, y)), z = max(((widest(piece.slice(z)), z) for z in levels), key=lambda each: each[0][0])
    return x, y, z


def _base(frame: Frame, cast: Shape, cores: Sequence[Shape], low: float) -> Shape:
    """Draw the base: plate and plinth with the cores, and the lower half of the cavity in it."""
    spec, lay = frame.spec, frame.lay
    standing = [moved(core, cell.x, cell.y) for cell in lay.cells for core in cores]
    if low < -LEVEL:
        step, lengths = spec.moulds.layer_mm, spec.moulds
        needed = math.ceil((FLOOR - low - lengths.plinth_height_mm) / step - 1e-6) * step
        deep = structs.replace(lengths, plate_mm=max(lengths.plate_mm, needed))
        frame = replace(frame, spec=structs.replace(spec, moulds=deep))
    recesses = [moved(cast, cell.x, cell.y) for cell in lay.cells] if low < -LEVEL else []
    return stand(frame, standing, recesses)


def _cup(frame: Frame, cast: Shape, drilled: Sequence[Shape], rim: float, segments: int, *, sides: bool) -> Shape:
    """Draw the upper half, or the side pieces in one."""
    spec, lay = frame.spec, frame.lay
    blank = _tapered(frame, rim) if sides else cup_blank(frame, rim)
    bores = [moved(shape, cell.x, cell.y) for cell in lay.cells for shape in (cast, *drilled)]
    overflow = [] if drilled else grooves(frame, 0)
    cup = cut(blank, [recess(frame), *bores, *overflow])
    if len(thick_pieces(realise(cup, segments), films(spec))) > 1:
        cup = Component(cup, (lay.cup[0] - spec.moulds.skirt_wall_mm / 2, 0.125, skirt_end(spec) + LEVEL))
    return cup


def _tapered(frame: Frame, rim: float) -> Shape:
    """Draw the block of side pieces, tapered at its top for the frame."""
    lay, slope = frame.lay, math.tan(math.radians(TAPER_DEG))
    low = max(rim - FRAME_HIGH - FRAME_TRAVEL, skirt_end(frame.spec) + 1.0)
    wide = (rim - low) * slope
    straight = Extrude(outline(lay.cup, MARK, wide), skirt_end(frame.spec), low)
    return union((straight, Extrude(outline(lay.cup, MARK, wide), low, rim, top=outline(lay.cup, MARK))))


def _side_pieces(frame: Frame, whole: Shape, rim: float, way: Way) -> list[Body]:
    """Return two or four side pieces, keyed to each other, and the frame that holds them together."""
    lay, far = frame.lay, 2 * max(frame.lay.plate)
    low = skirt_end(frame.spec) - BEYOND
    high = rim + BEYOND
    reach = frame.dims.radii[0] + frame.spec.moulds.land_mm + frame.spec.moulds.groove_width_mm
    middle = (reach + lay.cup[1]) / 2
    quarter = [(1, 1), (-1, 1), (-1, -1), (1, -1)] if way.kind == "four" else [(1, 0), (-1, 0)]

    def sector(sx: int, sy: int) -> Shape:
        x = (0.0, far) if sx > 0 else (-far, 0.0)
        y = (-far, far) if not sy else (0.0, far) if sy > 0 else (-far, 0.0)
        return box(*x, *y, low, high)

    # A key is on the piece that comes first round the axis, its groove in the next one.
    places: list[tuple[float, float, str]] = [(0.0, middle, "x"), (0.0, -middle, "x")]
    if way.kind == "four":
        places += [(middle, 0.0, "y"), (-middle, 0.0, "y")]
    pieces: list[Body] = []
    for i, (sx, sy) in enumerate(quarter):
        piece: Shape = Common((whole, sector(sx, sy)))
        own: list[tuple[float, float, str]] = []
        others: list[tuple[float, float, str]] = []
        for x, y, across in places:
            side = sx if across == "x" else sy
            if way.kind == "four" and (sy * y < 0 or sx * x < 0):
                continue
            (own if side > 0 else others).append((x, y, across))
        keys = [Common((whole, _key(*at, 0.0, rim))) for at in own]
        grooved = [_key(*at, KEY_PLAY, rim) for at in others]
        if keys:
            piece = union((piece, *keys))
        if grooved:
            piece = cut(piece, grooved)
        name = f"cup1{'abcd'[i]}"
        one = cup_piece(1, piece)
        pieces.append(replace(one, name=name, removal=(sx, sy, 0)))
    return [_frame(frame, rim), *pieces]


def _key(x: float, y: float, across: str, play: float, rim: float) -> Shape:
    """Draw an upright key on a parting plane; it reaches to -x from the plane x = 0, or to -y from y = 0."""
    foot, tip = KEY + play, KEY_TIP + play
    corners = ((0.5, -foot), (0.5, foot), (0.0, foot), (-KEY_HIGH - play, tip), (-KEY_HIGH - play, -tip), (0.0, -foot))
    placed = [(x + d, y + t) if across == "x" else (x + t, y + d) for d, t in corners]
    area = _area(np.array(placed))
    return Extrude(polygon(*(placed if area > 0 else placed[::-1])), -BEYOND * 5, rim + BEYOND)


def _frame(frame: Frame, rim: float) -> Body:
    """Draw the frame: a ring with the taper of the side pieces, pressed down over them."""
    lay, slope, play = frame.lay, math.tan(math.radians(TAPER_DEG)), frame.spec.moulds.plinth_clearance_mm
    high = rim - FRAME_LOW
    low = max(high - FRAME_HIGH, skirt_end(frame.spec) + 1.0 + FRAME_TRAVEL)
    if high - low < LEAST_FRAME:
        raise Impossible(f"side pieces {rim:.2g} mm high are too low for a frame")
    inner = [outline(lay.cup, MARK, (rim - z) * slope + play) for z in (low - BEYOND, high + BEYOND)]
    outer = outline(lay.cup, MARK, (rim - low) * slope + play + FRAME_WALL)
    ring = cut(Extrude(outer, low, high), [Extrude(inner[0], low - BEYOND, high + BEYOND, top=inner[1])])
    return Body("frame", "tool", "frame", ring, (0.62, 0.66, 0.72), step=1, removal=(0, 0, 1))


def _channels(spec: Spec, solid: Manifold, way: Way, rim: float, segments: int) -> list[tuple[Shape, Shape]]:
    """Return the gate, if the top is closed, then the vents, each as it is drilled and as it fills with silicone.

    Vents are at every place where the check of air finds a pocket; the highest is the riser. The gate is beside them,
    so that air and silicone don't meet in it.
    """
    if way.kind == "tray":
        return []
    vents: list[_Channel] = [] if way.open else [_riser(solid, rim)]
    limit = lid.MESH_ROOM * lid.deepest(spec, 0)
    for _ in range(ROUNDS):
        cavity = Manifold.batch_boolean([solid, *(realise(each.filled(rim), segments) for each in vents)], OpType.Add)
        deep = [pocket for pocket in pockets(cavity, rim) if pocket.depth > limit]
        deep = [pocket for pocket in deep if pocket_volume(cavity, rim, pocket) > CREVICE * solid.volume()]
        if not deep:
            break
        fresh: list[_Channel] = []
        for pocket in deep:
            vent = _vent(solid, pocket.peak)
            if all(math.dist((vent.x, vent.y), (each.x, each.y)) > VENT_APART for each in fresh):
                fresh.append(vent)
        vents += fresh
        if len(vents) > MOST_VENTS:
            raise Impossible(f"air stays {_at(deep[0].peak)}: it would take more than {MOST_VENTS} vents")
    else:
        raise Impossible("the air finds no way out through vents")
    gates = [] if way.open else [_gate(spec, solid, way, rim, vents)]
    return [(each.drilled(rim), each.filled(rim)) for each in (*gates, *vents)]


@dataclass(frozen=True)
class _Channel:
    """A gate or a vent: its axis, its radius at the body and at the mould's top, and z inside the body (mm)."""

    x: float
    y: float
    z: float
    radius: float
    wide: float

    def filled(self, rim: float) -> Shape:
        return self._drawn(rim, rim)

    def drilled(self, rim: float) -> Shape:
        return self._drawn(rim, rim + BEYOND)

    def _drawn(self, rim: float, end: float) -> Shape:
        if self.wide == self.radius:
            return moved(cylinder(self.radius, self.z, end), self.x, self.y)
        # The cone begins over the roof's middle: a short neck breaks off clean.
        neck = mm(rim - ROOF / 2)
        corners = [(0.0, self.z), (self.radius, self.z), (self.radius, neck), (self.wide, rim)]
        corners += [(self.wide, end), (0.0, end)] if end > rim else [(0.0, rim)]
        return moved(Revolve(polygon(*corners)), self.x, self.y)


def _riser(solid: Manifold, rim: float) -> _Channel:
    """Return the vent at the highest place of a body. Raises Impossible for a tip too fine for one."""
    corners = arrays(solid)[0]
    return _vent(solid, tuple(corners[corners[:, 2].argmax()].tolist()))  # type: ignore[arg-type]


def _vent(solid: Manifold, peak: tuple[float, float, float]) -> _Channel:
    """Return the vent over a peak, as wide as its ridge allows. Raises Impossible for a ridge too narrow."""
    px, py, pz = peak
    for depth in (0.05, 0.1, 0.2, 0.4, 0.7):
        # Only what is next to the peak: a peg's ridge is narrower than the ring that it is on.
        near = solid.slice(pz - depth) ^ CrossSection.circle(2 * VENT, 32).translate((px, py))
        parts = [part for part in thick_parts(near) if _distance(part, px, py) < DRIFT + depth]
        if not parts:
            continue
        nearest = min(parts, key=lambda part: _distance(part, px, py))
        radius = min(VENT, lid.GATE * widest(nearest)[0]) / 2
        if radius >= LEAST_WIDTH / 2:
            inner = nearest.offset(-radius, JoinType.Miter)
            corners = np.concatenate([loop for loop in inner.to_polygons()] or [np.array([widest(nearest)[1]])])
            x, y = corners[np.hypot(*(corners - (px, py)).T).argmin()].tolist()
            return _Channel(mm(x), mm(y), mm(pz - depth - 0.05), mm(radius), mm(radius))
    raise Impossible(f"the tip {_at(peak)} is too fine for a vent of {LEAST_WIDTH:g} mm: air would stay in it")


def _gate(spec: Spec, solid: Manifold, way: Way, rim: float, vents: Sequence[_Channel]) -> _Channel:
    """Return the gate: clear of the vents, and at the highest place that takes it. Raises Impossible without one."""
    sprue, gate = spec.moulds.sprue_mm / 2, min(spec.moulds.sprue_mm, GATE) / 2
    room = solid.project().offset(-gate, JoinType.Miter)
    if room.is_empty():
        raise Impossible(f"the body is too thin for a gate of {GATE:g} mm")
    x0, y0, x1, y1 = room.bounds()
    steps = np.linspace(0.5 / GATE_PLACES, 1 - 0.5 / GATE_PLACES, GATE_PLACES)
    xs = [0.0] if way.kind in ("two", "four") else (x0 + steps * (x1 - x0)).tolist()
    ys = [0.0] if way.kind == "four" else (y0 + steps * (y1 - y0)).tolist()
    low, top = bounds(solid)[2], bounds(solid)[5]
    best: tuple[float, float, float, float] | None = None
    for x, y in itertools.product(xs, ys):
        if any(math.dist((x, y), (each.x, each.y)) < sprue + each.radius + GATE_WALL for each in vents):
            continue
        disc = CrossSection.circle(gate, 24).translate((x, y))
        if not (disc - room.offset(gate, JoinType.Miter)).is_empty():
            continue
        depth = next((d for d in GATE_DEPTHS if top - d > low and (disc - solid.slice(top - d)).is_empty()), None)
        off = math.hypot(x, y)
        if depth is not None and (best is None or (depth, off) < best[:2]):
            best = (depth, off, x, y)
    if best is None:
        raise Impossible(f"a gate of {GATE:g} mm finds no place beside the riser")
    depth, _, x, y = best
    return _Channel(mm(x), mm(y), mm(top - depth - 0.05), mm(gate), mm(sprue))


def _distance(part: CrossSection, x: float, y: float) -> float:
    return min(float(np.hypot(*(loop - (x, y)).T).min()) for loop in part.to_polygons())


def _at(place: Sequence[float]) -> str:
    x, y, z = (round(float(value), 2) + 0.0 for value in place)
    return f"at x = {x:g}, y = {y:g}, z = {z:g} mm"
