"""A sweep over an array file: each variant is an array's result, refused ones are named."""

import json

import pytest

from unitcad.errors import Refusal
from unitcad.sweeps import batch
from unitcad.sweeps.sweep import load_sweep

ARRAY = """
name = "pair"
array = "pockets"
unit = "encapsulating"
layout = { kind = "grid", columns = 2, rows = 1, pitch_mm = 20 }
"""
SWEEP = """
base = "pair.toml"
[set]
"output.formats" = ["stl"]
[sweep]
"layout.pitch_mm" = [18, 12]
"""


def _sweep(folder, text=SWEEP):
    (folder / "pair.toml").write_text(ARRAY)
    (folder / "pitches.toml").write_text(text)
    return folder / "pitches.toml"


def test_a_sweep_makes_arrays_and_goes_on_where_it_ended(tmp_path):
    file = _sweep(tmp_path)
    out = tmp_path / "out"
    made = batch(file, out, only=["unit"], jobs=0, keep_going=True, report=True)
    assert made.summary.ok == 1
    folder = made.folder
    assert folder.parent == out
    entries = json.loads((folder / "batch.json").read_text())["variants"]
    assert [entry["status"] for entry in entries] == ["ok", "refused"]
    assert "need 16 mm" in entries[1]["reason"]
    assert (folder / entries[0]["folder"] / "array.toml").is_file()
    assert (entries[0]["units"], entries[0]["pitch_mm"]) == (2, 18)
    again = batch(file, out, only=["unit"], jobs=0, keep_going=True)
    assert again.summary.resumed == 1


def test_paths_of_an_array_are_known(tmp_path):
    with pytest.raises(Refusal, match=r"sweep\.sheet\.hold"):
        load_sweep(_sweep(tmp_path, SWEEP.replace("layout.pitch_mm", "sheet.hold")))
    load_sweep(_sweep(tmp_path, SWEEP.replace('"layout.pitch_mm" = [18, 12]', '"unit.diameter_mm" = [14, 15]')))
