"""Overhangs, D003: faces that lean out too far, by region; a region that is bridged everywhere is ignored.

A region's border is supported if the face beyond it goes down. A point of the region is bridged if a line through it
meets supported borders on both sides within the printer's bridge; a free ledge may be as wide as one extrusion.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.geometry.components import components
from unitcad.meshcheck.findings import Finding, Location, number
from unitcad.meshcheck.geometry.topology import Topology
from unitcad.meshcheck.rules.inspection import Inspection, Printer, at_region
from unitcad.meshcheck.rules.registry import Rule

D003 = Rule("""
    D003 info: overhang
    Faces lean out further than the printer can hold without support, and no bridge of its span reaches across. An error
    if the printer prints without support (support = "none" in its table).
    Example: A level arm reaches 10 mm out of a wall.
    Fix: Turn the part, chamfer the overhang, or print with support.
""")

_ANGLES = 16
_POINTS = 300  # sample points a region
_LEAST = 1.0  # mm2: smaller regions droop by less than shows
_SLACK = 1.0  # degree beyond the printer's angle, for tessellated cones of just that angle
_BORDER = 4000  # border edges a region may have; more is taken as not bridged


def check_print(part: Inspection, printer: Printer) -> Iterator[Finding]:
    """Apply D003 to a mesh that has an inside, which stands on its lowest point."""
    if not part.solid:
        return
    topology = part.topology
    mesh, areas = topology.mesh, topology.areas
    bed = float(mesh.vertices[mesh.faces, 2].min())
    double = np.sqrt(np.einsum("ij,ij->i", areas, areas))
    steep = -np.sin(np.radians(min(float(printer.overhang_deg) + _SLACK, 89.0)))
    leaning = areas[:, 2] < steep * double
    leaning &= mesh.vertices[mesh.faces, 2].max(axis=1) > bed + float(printer.layer_mm) / 2
    if not leaning.any():
        return
    one, other = topology.edges.pairs
    left, right = one // 3, other // 3
    inner = leaning[left] & leaning[right]
    region = components(len(leaning), left[inner], right[inner])
    rim = leaning[left] != leaning[right]
    beyond = np.where(leaning[left[rim]], other[rim], one[rim])
    owner = region[np.where(leaning[left[rim]], left[rim], right[rim])]
    segments, supported = _border(topology, beyond, bed + float(printer.layer_mm) / 2)
    bad: list[tuple[float, Location]] = []
    for label in np.unique(region[leaning]):
        faces = np.flatnonzero(leaning & (region == label))
        area = float(double[faces].sum()) / 2
        part.tick()
        if area < _LEAST:
            continue
        own = owner == label
        if _is_bridge(topology, faces, segments[own], supported[own], printer):
            continue
        centre = mesh.vertices[mesh.faces[faces[0]]].mean(axis=0)
        bad.append((area, at_region(topology.kept[faces], centre)))
    if not bad:
        return
    bad.sort(key=lambda item: -item[0])
    area = number(sum(area for area, _ in bad), 3)
    text = f"{area} mm2 lean out beyond {number(printer.overhang_deg)} degrees unsupported"
    severity = "error" if printer.support is not None and printer.support.value == "none" else None
    yield D003.finding(text, len(bad), [place for _, place in bad], severity)


def _border(topology: Topology, beyond: Ints, bed: float) -> tuple[Floats, Floats]:
    """Return border edges in plan (n, 2, 2), and whether each is held.

    It is if it touches the bed, or if the face beyond goes down.
    """
    faces, vertices = topology.mesh.faces, topology.mesh.vertices
    face, side = beyond // 3, beyond % 3
    a, b = vertices[faces[face, side]], vertices[faces[face, (side + 1) % 3]]
    apex = vertices[faces[face, (side + 2) % 3]]
    supported = apex[:, 2] < np.minimum(a[:, 2], b[:, 2]) - 1e-6
    supported |= np.maximum(a[:, 2], b[:, 2]) <= bed
    return np.stack([a[:, :2], b[:, :2]], axis=1), supported


def _is_bridge(topology: Topology, faces: Ints, segments: Floats, supported: Floats, printer: Printer) -> bool:
    if not len(segments) or len(segments) > _BORDER or not supported.any():
        return False
    corners = topology.mesh.vertices[topology.mesh.faces[faces]][:, :, :2]
    weights = np.array([[1, 1, 1], [4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 0.2], [2, 0.2, 2], [0.2, 2, 2]], float)
    weights /= weights.sum(axis=1, keepdims=True)
    points = np.einsum("wk,fkx->fwx", weights, corners).reshape(-1, 2)
    points = points[:: max(1, len(points) // _POINTS)]
    span, ledge = float(printer.bridge_mm), float(printer.least_feature_mm)
    held = _distance(points, segments[supported]) <= ledge * 1.001
    points = points[~held]
    for angle in np.pi * np.arange(_ANGLES) / _ANGLES:
        if not len(points):
            break
        along = np.array([np.cos(angle), np.sin(angle)])
        ahead, ahead_held = _first(points, along, segments, supported)
        back, back_held = _first(points, -along, segments, supported)
        points = points[~(ahead_held & back_held & (ahead + back <= span * 1.001))]
    return not len(points)


def _first(points: Floats, along: Floats, segments: Floats, supported: Floats) -> tuple[Floats, Floats]:
    """Return the distance to the first border edge from each point along a direction, and whether it is supported."""
    a, d = segments[:, 0], segments[:, 1] - segments[:, 0]
    across = d[:, 0] * along[1] - d[:, 1] * along[0]
    parallel = np.abs(across) < 1e-12
    across = np.where(parallel, 1.0, across)
    off = points[:, None, :] - a[None]
    t = -(off[..., 0] * d[:, 1] - off[..., 1] * d[:, 0]) / -across
    s = (off[..., 0] * along[1] - off[..., 1] * along[0]) / across
    hit = (s >= -1e-9) & (s <= 1 + 1e-9) & (t > 1e-9) & ~parallel
    t = np.where(hit, t, np.inf)
    nearest = t.argmin(axis=1)
    distance = t[np.arange(len(points)), nearest]
    return distance, supported[nearest] & np.isfinite(distance)


def _distance(points: Floats, segments: Floats) -> Floats:
    """Return distance in plan from each point to the nearest segment."""
    a, d = segments[:, 0], segments[:, 1] - segments[:, 0]
    off = points[:, None, :] - a[None]
    s = np.clip((off * d).sum(axis=2) / np.maximum((d * d).sum(axis=1), 1e-300), 0, 1)
    return np.sqrt(((off - s[..., None] * d) ** 2).sum(axis=2)).min(axis=1, initial=np.inf)
