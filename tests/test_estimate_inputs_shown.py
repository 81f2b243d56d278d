"""The table of inputs under `estimate --details` names the inputs without effect on the level."""

from unitcad.cli.estimate_command import _inputs


def test_the_tissues_inputs_are_said_to_change_the_curve():
    seen = {"by": {"diameter_mm": 1.0}, "no_effect": ["tissue damping"]}
    data = {"models": {"divider": {"sensitivities": seen}}, "layered": {}}
    found = _inputs(data)
    assert found
    assert found[1] == (
        "Inputs without effect on the level: tissue damping. The tissue changes only the curve on the skin."
    )
    del data["layered"]
    without = _inputs(data)
    assert without
    assert without[1] == "Inputs without effect on the level: tissue damping"
