"""Closed meshes to test checks with, each from a seed: unions, differences and intersections by manifold3d."""

import numpy as np
from manifold3d import CrossSection, Manifold


def _primitive(rng):
    size = rng.choice([2.0, 4.0, 5.0, 8.0, 10.0], 3)
    kind = rng.integers(6)
    if kind == 0:
        found = Manifold.cube([float(v) for v in size])
    elif kind == 1:
        top = size[2] / 2 if rng.integers(2) else -1.0
        found = Manifold.cylinder(size[0], size[1] / 2, top, int(rng.integers(3, 32)))
    elif kind == 2:
        found = Manifold.sphere(size[0] / 2, int(rng.integers(4, 32)))
    elif kind == 3:
        circle = CrossSection.circle(1.0, int(rng.integers(3, 16))).translate([3, 0])
        found = Manifold.revolve(circle, int(rng.integers(5, 32)))
    elif kind == 4:
        n = int(rng.integers(5, 14))
        angle, radius = np.sort(rng.uniform(0, 2 * np.pi, n)), rng.uniform(1, 6, n)
        outline = CrossSection([np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)])
        found = Manifold.extrude(outline, size[0])
    else:
        found = Manifold.tetrahedron().scale([size[0]] * 3)
    turn = rng.uniform(0, 360, 3) if rng.integers(2) else 90.0 * rng.integers(0, 4, 3)
    shift = rng.integers(-5, 6, 3) if rng.integers(2) else rng.uniform(-5, 5, 3)
    return found.rotate([float(v) for v in turn]).translate([float(v) for v in shift])


def _level_set(rng):
    shapes = (
        lambda x, y, z: np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x) + 0.2,
        lambda x, y, z: 9 - (x * x + y * y + z * z) + 2 * np.sin(3 * x) * np.sin(2 * y),
        lambda x, y, z: 1.5 - (np.hypot(x, y) - 3) ** 2 - z * z,
    )
    return Manifold.level_set(shapes[rng.integers(3)], [-5, -5, -5, 5, 5, 5], float(rng.uniform(0.5, 0.9)), 0.0)


def closed_body(seed):
    """The triangles (n, 3, 3) of a closed mesh as a float32 file holds them; one in ten is a level set."""
    rng = np.random.default_rng(seed)
    found = _level_set(rng) if seed % 10 == 9 else _primitive(rng)
    for _ in range(0 if seed % 10 == 9 else int(rng.integers(0, 6))):
        other = _primitive(rng)
        kind = rng.integers(3)
        made = found + other if kind == 0 else found - other if kind == 1 else found ^ other
        found = made if made.volume() > 0.1 else found + other
    mesh = found.to_mesh()
    return np.asarray(mesh.vert_properties, float)[:, :3][np.asarray(mesh.tri_verts)]
