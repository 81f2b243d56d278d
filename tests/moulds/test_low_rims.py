"""Cups so low that the letters of their label are as deep as the overflow groove."""

from __future__ import annotations

from unitcad.mould_checks import check_moulds
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import from_data


def test_a_label_as_deep_as_the_groove_keeps_a_wall_to_it() -> None:
    """The rim is 1.03 mm high: groove and letters are 0.4 mm deep. Letters 0.63 mm off the groove broke C230."""
    data = {
        "name": "low",
        "design": "embedded",
        "diameter_mm": 10.0,
        "motor": {"diameter_mm": 3.0, "thickness_mm": 1.033, "fill": True},
        "layers": [{"material": "ecoflex-00-10", "wall_mm": 0.5}],
    }
    findings = check_moulds(MouldSet(from_data(data)))
    assert "C230" in {finding.code for finding in findings}
    assert [finding for finding in findings if not finding.ok] == []
