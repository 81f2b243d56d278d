"""The parts of a mesh that a finding's places mark: faces, sides, lines on which faces cross, points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from unitcad.meshcheck.findings import Location
from unitcad.meshcheck.geometry.mesh import Mesh

_EDGES = {"T001", "T002", "T003", "T005", "T006", "T007", "G008", "G009"}
_POINTS = {"T004", "G003"}
_LINES = {"T010", "T011"}  # faces without area
_MOST = 3000  # places of a finding that are drawn
_NONE = np.empty(0, np.int64)


@dataclass(frozen=True)
class Marks:
    """The marks of a finding on one mesh.

    `faces`: those of the first place, the first and the second one of a pair apart; `others`: those of other places.
    `segments` (n, 2, 3) and `points` (n, 3) are drawn over everything; `boxes`: low and high corner of each place, the
    first one first; `point` its middle. `at_point`: that point is what must be seen, as opposed to the faces.
    `across`: the unit vector through a thin wall.
    """

    faces: tuple[np.ndarray, np.ndarray] = (_NONE, _NONE)
    others: np.ndarray = field(default_factory=lambda: _NONE)
    segments: np.ndarray = field(default_factory=lambda: np.empty((0, 2, 3)))
    points: np.ndarray = field(default_factory=lambda: np.empty((0, 3)))
    boxes: tuple[tuple[np.ndarray, np.ndarray], ...] = ()
    point: np.ndarray = field(default_factory=lambda: np.zeros(3))
    at_point: bool = False
    across: np.ndarray | None = None

    def askew(self, eye: np.ndarray) -> float:
        """Return how well a thin wall's thickness shows from a direction, 0 to 1; 1 for other findings."""
        return 1.0 if self.across is None else 1.0 - float(self.across @ eye) ** 4

    def samples(self) -> np.ndarray:
        """Return points (n, 3) of the first place that ought to be seen."""
        if len(self.segments):
            return self.segments[0].mean(axis=0)[None]
        return self.point[None]


def marks_of(code: str, mesh: Mesh, places: Sequence[Location]) -> Marks:
    """Return the marks of a finding's places on the mesh to which they belong."""
    places = places[:_MOST]
    segments, points, boxes = [], [], []
    regions = [np.asarray(place.region if place.region is not None else _NONE, np.int64) for place in places]
    for place, region in zip(places, regions, strict=True):
        corners = mesh.vertices[mesh.faces[region]]
        centre = np.array(place.xyz if place.xyz is not None else corners.reshape(-1, 3).mean(axis=0))
        lines = _lines(code, corners, centre)
        segments += lines
        if code in _POINTS or (not len(region) and not lines):
            points.append(centre)
        spread = np.concatenate(lines) if lines else corners.reshape(-1, 3)
        if not len(spread) or code in _POINTS:
            spread = centre[None]
        boxes.append((spread.min(axis=0), spread.max(axis=0)))
    first = regions[0]
    pair = len(places[0].faces) == 2 and len(first) == 2
    fill = code not in _EDGES
    return Marks(
        ((first[:1] if pair else first) if fill else _NONE, first[1:] if pair and fill else _NONE),
        np.unique(np.concatenate([_NONE, *regions[1:]])) if fill else _NONE,
        np.array(segments).reshape(-1, 2, 3),
        np.array(points).reshape(-1, 3),
        tuple(boxes),
        np.array(places[0].xyz) if places[0].xyz is not None else (boxes[0][0] + boxes[0][1]) / 2,
        pair or not fill or bool(points) or code in _LINES,
        _across(mesh, first) if code == "D001" and len(first) else None,
    )


def _across(mesh: Mesh, region: np.ndarray) -> np.ndarray:
    """Return the normal of a region's largest face."""
    corners = mesh.vertices[mesh.faces[region]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    return normals[int(lengths.argmax())] / max(float(lengths.max()), 1e-300)


def _lines(code: str, corners: np.ndarray, centre: np.ndarray) -> list[np.ndarray]:
    """Return the lines (2, 3) that a place is drawn by.

    The side of a face that has its middle there, the line of two faces that cross, the sides of a face that has no
    area.
    """
    if code in _EDGES and len(corners):
        sides = np.stack([corners[0], np.roll(corners[0], -1, axis=0)], axis=1)
        distance = np.linalg.norm(sides.mean(axis=1) - centre, axis=1)
        return [sides[int(distance.argmin())]]
    if code == "G001" and len(corners) == 2:
        line = common_line(corners[0], corners[1])
        return [] if line is None else [line]
    if code in _LINES and len(corners):
        return list(np.stack([corners[0], np.roll(corners[0], -1, axis=0)], axis=1))
    return []


def common_line(a: np.ndarray, b: np.ndarray) -> np.ndarray | None:
    """Return the line (2, 3) on which two triangles (3, 3) cross, to rounding; None if in one plane or apart."""
    along = np.cross(np.cross(a[1] - a[0], a[2] - a[0]), np.cross(b[1] - b[0], b[2] - b[0]))
    if not along.any():
        return None
    spans = []
    for one, other in ((a, b), (b, a)):
        height = (one - other[0]) @ np.cross(other[1] - other[0], other[2] - other[0])
        ends = [one[k] for k in range(3) if height[k] == 0]
        for k in range(3):
            low, high = height[k - 1], height[k]
            if low * high < 0:
                ends.append(one[k - 1] + (one[k] - one[k - 1]) * (low / (low - high)))
        if len(ends) < 2:
            return None
        spans.append(sorted(ends, key=lambda point: float(point @ along)))
    start = max((span[0] for span in spans), key=lambda point: float(point @ along))
    end = min((span[-1] for span in spans), key=lambda point: float(point @ along))
    return np.stack([start, end]) if float((end - start) @ along) > 0 else None
