r"""A body from a file in layers: `[body] file = "tip.stl"`. Lengths in mm.

        .-------.              .-------.
      .' .-----. '.          .'         '.   each layer is as thick as its thickness_mm,
     / .' .---. '. \        /  .-------.  \  measured from the body's surface inwards
    |  | |     | |  |      |  |  .---.  |  |
    |  | |     | |  |      |  |  | M |  |  |  layer 1 without thickness_mm fills the rest,
    '--'-'     '-'--'      '--'--'   '--'--'  round the motor's pocket
      bottom = "open"          and its notch

With bottom = "floor" layer 1 is a slab as thick as its thickness_mm. Motor and circuit are laid on it, and the other
layers are poured over them. The unit's frame has the middle of the file's box over its origin, and z = 0 at its bottom.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from manifold3d import Manifold
from msgspec import UNSET

from unitcad.designs.design import BEYOND, Design, circuit, motor, wires
from unitcad.designs.dimensions import Dimensions, concentric, wire_exit
from unitcad.designs.offset.inset import CIRCLE, inset, side_of, without_bottom
from unitcad.errors import Refusal
from unitcad.meshcheck.geometry.distance import nearest_of
from unitcad.meshcheck.geometry.mesh import solid_of
from unitcad.shape import Polyhedron, Shape, box, cut, cylinder, moved, union
from unitcad.shape.profile import GRID_PER_MM, mm
from unitcad.shape.tree import corners_and_faces
from unitcad.spec import Spec
from unitcad.spec.body_file import bodies_in
from unitcad.spec.raw import LEAST_LAYER, BodyTable
from unitcad.text import number

ABOUT = "layers of one body from a file"


@lru_cache(maxsize=16)
def body_of(file: str, source: str) -> tuple[Polyhedron, tuple[float, float, float]]:
    """Return the body of a file in the unit's frame, and the origin of that frame in the file's, mm.

    Raises Refusal for a file of several bodies.
    """
    bodies = bodies_in(file, source)
    if len(bodies) > 1:
        limit = f"has {len(bodies)} bodies, layers by offset take one; drawn layers are a design: design = {file!r}"
        raise Refusal("body.file", file, limit)
    (body,) = bodies.values()
    cells = np.frombuffer(body.vertices, "<i4").reshape(-1, 3)
    low, high = cells.min(axis=0), cells.max(axis=0)
    origin = np.array([(low[0] + high[0]) // 2, (low[1] + high[1]) // 2, low[2]])
    x, y, z = (origin / GRID_PER_MM).tolist()
    return Polyhedron(np.ascontiguousarray(cells - origin).astype("<i4").tobytes(), body.faces), (x, y, z)


def size_of(body: BodyTable) -> tuple[float, float, float]:
    """Return the lengths of a body's box, mm."""
    x, y, z = np.ptp(corners_and_faces(body_of(body.file, body.file_source or "")[0])[0], axis=0).tolist()
    return x, y, z


def layered(body: BodyTable) -> Design:
    """Return the design of a body from a file."""
    return Design(
        body.file,
        ABOUT,
        layers=_layers,
        dimensions=_dimensions,
        limits=_limits,
        advice=_advice,
        pad_radius=lambda raw, inner: 0.0,  # as wide as the motor
        laid_in=2 if body.bottom == "floor" else 0,
    )


@dataclass(frozen=True)
class _Plan:
    """The lengths of a layered body, mm: `motor` is the middle of the motor's lower face, `depths` the offset of each
    layer's outer surface, `hollow` that of a hollow; `side` the lattice's. `first` is the innermost layer by offset.
    """

    body: Polyhedron
    floor: float
    first: int
    depths: tuple[float, ...]
    hollow: float | None
    motor: tuple[float, float, float]
    side: float


def _plan(spec: Spec) -> _Plan:
    table = spec.body
    assert isinstance(table, BodyTable)
    body, origin = body_of(table.file, table.file_source or "")
    first = 1 if table.bottom == "floor" else 0
    thick = [layer.wall_mm for layer in spec.layers]
    depths = tuple(mm(sum(thick[i + 1 :])) for i in range(len(thick)))
    hollow = mm(sum(thick[first:])) if spec.layers[first].thickness_mm is not UNSET else None
    floor = mm(thick[0]) if first else 0.0
    at = spec.motor.at
    x, y, z = (mm(a - o) for a, o in zip(at, origin, strict=True)) if isinstance(at, tuple) else (0.0, 0.0, floor)
    offsets = [each for each in (*depths[first:-1], *((hollow,) if hollow else ()))]
    least = min((thick[i] for i in range(first, len(thick)) if i > first or hollow), default=1.0)
    return _Plan(body, floor, first, depths, hollow, (x, y, z), side_of(body, least, min(offsets, default=least)))


def _dimensions(spec: Spec) -> Dimensions:
    height = spec.motor.thickness_mm
    return concentric(spec, height, wire_exit(spec, height))


def _limits(spec: Spec, dims: Dimensions) -> None:
    """Raise Refusal for layers that the body has no room for, and for a motor that comes too near to its surface."""
    plan, last = _plan(spec), len(spec.layers) - 1
    if plan.first > last:
        raise Refusal("layers", last + 1, 'bottom = "floor" takes two layers or more: the floor, and one over it')
    for i in range(plan.first + 1, last + 1):
        if plan.side > spec.layers[i].wall_mm / 2:
            limit = f"is too thin for a body of this size: at least {2 * plan.side:.2g} mm"
            raise Refusal(f"layers.{i}.thickness_mm", spec.layers[i].wall_mm, limit, math.ceil(20 * plan.side) / 10)
    key = f"layers.{plan.first}.thickness_mm"
    if plan.hollow and plan.first:
        raise Refusal(key, spec.layers[plan.first].wall_mm, "the floor would close its hollow: leave it out to fill it")
    if spec.motor.absent:
        return
    if plan.hollow:
        if spec.motor.at is UNSET:
            limit = "is required in a hollow body: the middle of the motor's lower face, in the file's frame"
            raise Refusal("motor.at", None, f"{limit}; or motor = false")
        for field in ("fpcb", "wires"):
            if getattr(spec, field):
                raise Refusal(field, None, "the motor's leads leave a hollow body by its mouth: leave it out", False)
    _check_motor(spec, plan, dims)


def _check_motor(spec: Spec, plan: _Plan, dims: Dimensions) -> None:
    """Raise Refusal for a motor whose pocket leaves too little of layer 1 round it."""
    (x, y, z), radius = plan.motor, dims.motor_radius
    given = list(spec.motor.at) if isinstance(spec.motor.at, tuple) else None
    if z < plan.floor:
        raise Refusal(
            "motor.at", given, f"the motor would be {plan.floor - z:.3g} mm under the floor's top or the seat"
        )
    top = z + _stack(spec)
    turn = np.linspace(0, 2 * np.pi, 96, endpoint=False)
    rings = [(radius, level) for level in np.linspace(z, top, 5)] + [(radius * share, top) for share in (0.0, 0.5)]
    points = np.concatenate(
        [np.stack([x + r * np.cos(turn), y + r * np.sin(turn), np.full(96, level)], axis=1) for r, level in rings]
    )
    corners, faces = corners_and_faces(plan.body)
    pocket = Manifold.cylinder(top - z, radius, circular_segments=96).translate((x, y, z))
    needed = plan.depths[plan.first] + LEAST_LAYER
    says = f"{number(needed, 3)} mm is needed: the layers round it and {LEAST_LAYER:g} mm of layer {plan.first + 1}"
    if (pocket - solid_of(corners, faces)).volume() > 1e-3 * pocket.volume():
        raise Refusal("motor.at", given, f"the motor would stick out of the body; {says}")
    away = nearest_of(without_bottom(corners, faces)).distances(points)
    if away.min() < needed - plan.side / 4:
        px, py, pz = points[away.argmin()]
        place = f"x = {px:.3g}, y = {py:.3g}, z = {pz:.3g} mm over the body's bottom"
        raise Refusal("motor.at", given, f"the motor is {away.min():.3g} mm from the surface at {place}; {says}")


def _stack(spec: Spec) -> float:
    """Return the height of motor and circuit, mm."""
    return spec.motor.thickness_mm + (spec.fpcb.thickness_mm if spec.fpcb else 0.0)


def _layers(spec: Spec, dims: Dimensions) -> Mapping[str, Shape]:
    plan, far = _plan(spec), 2 * dims.outer_radius + 10
    bought = _bought(spec, plan, dims)
    inside = list(bought.values()) if plan.first else _pocket(spec, plan, dims, far)
    surfaces = [_inside(spec, plan, i, plan.depths[i]) for i in range(len(plan.depths))]
    seat = box(-far, far, -far, far, -far, plan.floor)
    drawn: dict[str, Shape] = {}
    if plan.first:
        drawn["layer1"] = cut(plan.body, [box(-far, far, -far, far, plan.floor, 2 * far + 100)])
    for i in range(plan.first, len(surfaces)):
        hollow = _inside(spec, plan, i, plan.hollow) if plan.hollow and i == plan.first else None
        inner = surfaces[i - 1] if i > plan.first else hollow
        below = [seat] if plan.floor or plan.depths[i] else []
        drawn[f"layer{i + 1}"] = cut(surfaces[i], [*below, *([inner] if inner else []), *inside])
    return drawn | bought


def _inside(spec: Spec, plan: _Plan, layer: int, depth: float) -> Polyhedron:
    """Return the body's inside from a depth on. Raises Refusal, at the layer, if nothing is that deep."""
    if not depth or layer < plan.first:
        return plan.body
    found = inset(plan.body, depth, plan.side)
    if found is None:
        around = layer if depth == plan.hollow else layer + 1
        inside = (
            "no hollow is left in it: leave it out to fill the body"
            if depth == plan.hollow
            else f"no layer {layer + 1}"
        )
        limit = f"nothing of the body is {depth:g} mm under its surface, so that {inside}"
        raise Refusal(f"layers.{around}.thickness_mm", spec.layers[around].wall_mm, limit)
    return found


def _bought(spec: Spec, plan: _Plan, dims: Dimensions) -> dict[str, Shape]:
    """Draw motor, circuit and wires at their place; on a floor the circuit is under the motor."""
    x, y, z = plan.motor
    if spec.motor.absent:
        return {}
    under = spec.fpcb.thickness_mm if spec.fpcb and plan.first else 0.0
    drawn = {"motor": moved(motor(dims), x, y, z + under)}
    if spec.fpcb and dims.pad:
        drawn["fpcb"] = moved(circuit(spec.fpcb, dims.pad, dims), x, y, z - (dims.pad.low if under else 0.0))
    if spec.wires and dims.exit:
        each = wires(spec.wires, dims.exit.wires_y, dims)
        drawn |= {f"wire{i}": moved(shape, x, y, z) for i, shape in enumerate(each, 1)}
    return drawn


def _pocket(spec: Spec, plan: _Plan, dims: Dimensions, far: float) -> list[Shape]:
    """Draw the motor's pocket, and the notch of its leads, both open to the skin."""
    x, y, z = plan.motor
    if spec.motor.absent:
        return []
    top = z + _stack(spec)
    pocket: list[Shape] = [cylinder(dims.motor_radius, -BEYOND, top)]
    half = (spec.fpcb.tail_width_mm + spec.moulds.slot_width_clearance_mm) / 2 if spec.fpcb else 0.0
    half = dims.exit.width / 2 if dims.exit else half
    pocket += [box(min(0, s * far), max(0, s * far), -half, half, -BEYOND, top) for s in dims.sides]
    return [moved(union(pocket), x, y)]


def _advice(spec: Spec, dims: Dimensions) -> list[str]:
    plan = _plan(spec)
    thin = min(layer.wall_mm for layer in spec.layers)
    if CIRCLE * plan.side <= thin / 2:
        return []
    return [
        f"the body is large for its layers: at sharp edges a layer may be {CIRCLE * plan.side:.2g} mm off its thickness"
    ]
