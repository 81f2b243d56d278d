"""Units side by side: reciprocity, power, closed forms, an independent solve, and figures that were once measured."""

import numpy as np
import pytest

from unitcad.attenuation import HalfSpace, LayeredMedium, Point
from unitcad.attenuation.inputs import tissue_medium
from unitcad.attenuation.receivers import FORCES, Patch, influence, motion, unit_mass
from unitcad.designs import unit_bodies
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_input
from unitcad.kernels.mesh import realise
from unitcad.validation import load

UNIT = estimate_input(load("encapsulating"))
FOREARM = tissue_medium(UNIT.tissue)
OMEGA = 2 * np.pi * 150
THREE = (Patch(0, 0, 7e-3, 1.2e-3), Patch(0.016, 0, 5e-3, 0.4e-3), Patch(0.003, 0.017, 7e-3, 0.9e-3))
MASSES = np.array([patch.mass for patch in THREE])
G = influence(FOREARM, THREE, OMEGA)


def driven(drive, count=3):
    forces = np.zeros((count, 3), dtype=complex)
    forces[0] = FORCES[drive]
    return forces


def test_influence_is_reciprocal_and_takes_power():
    g = G.reshape(9, 9)
    assert np.max(np.abs(g - g.T)) < 1e-3 * np.max(np.abs(g))
    assert np.linalg.eigvalsh((g.conj().T - g) / 2j).min() > 0


def test_a_pair_is_the_mean_of_points_over_both_discs():
    """By point loads, whose transform is another: a newton spread over points of one disc, read at the other's."""
    rings, spokes = np.sqrt((np.arange(5) + 0.5) / 5), 2 * np.pi * np.arange(11) / 11
    disc = (rings[:, None] * np.exp(1j * spokes)).ravel()
    between = (0.016 + 5e-3 * disc[:, None]) - 7e-3 * disc[None]
    distances, at = np.unique(np.round(np.abs(between), 6), return_inverse=True)
    normal, sideways = (FOREARM.response(Point(way), OMEGA, distances, rtol=1e-4) for way in ("normal", "tangential"))
    outwards = (between / np.abs(between)).ravel()
    cos, sin, at = outwards.real, outwards.imag, at.ravel()
    u_r, u_theta = sideways.u_r[at], sideways.u_theta[at]
    size = np.max(np.abs(G))
    assert abs(np.mean(normal.u_z[at]) - G[1, 2, 0, 2]) < 1e-3 * size
    assert abs(np.mean(normal.u_r[at] * cos) - G[1, 0, 0, 2]) < 1e-3 * size
    assert abs(np.mean(sideways.u_z[at] * cos) - G[1, 2, 0, 0]) < 1e-3 * size
    assert abs(np.mean(u_r * cos**2 - u_theta * sin**2) - G[1, 0, 0, 0]) < 1e-3 * size
    assert abs(np.mean(u_r * sin**2 - u_theta * cos**2) - G[1, 1, 0, 1]) < 1e-3 * size


def test_own_motion_is_the_closed_form_on_a_half_space():
    """Mean over a disc under its own uniform traction: 16 (1 - nu^2) / (3 pi^2 E a) a newton, sideways with C_sh."""
    a, e, nu = 6e-3, 20e3, 0.4
    g = influence(LayeredMedium([], HalfSpace(1000, e, nu)), (Patch(0, 0, a, 0.0),), 0.0)[0, :, 0, :]
    normal = 16 * (1 - nu**2) / (3 * np.pi**2 * e * a)
    assert g[2, 2] == pytest.approx(normal, rel=2e-4)
    assert g[0, 0] == pytest.approx(normal * (2 - nu) / (2 * (1 - nu)), rel=2e-4)
    assert g[0, 0] == g[1, 1]


@pytest.mark.parametrize("drive", ["flat", "axial"])
def test_masses_against_the_stiffness_of_the_skin(drive):
    """The same by another way: the skin's dynamic stiffness, G inverted, with the masses on its diagonal."""
    stiffness = np.linalg.inv(G.reshape(9, 9)) - OMEGA**2 * np.diag(np.repeat(MASSES, 3))
    expected = np.linalg.solve(stiffness, driven(drive).ravel()).reshape(3, 3)
    found = motion(G, MASSES, driven(drive), OMEGA)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-12 * np.max(np.abs(expected)))


@pytest.mark.parametrize("name", ["encapsulating", "embedded", "three-layer"])
def test_mass_is_that_of_the_drawn_silicone_and_the_motor(name):
    spec = load(name)
    variant = estimate_input(spec)
    solids = {one.name: realise(one.shape, 128) for one in unit_bodies(spec)}
    silicone = [solids[f"layer{i + 1}"].volume() * 1e-9 * layer.density for i, layer in enumerate(variant.layers)]
    mass, motor = unit_mass(variant), variant.geometry.motor_mass
    assert mass.value == pytest.approx(sum(silicone) + motor.middle, rel=0.03)
    assert mass.ends == pytest.approx([mass.value - motor.middle + end for end in motor.ends])


def test_patches_that_overlap_are_refused():
    with pytest.raises(Refusal, match="overlap"):
        influence(FOREARM, (THREE[0], Patch(0.011, 0, 5e-3, 0.0)), OMEGA)
