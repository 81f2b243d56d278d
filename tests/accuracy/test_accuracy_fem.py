"""Finite elements and layered solver on bare skin: two methods that share no code agree within the mesh's own error."""

import math

import numpy as np
import pytest

pytest.importorskip("skfem")

from unitcad.accuracy import fem
from unitcad.accuracy.edge_levels import unit_spec
from unitcad.accuracy.unit_fem import edge_level, pressed_skin
from unitcad.attenuation import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.inputs import body
from unitcad.attenuation.layered.loads import UniformDisc
from unitcad.estimating import estimate_input
from unitcad.validation import load

RADII = np.array([0, 2, 5, 7, 10, 15, 20, 30]) * 1e-3
DISC, OMEGA = 3.5e-3, 2 * math.pi * 125


@pytest.fixture(scope="module")
def skin():
    medium = body(estimate_input(load("embedded")).tissue)
    exact = medium.response(UniformDisc(DISC), OMEGA, RADII, rtol=1e-8).u_z
    coarse, fine = (pressed_skin(medium, OMEGA, DISC, n) for n in (1, 2))
    return exact, -coarse.at(RADII), -fine.at(RADII)


def off(a, b):
    return np.max(np.abs(a - b)) / np.max(np.abs(b))


def test_bare_skin_agrees_within_the_meshs_own_error(skin):
    exact, coarse, fine = skin
    own = off(coarse, fine)
    assert own < 5e-3
    assert off(fine, exact) < own
    assert off(fine, exact) < 1e-3


def test_halving_the_mesh_cuts_the_error(skin):
    exact, coarse, fine = skin
    assert off(fine, exact) < off(coarse, exact) / 2.5


def test_a_wrong_load_or_layer_is_seen(skin):
    exact, _, fine = skin
    medium = body(estimate_input(load("embedded")).tissue)
    assert off(medium.response(UniformDisc(1.02 * DISC), OMEGA, RADII).u_z, fine) > 5e-3
    thinner = LayeredMedium([Layer(0.00147, *_rest(medium.layers[0])), *medium.layers[1:]], medium.half_space)
    assert off(thinner.response(UniformDisc(DISC), OMEGA, RADII).u_z, fine) > 3e-3
    assert off(fine, exact) < 1e-3


def _rest(layer):
    return layer.density, layer.youngs_modulus, layer.poisson_ratio, layer.damping


def test_a_static_column_is_exact():
    """A rigid punch over the whole of a block that cannot move sideways: u is linear, so one element is exact."""
    nu, e, h, r = 0.3, 1e5, 4e-3, 2e-3
    shear = complex(e / (2 * (1 + nu)))
    blocks = [fem.Block(0, r, -h, 0, fem.Solid(shear, nu, 1000.0))]
    found = fem.solve(blocks, 0.0, 1.0, radius=0.16, pressure_radius=r)
    # Free at the side, held at the floor: stiffer than a free bar, softer than a confined one.
    confined = h * (1 + nu) * (1 - 2 * nu) / (e * (1 - nu))
    assert confined < -found.at([0.0])[0].real < h / e


def test_incompressible_elements_do_not_lock():
    """nu = 0.49999 against 0.4999 on a clamped layer: displacement elements without the pressure would stiffen."""

    def centre(nu):
        solid = fem.Solid(complex(1e4), nu, 1000.0)
        layer = fem.Block(0, 0.16, -0.02, 0, solid)
        return -fem.solve([layer], 0.0, 2.0, radius=0.16, pressure_radius=DISC).at([0.0])[0]

    layered = LayeredMedium([Layer(0.02, 1000, 2e4 * 1.49999, 0.49999)], HalfSpace(1000, 1e14, 0.3))
    exact = layered.response(UniformDisc(DISC), 0.0, [0.0]).u_z[0]
    assert centre(0.49999) == pytest.approx(exact, rel=2e-3)
    assert centre(0.49999) == pytest.approx(centre(0.4999), rel=3e-3)


def test_unit_levels_converge():
    for name in (("embedded", "E10/D30"), ("encapsulating", "D10")):
        coarse, fine = (edge_level(unit_spec(*name), n)[0] for n in (1, 2))
        assert coarse == pytest.approx(fine, rel=1e-2)
        assert 0 < fine < 1.2
