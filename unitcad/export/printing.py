"""A body for a printer's file: as printed on the bed, in the single precision that STL and slicers have, and as STL."""

from __future__ import annotations

import manifold3d
import numpy as np

from unitcad.errors import UnitcadError
from unitcad.geometry.arrays import unique_rows

ROUNDS = 6
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


class TooThin(UnitcadError):
    """A mesh that single precision can't represent."""


def print_ready(vertices: np.ndarray, faces: np.ndarray, upside_down: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Lay a closed mesh (vertices (n, 3) mm, faces (m, 3)) on the bed, rounded to single precision, still closed.

    Returns float32 vertices and faces in a canonical order (vertices sorted, each face from its least vertex, faces
    sorted), every face thicker than single precision resolves at this size. Raises TooThin if that is not
    possible.
    """
    return single_precision(laid_down(vertices, upside_down), faces)


def laid_down(vertices: np.ndarray, upside_down: bool) -> np.ndarray:
    """Return vertices (n, 3) in print attitude: turned by 180 degrees about x if `upside_down`, standing on z = 0."""
    turned = vertices * ((1.0, -1.0, -1.0) if upside_down else (1.0, 1.0, 1.0))
    return turned - (0.0, 0.0, turned[:, 2].min())


def resolution(vertices: np.ndarray) -> float:
    """Return the spacing of single precision numbers at the largest coordinate of `vertices` (mm)."""
    return float(np.spacing(np.float32(np.abs(vertices).max())))


def single_precision(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Round a closed mesh to float32 without a crack: see `print_ready`.

    Rounding alone turns slivers of a boolean into faces without area. So details thinner than a few roundings are
    simplified away first, by manifold3d (which keeps the mesh closed), with a growing limit until the rounded mesh is
    sound. The surface moves by less than 4 ** ROUNDS times the resolution in the worst case, 4 times it in the usual
    one.
    """
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(
            np.ascontiguousarray(vertices, dtype=np.float64), np.ascontiguousarray(faces, dtype=np.uint64)
        )
    )
    step = resolution(vertices)
    for power in range(1, ROUNDS + 1):
        mesh = solid.simplify(step * 4**power).to_mesh64()
        rounded = _to_float32(np.asarray(mesh.vert_properties[:, :3]), np.asarray(mesh.tri_verts, dtype=np.int64))
        if len(rounded[1]) and _is_closed(rounded[1]) and _thinnest(*rounded) > step:
            return rounded
    where = f"parts of it touch along an edge only, or two faces are nearer than {step:.2g} mm"
    raise TooThin(f"the mesh can't be rounded to single precision: {where}")


def _to_float32(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh in float32: equal vertices merged, collapsed faces dropped, in canonical order."""
    # Adding zero turns -0.0 into 0.0, which would otherwise be another vertex in the bytes.
    merged, index = unique_rows(vertices.astype(np.float32) + np.float32(0))
    faces = index[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    least = faces.argmin(axis=1)
    faces = np.take_along_axis(faces, (least[:, None] + np.arange(3)) % 3, axis=1)
    return merged, faces[np.lexsort(faces.T[::-1])]


def _is_closed(faces: np.ndarray) -> bool:
    """Tell whether every edge is used once in each direction, so that the mesh is closed, oriented, manifold."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = int(faces.max()) + 1
    forward = np.sort(start * count + end)
    return bool(np.all(np.diff(forward) > 0) and np.array_equal(forward, np.sort(end * count + start)))


def _thinnest(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Return the least altitude of any face (mm)."""
    corners = vertices.astype(np.float64)[faces]
    edges = corners[:, (1, 2, 0)] - corners
    doubled_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return float(np.min(doubled_area / np.linalg.norm(edges, axis=2).max(axis=1)))


def stl(vertices: np.ndarray, faces: np.ndarray, name: str) -> bytes:
    """Return the bytes of a binary STL with a mesh: vertices (n, 3) in mm, faces (m, 3). The format has no unit.

    `print_ready` makes a mesh that survives the rounding. The header names the part. It never starts
    with "solid", by which some readers take a file for the ASCII kind.
    """
    corners = np.asarray(vertices, dtype=np.float32)[faces]
    edges = corners[:, 1:].astype(np.float64) - corners[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1])
    facets = np.zeros(len(faces), dtype=_FACET)
    facets["normal"] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    facets["corners"] = corners
    header = f"unitcad, mm: {name}".encode("ascii", "replace")[:80].ljust(80)
    return header + len(faces).to_bytes(4, "little") + facets.tobytes()
