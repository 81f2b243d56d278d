"""Extreme media against the reference in ball arithmetic, and what the page promises of them."""

import numpy as np
import pytest

from unitcad.accuracy.extreme_responses import Row, cases, promises, rows, survey
from unitcad.accuracy.hankel import DISC, RADII
from unitcad.accuracy.random_media import CLASSES, Trial
from unitcad.attenuation import HalfSpace, Layer, LayeredMedium

pytest.importorskip("flint")


def test_a_complex_modes_pole_below_the_path():
    """40 % off at an estimate of 5e-8, while the path was as high as the Bessel functions allow."""
    medium = LayeredMedium(
        [
            Layer(5.485582740341288e-05, 997.9955422720587, 642216.4812960139, 0.0),
            Layer(0.0006904136665678724, 1506.152869248031, 6373.400863545326, 0.45),
            Layer(0.0006623084930159557, 1414.167893410191, 60640.50956886164, 0.4999999),
            Layer(0.009749349858037984, 991.7836678098779, 7388.897504837705, 0.45),
        ],
        HalfSpace(1577.8305940170262, 14700304.505067958, 0.45),
    )
    (response,) = rows([Trial("complex mode", "extreme", medium, DISC, 456.47726234772875, RADII, 0.0)], (1e-6,))
    assert response.decided
    assert response.met
    assert response.over_bound <= 1


def test_films_and_contrast_of_the_page():
    responses = list(rows([cases()[0], cases()[-1]], (1e-3, 1e-6)))
    assert all(row.decided and row.met and row.over_bound <= 1 for row in responses)


def test_the_survey_has_every_class_the_same_from_its_seed():
    one, other = survey(2), survey(2)
    assert {trial.kind for trial in one} == set(CLASSES)
    assert len({type(trial.load).__name__ + trial.load.direction for trial in survey(6)}) == 4
    assert any(trial.z > 0 for trial in survey(6))
    for a, b in zip(one, other, strict=True):
        assert (a.medium.layers, a.load, a.omega, a.z) == (b.medium.layers, b.load, b.omega, b.z)
        assert np.array_equal(a.r, b.r)


def test_what_is_promised_can_be_broken():
    good = [Row("a", "x", rtol, 0.1 * rtol, rtol, 1e-13, 0.1, 100) for rtol in (1e-3, 1e-6)]
    assert all(promise.ok for promise in promises(good, good))
    over = [Row("a", "x", 1e-3, 2e-3, 1e-3, 1e-13, 2.0, 100)]
    undecided = [Row("a", "x", 1e-3, 2e-3, 1e-3, 1e-3, 0.0, 100)]
    worse = [Row("a", "x", rtol, 0.0, bound, 1e-13, 0.0, 100) for rtol, bound in ((1e-5, 4e-6), (1e-9, 0.48))]
    for at, bad in enumerate((over, undecided, worse)):
        assert [promise.ok for promise in promises(bad, bad)] == [i != at for i in range(3)]
