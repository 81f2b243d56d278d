"""The shipped silicones: laws that their values keep; estimate and casting of each, or the sentence why not."""

import itertools
import math

import pytest

from unitcad import catalogue
from unitcad.casting.figures import CASTING_NEEDS, check_castable
from unitcad.casting.procedure import procedure
from unitcad.casting.procedure_text import files
from unitcad.casting.steps import pour_warnings
from unitcad.catalogue.entries import CHEMISTRIES, kinds_of
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_input
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import from_data, load, read, warnings

SHIPPED = catalogue.materials()
CASTABLE = [name for name, each in SHIPPED.items() if all(getattr(each, key) for key in CASTING_NEEDS)]


def of(*names, **more):
    """Return a spec with these silicones from the inside out."""
    data = read("encapsulating")
    layers = [{**layer, "material": name} for layer, name in zip(data["layers"], names, strict=True)]
    return from_data({**data, "layers": layers, **more})


def made(spec):
    moulds = MouldSet(spec)
    return procedure(moulds, [100.0] * len(moulds.plan.steps), 1000.0)


def known(name, key):
    value = getattr(SHIPPED[name], key)
    return None if value is None else value.value


def test_twenty_silicones_and_more_can_be_cast():
    assert len(CASTABLE) >= 20
    assert sum(each.quasistatic_modulus_kpa is not None for each in SHIPPED.values()) >= 12


@pytest.mark.parametrize("name", SHIPPED)
def test_every_value_has_its_source_and_keeps_the_laws(name):
    values = {key: value for key, _ in kinds_of(catalogue.Material) if (value := getattr(SHIPPED[name], key))}
    assert all(len(value.source) > 5 and value.status != "spec" for value in values.values())
    assert 0.9 < values["density_g_cm3"].value < 1.4
    if "pot_life_min" in values and "cure_h" in values:
        assert values["pot_life_min"].value < 60 * values["cure_h"].value
    if "tensile_mpa" in values and "modulus_100pct_kpa" in values:  # it breaks beyond 100 % strain
        assert 1000 * values["tensile_mpa"].value > values["modulus_100pct_kpa"].value
    for key in ("quasistatic_modulus_kpa", "modulus_100pct_kpa"):
        if key in values and "unitcad material" in values[key].source:
            assert values[key].low <= values[key].value <= values[key].high
            assert values[key].method


def test_slacker_softens_its_base():
    """By the bulletin; a scale of more noughts is a softer one."""
    for base in ("ecoflex-00-20", "ecoflex-00-30", "ecoflex-00-50", "dragon-skin-10"):
        parts = sorted(int(name.rpartition("-")[2]) for name in SHIPPED if name.startswith(f"{base}-slacker-"))
        shore = [known(f"{base}-slacker-{each}", "shore").partition("-") for each in parts]
        hard = [(-len(scale), float(points)) for scale, _, points in shore]
        assert len(hard) >= 2
        assert hard == sorted(hard, reverse=True)


def test_harder_silicones_are_stiffer():
    """By Gent's relation of hardness and modulus (1958), which is high for soft grades: unit errors are a factor 10."""
    pairs = []
    for name, each in SHIPPED.items():
        if each.shore and each.shore.value.endswith("A") and each.quasistatic_modulus_kpa:
            shore = float(each.shore.value[:-1])
            gent = 98.1 * (56 + 7.62336 * shore) / (0.137505 * (254 - 2.54 * shore))
            pairs.append((name, gent / float(each.quasistatic_modulus_kpa)))
    assert len(pairs) >= 7
    assert all(1 < ratio < 4.5 for _, ratio in pairs), pairs


def test_each_pair_has_an_estimate_or_the_reason_why_not():
    for moduli in ("small-strain", "quasi-static"):
        spec = {"estimate": {"moduli": moduli}}
        for name in SHIPPED:
            for pair in ((name, "dragon-skin-30"), ("dragon-skin-30", name)):
                if name == "dragon-skin-30":
                    continue
                for layer in estimate_input(of(*pair, **spec)).layers:
                    modulus, each = layer.youngs_modulus, SHIPPED[layer.material]
                    key = "youngs_modulus_kpa" if moduli == "small-strain" else "quasistatic_modulus_kpa"
                    if getattr(each, key):
                        assert modulus.value == pytest.approx(1e3 * float(getattr(each, key)))
                    else:
                        assert modulus.value is None
                        assert "is known" in modulus.note
                        assert "None" not in modulus.note


@pytest.mark.parametrize("name", SHIPPED)
def test_each_is_cast_or_refused_for_the_value_that_it_lacks(name):
    spec = of(name, name)
    if name in CASTABLE:
        check_castable(MouldSet(spec))
        sheet = files(made(spec))["casting.md"]
        assert name in sheet
        assert "None" not in sheet
        return
    with pytest.raises(Refusal, match="no source gives it, and casting needs it") as refused:
        check_castable(MouldSet(spec))
    assert refused.value.field.startswith(f"materials.{name}.")
    assert refused.value.limit.endswith("--only unit makes only the unit")
    lacking = refused.value.field.rpartition(".")[2]
    mine = {"like": name, **{key: 5.0 for key in CASTING_NEEDS if known(name, key) is None}}
    assert lacking in mine
    check_castable(MouldSet(of("mine", "mine", materials={"mine": mine})))


@pytest.mark.parametrize("vacuum", [True, False])
@pytest.mark.parametrize("pour", ["open", "injected"])
@pytest.mark.parametrize("absent", [{"pot_life_min"}, {"mixed_viscosity_cps"}, {"pot_life_min", "mixed_viscosity_cps"}])
def test_a_sheet_says_what_is_not_known_of_bubbles_and_time(absent, pour, vacuum):
    """A silicone like a shipped one but for the absent values: every other number of its sheet is the same."""
    whole = {key: known("ecoflex-00-10", key) for key, _ in kinds_of(catalogue.Material)}
    mine = {key: value for key, value in whole.items() if value is not None}
    tables = {"moulds": {"pour": pour}, "casting": {"vacuum": vacuum}}
    full = made(of("mine", "mine", materials={"mine": mine}, **tables))
    lacking = {key: value for key, value in mine.items() if key not in absent}
    part = made(of("mine", "mine", materials={"mine": lacking}, **tables))
    words = {"pot_life_min": "pot life", "mixed_viscosity_cps": "viscosity"}
    for a, b in zip(full.pours, part.pours, strict=True):
        assert set(b.unknown) == {words[key] for key in absent}
        assert a.unknown == ()
        assert (a.part_a_g, a.part_b_g, a.cure_h) == (b.part_a_g, b.part_b_g, b.cure_h)
        shown = {figure.name for figure in a.figures} - {figure.name for figure in b.figures}
        assert any("pot life" in name for name in shown) == ("pot_life_min" in absent)
        assert any("viscosity" in name for name in shown) == ("mixed_viscosity_cps" in absent)
        if not vacuum:
            assert "no source gives the" in b.verdict
            assert "so bubbles may stay" in b.verdict
    told = list(pour_warnings([vars(pour) for pour in part.pours]))
    assert sum("no source gives the" in line for line in told) == len(part.pours)
    assert "None" not in files(part)["casting.md"]


def test_an_own_silicone_needs_only_its_density():
    spec = of("mine", "mine", materials={"mine": {"density_g_cm3": 1.1}})
    assert warnings(spec) == warnings(of("ecoflex-00-10", "ecoflex-00-10"))[:0]
    layer = estimate_input(spec).layers[0]
    assert layer.density == 1100
    assert layer.youngs_modulus.value is None
    assert (layer.tan_delta.low, layer.tan_delta.high) == (0.1, 0.3)
    with pytest.raises(Refusal, match=r"^materials\.mine\.density_g_cm3: is required, or like"):
        of("mine", "mine", materials={"mine": {"shore": "10A"}})


def test_every_pair_of_chemistries_bonds_or_is_warned_of():
    one = {"platinum": "ecoflex-00-10", "tin": "oomoo-30"}
    other = {"platinum": "dragon-skin-30", "tin": "oomoo-25"}
    for inner, outer in itertools.product(CHEMISTRIES, repeat=2):
        told = [line for line in warnings(of(one[inner], other[outer])) if "layers.1.material" in line]
        pair = catalogue.contact(SHIPPED[other[outer]], SHIPPED[one[inner]])
        if pair is None:
            assert "no source says whether it bonds" in told[0]
        elif pair.result == "inhibited":
            assert f"won't cure on {one[inner]}" in told[0]
            assert pair.source in told[0]
        else:
            assert told == []
    assert {one.result for one in catalogue.contacts()} == {"bonds", "inhibited"}
    assert catalogue.contact(SHIPPED["rtv615"], SHIPPED["oomoo-30"]) is None  # its chemistry is not in its sources
    assert not any("layers.1.material" in line for line in warnings(of("oomoo-30", "oomoo-30")))


def test_the_sheet_keeps_inhibitors_away():
    (clean,) = (step for step in made(load("encapsulating")).preparation if step.title == "Clean")
    for surface in ("sulphur clay", "latex", "epoxy", "urethane rubber"):
        assert surface in clean.text
    (clean,) = (step for step in made(of("oomoo-30", "oomoo-30")).preparation if step.title == "Clean")
    assert "sulphur clay" in clean.text
    assert "latex" not in clean.text


def test_the_roof_of_a_silicone_without_a_modulus_is_not_guessed():
    from unitcad.validation.defaults import roof

    assert roof(of("ecoflex-00-20", "ecoflex-00-20")) is not None
    assert roof(of("solaris", "ecoflex-00-20")) is None
    sag, hertz = roof(of("dragon-skin-30", "dragon-skin-30"))
    assert math.isfinite(sag)
    assert hertz > 0
