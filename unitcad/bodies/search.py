r"""The search for a parting: which way up a body is cast, and where its mould comes apart.

    level, open above      level, closed         upright, two pieces     upright, four pieces

      |  .------.  |        .--| |--.              |      |                \      /
      |  | top  |  |        |  cup  |              |  <-  |  ->             \  ^  /
    ==|==|      |==|==     =|=======|=           --|------|--              <   X   >
      '--'      '--'        |  base |                base                    /  v  \

A point of the mould is free if its piece moves away without passing through the body. The search counts the points that
are not, on a grid (`voxels`), for every pose and every place of the parting, and returns the ways in the order in which
they are worth drawing: few points that are not free, then few pieces, then a top that can be struck off.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from unitcad.bodies.voxels import Voxels, voxels
from unitcad.moulds.complement import LEAST_AREA
from unitcad.shape.tree import Turn

POSES: tuple[tuple[str, Turn], ...] = (
    ("as drawn", ((1, 0, 0), (0, 1, 0), (0, 0, 1))),
    ("upside down", ((1, 0, 0), (0, -1, 0), (0, 0, -1))),
    ("+x up", ((0, 1, 0), (0, 0, 1), (1, 0, 0))),
    ("-x up", ((0, -1, 0), (0, 0, 1), (-1, 0, 0))),
    ("+y up", ((0, 0, 1), (1, 0, 0), (0, 1, 0))),
    ("-y up", ((0, 0, 1), (-1, 0, 0), (0, -1, 0))),
)
"""The six poses: their names, and the turn of each."""
NEGLIGIBLE = 2e-3
"""Share of the body's cubes up to which a way counts as free on the grid: what is really caught, the checks measure."""
OPEN_SHARE = 0.25
"""Share of the largest level section from which an open top comes before a gate."""
ANGLES = 12
"""Upright partings that are tried, over half a turn."""
COSTS = {"tray": 0.0, "level": 1.0, "two": 2.0, "four": 4.0}
"""Of the pieces of a way, to be compared with a gate, which leaves a mark that has to be trimmed."""
GATE_COST, SMALL_TOP_COST = 1.5, 0.25


@dataclass(frozen=True)
class Way:
    """One way to part a mould.

    pose     the name of the pose, and `turn`: the turn of the body into it
    kind     "tray" (no parting), "level" (a lower and an upper half), "two" or "four" (side pieces on a base)
    at       in the turned body's frame, mm, a range of places: of z if level, of x for two side pieces; for four x and y
             of the planes' line; upright in a frame that is turned back by `angle` (degrees) about z
    open     whether the top is open and struck off; otherwise it is filled through a gate
    caught   the volume of the body that stands in the way of a piece, on the grid, mm3
    """

    pose: str
    turn: Turn
    kind: str
    at: tuple[float, ...]
    angle: float
    open: bool
    caught: float

    @property
    def said(self) -> str:
        """The way in words."""
        top = "open above" if self.open else "filled through a gate"
        how = {
            "tray": "one tray",
            "level": f"two halves, parted level, {top}",
            "two": f"two side pieces, {top}",
            "four": f"four side pieces, {top}",
        }[self.kind]
        return f"{self.pose}: {how}"


def ways(vertices: np.ndarray, faces: np.ndarray) -> Iterator[Way]:
    """Yield the ways to part a mould round a closed mesh, the best first; later ones are looked for when asked for."""
    grids = [(name, turn, voxels(vertices @ np.array(turn, float).T, faces)) for name, turn in POSES]
    caught: list[Way] = []
    for kinds in (("tray", "level"), ("two", "four")):
        found: list[tuple[float, int, Way]] = []
        for rank, (name, turn, grid) in enumerate(grids):
            posed, total = vertices @ np.array(turn, float).T, int(grid.filled.sum())
            area = _top_area(grid)
            wide = area >= OPEN_SHARE * grid.filled.sum(axis=(0, 1)).max() * grid.side**2
            for kind, at, angle, count in (_level if "level" in kinds else _upright)(posed, faces, grid):
                # A closed mould first if little of the body would be open: less of it is struck off by hand.
                tops = (True, False) if wide else (False, True) if area >= LEAST_AREA else (False,)
                for opened in tops if kind != "tray" else (True,) * (True in tops):
                    way = Way(name, turn, kind, at, angle, opened, count * grid.side**3)
                    if count > NEGLIGIBLE * total:
                        caught.append(way)
                    else:
                        cost = 0.0 if opened and wide else GATE_COST + SMALL_TOP_COST * opened
                        found.append((COSTS[kind] + cost, rank, way))
        yield from (way for _, _, way in sorted(found, key=lambda each: each[:2]))
    yield from sorted(caught, key=lambda way: way.caught)


def ways_at(axis: int, place: float) -> Iterator[Way]:
    """Yield the ways whose mould comes apart at a plane across an axis of the body as drawn: halves, then side pieces."""
    for opened in (True, False):
        for name, turn in POSES:
            if side := turn[2][axis]:
                yield Way(name, turn, "level", (side * place,) * 2, 0.0, opened, 0.0)
        if axis < 2:
            name, turn = POSES[0]
            yield Way(name, turn, "two", (place, place), 90.0 * axis, opened, 0.0)


def _upright(
    vertices: np.ndarray, faces: np.ndarray, grid: Voxels
) -> Iterator[tuple[str, tuple[float, ...], float, int]]:
    """Yield kind, place, angle and cubes caught of the best two and the best four side pieces."""
    best: dict[str, tuple[int, tuple[float, ...], float]] = {}
    for step in range(ANGLES):
        angle = 180.0 * step / ANGLES
        side = voxels(vertices @ about_z(-angle).T, faces) if step else grid
        for kind, (caught, at) in (("two", _two(side)), ("four", _four(side)))[: 2 if 2 * step < ANGLES else 1]:
            if kind not in best or caught < best[kind][0]:
                best[kind] = caught, at, angle
        if all(count == 0 for count, _, _ in best.values()):
            break
    for kind, (caught, at, angle) in best.items():
        yield kind, at, angle, caught


def _level(
    vertices: np.ndarray, faces: np.ndarray, grid: Voxels
) -> Iterator[tuple[str, tuple[float, ...], float, int]]:
    """Yield the best level parting, and the tray: the parting at the top.

    Above it nothing outside may have the body over it, below it nothing may have the body under it. A hole or a pocket
    belongs to the half that it is open to.
    """
    filled = np.nonzero(grid.filled.any(axis=(0, 1)))[0]
    first, last = int(filled.min()), int(filled.max()) + 1
    over, under = grid.blocked(2, 1)[:, :, first:last], grid.blocked(2, -1)[:, :, first:last]
    outer, inner = grid.outer[:, :, first:last], grid.inner[:, :, first:last]
    above = np.concatenate([np.cumsum((outer & over).sum(axis=(0, 1))[::-1])[::-1], [0]])
    below = np.concatenate([[0], np.cumsum((outer & under).sum(axis=(0, 1)))])
    caught = above + below + int((inner & over & under).sum())
    heights, high = grid.heights(2)[first : last + 1], float(vertices[:, 2].max())
    yield "tray", (high,), 0.0, int(caught[-1] + (inner & under & ~over).sum())
    free = heights[caught <= caught.min()]
    # Levels at which the body has corners, and those between: the exact sections choose among them.
    yield "level", (float(free.min() - grid.side), float(free.max() + grid.side)), 0.0, int(caught.min())


def _two(grid: Voxels) -> tuple[int, tuple[float, ...]]:
    """Return cubes caught and the range in x of the best upright plane across x: its pieces leave along +x and -x."""
    right = (grid.outer & grid.blocked(0, 1)).sum(axis=(1, 2))
    left = (grid.outer & grid.blocked(0, -1)).sum(axis=(1, 2))
    after = np.concatenate([np.cumsum(right[::-1])[::-1], [0]])
    before = np.concatenate([[0], np.cumsum(left)])
    caught = after + before + _pockets(grid)
    least = caught.min()
    places = np.nonzero(caught == least)[0]
    borders = grid.heights(0)[places]
    return int(least), (float(borders.min() - grid.side), float(borders.max() + grid.side))


def _four(grid: Voxels) -> tuple[int, tuple[float, ...]]:
    """Return cubes caught, x and y of the best cross of diagonal planes: four pieces along +x, +y, -x, -y."""
    free = [(grid.outer & grid.blocked(axis, way)).sum(axis=2) for axis, way in ((0, 1), (0, -1), (1, 1), (1, -1))]
    nx, ny = grid.filled.shape[:2]
    x, y = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
    best = (math.inf, (0.0, 0.0))
    steps = range(-2, 3)
    for i, j in itertools.product(steps, steps):
        cx, cy = nx / 2 + i * nx / 16, ny / 2 + j * ny / 16
        dx, dy = x + 0.5 - cx, y + 0.5 - cy
        wide = np.abs(dx) >= np.abs(dy)
        regions = (wide & (dx > 0), wide & (dx <= 0), ~wide & (dy > 0), ~wide & (dy <= 0))
        caught = sum(int(count[region].sum()) for count, region in zip(free, regions, strict=True))
        place = float(grid.low[0] + cx * grid.side), float(grid.low[1] + cy * grid.side)
        best = min(best, (caught, place), key=lambda each: (each[0], math.hypot(*each[1])))
    return int(best[0]) + _pockets(grid), best[1]


def _pockets(grid: Voxels) -> int:
    """Return the cubes of holes and pockets that neither the base nor a top reaches."""
    return int((grid.inner & grid.blocked(2, 1) & grid.blocked(2, -1)).sum())


def _top_area(grid: Voxels) -> float:
    """Return the area of the highest level of a body, mm2: it can be poured through and struck off."""
    areas = grid.filled.sum(axis=(0, 1))
    return float(areas[int(np.nonzero(areas)[0].max())]) * grid.side**2


def about_z(degrees: float) -> np.ndarray:
    quarters, rest = divmod(degrees, 90.0)
    c, s = (math.cos(math.radians(rest)), math.sin(math.radians(rest))) if rest else (1.0, 0.0)
    for _ in range(int(quarters) % 4):
        c, s = -s, c
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
