"""Shape to mesh with manifold3d. Meshes are closed by construction; lengths in mm, double precision."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import product
from typing import Any

import manifold3d
import numpy as np
from manifold3d import CrossSection, FillRule, JoinType, Manifold

from unitcad.errors import UnitcadError
from unitcad.geometry.arrays import open_edges
from unitcad.geometry.components import components
from unitcad.geometry.segments import between_outlines
from unitcad.shape import Below, Common, Component, Cut, Extrude, Place, Polyhedron, Revolve, Shape, Union
from unitcad.shape.profile import FACETS, Profile, points
from unitcad.shape.tree import by_quarters, corners_and_faces

FINEST, COARSEST = 4096, 24


def segment_count(radius: float, tolerance: float) -> int:
    """Return the sides of an area-true polygon within `tolerance` of a circle of `radius` (both mm).

    Its corners are r (a - 1) outside, a = sqrt(x / sin x) with x = 2 pi / n; the middles of its sides half as far
    inside. A multiple of 8, so that the axes and diagonals are vertices.
    """
    n = COARSEST
    while n < FINEST and radius * (area_true(n) - 1) > tolerance:
        n += 8
    return n


def area_true(segments: int) -> float:
    """Return the factor on a regular polygon's circumradius that gives it the circle's area."""
    step = 2 * math.pi / segments
    return math.sqrt(step / math.sin(step))


def realise(shape: Shape, segments: int, swell: float | None = None) -> Manifold:
    """Return the solid of `shape`, every full turn in `segments` sides.

    swell: factor on the radii of revolved profiles. By default they are area-true, so mating ones mate; 1 puts a
    polygon's corners on the circle.
    """
    return _realise(shape, segments, area_true(segments) if swell is None else swell)


def _realise(shape: Shape, segments: int, swell: float) -> Manifold:
    if not isinstance(shape, Place):
        return _made(shape, segments, swell)
    # Not kept: the hundreds of places of a gang's parts would drive out the plates and the parts themselves.
    solid = _realise(shape.shape, segments, swell)
    if not by_quarters(shape.turn):
        # Evaluated first, in its own frame: equal points there stay equal to the last bit when they are turned.
        solid.num_tri()
    return solid.transform(np.column_stack([shape.turn, shape.move]))


@lru_cache(maxsize=512)
def _made(shape: Shape, segments: int, swell: float) -> Manifold:
    match shape:
        case Revolve(profile):
            # Scaled after revolving: CrossSection would round the scaled radii to its grid.
            return Manifold.revolve(CrossSection([points(profile, segments)]), segments).scale((swell, swell, 1.0))
        case Extrude(profile, z0, z1, holes, None):
            loops = [points(profile, segments), *(points(hole, segments)[::-1] for hole in holes)]
            return Manifold.extrude(CrossSection(loops), z1 - z0).translate((0, 0, z0))
        case Extrude(profile, z0, z1, _, Profile() as top):
            return _taper(points(profile, segments), points(top, segments), z0, z1)
        case Polyhedron():
            corners, faces = corners_and_faces(shape)
            return Manifold(manifold3d.Mesh64(corners, faces.astype(np.uint64)))
        case Union(parts):
            return Manifold.batch_boolean([_realise(part, segments, swell) for part in parts], manifold3d.OpType.Add)
        case Cut(body, tools):
            bodies = [_realise(body, segments, swell), *(_realise(tool, segments, swell) for tool in tools)]
            return Manifold.batch_boolean(bodies, manifold3d.OpType.Subtract)
        case Common(parts):
            return Manifold.batch_boolean(
                [_realise(part, segments, swell) for part in parts], manifold3d.OpType.Intersect
            )
        case Component(inner, at):
            return component(_realise(inner, segments, swell), at)
        case Below(inner, bottom):
            return _below(_realise(inner, segments, swell), bottom)
    raise TypeError(f"not a shape: {shape!r}")


def forget() -> None:
    """Drop every mesh that is kept for the next call, before a measurement of times."""
    _made.cache_clear()


def arrays(solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Return (vertices (n, 3) in mm, double; faces (m, 3))."""
    mesh = solid.to_mesh64()
    return np.asarray(mesh.vert_properties[:, :3]), np.asarray(mesh.tri_verts, dtype=np.int64)


def shells(solid: Manifold) -> list[Manifold]:
    """Return the connected surfaces of a solid, each as a solid.

    `Manifold.decompose` copies all vertices for each piece: with hundreds of pieces that takes longer than a boolean.
    """
    vertices, faces = arrays(solid)
    n = len(vertices)
    label = components(n, faces[:, :2].ravel(), faces[:, 1:].ravel())
    count = int(label.max(initial=-1)) + 1
    if count < _FEW:
        return solid.decompose()
    order, face_label = np.argsort(label, kind="stable"), label[faces[:, 0]]
    place = np.empty(n, np.int64)
    first = np.concatenate([[0], np.cumsum(np.bincount(label, minlength=count))])
    place[order] = np.arange(n) - first[label[order]]
    faces = faces[np.argsort(face_label, kind="stable")]
    ends = np.concatenate([[0], np.cumsum(np.bincount(face_label, minlength=count))])
    found = []
    for i in range(count):
        corners, sides = vertices[order[first[i] : first[i + 1]]], place[faces[ends[i] : ends[i + 1]]]
        found.append(Manifold(manifold3d.Mesh64(corners, sides.astype(np.uint64))))
    return found


def thick_pieces(solid: Manifold, least: float = FACETS) -> list[Manifold]:
    """Return the connected pieces of a solid that are thicker than films of facets or rounding."""
    return [piece for piece in shells(solid) if _is_thick(piece, least)]


def _is_thick(piece: Manifold, least: float) -> bool:
    """Tell whether a piece is thicker than `least` somewhere, mm.

    A film's thickness is twice its volume over its area. A piece with such films may be thicker than that: then a rest
    remains between two copies of the piece, moved apart by `least`, in every direction.
    """
    volume = float(piece.volume())
    if volume <= least**3 or 2 * volume > least * float(piece.surface_area()):
        return volume > least**3
    return _has_rest(piece, np.reshape(bounds(piece), (2, 3)), least)


def _has_rest(solid: Manifold, window: np.ndarray, least: float) -> bool:
    """Tell whether a rest remains in a window, its corners (2, 3) mm, between copies moved apart by `least` in all ways.

    A window with many faces is halved: intersections of many nearly parallel films have millions of faces.
    """
    left = solid ^ _box(window)
    if left.is_empty():
        return False
    window = np.reshape(bounds(left), (2, 3))
    solid ^= _box(window + np.array([[-least], [least]]))
    size = np.ptp(window, axis=0)
    longest = int(np.argmax(size))
    if solid.num_tri() > _MANY and size[longest] > 4 * least:
        halves = np.stack([window, window])
        halves[0, 1, longest] = halves[1, 0, longest] = window[:, longest].mean()
        return any(_has_rest(solid, half, least) for half in halves)
    for way in _WAYS:
        x, y, z = (least / 2 * way).tolist()
        left = left ^ solid.translate((x, y, z)) ^ solid.translate((-x, -y, -z))
        if left.is_empty():
            return False
    return True


def _box(corners: np.ndarray) -> Manifold:
    """Return the box between two corners (2, 3), mm."""
    return Manifold.cube((corners[1] - corners[0]).tolist()).translate(corners[0].tolist())


def as_trimesh(solid: Manifold) -> Any:
    """Return the mesh as a trimesh.Trimesh, vertices and faces unchanged: nothing is merged."""
    import trimesh

    vertices, faces = arrays(solid)
    return trimesh.Trimesh(vertices, faces, process=False)


def bounds(solid: Manifold) -> tuple[float, ...]:
    """Return (x0, y0, z0, x1, y1, z1) in mm."""
    return tuple(solid.bounding_box())


_WAYS = np.array([way for way in product((-1, 0, 1), repeat=3) if way > (0, 0, 0)], dtype=float)
_WAYS /= np.linalg.norm(_WAYS, axis=1)[:, None]
"""Directions from a cube's middle to its faces, edges and corners, one of each two that are opposite."""
_MANY = 30
"""Faces above which a window of a film is halved."""
_FEW = 20
"""Shells up to which `decompose` is the quicker way."""
_PROBE = 1e-4
"""Edge of the cube that finds the piece at a point, mm."""
_SAME_LINE = 1e-9
"""Distance in plan up to which two vertices count as on one vertical line, mm."""

_CRACK = 0.01
"""Area up to which a crack between two prisms is left, mm2."""
_OVER = 1e-8
"""Share of a patch's area in plan that may lie over itself: rounding of the section's grid."""
_STEEP = 0.1
"""Slope against the vertical of faces that are a patch of their own in one that lies over itself: leaning walls."""
_UPRIGHT = 1e-6
"""Slope against the vertical up to which a face counts as upright, since rounding tilts it."""


def component(solid: Manifold, at: tuple[float, float, float]) -> Manifold:
    """Return the connected piece of `solid` around the point `at` (mm). Raises UnitcadError if none does."""
    probe = Manifold.cube((_PROBE, _PROBE, _PROBE), True).translate(at)
    pieces = [(float((piece ^ probe).volume()), i, piece) for i, piece in enumerate(solid.decompose())]
    shared, _, held = max(pieces, default=(0.0, 0, Manifold()))
    if shared <= 0:
        raise UnitcadError(f"manifold3d: no solid is at the point {at}")
    return held


def _below(solid: Manifold, bottom: float) -> Manifold:
    """Return the volume under the upward faces of `solid`, down to `bottom`: a prism a patch of faces that join."""
    vertices, faces = arrays(solid)
    vertices = _plumb(vertices)
    faces = _upward(vertices, faces)
    patches, corners = _patches(faces), vertices[np.unique(faces), :2]
    patches = [part for patch in patches for part in _not_over_itself(vertices, patch)]
    plain = [_prism(vertices, patch, bottom) for patch in patches]
    split = [_prism(*_split_at_lines(vertices, patch, corners), bottom) for patch in patches]
    # Only a crack makes so much surface: without one, the fewer triangles are used. The measured solid is not returned,
    # since a boolean of many that is worked out in parts comes out in other triangles.
    cracked = _joined(plain).surface_area() > _joined(split).surface_area() + _CRACK
    return _joined(split if cracked else plain)


def swept_up(solid: Manifold, top: float) -> Manifold:
    """Return the volume over the upward faces of `solid`, up to z = `top`, which is above it."""
    vertices, faces = arrays(solid)
    turned = vertices * (1.0, 1.0, -1.0)
    patches = (part for patch in _patches(_upward(vertices, faces)) for part in _not_over_itself(turned, patch))
    prisms = (_prism(turned, patch, -top) for patch in patches)
    return _joined([prism.mirror((0, 0, 1)) for prism in prisms])


def _upward(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the upward faces, by slope: without a sliver of a level face two prisms would have a crack between."""
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return faces[normals[:, 2] > _UPRIGHT * np.linalg.norm(normals, axis=1)]


def _joined(prisms: list[Manifold]) -> Manifold:
    return Manifold.batch_boolean(prisms, manifold3d.OpType.Add)


def _plumb(vertices: np.ndarray) -> np.ndarray:
    """Return vertices, those within a boolean's rounding of one vertical line moved onto it.

    Otherwise two prisms that should share a wall have a crack between them.
    """
    from scipy.spatial import KDTree

    pairs = KDTree(vertices[:, :2]).query_pairs(_SAME_LINE, output_type="ndarray")
    label = components(len(vertices), pairs[:, 0], pairs[:, 1])
    _, first, line = np.unique(label, return_index=True, return_inverse=True)
    return np.column_stack([vertices[first[line], :2], vertices[:, 2]])


def _patches(faces: np.ndarray) -> list[np.ndarray]:
    """Return faces (m, 3) in groups that are joined by edges."""
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    of_face = np.repeat(np.arange(len(faces)), 3)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    same = np.all(edges[order][1:] == edges[order][:-1], axis=1)
    first, second = of_face[order][:-1][same], of_face[order][1:][same]
    labels = components(len(faces), first, second)
    return [faces[labels == i] for i in range(int(labels.max(initial=-1)) + 1)]


def _not_over_itself(vertices: np.ndarray, patch: np.ndarray) -> list[np.ndarray]:
    """Return a patch in parts of which none lies over itself, as several turns of a thread do: its prism would be none.

    Steep walls are parted from the rest, then halves by the number of faces from one end, until each part's shadow has
    the area of its faces.
    """
    plan = vertices[patch][:, :, :2]
    (x0, y0), (x1, y1) = (plan[:, 1] - plan[:, 0]).T, (plan[:, 2] - plan[:, 0]).T
    area = np.abs(x0 * y1 - y0 * x1).sum() / 2
    shadow = CrossSection(list(plan), FillRule.NonZero).area()
    if len(patch) < 2 or area - shadow <= _OVER * area:
        return [patch]
    normals = np.cross(vertices[patch[:, 1]] - vertices[patch[:, 0]], vertices[patch[:, 2]] - vertices[patch[:, 0]])
    steep = normals[:, 2] < _STEEP * np.linalg.norm(normals, axis=1)
    if steep.all() or not steep.any():
        steep = _from_one_end(patch) < len(patch) // 2
    halves = steep, ~steep
    return [part for half in halves for joined in _patches(patch[half]) for part in _not_over_itself(vertices, joined)]


def _from_one_end(patch: np.ndarray) -> np.ndarray:
    """Return the order of a patch's faces, counted over their edges from a face at one end."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import breadth_first_order

    edges = np.sort(patch[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort(edges.T)
    same = np.all(edges[order][1:] == edges[order][:-1], axis=1)
    first, second = (order[side][same] // 3 for side in (slice(None, -1), slice(1, None)))
    graph = coo_array((np.ones(len(first)), (first, second)), shape=(len(patch),) * 2).tocsr()
    far = breadth_first_order(graph, 0, directed=False, return_predecessors=False)[-1]
    rank = np.empty(len(patch), np.int64)
    rank[breadth_first_order(graph, far, directed=False, return_predecessors=False)] = np.arange(len(patch))
    return rank


def _split_at_lines(vertices: np.ndarray, patch: np.ndarray, lines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return vertices and a patch of faces, its border split at the vertical lines (x and y, (n, 2)) that it meets.

    Else two prisms that share a wall, in which one of them has one vertex more, keep a crack between them.
    """
    from scipy.spatial import KDTree

    tree, known = KDTree(lines), len(vertices)
    added, split = [vertices], dict[tuple[int, int], list[int]]()
    for i, j in open_edges(patch).tolist():
        start, (x, y, rise) = vertices[i], vertices[j] - vertices[i]
        length = math.hypot(x, y)
        near = lines[tree.query_ball_point(start[:2] + np.array([x, y]) / 2, length / 2)] - start[:2]
        share = near @ (x, y) / length**2
        off = np.abs(near @ (y, -x)) / length
        between = (off < _SAME_LINE) & (np.minimum(share, 1 - share) * length > _SAME_LINE)
        share, first = np.unique(share[between], return_index=True)
        if len(share):
            added.append(start + np.column_stack([near[between][first], share * rise]))
            split[i, j] = list(range(known, known + len(share)))
            known += len(share)
    parts, waiting = [], patch.tolist() if split else []
    while waiting:
        i, j, k = waiting.pop()
        side = next((side for side in ((i, j), (j, k), (k, i)) if split.get(side)), None)
        if side is None:
            parts.append((i, j, k))
            continue
        i, j, k = {(i, j): (i, j, k), (j, k): (j, k, i), (k, i): (k, i, j)}[side]
        at, *rest = split.pop(side)
        split[at, j] = rest
        waiting += [(i, at, k), (at, j, k)]
    return np.vstack(added), np.array(parts) if parts else patch


def _prism(vertices: np.ndarray, patch: np.ndarray, bottom: float) -> Manifold:
    """Return the solid between upward faces and the plane z = `bottom`."""
    used, patch = np.unique(patch, return_inverse=True)
    patch, n = patch.reshape(-1, 3), len(used)
    roof = vertices[used]
    floor = np.column_stack([roof[:, :2], np.full(n, bottom)])
    i, j = open_edges(patch).T
    walls = np.vstack([np.column_stack([j, i, i + n]), np.column_stack([j, i + n, j + n])])
    triangles = np.vstack([patch, patch[:, ::-1] + n, walls]).astype(np.uint64)
    return Manifold(manifold3d.Mesh64(np.vstack([roof, floor]), triangles))


def _taper(below: np.ndarray, above: np.ndarray, z0: float, z1: float) -> Manifold:
    """Return a ruled solid between two polygons with as many corners, the lower one counter-clockwise."""
    n = len(below)
    floor = np.column_stack([below, np.full(n, z0)])
    roof = np.column_stack([above, np.full(n, z1)])
    cap_below = manifold3d.triangulate([below])[:, ::-1]
    cap_above = manifold3d.triangulate([above]) + n
    i, j = np.arange(n), np.roll(np.arange(n), -1)
    sides = np.vstack([np.column_stack([i, j, j + n]), np.column_stack([i, j + n, i + n])])
    mesh = manifold3d.Mesh64(np.vstack([floor, roof]), np.vstack([cap_below, cap_above, sides]).astype(np.uint64))
    return Manifold(mesh)


FINENESS = 1e-3
"""Accuracy of the widest circle's diameter, mm."""


def widest(section: CrossSection) -> tuple[float, tuple[float, float]]:
    """Return the diameter of the largest circle that fits into a section, and a centre for it (mm).

    By bisection over inward offsets, mitred, so that a corner does not count as a rounded one. 0 for an empty section.
    """
    if section.is_empty():
        return 0.0, (0.0, 0.0)
    x0, y0, x1, y1 = section.bounds()
    low, high, kept = 0.0, min(x1 - x0, y1 - y0) / 2, section
    while high - low > FINENESS / 4:
        middle = (low + high) / 2
        inner = section.offset(-middle, JoinType.Miter)
        if inner.is_empty():
            high = middle
        else:
            low, kept = middle, inner
    # Any corner of the last offset is that deep; the mean of its corners would not, were it a ring.
    corner = min(tuple(map(float, point)) for loop in kept.to_polygons() for point in loop)
    return 2 * low, (corner[0], corner[1])


def thick_parts(section: CrossSection, least: float = FACETS) -> list[CrossSection]:
    """Return the connected parts of a section that are wider than the films of facets or rounding between two faces."""
    return [part for part in section.decompose() if not part.offset(-least / 2, JoinType.Miter).is_empty()]


def gap(one: CrossSection, other: CrossSection, most: float) -> float:
    """Return the least distance between two sections, neither empty, mm: 0 if they overlap, `most` at most."""
    if not (one ^ other).is_empty():
        return 0.0
    return between_outlines(one.to_polygons(), other.to_polygons(), most)
