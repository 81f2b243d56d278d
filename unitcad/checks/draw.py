"""C300: every piece comes out, in the plan's order, without passing through a piece that stays.

Removed pieces are ignored. An order that can't be followed is a finding too.

A piece that moves up passes through all that is over its upward faces. So the test is exact for any polyhedron: prisms
over the faces that face along the way, cut with each piece that stays. No height is sampled. If pieces overlap at the
start, silicone has taken the tool's real shape.

A piece of a parted mould may press silicone aside as it comes off. The depth is the diameter of the largest circle in
the shadow of the silicone in the way; the strain is twice that depth over the silicone's width there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from functools import lru_cache

import numpy as np
from manifold3d import Manifold

from unitcad.checks.finding import MouldCheck, MouldFinding, at_most
from unitcad.kernels.mesh import bounds, swept_up, thick_pieces, widest
from unitcad.moulds.cavities import united
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.pieces import CAST, Way
from unitcad.moulds.plan import Step

PRESSED_PCT = 10.0
"""Strain of silicone that is pressed aside, percent, at most (assumed): some N for each cm2, from a hand."""
BLOCKED = 1e-5
"""Largest volume in the way, mm3: rounding of faces that slide along each other."""


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Yield the volume in the way of every removed piece, and every step of the order that can't be done."""
    steps = moulds.plan.steps
    for step, after in zip(steps, (*steps[1:], None), strict=True):
        there = {name: moulds.pressed[name] for name in step.tools}
        laid = {body.name: moulds.mesh(body) for body in step.inserts}
        silicone, parted = united(moulds.meshes((*step.layer, *step.earlier))), False
        for removal in step.removals:
            where = f"pour {step.index}: {removal.piece}{removal.part and f' {removal.part}'} out"
            cast = removal.piece == CAST
            if cast and not silicone.is_empty():
                within = removal.within
                piece, rest = silicone.split(moulds.mesh_of(within)) if within else (silicone, Manifold())
                if not thick_pieces(piece):
                    yield _out_of_order(where, "there is no silicone where this part should be")
                    continue
                # Silicone bends, so a remaining layer lets a part go.
                silicone, parted, laid = rest if thick_pieces(rest) else Manifold(), True, {}
                piece -= united(there.values())
            elif removal.piece in there:
                piece = there.pop(removal.piece)
            else:
                yield _out_of_order(where, "it is not there: it was removed before, or is not part of this pour")
                continue
            stays = there | laid | ({} if cast or silicone.is_empty() else {"layer": silicone})
            found = blocked(piece, stays, removal.direction)
            if moulds.plan.way and "layer" in found:
                depth, percent = _pressed_aside(piece, silicone, removal.direction)
                said = f"{where}: the layer is pressed aside by {depth:.2g} mm"
                advice = "the silicone is caught under the piece: part the mould elsewhere, or change the body there"
                yield at_most("C300", said, percent, PRESSED_PCT, "%", advice)
                del found["layer"]
            name = max(found, key=lambda name: found[name], default="")
            where += f" against {name}" if name else ""
            advice = f"part of the piece is under {name}: the two are drawn with an undercut"
            yield at_most("C300", where, sum(found.values()), BLOCKED, "mm3", advice)
        if parted and not silicone.is_empty():
            part = f"{silicone.volume():.3g} mm3 of the silicone"
            yield _out_of_order(f"pour {step.index}: {part} stay", "no removed part carries them")
        yield from _left(moulds, step, after, there, cast=not silicone.is_empty())


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


def blocked(piece: Manifold, stays: Mapping[str, Manifold], direction: Way) -> dict[str, float]:
    """Return the volume, mm3, that is in the way of a piece along `direction`, by the name of what stays.

    `direction` is any vector but 0. If two overlap at the start, `piece` is cut out of the other.
    """
    turn = np.column_stack([upright(direction), np.zeros(3)])
    piece, there = piece.transform(turn), {name: solid.transform(turn) for name, solid in stays.items()}
    x0, y0, low, x1, y1, _ = bounds(piece)
    over = {
        name: solid
        for name, solid in there.items()
        if (b := bounds(solid))[0] < x1 and x0 < b[3] and b[1] < y1 and y0 < b[4] and low < b[5]
    }
    if not over:
        return {}
    space = swept_up(piece, max(bounds(solid)[5] for solid in (piece, *over.values())) + 1)
    met = {name: space ^ solid for name, solid in over.items()}
    met = {name: float((solid - piece).volume()) for name, solid in met.items() if solid.volume() > BLOCKED}
    return {name: volume for name, volume in met.items() if volume > BLOCKED}


def pressed_aside(moulds: MouldSet) -> list[tuple[str, float, float]]:
    """Return the pieces of a parted mould that press silicone aside as they leave: name, depth in mm, percent."""
    found = []
    for step in moulds.plan.steps if moulds.plan.way else ():
        silicone = united(moulds.meshes((*step.layer, *step.earlier)))
        for removal in step.removals:
            piece = moulds.pressed.get(removal.piece)
            if piece is not None and blocked(piece, {"layer": silicone}, removal.direction):
                found.append((removal.piece, *_pressed_aside(piece, silicone, removal.direction)))
    return found


def _pressed_aside(piece: Manifold, silicone: Manifold, direction: Way) -> tuple[float, float]:
    """Return by how much silicone is pressed aside by a piece that leaves along `direction`: mm, and percent."""
    turn = np.column_stack([upright(direction), np.zeros(3)])
    piece, silicone = piece.transform(turn), silicone.transform(turn)
    met = (swept_up(piece, max(bounds(solid)[5] for solid in (piece, silicone)) + 1) ^ silicone) - piece
    depth, percent = 0.0, 0.0
    for part in met.decompose():
        if part.volume() <= BLOCKED / 100:
            continue
        shadow = part.project()
        deep = widest(shadow)[0]
        low, high = bounds(part)[2], bounds(part)[5]
        there = [each for each in silicone.slice((low + high) / 2).decompose() if not (each ^ shadow).is_empty()]
        wide = max((widest(each)[0] for each in there), default=deep)
        depth, percent = max(depth, deep), max(percent, 200 * deep / wide)
    return depth, percent


@lru_cache(maxsize=256)
def upright(direction: Way) -> np.ndarray:
    """Return a rotation that turns a direction to +z, by rows; for a signed axis it is exact."""
    up = np.asarray(direction, float) / math.hypot(*direction)
    across = np.cross(np.roll(np.eye(3)[np.argmax(np.abs(up))], 1), up)
    across /= np.linalg.norm(across)
    return np.stack([across, np.cross(up, across), up])


CHECK = MouldCheck("C300", "draw: every piece comes out in the order of the procedure", findings)
