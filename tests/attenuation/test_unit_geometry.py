"""An estimate's geometry against the drawn bodies of the unit, whose boxes and volumes are worked out from shapes."""

import math

import pytest

from unitcad.attenuation.inputs import Quantity
from unitcad.designs import unit_bodies
from unitcad.estimate_inputs import estimate_input
from unitcad.kernels.mesh import bounds, realise
from unitcad.validation import load

SPECS = {
    "encapsulating": (),
    "embedded": (),
    "embedded filled": ("motor.fill=true",),
    "three-layer": (),
    "no-fpcb": (),
    "motor-10mm": (),
    "single-encapsulating": (),
}


def box(solid):
    """Return the largest x and z of a body, mm."""
    ends = bounds(solid)
    return ends[4], ends[5]


@pytest.mark.parametrize("name", SPECS)
def test_lengths_are_those_of_the_drawn_bodies(name):
    spec = load(name.split(" ")[0], list(SPECS[name]))
    geometry = estimate_input(spec).geometry
    solids = {body.name: realise(body.shape, 128) for body in unit_bodies(spec)}
    for i, layer in enumerate(geometry.layers):
        assert (layer.outer_radius * 1e3, layer.top * 1e3) == pytest.approx(box(solids[f"layer{i + 1}"]), abs=0.02)
    motor = (geometry.motor_radius * 1e3, geometry.motor_height * 1e3)
    assert motor == pytest.approx(box(solids["motor"]), abs=0.02)
    assert (geometry.pad is not None) == ("fpcb" in solids)
    assert (geometry.gap == 0) == spec.motor.fill
    drawn = sum(solids[f"layer{i + 1}"].volume() for i in range(len(geometry.layers)))
    assert volume(geometry) * 1e9 == pytest.approx(drawn, rel=0.03)  # the exit of tail or wires is not in it


def volume(geometry):
    """Return the silicone's volume, m3: the outermost layer's cylinder less cavity."""
    cavity = math.pi * geometry.cavity_radius**2 * geometry.core_height
    closed = sum(layer.cap for layer in geometry.layers)
    assert geometry.layers[-1].top == pytest.approx(geometry.core_height + closed, rel=1e-12)
    return math.pi * geometry.layers[-1].outer_radius ** 2 * geometry.layers[-1].top - cavity


def test_the_motor_s_mass_is_a_range_and_says_that_it_is_assumed():
    mass = estimate_input(load("encapsulating")).geometry.motor_mass
    assert isinstance(mass, Quantity)
    assert mass.low is not None
    assert mass.high is not None
    assert mass.low < mass.middle < mass.high
    assert mass.middle == pytest.approx(5e3 * math.pi * 3.5e-3**2 * 2e-3)
    assert "assumed" in mass.note
