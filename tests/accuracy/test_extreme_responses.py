"""Extreme media against the reference in ball arithmetic, and what the page promises of them."""

import numpy as np
import pytest

from benchmarks.accuracy import extreme_responses
from benchmarks.accuracy.ball_reference import TooHard
from benchmarks.accuracy.extreme_responses import Row, promises, rows
from benchmarks.accuracy.hankel import DISC, RADII
from unitcad.accuracy.random_media import CLASSES, Trial, trial
from unitcad.attenuation import HalfSpace, Layer, LayeredMedium
from unitcad.errors import UnitcadError

pytest.importorskip("flint")


@pytest.mark.long
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
    (response,) = rows([Trial("complex mode", "extreme", medium, DISC, 456.47726234772875, RADII)], (1e-6,))
    assert response.decided
    assert response.met
    assert response.over_bound <= 1


def test_the_media_have_every_class_and_load_the_same_from_their_seed():
    media = [trial(kind, seed) for kind in CLASSES for seed in range(6)]
    assert {one.load.direction for one in media} == {"normal", "tangential"}
    for one in media[::7]:
        again = trial(one.kind, int(one.name.split()[-1]))
        assert (one.medium.layers, one.load, one.omega) == (again.medium.layers, again.load, again.omega)
        assert np.array_equal(one.r, again.r)


def test_no_value_breaks_the_bound_and_no_reference_decides_nothing(monkeypatch):
    one = trial("ordinary", 1)

    def refused(*_, **__):
        raise UnitcadError("no finite answer")

    with monkeypatch.context() as patch:
        patch.setattr(LayeredMedium, "response", refused)
        (row,) = rows([one], (0.1,))
    assert not row.over_bound <= 1
    assert not row.met

    def hard(*_):
        raise TooHard("too many panels")

    monkeypatch.setattr(extreme_responses.ball_reference, "response", hard)
    (row,) = rows([one], (0.1,))
    assert not row.decided
    assert row.over_bound == 0


def test_what_is_promised_can_be_broken():
    good = [Row("a", "x", rtol, 0.1 * rtol, rtol, 1e-13, 0.1, 100) for rtol in (1e-3, 1e-6)]
    assert all(promise.ok for promise in promises(good, good))
    over = [Row("a", "x", 1e-3, 2e-3, 1e-3, 1e-13, 2.0, 100)]
    undecided = [Row("a", "x", 1e-3, 2e-3, 1e-3, 1e-3, 0.0, 100)]
    worse = [Row("a", "x", rtol, 0.0, bound, 1e-13, 0.0, 100) for rtol, bound in ((1e-5, 4e-6), (1e-9, 0.48))]
    stalled = [Row("a", "x", 1e-3, 0.0, 1e-3, 1e-13, 0.0, 100, seconds=61.0)]
    for at, bad in enumerate((over, undecided, stalled, worse)):
        assert [promise.ok for promise in promises(bad, bad)] == [i != at for i in range(4)]
