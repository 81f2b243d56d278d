"""Units named by the record of their casting: what is read, refused, and taken into a fit and a campaign."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from recordings import RATE
from scipy.io import wavfile
from typer.testing import CliRunner

from unitcad.attenuation.edge.closed_form import published_path
from unitcad.attenuation.edge.measured import nominal
from unitcad.attenuation.edge.ranges import unit_key
from unitcad.cli import app
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_input
from unitcad.files import sha256
from unitcad.lab.campaign import check_files, read_campaign
from unitcad.lab.fitting import fit_lab, load_fit_lab
from unitcad.spec import spec_hash, to_data
from unitcad.validation import load

WALLS = {1: (1.38, 1.42, 1.40), 2: (1.11, 1.09)}
CAST = "u.cast.json"


def record(folder: Path, change: Callable[[dict[str, Any]], Any] = lambda data: None) -> Path:
    """Write a cast record: unit 1 without walls, unit 2 with the walls above, unit 3 not usable."""
    spec = load("encapsulating")
    walls = [{"layer": layer, "places_mm": list(places)} for layer, places in WALLS.items()]
    data = {
        "format": "unitcad cast record",
        "version": 1,
        "spec_name": spec.name,
        "spec_hash": spec_hash(spec)[:12],
        "spec": to_data(spec),
        "cast_on": "2026-03-14",
        "pours": [{"index": 1, "material": "ecoflex-00-10", "part_a_g": 10.0}],
        "units": [{"cavity": 1}, {"cavity": 2, "walls": walls}, {"cavity": 3, "usable": False}],
    }
    change(data)
    (folder / CAST).write_text(json.dumps(data))
    return folder / CAST


def fit_file(folder: Path, **unit: Any) -> str:
    level = {} if "measured" in unit else {"level": {"value": 0.06, "low": 0.055, "high": 0.065}}
    data = {"name": "bench", "unit": [{"name": "b", "cast": CAST, **level, **unit}]}
    path = folder / "lab.toml"
    path.write_text(tomli_w.dumps({**data, "unit": [{k: v for k, v in data["unit"][0].items() if v is not None}]}))
    return str(path)


def test_measured_walls_stand_in_for_the_spec_s(tmp_path: Path) -> None:
    """The fit computes the unit with the walls that it has, and knows it by the spec that was asked for."""
    record(tmp_path)
    lab = load_fit_lab(fit_file(tmp_path, cavity=2))
    one = lab.units[0]
    assert [layer.wall_mm for layer in one.built.layers] == pytest.approx([1.40, 1.10])
    assert [layer.wall_mm for layer in one.spec.layers] == [1.25, 1.25]
    assert {file.file: file.sha256 for file in lab.inputs}[CAST] == sha256(tmp_path / CAST)
    fit = fit_lab(lab).fit
    walls = ["layers.0.wall_mm=1.4", "layers.1.wall_mm=1.1"]
    own = 0.06 / float(published_path(nominal(estimate_input(load("encapsulating", walls))))[0])
    weight = 1 / (1 + (one.error / fit.model["published"].model_error) ** 2)
    stored, found = fit.model["published"].stored["s"], fit.model["published"].constants["s"]
    assert np.log(found) == pytest.approx((0.9 * np.log(stored) + weight * np.log(own)) / (0.9 + weight), abs=2e-3)
    assert fit.measured[0].key == unit_key(estimate_input(load("encapsulating")))
    assert fit.measured[0].source == "as typed, walls as measured, 1.4, 1.1 mm"


@pytest.mark.parametrize(
    ("unit", "change", "field", "part"),
    [
        ({}, None, "unit.0.cavity", "is required: u.cast.json has the cavities 1, 2, 3"),
        ({"cavity": 9}, None, "unit.0.cavity", "has no such unit; it has 1, 2, 3; nearest accepted: 2"),
        ({"cavity": 3}, None, "unit.0.cavity", "not usable"),
        ({"cavity": 2, "cast": "gone.cast.json"}, None, "unit.0.cast", "no such file"),
        ({"cavity": 2, "spec": "encapsulating"}, None, "unit.0.cast", "excludes spec"),
        ({"cavity": 2, "cast": None, "spec": "encapsulating"}, None, "unit.0.cavity", "there is no cast"),
        ({"cast": None}, None, "unit.0.spec", "is required, or cast"),
        ({"cavity": 2, "set": {"layers.0.wall_mm": 1.0}}, None, "unit.0.set", "the record has the spec that was cast"),
        ({"cavity": 2}, lambda d: d.update(version=2), "unit.0.cast", "version = 2: must be at most 1"),
        ({"cavity": 2}, lambda d: d.pop("spec"), "unit.0.cast", "spec: is required here"),
        ({"cavity": 2}, lambda d: d["spec"].update(diameter_mm=3), "unit.0.cast", "diameter_mm"),
        ({"cavity": 2}, lambda d: d["units"][1]["walls"][0].update(layer=3), "unit.0.cast", "the spec has 2 layers"),
        ({"cavity": 2}, lambda d: d["pours"][0].update(material="ecoflex-00-30"), "unit.0.cast", "has ecoflex-00-10"),
    ],
)  # fmt: skip
def test_what_is_refused(unit: dict, change: Any, field: str, part: str, tmp_path: Path) -> None:
    record(tmp_path, change or (lambda data: None))
    with pytest.raises(Refusal) as refused:
        load_fit_lab(fit_file(tmp_path, **unit))
    assert refused.value.field == field
    assert part in str(refused.value)


def _campaign(folder: Path, unit: str) -> Path:
    rng = np.random.default_rng(5)
    time = np.arange(4000) / RATE
    names = {kind: [f"{kind}-{i}.wav" for i in range(3)] for kind in ("motor", "edge")}
    for kind, amplitude in (("motor", 0.5), ("edge", 0.05)):
        for name in names[kind]:
            line = amplitude * np.sin(2 * np.pi * 122.0 * time) + 1e-4 * rng.standard_normal(len(time))
            wavfile.write(folder / name, int(RATE), line.astype(np.float32))
    sensor = '[sensor]\nquantity = "displacement"\nunit = "um"\nscale = 500.0\n'
    records = f"reference = {names['motor']}\nedge = {names['edge']}\n"
    (folder / "c.toml").write_text(f'name = "c"\n{sensor}[[unit]]\nname = "b"\n{unit}\n{records}')
    return folder / "c.toml"


def test_a_campaign_s_unit_goes_into_a_fit_by_its_cast_record(tmp_path: Path) -> None:
    record(tmp_path)
    campaign = _campaign(tmp_path, f'cast = "{CAST}"\ncavity = 2')
    done = CliRunner().invoke(app, ["measure", str(campaign), "-o", str(tmp_path / "m")])
    assert done.exit_code == 0, done.output
    measured = tomllib.loads((tmp_path / "m" / "measured.toml").read_text())
    assert (measured["level"][0]["cast"], measured["level"][0]["cavity"]) == (CAST, 2)
    assert {"file": CAST, "sha256": sha256(tmp_path / CAST)} in measured["source"]
    lab = load_fit_lab(fit_file(tmp_path, cavity=2, measured="m/measured.toml"))
    assert lab.units[0].level.value == pytest.approx(0.1, rel=0.01)
    assert lab.units[0].source == "m/measured.toml, chain line, walls as measured, 1.4, 1.1 mm"
    with pytest.raises(Refusal, match="measured of cavity 2, not 1"):
        load_fit_lab(fit_file(tmp_path, cavity=1, measured="m/measured.toml"))
    record(tmp_path, lambda data: data.update(cast_on="2026-03-15"))
    with pytest.raises(Refusal, match="SHA-256 differs"):
        load_fit_lab(fit_file(tmp_path, cavity=2, measured="m/measured.toml"))


@pytest.mark.parametrize(
    ("unit", "field", "part"),
    [
        (f'cast = "{CAST}"', "unit.0.cavity", "is required"),
        (f'cast = "{CAST}"\ncavity = 3', "unit.0.cavity", "not usable"),
        ('cast = "c.toml"', "unit.0.cast", "JSON"),
        ('spec = "encapsulating"\ncavity = 1', "unit.0.cavity", "there is no cast"),
        (f'spec = "encapsulating"\ncast = "{CAST}"', "unit.0.cast", "excludes spec"),
    ],
)
def test_a_campaign_checks_the_record_before_it_measures(unit: str, field: str, part: str, tmp_path: Path) -> None:
    record(tmp_path)
    campaign = _campaign(tmp_path, unit)
    with pytest.raises(Refusal) as refused:
        check_files(read_campaign(campaign), tmp_path)
    assert refused.value.field == field
    assert part in str(refused.value)
