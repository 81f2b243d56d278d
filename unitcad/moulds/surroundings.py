"""Places of a mould set in like surroundings: a result at one of them is valid at all.

Congruent places of a mould: a result at one of them is valid at all.

A place is an upright column. Two places are alike if the drawn shapes reach into them in the same way
(`shape/column.py`), and if the meshes have the same corners there: a kernel that loses a wedge at one of a hundred
cells makes that cell one of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from manifold3d import Manifold

from unitcad.kernels.mesh import arrays, realise
from unitcad.moulds.plan import Plan, Step
from unitcad.shape import Shape
from unitcad.shape.column import Column, Standing

_Judged = TypeVar("_Judged")

SAME = 1e-6
"""Distance up to which two corners of meshes are one, mm."""
MARGIN = 0.2
"""Margin of a column round the examined part, mm: less than the thinnest wall."""
SLACK = 0.1
"""How much wider than a column's circle its box is taken, mm: the polygon about it reaches beyond it."""
_DIRECTIONS = np.array([[0.3217, 0.5931, 0.7381], [0.8017, -0.2713, 0.5326]])
_SIDES = 48
_FLAT = 1e-8
"""Largest least eigenvalue of the sum of n n', over the normals n of a vertex, at which they count as in one plane."""


def column_round(solids: Sequence[Manifold], margin: float) -> Column:
    """Return the column round solids, `margin` (mm) larger than they are about their box's middle."""
    boxes = np.array([solid.bounding_box() for solid in solids])
    low, high = boxes[:, :2].min(axis=0), boxes[:, 3:5].max(axis=0)
    x, y = (low + high) / 2
    column = Column(float(x), float(y), 0.0)
    corners = np.concatenate([arrays(solid)[0][:, :2] for solid in solids]) - (column.x, column.y)
    ends = float(boxes[:, 2].min()) - margin, float(boxes[:, 5].max()) + margin
    return Column(column.x, column.y, float(np.hypot(*corners.T).max()) + margin, *ends)


def crop(solid: Manifold, column: Column) -> Manifold:
    """Return the part of a solid in a column, whose round wall is a polygon about it."""
    low, high = max(solid.bounding_box()[2] - 1, column.low), min(solid.bounding_box()[5] + 1, column.high)
    if low >= high:
        return Manifold()
    outer = column.radius / np.cos(np.pi / _SIDES)
    wall = Manifold.cylinder(high - low, outer, outer, _SIDES)
    return solid ^ wall.translate((column.x, column.y, low))


def reaching(solids: Sequence[Manifold], column: Column) -> list[Manifold]:
    """Return the solids whose boxes reach into a column's, seen from above."""
    boxes = np.array([solid.bounding_box() for solid in solids]).reshape(-1, 6)
    apart = np.maximum(boxes[:, :2] - (column.x, column.y), (column.x, column.y) - boxes[:, 3:5])
    return [solids[int(i)] for i in np.flatnonzero((apart < column.radius + SLACK).all(axis=1))]


class Congruence:
    """Tells which columns through the same shapes and meshes are alike."""

    def __init__(self, shapes: Sequence[Shape], meshes: Sequence[Manifold] = ()) -> None:
        self.standing = Standing(shapes)
        corners = _corners(*_together(meshes))
        self._corners = corners[np.argsort(corners[:, 0], kind="stable")]
        self._known: dict[Hashable, list[tuple[int, np.ndarray]]] = {}
        self._count = 0

    def number(self, column: Column) -> int:
        """Return a number that is the same for columns that are alike."""
        drawn = self.standing.within(column), *(round(v, 6) for v in (column.radius, column.low, column.high))
        corners, known = self._about(column), self._known.setdefault(drawn, [])
        for index, other in known:
            if corners.shape == other.shape and np.all(np.abs(corners - other) <= SAME):
                return index
        self._count += 1
        known.append((self._count, corners))
        return self._count

    def _about(self, column: Column) -> np.ndarray:
        """Return the meshes' corners in a column as sorted lists of their heights along slanted directions, mm."""
        first, last = np.searchsorted(self._corners[:, 0], (column.x - column.radius, column.x + column.radius))
        near = self._corners[first:last] - (column.x, column.y, 0.0)
        inside = (near[:, 2] > column.low) & (near[:, 2] < column.high)
        near = near[inside & (np.hypot(near[:, 0], near[:, 1]) < column.radius)]
        return np.sort(near @ _DIRECTIONS.T, axis=0)


def _together(meshes: Sequence[Manifold]) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices (n, 3) and faces (m, 3) of several meshes as of one."""
    every = [arrays(mesh) for mesh in meshes]
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in every)])
    faces = [faces + start for (_, faces), start in zip(every, starts, strict=False)]
    vertices = [np.empty((0, 3)), *(vertices for vertices, _ in every)]
    return np.concatenate(vertices), np.concatenate([np.empty((0, 3), np.int64), *faces])


def _corners(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the vertices (n, 3) at which three planes or more meet.

    A boolean leaves others on flat faces and straight edges, which depend on the order of its operands. The normals
    there are all square to one direction.
    """
    across = np.cross(vertices[faces[:, 1]] - vertices[faces[:, 0]], vertices[faces[:, 2]] - vertices[faces[:, 0]])
    normals = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    spread = np.einsum("ni,nj->nij", normals, normals).reshape(-1, 9)
    sums = np.stack([np.bincount(faces.ravel(), np.repeat(part, 3), len(vertices)) for part in spread.T], axis=1)
    return vertices[np.linalg.eigvalsh(sums.reshape(-1, 3, 3))[:, 0] > _FLAT]


def once_each(keys: Sequence[int], make: Callable[[int], _Judged]) -> list[tuple[int, _Judged]]:
    """Return for every number the place of the first equal one and the result of `make` there."""
    first: dict[int, tuple[int, _Judged]] = {}
    for i, key in enumerate(keys):
        if key not in first:
            first[key] = (i, make(i))
    return [first[key] for key in keys]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The solids of pours between which nothing is laid in elsewhere, and their places that are alike.

    `solids` are the tools by name, `more` is drawn besides tools, silicone and seals: spaces of ribs.
    """

    plan: Plan
    steps: tuple[Step, ...]
    solids: Mapping[str, Manifold]
    more: Sequence[Shape]
    segments: int

    @cached_property
    def congruence(self) -> Congruence:
        """All tools in the pours, cast and laid in solids, and seals."""
        last = self.steps[-1]
        tools = [tool for tool in self.plan.tools if any(tool.name in step.tools for step in self.steps)]
        shapes = [tool.shape for tool in tools] + [*last.earlier, *last.layer, *self.more]
        for step in self.steps:
            shapes += [*step.seals, *step.channels, *(body.shape for body in step.inserts)]
        return Congruence(shapes, [self.solids[tool.name] for tool in tools])

    @cached_property
    def cells(self) -> tuple[int, ...]:
        """For every cell a number that is the same for cells in like surroundings.

        A cell's place encloses the silicone cast only in it: nothing of a sheet that joins all cells.
        """
        last, count = self.steps[-1], len(self.plan.layout.cells)
        alone = (*last.earlier, *last.layer) if len(last.layer) == count else last.earlier
        if count == 1 or not alone or len(alone) % count:
            return tuple(range(count))
        numbers = []
        for i in range(count):
            cast = [*alone[i::count]]
            for step in self.steps:
                share = len(step.channels) // count if len(step.layer) == count else 0
                cast += step.channels[i * share : (i + 1) * share]
            column = column_round([realise(shape, self.segments) for shape in cast], MARGIN)
            numbers.append(self.congruence.number(column))
        return tuple(numbers)


def surroundings(
    plan: Plan, solids: Mapping[str, Manifold], more: Sequence[Shape], segments: int
) -> tuple[Surroundings, ...]:
    """Return the surroundings of every pour: one object for pours that leave earlier silicone in place."""
    groups: list[list[Step]] = []
    for step in plan.steps:
        before = groups[-1][-1] if groups else None
        if before and step.earlier == (*before.earlier, *before.layer):
            groups[-1].append(step)
        else:
            groups.append([step])
    made = [Surroundings(plan, tuple(group), solids, more, segments) for group in groups]
    return tuple(each for each in made for _ in each.steps)
