"""The suite of signal chains: its records' truth, and its promises at a small size."""

import numpy as np
import pytest

from benchmarks.accuracy.synthetic_records import SCENARIOS, Scenario, synthetic


def test_a_record_has_the_amplitude_it_states():
    quiet = synthetic(Scenario("", snr=1e9), np.random.default_rng(1), 7.0, 125.0)
    assert np.sqrt(2) * quiet.x.std() == pytest.approx(7.0, rel=1e-3)
    noisy = synthetic(Scenario("", snr=10.0), np.random.default_rng(1), 7.0, 125.0)
    assert (noisy.x - quiet.x).std() == pytest.approx(0.7, rel=0.05)
    again = synthetic(SCENARIOS[-1], np.random.default_rng(2))
    assert np.array_equal(again.x, synthetic(SCENARIOS[-1], np.random.default_rng(2)).x)
