"""The uncertainty of a mean of correlated values, against the exact law of an autoregressive series."""

import numpy as np
import pytest
from scipy.signal import lfilter

from unitcad.lab.chains.line import of_mean


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.8])
def test_two_uncertainties_hold_the_mean_of_correlated_values(correlation):
    """The true mean is 0. Of 800 series 95 % should hold it; with a correlation of 0.8 and none assumed, 50 % do."""
    draws = np.random.default_rng(1).standard_normal((800, 150))
    series = lfilter([1.0], [1.0, -correlation], draws, axis=1)[:, 50:]
    held = [abs(one.mean()) <= 2 * of_mean(one, 0.0)[0] for one in series]
    assert 0.92 < np.mean(held) < 0.985
