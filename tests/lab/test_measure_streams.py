"""Long records are read and fitted in sections: memory does not grow with their length."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from unitcad.lab import record as signals
from unitcad.lab.campaign import Campaign, RecordingTable, SensorTable, UnitTable
from unitcad.lab.chains.line import Mains
from unitcad.lab.record import SECTION, measure_record, open_signal

SENSOR = SensorTable(quantity="displacement", unit="um", scale=500.0)
MEASURE = """
import resource, sys
from pathlib import Path
from unitcad.lab.campaign import Campaign, SensorTable, UnitTable
from unitcad.lab.chains.line import Mains
from unitcad.lab.record import measure_record
sensor = SensorTable(quantity="displacement", unit="um", scale=500.0)
campaign = Campaign(name="long", sensor=sensor, unit=(UnitTable(name="a"),))
path = Path(sys.argv[1])
found = measure_record(path, "edge", campaign, (sensor,), (Mains(),), (60.0, 250.0), path.name)
print(found.samples, found.amplitude_um, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3)
"""


def write_long(path: Path, count: int, rate: int) -> None:
    """Write a 16-bit WAV file of a line at 125 Hz, piece by piece."""
    import struct

    size = 2 * count
    form = struct.pack("<IHHIIHH", 16, 1, 1, rate, 2 * rate, 2, 16)
    head = b"RIFF" + struct.pack("<I", 36 + size) + b"WAVEfmt " + form
    rng = np.random.default_rng(1)
    with open(path, "wb") as file:
        file.write(head + b"data" + struct.pack("<I", size))
        for start in range(0, count, 1_000_000):
            time = np.arange(start, min(start + 1_000_000, count)) / rate
            x = 0.5 * np.cos(2 * np.pi * 125 * time) + 0.01 * rng.standard_normal(len(time))
            file.write(np.round(x * 32768).astype("<i2").tobytes())


def measured(path: Path) -> tuple[int, float, float]:
    """Measure a record in a process of its own; return samples, amplitude in um, and the peak of its memory in MB."""
    done = subprocess.run([sys.executable, "-c", MEASURE, str(path)], capture_output=True, text=True, check=True)
    samples, amplitude, peak = done.stdout.split()
    return int(samples), float(amplitude), float(peak)


def test_sections_are_the_file_in_order(tmp_path: Path) -> None:
    """No sample is lost or comes twice at the ends of sections and blocks, averaged or not."""
    from scipy.io import wavfile

    for rate, every in ((5_000, 1), (15_000, 3)):
        count = every * SECTION * 2 + 12_345
        x = np.random.default_rng(1).integers(-30000, 30000, count).astype("<i2")
        wavfile.write(tmp_path / "a.wav", rate, x)
        signal = open_signal(tmp_path / "a.wav", RecordingTable(), (SENSOR,), "a.wav")
        whole = np.concatenate(list(signal.sections()))[:, 0]
        assert (signal.averaged, signal.count) == (every, count)
        expected = x[: count // every * every].reshape(-1, every).mean(axis=1) / 2**15 * 500
        assert np.abs(whole - expected).max() < 1e-9


@pytest.mark.parametrize(("stops", "codes"), [(8000, ["L113"]), (12_000, [])])
def test_a_section_without_a_line_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stops: int, codes: list[str]
) -> None:
    from scipy.io import wavfile

    monkeypatch.setattr(signals, "SECTION", 4000)
    time = np.arange(12_000) / 2000
    x = np.where(np.arange(12_000) < stops, 0.5 * np.cos(2 * np.pi * 123.4 * time), 0.0)
    wavfile.write(tmp_path / "a.wav", 2000, np.round(x * 32768).astype("<i2"))
    campaign = Campaign(name="long", sensor=SENSOR, unit=(UnitTable(name="a"),))
    result = measure_record(tmp_path / "a.wav", "edge", campaign, (SENSOR,), (Mains(),), (60.0, 250.0), "a.wav")
    assert [one.code for one in result.findings] == codes
    assert result.amplitude_um == pytest.approx(250.0, rel=1e-3)
    if codes:
        assert "1 of 3 sections, the first from 4 s of 6 s" in result.findings[0].message


@pytest.mark.skipif(sys.platform == "win32", reason="resource is a module of POSIX")
def test_a_long_record_takes_little_more_memory_than_a_short_one(tmp_path: Path) -> None:
    peaks = []
    for count in (500_000, 4_000_000):
        write_long(tmp_path / "a.wav", count, 100_000)
        samples, amplitude, peak = measured(tmp_path / "a.wav")
        assert samples == count
        assert amplitude == pytest.approx(250.0, rel=2e-4)
        peaks.append(peak)
    assert peaks[1] < peaks[0] + 250


@pytest.mark.long
def test_a_hundred_million_samples_take_less_than_500_mb(tmp_path: Path) -> None:
    write_long(tmp_path / "a.wav", 100_000_000, 100_000)
    samples, amplitude, peak = measured(tmp_path / "a.wav")
    assert samples == 100_000_000
    assert amplitude == pytest.approx(250.0, rel=2e-4)
    print(f"peak {peak:.0f} MB")
    assert peak < 500
