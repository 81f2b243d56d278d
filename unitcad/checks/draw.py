"""C300: every piece comes out, in the plan's order, without passing through a piece that stays.

Removed pieces are ignored. An order that can't be followed is a finding too.

A piece that moves along +z meets a piece that stays if, and only if, on one vertical line an upward face of the first
is below (or against) a downward face of the second. So the test is exact for any polyhedron: project the faces along
the way, clip each pair of triangles against each other and take the part in which the moving piece's is below. No
height is sampled.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, lru_cache
from itertools import takewhile

import numpy as np
from manifold3d import Manifold

from unitcad.checks import overlap
from unitcad.checks.finding import MouldCheck, MouldFinding, at_most
from unitcad.geometry.boxes import Frame, boxes_of, frame_of, meeting_between, morton_order
from unitcad.kernels.mesh import arrays, thick_pieces
from unitcad.moulds.cavities import boxes_meet, united
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.pieces import CAST, Removal, Way
from unitcad.moulds.plan import Step

BLOCKED = 1e-5
"""Largest area of facing faces, mm2: rounding of faces that only touch along an edge."""
LEVEL = 1e-9
"""Heights nearer than this are equal, mm."""
_Named = Sequence[tuple[str, Manifold]]
_BLOCK = 100_000  # pairs of triangles clipped together


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Yield the blocked area of every removed piece, and every step of the order that can't be done.

    If pieces overlap, the moving piece is cut out of the others first: silicone has taken the tool's real shape.
    """
    overlapping = any(not finding.ok for finding in overlap.findings(moulds))
    facing = cache(_facing)
    steps = moulds.plan.steps
    for step, after in zip(steps, (*steps[1:], None), strict=True):
        there = {name: moulds.pressed[name] for name in step.tools}
        layers = moulds.meshes((*step.layer, *step.earlier))
        laid = [(body.name, moulds.mesh(body)) for body in step.inserts]
        silicone = [*(("layer", solid) for solid in layers), *laid]
        whole: Manifold | None = None
        together: dict[Removal, float] = {}
        for place, removal in enumerate(step.removals):
            where = f"pour {step.index}: {removal.piece}{removal.part and f' {removal.part}'} out"
            cast = removal.piece == CAST
            if cast and silicone:
                whole = united(layers) if whole is None else whole
                piece, whole = _parted(moulds, whole, removal)
                if not thick_pieces(piece):
                    yield _out_of_order(where, "there is no silicone where this part should be")
                    continue
                # Silicone bends, so a remaining layer lets a part go.
                silicone = [("layer", whole)] if thick_pieces(whole) else []
            elif removal.piece in there:
                piece = there.pop(removal.piece)
            else:
                yield _out_of_order(where, "it is not there: it was removed before, or is not part of this pour")
                continue
            areas, way, apart = [], removal.direction, []
            stays = [*there.items(), *silicone]
            if not (cast or overlapping or removal in together):
                together |= _together(step.removals[place:], piece, stays, facing)
            if together.get(removal, math.inf) <= BLOCKED:
                yield at_most("C300", where, together[removal], BLOCKED, "mm2")
                continue
            for name, solid in stays:
                if cast and name == "layer":
                    continue
                if overlapping and boxes_meet(piece, solid):
                    # Silicone has taken the tool's shape, whichever of the two moves.
                    areas.append(
                        (blocked_area(piece - solid, solid, way) if cast else blocked_area(piece, solid, way), name)
                    )
                elif _in_the_way(piece, solid, way):
                    apart.append((name, facing(solid, way, False)))
            areas += _areas(facing(piece, way, True), apart) if apart else []
            largest, name = max(areas, default=(0.0, ""))
            where += f" against {name}" if largest > BLOCKED else ""
            advice = f"part of the piece is under {name}: the two are drawn with an undercut"
            yield at_most("C300", where, sum(area for area, _ in areas), BLOCKED, "mm2", advice)
        if whole is not None and silicone:
            part = f"{whole.volume():.3g} mm3 of the silicone"
            yield _out_of_order(f"pour {step.index}: {part} stay", "no removed part carries them")
        yield from _left(moulds, step, after, there, cast=bool(silicone))


def _parted(moulds: MouldSet, silicone: Manifold, removal: Removal) -> tuple[Manifold, Manifold]:
    """Return the part of the silicone that a removal takes, and the rest."""
    if removal.within is None:
        return silicone, Manifold()
    part, rest = silicone.split(moulds.mesh_of(removal.within))
    return part, rest


def _together(
    removals: Sequence[Removal], first: Manifold, stays: _Named, facing: Callable[[Manifold, Way, bool], np.ndarray]
) -> dict[Removal, float]:
    """Return for the first removals, of pieces that go the same way, the area at which any of them meets anything.

    `first` is the piece of the first removal. Removed pieces count as staying too, so a piece that is free here is free
    in any order. One after the other, a hundred filaments under a plate would each be compared with the whole plate.
    """
    way, there = removals[0].direction, dict(stays)
    like = takewhile(lambda each: each.direction == way and each.piece in there and each.piece != CAST, removals[1:])
    going = [removals[0], *like]
    if len(going) == 1:
        return {}
    up = np.concatenate([facing(piece, way, True) for piece in (first, *(there[each.piece] for each in going[1:]))])
    down = np.concatenate([facing(solid, way, False) for solid in (first, *(solid for _, solid in stays))])
    return dict.fromkeys(going, _meeting(up, down))


def _areas(piece: np.ndarray, others: list[tuple[str, np.ndarray]]) -> list[tuple[float, str]]:
    """Return the blocked area by name, computed for all others at once if it is zero.

    One after the other they would take the square of the cells' number.
    """
    total = _meeting(piece, np.concatenate([faces for _, faces in others]))
    if total <= BLOCKED:
        return [(total, "")]
    return [(_meeting(piece, faces), name) for name, faces in others]


def _left(
    moulds: MouldSet, step: Step, after: Step | None, there: Iterable[str], *, cast: bool
) -> Iterator[MouldFinding]:
    """Yield a finding for every piece that the order leaves in the way of the next pour, or in the unit.

    `cast`: the silicone is still there. It must be there for a next pour that is cast on it, and removed before one
    that it is laid into; after the last it is peeled off the remaining pieces.
    """
    for name in there if after or cast else ():
        if moulds.plan.tool(name).removal and name not in (after.tools if after else ()):
            then = f"pour {after.index} has no place for it" if after else "it holds the unit"
            yield _out_of_order(f"pour {step.index}: {name} stays", f"it is never taken away, and {then}")
    stays = after and (*step.earlier, *step.layer) == after.earlier
    if after and stays and not cast:
        yield _out_of_order(f"pour {step.index}: {CAST} out", f"pour {after.index} is cast on it")
    if after and cast and not stays:
        yield _out_of_order(f"pour {step.index}: {CAST} stays", f"pour {after.index} has it laid in elsewhere")


def _out_of_order(where: str, why: str) -> MouldFinding:
    """Return the finding of a step that can't be done."""
    return at_most("C300", where, 1, 0, "", f"the order of removal is impossible: {why}")


def blocked_area(piece: Manifold, stays: Manifold, direction: Way) -> float:
    """Return the area, mm2, of upward faces of `piece` below downward faces of `stays` along `direction`.

    `direction` is any vector but 0. A face below several others counts once for each of them. If the two overlap at the
    start, `piece` is cut out of `stays`.
    """
    return _meeting(_facing(piece, direction, True), _facing(stays - piece, direction, False))


def _meeting(up: np.ndarray, down: np.ndarray) -> float:
    """Area of the triangles `up` (n, 3, 3) below, or against, the triangles `down`."""
    # Most of the larger set is far from a small piece.
    up, down = (up, _in_sight(down, up)) if len(up) < len(down) else (_in_sight(up, down), down)
    if not len(up) or not len(down):
        return 0.0
    frame = frame_of(np.concatenate([up, down]).reshape(-1, 3))
    up, risen = _boxed(up, frame, 0)
    down, sunk = _boxed(down, frame, LEVEL)
    # A triangle may meet all that is above it: upward boxes have no top, downward ones no bottom.
    risen[:, 5], sunk[:, 2] = 0, 0
    total = 0.0
    for first, second in meeting_between(risen, sunk):
        for start in range(0, len(first), _BLOCK):
            one, other = up[first[start : start + _BLOCK]], down[second[start : start + _BLOCK]]
            near = _overlap(one, other)
            total += float(_area_below(one[near], other[near]).sum())
    return total


def _in_sight(triangles: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the triangles that reach into the box, seen along the way, of the others."""
    if not len(triangles) or not len(others):
        return triangles[:0]
    low, high = others[:, :, :2].min(axis=(0, 1)), others[:, :, :2].max(axis=(0, 1))
    keep = np.ones(len(triangles), bool)
    for axis in range(2):
        first, second, third = triangles[:, :, axis].T
        keep &= np.maximum(np.maximum(first, second), third) >= low[axis]
        keep &= np.minimum(np.minimum(first, second), third) <= high[axis]
    return triangles[keep]


def _boxed(triangles: np.ndarray, frame: Frame, higher: float) -> tuple[np.ndarray, np.ndarray]:
    """Return triangles in an order in which neighbours are near, and their boxes, raised by `higher`."""
    steps = frame.steps(triangles.reshape(-1, 3) + np.array([0.0, 0.0, higher]))
    corners = np.arange(len(triangles) * 3).reshape(-1, 3)
    order = morton_order(steps, corners[:, 0])
    return triangles[order], boxes_of(steps, *corners[order].T)


def _in_the_way(piece: Manifold, stays: Manifold, direction: Way) -> bool:
    """Tell whether the boxes of moving and staying pieces can meet."""
    p, q = piece.bounding_box(), stays.bounding_box()
    for axis, way in enumerate(direction):
        if way >= 0 and q[axis + 3] < p[axis] - LEVEL:
            return False
        if way <= 0 and q[axis] > p[axis + 3] + LEVEL:
            return False
    return True


def _facing(solid: Manifold, direction: Way, upwards: bool) -> np.ndarray:
    """Return the triangles (n, 3, 3) that face along the direction (or against it), in a frame whose +z it is."""
    vertices, faces = arrays(solid)
    corners = (vertices @ upright(direction).T)[faces]
    doubled = _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return corners[doubled > 1e-9] if upwards else corners[doubled < -1e-9]


@lru_cache(maxsize=256)
def upright(direction: Way) -> np.ndarray:
    """Return a rotation that turns a direction to +z, by rows; for a signed axis it is exact."""
    up = np.asarray(direction, float) / math.hypot(*direction)
    across = np.cross(np.roll(np.eye(3)[np.argmax(np.abs(up))], 1), up)
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(up, across), up])


def _overlap(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Tell whether the boxes of two triangles share area in plan: a common edge is none."""
    one, other = first[:, :, :2], second[:, :, :2]
    return ((one.min(1) < other.max(1)) & (other.min(1) < one.max(1))).all(1)


def _area_below(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the area in plan of each triangle of `first` on or below its partner of `second`."""
    polygon = first[:, :, :2]
    sense = np.sign(_cross(second[:, 1] - second[:, 0], second[:, 2] - second[:, 0]))
    for i in range(3):
        start, along = second[:, i, :2], second[:, (i + 1) % 3, :2] - second[:, i, :2]
        side = sense[:, None] * _cross(along[:, None], polygon - start[:, None])
        polygon = _clip(polygon, side)
    gap = _height(second, polygon) - _height(first, polygon)
    polygon = _clip(polygon, gap + LEVEL)
    after = np.roll(polygon, -1, axis=1)
    return np.abs(np.sum(_cross(polygon, after), axis=1)) / 2


def _clip(polygon: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Return the part of convex polygons (n, m, 2) in which a linear function, given at the corners, is >= 0.

    Corners that are no longer needed repeat another one, which adds no area; a polygon wholly outside shrinks to one
    point.
    """
    after, value_after = np.roll(polygon, -1, axis=1), np.roll(value, -1, axis=1)
    inside, crosses = value >= 0, (value >= 0) != (value_after >= 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(crosses, value / (value - value_after), 0.0)
    crossing = polygon + share[..., None] * (after - polygon)
    n, m = value.shape
    corners = np.stack([polygon, crossing], axis=2).reshape(n, 2 * m, 2)
    kept = np.stack([inside, crosses], axis=2).reshape(n, 2 * m)
    order = np.argsort(~kept, axis=1, kind="stable")
    count = kept.sum(axis=1)
    # The first kept corner replaces those that fall away.
    index = np.where(np.arange(2 * m) < count[:, None], order, order[:, :1])
    corners = np.take_along_axis(corners, index[..., None], axis=1)
    return corners[:, : max(1, int(count.max(initial=0)))]


def _height(triangle: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the height of each triangle's plane at its own points (n, m, 2)."""
    a, ab, ac = triangle[:, 0], triangle[:, 1] - triangle[:, 0], triangle[:, 2] - triangle[:, 0]
    doubled = _cross(ab, ac)
    slope_x = (ab[:, 2] * ac[:, 1] - ac[:, 2] * ab[:, 1]) / doubled
    slope_y = (ac[:, 2] * ab[:, 0] - ab[:, 2] * ac[:, 0]) / doubled
    offset = points - a[:, None, :2]
    return a[:, 2, None] + slope_x[:, None] * offset[..., 0] + slope_y[:, None] * offset[..., 1]


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


CHECK = MouldCheck("C300", "draw: every piece comes out in the order of the procedure", findings)
