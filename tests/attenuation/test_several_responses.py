"""Several bodies and loads on one path: each as it is by itself, within both bounds, and within its own rtol."""

import numpy as np
import pytest

from unitcad.attenuation import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.layered import KelvinVoigt, LossFactor, Point, UniformDisc, responses
from unitcad.attenuation.layered.medium import Stack
from unitcad.errors import Refusal

R = np.array([[0.5e-3, 7e-3], [20e-3, 37e-3]])
WAYS = ("normal", "tangential")


def _body(stiffer=1.0, tan_delta=0.2):
    damping = LossFactor(tan_delta)
    layers = [Layer(1.5e-3, 1100, 130e3 * stiffer, 0.49, damping), Layer(4e-3, 950, 9e3 * stiffer, 0.495, damping)]
    return LayeredMedium(layers, HalfSpace(1050, 12e3 * stiffer, 0.495, KelvinVoigt(4.5)))


def _components(one):
    names = ("r", "theta", "z")
    return (np.array([getattr(one, f"{what}_{name}") for name in names]) for what in ("u", "error"))


@pytest.mark.parametrize("z", [0.0, 2e-3])
@pytest.mark.parametrize("rtol", [1e-3, 1e-7])
@pytest.mark.parametrize(
    "bodies",
    [
        [(_body(), 785.0), (_body(1.1), 785.0), (_body(0.8), 900.0)],
        [(_body(), 785.0), (_body(1e4), 785.0)],
        [(_body(), 785.0), (_body(tan_delta=0.0), 785.0)],
        [(_body(), 785.0), (LayeredMedium([], HalfSpace(1050, 12e3, 0.4, LossFactor(0.1))), 300.0)],
    ],
    ids=["alike", "contrast", "undamped", "half-space"],
)
def test_each_is_what_it_is_by_itself(bodies, rtol, z):
    loads = [UniformDisc(3.5e-3, way) for way in WAYS]
    found = responses(bodies, loads, R, z=z, rtol=rtol)
    for (medium, omega), both in zip(bodies, found, strict=True):
        for load, one in zip(loads, both, strict=True):
            u, error = _components(one)
            alone, of_alone = _components(medium.response(load, omega, R, z=z, rtol=1e-2 * rtol))
            assert u.shape == (3, 2, 2)
            assert np.all(np.abs(u - alone) <= error + of_alone)
            assert one.error <= rtol * np.max(np.abs(alone)) * (1.0 + rtol)


def test_bodies_that_are_alike_share_a_path(monkeypatch):
    calls = []
    monkeypatch.setattr(Stack, "planes", _counted(Stack.planes, calls))
    responses(
        [(_body(1.0 + 0.01 * i), 785.0) for i in range(4)], [UniformDisc(3.5e-3, way) for way in WAYS], R, rtol=1e-4
    )
    assert len(calls) == 4


def _counted(method, calls):
    return lambda *args: calls.append(0) or method(*args)


@pytest.mark.parametrize(
    "loads", [[UniformDisc(3e-3), UniformDisc(4e-3)], [Point(), UniformDisc(3e-3)], [Point(), Point("radial")]]
)
def test_loads_of_other_transforms_are_refused(loads):
    with pytest.raises(Refusal) as refused:
        responses([(_body(), 785.0)], loads, R)
    assert refused.value.field == "loads"
