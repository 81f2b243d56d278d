"""What a refusal offers is accepted, and stands at the field that was changed."""

import tomllib

import pytest

pytest.importorskip("tomlkit", reason="the extra serve is not installed")
from unitcad.arrays.array_file import array_templates
from unitcad.documents import read_toml
from unitcad.serve.answers import answered
from unitcad.serve.form import edited, groups
from unitcad.serve.messages import Ask, Edit, Trusted
from unitcad.serve.server import _trusted_source
from unitcad.validation import custom_templates, templates
from unitcad.validation.suggestions import numbers


def text_of(template):
    """The text of a template."""
    return (templates() | array_templates())[template].read_text("utf-8")


def faults(template, edits, since, what="unit"):
    """The faults of a template after edits."""
    return answered(Ask(text=text_of(template), edits=edits, since=since, what=what), Trusted()).faults


@pytest.mark.parametrize(
    ("path", "accepted", "refused", "other"),
    [
        ("layers.0.wall_mm", 1.25, 9.0, "diameter_mm"),
        ("layers.1.wall_mm", 1.25, 400, "diameter_mm"),
        ("motor.diameter_mm", 7.0, 13.9, "diameter_mm"),
    ],
)
def test_a_refusal_stands_where_the_change_was(path, accepted, refused, other):
    edit = Edit(path=path, value=refused)
    assert faults("encapsulating", [edit], [])[0].field == other
    fault = faults("encapsulating", [edit], [Edit(path="name", value="x"), Edit(path=path, value=accepted)])[0]
    assert (fault.field, fault.at) == (other, path)
    assert accepted < fault.at_nearest < refused
    assert faults("encapsulating", [Edit(path=path, value=fault.at_nearest)], []) == []
    # A hundredth beyond it nothing is accepted any more.
    assert faults("encapsulating", [Edit(path=path, value=fault.at_nearest + 0.011)], []) != []
    assert faults("encapsulating", [edit, Edit(path=other, value=fault.nearest)], []) == []


@pytest.mark.parametrize(
    ("path", "accepted", "refused", "diameter"),
    [
        ("motor.part", "LCM0720A3463F", "VG1040003D", 17.0),
        ("motor.diameter_mm", 7.0, 9.0, 16.0),
        ("layers.0.wall_mm", 1.25, 2.5, 16.5),
    ],
)
def test_the_offered_diameter_keeps_the_ring_of_air(path, accepted, refused, diameter):
    """The template is 14 mm across: a motor of 7 mm, walls of 2.5 mm a side and a ring of 1 mm."""
    fault = faults("encapsulating", [Edit(path=path, value=refused)], [Edit(path=path, value=accepted)])[0]
    assert (fault.field, fault.nearest) == ("diameter_mm", diameter)


def test_a_change_that_is_not_to_blame_is_not_blamed():
    edits = [Edit(path="layers.0.wall_mm", value=9.0), Edit(path="moulds.plate_mm", value=5.0)]
    assert faults("encapsulating", edits, [Edit(path="moulds.plate_mm", value=4.0)])[0].at == ""
    path = "layers.0.wall_mm"
    own = faults("encapsulating", [Edit(path=path, value=0.1)], [Edit(path=path, value=1.25)])
    assert [(fault.field, fault.at) for fault in own] == [("layers.0.wall_mm", "")]


def test_a_key_that_has_to_go_is_offered_to_be_left_out():
    edit = Edit(path="layers.0.cap_mm", value=1.0)
    fault = faults("embedded", [edit], [])[0]
    assert fault.leave_out
    assert faults("embedded", [edit, Edit(path=fault.field, remove=True)], []) == []
    assert not faults("embedded", [Edit(path="layers.0.material", value="cheese")], [])[0].leave_out


@pytest.mark.parametrize(
    ("template", "path", "before", "now", "gone"),
    [
        ("encapsulating", "design", "encapsulating", "embedded", ["layers.0.cap_mm", "layers.1.cap_mm"]),
        ("forearm-pockets", "layout.kind", "grid", "hex", ["layout.columns", "layout.rows"]),
    ],
)
def test_keys_that_have_to_go_together_are_offered_to_be_left_out_together(template, path, before, now, gone):
    text = text_of(template).replace(f'{path.rpartition(".")[2]} = "{before}"', f'{path.rpartition(".")[2]} = "{now}"')
    for fault in answered(Ask(text=text, since=[Edit(path=path, value=before)]), Trusted()).faults:
        assert fault.leave_out
        assert sorted([fault.field, *fault.together]) == gone
        # And back to the word that was there.
        assert (fault.at, fault.at_nearest) == (path, before)
    assert faults(template, [Edit(path=path, value=now), *(Edit(path=each, remove=True) for each in gone)], []) == []


@pytest.mark.parametrize(
    ("template", "path", "now", "also"),
    [
        ("encapsulating", "design", "embedded", "Left out: layers.0.cap_mm and layers.1.cap_mm."),
        ("embedded", "design", "encapsulating", "Set: layers.0.cap_mm = 1.25 and layers.1.cap_mm = 1.25."),
        ("hex-19", "layout.kind", "grid", "Left out: layout.rings. Set: layout.columns = 3 and layout.rows = 3."),
        ("hex-19", "layout.kind", "list", "Left out: layout.rings and layout.pitch_mm. Set: layout.points_mm (19 entries)."),
        ("forearm-patch", "array", "pockets", "Left out: circuit."),
        ("forearm-patch", "unit", "motor-10mm", "Set: layout.pitch_mm = 21."),
    ],
)  # fmt: skip
def test_a_picked_design_makes_the_changes_that_it_needs_and_names_them(template, path, now, also):
    answer = answered(Ask(text=text_of(template), edits=[Edit(path=path, value=now)]), Trusted())
    assert (answer.faults, answer.also, answer.picked) == ([], also, path)
    # The text has them: it is accepted as it is, and every number that is not named is as it was.
    assert answered(Ask(text=answer.text), Trusted()).faults == []
    before, after = (dict(numbers(tomllib.loads(each))) for each in (text_of(template), answer.text))
    assert all(key in also or key.startswith("layout.points_mm") for key in before.keys() ^ after.keys())
    assert all(before[key] == after[key] or key in also for key in before.keys() & after.keys())


def test_a_pick_changes_nothing_in_a_text_that_was_refused_before_or_that_can_t_have_it():
    refused = text_of("encapsulating").replace("wall_mm = 1.25", "wall_mm = 0.1", 1)
    for text, edit in (
        (refused, Edit(path="design", value="embedded")),
        (text_of("forearm-patch"), Edit(path="unit", value="no-fpcb")),
        (text_of("encapsulating"), Edit(path="design", value="cheese")),
    ):
        answer = answered(Ask(text=text, edits=[edit]), Trusted())
        assert answer.faults
        assert (answer.text, answer.also) == (edited(text, [edit]), "")


def test_a_default_that_was_changed_has_a_nearest_value_too():
    edit = Edit(path="motor.diameter_mm", value=30)
    fault = faults("encapsulating", [edit], [Edit(path="motor.diameter_mm", remove=True)])[0]
    assert (fault.field, fault.at) == ("diameter_mm", "motor.diameter_mm")
    assert faults("encapsulating", [Edit(path=fault.at, value=fault.at_nearest)], []) == []


def test_what_is_offered_is_accepted_where_another_field_refuses_the_nearest_value():
    edit = Edit(path="layout.pitch_mm", value=10)
    fault = faults("forearm-pockets", [edit], [Edit(path="layout.pitch_mm", value=20)])[0]
    assert fault.nearest > 16
    assert fault.message.endswith(f"; nearest accepted: {fault.nearest:g}")
    assert faults("forearm-pockets", [Edit(path="layout.pitch_mm", value=fault.nearest)], []) == []


def test_an_unknown_key_is_offered_its_right_name():
    text = templates()["encapsulating"].read_text("utf-8").replace("diameter_mm = 14", "diamter_mm = 14", 1)
    fault = answered(Ask(text=text), Trusted()).faults[0]
    assert fault.rename == ("diameter_mm", 14)
    edits = [Edit(path=fault.field, remove=True), Edit(path=fault.rename[0], value=fault.rename[1])]
    assert answered(Ask(text=text, edits=edits), Trusted()).faults == []


def test_wires_begin_with_what_they_need_in_place_of_the_circuit():
    text = templates()["encapsulating"].read_text("utf-8")
    groups = {group.path: group for group in answered(Ask(text=text), Trusted()).groups}
    wires = groups["wires"]
    assert not wires.present
    edits = [Edit(path=wires.instead, remove=True), Edit(path="wires", value=wires.needs)]
    assert faults("encapsulating", edits, []) == []


@pytest.mark.parametrize(
    ("path", "accepted"),
    [
        ("layers.0.wall_mm", 1.25),
        ("motor.diameter_mm", 7.0),
        ("moulds.layer_mm", 0.2),
        ("diameter_mm", 14),
        ("layers.0.cap_mm", 1.25),
    ],
)
def test_the_value_that_is_offered_has_moulds_and_stands_in_the_sentence_too(path, accepted):
    fault = faults("encapsulating", [Edit(path=path, value=99999)], [Edit(path=path, value=accepted)])[0]
    assert fault.field == path
    assert fault.message.endswith(f"; nearest accepted: {fault.nearest:g}")
    assert faults("encapsulating", [Edit(path=path, value=fault.nearest)], [], "moulds") == []


def test_a_bed_that_is_too_small_is_refused_at_the_count_that_was_changed():
    edits = [Edit(path="layout.pitch_mm", value=18), Edit(path="layout.columns", value=50)]
    since = [Edit(path="layout.columns", value=3), Edit(path="layout.pitch_mm", value=18)]
    fault = faults("forearm-patch", edits, since, "moulds")[0]
    assert (fault.field, fault.at, fault.at_nearest) == ("moulds.bed_x_mm", "layout.columns", 9)


def test_no_option_of_the_command_line_is_told_on_the_page(tmp_path):
    hollow = "from unitcad.shape import cut, cylinder\n\ndef unit(spec):\n"
    (tmp_path / "dome.py").write_text(f"{hollow}    return cut(cylinder(7, 0, 6), [cylinder(5, 3, 5)])\n")
    path = tmp_path / "hollow.toml"
    path.write_text(custom_templates()["custom/dome"].read_text("utf-8"))
    known = Trusted([_trusted_source(read_toml(path), path, code=True)])
    told = answered(Ask(text=path.read_text("utf-8"), what="moulds"), known).faults
    assert [fault.field for fault in told] == ["design"]
    assert "closed" in told[0].message
    assert "--only" not in told[0].message


def test_the_form_has_the_size_of_a_refused_part_and_offers_a_motor_where_there_is_none():
    data = read_toml(templates()["encapsulating"])
    shown = {
        field.path: field.value
        for group in groups({**data, "motor": {"part": "VG1040003D"}}, None)
        for field in group.fields
    }
    assert (shown["motor.diameter_mm"], shown["motor.thickness_mm"], shown["motor.drive"]) == (10, 4, "axial")
    (without,) = [group for group in groups({**data, "motor": False}, None) if group.path == "motor"]
    assert (without.fields, without.present, without.optional) == ([], False, True)
