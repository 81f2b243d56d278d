"""`unitcad fit --check`: a contributed unit, and everything that it may lack."""

import json
import shutil
import tomllib

import pytest
import tomli_w

from tests.in_process import unitcad
from tests.refusals import refuses
from unitcad.files import sha256
from unitcad.lab.contribution import lacks, unit_rows
from unitcad.lab.fitting import fit_lab, load_fit_lab
from unitcad.spec import spec_hash
from unitcad.validation import load
from unitcad.validation.load import shipped_files

LAB = shipped_files("lab")["contribution"].parent
UNIT = "E10/D30 encapsulating"


@pytest.fixture(scope="module")
def shipped(tmp_path_factory):
    """Copy the shipped lab, whose recordings take a second to measure, and load its contribution."""
    folder = tmp_path_factory.mktemp("contribution") / "lab"
    shutil.copytree(LAB, folder)
    return load_fit_lab(str(folder / "contribution.toml"))


def changed(tmp_path, change):
    """Write the shipped contribution with a change of its data; without recordings a typed level stands in."""
    for name in ("E10-D30.cast.json", "campaign.toml"):
        shutil.copy(LAB / name, tmp_path)
    data = tomllib.loads((LAB / "contribution.toml").read_text())
    del data["unit"][0]["recordings"]
    data["unit"][0]["level"] = {"value": 0.05, "low": 0.045, "high": 0.055}
    change(data)
    (tmp_path / "c.toml").write_text(tomli_w.dumps(data))
    return str(tmp_path / "c.toml")


def test_the_shipped_form_is_complete_and_its_level_is_that_of_its_recordings(shipped):
    (unit,) = shipped.units
    assert lacks(shipped) == []
    assert unit.level.value == pytest.approx(0.42, rel=0.01)  # put into the recordings
    assert (unit.level.low < 0.42 < unit.level.high, unit.batch, unit.walls_measured) == (
        True,
        "E10-D30.cast.json",
        True,
    )
    assert [layer.wall_mm for layer in unit.built.layers] == pytest.approx([3.8 / 3, 3.65 / 3])
    read = {one.file: one.sha256 for one in shipped.inputs}
    assert read["edge-2.wav"] == sha256(LAB / "edge-2.wav")
    assert set(read) >= {"contribution.toml", "campaign.toml", "E10-D30.cast.json", "motor-1.wav"}
    (row,) = unit_rows(shipped)
    assert row["far"]  # a level of 0.42, where the rule expects less than 0.07
    assert fit_lab(shipped).fit.measured[0].value == unit.level.value


def test_the_command_prints_units_and_writes_nothing(tmp_path):
    path = changed(tmp_path, lambda data: None)
    before = sorted(tmp_path.iterdir())
    done = unitcad("fit", path, "--check")
    assert done.returncode == 0
    assert "5 % (4.5 to 5.5) of the motor's amplitude at 125.0 Hz" in done.stdout
    assert "walls as measured, 1.27, 1.22 mm; the rule expects 3." in done.stdout
    assert done.stdout.splitlines()[-1] == "1 unit: nothing is missing"
    data = json.loads(unitcad("fit", path, "--check", "--json").stdout)
    assert (data["complete"], data["lacks"], data["units"][0]["far"]) == (True, [], False)
    assert sorted(tmp_path.iterdir()) == before
    # A level that is off is no missing field, and the last line points to it.
    last = unitcad("fit", LAB / "contribution.toml", "--check").stdout.splitlines()[-1]
    assert last.startswith("1 unit: every field is there; look at the level of ")
    refused = unitcad("fit", path, "--check", "-o", tmp_path / "out")
    assert (refused.returncode, "leave out --out" in refused.stderr) == (2, True)


def _without_walls(data, folder):
    record = json.loads((folder / "E10-D30.cast.json").read_text())
    del record["units"][0]["walls"]
    (folder / "E10-D30.cast.json").write_text(json.dumps(record))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda data, _: data.pop("instrument"), "instrument: is missing: sensor, surface, axis, support and motor"),
        (lambda data, _: data.pop("contributor"), "contributor: is missing: name and licence"),
        (lambda data, _: data["unit"][0].update(lab="b"), "is of lab b"),
        (lambda data, _: (data["unit"][0].pop("cast"), data["unit"][0].update(spec="embedded")), "has no cast record"),
        (_without_walls, "has no walls of this unit"),
        (lambda data, _: data["unit"][0].update(level={"value": 0.05}), "has no 95 % interval"),
        (lambda data, _: data["unit"][0].update(level={"value": 50, "low": 45, "high": 55}), "is a unit wrong?"),
    ],
)
def test_everything_that_a_contribution_lacks_is_said(change, said, tmp_path):
    path = changed(tmp_path, lambda data: change(data, tmp_path))
    done = unitcad("fit", path, "--check")
    assert done.returncode == 1
    assert said in done.stderr
    assert done.stdout.splitlines()[-1].startswith("1 unit; 1 to settle")
    assert fit_lab(load_fit_lab(path)).fit.leads == "rule"  # a fit needs none of it


def _campaign(**changes):
    def change(data):
        del data["unit"][0]["level"]
        data["unit"][0].update({"recordings": "campaign.toml", **changes})

    return change


@pytest.mark.parametrize(
    ("change", "field", "part"),
    [
        (_campaign(level={"value": 0.1}), "unit.0.level", "one of them"),
        (_campaign(recordings="gone.toml"), "unit.0.recordings", "no such file"),
        (_campaign(), "unit.0.recordings", "no such file"),  # the campaign's recordings are not in this folder
        (lambda data: data["instrument"].update(axis="sideways"), "instrument.axis", "normal"),
        (lambda data: data["instrument"].pop("support"), "instrument.support", "required"),
        (lambda data: data["contributor"].update(licence=""), "contributor.licence", "empty"),
    ],
)
def test_a_contribution_that_can_not_be_meant_is_refused(change, field, part, tmp_path):
    with refuses(field, part):
        load_fit_lab(changed(tmp_path, change))


def test_a_unit_that_is_not_in_its_campaign_is_refused(shipped, tmp_path):
    shutil.copytree(LAB, tmp_path / "lab")
    file = tmp_path / "lab" / "contribution.toml"
    file.write_text(file.read_text().replace(f'name = "{UNIT}"', 'name = "other"'))
    with refuses("unit.0.recordings (unit)", UNIT):
        load_fit_lab(str(file))


def test_the_shipped_cast_record_is_of_the_template():
    record = json.loads((LAB / "E10-D30.cast.json").read_text())
    assert record["spec_hash"] == spec_hash(load("encapsulating"))[:12]
