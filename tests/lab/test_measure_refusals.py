"""What a campaign says that can't be: refused before the first measurement, with the field."""

import shutil

import numpy as np
import pytest
from scipy.io import wavfile

from unitcad.errors import Refusal
from unitcad.lab import measuring
from unitcad.lab.campaign import read_campaign

HEAD = 'name = "t"\n[sensor]\nquantity = "displacement"\nunit = "um"\nscale = 500.0\n'
UNIT = '[[unit]]\nname = "a"\nreference = ["m0.wav", "m1.wav", "m2.wav"]\nedge = ["e0.wav", "e1.wav", "e2.wav"]\n'


@pytest.fixture
def folder(tmp_path):
    time = np.arange(4000) / 2000
    for k, name in enumerate(("m0", "m1", "m2", "e0", "e1", "e2")):
        x = (0.6 if name < "m" else 0.3) * (1 + 0.01 * k) * np.cos(2 * np.pi * 121.3 * time)
        wavfile.write(tmp_path / f"{name}.wav", 2000, x.astype("<f4"))
    shutil.copy(tmp_path / "e0.wav", tmp_path / "copy.wav")
    (tmp_path / "x.svd").write_bytes(b"x")
    (tmp_path / "x.odd").write_bytes(b"x")
    return tmp_path


@pytest.mark.parametrize(
    ("old", "new", "field", "nearest"),
    [
        ('"e1.wav"', '"./e0.wav"', "unit.0.edge.1", None),
        ('"e1.wav"', '"copy.wav"', "unit.0.edge.1", None),
        ('"e1.wav"', '"m1.wav"', "unit.0.edge.1", None),
        ('"e1.wav"', '"gone.wav"', "unit.0.edge.1", None),
        ('"e1.wav"', '"x.svd"', "unit.0.edge.1", None),
        ('"e1.wav"', '"x.odd"', "unit.0.edge.1", None),
        ('name = "a"', 'name = "a"\nspec = "encapsulatign"', "unit.0.spec", "encapsulating"),
        ('name = "a"', 'name = "a"\nspec = "gone.toml"', "unit.0.spec", None),
        ("[[unit]]", '[chain]\nuse = ["line", "line"]\n[[unit]]', "chain.use", ["line"]),
        ("[[unit]]", '[motor_sensor]\nquantity = "velocity"\nunit = "um"\n[[unit]]', "motor_sensor.unit", None),
    ],
)
def test_what_a_campaign_names_is_checked_first(folder, monkeypatch, old, new, field, nearest):
    monkeypatch.setattr(measuring, "measure_record", lambda *_: pytest.fail("a record was measured"))
    (folder / "c.toml").write_text(HEAD + UNIT.replace(old, new))
    with pytest.raises(Refusal) as refused:
        measuring.measure(read_campaign(folder / "c.toml"), folder)
    assert refused.value.field == field
    if nearest is not None:
        assert refused.value.nearest == nearest


@pytest.mark.parametrize(("rate", "accepted"), [(2000.0, True), (2001.0, True), (2010.0, False), (1000.0, False)])
@pytest.mark.parametrize("ending", ["wav", "csv"])
def test_a_rate_that_the_file_contradicts_is_refused(folder, rate, accepted, ending):
    for name in ("m0", "m1", "m2", "e0", "e1", "e2"):
        x = wavfile.read(folder / f"{name}.wav")[1]
        rows = "\n".join(f"{i / 2000:.4f},{value:.6f}" for i, value in enumerate(x))
        (folder / f"{name}.csv").write_text(f"time (s),u\n{rows}\n")
    text = HEAD + f"[recording]\nrate_hz = {rate}\n" + ('channel = "u"\n' if ending == "csv" else "")
    (folder / "c.toml").write_text(text + UNIT.replace("wav", ending))
    campaign = read_campaign(folder / "c.toml")
    if accepted:
        assert measuring.measure(campaign, folder).levels
        return
    with pytest.raises(Refusal) as refused:
        measuring.measure(campaign, folder)
    assert refused.value.field == "recording.rate_hz"
    assert refused.value.nearest == pytest.approx(2000.0, rel=1e-6)
