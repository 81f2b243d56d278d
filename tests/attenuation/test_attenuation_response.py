"""Displacements: exact identities and shapes."""

from dataclasses import replace

import numpy as np
import pytest

from unitcad.attenuation import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.curve import layered_block
from unitcad.attenuation.edge.estimates import estimate
from unitcad.attenuation.edge.words import skin_lines
from unitcad.attenuation.layered import KelvinVoigt, LossFactor, UniformDisc
from unitcad.estimate_inputs import estimate_input
from unitcad.validation import load

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


def test_a_response_that_misses_its_accuracy_says_so():
    """Without damping rounding leaves 1e-10 of the largest motion, so 1e-12 can't be reached; 1e-6 can."""
    missed, reached = (forearm(damped=False).response(UniformDisc(A), OMEGA, RADII, rtol) for rtol in (1e-12, 1e-6))
    assert (missed.rtol, missed.reached) == (1e-12, False)
    assert missed.error > 1e-12 * missed.largest
    assert f"may be {missed.error / missed.largest:.2g} of the largest motion, 1e-12 was wanted" in missed.shortfall
    assert (reached.reached, reached.shortfall) == (True, "")


def test_the_estimate_prints_a_missed_accuracy(monkeypatch):
    variant, solve = estimate_input(load("encapsulating")), LayeredMedium.response
    fine = layered_block(variant)
    assert (fine["rtol"], fine["not_reached"]) == (1e-4, [])
    assert not any("does not reach" in line for line in skin_lines(fine))

    def poor(*arguments, **keywords):
        found = solve(*arguments, **keywords)
        return replace(found, error_z=found.error_z + 0.02 * found.largest)

    monkeypatch.setattr(LayeredMedium, "response", poor)
    block = layered_block(variant)
    assert block["not_reached"][0].startswith(
        "flat drive, nominal: the error may be 0.02 of the largest motion, 0.0001"
    )
    assert len(block["not_reached"]) == 2 * 9
    (told,) = (line for line in skin_lines(block) if "does not reach" in line)
    assert block["not_reached"][0] in told
    data = estimate(variant, layered=lambda _: block)
    assert told in data["answer"]["details"]
