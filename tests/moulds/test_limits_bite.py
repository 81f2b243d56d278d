"""Limits of checks and rules, one step inside and one step outside: a limit that is moved fails here."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from manifold3d import Manifold

import unitcad
from unitcad.checks.draw import BLOCKED, blocked
from unitcad.designs import limits
from unitcad.designs.dimensions import whole_layers
from unitcad.errors import Refusal
from unitcad.pipeline.write import whole
from unitcad.validation.load import load


@pytest.mark.parametrize("direction", [(0, 0, 1), (0.6, 0, 0.8)])
@pytest.mark.parametrize(("volume", "caught"), [(0.8e-5, False), (1.2e-5, True), (1e-3, True)])
def test_a_hundred_thousandth_of_a_cubic_millimetre_is_in_the_way(volume, caught, direction):
    """A block of 1 mm3 slides past the edge of another; their overlap in its way has an area of `volume`, 1 mm long."""
    assert BLOCKED == 1e-5
    away = direction[0] / direction[2]
    piece = Manifold.cube((1, 1, 1))
    over = Manifold.cube((1, 1, 1)).translate((2 * away, 1 - volume, 2))
    in_the_way = blocked(piece, {"over": over}, direction)
    assert ("over" in in_the_way) == caught
    if caught:
        assert in_the_way["over"] == pytest.approx(volume, rel=0.02) or away


@given(st.floats(0.001, 500))
def test_offers_are_the_nearest_typed_values_on_the_allowed_side(limit):
    up, down = limits.up(limit), limits.down(limit)
    assert limit - 1e-9 <= up < limit + 0.001
    assert limit - 0.001 < down <= limit + 1e-9
    for offered in (up, down):
        assert math.isclose(offered * 1000, round(offered * 1000), abs_tol=1e-6)


@pytest.mark.parametrize("height", [0.1, 0.2, 0.25])
@pytest.mark.parametrize("first", [0.2, 0.3, 0.35])
def test_a_floor_ends_a_layer_and_is_moved_by_half_a_layer_at_most(height, first):
    spec = load("encapsulating", set={"moulds.layer_mm": height, "moulds.first_layer_mm": first})
    seat = spec.moulds.plate_mm + spec.moulds.plinth_height_mm
    for step in range(200):
        z = 0.013 * step
        end = whole_layers(spec, z)
        layers = (seat + end - first) / height
        assert layers == pytest.approx(round(layers), abs=1e-6)
        assert abs(end - z) <= height / 2 + 1e-9


def test_the_wall_under_a_window_is_refused_just_below_its_least_and_accepted_at_it():
    with pytest.raises(Refusal, match="the cup's wall under the window needs a motor of at least") as refused:
        load("encapsulating", set={"motor": {"diameter_mm": 7, "thickness_mm": 0.5}})
    least = refused.value.nearest
    spec = load("encapsulating", set={"motor": {"diameter_mm": 7, "thickness_mm": least}})
    # The window's floor is that of a slot with the circuit in its middle, which lies on the motor, less a clearance.
    moulds = spec.moulds
    floor = least + (spec.fpcb.thickness_mm - moulds.slot_height_mm) / 2 - moulds.window_clearance_mm
    assert floor == pytest.approx(moulds.least_wall_mm, abs=1e-3)
    with pytest.raises(Refusal, match="motor of at least"):
        load("encapsulating", set={"motor": {"diameter_mm": 7, "thickness_mm": round(least - 0.002, 3)}})


def test_a_file_that_is_shorter_or_changed_makes_a_result_less_than_whole(tmp_path):
    folder = unitcad.build("single-embedded", out=tmp_path, only=["unit"], formats=["stl"], check=False).folder
    assert whole(folder)
    assert whole(folder, hashes=True)
    path = folder / "unit/layer1.stl"
    content = path.read_bytes()
    path.unlink()  # the cache's copy may share its bytes
    path.write_bytes(content[:-1])
    assert whole(folder) is None
    path.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    assert whole(folder)
    assert whole(folder, hashes=True) is None
    path.write_bytes(content)
    assert whole(folder, hashes=True)
