"""The table of inputs under `estimate --details`: what reads none of them is said of the level alone."""

from unitcad.cli.estimate_command import _inputs


def test_the_bodys_inputs_are_said_to_change_the_curve():
    seen = {"by": {"diameter_mm": 1.0}, "not_seen": ["tissue damping"]}
    data = {"models": {"divider": {"sensitivities": seen}}, "layered": {}}
    found = _inputs(data)
    assert found
    assert found[1] == (
        "read by no model of the level: tissue damping; the body's inputs change the curve of the skin alone"
    )
    del data["layered"]
    without = _inputs(data)
    assert without
    assert without[1] == "read by no model of the level: tissue damping"
