"""Displacements against closed forms, independent solvers, published figures and exact identities."""

import numpy as np
import pytest

from unitcad.attenuation import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.layered import KelvinVoigt, LossFactor, UniformDisc

A, OMEGA = 3.5e-3, 2 * np.pi * 125
RADII = np.geomspace(1e-4, 50e-3, 13)


def forearm(damped=True):
    def of(law):
        return law if damped else None

    return LayeredMedium(
        [
            Layer(1.5e-3, 1100, 130e3, 0.49, of(LossFactor(0.14))),
            Layer(4e-3, 950, 8970.0, 0.495, of(KelvinVoigt(3.0))),
            Layer(25e-3, 1050, 11960.0, 0.495, of(KelvinVoigt(4.5))),
        ],
        HalfSpace(1900, 15e9, 0.3, of(LossFactor(0.01))),
    )


def largest(response):
    return float(max(np.max(np.abs(response.u_z)), np.max(np.abs(response.u_r))))


def difference(one, other):
    return float(max(np.max(np.abs(one.u_z - other.u_z)), np.max(np.abs(one.u_r - other.u_r))))


def test_zero_thickness_changes_nothing_and_a_film_little():
    base = forearm()
    load = UniformDisc(A)
    bare = base.response(load, OMEGA, RADII, rtol=2e-6)
    changes = []
    for thickness in (0.0, 2e-9, 4e-9):
        coated = LayeredMedium([Layer(thickness, 1000, 1e7, 0.4), *base.layers], base.half_space)
        found = coated.response(load, OMEGA, RADII, rtol=2e-6)
        changes.append(difference(found, bare) / largest(bare))
    assert changes[0] == 0
    assert changes[2] == pytest.approx(2 * changes[1], rel=0.1)
    assert changes[2] < 1e-3


def test_published_static_layered_table():
    """European Commission, AMADEUS project (Belgian Road Research Centre 2000): strains by BISAR, KENLAYER and GAMES.

    Three layers bonded, 0.7 MPa on a disc of 150.8 mm; microstrain, compression positive: horizontal at the bottom of
    the first layer, vertical at the top of the second and of the third, at the centre and at the edge of the load.
    """
    medium = LayeredMedium([Layer(0.26, 2000, 5e9, 0.35), Layer(0.5, 2000, 2e8, 0.40)], HalfSpace(2000, 5e7, 0.45))
    a, step = 0.1508, 1e-3

    def vertical(z, r):
        top, lower = (medium.response(UniformDisc(a), 0.0, r, z=at, rtol=1e-11).u_z for at in (z, z + step))
        return float(0.7e6 * (top - lower).real / step * 1e6)

    def radial(z, r):
        sides = medium.response(UniformDisc(a), 0.0, [max(r - step, 0.0), r + step], z=z, rtol=1e-11).u_r
        return float(-0.7e6 * (sides[1] - sides[0]).real / (step + min(r, step)) * 1e6)

    published = {"centre": (-100.5, 251.65, 185.1), "edge": (-61.9, 192.2, 177.3)}
    for place, r in (("centre", 0.0), ("edge", a)):
        found = (radial(0.26 - 1e-9, r), vertical(0.26, r), vertical(0.76, r))
        assert found == pytest.approx(published[place], rel=4e-3), place


def test_shapes():
    medium, load = forearm(), UniformDisc(A)
    assert np.ndim(medium.response(load, OMEGA, 5e-3).u_z) == 0
    assert medium.response(load, OMEGA, [[1e-3, 2e-3]]).u_r.shape == (1, 2)
