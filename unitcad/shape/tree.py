"""Solids as data: a small frozen tree that three kernels realise. Lengths in mm on the grid.

Quarter turns keep everything on the grid. A solid turned by another angle has its grid in the turned frame: a solid is
drawn and cut there, then turned as a whole. Points that are equal in that frame stay equal; coincident faces stay so up
to rounding, so the joint of two such pieces next to a cavity needs a seal that reaches into both.

A tree is hashable, picklable and costs nothing to import; `content_hash` is stable over processes and machines.
"""

from __future__ import annotations

import hashlib
import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from unitcad.shape.profile import GRID_PER_MM, Profile, ProfileError, mm, rectangle

SCHEMA = 1
"""Part of every hash: raise it when a node's meaning changes."""


@dataclass(frozen=True)
class Revolve:
    """A profile in the (r, z) half-plane, turned fully about the z axis. Raises ProfileError if r < 0."""

    profile: Profile

    def __post_init__(self) -> None:
        if self.profile.bounds[0] < -1e-9:  # an arc's computed extreme may miss the axis by a rounding
            raise ProfileError(f"crosses the axis: r = {self.profile.bounds[0]}")


@dataclass(frozen=True)
class Extrude:
    """A profile in (x, y), from z0 up to z1, with `holes`; `top`, with as many vertices, makes a ruled taper."""

    profile: Profile
    z0: float
    z1: float
    holes: tuple[Profile, ...] = ()
    top: Profile | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "z0", mm(self.z0))
        object.__setattr__(self, "z1", mm(self.z1))
        if self.z1 <= self.z0:
            raise ProfileError(f"has no height: z0 = {self.z0}, z1 = {self.z1}")
        if self.top is not None and (self.holes or len(self.top.vertices) != len(self.profile.vertices)):
            raise ProfileError("a taper has no holes and as many vertices above as below")
        if self.top is not None and any(
            below[2] != above[2] for below, above in zip(self.profile.vertices, self.top.vertices, strict=True)
        ):
            raise ProfileError("a taper's arcs turn by the same angle above and below")


@dataclass(frozen=True)
class Polyhedron:
    """A closed mesh with its faces outwards: corners and faces, three little-endian int32 each, as bytes.

    Coordinates count in 1/1024 mm, the grid of all solids; faces are indices of corners.
    """

    vertices: bytes
    faces: bytes


def corners_and_faces(body: Polyhedron) -> tuple[np.ndarray, np.ndarray]:
    """Return (corners (n, 3) in mm, double; faces (m, 3))."""
    corners = np.frombuffer(body.vertices, "<i4").reshape(-1, 3) / GRID_PER_MM
    return corners, np.frombuffer(body.faces, "<i4").reshape(-1, 3).astype(np.int64)


@dataclass(frozen=True)
class Union:
    """All of `parts` together."""

    parts: tuple[Shape, ...]


@dataclass(frozen=True)
class Cut:
    """`body` less every one of `tools`."""

    body: Shape
    tools: tuple[Shape, ...]


@dataclass(frozen=True)
class Common:
    """The intersection of `parts`."""

    parts: tuple[Shape, ...]


@dataclass(frozen=True)
class Component:
    """The connected piece of `shape` around the point `at` (mm)."""

    shape: Shape
    at: tuple[float, float, float]


@dataclass(frozen=True)
class Below:
    """`shape` and everything under it, straight down to z = `bottom` (mm), which is below the shape."""

    shape: Shape
    bottom: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "bottom", mm(self.bottom))


Turn = tuple[tuple[float, float, float], ...]
"""A proper rotation, by rows; made of quarter turns, it is a signed permutation of the axes in whole numbers."""
UNTURNED: Turn = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
_ROUNDING = 1e-12
"""How far rows of a rotation may be off unit length and off square to each other."""


@dataclass(frozen=True)
class Place:
    """`shape` turned by `turn`, then moved by `move` (mm). Raises ProfileError if `turn` is no proper rotation."""

    shape: Shape
    turn: Turn = UNTURNED
    move: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if self.turn is not UNTURNED and not _is_rotation(self.turn):
            raise ProfileError(f"is no rotation: {self.turn}")
        x, y, z = self.move
        object.__setattr__(self, "move", (mm(x), mm(y), mm(z)))


Shape = Revolve | Extrude | Polyhedron | Union | Cut | Common | Component | Below | Place


def cylinder(radius: float, z0: float, z1: float) -> Revolve:
    """Return a cylinder of `radius` about the z axis, from `z0` to `z1`, mm.

    Examples
    --------
    >>> from unitcad.shape import cylinder, exact_volume
    >>> round(exact_volume(cylinder(1, 0, 2)), 3)
    6.283
    """
    return Revolve(rectangle(0, z0, radius, z1))


def ring(inner: float, outer: float, z0: float, z1: float) -> Revolve:
    """Return a tube about the z axis between two radii, from `z0` to `z1`, mm."""
    return Revolve(rectangle(inner, z0, outer, z1))


def box(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> Extrude:
    """Return a box between two ends along each axis, mm.

    Examples
    --------
    >>> from unitcad.shape import box, exact_volume
    >>> exact_volume(box(0, 2, 0, 3, 0, 4))
    24.0
    """
    return Extrude(rectangle(x0, y0, x1, y1), z0, z1)


def union(parts: Iterable[Shape]) -> Shape:
    """Return the union of one or more shapes; one is returned unchanged."""
    parts = tuple(parts)
    return parts[0] if len(parts) == 1 else Union(parts)


def cut(body: Shape, tools: Iterable[Shape]) -> Shape:
    """Return `body` less `tools`; without tools the body unchanged.

    Examples
    --------
    >>> from unitcad.shape import cut, cylinder
    >>> cut(cylinder(2, 0, 1), [cylinder(1, -1, 2)]).tools == (cylinder(1, -1, 2),)
    True
    """
    tools = tuple(tools)
    return Cut(body, tools) if tools else body


def moved(shape: Shape, x: float = 0.0, y: float = 0.0, z: float = 0.0) -> Shape:
    """Return `shape` moved by (x, y, z) mm; unchanged if all are 0.

    Examples
    --------
    >>> from unitcad.shape import box, moved
    >>> moved(box(0, 1, 0, 1, 0, 1), z=2).move
    (0.0, 0.0, 2.0)
    """
    return Place(shape, move=(x, y, z)) if (x, y, z) != (0.0, 0.0, 0.0) else shape


def turned(shape: Shape, axis: str, quarters: int) -> Shape:
    """Return `shape` turned about an axis through the origin by quarter turns, counter-clockwise."""
    return rotated(shape, axis, 90.0 * quarters)


def rotated(shape: Shape, axis: str, degrees: float) -> Shape:
    """Return `shape` turned about an axis through the origin by an angle, counter-clockwise; as is for a full turn."""
    quarters = round(degrees / 90)
    rest = math.radians(degrees - 90.0 * quarters)
    c, s = (math.cos(rest), math.sin(rest)) if rest else (1, 0)
    # By the nearest quarter turn and the remainder: quarter turns are exact, opposite angles mirror each other.
    c, s = ((c, s), (-s, c), (-c, -s), (s, -c))[quarters % 4]
    turns: dict[str, Turn] = {
        "x": ((1, 0, 0), (0, c, -s), (0, s, c)),
        "y": ((c, 0, s), (0, 1, 0), (-s, 0, c)),
        "z": ((c, -s, 0), (s, c, 0), (0, 0, 1)),
    }
    return Place(shape, turn=turns[axis]) if (c, s) != (1, 0) else shape


def by_quarters(turn: Turn) -> bool:
    """Tell whether a rotation is made of quarter turns, so that it keeps a solid on the grid."""
    return all(entry in (-1, 0, 1) for row in turn for entry in row)


def _is_rotation(turn: Turn) -> bool:
    """Tell whether the rows are of unit length, square to each other, and right-handed."""
    a, b, c = turn
    third = (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])
    off = [abs(x - y) for x, y in zip(third, c, strict=True)]
    off += [abs(sum(x * y for x, y in zip(a, b, strict=True))), *(abs(math.hypot(*row) - 1) for row in turn)]
    return max(off) < _ROUNDING


def content_hash(shape: Shape, *more: object) -> str:
    """SHA-256 (64 hex digits) of the tree's values, the schema version and `more` (plain values)."""
    digest = hashlib.sha256(repr((SCHEMA, more)).encode())
    _feed(shape, digest)
    return digest.hexdigest()


def exact_volume(shape: Shape) -> float:
    """Return the volume in mm3 of a revolved or extruded body, placed or not, in closed form.

    Revolve: Pappus. Extrude: area times height, or for a taper Simpson's rule, exact for a ruled solid whose section
    is quadratic in z. Raises TypeError for a boolean: it has no closed form here.
    """
    match shape:
        case Revolve(profile):
            return 2 * math.pi * profile.first_moment
        case Extrude(profile, z0, z1, holes, None):
            return (profile.area - sum(hole.area for hole in holes)) * (z1 - z0)
        case Extrude(profile, z0, z1, _, Profile() as top):
            # Twice the size keeps the halved vertices on the grid: the middle section's area is a quarter of the sum's.
            pairs = zip(profile.vertices, top.vertices, strict=True)
            middle = Profile(tuple((a[0] + b[0], a[1] + b[1], a[2]) for a, b in pairs)).area / 4
            return (profile.area + 4 * middle + top.area) * (z1 - z0) / 6
        case Place(inner):
            return exact_volume(inner)
    raise TypeError(f"no closed form for {type(shape).__name__}")


def _feed(node: object, digest: hashlib._Hash) -> None:
    """Stream a tree into a digest, type and length before contents, so that no two trees share a stream."""
    match node:
        case float():
            digest.update(float.hex(node + 0.0).encode() + b";")
        case int() | str() | bytes() | None:
            digest.update(repr(node).encode() + b";")
        case tuple():
            digest.update(b"(%d" % len(node))
            for item in node:
                _feed(item, digest)
        case _:
            digest.update(type(node).__name__.encode() + b"{")
            for name in node.__dataclass_fields__:  # type: ignore[union-attr]
                _feed(getattr(node, name), digest)


Kind = Literal[
    "layer",
    "film",
    "printed",
    "motor",
    "circuit",
    "wire",
    "base",
    "cup",
    "lid",
    "tongue",
    "filament",
    "blade",
    "tray",
    "coupon",
    "frame",
    "holder",
]
"""Kind of a body: a part of the unit (layer to wire) or a piece of tooling."""


@dataclass(frozen=True)
class Body:
    """One solid, as assembled (mm, z = 0 at the skin).

    `name` comes only from role and layer number ("layer1", "cup2", "base"), never from a material or a variant, since
    files of equal bodies are shared. `made` is "cast", "printed", "cut" (from film or filament) or "bought".
    `step` is the pour that it belongs to. `upside_down`: it is printed turned by 180 degrees about x. `removal` is the
    direction in which a piece of tooling is taken away, None for one that stays; the plan has the order. `file` is the
    shape in its files if a printer's error is made up for there.
    """

    name: str
    role: Literal["unit", "tool"]
    kind: Kind
    shape: Shape
    colour: tuple[float, float, float]
    made: Literal["cast", "printed", "cut", "bought"] = "printed"
    step: int | None = None
    upside_down: bool = False
    removal: tuple[float, float, float] | None = None
    file: Shape | None = None

    @property
    def in_file(self) -> Body:
        """The body as its files have it."""
        return replace(self, shape=self.file, file=None) if self.file else self

    def __repr__(self) -> str:
        return f"Body({self.name!r}: {self.kind}, {self.made}, {type(self.shape).__name__})"


def copies(bodies: Sequence[Body]) -> list[list[int]]:
    """Return the places in the list of bodies that differ by name and a move alone: as they are printed, one solid."""
    found: dict[object, list[int]] = {}
    for i, body in enumerate(bodies):
        shape = body.shape
        while isinstance(shape, Place) and shape.turn == UNTURNED:
            shape = shape.shape
        like = (shape, body.kind, body.step, body.colour, body.made, body.upside_down)
        found.setdefault(like, []).append(i)
    return list(found.values())


def part_names(bodies: Sequence[Body], parts: Sequence[Sequence[int]]) -> list[str]:
    """Return a name for each part: its body's, or for several copies that of their kind, which no other body has."""
    taken, names = {body.name for body in bodies}, []
    for part in parts:
        first = bodies[part[0]]
        kind = f"{first.kind}{first.step or ''}"
        several = (f"{kind}-{i}" if i else kind for i in itertools.count())
        others = taken - {bodies[i].name for i in part}
        names.append(first.name if len(part) == 1 else next(name for name in several if name not in others))
        taken.add(names[-1])
    return names
