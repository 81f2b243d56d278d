"""The unit of an array changed by paths: what `like` names, and values in it."""

import pytest

from unitcad.arrays.array_file import load_array
from unitcad.errors import Refusal
from unitcad.export import printing
from unitcad.kernels.mesh import arrays, realise
from unitcad.shape import cylinder

LIKE = """
name = "pair"
array = "pockets"
layout = { kind = "grid", columns = 2, rows = 1, pitch_mm = 24 }
[unit]
like = "embedded"
diameter_mm = 15
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "pair.toml"
    path.write_text(LIKE)
    return path


def test_like_is_changed_and_the_other_keys_of_the_file_stay(file):
    assert load_array(file).unit.design == "embedded"
    unit = load_array(file, ["unit.like=encapsulating"]).unit
    assert (unit.design, unit.diameter_mm) == ("encapsulating", 15)


@pytest.mark.parametrize("changes", [["unit=three-layer"], ['unit={like="three-layer"}'], ["unit.like=three-layer"]])
def test_a_unit_by_name_is_changed_by_paths(changes):
    tail = "unit.fpcb.tail_length_mm=5.6"
    one, other = (load_array("hex-19", order) for order in ([*changes, tail], [tail, *changes]))
    assert len(one.unit.layers) == 3
    assert one.unit.fpcb is not None
    assert one.unit.fpcb.tail_length_mm == 5.6
    assert one.asked == other.asked


def test_a_place_takes_like_too():
    whole = load_array("hex-19", ['place=[{at="A1", unit={like="encapsulating", diameter_mm=13}}]'])
    assert whole.places[0].unit.diameter_mm == 13
    parts = ["place.0.unit.diameter_mm=13", 'place=[{at="A1"}]', "place.0.unit.like=encapsulating"]
    assert load_array("hex-19", parts).places[0].unit == whole.places[0].unit


@pytest.mark.parametrize(
    ("change", "field", "words"),
    [
        ("unit.like=nope", "unit.like", "unknown name"),
        ("motor.thickness_mm=2", "motor", "unknown key; closest: unit.motor.thickness_mm"),
        ("unit.like=3", "unit.like", "takes a text"),
        ("unit=nope.toml", "unit", "there is no file nope.toml"),
    ],
)
def test_a_unit_that_is_not_found_is_refused_with_its_field(change, field, words):
    with pytest.raises(Refusal) as refused:
        load_array("hex-19", [change])
    assert refused.value.field == field
    assert words in refused.value.limit


def test_an_array_refuses_a_unit_without_a_motor(tmp_path):
    (tmp_path / "disc.stl").write_bytes(printing.stl(*arrays(realise(cylinder(7, 0, 4), 96)), "disc"))
    layer = '[[layers]]\nmaterial = "ecoflex-00-30"\nwall_mm = 3.0\n'
    text = f'name = "disc"\ndesign = "disc.stl"\ndiameter_mm = 14.0\nmotor = false\n{layer}'
    (tmp_path / "disc.toml").write_text(text)
    with pytest.raises(Refusal, match=r"^unit\.motor = false: an array's circuit joins motors"):
        load_array("forearm-pockets", {"unit": str(tmp_path / "disc.toml")})
