"""Displacements: exact identities and shapes."""

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


def test_shapes():
    medium, load = forearm(), UniformDisc(A)
    assert np.ndim(medium.response(load, OMEGA, 5e-3).u_z) == 0
    assert medium.response(load, OMEGA, [[1e-3, 2e-3]]).u_r.shape == (1, 2)
