"""Records in which the motor runs for a short part, and records that are hardly records at all."""

import numpy as np
import pytest
from scipy.io import wavfile

from unitcad.lab.campaign import Campaign, SensorTable
from unitcad.lab.chains.line import Mains, fit_line, running_part
from unitcad.lab.record import measure_record
from unitcad.spec.convert import convert

RATE = 2000
TIME = np.arange(2 * RATE) / RATE
SENSOR = SensorTable(quantity="displacement", unit="um")


def gated(size, start, end, noise, seed=1):
    wave = np.where((start <= TIME) & (end > TIME), size * np.sin(2 * np.pi * 123.4 * TIME), 0.0)
    return wave + noise * np.random.default_rng(seed).standard_normal(len(TIME))


def record(folder, channels):
    wavfile.write(folder / "a.wav", RATE, np.column_stack(channels).astype("<f4"))
    paired = {"recording": {"channel": 1, "motor_channel": 2}} if len(channels) > 1 else {}
    data = {"name": "t", "sensor": {"quantity": "displacement", "unit": "um"}, "unit": [{"name": "a"}], **paired}
    campaign = convert(data, Campaign)
    sensors = (SENSOR,) * len(channels)
    return measure_record(
        folder / "a.wav", "edge", campaign, sensors, (Mains(),) * len(channels), (60.0, 250.0), "a.wav"
    )


@pytest.mark.parametrize(
    ("start", "end"), [(0.95, 2.1), (1.1, 2.1), (1.5, 2.1), (0.0, 0.9), (0.5, 1.4), (0.9, 1.3), (1.7, 2.1)]
)
@pytest.mark.parametrize("noise", [0.01, 1.0, 3.0])
def test_a_motor_that_runs_for_less_than_half_is_measured(tmp_path, start, end, noise):
    hum = 5 * np.sin(2 * np.pi * 50 * TIME)
    result = record(tmp_path, [gated(40.0, start, end, noise) + hum])
    assert result.usable
    assert abs(result.amplitude_um - 40.0) < max(4 * result.u_um, 0.002 * 40)
    assert result.frequency_hz == pytest.approx(123.4, abs=0.2)
    assert min(end, 2.0) - start - 0.2 < result.steady_s < min(end, 2.0) - start + 0.05
    codes = {one.code: one.message for one in result.findings}
    assert set(codes) <= {"L107", "L108", "L105"}
    if result.steady_s < 1:
        assert "only that part was used" in codes["L107"]


def test_pulses_are_measured_in_the_longest(tmp_path):
    x = gated(40.0, 0.1, 0.4, 0.5) + gated(40.0, 1.0, 1.5, 0.5)
    result = record(tmp_path, [x])
    assert result.amplitude_um == pytest.approx(40.0, rel=0.01)
    assert 0.35 < result.steady_s < 0.55


def test_beats_and_sweeps_are_no_silence():
    """Two lines 0.2 Hz apart fade in and out; a motor that speeds up leaves its first frequency."""
    time = np.arange(10 * RATE) / RATE
    beat = 40 * np.sin(2 * np.pi * 125 * time) + 38 * np.sin(2 * np.pi * 125.2 * time + 1)
    found = fit_line(beat, RATE)
    assert found is not None
    assert len(found.lines) == 2
    for rise in (2, 5, 12, 25):
        sweep = 40 * np.sin(2 * np.pi * (115 * TIME + rise * TIME**2))
        assert running_part(sweep, np.ones(len(sweep), bool), RATE, (60.0, 250.0), 50.0) is None


def odd_signal(seed):
    """Up to three pieces of lines, noise, mains and offset of any size; rounded, cut off, with gaps or drop-outs."""
    rng = np.random.default_rng(seed)
    rate = float(rng.choice([300, 500, 1000, 2000]))
    length = np.exp(rng.uniform(np.log(0.05), np.log(5)))
    time = np.arange(max(int(length * rate), 20)) / rate
    x = np.zeros(len(time))
    for _ in range(int(rng.integers(0, 4))):
        start, end = sorted(rng.uniform(-0.5 * length, 1.5 * length, 2))
        inside = (time >= start) & (time <= end)
        x += 10 ** rng.uniform(-3, 3) * inside * np.sin(2 * np.pi * rng.uniform(30, 300) * time + rng.uniform(0, 6))
    x += 10 ** rng.uniform(-6, 2) * rng.standard_normal(len(x)) * rng.choice([0, 1])
    x += 10 ** rng.uniform(-6, 2) * np.sin(2 * np.pi * 50 * time) * rng.choice([0, 1])
    x += rng.uniform(-100, 100) * rng.choice([0, 1])
    match rng.integers(0, 8):
        case 1:
            x = np.round(x)
        case 2:
            x = np.maximum(x, -np.quantile(np.abs(x), 0.8))
        case 3:
            x[rng.random(len(x)) < rng.uniform(0, 0.9)] = np.nan
        case 4:
            x[(first := rng.integers(0, len(x))) : first + int(len(x) * rng.uniform(0, 0.9))] = np.nan
        case 5:
            x[rng.integers(0, len(x), 5)] = 1e9
        case 6:
            x[int(0.3 * len(x)) :] = x[int(0.3 * len(x))]
        case 7:
            x[rng.integers(0, len(x), len(x) // 3)] = rng.uniform(-1e4, 1e4)
    return x, rate


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("first", [150, 240, 350, 450, 2190, 2400])
def test_no_signal_ends_in_an_error(first):
    for seed in range(first, first + 25):
        fit = fit_line(*odd_signal(seed))
        assert fit is None or np.isfinite([fit.amplitude, fit.u, fit.frequency_hz, fit.drift]).all()
