"""Meshes of any size for the benchmarks: a wavy torus, closed, free of crossings, nothing coplanar."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np


def torus(n_faces: int) -> tuple[np.ndarray, np.ndarray]:
    """About `n_faces` faces: vertices (n, 3) that float32 holds exactly, mm, as float64; faces (m, 3) int32."""
    n = int(np.sqrt(n_faces / 2))
    m = n_faces // (2 * n)
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(m) * 2 * np.pi / m, indexing="ij")
    r = 8 + 0.05 * np.sin(9 * u) * np.sin(7 * v)
    points = np.stack([(20 + r * np.cos(v)) * np.cos(u), (20 + r * np.cos(v)) * np.sin(u), r * np.sin(v)], axis=-1)
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b, c, d = i * m + j, (i + 1) % n * m + j, (i + 1) % n * m + (j + 1) % m, i * m + (j + 1) % m
    faces = np.concatenate([np.stack([a, b, c], axis=-1).reshape(-1, 3), np.stack([a, c, d], axis=-1).reshape(-1, 3)])
    return points.reshape(-1, 3).astype(np.float32).astype(np.float64), faces.astype(np.int32)


def write_stl(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    """A binary STL with zero normals."""
    records = np.zeros(len(faces), np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]))
    records["v"] = vertices[faces]
    path.write_bytes(b"torus".ljust(80, b"\0") + np.uint32(len(faces)).tobytes() + records.tobytes())


if __name__ == "__main__":
    write_stl(Path(sys.argv[2]), *torus(int(sys.argv[1])))
