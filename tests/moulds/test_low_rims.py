"""Cups so low that the letters of their label are as deep as the overflow groove."""

import pytest

from unitcad.checks import check_moulds
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import from_data


@pytest.mark.parametrize("height", [1.0, 1.033, 1.1, 1.2, 1.3, 1.39, 1.5, 1.61])
def test_walls_of_a_low_cup_are_whole(height):
    """At 1.03 mm groove and letters are 0.4 mm deep: letters 0.63 mm off the groove broke C230.

    At 1.2 mm the groove's floor is 0.6 mm thick, which broke C240.
    """
    data = {
        "name": "low",
        "design": "embedded",
        "diameter_mm": 10.0,
        "motor": {"diameter_mm": 3.0, "thickness_mm": height, "fill": True},
        "layers": [{"material": "ecoflex-00-10", "wall_mm": 0.5}],
    }
    findings = check_moulds(MouldSet(from_data(data)))
    assert {"C230", "C240"} <= {finding.code for finding in findings}
    assert [finding for finding in findings if not finding.ok] == []
