"""Rays from faces against every triangle by Moeller and Trumbore's intersection, without boxes."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import Manifold

from unitcad.meshcheck.geometry import rays
from unitcad.meshcheck.geometry.mesh import Mesh
from unitcad.meshcheck.geometry.topology import topology_of

FLOORS, LEAST = (0.8, 0.5), 0.4


def slotted(gap):
    """Draw a block with a slot, a thin wall and a pin."""
    block = Manifold.cube((6, 4, 3)) - Manifold.cube((gap, 5, 2)).translate((2, -0.5, 1))
    return block - Manifold.cube((1, 5, 2)).translate((2 + gap + 0.3, -0.5, 1)) + Manifold.cylinder(5, 0.15, 0.1, 12)


def fan(gap):
    """Draw a tube of slivers whose boxes all meet once it is turned."""
    return Manifold.cylinder(8, 3, 3, 90) - Manifold.cylinder(10, 3 - gap, 3 - gap, 90).translate((0, 0, -1))


def by_brute_force(mesh, points, owners, reach, side):
    """Return `thickness` and `behind` of points on faces, mm."""
    corners = mesh.vertices[mesh.faces[:, ::side]]
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(one, two)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    thickness, behind = np.full((2, len(points)), np.inf)
    for i, (point, owner) in enumerate(zip(points, owners, strict=True)):
        along = -normal[owner]
        p = np.cross(along, two)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1 / np.einsum("ij,ij->i", p, one)
            u = np.einsum("ij,ij->i", p, point - corners[:, 0]) * inverse
            q = np.cross(point - corners[:, 0], one)
            v, t = (q @ along) * inverse, np.einsum("ij,ij->i", q, two) * inverse
            hit = (u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (t > 1e-4) & (t < reach[i])
        facing = normal @ along
        thickness[i] = np.min(t[hit & (facing > rays.PARALLEL)], initial=np.inf)
        behind[i] = np.min(t[hit & (facing > rays.OPPOSED)], initial=np.inf)
    return thickness, behind


@settings(max_examples=12)
@given(
    drawn=st.sampled_from([slotted, fan]),
    gap=st.floats(0.05, 0.7),
    angles=st.tuples(*[st.sampled_from([0.0, 17.0, 41.0, 90.0])] * 3),
    side=st.sampled_from([1, -1]),
)
def test_rays_find_what_lies_across(drawn, gap, angles, side):
    solid = drawn(gap).rotate(angles).to_mesh64()
    mesh = Mesh(np.ascontiguousarray(solid.vert_properties), np.ascontiguousarray(solid.tri_verts, np.int32))
    found = rays.cast(topology_of(mesh, lambda: None), FLOORS, LEAST, lambda: None, side=side)
    reach = np.maximum(found.floor, LEAST)
    some = np.random.default_rng(1).permutation(len(reach))[:300]
    expected = by_brute_force(mesh, found.points[some], found.owner[some], reach[some], side)
    for mine, other in zip((found.thickness[some], found.behind[some]), expected, strict=True):
        np.testing.assert_allclose(np.where(mine < reach[some], mine, np.inf), other, rtol=1e-7, atol=1e-9)
    thin = np.flatnonzero(found.thickness < found.floor)
    assert (found.across[thin] >= 0).all()
