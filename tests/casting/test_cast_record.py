"""The cast record: what is accepted comes back the same; what is not is refused by its field."""

import json
from pathlib import Path

import pytest
from cast_records import spec_of, to_json
from typer.testing import CliRunner

from unitcad.casting.cast_record import FORMAT, cast_record, read_cast_record
from unitcad.cli import app, main
from unitcad.errors import Refusal, UnitcadError
from unitcad.spec import spec_hash, to_data
from unitcad.validation import load


def data():
    spec = load("encapsulating")
    return {
        "format": FORMAT,
        "version": 1,
        "spec_name": spec.name,
        "spec_hash": spec_hash(spec)[:12],
        "spec": to_data(spec),
        "cast_on": "2026-03-14",
        "pours": [
            {"index": 1, "part_a_g": 10.0, "part_b_g": 10, "mixed_at": "2026-03-14T09:30:00+01:00", "cure_h": 4.5},
            {"index": 2, "pot_life_min": 12.0, "notes": ["cup 2 lifted a little"]},
        ],
        "units": [
            {"cavity": 1, "height_mm": 3.95, "mass_g": 0.61, "walls": [{"layer": 1, "places_mm": [1.2, 1.3]}]},
            {"cavity": 2, "usable": False, "notes": ["bubble"]},
        ],
    }


def test_a_record_comes_back_the_same(tmp_path):
    record = cast_record(data())
    (tmp_path / "a.cast.json").write_text(to_json(record), encoding="utf-8")
    assert read_cast_record(tmp_path / "a.cast.json") == record
    assert spec_hash(spec_of(record))[:12] == record.spec_hash
    first = record.unit(1)
    assert first is not None
    assert (first.wall_mm(1), first.wall_mm(2), record.unit(3)) == ((1.2, 1.3), (), None)


FAULTS = {
    "version": (lambda d: d.update(version=2), "version"),
    "unknown key": (lambda d: d.update(spec_nme="x"), "spec_nme"),
    "hash": (lambda d: d.update(spec_hash="XYZ"), "spec_hash"),
    "day": (lambda d: d.update(cast_on="14.3.2026"), "cast_on"),
    "day that is none": (lambda d: d.update(cast_on="2026-02-30"), "cast_on"),
    "time": (lambda d: d["pours"][0].update(mixed_at="half past nine"), "pours.0.mixed_at"),
    "time without zone": (lambda d: d["pours"][0].update(mixed_at="2026-03-14T09:30:00"), "pours.0.mixed_at"),
    "grams": (lambda d: d["pours"][0].update(part_a_g=-1.0), "pours.0.part_a_g"),
    "grams as text": (lambda d: d["pours"][0].update(part_a_g="10 g"), "pours.0.part_a_g"),
    "pour twice": (lambda d: d["pours"][1].update(index=1), "pours.1.index"),
    "cavity twice": (lambda d: d["units"][1].update(cavity=1), "units.1.cavity"),
    "wall": (lambda d: d["units"][0]["walls"][0].update(places_mm=[1.2, 0.0]), "units.0.walls.0.places_mm.1"),
    "no place": (lambda d: d["units"][0]["walls"][0].update(places_mm=[]), "units.0.walls.0.places_mm"),
    "layer twice": (lambda d: d["units"][0].update(walls=d["units"][0]["walls"] * 2), "units.0.walls.1.layer"),
    "infinite": (lambda d: d["units"][0].update(mass_g=float("inf")), "units.0.mass_g"),
}


@pytest.mark.parametrize(("change", "field"), FAULTS.values(), ids=FAULTS)
def test_a_fault_is_refused_by_its_field(change, field):
    faulty = data()
    change(faulty)
    with pytest.raises(Refusal) as refused:
        cast_record(faulty)
    assert refused.value.field == field


def test_the_nearest_time_is_accepted():
    faulty = data()
    faulty["pours"][0]["mixed_at"] = "2026-03-14T09:30"
    with pytest.raises(Refusal) as refused:
        cast_record(faulty)
    faulty["pours"][0]["mixed_at"] = refused.value.nearest
    cast_record(faulty)


@pytest.mark.parametrize("text", ["", "[]", "7", '{"format": "other"}', '{"a": NaN}', "[" * 5000])
def test_another_file_is_no_record(text, tmp_path):
    (tmp_path / "a.json").write_text(text, encoding="utf-8")
    with pytest.raises(UnitcadError, match=r"a\.json"):
        read_cast_record(tmp_path / "a.json")


def test_a_large_file_and_a_link_are_refused(tmp_path):
    (tmp_path / "large.json").write_text(" " * 1_000_001, encoding="utf-8")
    with pytest.raises(UnitcadError, match="larger than 1 MB"):
        read_cast_record(tmp_path / "large.json")
    (tmp_path / "link.json").symlink_to("large.json")
    with pytest.raises(UnitcadError, match="link"):
        read_cast_record(tmp_path / "link.json", links=False)


def test_a_record_without_its_spec_says_so():
    with pytest.raises(Refusal, match="spec"):
        spec_of(cast_record({key: value for key, value in data().items() if key != "spec"}))


def test_the_example_of_the_docs_is_a_record():
    text = (Path(__file__).parents[2] / "docs" / "how-to" / "print-and-cast.md").read_text("utf-8")
    example = text.split("## Write a cast record")[1].split("```json\n")[1].split("```")[0]
    assert cast_record(json.loads(example)).units[0].wall_mm(1) == (1.2, 1.3)


def test_the_schema_is_offered():
    done = CliRunner().invoke(app, ["schema", "cast-record"])
    schema = json.loads(done.stdout)
    assert schema["title"] == "unitcad cast record"
    assert {"part_a_g", "pot_life_min", "cure_h"} <= schema["$defs"]["CastPour"]["properties"].keys()


@pytest.mark.parametrize(("text", "said"), [("{", "JSON"), ('{"format": "x"}', "format"), ("[]", "no table")])
def test_report_refuses_a_folder_with_a_damaged_record(text, said, tmp_path, monkeypatch, capsys):
    """The record is what somebody put there: its fault is an error that names it, and no page is written."""
    (tmp_path / "manifest.json").write_text("{}")
    (tmp_path / "a-2026-03-14.cast.json").write_text(text)
    monkeypatch.setattr("sys.argv", ["unitcad", "report", str(tmp_path)])
    with pytest.raises(SystemExit) as left:
        main()
    error = capsys.readouterr().err
    assert left.value.code == 2
    assert "a-2026-03-14.cast.json" in error
    assert said in error
    assert not (tmp_path / "report.html").exists()
