"""Signal chains against exact answers, an independent fit, and records that a chain must not be fooled by."""

import math

import numpy as np
import pytest
from scipy.optimize import curve_fit
from scipy.stats import ttest_ind, ttest_rel

from benchmarks.accuracy.synthetic_records import LENGTH_S, PLAIN, RATE, Scenario, synthetic
from unitcad.errors import Refusal
from unitcad.lab.chains import ChainTable, bandpass
from unitcad.lab.chains.line import Mains, fit_line
from unitcad.lab.measuring import level

TIME = np.arange(4000) / RATE


def fitted(x, rate=RATE, **options):
    fit = fit_line(x, rate, **options)  # type: ignore[arg-type]
    assert fit is not None
    return fit


def test_a_line_without_noise_is_exact():
    x = 3.0 * np.cos(2 * np.pi * 123.4 * TIME + 0.7) + 0.4 * np.cos(2 * np.pi * 246.8 * TIME) + 5 + 0.1 * TIME
    x += 0.8 * np.cos(2 * np.pi * 50 * TIME) + 0.3 * np.cos(2 * np.pi * 150 * TIME + 1)
    fit = fitted(x)
    assert fit.amplitude == pytest.approx(3.0, rel=1e-6)
    assert fit.frequency_hz == pytest.approx(123.4, rel=1e-6)
    assert (fit.masked, fit.lines, fit.mains_hz) == (0.0, (), 0.0)
    assert math.isinf(fit.clipped)


def test_a_line_is_what_a_nonlinear_fit_gives():
    """scipy's Levenberg-Marquardt over amplitude, frequency, phase and offset shares no code with the chain."""
    record = synthetic(PLAIN, np.random.default_rng(3), 40.0, 131.7)

    def model(t, a, hz, phase, offset):
        return a * np.cos(2 * np.pi * hz * t + phase) + offset

    fit = fitted(record.x)
    assert fit.phase is not None
    start = (fit.amplitude, fit.frequency_hz, float(fit.phase.at(np.zeros(1))[0] + np.angle(fit.value)), 0.0)
    values, covariance = curve_fit(model, TIME, record.x, start)
    assert fit.amplitude == pytest.approx(abs(values[0]), abs=0.2 * fit.u)
    assert 0.7 < fit.u / math.sqrt(covariance[0, 0]) < 2
    assert fit.frequency_hz == pytest.approx(values[1], abs=0.01)


def test_three_lines_within_two_hertz_are_three():
    """Lines as close as in a real record of 11.5 s in acceleration, at 3.2 kHz: synthesised."""
    rate, rng = 3200.0, np.random.default_rng(8)
    time = np.arange(round(11.5 * rate)) / rate
    truth = {121.3: 1.0, 122.1: 0.7, 122.9: 0.45}
    x = sum(a * np.cos(2 * np.pi * hz * time + k) for k, (hz, a) in enumerate(truth.items()))
    fit = fitted(x + 0.05 * rng.standard_normal(len(time)), rate)
    assert [one.frequency_hz for one in fit.lines] == pytest.approx(list(truth), abs=0.005)
    assert [one.amplitude for one in fit.lines] == pytest.approx(list(truth.values()), abs=0.01)


@pytest.mark.parametrize("noise", [0.02, 0.2, 0.5])
@pytest.mark.parametrize("seed", range(3))
def test_lines_in_noise_are_named_each_at_its_frequency(noise, seed):
    """A single line of varying phase follows their beat, and noise hides that it leaves more than three lines do."""
    rng, rate = np.random.default_rng(seed), 1000.0
    time = np.arange(20_000) / rate
    truth = {121.70: 0.4, 122.77: 0.2, 123.26: 0.3}
    x = sum(a * np.cos(2 * np.pi * hz * time + rng.uniform(0, 6)) for hz, a in truth.items())
    fit = fitted(x + 0.4 * noise * rng.standard_normal(len(time)), rate)
    assert sorted(one.frequency_hz for one in fit.lines) == pytest.approx(sorted(truth), abs=0.02)


@pytest.mark.parametrize("noise", [0.02, 0.5, 2.0])
def test_noise_makes_no_second_line(noise):
    """Steady, wandering and drifting motors over 2 and 20 s."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        time = np.arange((2 if seed % 2 else 20) * 1000) / 1000
        phase = 2 * np.pi * 122 * time + 3 * np.sin(2 * np.pi * 0.1 * (seed % 3) * time)
        assert fitted(np.cos(phase) + noise * rng.standard_normal(len(time)), 1000.0).lines == ()


def test_one_drifting_line_is_not_several():
    for seed in range(5):
        scenario = Scenario("drift and wander", drift=0.03, wander=0.02, spin_up_s=0.05)
        record = synthetic(scenario, np.random.default_rng(seed), 1.0, 120.0 + 5 * seed)
        fit = fitted(record.x)
        assert fit.lines == ()
        assert fit.drift == pytest.approx(0.03 * (1 - 0.5 / LENGTH_S), rel=0.35)
        assert fit.amplitude == pytest.approx(record.amplitude, rel=0.01)


def test_a_motor_on_the_same_clock_takes_the_wander_out_of_the_ratio():
    """Both channels wander together: their ratio is far better known than either amplitude's mean."""
    motor = synthetic(Scenario("wander", wander=0.05, drift=0.01), np.random.default_rng(1), 300.0, 127.0)
    rng = np.random.default_rng(2)
    edge = 0.4 * np.roll(motor.x, 1) + 0.5 * rng.standard_normal(len(motor.x))
    first = fitted(motor.x)
    assert first.phase is not None
    second = fitted(edge, phase=first.phase, span=(first.start_s, first.end_s))
    assert abs(second.value / first.value) == pytest.approx(0.4, rel=3e-4)
    lag = np.angle(second.value / first.value)
    assert lag == pytest.approx(-2 * np.pi * 127.0 / RATE, abs=0.01)


def test_mains_beside_the_line_are_in_the_uncertainty():
    record = synthetic(Scenario("mains", mains=(0.0, 0.05, 0.0)), np.random.default_rng(4), 1.0, 100.01)
    alone, known = fitted(record.x), fitted(record.x, mains=Mains(blank=((2, 0.05),)))
    assert alone.mains_hz == known.mains_hz == 100.0
    assert known.u_mains == pytest.approx(0.05 / math.sqrt(2), rel=0.03)
    assert abs(known.amplitude - record.amplitude) < 2 * known.u
    assert fitted(synthetic(PLAIN, np.random.default_rng(4), 1.0, 103.0).x).mains_hz == 0.0


@pytest.mark.parametrize("level_", [0.95, 0.8, 0.5])
def test_clipping_is_seen_and_its_level_is_told(level_):
    record = synthetic(Scenario("clip", clip=level_), np.random.default_rng(6), 2.0, 127.0)
    assert fitted(record.x).clipped == pytest.approx(level_, rel=0.06)


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_a_converters_steps_are_no_clipping(bits):
    step = 2.0 ** (1 - bits) / 0.9
    x = np.round(np.cos(2 * np.pi * 125.3 * TIME) / step) * step
    fit = fitted(x)
    assert math.isinf(fit.clipped)
    assert fit.amplitude == pytest.approx(1.0, abs=step)


def test_a_record_without_a_line_has_none():
    assert fit_line(np.zeros(4000), RATE) is None
    assert fit_line(np.full(4000, 3.0), RATE) is None
    assert fit_line(np.full(4000, np.nan), RATE) is None


@pytest.mark.parametrize("zero_phase", [True, False])
@pytest.mark.parametrize("hz", [100.0, 101.0, 117.0, 150.0])
def test_the_papers_chain_has_the_gain_that_it_states(zero_phase, hz):
    """A long steady line through the filters themselves, not through their frequency response."""
    chain = ChainTable(zero_phase=zero_phase, trim_s=4.0)
    time = np.arange(20000) / RATE
    found = bandpass.amplitude(chain, 2.0 * np.cos(2 * np.pi * hz * time + 0.3), RATE)
    assert found == pytest.approx(2.0 * bandpass.gain(chain, hz), abs=2e-4)
    assert (bandpass.gain(chain, hz) < 1e-6) == (hz in (100.0, 150.0))


def test_a_levels_interval_is_welchs():
    """scipy's Welch test of the same logarithms."""
    edge, motor = [41.0, 44.0, 40.5, 43.1], [101.0, 98.0, 105.0]
    found = level(edge, motor)
    welch = ttest_ind(np.log(edge), np.log(motor), equal_var=False).confidence_interval(0.95)
    assert (found.low, found.high) == pytest.approx((math.exp(welch.low), math.exp(welch.high)), rel=1e-9)
    assert found.repeats == (4, 3)
    pairs = level([a / b for a, b in zip(edge, motor, strict=False)])
    paired = ttest_rel(np.log(edge[:3]), np.log(motor)).confidence_interval(0.95)
    assert (pairs.low, pairs.high) == pytest.approx((math.exp(paired.low), math.exp(paired.high)), rel=1e-9)
    assert level(edge, motor, shared=0.1).high > found.high
    with pytest.raises(Refusal, match="3 or more"):
        level(edge, motor[:2])
