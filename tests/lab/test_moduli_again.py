"""The catalogue's moduli are those that `unitcad material` makes of the published curves."""

from pathlib import Path

from docs.make_moduli import MATERIALS, again, commands

DATA = Path(__file__).parent / "data" / "soft-robotics-materials-database"


def test_the_catalogue_has_the_moduli_that_its_commands_make():
    """For the five curves that are here; `python docs/make_moduli.py FOLDER` does it for all."""
    text = MATERIALS.read_text("utf-8")
    here = [name for name, _, _, command in commands(text) if (DATA / command.split('"')[1]).exists()]
    assert len(here) == 5
    assert again(text, DATA) == text


def test_a_wrong_modulus_is_found():
    text = MATERIALS.read_text("utf-8")
    name, key, value, _ = next(commands(text))
    wrong = text.replace(f"{key} = {{ value = {value['value']}", f"{key} = {{ value = 1.0", 1)
    assert wrong != text
    assert name == "ecoflex-00-10"
    assert again(wrong, DATA) == text
