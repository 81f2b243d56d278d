"""Entries of the catalogue: every key has a type, a range and a sentence; shipped ones and a spec's own pass them."""

import tomllib
import typing
from importlib.resources import files

import msgspec
import pytest

from unitcad import catalogue
from unitcad.catalogue.entries import Value, kinds_of
from unitcad.errors import Refusal
from unitcad.spec import to_data, to_toml
from unitcad.validation import from_data, read

ENTRIES = {
    "materials": (catalogue.Material, catalogue.materials, "ecoflex-00-30"),
    "motors": (catalogue.Motor, catalogue.motors, "LCM0720A3463F"),
    "printers": (catalogue.Printer, catalogue.printers, "fdm-0.4"),
    "tissue": (catalogue.Tissue, None, ""),
}
SKIN = {"density_kg_m3": 1100.0, "poisson_ratio": 0.49, "youngs_modulus_kpa": 100.0}


@pytest.mark.parametrize("kind", ENTRIES)
def test_every_key_has_a_type_a_range_and_a_sentence(kind):
    keys = dict(kinds_of(ENTRIES[kind][0]))
    assert set(keys) == {field.name for field in msgspec.structs.fields(ENTRIES[kind][0])} - {"name", "like"}
    for key, annotated in keys.items():
        about, (note,) = typing.get_args(annotated)[0], annotated.__metadata__
        assert note.description, key
        if about is float:
            assert note.ge is not None, key
            assert note.le is not None, key
            assert note.gt is None, key
            assert note.lt is None, key


@pytest.mark.parametrize("kind", ["materials", "motors", "printers"])
def test_shipped_entries_pass_the_validation_of_a_own_entries(kind):
    """Each shipped table, typed into a spec under another name, is the same entry."""
    _, load, _ = ENTRIES[kind]
    shipped = tomllib.loads((files("unitcad.catalogue") / f"{kind}.toml").read_text("utf-8"))
    assert list(shipped) == list(load())
    spec = from_data({**read("encapsulating"), kind: {f"our-{name}": table for name, table in shipped.items()}})
    for name, entry in load().items():
        ours = load(getattr(spec, kind))[f"our-{name}"]
        assert msgspec.structs.replace(ours, name=name) == entry


@pytest.mark.parametrize(
    ("table", "key", "value", "nearest"),
    [
        ("materials", "youngs_modulus_kpa", -5, 0.01),
        ("materials", "poisson_ratio", 0.6, 0.5),
        ("materials", "youngs_modulus_kpa", "soft", None),
        ("materials", "shore", 30, None),
        ("printers", "bed_x_mm", 0, 20),
        ("printers", "technology", "fmd", "fdm"),
        ("motors", "rpm", 1e9, 300000),
    ],
)
@pytest.mark.parametrize("form", ["", "value", "low"])
def test_a_value_that_can_not_be_is_refused(table, key, value, nearest, form):
    """Alone, in a table and as an end of the range; what is offered is accepted in the same place."""
    if form == "low" and (isinstance(value, str) or key == "shore"):
        pytest.skip("words have no range")
    possible = {"poisson_ratio": 0.4, "rpm": 1000.0, "bed_x_mm": 100.0}.get(key, 10.0)
    data = read("encapsulating")

    def give(value):
        typed = {"": value, "value": {"value": value}, "low": {"value": possible, "low": value}}[form]
        data[table] = {"ours": {"like": ENTRIES[table][2], key: typed}}

    give(value)
    with pytest.raises(Refusal) as refused:
        from_data(data)
    assert refused.value.field == ".".join([table, "ours", key, form]).rstrip(".")
    assert refused.value.value == value
    assert refused.value.limit
    if form != "low":
        assert refused.value.nearest == nearest
    if refused.value.nearest is not None:
        give(refused.value.nearest)
        from_data(data)


@pytest.mark.parametrize(
    ("low", "high", "field", "nearest"), [(60.0, None, "low", 50.0), (None, 40.0, "high", 50.0), (60, 40, "low", 50.0)]
)
def test_a_value_outside_its_own_range_is_refused(low, high, field, nearest):
    data = read("encapsulating")
    given = {"value": 50.0, "low": low, "high": high}
    given = {key: end for key, end in given.items() if end is not None}
    data["materials"] = {"ours": {"like": "ecoflex-00-30", "youngs_modulus_kpa": given}}
    with pytest.raises(Refusal) as refused:
        from_data(data)
    assert refused.value.field == f"materials.ours.youngs_modulus_kpa.{field}"
    assert refused.value.nearest == nearest


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({}, "tissue.mine"),
        ({"skin": {}}, "tissue.mine.skin.density_kg_m3"),
        ({"skin": {**SKIN, "thickness_mm": 2.0}}, "tissue.mine.skin.thickness_mm"),
        ({"skin": SKIN, "bone": SKIN}, "tissue.mine.skin.thickness_mm"),
        ({"skin": {k: v for k, v in SKIN.items() if "modulus" not in k}}, "tissue.mine.skin.youngs_modulus_kpa"),
        ({"skin": {**SKIN, "like": "forearm"}}, "tissue.mine.skin.like"),
    ],
)
@pytest.mark.parametrize("chosen", ["mine", "forearm"])
def test_a_body_that_can_not_be_is_refused_whether_it_is_used_or_not(body, field, chosen):
    with pytest.raises(Refusal) as refused:
        from_data({**read("encapsulating"), "tissue": {"mine": body}, "estimate": {"tissue": chosen}})
    assert refused.value.field == field


def test_an_entry_that_lacks_values_names_them():
    data = {**read("encapsulating"), "motors": {"mine": {"rpm": 9000.0}}}
    with pytest.raises(Refusal, match=r"^motors\.mine\.diameter_mm: is required with thickness_mm, or like"):
        from_data(data)
    data["motors"] = {"mine": {"like": "LCM"}}
    with pytest.raises(Refusal, match=r"^motors\.mine\.like = 'LCM'"):
        from_data(data)


def test_an_own_entry_says_where_its_values_come_from():
    data = read("encapsulating")
    data["materials"] = {
        "ours": {
            "like": "ecoflex-00-30",
            "status": "secondary",
            "source": "a book",
            "cure_h": 5,
            "density_g_cm3": {"value": 1.1, "source": "our scale"},
        }
    }
    spec = from_data(data)
    ours = catalogue.materials(spec.materials)["ours"]
    assert ours.cure_h == Value(5.0, "secondary", "a book")
    assert ours.density_g_cm3 == Value(1.1, "secondary", "our scale")
    assert ours.tensile_mpa == catalogue.materials()["ecoflex-00-30"].tensile_mpa
    again = from_data(tomllib.loads(to_toml(spec)))
    assert again == spec
    assert from_data(to_data(spec)) == spec
