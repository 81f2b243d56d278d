"""The shipped tissues: layers on a half-space, of which an estimate is made; palm and upper arm beside the forearm."""

import math

import pytest
from msgspec.structs import replace

from unitcad import catalogue
from unitcad.attenuation.inputs import tissue_medium
from unitcad.attenuation.layered import UniformDisc
from unitcad.catalogue.entries import kinds_of
from unitcad.estimate_inputs import answer_spec, estimate_input, tissue_layer
from unitcad.validation import from_data, read

BODY = ("forearm", "upper-arm", "palm")


@pytest.mark.parametrize("name", catalogue.tissues())
def test_a_tissue_is_layers_on_a_half_space_and_every_value_has_its_source(name):
    layers = catalogue.tissues()[name]
    assert [one.thickness_mm is None for one in layers] == [*[False] * (len(layers) - 1), True]
    for one in layers:
        values = [value for key, _ in kinds_of(catalogue.Tissue) if (value := getattr(one, key)) is not None]
        assert all(value.status and value.source for value in values)
    own = from_data({**read("encapsulating"), "estimate": {"tissue": name}})
    differs = [feature.name for feature in estimate_input(own).features]
    assert ("tissue" in differs) == (name != "forearm")


def test_the_range_widens_the_more_a_tissue_differs_from_the_measured_one():
    answers = [answer_spec(from_data({**read("encapsulating"), "estimate": {"tissue": name}})) for name in BODY]
    widths = [one.high / one.low for one in answers]
    assert widths == sorted(widths)
    assert len(set(widths)) == len(BODY)


def test_a_muscle_without_a_bone_under_it_moves_the_skin_as_one_on_bone():
    """The upper arm's muscle is a half-space, since no source gives its thickness."""
    skin, fat, muscle, bone = map(tissue_layer, catalogue.tissue())
    moved = [
        abs(tissue_medium(layers).response(UniformDisc(3.5e-3), 2 * math.pi * 125, [7e-3], rtol=1e-3).u_z[0])
        for layers in ((skin, fat, muscle, bone), (skin, fat, replace(muscle, thickness=None)))
    ]
    assert moved[0] == pytest.approx(moved[1], rel=0.01)


def test_both_moduli_of_the_forearms_skin_name_their_method_and_each_other():
    pressed, waves = (catalogue.tissue(name)[0].youngs_modulus_kpa for name in ("forearm", "forearm-elastography"))
    assert (pressed.value, pressed.low, pressed.high) == (130, 69, 260)  # the curve's comparisons were made with it
    assert (waves.value, waves.low, waves.high) == (14.8, 3.5, 26.0)
    assert "indentation" in pressed.method
    assert "14.8" in pressed.source
    assert waves.method == "shear-wave elastography"
    assert "69 to 260" in waves.source
    deep = [catalogue.tissue(name)[1:] for name in ("forearm", "forearm-elastography")]
    assert deep[0] == deep[1]
