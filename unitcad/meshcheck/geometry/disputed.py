"""The space that fill rules treat differently: its largest thickness and area, and whether a printer could show it.

A printer shows a piece of it that is thicker than `Resolution.thin` and wider than `feature` in both directions across:
laid flat, it fills or spoils a layer. Both are lengths in space, so the attitude of a file does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from manifold3d import CrossSection

from unitcad.geometry.arrays import Floats, Ints, cross, extent
from unitcad.geometry.boxes import Interrupted, Tick
from unitcad.meshcheck.geometry.layers import Layer, Slicer, eroded
from unitcad.meshcheck.geometry.mesh import float32_step
from unitcad.meshcheck.geometry.resolution import EXACT, STEPS, Resolution
from unitcad.meshcheck.geometry.topology import Topology, edges_of

_MOST_LAYERS = 200  # along z, evenly
_MOST_TARGETS = 60  # along each axis, through places to look at
_MOST_PLACES = 8  # whose thickness is measured, along each axis
_MOST_SHELLS = 500  # whose neighbours are looked for one by one
_GRID = 1e-7  # mm; polygons are rounded to a tenth of it


@dataclass(frozen=True, eq=False)
class Disputed:
    """The disputed space of a mesh, as far as it was found.

    `thick` is its thickness, mm, at most; 0 if there is none beyond rounding. `shows`: a printer shows it. `area` is
    the largest disputed area of a layer, mm2, and `layer` that layer; None if none was found. `stopped`: why the search
    ended early, None if it did not; the space counts as one that shows then.
    """

    thick: float = 0.0
    shows: bool = False
    area: float = 0.0
    layer: Layer | None = None
    stopped: Interrupted | None = None


def disputed_of(topology: Topology, crossed: Ints, targets: Floats, tick: Tick) -> Disputed:
    """Look for disputed space in layers along z, and in cuts through the middles of `targets` along all axes.

    `targets` are low and high corners of boxes, (k, 2, 3) mm, `crossed` the shells that cross themselves or others:
    only those and their neighbours are cut.
    """
    slicer = _slicer(topology, crossed, tick)
    if slicer is None:
        return Disputed()
    try:
        return _search(slicer, targets, topology.resolution)
    except Interrupted as stop:
        return Disputed(shows=True, stopped=stop)


def _search(slicer: Slicer, targets: Floats, limits: Resolution) -> Disputed:
    rounding = max(STEPS * float32_step(slicer.vertices), _GRID)
    found = Disputed()
    for axis in (2, 0, 1):
        thick, thin = list[tuple[Layer, CrossSection]](), list[tuple[Layer, CrossSection]]()
        for layer in slicer.layers(axis, _heights(slicer, axis, targets, limits.layer)):
            slicer.tick()
            area = layer.disputed()
            core = eroded(area, limits.thin / 2 * EXACT)
            if core.is_empty() and eroded(area, rounding / 2).is_empty():
                continue
            if area.area() > found.area and (axis == 2 or found.layer is None or found.layer.axis == axis):
                found = replace(found, area=area.area(), layer=layer)
            if core.is_empty():
                thin.append((layer, area))
            else:
                thick += [(layer, piece) for piece in core.decompose()]
        for layer, piece in sorted(thick or thin, key=lambda place: -place[1].area())[:_MOST_PLACES]:
            found = _measured(slicer, layer, piece, found, limits)
            if found.shows:
                return found
    return found


def _slicer(topology: Topology, crossed: Ints, tick: Tick) -> Slicer | None:
    """Return what cuts the shells that cross, and those whose boxes meet theirs; None if there are none."""
    low, high = topology.low, topology.high
    near = np.zeros(topology.n_shells, bool)
    for one in crossed.tolist() if len(crossed) <= _MOST_SHELLS else []:
        near |= ((low <= high[one]) & (high >= low[one])).all(axis=1)
    near |= len(crossed) > _MOST_SHELLS
    faces, edges = topology.mesh.faces, topology.edges
    if not near.any():
        return None
    if not near.all():
        faces = faces[near[topology.shells]]
        edges = edges_of(faces, len(topology.mesh.vertices))
    if topology.volumes[near & topology.closed].sum() < 0:  # all of it is inside out, which is a finding of its own
        faces = np.ascontiguousarray(faces[:, ::-1])
        edges = edges_of(faces, len(topology.mesh.vertices))
    return Slicer(topology.mesh.vertices, faces, edges, tick)


def _heights(slicer: Slicer, axis: int, targets: Floats, step: float) -> Floats:
    """Return the heights of layers along an axis: through the middles of targets, and along z evenly."""
    middle = targets[:, :, axis].mean(axis=1)
    largest = np.argsort(-np.ptp(targets, axis=1).max(axis=1), kind="stable")[: _MOST_TARGETS // 2]
    evenly = np.linspace(0, len(middle) - 1, _MOST_TARGETS // 2).astype(int) if len(middle) else largest
    heights = [middle[largest], np.sort(middle)[evenly]]
    if axis == 2:
        low, high = (float(corner[2]) for corner in extent(slicer.vertices[slicer.faces.reshape(-1)]))
        n = int(np.clip((high - low) / step, 1, _MOST_LAYERS))
        heights.append(low + (np.arange(n) + 0.5) * (high - low) / n)
    return np.unique(np.concatenate(heights))


def _measured(slicer: Slicer, layer: Layer, piece: CrossSection, found: Disputed, limits: Resolution) -> Disputed:
    """Return what was found, with the thickness of the space at the deepest point of a piece of a layer."""
    centre = layer.in_space(deepest(piece)[1][None])[0]
    radius = _distance(slicer, centre)
    found = replace(found, thick=max(found.thick, 2 * radius))
    if 2 * radius < limits.thin * EXACT:
        return found
    wide = 2 * radius if 2 * radius >= limits.feature else _width(slicer, centre, radius / 4)
    return replace(found, shows=wide >= limits.feature * EXACT)


def deepest(area: CrossSection) -> tuple[float, Floats]:
    """Return the radius, mm, and the middle (2,) of about the largest circle in an area, to 2 % or rounding."""
    if area.is_empty():
        return 0.0, np.zeros(2)
    least, most, core = 0.0, float(np.sqrt(area.area())), area  # no circle inside is as large
    while most - least > max(0.02 * most, _GRID):  # of a needle, no offset leaves anything
        smaller = eroded(area, (least + most) / 2)
        if smaller.is_empty():
            most = (least + most) / 2
        else:
            least, core = (least + most) / 2, smaller
    return (least + most) / 2, core.to_polygons()[0][0]


def _width(slicer: Slicer, centre: Floats, margin: float) -> float:
    """Return how wide the disputed space round a point is, mm: its second largest extent.

    Pieces of it are told apart that join by less than twice the `margin`.
    """
    outline = list[Floats]()
    for axis in range(3):
        for layer in slicer.layers(axis, centre[axis : axis + 1]):
            spot = CrossSection.circle(margin, 8).translate(np.roll(centre, -axis)[1:].tolist())
            for piece in layer.disputed().offset(-margin).decompose():
                if not (piece ^ spot).is_empty():
                    outline += [layer.in_space(loop) - centre for loop in piece.to_polygons()]
    if not outline:
        return 0.0
    points = np.concatenate(outline)
    for _ in range(2):
        along = points[np.argmax(np.einsum("ij,ij->i", points, points))]
        along = along / max(float(np.linalg.norm(along)), 1e-300)
        reach = points @ along
        points = points - reach[:, None] * along
    return float(np.ptp(reach)) + 2 * margin


def _distance(slicer: Slicer, point: Floats) -> float:
    """Return the distance of a point from the surface, mm."""
    corners = _near(slicer, point)
    normal = cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    off = point - corners
    height = np.abs(np.einsum("ij,ij->i", off[:, 0], normal))
    within, least = np.ones(len(corners), bool), np.inf
    for k in range(3):
        side = corners[:, (k + 1) % 3] - corners[:, k]
        within &= np.einsum("ij,ij->i", cross(side, off[:, k]), normal) >= 0
        share = np.clip(
            np.einsum("ij,ij->i", off[:, k], side) / np.maximum(np.einsum("ij,ij->i", side, side), 1e-300), 0, 1
        )
        least = min(least, float(np.linalg.norm(off[:, k] - share[:, None] * side, axis=1).min()))
    return min(least, float(height[within].min(initial=np.inf)))


def _near(slicer: Slicer, point: Floats) -> Floats:
    """Return the corners (k, 3, 3) of the faces that may be the nearest to a point."""
    columns = [slicer.vertices[:, axis].take(slicer.faces) - point[axis] for axis in range(3)]
    beside = np.zeros(len(slicer.faces))
    for column in columns:
        beside += np.maximum(np.maximum(column.min(axis=1), -column.max(axis=1)), 0) ** 2
    reach = float(np.add.reduce([column**2 for column in columns]).min())  # of the nearest corner
    return slicer.vertices[slicer.faces[beside <= reach]]
