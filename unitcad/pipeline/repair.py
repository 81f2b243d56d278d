"""A closed copy of a mesh file: corners of open edges that nearly meet are joined. Larger holes are refused."""

from __future__ import annotations

import struct
import tempfile
from pathlib import Path

import numpy as np
from manifold3d import Error
from scipy.spatial import KDTree

from unitcad import files
from unitcad.errors import Refusal
from unitcad.geometry.arrays import Floats, Ints, open_edges
from unitcad.geometry.components import components
from unitcad.meshcheck.file_checks import check_file, surface_of
from unitcad.meshcheck.geometry.mesh import solid_of
from unitcad.meshcheck.readers.read_stl import RECORD
from unitcad.meshcheck.rules.f_file import Deadline, Unreadable
from unitcad.meshcheck.rules.inspection import Options

WIDEST = 0.002
"""Widest gap that is closed, as a share of the body's longest side."""


def repair(source: Path, target: Path, options: Options) -> float:
    """Write a closed copy of a file as STL; return the largest distance between both surfaces, mm.

    Each triangle is moved by its corners, so no point of it moves further than the farthest corner.

    Raises Refusal for a file that can't be closed so: nothing is written then.
    """
    if target.suffix.lower() != ".stl":
        raise Refusal("--repair", str(target), "the copy is an STL: its name ends in .stl", f"{target.stem}.stl")
    try:
        before = surface_of(source, options, Deadline(options.limits.seconds))
    except Unreadable as error:
        raise Refusal("FILE", str(source), str(error)) from None
    if not len(before):
        raise Refusal("FILE", str(source), "has no triangles")
    found = joined(before)
    if found is not None:
        after, far = found
        content = _stl(after)
        with tempfile.TemporaryDirectory() as folder:
            copy = Path(folder) / "copy.stl"
            copy.write_bytes(content)
            left = [each for each in check_file(copy, options).findings if each.severity == "error"]
        if not left:
            files.write(target, content)
            return far + float(np.abs(after.astype(np.float32) - after).max())
        why = f"after joining its edges it still fails: {left[0].code}: {left[0].message}"
    else:
        why = f"its open edges are further apart than {WIDEST * float(np.ptp(before.reshape(-1, 3), axis=0).max()):.2g} mm"
    raise Refusal("--repair", str(source), f"{why}; close the holes in the program that made it")


def joined(corners: Floats) -> tuple[Floats, float] | None:
    """Return triangles (n, 3, 3) whose open edges are joined to a closed body, and how far a corner moved at most, mm.

    None if they don't meet.
    """
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces = faces.reshape(-1, 3)
    size = float(np.ptp(vertices, axis=0).max())
    for gap in (0.0, 1e-5, 1e-4, 1e-3, WIDEST):
        moved, index = _clustered(vertices, _open_corners(faces), gap * size)
        found = index[faces]
        found = found[(found != np.roll(found, 1, axis=1)).all(axis=1)]
        solid = solid_of(moved, found)
        if solid.status() == Error.NoError and not solid.is_empty():
            triangles: Floats = moved[found]
            far = float(np.linalg.norm(moved[index] - vertices, axis=1).max())
            return (triangles if solid.volume() > 0 else triangles[:, ::-1]), far
    return None


def _open_corners(faces: Ints) -> Ints:
    """Return the corners at edges that no face on the other side shares."""
    return np.unique(open_edges(faces))


def _clustered(vertices: Floats, loose: Ints, gap: float) -> tuple[Floats, Ints]:
    """Return vertices, those of `loose` that are within a gap of each other as one in their middle, and each one's place."""
    pairs = (
        loose[KDTree(vertices[loose]).query_pairs(gap, output_type="ndarray")] if len(loose) else np.empty((0, 2), int)
    )
    label = components(len(vertices), pairs[:, 0], pairs[:, 1])
    _, index, many = np.unique(label, return_inverse=True, return_counts=True)
    middles = np.stack([np.bincount(index, vertices[:, k]) / many for k in range(3)], axis=1)
    return middles, index


def _stl(corners: Floats) -> bytes:
    records = np.zeros(len(corners), RECORD)
    records["corners"] = corners
    return b"repaired copy".ljust(80) + struct.pack("<I", len(corners)) + records.tobytes()
