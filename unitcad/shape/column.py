"""The part of a set of shapes inside an upright round column, found from the trees without meshes.

Two columns with the same shapes at the same places contain the same solid, so one finding is valid for both.
The trees are cut down to the nodes that reach into the column, and moved so that its axis is at x = y = 0. Parts of a
node outside the column are dropped as far as its box, or a plate's outline, shows them; so equal results mean congruent
contents, and different ones mean nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from unitcad.shape.profile import GRID_PER_MM, Profile, mm, points
from unitcad.shape.tree import (
    UNTURNED,
    Below,
    Common,
    Component,
    Cut,
    Extrude,
    Place,
    Polyhedron,
    Revolve,
    Shape,
    Turn,
    Union,
    box,
    by_quarters,
)

Point = tuple[float, float, float]
Extent = tuple[float, float, float, float, float, float]
"""The low corner of a box, then the high one, mm."""

_ORIGIN: Point = (0.0, 0.0, 0.0)
_ARC_SIDES = 96
_OUTSIDE = 1.0
"""How far beyond the column a box that reaches farther is cut off, mm."""
_CLEAR = 1 / 64
"""Largest distance of a circle's polygon from its arc; nearer than this two things count as touching, mm."""


@dataclass(frozen=True)
class Column:
    """An upright cylinder about (x, y) between two heights; mm."""

    x: float
    y: float
    radius: float
    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        object.__setattr__(self, "x", mm(self.x))
        object.__setattr__(self, "y", mm(self.y))


class Standing:
    """Shapes in their places, ready for being asked which of them reach into a column, and how."""

    def __init__(self, shapes: Iterable[Shape]) -> None:
        shapes, nodes = tuple(shapes), _Nodes()
        self._kept = shapes  # their parts are told apart by identity
        self._group = _Node(Union, [nodes.of(shape) for shape in shapes])

    def inside(self, column: Column) -> list[int]:
        """Return the places in the list of the shapes that may reach into the column."""
        return [int(i) for i in self._group.near(column)]

    def within(self, column: Column) -> tuple[Shape, ...]:
        """Return the contents of the column, its axis moved to x = y = 0: equal for columns of equal contents."""
        parts = (self._group.children[i].within(column) for i in self._group.near(column))
        return tuple(part for part in parts if part is not None)


class _Node:
    """A node of a tree with the boxes of its placed children."""

    def __init__(
        self,
        kind: type,
        children: Sequence[_Node] = (),
        leaf: Shape | None = None,
        place: tuple[Turn, Point] = (UNTURNED, _ORIGIN),
        extent: Extent | None = None,
    ) -> None:
        self.kind, self.children, self.leaf, self.turn, self.move = kind, children, leaf, *place
        self._outlines: list[np.ndarray] = []
        self._extents = np.array([child.extent for child in children]).reshape(-1, 6)
        low, high = self._extents[:, :3], self._extents[:, 3:]
        if extent is not None or not children:
            self.extent = extent or (*_ORIGIN, *_ORIGIN)
        elif kind is Cut:
            self.extent = children[0].extent
        elif kind is Common:
            self.extent = *low.max(axis=0).tolist(), *high.min(axis=0).tolist()
        else:
            self.extent = *low.min(axis=0).tolist(), *high.max(axis=0).tolist()

    def near(self, column: Column) -> np.ndarray:
        """Return which children's boxes reach into the column."""
        axis = np.array([column.x, column.y])
        beside = np.maximum(np.maximum(self._extents[:, :2] - axis, axis - self._extents[:, 3:5]), 0.0)
        reaches = np.hypot(beside[:, 0], beside[:, 1]) <= column.radius
        return np.flatnonzero(reaches & (self._extents[:, 2] <= column.high) & (self._extents[:, 5] >= column.low))

    def outlines(self, leaf: Extrude) -> list[np.ndarray]:
        """Return the placed outlines of an upright prism, mm: below, above if it tapers, its holes."""
        if not self._outlines:
            turn = np.array(self.turn, float)[:2, :2]
            for profile in (leaf.profile, *((leaf.top,) if leaf.top else ()), *leaf.holes):
                self._outlines.append(points(profile, _ARC_SIDES) @ turn.T + np.array(self.move[:2]))
        return self._outlines

    def within(self, column: Column) -> Shape | None:
        if self.leaf is not None:
            return _leaf_within(self, self.leaf, column)
        near = self.near(column)
        if self.kind in (Cut, Common) and (len(near) == 0 or near[0] != 0):
            return None
        if self.kind is Common and len(near) < len(self.children):
            return None
        parts = [self.children[i].within(column) for i in near]
        if self.kind is Common:
            return None if None in parts else Common(tuple(part for part in parts if part is not None))
        if self.kind is Cut and parts[0] is None:
            return None
        first, *rest = [part for part in parts if part is not None] or [None]
        if not rest or first is None:
            return first
        return Cut(first, tuple(rest)) if self.kind is Cut else Union((first, *rest))


class _Nodes:
    """Makes the nodes of trees, one for a part that several of them share."""

    def __init__(self) -> None:
        self._made: dict[tuple[int, Turn, Point], _Node] = {}

    def of(self, shape: Shape, turn: Turn = UNTURNED, move: Point = _ORIGIN) -> _Node:
        while isinstance(shape, Place):
            move = _transform(turn, shape.move, move)
            if shape.turn != UNTURNED:
                turn = _both(turn, shape.turn)
            shape = shape.shape
        key = id(shape), turn, move
        if key not in self._made:
            self._made[key] = self._new(shape, turn, move)
        return self._made[key]

    def _new(self, shape: Shape, turn: Turn, move: Point) -> _Node:
        match shape:
            case Union(parts) | Common(parts):
                return _Node(type(shape), [self.of(part, turn, move) for part in parts])
            case Cut(body, tools):
                return _Node(Cut, [self.of(part, turn, move) for part in (body, *tools)])
        return _Node(type(shape), (), shape, (turn, move), _placed_box(_box_of(shape), turn, move))


def _both(turn: Turn, first: Turn) -> Turn:
    """Return the rotation `first`, then `turn`."""
    a, b, c = (tuple(row[i] for row in first) for i in range(3))
    return tuple((_dot(row, a), _dot(row, b), _dot(row, c)) for row in turn)


def _dot(row: Sequence[float], column: Sequence[float]) -> float:
    return sum(one * other for one, other in zip(row, column, strict=True))


def extent(shape: Shape) -> Extent:
    """Return a box around a shape: (x0, y0, z0, x1, y1, z1), mm; of a cut shape the box of its body."""
    return _Nodes().of(shape).extent


@lru_cache(maxsize=4096)
def _box_of(shape: Shape) -> Extent:
    """Return a box around a leaf in its own frame, mm; a circle's polygon may exceed the circle a little."""
    match shape:
        case Revolve(profile):
            _, z0, r, z1 = profile.bounds
            r *= 1 + 1 / 32  # an area-true polygon of 24 sides, the coarsest, reaches to 1.012 r
            return -r, -r, z0, r, r, z1
        case Extrude(profile, z0, z1, _, top):
            x0, y0, x1, y1 = profile.bounds
            if top is not None:
                u0, v0, u1, v1 = top.bounds
                x0, y0, x1, y1 = min(x0, u0), min(y0, v0), max(x1, u1), max(y1, v1)
            return x0, y0, z0, x1, y1, z1
        case Polyhedron(vertices, _):
            corners = np.frombuffer(vertices, "<i4").reshape(-1, 3) / GRID_PER_MM
            return *corners.min(axis=0).tolist(), *corners.max(axis=0).tolist()
        case Component(inner, _):
            return _Nodes().of(inner).extent
        case Below(inner, bottom):
            x0, y0, z0, x1, y1, z1 = _Nodes().of(inner).extent
            return x0, y0, min(bottom, z0), x1, y1, z1
    raise TypeError(f"not a leaf: {shape!r}")


def _placed_box(extent: Extent, turn: Turn, move: Point) -> Extent:
    if turn == UNTURNED:
        x, y, z = move
        return extent[0] + x, extent[1] + y, extent[2] + z, extent[3] + x, extent[4] + y, extent[5] + z
    # Along each axis the two corners that reach least and farthest: exact for quarter turns, a bound for others.
    ends = [
        [sum(pick(row[k] * extent[k], row[k] * extent[k + 3]) for k in range(3)) + by for pick in (min, max)]
        for row, by in zip(turn, move, strict=True)
    ]
    (x0, x1), (y0, y1), (z0, z1) = ends
    return x0, y0, z0, x1, y1, z1


def _transform(turn: Turn, point: Point, move: Point) -> Point:
    """Return a point turned, then moved."""
    x, y, z = (sum(row[k] * point[k] for k in range(3)) + by for row, by in zip(turn, move, strict=True))
    return x, y, z


def _leaf_within(node: _Node, leaf: Shape, column: Column) -> Shape | None:
    reach = mm(column.radius) + _OUTSIDE
    on_grid = by_quarters(node.turn)
    if on_grid and isinstance(leaf, Extrude) and leaf.top is None and not leaf.holes and _is_rectangle(leaf.profile):
        x0, y0, z0, x1, y1, z1 = node.extent
        left, right = max(x0 - column.x, -reach), min(x1 - column.x, reach)
        return box(left, right, max(y0 - column.y, -reach), min(y1 - column.y, reach), z0, z1)
    if isinstance(leaf, Extrude) and abs(node.turn[2][2]) == 1:
        outlines = node.outlines(leaf)
        ends = 1 if leaf.top is None else 2
        outside = [_side_of(outline, column) for outline in outlines]
        if max(outside[:ends]) < 0 and all(side > 0 for side in outside[ends:]):
            return box(-reach, reach, -reach, reach, node.extent[2], node.extent[5])
        if leaf.top is None and outside[0] > 0:
            return None
    x, y, z = node.move
    placed = Place(leaf, node.turn, (x - column.x, y - column.y, z))
    if not on_grid:
        # Off the grid: snapped, two leaves at different places could become equal.
        object.__setattr__(placed, "move", tuple(round(v, 9) for v in (x - column.x, y - column.y, z)))
    return placed


def _is_rectangle(profile: Profile) -> bool:
    corners = profile.vertices
    if len(corners) != 4 or any(bulge for _, _, bulge in corners):
        return False
    return len({x for x, _, _ in corners}) == 2 and len({y for _, y, _ in corners}) == 2


def _side_of(corners: np.ndarray, column: Column) -> int:
    """Return the column's place relative to an upright prism's outline: -1 inside, 1 outside, 0 across."""
    corners = corners - (column.x, column.y)
    after = np.roll(corners, -1, axis=0)
    along = after - corners
    share = np.clip(-np.einsum("ij,ij->i", corners, along) / np.einsum("ij,ij->i", along, along), 0.0, 1.0)
    nearest = np.hypot(*(corners + share[:, None] * along).T).min()
    if nearest <= column.radius + _CLEAR:
        return 0
    # The angle that the outline turns through about the axis: a full turn if the axis is inside.
    turned = np.arctan2(
        corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0], np.einsum("ij,ij->i", corners, after)
    ).sum()
    return -1 if abs(turned) > math.pi else 1
