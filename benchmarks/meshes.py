"""Meshes of any size for the benchmarks. The torus is closed and wavy, free of crossings, nothing of it coplanar."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from manifold3d import Manifold


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


def plate(n_faces: int) -> tuple[np.ndarray, np.ndarray]:
    """A plate with rows of round holes, cut by manifold3d: fans of thin triangles that meet in the rims."""
    from manifold3d import CrossSection, Manifold, OpType

    n = max(int(np.sqrt(n_faces / 196)), 1)
    holes = [CrossSection.circle(3.0, 48).translate((10.0 * i + 5, 10.0 * j + 5)) for i in range(n) for j in range(n)]
    section = CrossSection.square((10.0 * n, 10.0 * n)) - CrossSection.batch_boolean(holes, OpType.Add)
    return _arrays(Manifold.extrude(section, 4.0))


def gyroid(n_faces: int) -> tuple[np.ndarray, np.ndarray]:
    """A gyroid in a cube of 20 mm, by manifold3d's level set."""
    from manifold3d import Manifold

    def inside(x: float, y: float, z: float) -> float:
        return 0.4 - np.sin(x) * np.cos(y) - np.sin(y) * np.cos(z) - np.sin(z) * np.cos(x)

    edge = 20.0 / max(np.sqrt(n_faces / 66), 4)
    return _arrays(Manifold.level_set(inside, [0, 0, 0, 20, 20, 20], edge, 0.0))


def scan(n_faces: int) -> tuple[np.ndarray, np.ndarray]:
    """A made-up scanned body: a noisy torus on a turned frame, some faces slivers, every tenth doubled in its plane."""
    points, faces = torus(n_faces)
    rng = np.random.default_rng(11)
    points = points + rng.normal(scale=0.01, size=points.shape)
    thin = rng.choice(len(faces), len(faces) // 50, replace=False)
    one, two = points[faces[thin, 0]], points[faces[thin, 1]]
    points[faces[thin, 2]] = one + (two - one) * rng.random((len(thin), 1))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    points = (points @ turn).astype(np.float32).astype(np.float64)
    return np.concatenate([points, points]), np.concatenate([faces, faces[::10] + np.int32(len(points))])


def body(_: int) -> tuple[np.ndarray, np.ndarray]:
    """A bust scanned from photographs, 16,719 faces whatever is asked for (demosthenes.txt: author and licence)."""
    with (Path(__file__).parent / "demosthenes.ply").open("rb") as file:
        lines = iter(lambda: file.readline().split(), [b"end_header"])
        count = {line[1]: int(line[2]) for line in lines if line[0] == b"element"}
        points = np.frombuffer(file.read(12 * count[b"vertex"]), "<f4").reshape(-1, 3)
        faces = np.frombuffer(file.read(), np.dtype([("n", "u1"), ("corners", "<i4", 3)]))
    return points.astype(np.float64), faces["corners"].astype(np.int32)


def cubes(n_faces: int) -> tuple[np.ndarray, np.ndarray]:
    """Cubes of 10 mm that touch, as many along each axis."""
    from manifold3d import Manifold

    points, faces = _arrays(Manifold.cube((10.0, 10.0, 10.0)))
    n = max(round((n_faces / 12) ** (1 / 3)), 1)
    place = 10.0 * np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    return (points + place).reshape(-1, 3), (faces + 8 * np.arange(n**3, dtype=np.int32)[:, None, None]).reshape(-1, 3)


def _arrays(solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    mesh = solid.to_mesh64()
    points = np.asarray(mesh.vert_properties)[:, :3].astype(np.float32).astype(np.float64)
    return points, np.asarray(mesh.tri_verts, np.int32)


def write_stl(path: Path, vertices: np.ndarray, faces: np.ndarray) -> None:
    """A binary STL with zero normals."""
    records = np.zeros(len(faces), np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]))
    records["v"] = vertices[faces]
    path.write_bytes(b"torus".ljust(80, b"\0") + np.uint32(len(faces)).tobytes() + records.tobytes())


if __name__ == "__main__":
    write_stl(Path(sys.argv[2]), *torus(int(sys.argv[1])))
