"""Where names stand in a picture: in a column left of the drawing or above a part that stands out to the right.

In pixels from the lower left corner. No name covers another one or a part.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt

from unitcad.export import drawing

EDGE_PX, GAP_PX, LEADER_PX = 8.0, 6.0, 30.0
"""From a name to the picture's edge; between two names; from the column of names to the drawing."""
_WELL_INSIDE = 7.0
"""How far inside a part its leader ends where there is room, px."""
_ASIDE = 0.6
"""A part whose visible middle lies beyond this share of the drawing's width is named beside itself."""

_REACH_PX = 48.0
"""How far from what it names a free place is looked for first."""

Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class Label:
    """A name's box (left, right, bottom, top) and the point (x, y) of the part it names; None where that is hidden."""

    box: Box
    end: tuple[float, float] | None

    @property
    def start(self) -> tuple[float, float]:
        """The point of the box at which the leader begins."""
        left, right, bottom, top = self.box
        if self.end is None or self.end[0] > right:
            return right + GAP_PX, (bottom + top) / 2
        return min(max(self.end[0], left), right), (bottom if self.end[1] < bottom else top)


def place(owner: np.ndarray, sizes: Mapping[int, tuple[float, float]]) -> dict[int, Label]:
    """Place the names of parts in a picture.

    `owner` (height, width), row 0 the lowest: the number of the part that a pixel shows, -1 for none. `sizes`: width
    and height of the name of each part that has one. Parts that nothing shows of are named below the others.
    """
    drawn = owner >= 0
    columns = np.flatnonzero(drawn.any(axis=0))
    first, last = (int(columns[0]), int(columns[-1])) if len(columns) else (owner.shape[1] // 2,) * 2
    seen = {part: _seen(owner == part) for part in sizes}
    found: dict[int, Label] = {}
    for part, middle_end in seen.items():
        if middle_end and middle_end[0][0] > first + _ASIDE * (last - first):
            box = _beside(drawn, [label.box for label in found.values()], middle_end[0], sizes[part])
            if box:
                found[part] = Label(box, middle_end[0])
    left = [part for part in sizes if part not in found]
    ends = {part: pair[1] for part in left if (pair := seen[part])}
    wanted = [ends[part][1] if part in ends else 0.0 for part in left]
    heights = [sizes[part][1] for part in left]
    edge = first - LEADER_PX
    ends_px = EDGE_PX, owner.shape[0] - EDGE_PX
    middles = drawing.within(drawing.spread(wanted, heights, GAP_PX), heights, ends_px, GAP_PX)
    for part, y in zip(left, middles, strict=True):
        width, height = sizes[part]
        found[part] = Label((edge - width, edge, y - height / 2, y + height / 2), ends.get(part))
    return found


def _seen(mask: np.ndarray) -> tuple[tuple[float, float], tuple[float, float]] | None:
    """Return points well inside what is seen of a part: near its middle, and near its left end at half its height."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return None

    window = np.pad(mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1], 1)
    inside = np.asarray(distance_transform_edt(window))
    y, x = np.nonzero(inside >= min(_WELL_INSIDE, inside.max()))
    y, x = y + rows[0] - 1, x + columns[0] - 1
    half = (rows[0] + rows[-1]) / 2
    at = int(np.argmin(x + 1.5 * np.abs(y - half)))
    seen_y, seen_x = np.nonzero(mask)
    mid = int(np.argmin(np.hypot(x - seen_x.mean(), y - seen_y.mean())))
    return (float(x[mid]), float(y[mid])), (float(x[at]), float(y[at]))


def _beside(drawn: np.ndarray, taken: list[Box], at: tuple[float, float], size: tuple[float, float]) -> Box | None:
    """Return the free box nearest to `at`, above or below it or further right; None where there is none."""
    height, width = drawn.shape
    nearest, least = None, np.inf
    for right in np.arange(0.0, width - EDGE_PX - size[0] / 2 - at[0], 8.0):
        for up in np.arange(size[1], height, 2.0):
            if np.hypot(right, up) >= least:
                break
            for y in (at[1] + up, at[1] - up):
                box = (at[0] + right - size[0] / 2, at[0] + right + size[0] / 2, y - size[1] / 2, y + size[1] / 2)
                if np.hypot(right, up) < least and _free(drawn, taken, box):
                    nearest, least = box, np.hypot(right, up)
    return nearest


def _free(drawn: np.ndarray, taken: list[Box], box: Box) -> bool:
    """Return whether a box, with a gap round it, is in the picture and covers neither a part nor another name."""
    height, width = drawn.shape
    left, right, bottom, top = box
    if left < EDGE_PX or right > width - EDGE_PX or bottom < EDGE_PX or top > height - EDGE_PX:
        return False
    wide = (left - GAP_PX, right + GAP_PX, bottom - GAP_PX, top + GAP_PX)
    x0, x1, y0, y1 = (max(round(value), 0) for value in wide)
    return not any(overlap(wide, other) for other in taken) and not drawn[y0:y1, x0:x1].any()


def nearest_free(drawn: np.ndarray, at: tuple[float, float], size: tuple[int, int]) -> tuple[int, int]:
    """Return the left column and top row of the box of `size` (width, height) nearest to a point (x, y).

    `drawn` (height, width), row 0 the highest: the pixels that the box, with a gap round it, keeps clear of; where no
    place is clear it covers as few of them as it can.
    """
    edge = round(EDGE_PX)
    height, width = drawn.shape
    left = np.arange(edge, max(width - edge - size[0], edge) + 1, 2)
    top = np.arange(edge, max(height - edge - size[1], edge) + 1, 2)
    across = np.maximum(np.maximum(left - at[0], at[0] - left - size[0]), 0.0)
    down = np.maximum(np.maximum(top - at[1], at[1] - top - size[1]), 0.0)
    farthest = float(np.hypot(across.max(), down.max()))
    reach = _REACH_PX
    while True:  # most names stand near: places within `reach` first
        near, below = across <= reach, down <= reach
        if near.any() and below.any():
            cost = np.hypot(across[near][None, :], down[below][:, None])
            cost += 1e6 * _covered(drawn, left[near], top[below], size)
            row, column = np.unravel_index(int(cost.argmin()), cost.shape)
            if cost[row, column] <= reach or reach >= farthest:
                return int(left[near][column]), int(top[below][row])
        reach *= 4


def _covered(drawn: np.ndarray, left: np.ndarray, top: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    """Return how many pixels drawn a box of `size`, with a gap round it, covers at each top row and left column."""
    gap = round(GAP_PX)
    height, width = drawn.shape
    x0, x1 = left - gap, np.minimum(left + size[0] + gap, width)
    y0, y1 = top - gap, np.minimum(top + size[1] + gap, height)
    part = drawn[y0[0] : y1[-1], x0[0] : x1[-1]]
    x0, x1, y0, y1 = x0 - x0[0], x1 - x0[0], y0 - y0[0], y1 - y0[0]
    along = np.zeros((part.shape[0], part.shape[1] + 1), np.int32)  # enough for every picture's pixels
    np.cumsum(part, axis=1, out=along[:, 1:])
    total = np.zeros((part.shape[0] + 1, len(x0)), np.int32)
    np.cumsum(along[:, x1] - along[:, x0], axis=0, out=total[1:])
    return total[y1] - total[y0]


def overlap(one: Box, other: Box) -> bool:
    """Return whether two boxes share an area."""
    return one[0] < other[1] and other[0] < one[1] and one[2] < other[3] and other[2] < one[3]
