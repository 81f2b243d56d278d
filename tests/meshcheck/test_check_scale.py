"""S001 says which size the numbers would give in the unit that was probably meant."""

import numpy as np
import pytest
from shapes import CUBE_CORNERS, FORMATS, box, finding, in_format, mesh_xml, model_xml, package, stl


@pytest.mark.parametrize(
    ("unit", "said"),
    [
        ("meter", "largest side 10000 mm with the unit meter that is named; 10 mm if the numbers are millimetres"),
        ("micron", "largest side 0.01 mm with the unit micron that is named; 10 mm if the numbers are millimetres"),
        ("foot", "largest side 3048 mm with the unit foot that is named; 10 mm if the numbers are millimetres"),
        ("inch", None),
    ],
)
def test_a_3mf_of_another_unit_and_a_unit_that_is_given(judge, unit, said):
    for report in (judge(package(model_xml(attributes=f'unit="{unit}"')), "a.3mf"), judge(stl(box()), unit=unit)):
        assert next((found.message for found in report.findings if found.code == "S001"), None) == said


def test_millimetres_are_taken_for_metres_inches_or_microns(judge):
    small = judge(stl(box((0.5, 0.5, 0.5)))).findings[0].message
    assert small == "largest side 0.5 mm as millimetres; 500 mm if it was metres, 12.7 mm if inches"
    large = judge(stl(box((5000, 10, 10)))).findings[0].message
    assert large == "largest side 5000 mm as millimetres; 5 mm if it was microns"


@pytest.mark.parametrize(("side", "found"), [(0.002, True), (0.019, True), (0.021, False), (0.5, False)])
@pytest.mark.parametrize("name", FORMATS)
def test_a_speck_beside_a_part(side, found, name, judge):
    parts = np.concatenate([box(), box((side, side / 2, side), (12, 3, 3))])
    report = judge(in_format(parts, name), name)
    assert report.has("G010") == found
    if found:
        said = finding(report, "G010")
        assert (said.count, said.severity) == (1, "warning")
        assert said.locations[0].xyz == pytest.approx((12, 3, 3), abs=side)


def test_a_speck_is_an_instance_too_but_no_cavity_and_no_part_in_metres(judge):
    small = f'<object id="2">{mesh_xml(CUBE_CORNERS * 0.004)}</object>'
    both = '<build><item objectid="1"/><item objectid="2" transform="1 0 0 0 1 0 0 0 1 20 0 0"/></build>'
    model = model_xml(f'<object id="1">{mesh_xml()}</object>{small}', both)
    assert judge(package(model), "a.3mf").has("G010")
    hole = np.concatenate([box(), box((0.004, 0.004, 0.004), (5, 5, 5))[:, ::-1]])
    assert {found.code for found in judge(stl(hole)).findings} >= {"G006"}
    assert not judge(stl(hole)).has("G010")
    metres = np.concatenate([box((0.014, 0.014, 0.005)), box((0.001, 0.001, 0.001), (0.02, 0, 0))])
    assert not judge(stl(metres)).has("G010")
    assert not judge(stl(box((0.01, 0.01, 0.01)))).has("G010")
