"""What hangs on radii and path alone is kept: the same answer, a bounded memory, nothing that a caller can change."""

import numpy as np
import pytest

from unitcad.attenuation.inputs import body
from unitcad.attenuation.layered import Point, UniformDisc
from unitcad.attenuation.layered.loads import kept
from unitcad.estimate_inputs import estimate_input
from unitcad.validation import load as load_spec

DISC = UniformDisc(3.5e-3)
OMEGA = 2 * np.pi * 125.0
RADII = np.array([0.5, 1, 2, 3, 4, 5, 7, 9, 12, 15, 20, 25, 30]) * 1e-3


def _counted():
    made = []

    @kept
    def double(name: str, values: np.ndarray) -> tuple[np.ndarray]:
        made.append(name)
        return (2 * values,)

    return double, made


def test_the_same_arrays_are_worked_out_once():
    double, made = _counted()
    first = double("a", np.array([1.0, 2.0]))
    assert double("a", np.array([1.0, 2.0])) is first
    assert double("b", np.array([1.0, 2.0])) is not first
    assert made == ["a", "b"]


@pytest.mark.parametrize(
    "other", [np.array([[1.0, 2.0]]), np.array([1.0, 2.0]).view(np.int64), np.array([1.0, -0.0])], ids=str
)
def test_shape_and_type_tell_arrays_apart(other):
    double, _ = _counted()
    double("a", np.array([1.0, 2.0]))
    double("a", np.array([1.0, 0.0]))
    assert np.array_equal(double("a", other)[0], 2 * other)
    assert double("a", other)[0].shape == other.shape


def test_what_is_kept_cannot_be_changed():
    double, _ = _counted()
    with pytest.raises(ValueError, match="read-only"):
        double("a", np.array([1.0]))[0][0] = 3.0


@pytest.mark.parametrize("load", [DISC, UniformDisc(3.5e-3, "radial"), Point("tangential")], ids=str)
def test_a_response_at_radii_met_before_is_the_same_to_the_bit(load):
    """Others in between have all but the load, the radii, the depth or the path alike."""
    medium = body(estimate_input(load_spec("encapsulating")).tissue)

    def solved(load=load, r=RADII, z=0.0, rtol=1e-6):
        found = medium.response(load, OMEGA, r, z=z, rtol=rtol)
        return np.stack([found.u_r, found.u_theta, found.u_z, found.error_r, found.error_theta, found.error_z])

    first = solved()
    others = [solved(UniformDisc(3e-3)), solved(r=RADII[::-1]), solved(z=1e-3), solved(rtol=1e-3), solved(r=RADII[:5])]
    assert np.array_equal(solved(), first)
    assert others[1][:, ::-1] == pytest.approx(first, rel=1e-9, abs=1e-9 * np.abs(first).max())
    assert all(not np.array_equal(one[:, :5], first[:, :5]) for one in (others[0], others[2], others[3]))
