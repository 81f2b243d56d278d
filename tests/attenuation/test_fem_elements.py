"""Harmonic finite elements against the layered solver, against rigid bodies, energy and reciprocity, and each other."""

import math

import numpy as np
import pytest
from msgspec.structs import replace

pytest.importorskip("skfem")

from benchmarks.accuracy.elements import pressed_skin
from unitcad.attenuation.fem import elements as hm
from unitcad.attenuation.fem.elements import motor_response
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
