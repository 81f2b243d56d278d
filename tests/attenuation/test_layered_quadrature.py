"""Panels longer than the waves that cross them, and panels cut towards the pole that they show."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy import special

from unitcad.attenuation.layered import HalfSpace, Layer, LayeredMedium, Load, LossFactor, Point, UniformDisc
from unitcad.attenuation.layered.quadrature import evaluate, halve_towards, nodes

PHASE = 8.0 * np.pi


class Seen(NamedTuple):
    load: Load
    r: np.ndarray
    taken_out: np.ndarray = np.zeros(2)


def _kernel(k):
    return np.array([1.0 / (k + 300.0), np.exp(-1e-3 * k) * (1.0 + 0.2j)])


def _exact(seen, low, high):
    """The integral by 60,000 midpoints, extrapolated by Richardson from 20,000."""
    sums = []
    for count in (20_000, 60_000):
        k = low + (np.arange(count) + 0.5) * (high - low) / count
        q = seen.load.transform(k)
        waves = np.array([special.jv(order, np.outer(seen.r, k)) for order in seen.load.orders])
        sums.append(np.einsum("rk,rxk->rx", _kernel(k) * q, waves) * (high - low) / count)
    return (9.0 * sums[1] - sums[0]) / 8.0


@pytest.mark.parametrize("load", [UniformDisc(3.5e-3), Point()])
@pytest.mark.parametrize(("low", "high"), [(500.0, 1000.0), (1e3, 2e3), (4e3, 8e3)])
def test_the_kernel_of_a_long_panel_is_read_off_at_its_pieces(load, low, high):
    seen = Seen(load, np.array([0.5e-3, 7e-3, 45e-3]))
    panels = np.array([[low, high, 0, 0], [0.5 * low, low, 0, 0]], dtype=complex)
    k, _ = nodes(panels)
    found = evaluate(seen, panels, _kernel(k.ravel()).reshape(2, *k.shape), PHASE)
    exact = np.array([_exact(seen, *panels[i, :2].real) for i in range(2)])
    size = np.max(np.abs(exact), axis=(0, 2))[:, None]
    assert np.all(np.abs(found.parts - exact) <= found.errors + 1e-12 * size)
    assert np.all(found.errors < 1e-6 * size)


@pytest.mark.parametrize("chunk", [200_000, 1, 3_000])
def test_a_panel_is_integrated_as_it_is_by_itself(monkeypatch, chunk):
    """Some in pieces, one off the axis, at once or in chunks."""
    monkeypatch.setattr("unitcad.attenuation.layered.quadrature._CHUNK", chunk)
    seen = Seen(UniformDisc(3.5e-3), np.array([0.5e-3, 7e-3, 45e-3]))
    level = [[0, 500, 0, 0], [500, 1000, 0, 0], [1e3, 4e3, 0, 0]]
    panels = np.array([*level, [4e3, 4e3 + 300 + 80j, 0, 0]])
    k, _ = nodes(panels)
    kernel = _kernel(k.ravel()).reshape(2, *k.shape)
    found = evaluate(seen, panels, kernel, PHASE)
    for i in range(len(panels)):
        one = evaluate(seen, panels[i : i + 1], kernel[:, i : i + 1], PHASE)
        assert np.allclose(found.parts[i], one.parts[0], rtol=1e-12, atol=0.0)
        # The last coefficients are as good as the kernel's rounding.
        assert np.all(np.abs(found.errors[i] - one.errors[0]) <= 1e-6 * one.errors[0] + 1e-15 * one.sizes[0])


def test_panels_are_halved_towards_their_poles():
    panels = np.array([[8, 16, 0, 0], [16, 32, 0, 0], [32, 64, 0, 0]], dtype=complex)
    poles = np.array([11.9 + 0.2j, 15.0 - 1j, 70.0])
    at = (poles - panels[:, :2].mean(axis=1)) / ((panels[:, 1] - panels[:, 0]) / 2)
    pieces, of = halve_towards(panels, at, np.array([3, 1, 2]))
    found = {i: sorted(map(tuple, pieces[of == i, :2].real)) for i in range(3)}
    assert found[0] == [(8, 10), (10, 11), (11, 12), (12, 16)]
    assert found[1] == [(16, 24), (24, 32)]
    assert found[2] == [(32, 48), (48, 56), (56, 64)]


def test_a_pole_next_to_the_path_takes_few_rounds(monkeypatch):
    """With tan delta 0.01 the forearm's poles are 1 /m from the path: eight rounds when each panel was cut in two."""
    rounds = []
    monkeypatch.setattr(
        "unitcad.attenuation.layered.integral.evaluate", lambda *args: rounds.append(0) or evaluate(*args)
    )
    layers = [Layer(h, 1000, e, 0.49, LossFactor(0.01)) for h, e in ((1.5e-3, 130e3), (4e-3, 9e3), (25e-3, 12e3))]
    medium = LayeredMedium(layers, HalfSpace(1900, 15e9, 0.3, LossFactor(0.01)))
    found = medium.response(UniformDisc(3.5e-3), 785.0, [1e-3, 30e-3], rtol=1e-8)
    assert found.error <= 1e-8 * np.max(np.abs(found.u_z))
    assert len(rounds) <= 6
