"""Faces round a vertex that very many share, such as the tip of a cone: their boxes all meet, the faces do not.

If the star of such a vertex is a height field, its faces meet in that vertex and their common edges alone, and are not
compared with each other. With all other faces they are compared in pieces, since they are long and lie askew.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from unitcad.geometry.arrays import Bools, Ints
from unitcad.geometry.boxes import box_order, frame_of, meeting_between, meeting_parts
from unitcad.geometry.ticks import Tick
from unitcad.meshcheck.geometry.arranged import Arranged

LEAST = 2000
"""Faces that a hub has at least."""
_HUBS = 16  # hubs, those with the most faces: each is compared with all that is left
_PIECES = 32  # of a face, from the hub outwards
_MOST_PIECES = 4_000_000
Walk = Iterator[tuple[Ints, Ints]]


def hub_walks(ready: Arranged, smooth: Bools, parts: int, tick: Tick) -> list[Walk]:
    """Return iterators over the pairs of faces to compare, some pairs twice; none if there is no hub.

    `smooth` says which vertices have a star that is a height field.
    """
    valence = np.bincount(ready.corners.reshape(-1), minlength=len(smooth)) * smooth
    hubs = np.flatnonzero(valence >= LEAST)
    if not len(hubs):
        return []
    hubs = np.sort(hubs[np.argsort(-valence[hubs], kind="stable")][:_HUBS])
    weight = np.zeros_like(valence)
    weight[hubs] = valence[hubs]
    weights = weight[ready.corners]
    corner = np.argmax(weights, axis=0)
    own = np.where(weights.max(axis=0) > 0, np.take_along_axis(ready.corners, corner[None], axis=0)[0], -1)
    rest, boxes = np.flatnonzero(own < 0), ready.steps[own < 0]
    walks = [_renamed(walk, rest, rest) for walk in meeting_parts(boxes, parts, tick)] if len(rest) > 1 else []
    for hub in hubs:
        mine = np.flatnonzero(own == hub)
        if not len(mine):
            continue
        faces, pieces = _pieces(ready, mine, corner[mine])
        if len(rest):
            walks.append(_renamed(meeting_between(pieces, boxes, tick), faces, rest))
        rest, boxes = np.concatenate([rest, faces]), np.concatenate([boxes, pieces])
    return walks


def _renamed(walk: Walk, here: Ints, there: Ints) -> Walk:
    """Yield the pairs of a walk as faces, each pair once a block."""
    for i, j in walk:
        key = np.unique(here[i].astype(np.uint64) << np.uint64(32) | there[j].astype(np.uint64))
        yield (key >> np.uint64(32)).astype(np.intp), (key & np.uint64(0xFFFFFFFF)).astype(np.intp)


def _pieces(ready: Arranged, faces: Ints, corner: Ints) -> tuple[Ints, Ints]:
    """Return the boxes of pieces of some faces from their hubs outwards, in steps, and the face of each.

    A box is a step wider than its piece on all sides, more than rounding takes.
    """
    frame, n = frame_of(ready.columns.T), max(min(_PIECES, _MOST_PIECES // len(faces)), 1)
    part = np.linspace(0, 1, n + 1)[:, None, None]
    ids = ready.corners[:, faces]
    hub, one, other = (ready.columns[:, np.take_along_axis(ids, (corner[None] + k) % 3, axis=0)[0]].T for k in range(3))
    ends = []
    for far in (one, other):
        points = (hub + part * (far - hub)).reshape(-1, 3)
        ends.append(np.stack(frame.steps(points), axis=1).reshape(n + 1, len(faces), 3).astype(np.int32))
    low = np.minimum(np.minimum(ends[0][:-1], ends[0][1:]), np.minimum(ends[1][:-1], ends[1][1:])) - 1
    high = np.maximum(np.maximum(ends[0][:-1], ends[0][1:]), np.maximum(ends[1][:-1], ends[1][1:])) + 1
    boxes = np.concatenate([low, 65_535 - high], axis=2).reshape(-1, 6).astype(np.uint16)
    order = box_order(boxes, frame)
    return np.tile(faces, n)[order], boxes[order]
