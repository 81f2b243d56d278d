"""One record: its line against exact answers and an independent fit, and the reasons to refuse or doubt it."""

import math
import re

import numpy as np
import pytest
from scipy.io import wavfile
from scipy.optimize import curve_fit
from scipy.signal import lfilter
from signals import RATE, TIME, noise, wave

from benchmarks.accuracy.synthetic_records import LENGTH_S, PLAIN, Scenario, synthetic
from unitcad.errors import Refusal
from unitcad.lab import bandpass
from unitcad.lab.campaign import Campaign, ChainTable, SensorTable, UnitTable
from unitcad.lab.line import DROP_OUT, clip_level, fit_line, of_mean
from unitcad.lab.record import measure_record

SENSOR = SensorTable(quantity="displacement", unit="um")


def turning(size, hertz):
    """A line of varying frequency in some noise."""
    return size * np.cos(2 * np.pi * np.cumsum(hertz) / RATE) + noise(2.0)


def record(folder, x, band=(60.0, 250.0), use=("line",)):
    wavfile.write(folder / "a.wav", RATE, x.astype("<f4"))
    campaign = Campaign(name="t", sensor=SENSOR, unit=(UnitTable(name="a"),), chain=ChainTable(use=use))
    return measure_record(folder / "a.wav", "edge", campaign, (SENSOR,), band, "a.wav")


def said(result):
    return {one.code: one.message for one in result.findings}


def severities(result):
    return {(one.code, one.severity) for one in result.findings}


def fitted(x, rate=RATE, **options):
    fit = fit_line(x, rate, **options)
    return fit


# The line of samples.


def test_a_line_without_noise_is_exact():
    x = wave(3.0, 123.4, 0.7) + wave(0.4, 246.8) + 5 + 0.1 * TIME + wave(0.8, 50) + wave(0.3, 150, 1)
    fit = fitted(x)
    assert fit.amplitude == pytest.approx(3.0, rel=1e-6)
    assert fit.frequency_hz == pytest.approx(123.4, rel=1e-6)
    assert (fit.masked, fit.second_hz, fit.mains_hz) == (0.0, 0.0, 0.0)
    assert math.isinf(clip_level(x))


def test_a_line_is_what_a_nonlinear_fit_gives():
    """scipy's Levenberg-Marquardt over amplitude, frequency, phase and offset shares no code with the chain."""
    x = synthetic(PLAIN, np.random.default_rng(3), 40.0, 131.7).x

    def model(t, a, hz, phase, offset):
        return a * np.cos(2 * np.pi * hz * t + phase) + offset

    fit = fitted(x)
    start = (fit.amplitude, fit.frequency_hz, float(fit.phase(np.zeros(1))[0] + np.angle(fit.value)), 0.0)
    values, covariance = curve_fit(model, TIME, x, start)
    assert fit.amplitude == pytest.approx(abs(values[0]), abs=0.2 * fit.u)
    assert 0.7 < fit.u / math.sqrt(covariance[0, 0]) < 2
    assert fit.frequency_hz == pytest.approx(values[1], abs=0.01)


@pytest.mark.parametrize("size", [0.1, 0.9])
@pytest.mark.parametrize("away", [-14.0, -3.0, 8.0])
def test_a_second_line_is_named_at_its_frequency(tmp_path, away, size):
    result = record(tmp_path, wave(100) + wave(100 * size, 121.3 + away, 1.0) + noise(3.0))
    frequency = float(re.search(r"about ([\d.]+) Hz", said(result)["L104"])[1])
    assert frequency == pytest.approx(121.3 + away, abs=0.5)
    assert not result.usable


@pytest.mark.parametrize("away", [0.3, 1.0, 2.0])
def test_a_slow_beat_of_two_lines_gives_no_level(tmp_path, away):
    """The phase follows it, so that it looks like a modulation."""
    result = record(tmp_path, wave(100) + wave(60, 121.3 + away, 1.0) + noise())
    assert ("L107", "error") in severities(result)


@pytest.mark.parametrize("size", [0.02, 0.5, 2.0])
def test_noise_makes_no_second_line(size):
    """Steady and wandering motors over 2 and 10 s."""
    for seed in range(6):
        time = np.arange((2 if seed % 2 else 10) * 1000) / 1000
        phase = 2 * np.pi * 122 * time + 3 * np.sin(2 * np.pi * 0.1 * (seed % 3) * time)
        x = np.cos(phase) + size * np.random.default_rng(seed).standard_normal(len(time))
        assert fitted(x, 1000.0).second_hz == 0.0


def test_one_drifting_line_is_not_several():
    for seed in range(5):
        scenario = Scenario("drift and wander", drift=0.03, wander=0.02, spin_up_s=0.05)
        made = synthetic(scenario, np.random.default_rng(seed), 1.0, 120.0 + 5 * seed)
        fit = fitted(made.x)
        assert fit.second_hz == 0.0
        assert fit.drift == pytest.approx(0.03 * (1 - 0.5 / LENGTH_S), rel=0.35)
        assert fit.amplitude == pytest.approx(made.amplitude, rel=0.01)


def test_mains_beside_the_line_are_named():
    made = synthetic(Scenario("mains", mains=(0.0, 0.05, 0.0)), np.random.default_rng(4), 1.0, 100.01)
    assert fitted(made.x).mains_hz == 100.0
    assert fitted(synthetic(PLAIN, np.random.default_rng(4), 1.0, 103.0).x).mains_hz == 0.0


@pytest.mark.parametrize("level", [0.95, 0.5])
def test_clipping_is_seen_and_its_level_is_told(level):
    x = synthetic(Scenario("clip", clip=level), np.random.default_rng(6), 2.0, 127.0).x
    assert clip_level(x) == pytest.approx(level, rel=0.06)


@pytest.mark.parametrize("bits", [8, 16])
def test_a_converters_steps_are_no_clipping(bits):
    step = 2.0 ** (1 - bits) / 0.9
    x = np.round(wave(1.0, 125.3) / step) * step
    assert math.isinf(clip_level(x))
    assert fitted(x).amplitude == pytest.approx(1.0, abs=step)


@pytest.mark.parametrize("value", [3.0, np.nan])
def test_a_record_without_a_line_has_none(value):
    assert fit_line(np.full(4000, value), RATE) is None


def test_noise_alone_is_called_a_drop_out_in_one_record_of_a_thousand_at_most():
    rng = np.random.default_rng(5)
    for count in (200, 4000):
        x = np.abs(rng.standard_normal((2000, count)))
        assert np.sum(x.max(axis=1) > DROP_OUT * 1.4826 * np.median(x, axis=1)) <= 2


@pytest.mark.parametrize("hz", [100.0, 101.0, 117.0])
def test_the_papers_chain_has_the_gain_that_it_states(hz, monkeypatch):
    """A long steady line through the filters themselves, not through their frequency response."""
    monkeypatch.setattr(bandpass, "TRIM_S", 4.0)
    found = bandpass.amplitude(2.0 * np.cos(2 * np.pi * hz * np.arange(20000) / RATE + 0.3), RATE)
    assert found == pytest.approx(2.0 * bandpass.gain(hz), abs=2e-4)
    assert (bandpass.gain(hz) < 1e-6) == (hz == 100.0)


@pytest.mark.parametrize(("length", "fit"), [(1190, False), (1210, True)])
def test_a_record_that_is_too_short_for_the_papers_chain_is_said(tmp_path, length, fit):
    result = record(tmp_path, wave(100, 121.3)[:length], use=("bandpass",))
    assert ("L114" in said(result)) != fit
    assert ("bandpass" in result.by_chain) == fit


@pytest.mark.parametrize(("start", "end"), [(0.95, 2.1), (0.0, 0.9), (0.5, 1.4), (1.7, 2.1), (0.6, 2.1), (0.3, 1.8)])
@pytest.mark.parametrize("size", [0.01, 3.0])
def test_a_motor_that_runs_for_a_part_is_measured_there_or_not_used(tmp_path, start, end, size):
    running = (start <= TIME) & (end > TIME)
    result = record(tmp_path, np.where(running, wave(40.0, 123.4), 0.0) + noise(size) + wave(5, 50))
    if running.mean() > 0.5:
        assert result.usable
    if result.usable:
        assert result.amplitude_um == pytest.approx(40.0, rel=0.005)
    else:
        assert {"L110", "L111"} & set(said(result))


# The findings.


@pytest.mark.parametrize("rail", [1, -1])
@pytest.mark.parametrize("at", [60.0, 5.0, 0.0, -80.0])
def test_a_clip_at_one_rail_is_clipping_and_nothing_else(tmp_path, rail, at):
    """Down to a rail beyond the line's middle: more than half of the samples then lie on the plateau."""
    result = record(tmp_path, 7.0 + rail * np.minimum(wave(100) + noise(), at))
    assert severities(result) == {("L101", "error")}
    assert not result.usable


@pytest.mark.parametrize("size", [0.12, 0.3])
@pytest.mark.parametrize("hz", [0.6, 2.5, 9.0])
def test_a_slow_modulation_is_unsteady_and_one_line(tmp_path, hz, size):
    """Two equal lines to either side of one are one amplitude that goes up and down."""
    result = record(tmp_path, (1 + wave(size, hz, 0.4)) * wave(100) + noise())
    assert f"amplitude varies by {'2' if size == 0.3 else '8'}" in said(result)["L107"]  # over the root of 2
    assert severities(result) == {("L107", "warning")}
    assert result.amplitude_um == pytest.approx(100.0, abs=max(3 * result.u_um, 1.0))


@pytest.mark.parametrize(
    ("ratio", "found"), [(12.0, set()), (7.0, {("L118", "warning")}), (1.0, {("L118", "warning")})]
)
def test_a_low_signal_to_noise_is_said(tmp_path, ratio, found):
    result = record(tmp_path, wave(10) + noise(10 / ratio))
    assert severities(result) == found
    assert result.usable


@pytest.mark.parametrize(("first", "last"), [(115.0, 139.0), (139.0, 115.0)])
@pytest.mark.parametrize("order", [0, 1])
def test_a_sweep_is_unsteady_and_only_its_steady_part_is_used(tmp_path, first, last, order):
    """A velocity's amplitude rises with the frequency, too."""
    hertz = first + (last - first) * TIME / 2
    result = record(tmp_path, turning(100 * (hertz / first) ** order, hertz))
    used = f"steady for {result.steady_s:.2f} s of 2.00 s; only that part was used"
    if first < last:
        assert [one.message for one in result.findings if one.code == "L107"].count(used) == 1
    assert "L107" in said(result)
    assert result.as_dict()["length_s"] == 2.0


@pytest.mark.parametrize("constant", [0.03, 0.2])
@pytest.mark.parametrize("order", [0, 2])
def test_a_spin_up_is_cut_and_nothing_is_wrong(tmp_path, constant, order):
    """A motor's speed approaches its own exponentially; the amplitude with its power, by the quantity."""
    hertz = 125 * (1 - np.exp(-TIME / constant))
    phase = 2 * np.pi * 125 * (TIME + constant * np.exp(-TIME / constant))
    result = record(tmp_path, 100 * (hertz / 125) ** order * np.cos(phase) + noise(2.0))
    assert "L107" not in said(result)
    assert 1.0 < result.steady_s < 1.9
    assert result.amplitude_um == pytest.approx(100.0, rel=0.01)


@pytest.mark.parametrize(("part", "severity"), [(0.005, "warning"), (0.6, "error")])
def test_missing_samples_are_counted_and_named(tmp_path, part, severity):
    x = wave(100, 127.3) + noise(2.0)
    x[np.random.default_rng(1).permutation(len(x))[: round(part * len(x))]] = np.nan
    result = record(tmp_path, x, use=("line", "bandpass"))
    assert ("L119", severity) in severities(result)
    assert said(result)["L119"].startswith(f"{round(part * len(x))} of 4000 samples")
    assert result.usable == (severity == "warning")
    if result.usable:
        assert "missing" in said(result)["L114"]
        assert result.amplitude_um == pytest.approx(100.0, abs=3 * result.u_um)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("count", [2, 3])
def test_a_record_of_few_samples_has_no_line_and_no_warning(tmp_path, count):
    assert set(said(record(tmp_path, wave(100, 127.3)[:count]))) == {"L111"}


def test_a_record_of_more_than_a_minute_is_refused(tmp_path):
    with pytest.raises(Refusal, match=r"a\.wav: lasts 62 s; cut the record to 60 s or less"):
        record(tmp_path, np.zeros(62 * RATE))


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.8])
def test_two_uncertainties_hold_the_mean_of_correlated_values(correlation):
    """The true mean is 0. Of 800 series 95 % should hold it; with a correlation of 0.8 and none assumed, 50 % do."""
    draws = np.random.default_rng(1).standard_normal((800, 150))
    series = lfilter([1.0], [1.0, -correlation], draws, axis=1)[:, 50:]
    held = [abs(one.mean()) <= 2 * of_mean(one, 0.0)[0] for one in series]
    assert 0.92 < np.mean(held) < 0.985


ODD = {
    "whole": lambda x, rng: x,
    "rounded": lambda x, rng: np.round(x),
    "cut off": lambda x, rng: np.maximum(x, -np.quantile(np.abs(x), 0.8)),
    "gaps": lambda x, rng: np.where(rng.random(len(x)) < rng.uniform(0, 0.9), np.nan, x),
    "a gap": lambda x, rng: np.where(np.arange(len(x)) / len(x) < rng.uniform(0, 0.9), np.nan, x),
    "drop-outs": lambda x, rng: np.where(rng.random(len(x)) < 0.3 * rng.random(), 1e9, x),
    "stuck": lambda x, rng: np.where(np.arange(len(x)) / len(x) < 0.3, x, x[0]),
}


@pytest.mark.parametrize("change", ODD)
def test_no_signal_ends_in_an_error(change):
    """Pieces of lines, noise, mains and offset of any size and length."""
    for seed in range(12):
        rng = np.random.default_rng([seed, 150])
        rate = float(rng.choice([300, 500, 1000, 2000]))
        time = np.arange(max(int(np.exp(rng.uniform(-3, 1.6)) * rate), 20)) / rate
        x = 10 ** rng.uniform(-6, 2) * rng.standard_normal(len(time)) + rng.uniform(-100, 100) * rng.choice([0, 1])
        for hertz in (50.0, *rng.uniform(30, 300, rng.integers(0, 4))):
            start, end = sorted(rng.uniform(-0.5, 1.5, 2) * time[-1])
            x += 10 ** rng.uniform(-3, 3) * ((time >= start) & (time <= end)) * np.sin(2 * np.pi * hertz * time)
        fit = fit_line(ODD[change](x, rng), rate)
        assert fit is None or np.isfinite([fit.amplitude, fit.u, fit.frequency_hz, fit.drift]).all()
