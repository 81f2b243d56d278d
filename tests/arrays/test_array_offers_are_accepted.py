"""A refusal's suggestion for an array was tried: put in, the file is accepted, with its moulds."""

import pytest

from tests.robustness.test_offers_are_accepted import check_each_field, numbers
from unitcad.arrays.array_file import array_templates, expand, load_array
from unitcad.arrays.patch import patch_moulds
from unitcad.documents import read_toml


def tools_of(data):
    return patch_moulds(load_array(data)).plan


@pytest.mark.parametrize("count", [6, pytest.param(200, marks=pytest.mark.long)])
@pytest.mark.parametrize("name", sorted(array_templates()))
def test_a_wild_number_of_an_array_is_refused_with_a_value_that_is_accepted(name, count):
    path = array_templates()[name]
    base = expand(read_toml(path), path.parent)
    tables = ("layout.", "sheet.", "body.", "circuit.")
    own = {at: value for at, value in numbers(load_array(name).asked).items() if at.startswith(tables)}
    check_each_field(base, own, tools_of, count, name)
