"""The skin's motion under either drive: a force that turns, made of two in quadrature, and one along the axis."""

import numpy as np
import pytest

from tests.sample_bodies import LEADLESS
from unitcad.attenuation import UniformDisc
from unitcad.attenuation.curve import layered_block
from unitcad.attenuation.inputs import tissue_medium
from unitcad.catalogue import motors
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_input, estimate_spec
from unitcad.validation import from_data, load, read

DRIVEN = {drive: estimate_input(load("encapsulating", [f"motor.drive={drive}"])) for drive in ("flat", "axial")}
FOREARM = tissue_medium(DRIVEN["flat"].tissue)
BLOCKS = {drive: layered_block(variant) for drive, variant in DRIVEN.items()}


@pytest.mark.parametrize("angle", [0.0, 0.7, 2.5])
def test_the_rotating_force_is_two_in_quadrature(angle):
    """Twice the mean square of x, y and z over a turn is |u|^2, at every angle."""
    r, omega = np.array([7e-3, 12e-3, 37e-3]), 2 * np.pi * 125
    one = FOREARM.response(UniformDisc(3.5e-3, "tangential"), omega, r, rtol=1e-4)
    # A force along x and, a quarter of a turn behind, one along y: at `angle` the second sees angle - pi/2.
    directions = [(1.0, angle), (-1j, angle - np.pi / 2)]
    radial, around, normal = (
        sum(phase * turn(at) * part for phase, at in directions)
        for part, turn in ((one.u_r, np.cos), (one.u_theta, np.sin), (one.u_z, np.cos))
    )
    assert [radial, around, normal] == [
        pytest.approx(np.exp(-1j * angle) * part, rel=1e-12) for part in (one.u_r, 1j * one.u_theta, one.u_z)
    ]
    x = radial * np.cos(angle) - around * np.sin(angle)
    y = radial * np.sin(angle) + around * np.cos(angle)
    turns = np.exp(1j * np.linspace(0, 2 * np.pi, 24, endpoint=False))[:, None]
    square = sum(np.mean(np.real(part * turns) ** 2, axis=0) for part in (x, y, normal))
    found = BLOCKS["flat"]["drives"]["flat"]
    sizes = np.array(found["u"]["value"])[[0, 5, 30]] * found["m_per_n_at_the_edge"] * np.pi * 3.5e-3**2
    assert np.sqrt(2 * square) == pytest.approx(sizes, rel=2e-4)


def test_the_motor_s_drive_stands_first_and_changes_nothing_else():
    flat, axial = BLOCKS["flat"], BLOCKS["axial"]
    assert (list(flat["drives"]), list(axial["drives"])) == (["flat", "axial"], ["axial", "flat"])
    assert (flat["drive"], axial["drive"]) == ("flat", "axial")
    rest = [{key: value for key, value in block.items() if key != "drive"} for block in (flat, axial)]
    assert rest[0] == rest[1]


@pytest.mark.parametrize("drive", ["flat", "axial"])
def test_a_drive_s_curve(drive):
    """The components add up to |u|, the spread holds the value, and the other of the two is per newton of the same."""
    block = BLOCKS["flat"]
    found = block["drives"][drive]
    parts = [np.array(found[key]["value"]) for key in ("u_r", "u_theta", "u_z") if key in found]
    assert len(parts) == (3 if drive == "flat" else 2)
    value, low, high = (np.array(found["u"][key]) for key in ("value", "low", "high"))
    assert np.sqrt(sum(part**2 for part in parts)) == pytest.approx(value, rel=1e-12)
    assert value[0] == low[0] == high[0] == 1
    assert np.all((low <= value) & (value <= high))
    assert found["error_estimate"] < 1e-4
    sizes = {name: np.array(one["u"]["value"]) * one["m_per_n_at_the_edge"] for name, one in block["drives"].items()}
    assert sizes["flat"] / sizes["axial"] == pytest.approx(np.array(block["flat_over_axial_per_newton"]["value"]))


def test_the_drive_is_the_part_s_where_the_spec_gives_none():
    drives = {(one.kind.value, one.drive and one.drive.value) for one in motors().values() if one.kind}
    assert drives == {("erm", "flat"), ("lra", "axial"), ("lra", None), ("voice-coil", "axial"), ("piezo", "axial")}
    plain = read(LEADLESS)
    lra = {"part": "VG1040003D"}
    assert from_data({**plain, "diameter_mm": 18.0, "motor": lra}).motor.drive == "axial"
    assert from_data({**plain, "diameter_mm": 18.0, "motor": {**lra, "drive": "flat"}}).motor.drive == "flat"
    assert from_data({**plain, "motor": {"diameter_mm": 7.0, "thickness_mm": 2.0}}).motor.drive == "flat"
    own = {"like": "LCM0720A3463F", "drive": "axial"}
    assert from_data({**plain, "motor": {"part": "ours"}, "motors": {"ours": own}}).motor.drive == "axial"
    bare = {"diameter_mm": 7.0, "thickness_mm": 2.0}
    assert from_data({**plain, "motor": {"part": "ours"}, "motors": {"ours": bare}}).motor.drive == "flat"
    with pytest.raises(Refusal) as refused:
        from_data({**plain, "motor": {"drive": "axail"}})
    assert (refused.value.field, refused.value.nearest) == ("motor.drive", "axial")


def test_a_mass_given_is_the_motor_s():
    data = {**read("encapsulating"), "motor": {"part": "ours"}}
    data["motors"] = {"ours": {"like": "LCM0720A3463F", "mass_g": {"value": 0.5, "low": 0.4}}}
    mass = estimate_input(from_data(data)).geometry.motor_mass
    assert (mass.low, mass.value, mass.high) == pytest.approx((0.4e-3, 0.5e-3, None))


def test_the_edge_level_does_not_know_the_drive():
    flat, axial = (estimate_spec(load("encapsulating", [f"motor.drive={drive}"])) for drive in ("flat", "axial"))
    for model, block in flat["models"].items():
        assert block["edge_level"] == axial["models"][model]["edge_level"]
    assert (flat["variant"]["motor_drive"], axial["variant"]["motor_drive"]) == ("flat", "axial")
