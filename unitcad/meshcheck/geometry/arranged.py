"""Faces of a mesh along a space-filling curve, and what the crossing test needs of each one alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Floats, Ints, columns_of
from unitcad.geometry.boxes import Slabs, box_order, boxes_of, frame_of, ranks_of, slabs_of
from unitcad.meshcheck.geometry.contact import MOST_RANK, FaceBoxes, ranked_boxes
from unitcad.meshcheck.geometry.topology import Surface


@dataclass(frozen=True, eq=False)
class Arranged:
    """Faces that have an area, in the order `order`: `columns` (3, n) of their vertices, `corners` (3, m) into them.

    `normal` (3, m) is twice their area vectors, `steps` (m, 6) their boxes in the tree's steps; `ranked` are these
    boxes where vertices have few coordinates.
    """

    order: Ints
    columns: Floats
    corners: Ints
    normal: Floats
    steps: Ints
    slabs: Slabs
    ranked: FaceBoxes | None


def arranged(surface: Surface) -> Arranged:
    """Arrange the faces of a surface, each where the file has it."""
    vertices, faces, areas = surface.mesh.vertices, surface.stored, surface.stored_areas
    frame = frame_of(vertices)
    steps = frame.steps(vertices)
    boxes = boxes_of(steps, *faces.T)
    order = box_order(boxes, frame)
    normal = columns_of(areas, order)
    solid = (normal != 0).any(axis=0)
    if not solid.all():
        order, normal = order[solid], normal.compress(solid, axis=1)  # keeps each axis in one piece
    columns, corners = np.ascontiguousarray(vertices.T), columns_of(faces, order)
    ranks = ranks_of(steps, vertices, MOST_RANK)
    return Arranged(
        order,
        columns,
        corners,
        normal,
        boxes.take(order, axis=0),
        slabs_of(steps, *corners),
        None if ranks is None else ranked_boxes(ranks, corners),
    )
