"""Changes of a text keep its comments, and give what the same change of its data gives."""

import copy
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("tomlkit", reason="the extra serve is not installed")
from unitcad.errors import Refusal, UnitcadError
from unitcad.serve.form import edited
from unitcad.serve.messages import Edit
from unitcad.validation import put, templates
from unitcad.validation.plain_data import drop

NAMES = [
    "diameter_mm", "layers.0.wall_mm", "layers.1.material", "motor.fill", "fpcb.tail_width_mm", "moulds.plate_mm",
    "wires.count",
]  # fmt: skip
VALUES = st.one_of(
    st.floats(-1e3, 1e3), st.integers(-5, 5), st.booleans(), st.text(max_size=8),
    st.lists(st.integers(0, 9), max_size=3),
)  # fmt: skip


@given(
    st.sampled_from(sorted(templates())),
    st.lists(st.tuples(st.sampled_from(NAMES), st.one_of(st.none(), VALUES)), max_size=6),
)
def test_edits_of_the_text_are_those_of_the_data(template, changes):
    text = templates()[template].read_text("utf-8")
    data = tomllib.loads(text)
    if len(data["layers"]) < 2:
        changes = [(path, value) for path, value in changes if not path.startswith("layers.1")]
    wanted = copy.deepcopy(data)
    for path, value in changes:
        if value is None:
            drop(wanted, path)
        else:
            put(wanted, path, value)
    after = edited(text, [Edit(path=path, value=value, remove=value is None) for path, value in changes])
    assert tomllib.loads(after) == wanted


def test_comments_and_layout_stay():
    text = "# mine\ndiameter_mm = 14.0   # across\n\n[motor]\npart = 'x' # a part\n"
    after = edited(text, [Edit(path="diameter_mm", value=15.5), Edit(path="motor.fill", value=True)])
    assert after == "# mine\ndiameter_mm = 15.5   # across\n\n[motor]\npart = 'x' # a part\nfill = true\n"


def test_layers_are_added_and_taken_out():
    text = templates()["encapsulating"].read_text("utf-8")
    more = edited(text, [Edit(path="layers.2", value={"material": "dragon-skin-30", "wall_mm": 1.0})])
    assert [layer["wall_mm"] for layer in tomllib.loads(more)["layers"]] == [1.25, 1.25, 1.0]
    fewer = edited(more, [Edit(path="layers.0", remove=True)])
    assert [layer["wall_mm"] for layer in tomllib.loads(fewer)["layers"]] == [1.25, 1.0]


def test_a_value_may_be_written_as_toml_has_it():
    after = edited("", [Edit(path="moulds.cavities", value="[2, 3]", toml=True)])
    assert tomllib.loads(after) == {"moulds": {"cavities": [2, 3]}}
    with pytest.raises(Refusal, match="no TOML value"):
        edited("", [Edit(path="moulds.cavities", value="[2, ", toml=True)])


@pytest.mark.parametrize("path", ["name.x", "layers.7.wall_mm", "layers.x", "layers.-1"])
def test_a_path_that_leads_nowhere_is_refused(path):
    with pytest.raises(Refusal):
        edited(templates()["encapsulating"].read_text("utf-8"), [Edit(path=path, value=1)])


def test_a_text_that_is_no_toml_is_refused():
    with pytest.raises(UnitcadError, match="not TOML"):
        edited("a = [", [Edit(path="b", value=1)])
