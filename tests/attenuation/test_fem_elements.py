"""Harmonic finite elements against the layered solver, against rigid bodies, energy and reciprocity, and each other."""

import math

import numpy as np
import pytest
from msgspec.structs import replace

pytest.importorskip("skfem")

from benchmarks.accuracy.elements import pressed_skin
from unitcad.attenuation import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.fem import elements as hm
from unitcad.attenuation.fem.elements import element_matrices, motor_response
from unitcad.attenuation.fem.unit import Setting, motion, unit_fields
from unitcad.attenuation.inputs import tissue_medium
from unitcad.attenuation.layered import UniformDisc
from unitcad.estimate_inputs import estimate_input
from unitcad.validation import load

RADII = np.array([0, 2, 5, 7, 10, 15, 20, 30]) * 1e-3
DISC, OMEGA = 3.5e-3, 2 * math.pi * 125
DRIVES = (("axial", "normal"), ("flat", "tangential"))


def forearm():
    return tissue_medium(estimate_input(load("embedded")).tissue)


def off(a, b):
    return np.max(np.abs(a - b)) / np.max(np.abs(b))


@pytest.fixture(scope="module", params=DRIVES, ids=lambda pair: pair[0])
def skin(request):
    drive, direction = request.param
    exact = forearm().response(UniformDisc(DISC, direction), OMEGA, RADII, rtol=1e-8)
    wanted = np.array([exact.u_r, exact.u_z] if drive == "axial" else [exact.u_r, exact.u_theta, exact.u_z])

    def solved(fineness):
        u_r, u_theta, u_z = (u[:, 0] for u in pressed_skin(forearm(), OMEGA, drive, DISC, fineness).skin(RADII))
        return np.array([u_r, -u_z] if drive == "axial" else [u_r, u_theta, -u_z])  # the solver's z points down

    return wanted, solved(1), solved(2)


def test_bare_skin_agrees_with_the_layered_solver_within_the_meshs_own_error(skin):
    exact, coarse, fine = skin
    own = off(coarse, fine)
    assert own < 5e-3
    assert off(fine, exact) < min(own, 1e-3)
    assert off(fine, exact) < off(coarse, exact) / 2.5


@pytest.mark.parametrize("drive", ["axial", "flat"])
def test_incompressible_elements_do_not_lock(drive):
    """nu = 0.4999 in a held layer of 10 kPa: displacement elements without the pressure would be far stiffer."""
    medium = LayeredMedium([Layer(0.02, 1000, 1e4 * 3, 0.4999)], HalfSpace(1000, 1e14, 0.3))
    direction = dict(DRIVES)[drive]
    exact = medium.response(UniformDisc(DISC, direction), 0.0, RADII, rtol=1e-7)
    u_r, _, u_z = pressed_skin(medium, 0.0, drive, DISC, 2).skin(RADII)
    solved, wanted = (-u_z, exact.u_z) if drive == "axial" else (u_r, exact.u_r)
    assert off(solved[:, 0], wanted) < 2e-3


def ring_mesh():
    """Two blocks of a unit's size, one on the axis, without a body under them."""
    solid = hm.Solid(complex(1e4), 0.45, 1000.0)
    blocks = [hm.Block(0, 4e-3, 1e-3, 3e-3, solid), hm.Block(4e-3, 7e-3, 1e-3, 5e-3, solid)]
    return hm.harmonic_mesh(blocks, 1, 0.02), blocks


def column(mesh, *fields):
    """A field over nodes as the unknowns of each element."""
    return np.concatenate([f[mesh.basis.element_dofs] for f in np.broadcast_arrays(*fields, mesh.r)[:-1]]).T


@pytest.mark.parametrize("motion", ["along z", "sideways", "turning"])
def test_a_rigid_motion_has_no_strain_and_its_own_inertia(motion):
    mesh, blocks = ring_mesh()
    matrices = element_matrices(mesh, 0 if motion == "along z" else 1)
    u = {
        "along z": lambda: column(mesh, 0 * mesh.r, 1 + 0 * mesh.r),
        "sideways": lambda: column(mesh, 1 + 0 * mesh.r, 0 * mesh.r, 0 * mesh.r),
        "turning": lambda: column(mesh, mesh.z, 0 * mesh.r, -mesh.r),
    }[motion]()

    def twice_energy(matrix):
        return np.einsum("ei,eij,ej->", u, matrix, u)

    stiff = max(np.abs(matrices.shear).max(), np.abs(matrices.bulk).max())
    assert abs(twice_energy(matrices.shear)) < 1e-12 * stiff * np.max(u**2)
    assert abs(twice_energy(matrices.bulk)) < 1e-12 * stiff * np.max(u**2)
    rings = [(math.pi * (b.r1**2 - b.r0**2) * (b.z1 - b.z0), b) for b in blocks]
    if motion == "turning":
        wanted = sum(v * ((b.r1**2 + b.r0**2) / 4 + (b.z1**3 - b.z0**3) / (b.z1 - b.z0) / 3) for v, b in rings)
    else:
        wanted = sum(v for v, _ in rings)
    assert twice_energy(matrices.mass) == pytest.approx(wanted, rel=1e-12)


def test_a_first_harmonic_of_pure_strain_has_its_exact_energy():
    """u_x = x^2 - y^2, a second harmonic in p and a quadratic: exact in the elements; and u_x = x z, u_z = 0."""
    mesh, blocks = ring_mesh()
    matrices = element_matrices(mesh, 1)
    # u_x = g z: gamma_xz = g, energy density mu g^2 / 2.
    u = column(mesh, mesh.z, 0 * mesh.r, 0 * mesh.r)
    volume = sum(math.pi * (b.r1**2 - b.r0**2) * (b.z1 - b.z0) for b in blocks)
    assert np.einsum("ei,eij,ej->", u, matrices.shear, u) == pytest.approx(volume, rel=1e-12)
    # u_x = x^2 - y^2 + 0, u_y = 2 x y: u_r = r^2 cos(theta), u_theta = r^2 sin(theta), so p = r^2 and q = 0.
    # eps_xx = 2x, eps_yy = 2x, eps_xy = (-2y + 2y)/2 = 0: mu 2 (eps:eps) = 16 mu x^2, div = 4x.
    u = column(mesh, 0 * mesh.r, mesh.r**2, 0 * mesh.r)
    x_squared = sum(math.pi * (b.r1**4 - b.r0**4) / 4 * (b.z1 - b.z0) for b in blocks)
    assert np.einsum("ei,eij,ej->", u, matrices.shear, u) == pytest.approx(16 * x_squared, rel=1e-12)
    assert np.einsum("ei,eij,ej->", u, matrices.bulk, u) == pytest.approx(16 * x_squared, rel=1e-12)


def test_a_motor_in_next_to_nothing_moves_as_a_free_body():
    """F / (-omega^2 m): its surroundings have a millionth of its mass and no stiffness to speak of."""
    variant = estimate_input(load("embedded"))
    soft = replace(
        variant,
        layers=tuple(
            replace(layer, density=1e-3, youngs_modulus=replace(layer.youngs_modulus, value=1e-3, low=None, high=None))
            for layer in variant.layers
        ),
        tissue=tuple(
            replace(
                t,
                density=1e-3,
                damping=replace(t.damping, value=0.0, low=None, high=None),
                shear_modulus=replace(t.shear_modulus, value=1e-3, low=None, high=None),
            )
            if t.thickness
            else t
            for t in variant.tissue
        ),
        geometry=replace(variant.geometry, pad=None),
    )
    omega = 2 * math.pi * soft.frequency.middle
    free = -1 / (omega**2 * soft.geometry.motor_mass.middle)
    for drive in ("axial", "flat"):
        moved = motion(soft, drive, Setting(), 0.5)
        assert moved.motor == pytest.approx(free, rel=1e-4)
        assert abs(moved.turning) * soft.geometry.motor_radius < 1e-4 * abs(free)


def test_the_power_of_the_motor_is_what_the_materials_dissipate():
    """Im(F conj(u)) against the loss moduli times the strains, summed over the elements."""
    mu, eta = 2e4, 0.3
    solid = hm.Solid(mu * (1 + 1j * eta), 0.45, 1000.0)
    blocks = [hm.Block(0, 0.02, -0.02, 0, solid), hm.Block(0, DISC, 0, 2e-3, None)]
    mesh = hm.harmonic_mesh(blocks, 1, 0.02)
    for harmonic in (0, 1):
        fields = motor_response(mesh, blocks, OMEGA, harmonic)
        unit = element_matrices(mesh, harmonic)
        u = np.concatenate([f[mesh.basis.element_dofs] for f in fields.values[..., 0]]).T
        energy = solid.shear.imag * unit.shear + solid.lame.imag * unit.bulk
        assert fields.stiffness[0, 0].imag == pytest.approx(
            np.einsum("ei,eij,ej->", u.conj(), energy, u).real, rel=1e-9
        )


def test_a_resting_unit_slides_and_does_not_lift_off():
    variant = estimate_input(load("encapsulating"))
    for contact in ("bonded", "resting"):
        fields = unit_fields(variant, "flat", Setting(contact), 0.5)
        r = variant.diameter / 2
        unit, skin = (np.array(fields.displacement(fields.mesh.at(r, 0.0, above)))[:, 0] for above in (True, False))
        assert unit[2] == skin[2] != 0
        for field in (0, 1):
            assert (unit[field] == skin[field]) == (contact == "bonded")


def test_elements_converge_towards_a_static_punch():
    """A rigid disc on an incompressible half-space: F / u = 8 G a along z, 16/3 G a sideways; M / angle 16/3 G a^3.

    (Mindlin; at nu = 1/2 shear on the surface moves it nowhere along z, so bonded and frictionless discs agree.)
    """
    shear, height = 1e4, 2e-3
    solid = hm.Solid(shear + 0j, 0.4999, 1000.0)
    exact = shear * DISC * np.array([8, 16 / 3, 16 / 3 * DISC**2])

    def stiffness(fineness, size):
        blocks = [hm.Block(0, size, -size, 0, solid), hm.Block(0, DISC, 0, height, None)]
        mesh = hm.harmonic_mesh(blocks, fineness, size)
        along = motor_response(mesh, blocks, 0.0, 0).stiffness[0, 0].real
        sideways = motor_response(mesh, blocks, 0.0, 1).stiffness.real
        # The motions are about the motor's middle; the disc turns about its underside.
        return np.array([along, sideways[0, 0], sideways[1, 1] - (height / 2) ** 2 * sideways[0, 0]])

    # What the held outer edge adds falls with its distance.
    errors = [(2 * stiffness(n, 0.06) - stiffness(n, 0.03)) / exact - 1 for n in (0.5, 1)]
    assert np.all(errors[1] < errors[0] / 1.5)
    assert np.all(np.abs(errors[1]) < 0.04)
