"""One radial curve in place of a response for each distance: against the solver at every radius, near a load too."""

import numpy as np
import pytest

from unitcad.attenuation import HalfSpace, KelvinVoigt, LayeredMedium, UniformDisc
from unitcad.attenuation.curve import decay
from unitcad.attenuation.inputs import tissue_medium
from unitcad.attenuation.layered import MOST_SOLVED, components
from unitcad.estimate_inputs import estimate_input
from unitcad.validation import load

UNIT = estimate_input(load("encapsulating"))
FOREARM = tissue_medium(UNIT.tissue)
SOFT = LayeredMedium([], HalfSpace(1000, 4e3, 0.49, KelvinVoigt(0.5)))


@pytest.mark.parametrize("medium", [FOREARM, SOFT], ids=["forearm", "soft gel"])
@pytest.mark.parametrize(("direction", "hertz"), [("normal", 300), ("tangential", 125)])
def test_a_curve_is_the_solver_at_every_radius(medium, direction, hertz):
    a = 3.5e-3
    r = np.random.default_rng(3).uniform(a, 0.2, 900)
    r[:6] = 0.0, a, a + 1e-6, a + 1e-4, a + 2e-4, a / 2
    load, omega = UniformDisc(a, direction), 2 * np.pi * hertz
    assert r.size > MOST_SOLVED
    found = components(medium, load, omega, r, 1e-5)
    alone = [medium.response(load, omega, part, rtol=1e-5) for part in np.array_split(r, 6)]
    direct = np.array([np.concatenate([getattr(one, u) for one in alone]) for u in ("u_r", "u_theta", "u_z")])
    assert np.max(np.abs(found - direct)) < 5e-4 * np.max(np.abs(direct))


def test_few_radii_are_the_solver_itself_in_their_shape():
    r = np.array([[0.02, 0.01], [0.01, 0.05]])
    found = components(FOREARM, UniformDisc(3.5e-3), 800.0, r, 1e-3)
    direct = FOREARM.response(UniformDisc(3.5e-3), 800.0, np.array([0.01, 0.02, 0.05]), rtol=1e-3)
    assert found.shape == (3, 2, 2)
    np.testing.assert_array_equal(found[2], direct.u_z[[[1, 0], [0, 2]]])


@pytest.mark.parametrize("drive", ["flat", "axial"])
def test_decay_of_many_distances_is_that_of_each_alone(drive):
    r = np.random.default_rng(4).uniform(7e-3, 0.3, (30, 20))
    whole = decay(UNIT, r, drive, 250.0)
    rows = np.array([decay(UNIT, row, drive, 250.0) for row in r])  # type: ignore[arg-type]
    assert np.max(np.abs(whole - rows)) < 5e-4
    assert decay(UNIT, np.array([7e-3]), drive, 250.0)[0] == pytest.approx(1.0)
