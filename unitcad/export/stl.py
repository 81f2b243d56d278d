"""Binary STL: little-endian single precision, mm by custom (the format has no unit)."""

from __future__ import annotations

import numpy as np

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def content(vertices: np.ndarray, faces: np.ndarray, name: str) -> bytes:
    """Return the bytes of a file with a mesh: vertices (n, 3) in mm, faces (m, 3).

    `export.printing.print_ready` makes a mesh that survives the rounding. The header names the part. It never starts
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
