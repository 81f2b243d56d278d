"""Mains that a record can't tell from the line: what the motor-off record knows of them is used."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import least_squares

from unitcad.accuracy.synthetic_records import RATE, Scenario, synthetic
from unitcad.lab.chains.line import Mains, fit_line

TIME = np.arange(4000) / RATE


def prior_fit(x: np.ndarray, hz: float, part: float) -> float:
    """Return the amplitude's deviation by scipy's Levenberg-Marquardt, the mains' prior as two observations."""

    def left(p: np.ndarray) -> np.ndarray:
        size, phase, frequency, offset, *mains = p
        model = size * np.cos(2 * np.pi * frequency * TIME + phase) + offset
        for i, k in enumerate((2, 3)):
            turn = 2 * np.pi * 50 * k * TIME
            model = model + mains[2 * i] * np.cos(turn) + mains[2 * i + 1] * np.sin(turn)
        return np.concatenate([(x - model) * 30, np.array(mains) * np.sqrt(2) / part])

    angle = np.angle(np.sum(x * np.exp(-2j * np.pi * hz * TIME)))
    found = least_squares(left, [1.0, angle, hz, *[0.0] * 5], method="lm")
    return float(np.sqrt(np.linalg.inv(found.jac.T @ found.jac)[0, 0]))


def test_the_amplitude_is_as_good_as_that_of_a_fit_with_a_prior() -> None:
    """In units of that fit's deviation the errors have a root mean square of about 1."""
    part, errors = 0.03, []
    for hz in (100.08, 100.27, 149.65, 150.4):
        for seed in range(8):
            scenario = Scenario("mains", mains=(0.0, part, part))
            record = synthetic(scenario, np.random.default_rng([seed, 5]), 1.0, hz)
            fit = fit_line(record.x, RATE, mains=Mains(blank=((2, part), (3, part))))
            assert fit is not None
            deviation = prior_fit(record.x, hz, part)
            errors.append((fit.amplitude - record.amplitude) / deviation)
            assert fit.mains_hz == 50 * round(hz / 50)
            assert fit.u > 0.8 * deviation
            assert abs(fit.amplitude - record.amplitude) < 3.5 * fit.u
    assert np.sqrt(np.mean(np.square(errors))) < 1.3


@pytest.mark.parametrize("hz", [100.1, 100.3, 149.6])
def test_a_wandering_amplitude_is_not_taken_for_mains(hz: float) -> None:
    """A wander of 1 % and mains of 2 % look alike: the uncertainty holds the error."""
    part = 0.02
    scenario = Scenario("both", wander=0.01, mains=(0.0, part, part), drift=0.004, spin_up_s=0.05)
    for seed in range(12):
        record = synthetic(scenario, np.random.default_rng([seed, 6]), 1.0, hz)
        fit = fit_line(record.x, RATE, mains=Mains(blank=((2, part), (3, part))))
        assert fit is not None
        assert abs(fit.amplitude - record.amplitude) < 3.5 * fit.u


def test_without_a_motor_off_record_nothing_is_taken_away() -> None:
    record = synthetic(Scenario("mains", mains=(0.0, 0.03, 0.0)), np.random.default_rng(4), 1.0, 100.3)
    fit = fit_line(record.x, RATE)
    assert fit is not None
    assert (fit.mains_hz, fit.u_mains) == (100.0, 0.0)


def test_a_motors_phase_leaves_the_mains_less_room() -> None:
    """The motor's channel, without mains, gives the phase of the unit's line under mains."""
    rng = np.random.default_rng(2)
    x = np.cos(2 * np.pi * 100.25 * TIME + 0.4) + 0.03 * np.cos(2 * np.pi * 100 * TIME + 1.0)
    motor = fit_line(np.cos(2 * np.pi * 100.25 * TIME) + 0.01 * rng.standard_normal(4000), RATE)
    assert motor is not None
    span = (motor.start_s, motor.end_s)
    x = x + 0.01 * rng.standard_normal(4000)
    mains = Mains(blank=((2, 0.03),))
    fit = fit_line(x, RATE, mains=mains, phase=motor.phase, span=span)
    blind = fit_line(x, RATE, phase=motor.phase, span=span)
    assert fit is not None
    assert blind is not None
    assert abs(fit.amplitude - 1) < 3.5 * fit.u < 0.005
    assert abs(blind.amplitude - 1) > 0.005
