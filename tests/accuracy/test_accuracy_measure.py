"""The suite of signal chains: its records' truth, and its promises at a small size."""

import numpy as np
import pytest

from benchmarks.accuracy import measure
from benchmarks.accuracy.synthetic_records import PLAIN, RATE, SCENARIOS, Scenario, synthetic


def test_a_record_has_the_amplitude_it_states():
    quiet = synthetic(Scenario("", snr=1e9), np.random.default_rng(1), 7.0, 125.0)
    assert np.sqrt(2) * quiet.x.std() == pytest.approx(7.0, rel=1e-3)
    noisy = synthetic(Scenario("", snr=10.0), np.random.default_rng(1), 7.0, 125.0)
    assert (noisy.x - quiet.x).std() == pytest.approx(0.7, rel=0.05)
    again = synthetic(SCENARIOS[-1], np.random.default_rng(2))
    assert np.array_equal(again.x, synthetic(SCENARIOS[-1], np.random.default_rng(2)).x)


def test_the_suite_keeps_its_promises(monkeypatch):
    monkeypatch.setattr(measure, "QUICK_TRIALS", 12)
    monkeypatch.setattr(measure, "SCENARIOS", (PLAIN,))
    result = measure.run(True, lambda stage: None)
    by_chain = {row[0]: row for row in result.tables[0].rows}
    assert by_chain["line"][1] < 0.2
    assert by_chain["bandpass, zero-phase, RMS, trimmed"][3] < -30
    assert by_chain["FFT peak, rectangular window"][2] > 10
    assert {promise.what: promise.ok for promise in result.promises}["bandpass: gain at 100 Hz"]
    assert RATE == 2000.0
