"""S001 says which size the numbers would give in the unit that was probably meant."""

from __future__ import annotations

import pytest
from conftest import Judge
from shapes import box, model_xml, package, stl


@pytest.mark.parametrize(
    ("unit", "said"),
    [
        ("meter", "largest side 10000 mm with the unit meter that is named; 10 mm if the numbers are millimetres"),
        ("micron", "largest side 0.01 mm with the unit micron that is named; 10 mm if the numbers are millimetres"),
        ("foot", "largest side 3048 mm with the unit foot that is named; 10 mm if the numbers are millimetres"),
        ("inch", None),
    ],
)
def test_a_3mf_of_another_unit_and_a_unit_that_is_given(judge: Judge, unit: str, said: str | None) -> None:
    for report in (judge(package(model_xml(attributes=f'unit="{unit}"')), "a.3mf"), judge(stl(box()), unit=unit)):
        assert next((found.message for found in report.findings if found.code == "S001"), None) == said


def test_millimetres_are_taken_for_metres_inches_or_microns(judge: Judge) -> None:
    small = judge(stl(box((0.5, 0.5, 0.5)))).findings[0].message
    assert small == "largest side 0.5 mm as millimetres; 500 mm if it was metres, 12.7 mm if inches"
    large = judge(stl(box((5000, 10, 10)))).findings[0].message
    assert large == "largest side 5000 mm as millimetres; 5 mm if it was microns"
